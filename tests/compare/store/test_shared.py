"""One folder for each command, and one store of finished shells for all of them."""

from __future__ import annotations

import fcntl
import json
import shlex
from pathlib import Path

import pytest

from compare.check import cache_folder
from compare.cli import BAD_INPUT, DONE, main
from compare.page.page import read_page
from compare.pages.report.folders import folders_of
from compare.store.shared import shared_store
from compare.store.store import CaseStore, case_key

KEYS = [case_key(number) for number in range(3)]


def fill(folder: Path) -> None:
    (folder / "shell.json").write_text("x" * 1000)


@pytest.fixture
def store(tmp_path, monkeypatch):
    """The store of a user, and not of the tests."""
    place = tmp_path / "of the user"
    monkeypatch.setenv("RIBBONBENCH_STORE", str(place))
    return CaseStore(place)


def test_where_the_store_is(monkeypatch, tmp_path):
    monkeypatch.delenv("RIBBONBENCH_CHECK", raising=False)
    monkeypatch.delenv("RIBBONBENCH_STORE")
    monkeypatch.delenv("RIBBONBENCH_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "caches"))
    out = tmp_path / "out"
    assert shared_store(out).root == tmp_path / "caches" / "ribbonbench" / "cases"
    assert cache_folder() / "cases" == shared_store(out).root  # that of assert_agreement
    monkeypatch.setenv("RIBBONBENCH_CACHE", str(tmp_path / "moved"))
    assert shared_store(out).root == shared_store(tmp_path / "another").root == tmp_path / "moved" / "cases"
    monkeypatch.setenv("RIBBONBENCH_STORE", "beside")
    assert shared_store(out).root == out / "beside"


def test_tests_never_use_the_users_own_store(tmp_path):
    assert shared_store(tmp_path).root.is_relative_to(tmp_path)


def test_a_store_that_takes_nothing_is_one_line(capsys, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("RIBBONBENCH_STORE", str(tmp_path / "file" / "store"))
    assert main(["solve", "coil_10_100", "--out", str(tmp_path / "o")]) == BAD_INPUT
    said = capsys.readouterr().err
    assert "RIBBONBENCH_STORE" in said
    assert said.count("\n") == 1


def test_size_and_clear(store):
    for key in KEYS:
        store.put(key, fill)
    count, size = store.size()
    assert count == 3
    assert 3000 < size < 9000
    store.way(KEYS[0]).mkdir(parents=True)
    store.clear()
    assert store.size() == (0, 0)
    assert not store.way(KEYS[0]).exists()
    assert store.get(KEYS[0]) is None
    assert CaseStore(store.root / "none").size() == (0, 0)


def test_clear_leaves_what_is_being_worked_on(store):
    with store.unfinished(KEYS[0]) as held:
        (held.folder / "checkpoint").write_text("x")
        store.clear()
        assert (held.folder / "checkpoint").exists()
    idle = store.root / ".unfinished" / KEYS[1]
    idle.mkdir(parents=True)
    (idle / "lock").touch()
    with (idle / "lock").open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        store.clear()
        assert idle.exists()
    store.clear()
    assert not idle.exists()


def test_the_command_that_empties_it(store, capsys):
    store.put(KEYS[0], fill)
    assert main(["doctor", "--clean-store"]) == DONE
    assert "1 " in capsys.readouterr().out
    assert store.size()[0] == 0


def test_no_command_overwrites_another_ones_results(tmp_path, monkeypatch, capsys):
    """Default folders, and one report of all: with out/SCENE, and without a folder."""
    monkeypatch.chdir(tmp_path)
    scene = ["limits_7_3", "--set", "model.elements=6"]
    assert main(["solve", *scene, "--quiet"]) == DONE
    assert main(["limits", *scene, "--quick", "--clamp", "edge", "--quiet"]) == DONE
    assert main(["export", "out/limits_7_3", "--format", "obj", "--quiet"]) == DONE
    place = tmp_path / "out" / "limits_7_3"
    assert {path.name for path in place.iterdir()} == {"solve", "limits", "export"}
    assert [read_page(place / name).command for name in ("solve", "limits", "export")] == ["solve", "limits", "export"]
    assert (place / "export" / "ribbon.obj").stat().st_size > 1000
    before = json.loads((place / "solve" / "result.json").read_text())
    again = shlex.split(read_page(place / "solve").again)[1:]
    assert main(again) == DONE
    assert json.loads((place / "solve" / "result.json").read_text())["energy"] == before["energy"]
    assert main(["report", "out/limits_7_3", "--quiet"]) == DONE
    assert (place / "report.html").exists()
    assert main(["report", "--quiet"]) == DONE
    words = (tmp_path / "out" / "report.md").read_text()
    assert words.count('<a id="r') == 3
    capsys.readouterr()


def test_results_below_a_result_are_its_own(tmp_path):
    for name in ("my/solve", "my/solve/export", "other/limits"):
        (tmp_path / name).mkdir(parents=True)
        (tmp_path / name / "page.json").write_text("{}")
    assert [path.relative_to(tmp_path).as_posix() for path in folders_of([tmp_path])] == ["my/solve", "other/limits"]


@pytest.mark.shell
def test_two_folders_solve_a_shell_once(store, tmp_path):
    pytest.importorskip("dolfinx")
    rows = []
    for name in ("one", "two"):
        arguments = ["compare", "cantilever", "--set", "shell.elements=[8,1]", "--set", "shell.width_to_thickness=20"]
        main([*arguments, "--quiet", "--out", str(tmp_path / name)])
        rows += json.loads((tmp_path / name / "result.json").read_text())["rows"]
        if name == "one":
            before = store.size()[0]
            assert before == 2  # and the mesh for its error
    assert [row["reused"] for row in rows] == [False, True]
    assert rows[0]["hausdorff"] == rows[1]["hausdorff"]
    assert store.size()[0] == before
    assert not (tmp_path / "two" / "cases").exists()
