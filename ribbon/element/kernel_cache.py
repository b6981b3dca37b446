"""Where compiled kernels are kept: in a folder named by the digest of our sources.

numba keeps one cache per file and looks at that file alone: a kernel that calls a kernel of another file would go on
with the old code of the other after it changed. A folder per state of the sources makes a stale kernel impossible.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from numba.core import config as _config

#: States of the sources whose kernels are kept.
KEPT = 4

config: Any = _config  # numba's settings are made at import, unknown to type checkers


def root() -> Path:
    """``NUMBA_CACHE_DIR``, else ``RIBBONBENCH_CACHE``, else the user's cache folder (XDG)."""
    given = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("RIBBONBENCH_CACHE")
    if given:
        return Path(given).expanduser() / "kernels"
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home) / "ribbonbench" / "kernels"


def digest() -> str:
    """First 16 digits of the SHA-256 of all modules of this package."""
    found = hashlib.sha256()
    here = Path(__file__).parent.parent
    for path in sorted(here.rglob("*.py")):
        found.update(path.relative_to(here).as_posix().encode() + b"\0" + path.read_bytes())
    return found.hexdigest()[:16]


def prune(folder: Path, keep: str) -> None:
    """Removes all but the newest KEPT states of the sources from `folder`, and never the state `keep`."""
    with contextlib.suppress(OSError):
        others = [entry for entry in folder.iterdir() if entry.is_dir() and entry.name != keep]
        for entry in sorted(others, key=lambda path: path.stat().st_mtime, reverse=True)[KEPT - 1 :]:
            shutil.rmtree(entry, ignore_errors=True)


@contextlib.contextmanager
def in_use() -> Iterator[None]:
    """Kernels that are decorated inside are cached in this package's folder; other users of numba keep theirs."""
    before = config.CACHE_DIR
    state = digest()
    config.CACHE_DIR = str(root() / state)
    prune(root(), state)
    try:
        yield
    finally:
        config.CACHE_DIR = before
