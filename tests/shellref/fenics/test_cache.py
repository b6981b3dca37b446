"""Compiled forms are machine code: a folder that others can write, or that is another's, is not used."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from shellref.fenics import cache


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("RIBBONBENCH_CACHE", str(tmp_path))
    found = tmp_path / "forms"
    found.mkdir(mode=0o700)
    (found / "libffcx_forms.so").write_bytes(b"code")
    (found / "libffcx_forms.so").chmod(0o644)
    cache.cache_folder.cache_clear()
    yield found
    cache.cache_folder.cache_clear()


def test_the_users_own_folder_is_used(folder, capsys):
    assert cache.cache_folder() == folder
    folder.chmod(0o755)
    assert cache.distrusted(folder) is None
    assert cache.distrusted(folder / "not there") is None
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("mode", [0o777, 0o775])
def test_a_folder_that_others_can_write_is_not(folder, mode, capsys):
    folder.chmod(mode)
    other = cache.cache_folder()
    assert other != folder
    assert other.stat().st_mode & 0o777 == 0o700
    assert capsys.readouterr().err.count("\n") == 1
    assert cache.cache_folder() == other  # of this process, said once
    assert capsys.readouterr().err == ""


def test_a_file_that_others_can_write_counts_where_they_can_reach_it(folder):
    (folder / "libffcx_forms.so").chmod(0o666)
    assert cache.distrusted(folder) is None
    folder.chmod(0o755)
    assert cache.distrusted(folder) is not None


def test_a_link_in_it_is_not_followed(folder, tmp_path):
    (folder / "libffcx_other.so").symlink_to(tmp_path / "elsewhere.so")
    assert cache.distrusted(folder) is not None


def test_anothers_folder_is_not_used(folder, monkeypatch):
    monkeypatch.setattr(os, "geteuid", lambda: Path(folder).stat().st_uid + 1000)
    owned_by_root = Path(folder).stat().st_uid == 0
    assert (cache.distrusted(folder) is None) == owned_by_root
