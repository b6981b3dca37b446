"""docs/extend.md: the energy of the page, added to a copy of the package as the page says, is solved there.

The copy runs in a process of its own with numba's compiler off: few segments, no compilation.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys

import pytest

from tests.docs_blocks import DOCS, ROOT, blocks
from tests.patience import PATIENCE

PAGE = (DOCS / "extend.md").read_text()

SOLVES = """
import numpy as np
from ribbon import Clamp, Gravity, RibbonInputError, Strip, solve
from ribbon.energies import threaded
from compare.scene import load

assert "copy" in threaded.__file__, threaded.__file__
up, factor = Gravity(up=(0, 1, 0)), 1.0 + threaded.BENDING
plain = solve(Strip(1.0, 0.05, gamma=4.0), Clamp(), up, energy="sadowsky", segments=4)
stiff = solve(Strip(1.0, 0.05, gamma=4.0 * factor), Clamp(), up, energy="threaded", segments=4)
assert plain.ok and stiff.ok, (plain.message, stiff.message)
gap = np.abs(plain.end.position - stiff.end.position).max()
assert gap < 1e-9, gap
assert abs(stiff.energy.total - factor * plain.energy.total) < 1e-9
softer = solve(Strip(1.0, 0.05, gamma=4.0), Clamp(), up, energy="threaded", segments=4)
assert softer.end.position[1] > plain.end.position[1] + 0.02  # the thread stiffens
assert load("cantilever").replace({"model.energy": "threaded"}).model.energy == "threaded"
print("threaded", gap)
"""


def patched(text: str, hunk: list[str], name: str) -> str:
    """`text` with one replacement: the lines "-" (found once) become the lines "+"."""
    old = "\n".join(line[1:] for line in hunk if line.startswith("-"))
    new = "\n".join(line[1:] for line in hunk if line.startswith("+"))
    assert text.count(old) == 1, f"{name} has changed: {old!r}"
    return text.replace(old, new)


def hunks(diff: str) -> tuple[str, list[list[str]]]:
    """The file of a diff block, and its runs of "-" lines with the "+" lines that follow."""
    lines = diff.splitlines()
    name = lines[1].removeprefix("+++ b/")
    found: list[list[str]] = []
    for line in lines[2:]:
        if line.startswith("-") and (not found or any(x.startswith("+") for x in found[-1])):
            found.append([])
        found[-1].append(line)
    return name, found


@pytest.fixture
def copy(tmp_path):
    """A copy of the sources with what the page adds."""
    root = tmp_path / "copy"
    for package in ("ribbon", "compare", "shellref"):
        shutil.copytree(ROOT / package, root / package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", root)
    added = 0
    for block in blocks(PAGE):
        named = re.match(r"# (ribbon/\S+\.py)\n", block.text)
        if block.info == "python" and named:
            (root / named[1]).write_text(block.text)
            added += 1
        elif block.info == "diff":
            name, changes = hunks(block.text)
            for hunk in changes:
                (root / name).write_text(patched((root / name).read_text(), hunk, name))
            added += 1
    assert added == 3
    return root


def test_the_energy_of_the_page_is_solved(copy, tmp_path):
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(copy), "OMP_NUM_THREADS": "1"}
    environment["NUMBA_CACHE_DIR"] = str(tmp_path / "cache")
    done = subprocess.run(
        [sys.executable, "-c", SOLVES], cwd=copy, env=environment, capture_output=True, text=True, timeout=PATIENCE
    )
    assert done.returncode == 0, done.stderr[-3000:]
    assert "threaded" in done.stdout
