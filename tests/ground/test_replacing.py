"""Files that are whole or not there."""

from __future__ import annotations

import os

import pytest

from ribbonbench.replacing import replacing, umask


@pytest.mark.parametrize("sole", [False, True])
def test_a_reader_sees_the_old_file_or_the_new_one(tmp_path, sole):
    place = tmp_path / "new" / "part"
    with replacing(place, sole=sole) as stream:
        stream.write(b"one")
        assert not place.exists()
    assert place.read_bytes() == b"one"
    with pytest.raises(TypeError), replacing(place, sole=sole) as stream:
        stream.writelines([b"half", "of it"])
    assert place.read_bytes() == b"one"
    assert os.listdir(place.parent) == ["part"]
    assert place.stat().st_mode & 0o777 == 0o666 & ~umask()


def test_what_a_killed_sole_writer_left_is_written_over_and_caches_are_their_owners(tmp_path):
    (tmp_path / ".part.tmp").write_bytes(b"left by a killed run, and longer than what comes")
    with replacing(tmp_path / "part", sole=True) as stream:
        stream.write(b"new")
    with replacing(tmp_path / "kept", own=True, lasting=False) as stream:
        stream.write(b"mine")
    assert sorted(os.listdir(tmp_path)) == ["kept", "part"]
    assert (tmp_path / "part").read_bytes() == b"new"
    assert (tmp_path / "kept").stat().st_mode & 0o777 == 0o600
