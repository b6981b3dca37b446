"""The workers of a sweep: processes of this machine, or the processes of an mpirun, each with a process beside it.

A case runs in a worker process of its own making (start method "spawn", one thread), so that a solver that crashes
takes nothing with it: the worker is known by its pipe, its case is tried once more in a new one, and then recorded as
crashed. The processes of an mpirun only carry cases: each has such a worker, where no MPI is loaded (Debian's Ipopt
brings a dummy MPI of its own, and a shell run is a process that starts its own MPI).
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from multiprocessing.connection import Connection
from multiprocessing.connection import wait as wait_for
from typing import Any, Protocol

from compare.start import end_with, one_thread_each, shielded
from compare.sweep.case import Record, Task, crashed, run_case

#: Tries of a case whose worker dies.
TRIES = 2
#: Cases on their way to each process of an mpirun.
AHEAD = 2
_PATIENCE = 3.0  # s that a worker gets to end its children before it is killed
_LAUNCHERS = ("OMPI_", "PMIX_", "PMI_", "PRTE_", "MPIR_", "HYDRA_", "MPI_LOCALNRANKS", "MPI_LOCALRANKID")


class Crew(Protocol):
    """Whoever runs cases: yields (index of the task, record) as they end, in any order; the record names its worker."""

    size: int

    def run(self, tasks: Sequence[Task]) -> Iterator[tuple[int, Record]]:
        """Runs all tasks."""


def usable_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0))


class Died(Exception):
    """A worker ended without a record."""


def _serve(pipe: Connection, launched: bool, master: int) -> None:
    """The worker process: cases in, records out, until the pipe closes or the `master` (its process id) ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the master says when to stop
    signal.signal(signal.SIGTERM, _stop)
    end_with(master, signal.SIGKILL)  # at once, whatever is being compiled; what runs for this process ends with it
    if launched:
        for name in [name for name in os.environ if name.startswith(_LAUNCHERS)]:
            del os.environ[name]
    with contextlib.suppress(EOFError, OSError, KeyboardInterrupt):
        while True:
            pipe.send(run_case(pipe.recv()))


def _stop(*_: object) -> None:
    """SIGTERM ends the worker by an exception, so that a shell's process that runs for it is ended too."""
    raise SystemExit(1)


class Worker:
    """A process that runs one case at a time."""

    def __init__(self, launched: bool = False) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs, launched, os.getpid()), daemon=False)
        with shielded():
            self.process.start()
        theirs.close()
        self.busy: int | None = None

    def give(self, index: int, task: Task) -> None:
        """Sends a case; a worker that is already dead is found out by `take`."""
        self.busy = index
        with contextlib.suppress(OSError):
            self.pipe.send(task)

    def take(self) -> Record:
        """The record of the case that was given; `Died` when the process ended instead."""
        self.busy = None
        try:
            return self.pipe.recv()  # type: ignore[no-any-return]
        except (EOFError, OSError):
            self.process.join(_PATIENCE)
            raise Died(_ending(self.process.exitcode)) from None

    def end(self) -> None:
        """Ends the process and what it started."""
        self.pipe.close()
        if self.busy is not None and self.process.is_alive():
            self.process.terminate()
        self.process.join(_PATIENCE)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()


def _ending(code: int | None) -> str:
    if code is not None and code < 0:
        with contextlib.suppress(ValueError):
            return f"the worker process was killed by {signal.Signals(-code).name}"
    return f"the worker process ended with code {code}"


class LocalCrew:
    """Worker processes on this machine."""

    def __init__(self, size: int) -> None:
        self.size = size

    def run(self, tasks: Sequence[Task]) -> Iterator[tuple[int, Record]]:
        """Runs all tasks; a worker that dies is replaced."""
        one_thread_each()
        waiting = list(range(len(tasks)))[::-1]
        tries = [0] * len(tasks)
        crew: dict[int, Worker] = {}
        try:
            for number in range(min(self.size, len(tasks))):
                crew[number] = Worker()
                self._next(crew[number], waiting, tasks)
            while any(worker.busy is not None for worker in crew.values()):
                ready = wait_for([worker.pipe for worker in crew.values() if worker.busy is not None])
                for number, worker in list(crew.items()):
                    index = worker.busy
                    if worker.pipe not in ready or index is None:
                        continue
                    try:
                        record = worker.take()
                    except Died as death:
                        worker.end()
                        crew[number] = worker = Worker()
                        tries[index] += 1
                        if tries[index] < TRIES:
                            waiting.append(index)
                            self._next(worker, waiting, tasks)
                            continue
                        record = crashed(f"{death}, {TRIES} times")
                    self._next(worker, waiting, tasks)
                    yield index, {**record, "worker": number}
        finally:
            for worker in crew.values():
                worker.pipe.close() if worker.busy is None else worker.process.terminate()
            for worker in crew.values():
                worker.end()

    @staticmethod
    def _next(worker: Worker, waiting: list[int], tasks: Sequence[Task]) -> None:
        if waiting:
            index = waiting.pop()
            worker.give(index, tasks[index])


_BESIDE: list[Worker] = []
"""The worker beside this process of an mpirun."""


def run_beside(task: Task) -> Record:
    """Runs a case in the worker beside this process, which is made when absent or dead."""
    from compare.store.world import placed

    one_thread_each()
    death = ""
    for _ in range(TRIES):
        if not _BESIDE:
            _BESIDE.append(Worker(launched=True))
        _BESIDE[0].give(0, task)
        try:
            return {**_BESIDE[0].take(), "worker": placed()[0]}
        except Died as died:
            death = str(died)
            _BESIDE.pop().end()
    return {**crashed(f"{death}, {TRIES} times"), "worker": placed()[0]}


def end_beside() -> None:
    """Ends the worker beside this process."""
    while _BESIDE:
        _BESIDE.pop().end()


class ClusterCrew:
    """The other processes of an mpirun, through mpi4py.futures; the first one hands out the cases."""

    def __init__(self, executor: Executor, size: int) -> None:
        self.executor = executor
        self.size = size

    def run(self, tasks: Sequence[Task]) -> Iterator[tuple[int, Record]]:
        """Runs all tasks."""
        waiting = list(range(len(tasks)))[::-1]
        flying: dict[Future[Any], int] = {}
        try:
            while flying or waiting:
                while waiting and len(flying) < AHEAD * self.size:
                    index = waiting.pop()
                    flying[self.executor.submit(run_beside, tasks[index])] = index
                for future in wait(flying, return_when=FIRST_COMPLETED).done:
                    yield flying.pop(future), future.result()
        finally:
            for future in flying:
                future.cancel()
