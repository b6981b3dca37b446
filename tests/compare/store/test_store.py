"""Results storage: what is written is whole, what is reused is what was asked for, errors are one line."""

from __future__ import annotations

import dataclasses
import enum
import json
import math
import multiprocessing
import os
import pickle
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from compare.store import provenance, store
from compare.store.store import CaseStore, atomic_write_bytes, atomic_write_json, case_key, check_writable, jsonable
from ribbonbench.errors import BadInput, Missing
from ribbonbench.replacing import umask
from tests.compare.store.ordinary_user import not_root, public_folder


class Colour(enum.Enum):
    RED = "red"
    BLUE = 2


class Level(enum.IntEnum):
    LOW = 1


class Point(NamedTuple):
    x: float
    y: float


@dataclasses.dataclass(frozen=True)
class Inner:
    values: np.ndarray
    path: Path


@dataclasses.dataclass(frozen=True)
class Outer:
    inner: Inner
    status: Colour


# --- errors ----------------------------------------------------------------------------------------------------------


def test_bad_input_is_one_line_with_key_value_problem_and_remedy():
    error = BadInput("strip.width", 2.0, "is not\nsmaller than the length", "give less than 1.0")
    assert str(error) == "strip.width = 2.0: is not smaller than the length; give less than 1.0"
    assert (error.exit_code, error.key, error.value) == (2, "strip.width", 2.0)
    assert "\n" not in str(BadInput("key", "a\nb" * 200, "x"))
    assert len(str(BadInput("key", "a" * 10_000, "x"))) < 200
    assert str(BadInput("strip.length", None, "is missing", "add it")) == "strip.length: is missing; add it"


@pytest.mark.parametrize("error", [BadInput("a", math.nan, "b", "c"), Missing("dolfinx", "run it")])
def test_errors_survive_the_way_between_processes(error):
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), vars(again).keys()) == (type(error), str(error), vars(error).keys())
    assert again.remedy == error.remedy


# --- JSON ------------------------------------------------------------------------------------------------------------


def test_jsonable_of_what_results_hold():
    value = {
        "outer": Outer(Inner(np.array([[1.0, np.nan], [np.inf, 2.0]]), Path("a/b")), Colour.RED),
        "scalars": (np.float64(0.1), np.int64(3), np.bool_(True), np.str_("s"), np.float32(0.5)),
        "point": Point(1.0, -math.inf),
        "enums": [Colour.BLUE, Level.LOW],
        "set": {"b", "a"},
        "none": None,
        7: False,
    }
    expected = {
        "outer": {"inner": {"values": [[1.0, None], [None, 2.0]], "path": "a/b"}, "status": "red"},
        "scalars": [0.1, 3, True, "s", 0.5],
        "point": {"x": 1.0, "y": None},
        "enums": ["BLUE", "LOW"],
        "set": ["a", "b"],
        "none": None,
        "7": False,
    }
    plain = jsonable(value)
    assert plain == expected
    assert json.loads(json.dumps(plain, allow_nan=False)) == expected
    assert type(plain["scalars"][3]) is str
    assert plain["scalars"][2] is True


@pytest.mark.parametrize("value", [object(), 1j, b"bytes", {1: "a", "1": "b"}, [np.array([1j])], Outer])
def test_jsonable_refuses_what_json_cannot_say(value):
    with pytest.raises(TypeError):
        jsonable(value)


# --- files -----------------------------------------------------------------------------------------------------------


def test_atomic_write_replaces_whole_files_and_leaves_nothing_beside(tmp_path):
    target = tmp_path / "deep" / "result.json"
    atomic_write_json(target, {"a": math.nan})
    assert json.loads(target.read_text()) == {"a": None}
    assert atomic_write_bytes(target, b"new") == target
    assert target.read_bytes() == b"new"
    assert os.listdir(target.parent) == ["result.json"]
    assert target.stat().st_mode & 0o777 == 0o666 & ~umask()


