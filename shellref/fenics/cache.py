"""Where compiled forms are kept between runs. They are machine code: a folder that others can write is not used."""

from __future__ import annotations

import functools
import os
import stat
import sys
import tempfile
from pathlib import Path


@functools.cache
def cache_folder() -> Path:
    """In $RIBBONBENCH_CACHE, $XDG_CACHE_HOME or ~/.cache; where that folder or a file in it belongs to another user, or
    others can write it, a folder for this process alone, which is said once on stderr."""
    own = os.environ.get("RIBBONBENCH_CACHE")
    home = Path(own).expanduser() if own else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = home / "forms" if own else home / "ribbonbench" / "forms"
    why = distrusted(folder)
    if why is None:
        return folder
    note = f"compiled forms in {folder} are not used: {why}; they are compiled again, remove that folder to mend it"
    print(f"ribbonbench: note: {note}", file=sys.stderr)
    return Path(tempfile.mkdtemp(prefix="ribbonbench-forms-"))


def distrusted(folder: Path) -> str | None:
    """Why code in `folder` may be another's, in words; None where it is this user's (or root's) alone, or not there."""
    try:
        paths = [folder, *folder.iterdir()]
    except FileNotFoundError:
        return None
    except OSError as error:
        return (error.strerror or str(error)).lower()
    entered = True
    for path in paths:
        try:
            found = path.stat() if path == folder else path.lstat()
        except FileNotFoundError:
            continue  # another process has removed it meanwhile
        name = "it" if path == folder else path.name
        if found.st_uid not in (os.geteuid(), 0):
            return f"{name} belongs to another user (number {found.st_uid})"
        if stat.S_ISLNK(found.st_mode):
            return f"{name} is a link"
        if entered and found.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
            return f"others can write {name}"
        if path == folder:  # what stands in a folder that others cannot enter, they cannot write
            entered = bool(found.st_mode & (stat.S_IXGRP | stat.S_IXOTH))
    return None
