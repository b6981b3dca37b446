"""The workers of a sweep: processes of this machine, or the processes of an mpirun, each with a process beside it.

A case runs in a worker process of its own making (start method "spawn", one thread), so that a solver that crashes
takes nothing with it: the worker is known by its pipe, its case is tried once more in a new one, and then recorded as
crashed. Light cases go in slices (`compare.sweep.case.run_cases`); those of a slice whose worker dies go alone. The
processes of an mpirun only carry cases: each has such a worker, where no MPI is loaded (Debian's Ipopt brings a dummy
MPI of its own, and a shell run is a process that starts its own MPI).
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from dataclasses import replace
from multiprocessing.connection import Connection
from multiprocessing.connection import wait as wait_for
from typing import Any, Protocol

from compare.sweep.case import COMPARE, Record, Task, crashed, run_case, run_cases
from ribbonbench.start import end_with, one_thread_each, shielded

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
            pipe.send(_records(pipe.recv()))


def _records(tasks: Sequence[Task]) -> list[Record]:
    """The records of the tasks that a worker gets at once."""
    if tasks[0].solver != COMPARE:
        return run_cases(tasks)
    from compare.sweep.pair import compared

    return [run_case(task, compared) for task in tasks]


def _stop(*_: object) -> None:
    """SIGTERM ends the worker by an exception, so that a shell's process that runs for it is ended too."""
    raise SystemExit(1)


#: Indices of the tasks that a worker gets at once.
Job = tuple[int, ...]


def jobs_of(tasks: Sequence[Task]) -> list[Job]:
    """The slices of the tasks, and each of the others alone, in their order."""
    found: dict[tuple[str, int], list[int]] = {}
    for index, task in enumerate(tasks):
        key = ("case", index) if task.slice is None else ("slice", task.slice)
        found.setdefault(key, []).append(index)
    return [tuple(job) for job in found.values()]


class Worker:
    """A process that runs one case, or one slice of them, at a time."""

    def __init__(self, launched: bool = False) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs, launched, os.getpid()), daemon=False)
        with shielded():
            self.process.start()
        theirs.close()
        self.busy: Job | None = None

    def give(self, job: Job, tasks: Sequence[Task]) -> None:
        """Sends the cases of a job; a worker that is already dead is found out by `take`."""
        self.busy = job
        with contextlib.suppress(OSError):
            self.pipe.send(tasks)

    def take(self) -> list[Record]:
        """The records of the cases that were given; `Died` when the process ended instead."""
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
        tasks = list(tasks)
        waiting = jobs_of(tasks)[::-1]
        tries = [0] * len(tasks)
        crew: dict[int, Worker] = {}
        try:
            for number in range(min(self.size, len(waiting))):
                crew[number] = Worker()
                self._next(crew[number], waiting, tasks)
            while any(worker.busy is not None for worker in crew.values()):
                ready = wait_for([worker.pipe for worker in crew.values() if worker.busy is not None])
                for number, worker in list(crew.items()):
                    job = worker.busy
                    if worker.pipe not in ready or job is None:
                        continue
                    try:
                        records = worker.take()
                    except Died as death:
                        worker.end()
                        crew[number] = worker = Worker()
                        records = []
                        for index in reversed(job):
                            if tasks[index].slice is not None:
                                tasks[index] = replace(tasks[index], slice=None)
                            else:
                                tries[index] += 1
                            if tries[index] < TRIES:
                                waiting.append((index,))
                            else:
                                records.append(crashed(f"{death}, {TRIES} times"))
                    self._next(worker, waiting, tasks)
                    for index, record in zip(job, records, strict=bool(records)):
                        yield index, {**record, "worker": number}
        finally:
            for worker in crew.values():
                worker.pipe.close() if worker.busy is None else worker.process.terminate()
            for worker in crew.values():
                worker.end()

    @staticmethod
    def _next(worker: Worker, waiting: list[Job], tasks: Sequence[Task]) -> None:
        if waiting:
            job = waiting.pop()
            worker.give(job, [tasks[index] for index in job])


_BESIDE: list[Worker] = []
"""The worker beside this process of an mpirun."""


def run_reference(tasks: Sequence[Task]) -> list[Record]:
    """Runs cases in the worker beside this process, which is made when absent or dead."""
    from compare.store.world import placed

    one_thread_each()
    alone = tasks[0].slice is None
    death = ""
    for _ in range(TRIES if alone else 1):
        if not _BESIDE:
            _BESIDE.append(Worker(launched=True))
        _BESIDE[0].give(tuple(range(len(tasks))), tasks)
        try:
            return [{**record, "worker": placed()[0]} for record in _BESIDE[0].take()]
        except Died as died:
            death = str(died)
            _BESIDE.pop().end()
    if not alone:
        return [record for task in tasks for record in run_reference([replace(task, slice=None)])]
    return [{**crashed(f"{death}, {TRIES} times"), "worker": placed()[0]}]


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
        waiting = jobs_of(tasks)[::-1]
        flying: dict[Future[Any], Job] = {}
        try:
            while flying or waiting:
                while waiting and len(flying) < AHEAD * self.size:
                    job = waiting.pop()
                    flying[self.executor.submit(run_reference, [tasks[index] for index in job])] = job
                for future in wait(flying, return_when=FIRST_COMPLETED).done:
                    yield from zip(flying.pop(future), future.result(), strict=True)
        finally:
            for future in flying:
                future.cancel()