def test_a_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    target = tmp_path / "result.json"
    target.write_text("old")
    monkeypatch.setattr(store.os, "replace", lambda *_: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        atomic_write_bytes(target, b"new")
    assert os.listdir(tmp_path) == ["result.json"]
    assert target.read_text() == "old"
    with pytest.raises(TypeError):
        atomic_write_json(target, object())
    assert target.read_text() == "old"


def test_check_writable_makes_the_folder(tmp_path):
    out = tmp_path / "a" / "b"
    assert check_writable(out) == out
    assert os.listdir(out) == []
    assert check_writable(str(out)) == out


@pytest.mark.parametrize("tail", ["", "sub", "sub/sub"])
def test_check_writable_with_a_file_in_the_way(tmp_path, tail):
    (tmp_path / "file").write_text("x")
    with pytest.raises(BadInput, match="is a file, not a folder") as caught:
        check_writable(tmp_path / "file" / tail, key="--out")
    assert caught.value.key == "--out"
    assert str(caught.value).startswith("--out = ")
    assert "\n" not in str(caught.value)
    assert os.listdir(tmp_path) == ["file"]


def test_check_writable_on_a_file_system_that_takes_no_files():
    with pytest.raises(BadInput, match="cannot be written"):  # not even root can make a folder in /proc
        check_writable("/proc/ribbonbench/out")


def test_check_writable_in_a_read_only_folder():
    with public_folder() as folder:
        folder.chmod(0o555)
        with not_root(), pytest.raises(BadInput, match="permission denied"):
            check_writable(folder / "out")
        folder.chmod(0o755)


def test_check_writable_removes_folders_it_made_in_vain(tmp_path):
    name = "x" * 300  # longer than any file system takes
    with pytest.raises(BadInput):
        check_writable(tmp_path / "made" / "on_the_way" / name)
    assert os.listdir(tmp_path) == []
    with pytest.raises(BadInput):
        check_writable("nul\0byte")


# --- keys ------------------------------------------------------------------------------------------------------------

leaves = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=5)
trees = st.recursive(leaves, lambda t: st.lists(t, max_size=3) | st.dictionaries(st.text(max_size=3), t, max_size=3))


def _shuffled(value):
    """The same value, every dictionary filled in reverse order."""
    if isinstance(value, dict):
        return {key: _shuffled(value[key]) for key in reversed(value)}
    return [_shuffled(item) for item in value] if isinstance(value, list) else value


@given(trees)
def test_case_key_does_not_depend_on_the_order_of_keys(value):
    assert case_key(value) == case_key(_shuffled(value))


@given(st.floats(allow_nan=False, allow_infinity=False), st.floats(allow_nan=False, allow_infinity=False))
def test_case_key_tells_floats_apart_to_the_last_bit(a, b):
    assert (case_key(a) == case_key(b)) == (repr(a) == repr(b))
    assert case_key(a) != case_key(np.nextafter(a, 0.0)) or a == 0.0


def test_case_key_tells_apart_what_differs():
    values = [
        [],
        [[]],
        [1],
        [1.0],
        ["1"],
        [True],
        [None],
        [math.nan],
        [math.inf],
        [-math.inf],
        [1, 2],
        [[1, 2]],
        [{"a": 1}],
    ]
    assert len({case_key(*value) for value in values}) == len(values)
    assert case_key(np.float64(0.1)) == case_key(0.1)
    assert len(case_key()) == 64


# --- cases -----------------------------------------------------------------------------------------------------------

KEY = case_key("scene", 1)


def _fill(folder: Path) -> None:
    (folder / "sub").mkdir()
    (folder / "sub" / "mesh.bin").write_bytes(b"0123456789")
    (folder / "result.json").write_text("{}")


def _failing(folder: Path) -> None:
    _fill(folder)
    raise RuntimeError("solver")


def test_a_case_is_found_again_only_under_its_key(tmp_path):
    cases = CaseStore(tmp_path / "cases")
    assert cases.get(KEY) is None
    folder = cases.put(KEY, _fill)
    assert cases.get(KEY) == folder
    assert (folder / "sub" / "mesh.bin").read_bytes() == b"0123456789"
    assert CaseStore(tmp_path / "cases").get(KEY) == folder
    assert cases.get(case_key("scene", 2)) is None
    with pytest.raises(ValueError, match="not a case key"):
        cases.get("../escape")


