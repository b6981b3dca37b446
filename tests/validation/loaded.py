"""Which modules a measurement had loaded, and whether these are all that made its numbers, by Python's own account
(audit events) from the import of its module to the end of its `run`.

A module that was never loaded has changed no number, and what would load it now must itself have changed. That holds
where this process did all the work from sources alone: it started no program but those of `FOREIGN`, no worker of
multiprocessing, and opened no file that an earlier run had left, but for what is in the key and what is found again by
its content (`CONTENT`: code, kernels under the digest of their sources, forms under theirs). Otherwise `why_not` says
what speaks against it. It imports nothing of ours.
"""

from __future__ import annotations

import contextlib
import os
import re
import sys
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

#: Programs that run none of our code.
FOREIGN = re.compile(r"git|dpkg-query|ldconfig|ld|lscpu|uname|ccx|([\w]+-linux-gnu-)?(cc|gcc|g\+\+|c\+\+|ld)")
#: Files whose names or whose use hold what they were made from, and what is no result.
CONTENT = re.compile(
    r".*(\.py|\.pyc|\.so|\.nbc|\.c|\.c\.cached|/sources-[\d.]+\.json|/fontlist-[\w.-]+\.json|\.(egg|dist)-info/[\w.-]+)"
)
#: Where the system and the installed packages stand.
SYSTEM = tuple(
    f"{os.path.realpath(place)}/"
    for place in (sys.prefix, sys.base_prefix, "/usr", "/etc", "/proc", "/sys", "/dev", "/run")
)
_STARTS = {"os.fork", "os.forkpty", "os.exec", "os.spawn", "os.system", "pty.spawn"}
_PROGRAMS = {"subprocess.Popen", "os.posix_spawn"}
_EVENTS = frozenset({"import", "open", "os.rename", "os.link", "sqlite3.connect", *_STARTS, *_PROGRAMS})
_WRITES = os.O_WRONLY | os.O_RDWR
_FRESH = os.O_TRUNC | os.O_EXCL


class Heard:
    """What was imported, started, opened and written since the hearing began."""

    def __init__(self) -> None:
        self.imported: set[str] = set()
        self.started: dict[str, None] = {}
        self.opened: dict[str, None] = {}
        self._own: set[str] = set()

    def __call__(self, event: str, arguments: tuple[Any, ...]) -> None:
        """An audit event."""
        if event == "import":
            self.imported.add(str(arguments[0]))
        elif event == "open":
            self._open(arguments[0], arguments[2])
        elif event in ("os.rename", "os.link"):
            self._moved(*map(_real, arguments[:2]))
        elif event == "sqlite3.connect":
            self._open(arguments[0], os.O_RDWR)
        elif event in _PROGRAMS:
            program = os.path.basename(os.fsdecode(arguments[0] or arguments[1][0]))
            if FOREIGN.fullmatch(program) is None:
                self.started[program] = None
        elif event in _STARTS:
            self.started[event] = None

    def _open(self, name: Any, flags: Any) -> None:
        if not isinstance(name, str | bytes | os.PathLike):
            return
        path, flags = _real(name), flags if isinstance(flags, int) else 0
        if path in self._own or CONTENT.fullmatch(path) or path.startswith(SYSTEM):
            return
        if not flags & _FRESH and os.path.isfile(path) and os.path.getsize(path):
            self.opened[path] = None
        elif flags & _WRITES:
            self._own.add(path)

    def _moved(self, old: str, new: str) -> None:
        inside = [path for path in tuple(self._own) if path == old or path.startswith(f"{old}/")]
        self._own.update(new + path.removeprefix(old) for path in inside)

    def why_not(self, root: Path, known: Collection[Path]) -> str:
        """What speaks against the loaded modules as the whole truth, in words; "" where nothing does. known: the files
        that are in the key."""
        allowed = {os.path.realpath(path) for path in known}
        read = [path for path in self.opened if path not in allowed]
        if self.started or "multiprocessing.popen_fork" in sys.modules:
            return f"it started {next(iter(self.started), 'workers')}"
        if read:
            path = Path(read[0])
            home = root.resolve()
            return f"it read {path.relative_to(home).as_posix() if path.is_relative_to(home) else path.name}"
        return ""

    def loaded(self) -> dict[str, str]:
        """Name -> file of all modules that are loaded now, were since the hearing began ("": its file is not known), or
        are compiled into a kernel that is."""
        found = dict.fromkeys(self.imported, "")
        memo = getattr(sys.modules.get("numba.core.environment"), "Environment", None)
        found.update({str(one.globals.get("__name__")): "" for one in list(memo._memo.values())} if memo else {})
        files = {name: getattr(module, "__file__", None) for name, module in list(sys.modules.items())}
        found.update({name: file or "" for name, file in files.items()})
        return found


def _real(name: Any) -> str:
    return os.path.realpath(os.fsdecode(name))


_hearing: list[Heard] = []
_hooked = False


def _hook(event: str, arguments: tuple[Any, ...]) -> None:
    if event in _EVENTS:
        for heard in _hearing:
            heard(event, arguments)


@contextlib.contextmanager
def hearing(heard: Heard) -> Iterator[None]:
    """Lets `heard` hear what happens while the block runs."""
    global _hooked
    if not _hooked:
        sys.addaudithook(_hook)
        _hooked = True
    _hearing.append(heard)
    try:
        yield
    finally:
        _hearing.remove(heard)
