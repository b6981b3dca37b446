"""A full disk, and stores that are none: one clear line, nothing corrupt, the same command goes on."""

from __future__ import annotations

import errno
import json
import os
import random
import signal
import subprocess
import sys
import time

import pytest

from compare.cli import DONE, MISSING, main
from compare.store import store
from compare.store.store import CaseStore, atomic_write_bytes, case_key, check_writable, disk_full
from ribbonbench.errors import BadInput

KEY = case_key("a case")


def write(folder):
    (folder / "data.bin").write_bytes(b"\x01" * 100_000)


def test_disk_full_is_found_behind_other_errors():
    full = OSError(errno.EDQUOT, "Disk quota exceeded")
    wrapped = RuntimeError("could not save")
    wrapped.__cause__ = full
    assert disk_full(full) is full
    assert disk_full(wrapped) is full
    assert disk_full(OSError(errno.EACCES, "no")) is None
    assert disk_full(ValueError()) is None


@pytest.mark.parametrize(
    ("call", "number"), [("fsync", errno.ENOSPC), ("replace", errno.EDQUOT), ("chmod", errno.EFBIG)]
)
def test_solve_on_a_full_disk_is_one_line(tmp_path, monkeypatch, capsys, call, number):
    scene = ["solve", "cantilever", "--set", "model.elements=4", "--quiet", "--out", str(tmp_path)]

    def full(*arguments, **keywords):
        raise OSError(number, os.strerror(number))

    with monkeypatch.context() as patch:
        patch.setattr(store.os, call, full)
        assert main(scene) == MISSING
    said = capsys.readouterr().err
    assert said.startswith("ribbonbench: disk full (")
    assert said.count("\n") == 1
    assert not (tmp_path / "result.json").exists()
    assert main(scene) == DONE
    assert json.loads((tmp_path / "result.json").read_text())["status"] == "converged"
    assert not list(tmp_path.glob(".*tmp"))


def test_a_full_disk_is_no_bad_folder(tmp_path, monkeypatch):
    def full(*arguments, **keywords):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(store.tempfile, "NamedTemporaryFile", full)
    with pytest.raises(OSError, match="space"):
        check_writable(tmp_path / "new")
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("call", ["rename", "fsync"])
def test_a_case_on_a_full_disk_leaves_nothing(tmp_path, monkeypatch, call):
    cases = CaseStore(tmp_path / "cases")

    def full(*arguments):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(store.os, call, full)
        with pytest.raises(OSError, match="space"):
            cases.put(KEY, write)
    assert cases.get(KEY) is None
    assert [p for p in (tmp_path / "cases").rglob("*") if p.is_file()] == []
    assert cases.get(KEY) is None
    assert cases.put(KEY, write).name == KEY


@pytest.mark.parametrize("place", ["cases", "cases/.partial", "cases/.unfinished"])
def test_a_file_in_the_place_of_a_store_is_said(tmp_path, place):
    (tmp_path / place).parent.mkdir(exist_ok=True)
    (tmp_path / place).write_text("mine")
    cases = CaseStore(tmp_path / "cases")
    assert cases.get(KEY) is None
    with pytest.raises(BadInput, match="no store of cases"), cases.unfinished(KEY):
        cases.put(KEY, write)
    assert (tmp_path / place).read_text() == "mine"


WRITER = """
import sys
from compare.store.store import CaseStore, case_key
cases = CaseStore(sys.argv[1])
k = int(sys.argv[2])
print("go", flush=True)
while True:
    cases.put(case_key(k), lambda folder: [(folder / f"{n}.bin").write_bytes(bytes([k % 251]) * 50_000) for n in "abc"])
    k += 1
"""


def test_killed_in_mid_write_every_case_is_whole_or_absent(tmp_path):
    rng = random.Random(1)
    finished = kills = 0
    while kills < 8 or not finished:  # on a busy machine the first ones may come before anything is written
        kills += 1
        process = subprocess.Popen(
            [sys.executable, "-c", WRITER, str(tmp_path), str(finished)], stdout=subprocess.PIPE, text=True
        )
        assert process.stdout.readline() == "go\n"
        time.sleep(rng.uniform(0.0, 0.0075 * kills))
        process.send_signal(signal.SIGKILL)
        process.wait()
        process.stdout.close()
        cases = CaseStore(tmp_path)
        while (folder := cases.get(case_key(finished))) is not None:
            assert [(folder / f"{n}.bin").read_bytes() for n in "abc"] == [bytes([finished % 251]) * 50_000] * 3
            finished += 1
        folders = [p for p in tmp_path.iterdir() if not p.name.startswith(".")]
        assert len(folders) == finished
    CaseStore(tmp_path).put(case_key("last"), write)
    assert list((tmp_path / ".partial").iterdir()) == []


FILE_WRITER = """
import sys
from compare.store.store import atomic_write_bytes
print("go", flush=True)
k = 0
while True:
    atomic_write_bytes(sys.argv[1], bytes([k % 256]) * 200_000)
    k += 1
"""


def test_killed_in_mid_write_a_file_is_the_old_or_the_new(tmp_path):
    rng = random.Random(2)
    path = tmp_path / "f.bin"
    atomic_write_bytes(path, b"\x00" * 200_000)
    for _ in range(6):
        process = subprocess.Popen([sys.executable, "-c", FILE_WRITER, str(path)], stdout=subprocess.PIPE, text=True)
        assert process.stdout.readline() == "go\n"
        time.sleep(rng.uniform(0.0, 0.04))
        process.send_signal(signal.SIGKILL)
        process.wait()
        process.stdout.close()
        data = path.read_bytes()
        assert len(data) == 200_000
        assert len(set(data)) == 1