def test_a_writer_that_fails_leaves_nothing(tmp_path):
    cases = CaseStore(tmp_path)
    with pytest.raises(RuntimeError, match="solver"):
        cases.put(KEY, _failing)
    assert cases.get(KEY) is None
    assert list(tmp_path.rglob("mesh.bin")) == []


def _truncate(folder: Path) -> None:
    (folder / "sub" / "mesh.bin").write_bytes(b"01234")


def _alter(folder: Path) -> None:
    (folder / "sub" / "mesh.bin").write_bytes(b"0123456780")


def _drop(folder: Path) -> None:
    (folder / "result.json").unlink()


def _no_manifest(folder: Path) -> None:
    (folder / store.MANIFEST).unlink()


def _half_manifest(folder: Path) -> None:
    text = (folder / store.MANIFEST).read_text()
    (folder / store.MANIFEST).write_text(text[: len(text) // 2])


def _foreign_manifest(folder: Path) -> None:
    text = (folder / store.MANIFEST).read_text()
    (folder / store.MANIFEST).write_text(text.replace(KEY, case_key("other")))


@pytest.mark.parametrize("damage", [_truncate, _alter, _drop, _no_manifest, _half_manifest, _foreign_manifest])
def test_a_damaged_case_is_not_seen_and_is_made_anew(tmp_path, damage):
    cases = CaseStore(tmp_path)
    damage(cases.put(KEY, _fill))
    assert cases.get(KEY) is None
    folder = cases.put(KEY, _fill)
    assert cases.get(KEY) == folder
    assert (folder / "sub" / "mesh.bin").read_bytes() == b"0123456789"
    assert list((tmp_path / store._PARTIAL).iterdir()) == []


def test_a_regular_file_in_the_place_of_a_case_is_replaced(tmp_path):
    (tmp_path / KEY).write_text("not a case")
    cases = CaseStore(tmp_path)
    assert cases.get(KEY) is None
    assert cases.put(KEY, _fill) == cases.get(KEY)


def test_an_intact_case_is_kept(tmp_path):
    cases = CaseStore(tmp_path)
    folder = cases.put(KEY, _fill)
    (folder / "extra.txt").write_text("added later")
    cases.put(KEY, lambda work: (work / "result.json").write_text("second"))
    assert (folder / "result.json").read_text() == "{}"
    assert (folder / "extra.txt").exists()
    assert cases.get(KEY) == folder


def test_what_a_killed_process_left_behind_is_swept_and_what_lives_is_not(tmp_path):
    child = multiprocessing.get_context("spawn").Process(target=os.getpid)
    child.start()
    child.join()
    partial = tmp_path / store._PARTIAL
    dead, alive, other = (
        partial / f"{store._host()}-{child.pid}.abc",
        partial / f"{store._host()}-{os.getppid()}.abc",
        partial / "0badcafe-1.abc",
    )
    for folder in (dead, alive, other):
        folder.mkdir(parents=True)
        (folder / "half").write_text("x")
    CaseStore(tmp_path).put(KEY, _fill)
    assert (dead.exists(), alive.exists(), other.exists()) == (False, True, True)


def _put_slowly(root: str, number: int) -> None:
    CaseStore(root).put(KEY, lambda folder: (folder / "result.json").write_text(str(number) * 100_000))


def test_processes_that_make_the_same_case_at_once_end_with_one_whole_case(tmp_path):
    context = multiprocessing.get_context("spawn")
    workers = [context.Process(target=_put_slowly, args=(str(tmp_path), number)) for number in range(3)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert [worker.exitcode for worker in workers] == [0, 0, 0]
    folder = CaseStore(tmp_path).get(KEY)
    assert folder is not None
    assert len(set((folder / "result.json").read_text())) == 1


# --- provenance ------------------------------------------------------------------------------------------------------


def test_versions_tell_what_ran_and_no_path():
    seen = provenance.versions()
    assert seen["packages"]["numpy"] == np.__version__
    assert seen["cores"] >= 1
    assert seen["time"].endswith("+00:00")
    text = json.dumps(seen, allow_nan=False)
    for path in (str(Path(__file__).resolve().parents[3]), str(Path.home()) + "/"):
        assert path not in text


def test_software_is_what_a_key_may_depend_on():
    assert case_key(provenance.software()) == case_key(provenance.software())
    assert "time" not in provenance.software()
