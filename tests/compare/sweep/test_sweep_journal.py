"""The journal of a sweep: whatever happens to it, what is read back is what was finished."""

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

from compare.sweep import journal as sweep_journal
from compare.sweep.journal import JOURNAL, Journal
from ribbonbench.errors import BadInput

RECORD = {"status": "converged", "message": "é\n", "rows": [{"x": 0.1 + 0.2, "none": None}]}


def filled(folder, count=3, software="s"):
    with Journal(folder, software) as journal:
        for k in range(count):
            journal.add(f"key{k}", {**RECORD, "k": k})
    return folder / JOURNAL


def test_cases_come_back_to_the_last_bit(tmp_path):
    filled(tmp_path)
    again = Journal(tmp_path, "s")
    assert again.found == {f"key{k}": {**RECORD, "k": k} for k in range(3)}
    assert (again.damaged, again.others, again.aside) == (0, 0, None)
    assert Journal(tmp_path, "s", fresh=True).found == {}
    assert not (tmp_path / JOURNAL).exists()


def test_cut_anywhere_it_goes_on(tmp_path):
    """Every prefix is a journal: complete lines count, and what is added after is found."""
    whole = filled(tmp_path).read_bytes()
    ends = [k for k, byte in enumerate(whole) if byte == 10]
    for cut in [*range(0, len(whole), 7), *(e + d for e in ends for d in (-1, 0, 1))]:
        folder = tmp_path / f"cut{cut}"
        folder.mkdir(exist_ok=True)
        (folder / JOURNAL).write_bytes(whole[:cut])
        with Journal(folder, "s") as journal:
            # the last line counts with or without its newline
            expected = sum(cut >= end for end in ends[1:])
            assert len(journal.found) == expected, cut
            journal.add("later", RECORD)
        again = Journal(folder, "s")
        assert set(again.found) == {*(f"key{k}" for k in range(expected)), "later"}


def test_an_altered_line_is_made_again_and_the_rest_counts(tmp_path):
    path = filled(tmp_path)
    path.write_bytes(path.read_bytes().replace(b'"k":1', b'"k":7'))
    journal = Journal(tmp_path, "s")
    assert set(journal.found) == {"key0", "key2"}
    assert journal.damaged == 1
    lines = path.read_bytes().split(b"\n")
    path.write_bytes(b"\n".join([b"rubbish", *lines[1:]]))
    assert set(Journal(tmp_path, "s").found) == {"key0", "key2"}


@pytest.mark.parametrize("content", [b"a diary\nof mine\n", b"\x00" * 50, b"{}\n"])
def test_a_foreign_file_is_left_alone(tmp_path, content):
    (tmp_path / JOURNAL).write_bytes(content)
    with pytest.raises(BadInput, match="not the journal of a sweep"):
        Journal(tmp_path, "s")
    assert (tmp_path / JOURNAL).read_bytes() == content


def test_a_folder_in_its_place(tmp_path):
    (tmp_path / JOURNAL).mkdir()
    with pytest.raises(BadInput, match="not the journal"):
        Journal(tmp_path, "s")


def test_another_version_is_counted_and_another_format_put_aside(tmp_path, monkeypatch):
    filled(tmp_path, software="older")
    assert Journal(tmp_path, "newer").others == 3
    monkeypatch.setattr(sweep_journal, "FORMAT", 2)
    with Journal(tmp_path, "newer") as journal:
        assert journal.found == {}
        journal.add("key", RECORD)
    assert journal.aside == "journal-format-1.jsonl"
    assert (tmp_path / journal.aside).read_bytes().count(b"\n") == 4
    assert set(Journal(tmp_path, "newer").found) == {"key"}


@pytest.mark.parametrize("kept", [0, 5])
def test_a_full_disk_leaves_the_journal_as_it_was(tmp_path, monkeypatch, kept):
    """The disk takes `kept` bytes of a line and then nothing more."""
    path = filled(tmp_path)
    before = path.read_bytes()
    real = os.pwrite

    def full(handle, data, offset):
        if offset - len(before) >= kept:
            raise OSError(errno.ENOSPC, "No space left on device")
        return real(handle, data[:kept], offset)

    with Journal(tmp_path, "s") as journal:
        monkeypatch.setattr(os, "pwrite", full)
        with pytest.raises(OSError, match="space"):
            journal.add("more", RECORD)
    assert path.read_bytes() == before
    monkeypatch.undo()
    assert len(Journal(tmp_path, "s").found) == 3


WRITER = """
import sys
from pathlib import Path
from compare.sweep.journal import Journal
k = int(sys.argv[2])
with Journal(Path(sys.argv[1]), "s") as journal:
    print("go", flush=True)
    while True:
        journal.add(f"key{k}", {"k": k, "text": "x" * 3000})
        k += 1
"""


def test_killed_at_random_moments_nothing_finished_is_lost(tmp_path):
    rng = random.Random(4)
    count = kills = 0
    while kills < 8 or not count:  # on a busy machine the first ones may come before anything is written
        kills += 1
        process = subprocess.Popen(
            [sys.executable, "-c", WRITER, str(tmp_path), str(count)], stdout=subprocess.PIPE, text=True
        )
        assert process.stdout.readline() == "go\n"
        time.sleep(rng.uniform(0.0, 0.00625 * kills))
        process.send_signal(signal.SIGKILL)
        process.wait()
        process.stdout.close()
        found = Journal(tmp_path, "s").found
        assert len(found) >= count
        assert all(found[f"key{k}"]["k"] == k for k in range(len(found)))
        count = len(found)
    first = (tmp_path / JOURNAL).read_text().split("\n")[0]
    assert json.loads(first.partition(" ")[2])["format"] == sweep_journal.FORMAT
