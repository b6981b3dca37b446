"""Before anything heavy is loaded: one thread for linear algebra, and what ctrl-C and SIGTERM do to a command.

Both signals end a command by an exception, so that finished work is kept and processes that work for it are ended: one
line on stderr, exit code 130 after ctrl-C, 143 after SIGTERM. An exception inside an import leaves modules half made
and can be taken for a missing library, one inside the loading of a kernel leaves that without its code (a call back of
LLVM's that fails, and an access to address 0), so that a signal is put off until these are over. Only the standard
library is imported here.
"""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import errno
import gc
import os
import signal
import sys
import threading
from collections.abc import Callable
from types import FrameType
from typing import Any, NoReturn

from ribbonbench import system
from ribbonbench.system import end_with as end_with
from ribbonbench.system import shielded as shielded

#: 128 + the number of the signal, as a shell says it.
INTERRUPTED = 128 + signal.SIGINT
TERMINATED = 128 + signal.SIGTERM

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_AGAIN = 0.02  # s until a signal that came inside what is whole is tried again
#: How the files end whose functions no exception may leave in the middle.
_WHOLE = ("<frozen importlib._bootstrap>", os.path.join("llvmlite", "binding", "executionengine.py"))

#: Variables that limit threads; the first one is looked at by all but numba.
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")

#: Exit code of a command that memory does not suffice for (something is missing on this machine).
NO_MEMORY = 3
_NO_MEMORY = (
    "ribbonbench: out of memory: what is finished (cases, steps of a path) is kept; the same command goes on where it "
    "has more (ulimit -v, a smaller model.elements or shell.elements, fewer --workers)"
)
#: What the dynamic loader says where there is no memory for a library.
_LOADER = ("failed to map segment", "cannot allocate memory", "cannot enable executable stack")


class Terminated(KeyboardInterrupt):
    """SIGTERM: whatever is cleaned up after ctrl-C is cleaned up after this too."""


def one_thread() -> None:
    """One thread for BLAS and OpenMP, which read this when they are loaded; what the user has set stays.

    The matrices are small: threads only wait for each other, and on a busy machine for long (docs/decisions.md).
    OpenBLAS and MKL look at OMP_NUM_THREADS where their own variable is not set. `ribbonbench.threads` holds a
    solve to one thread in programs that have loaded them already.
    """
    os.environ.setdefault(THREADS[0], "1")


def one_thread_each() -> None:
    """One thread in this process's children, whatever this process has: as many of them as cores are at work."""
    for name in THREADS:
        os.environ.setdefault(name, "1")


def said(stop: KeyboardInterrupt) -> int:
    """Says that a command was interrupted; returns its exit code."""
    terminated = isinstance(stop, Terminated)
    word = "terminated" if terminated else "interrupted"
    with contextlib.suppress(OSError, ValueError):
        print(
            f"ribbonbench: {word}; what is finished (cases, steps of a path) is kept, the same command goes on",
            file=sys.stderr,
            flush=True,
        )
    return TERMINATED if terminated else INTERRUPTED


class Signals:
    """SIGINT and SIGTERM as exceptions of the main thread; ignored ones (nohup) stay ignored.

    seen: the exception of the first signal that came, None: none did.
    """

    def __init__(self) -> None:
        self.seen: KeyboardInterrupt | None = None
        self._hook = sys.unraisablehook

    def __enter__(self) -> Signals:
        self._taken = [number for number in _SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]
        for number in self._taken:
            signal.signal(number, self._come)
        self._again = system.Later(self._later)
        sys.unraisablehook = self._unraisable
        return self

    def __exit__(self, *_: object) -> None:
        """What is left to do is the interpreter's end: a signal ends that at once, without a trace."""
        self._again.forget()
        for number in self._taken:
            signal.signal(number, signal.SIG_DFL)

    def _come(self, number: int, frame: FrameType | None) -> None:
        first, self.seen = self.seen is None, Terminated() if number == signal.SIGTERM else KeyboardInterrupt()
        if first and whole(frame) and system.TIMERS:
            self._again.ask(_AGAIN)
            return
        raise self.seen

    def _later(self, _number: int, frame: FrameType | None) -> None:
        if whole(frame):
            self._again.ask(_AGAIN)
        elif self.seen is not None:
            raise self.seen

    def _unraisable(self, found: Any) -> None:
        """Raised where no exception can leave (a weak reference's callback, a finaliser): it is raised once more."""
        if isinstance(found.exc_value, KeyboardInterrupt) and system.TIMERS:
            self._again.ask(_AGAIN)
        else:
            self._hook(found)


