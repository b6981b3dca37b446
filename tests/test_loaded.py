"""The key of a page whose measurement ran in one process from sources alone: the modules that it had loaded."""

from __future__ import annotations

import importlib
import json
import sys
from pathlib import Path

import pytest

from tests.validation import loaded, stale
from tests.validation.number import Number
from tests.validation.record import Pages, Record

FILES = {
    "ribbon/toy_law.py": "MODULUS = 3.0\n",
    "ribbon/toy_late.py": "X = 1\n",
    "ribbon/toy_never.py": "X = 2\n",
    "ribbon/toy_model.py": "import ribbon.toy_below\n",
    "ribbon/toy_below.py": "X = 3\n",
    "compare/scenes/arc.toml": "a = 1\n",
    "results/kept.json": "4.0\n",
    "out/validate/toy/kept.json": "5.0\n",
    "tests/validation/room/toy.py": """
import importlib, json, os, subprocess, sys
from pathlib import Path
from ribbon.toy_law import MODULUS
READS = ("kept.json",)
SCENE = "arc"


def run(out, how):
    import ribbon.toy_late
    if how == "never":
        import ribbon.toy_never
    if how == "model":
        importlib.import_module("".join(["ribbon.toy_", how]))
    if how == "python":
        subprocess.run([sys.executable, "-c", ""], check=True)
    if how == "git":
        subprocess.run(["git", "--version"], check=True, capture_output=True)
    if how == "fork" and not (child := os.fork()):
        os._exit(0)
    elif how == "fork":
        os.waitpid(child, 0)
    if how in ("kept", "reads"):
        json.loads((out.parent / "out/validate/toy/kept.json" if how == "kept" else out / "kept.json").read_text())
    if how == "own":
        (out.parent / "out/part").mkdir()
        (out.parent / "out/part/row.json").write_text("6.0")
        (out.parent / "out/part").rename(out.parent / "out/whole")
        json.loads((out.parent / "out/whole/row.json").read_text())
    (out / "toy.md").write_text(how)
""",
}


@pytest.fixture
def root(tmp_path, monkeypatch):
    """A small tree whose modules can be imported beside the real ones."""
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    for folder in ("ribbon", "compare", "tests", "tests/validation", "tests/validation/room"):
        (tmp_path / folder / "__init__.py").write_text("")
    for package in ("ribbon", "tests.validation"):
        module = importlib.import_module(package)
        monkeypatch.setattr(module, "__path__", [*module.__path__, str(tmp_path / package.replace(".", "/"))])
    before = set(sys.modules)
    yield tmp_path
    for name in {*sys.modules} - before:
        if "toy" in name or "room" in name:
            del sys.modules[name]


def made(root: Path, how: str) -> Record:
    module = importlib.import_module("tests.validation.room.toy")

    def run(out: Path) -> dict[str, Number]:
        module.run(out, how)
        return {"modulus": Number(module.MODULUS, 0.1, shown=".2f")}

    return Pages(root).measure("toy", run, "python -m tests.validation toy")


def moved(root: Path, file: str) -> tuple[str, ...]:
    """What makes the page stale once a file has changed."""
    (root / file).write_text("X = 7\n")
    found = stale.status(Pages(root), "toy")
    assert found.stale == bool(found.moved)
    return found.moved


@pytest.mark.parametrize("how", ["plain", "git", "reads", "own"])
def test_a_module_that_was_never_loaded_is_in_no_key_and_a_loaded_one_is(root, how):
    record = made(root, how)
    assert record.wide == ""
    assert Pages(root).read("toy") == record
    assert not stale.status(Pages(root), "toy").stale
    assert moved(root, "ribbon/toy_never.py") == ()
    assert moved(root, "ribbon/toy_late.py") == ("ribbon.toy_late",)
    assert moved(root, "compare/scenes/arc.toml") == ("compare/scenes/arc.toml", "ribbon.toy_late")
    assert "ribbon.toy_law" in moved(root, "ribbon/toy_law.py")
    (root / "ribbon/toy_law.py").unlink()
    assert "ribbon.toy_law" in stale.status(Pages(root), "toy").moved


def test_a_module_counts_once_it_is_loaded(root):
    assert made(root, "never").wide == ""
    assert moved(root, "ribbon/toy_never.py") == ("ribbon.toy_never",)


def test_what_is_loaded_by_a_name_that_no_import_says_counts_with_what_it_imports(root):
    assert "ribbon.toy_model" not in Pages(root).modules("toy")
    assert made(root, "model").wide == ""
    assert moved(root, "ribbon/toy_below.py") == ("ribbon.toy_below",)
    assert moved(root, "ribbon/toy_model.py") == ("ribbon.toy_below", "ribbon.toy_model")


@pytest.mark.parametrize(
    ("how", "why"),
    [
        ("python", f"it started {Path(sys.executable).name}"),
        ("fork", "it started os.fork"),
        ("kept", "it read out/validate/toy/kept.json"),
    ],
)
def test_all_that_a_page_imports_counts_where_another_process_or_an_earlier_run_worked_for_it(root, how, why):
    assert made(root, how).wide == why
    assert moved(root, "ribbon/toy_never.py") == ("ribbon.toy_never",)


def test_a_record_of_an_earlier_form_is_judged_by_all_that_its_page_imports(root):
    made(root, "kept")
    pages = Pages(root)
    data = json.loads(pages.data("toy").read_text())
    del data["wide"]
    pages.data("toy").write_text(json.dumps(data))
    assert not stale.status(pages, "toy").stale
    assert moved(root, "ribbon/toy_never.py") == ("ribbon.toy_never",)


def test_workers_of_multiprocessing_are_seen_where_no_event_tells_of_them(root, monkeypatch):
    monkeypatch.delitem(sys.modules, "multiprocessing.popen_fork", raising=False)
    heard = loaded.Heard()
    assert heard.why_not(root, ()) == ""
    monkeypatch.setitem(sys.modules, "multiprocessing.popen_fork", sys)
    assert heard.why_not(root, ()) == "it started workers"
    assert loaded.Heard().why_not(root, ()) == ""


def test_the_modules_of_functions_that_are_compiled_into_a_loaded_kernel_count(monkeypatch):
    class Compiled:
        globals = {"__name__": "ribbon.toy_kernel"}  # noqa: RUF012

    class Environment:
        _memo = {"kernel": Compiled}  # noqa: RUF012

    numba = type(sys)("numba.core.environment")
    monkeypatch.setattr(numba, "Environment", Environment, raising=False)
    monkeypatch.setitem(sys.modules, "numba.core.environment", numba)
    assert "ribbon.toy_kernel" in loaded.Heard().loaded()
