"""What an operating system gives, asked in one place: locks, processes, signals, memory, cores, the processor's name.

On POSIX systems by their own calls; where those are not there (Windows), or not on this POSIX system (macOS has no
`prctl`, no affinity, no /proc), the nearest that is portable, and each function says what is then different. Only the
standard library is imported here, and of that what is not always needed late.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import subprocess

try:
    import fcntl as _fcntl
except ImportError:  # Windows
    _fcntl = None  # type: ignore[assignment]
try:
    import resource as _resource
except ImportError:  # Windows
    _resource = None  # type: ignore[assignment]

_PR_SET_PDEATHSIG = 1
#: s between two looks at a parent process, and at a lock that another holds, where the system does not tell by itself.
_LOOK = 0.2
#: The signal that ends a process at once.
KILL: int = getattr(signal, "SIGKILL", signal.SIGTERM)
#: Flag of `os.open`: children that a process starts do not have the file (Windows: they never have).
NOT_FOR_CHILDREN: int = getattr(os, "O_CLOEXEC", 0)
_STILL_ACTIVE, _QUERY = 259, 0x1000  # Windows: exit code of a process that runs; the right to ask for it


# --- locks -----------------------------------------------------------------------------------------------------------
def lock(handle: int, wait: bool) -> None:
    """Locks the open file `handle` for this process alone, until it is closed or the process ends, however it ends.

    Raises BlockingIOError where another process has it and `wait` is false.
    """
    if _fcntl is not None:
        _fcntl.flock(handle, _fcntl.LOCK_EX | (0 if wait else _fcntl.LOCK_NB))
        return
    import msvcrt

    locking: Any = msvcrt.locking  # type: ignore[attr-defined]
    while True:
        try:
            os.lseek(handle, 0, os.SEEK_SET)
            locking(handle, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
            return
        except OSError as error:
            if not wait:
                raise BlockingIOError(error.errno, "another process has the lock") from error
            time.sleep(_LOOK)


# --- processes -------------------------------------------------------------------------------------------------------
def alive(process: int) -> bool:
    """Whether a process of this number exists on this machine."""
    if sys.platform == "win32":  # os.kill(number, 0) would end it
        kernel = ctypes.windll.kernel32
        handle = kernel.OpenProcess(_QUERY, False, process)
        if not handle:
            return False
        code = ctypes.c_ulong()
        kernel.GetExitCodeProcess(handle, ctypes.byref(code))
        kernel.CloseHandle(handle)
        return code.value == _STILL_ACTIVE
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def end_with(parent: int, number: int = signal.SIGTERM) -> None:
    """This process gets the signal `number` when its `parent` (a process id) ends, however that ends.

    Linux sees to that itself; elsewhere a thread looks every fifth of a second.
    """
    if sys.platform.startswith("linux"):
        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, int(number), 0, 0, 0)
    else:
        threading.Thread(target=_watch, args=(parent, int(number)), daemon=True).start()
    if os.getppid() != parent:  # it ended before we asked
        os.kill(os.getpid(), number)


def _watch(parent: int, number: int) -> None:
    while os.getppid() == parent and alive(parent):
        time.sleep(_LOOK)
    os.kill(os.getpid(), number)


def end_tree(process: subprocess.Popen[Any]) -> None:
    """Ends at once a process that was started with `start_new_session`, and what it has started (Windows: by its own
    `taskkill`)."""
    if hasattr(os, "killpg"):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, KILL)
        return
    import subprocess

    with contextlib.suppress(OSError):
        subprocess.run(["taskkill", "/F", "/T", "/PID", str(process.pid)], capture_output=True, check=False)
    with contextlib.suppress(OSError):
        process.kill()


# --- signals ---------------------------------------------------------------------------------------------------------
@contextlib.contextmanager
def shielded() -> Iterator[None]:
    """Processes started inside are not reached by ctrl-C while they load; ours comes through afterwards (where signals
    can be masked; elsewhere nothing is changed)."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


#: Whether something can be put off to a later time in the main thread.
TIMERS = hasattr(signal, "setitimer") and hasattr(signal, "SIGALRM")


class Later:
    """Calls `do` (number, frame) in the main thread some time after `ask`; where there are no `TIMERS`, never."""

    def __init__(self, do: Callable[[int, FrameType | None], None]) -> None:
        if TIMERS:
            signal.signal(signal.SIGALRM, do)

    def ask(self, seconds: float) -> None:
        """In so many seconds."""
        if TIMERS:
            signal.setitimer(signal.ITIMER_REAL, seconds)

    def forget(self) -> None:
        """What has not come yet comes no more."""
        self.ask(0.0)


# --- what there is ---------------------------------------------------------------------------------------------------
def cores() -> int:
    """Cores that this process may use (all, where a system cannot tell)."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def processor() -> str:
    """The processor's model name, or its architecture where the system does not tell."""
    with contextlib.suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines():
            name, _, value = line.partition(":")
            if name.strip() == "model name":
                return value.strip()
    import platform

    return platform.processor() or platform.machine()


def peak_memory() -> float:
    """The most memory that this process has had, MB; nan where the system does not tell (Windows)."""
    if _resource is None:
        return float("nan")
    peak = float(_resource.getrusage(_resource.RUSAGE_SELF).ru_maxrss)
    return peak / (1024.0**2 if sys.platform == "darwin" else 1024.0)  # macOS counts bytes, Linux kilobytes


def address_space() -> float:
    """Bytes of address space that this process may have; inf without a limit."""
    if _resource is None:
        return float("inf")
    limit, _ = _resource.getrlimit(_resource.RLIMIT_AS)
    return float("inf") if limit == _resource.RLIM_INFINITY else float(limit)