def whole(frame: FrameType | None) -> bool:
    """Whether a module is imported or a kernel loaded in this frame or in one that called it."""
    while frame is not None:
        if frame.f_code.co_filename.endswith(_WHOLE):
            return True
        frame = frame.f_back
    return False


def behind(error: BaseException) -> KeyboardInterrupt | None:
    """The signal in whose wake `error` was raised (a file that a clean-up did not find any more); None: it has none."""
    found: BaseException | None = error
    seen: set[int] = set()
    while found is not None and id(found) not in seen:
        if isinstance(found, KeyboardInterrupt):
            return found
        seen.add(id(found))
        found = found.__cause__ or found.__context__
    return None


def run(command: Callable[[], int]) -> int:
    """The exit code of a whole process that runs `command`, interrupted or not."""
    one_thread()
    signals = Signals()
    try:
        with signals:
            try:
                if not _room():
                    raise MemoryError
                return command()
            except Exception as error:
                if signals.seen is not None:
                    raise signals.seen from error  # what goes wrong after a signal is its doing
                if not out_of_memory(error):
                    raise
                print(_NO_MEMORY, file=sys.stderr, flush=True)
                return NO_MEMORY
    except KeyboardInterrupt as stop:
        return said(stop)


#: Objects made and not yet let go until Python looks for circles among them: its own 700 are passed some 400 times
#: while libraries are loaded, and next to nothing is found (arrays are let go at once, not in circles).
SELDOM = 50_000
#: How libraries are called (of MPI, PETSc, SLEPc) that end something only where the interpreter is taken apart.
_ENDING = "4py"


def command(run_it: Callable[[], int]) -> NoReturn:
    """A process that is one command and no more: its code is that of `run_it`, and it is not taken apart at the end."""
    _COMMAND.append(True)
    gc.set_threshold(SELDOM, *gc.get_threshold()[1:])
    leave(run_it())


def is_command() -> bool:
    """Whether this process is one command and no more."""
    return bool(_COMMAND)


_COMMAND: list[bool] = []


def leave(code: int) -> NoReturn:
    """Ends the process: threads are waited for, exit handlers called, what is written written; but modules and objects
    are not let go one by one, which takes longer than a solve, for memory that goes back as a whole.

    As usual where somebody looks on (a profiler, a debugger, `python -i`) or a library ends something of its own.
    """
    of_threads: Any = threading  # what Python itself calls there has no public name
    of_handlers: Any = atexit
    try:
        ends = (of_threads._shutdown, of_handlers._run_exitfuncs)
    except AttributeError:
        sys.exit(code)
    watched = sys.gettrace() is not None or sys.getprofile() is not None or sys.flags.inspect
    ending = any(name.partition(".")[0].endswith(_ENDING) for name in sys.modules)
    if watched or ending or os.environ.get("PYTHONINSPECT"):
        sys.exit(code)
    for end in ends:
        end()
    try:
        sys.stdout.flush()
        sys.stderr.flush()
        ctypes.CDLL(None).fflush(None)  # what libraries in C have said
    except (OSError, ValueError, AttributeError, TypeError):  # a closed pipe, no stream: as Python does
        sys.exit(code)
    os._exit(code)


def out_of_memory(error: BaseException) -> bool:
    """Whether memory that was not to be had is in `error` or behind it, also for a library that could not be loaded."""
    seen: set[int] = set()
    found: BaseException | None = error
    while found is not None and id(found) not in seen:
        seen.add(id(found))
        if isinstance(found, MemoryError) or (isinstance(found, OSError) and found.errno == errno.ENOMEM):
            return True
        if isinstance(found, ImportError | OSError) and any(words in str(found).lower() for words in _LOADER):
            return True
        found = found.__cause__ or found.__context__
    return False


#: Bytes of address space below which nothing is begun: OpenBLAS asks again and again, for ever, for what it cannot get
#: (seen at 400 MB; with 500 MB libraries cannot be loaded, with 600 MB a scene is solved).
LEAST_MEMORY = 550_000_000


def _room() -> bool:
    """Whether this process may have the least address space that the libraries need."""
    return system.address_space() >= LEAST_MEMORY


def main(arguments: list[str]) -> None:
    """`python -m ribbonbench.start PARENT MODULE ...`: runs it as `python -m` does, for as long as PARENT lives."""
    import runpy

    end_with(int(arguments[0]))
    sys.argv = arguments[1:]
    runpy.run_module(arguments[1], run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main(sys.argv[1:])
