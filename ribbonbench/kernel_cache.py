"""Where compiled kernels are kept, and how they are loaded: in a folder named by the digest of their sources.

numba keeps one cache per file and looks at that file alone: a kernel that calls a kernel of another file would go on
with the old code of the other after it changed. A folder per state of the sources makes a stale kernel impossible.

Kernels are code: a folder that another user owns, or that others can write, is not loaded from (`trusted`); that is
said in one line, and a folder of this user alone is taken instead. `kernel_files` has the files. This is ground that
`ribbon` and `shellref` share: no mechanics and no numerics.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import re
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from numba.core import config as _config
from numba.core import dispatcher as _dispatcher
from numba.core import event

from ribbonbench import clock, kernel_files
from ribbonbench.sources import Sources
from ribbonbench.trusted import fault, makeable, private

#: States of a package's sources whose kernels are kept.
KEPT = 16
#: Digits of the digest in the name of a state.
DIGITS = 16

config: Any = _config  # numba's settings are made at import, unknown to type checkers
dispatcher: Any = _dispatcher

_KERNEL = b"njit"
_READ_ONLY = "it cannot be written"


class KernelCache:
    """The compiled kernels of one top-level package. marks: what a source with kernels has in it."""

    def __init__(self, package: Path, *marks: bytes) -> None:
        self.package, self._marks = package, (_KERNEL, *marks)
        event.register("numba:compile", _Listener(package.name, _tell_all))

    def root(self) -> Path:
        """Where kernels are kept: ``NUMBA_CACHE_DIR``, else ``RIBBONBENCH_CACHE``, else the user's cache folder (XDG);
        a folder of this user alone where others could have put kernels there, or nothing can be kept."""
        home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "ribbonbench"
        given = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("RIBBONBENCH_CACHE")
        return _trusted((Path(given).expanduser() if given else home) / "kernels", home / "kernels", self.state())

    def state(self) -> str:
        """The name of the folder, in `root`, of the kernels of the present sources."""
        return f"{self.package.name}-{self.digest()}"

    def sources(self, package: Path | None = None) -> dict[str, bytes]:
        """Dotted name -> text of every module of the package with kernels, and of all that they import from it.

        What only calls kernels changes none: a solver may be worked on without compiling everything again.
        package: another copy of it.
        """
        place = self.package if package is None else package
        tree = Sources(place.parent)
        texts = {name: path.read_bytes() for name, path in tree.every(place.name).items()}
        kernels = [name for name, text in texts.items() if any(mark in text for mark in self._marks)]
        found = tree.closure(*kernels, statements=True)
        return {name: path.read_bytes() for name, path in found.items() if name.partition(".")[0] == place.name}

    def digest(self) -> str:
        """First `DIGITS` digits of the SHA-256 of `sources`."""
        if self._digest is None:
            found = hashlib.sha256()
            for name, text in sorted(self.sources().items()):
                found.update(name.encode() + b"\0" + text)
            self._digest = found.hexdigest()[:DIGITS]
        return self._digest

    _digest: str | None = None

    def prune(self, folder: Path, keep: str) -> None:
        """Removes all but the latest used KEPT states of the package from `folder`, and never the state `keep`. States
        of earlier versions, named by a digest alone, count among them."""
        with contextlib.suppress(OSError):
            states = [entry for entry in folder.iterdir() if entry.is_dir() and entry.name != keep]
            ours = [entry for entry in states if self._named(entry.name)]
            for entry in sorted(ours, key=lambda path: path.stat().st_mtime, reverse=True)[KEPT - 1 :]:
                shutil.rmtree(entry, ignore_errors=True)

    def _named(self, name: str) -> bool:
        """Whether a folder of this name holds a state of the package, or of a version that did not name packages."""
        nameless = re.fullmatch(f"[0-9a-f]{{{DIGITS}}}", name) is not None
        return nameless or name.rpartition("-")[0] == self.package.name

    @contextlib.contextmanager
    def in_use(self) -> Iterator[None]:
        """Kernels that are decorated inside are cached in the package's folder; other users of numba keep theirs."""
        folder, cache = config.CACHE_DIR, dispatcher.FunctionCache
        root, state = self.root(), self.state()
        config.CACHE_DIR = str(root / state)
        if kernel_files.FITS:
            dispatcher.FunctionCache = kernel_files.QuickCache
        with contextlib.suppress(OSError):
            os.utime(root / state)
        self.prune(root, state)
        try:
            yield
        finally:
            config.CACHE_DIR, dispatcher.FunctionCache = folder, cache

    @contextlib.contextmanager
    def told(self, tell: Callable[[int], object]) -> Iterator[None]:
        """While inside, `tell` is called with 1, 2, ... whenever the compilation of a kernel of the package begins."""
        listener = _Listener(self.package.name, tell)
        event.register("numba:compile", listener)
        try:
            yield
        finally:
            event.unregister("numba:compile", listener)


def _tell_all(_: int) -> None:
    for tell in list(clock.COMPILING):
        tell()


@functools.cache
def _trusted(place: Path, own: Path, state: str) -> Path:
    """The first of both that nobody else can write; a private folder where there is none."""
    why = _why_not(place, state)
    if why is None:
        return place
    instead = own if own != place and _why_not(own, state) is None else private("ribbonbench-kernels")
    words = f"kernels are code, and are not taken from {place}: {why}; they are compiled into {instead} instead"
    if (place, why) not in _SAID:
        _SAID.add((place, why))
        print(f"ribbonbench: note: {words}", file=sys.stderr)
    return instead


_SAID: set[tuple[Path, str]] = set()


def _why_not(place: Path, state: str) -> str | None:
    """What speaks against the kernels in `place`, those of a state of the sources among them."""
    inner = place / state
    return fault(place, whole=False) or fault(inner) or (None if inner.is_dir() or makeable(place) else _READ_ONLY)


class _Listener(event.Listener):
    """Counts the compilations of a package's kernels."""

    def __init__(self, package: str, tell: Callable[[int], object]) -> None:
        self.package, self.tell, self.count = package, tell, 0

    def on_start(self, event: Any) -> None:
        """A compilation begins: the package's only are counted."""
        if event.data["dispatcher"].py_func.__module__.partition(".")[0] == self.package:
            self.count += 1
            self.tell(self.count)

    def on_end(self, event: Any) -> None:
        """Nothing."""
