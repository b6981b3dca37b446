"""Where compiled kernels are kept, and how they are loaded: in a folder named by the digest of their sources.

numba keeps one cache per file and looks at that file alone: a kernel that calls a kernel of another file would go on
with the old code of the other after it changed. A folder per state of the sources makes a stale kernel impossible.

Kernels are code: a folder that another user owns, or that others can write, is not loaded from (`trusted`); that is
said in one line, and a folder of this user alone is taken instead. `kept` has the files.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from numba.core import config as _config
from numba.core import dispatcher as _dispatcher
from numba.core import event

from ribbon.element import kept
from ribbon.element.trusted import fault, makeable, private
from ribbonbench.sources import Sources

#: States of the sources whose kernels are kept.
KEPT = 16

config: Any = _config  # numba's settings are made at import, unknown to type checkers
dispatcher: Any = _dispatcher

_PACKAGE = Path(__file__).parent.parent
_KERNEL = b"njit"


def root() -> Path:
    """Where kernels are kept: ``NUMBA_CACHE_DIR``, else ``RIBBONBENCH_CACHE``, else the user's cache folder (XDG); a
    folder of this user alone where others could have put kernels there, or nothing can be kept."""
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "ribbonbench"
    given = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("RIBBONBENCH_CACHE")
    return _trusted((Path(given).expanduser() if given else home) / "kernels", home / "kernels")


@functools.cache
def _trusted(place: Path, own: Path) -> Path:
    """The first of both that nobody else can write; a private folder where there is none."""
    why = _why_not(place)
    if why is None:
        return place
    instead = own if own != place and _why_not(own) is None else private("ribbonbench-kernels")
    words = f"kernels are code, and are not taken from {place}: {why}; they are compiled into {instead} instead"
    print(f"ribbonbench: note: {words}", file=sys.stderr)
    return instead


def _why_not(place: Path) -> str | None:
    """What speaks against the kernels in `place`, those of the present sources among them."""
    state = place / digest()
    return fault(place, whole=False) or fault(state) or (None if state.is_dir() or makeable(place) else _READ_ONLY)


_READ_ONLY = "it cannot be written"


def sources(package: Path = _PACKAGE) -> dict[str, bytes]:
    """Dotted name -> text of every module of the package with kernels, and of all that they import from it.

    What only calls kernels changes none: a solver may be worked on without compiling everything again.
    """
    tree = Sources(package.parent)
    kernels = [name for name, path in tree.every(package.name).items() if _KERNEL in path.read_bytes()]
    found = tree.closure(*kernels, statements=True)
    return {name: path.read_bytes() for name, path in found.items() if name.partition(".")[0] == package.name}


@functools.cache
def digest() -> str:
    """First 16 digits of the SHA-256 of `sources`."""
    found = hashlib.sha256()
    for name, text in sorted(sources().items()):
        found.update(name.encode() + b"\0" + text)
    return found.hexdigest()[:16]


def prune(folder: Path, keep: str) -> None:
    """Removes all but the latest used KEPT states of the sources from `folder`, and never the state `keep`."""
    with contextlib.suppress(OSError):
        others = [entry for entry in folder.iterdir() if entry.is_dir() and entry.name != keep]
        for entry in sorted(others, key=lambda path: path.stat().st_mtime, reverse=True)[KEPT - 1 :]:
            shutil.rmtree(entry, ignore_errors=True)


@contextlib.contextmanager
def in_use() -> Iterator[None]:
    """Kernels that are decorated inside are cached in this package's folder; other users of numba keep theirs."""
    folder, kept_by = config.CACHE_DIR, dispatcher.FunctionCache
    state = digest()
    config.CACHE_DIR = str(root() / state)
    if kept.FITS:
        dispatcher.FunctionCache = kept.QuickCache
    with contextlib.suppress(OSError):
        os.utime(root() / state)
    prune(root(), state)
    try:
        yield
    finally:
        config.CACHE_DIR, dispatcher.FunctionCache = folder, kept_by


class _Listener(event.Listener):
    def __init__(self, tell: Callable[[int], object]) -> None:
        self.tell = tell
        self.count = 0

    def on_start(self, event: Any) -> None:
        """A compilation begins: ours only are counted."""
        if event.data["dispatcher"].py_func.__module__.partition(".")[0] == _PACKAGE.name:
            self.count += 1
            self.tell(self.count)

    def on_end(self, event: Any) -> None:
        """Nothing."""


@contextlib.contextmanager
def told(tell: Callable[[int], object]) -> Iterator[None]:
    """While inside, `tell` is called with 1, 2, ... whenever the compilation of a kernel of ours begins."""
    listener = _Listener(tell)
    event.register("numba:compile", listener)
    try:
        yield
    finally:
        event.unregister("numba:compile", listener)
