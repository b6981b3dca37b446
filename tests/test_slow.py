"""The tests that are left to `make validate`: measured, there, and none of those that rounding can turn."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from xml.etree import ElementTree

import pytest

from tests import slow
from tests.portable import PROVED, SLOW_TOO

LISTED = sorted(slow._read())


def test_every_one_of_them_is_there():
    """By file and function: a test that was renamed would be left out of nothing."""
    gone = []
    for name in LISTED:
        file, _, function = name.partition("::")
        path = slow.ROOT / file
        tree = ast.parse(path.read_text()) if path.exists() else ast.Module([], [])
        found = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
        if function.partition("[")[0] not in found:
            gone.append(name)
    assert gone == []
    assert set(LISTED).isdisjoint(PROVED)


def test_the_list_is_what_a_run_took(tmp_path):
    """The slow ones of the run, those that it left out, and not what became quick or what was skipped."""
    suite = ElementTree.Element("testsuite")
    for name, seconds in (("quick", 0.1), ("long", 7.25), ("became_quick", 1.0)):
        ElementTree.SubElement(suite, "testcase", classname="tests.test_slow", name=name, time=str(seconds))
    skipped = ElementTree.SubElement(suite, "testcase", classname="tests.test_slow", name="absent", time="9")
    ElementTree.SubElement(skipped, "skipped")
    ElementTree.ElementTree(suite).write(tmp_path / "junit.xml")
    run = slow.times(tmp_path / "junit.xml")
    assert set(run) == {f"tests/test_slow.py::{name}" for name in ("quick", "long", "became_quick")}
    before = {"tests/test_slow.py::became_quick": 8.0, "tests/test_slow.py::left_out": 6.0, PROVED[0]: 30.0}
    assert slow.slow(run, before) == {"tests/test_slow.py::left_out": 6.0, "tests/test_slow.py::long": 7.2}


@pytest.mark.parametrize(("too", "expected"), [("", 0), ("1", 1)])
def test_they_are_run_where_they_are_asked_for(too, expected):
    """One of them, by its name: among the tests of `make test` only where the slow ones are wanted too."""
    name = next(name for name in LISTED if "[" not in name)
    words = [sys.executable, "-m", "pytest", "-n", "0", "--collect-only", "-m", "not validate", name]
    done = subprocess.run(
        words, cwd=slow.ROOT, env={**os.environ, SLOW_TOO: too}, capture_output=True, text=True, check=False
    )
    assert done.stdout.count(f"{name}\n") == expected
