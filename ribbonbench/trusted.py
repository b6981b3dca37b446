"""Whose folders code is loaded from: kernels are executable, and whoever can write one can run what he likes as us.

A folder is trusted when it and all in it belong to this user (or to root) and nobody else can write it; so are folders
that are not there yet, which are made for this user alone.
"""

from __future__ import annotations

import os
import stat
import tempfile
from pathlib import Path

_OTHERS = stat.S_IWGRP | stat.S_IWOTH


def fault(folder: Path, whole: bool = True) -> str | None:
    """Why nothing is loaded from `folder`, in words; None where it is trusted, or not there. whole: with all in it."""
    for above in folder.absolute().parents:
        mode = _mode(above)
        if mode is not None and mode.st_mode & stat.S_IWOTH and not mode.st_mode & stat.S_ISVTX:
            return f"everybody can write {above.name or above}, in which it stands"
    return _fault(folder, whole)


def _fault(folder: Path, whole: bool) -> str | None:
    found = _mode(folder)
    if found is None:
        return None
    if not stat.S_ISDIR(found.st_mode):
        return "it is no folder"
    if found.st_uid not in (os.geteuid(), 0):
        return f"it belongs to another user (number {found.st_uid})"
    if found.st_mode & _OTHERS:
        return "others can write it"
    if not whole:
        return None
    try:
        entries = list(os.scandir(folder))
    except OSError as error:
        return f"it cannot be read ({(error.strerror or str(error)).lower()})"
    for entry in entries:
        deeper = entry.is_dir(follow_symlinks=False)
        worse = _fault(Path(entry.path), True) if deeper else _file_fault(entry)
        if worse is not None:
            return worse if worse.startswith("in it") else f"in it, {entry.name}: {worse.removeprefix('it ')}"
    return None


def _file_fault(entry: os.DirEntry[str]) -> str | None:
    try:
        found = entry.stat(follow_symlinks=False)
    except OSError:
        return None  # gone meanwhile
    if stat.S_ISLNK(found.st_mode):
        return "is a link"
    if found.st_uid not in (os.geteuid(), 0):
        return f"belongs to another user (number {found.st_uid})"
    return "others can write it" if found.st_mode & _OTHERS else None


def _mode(path: Path) -> os.stat_result | None:
    try:
        return path.stat()
    except OSError:
        return None


def made(folder: Path) -> Path:
    """The folder, made where it is not there, for this user alone."""
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    for path in reversed(missing):
        path.mkdir(mode=0o700, exist_ok=True)
    return folder


def makeable(folder: Path) -> bool:
    """Whether files can be put into the folder, or it can be made."""
    try:
        made(folder)
        handle, name = tempfile.mkstemp(prefix=".probe-", dir=folder)
        os.close(handle)
        os.unlink(name)
    except OSError:
        return False
    return True


def private(name: str) -> Path:
    """A folder for temporary files of this user alone: the same one for all his processes where it is trusted."""
    place = Path(tempfile.gettempdir()) / f"{name}-{os.geteuid()}"
    if fault(place) is None:
        return place
    return Path(tempfile.mkdtemp(prefix=f"{name}-"))
