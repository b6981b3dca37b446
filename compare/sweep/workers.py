"""The workers of a sweep: processes of this machine, or the processes of an mpirun, each with a process beside it.

A case runs in a worker process of its own making (start method "spawn", one thread), so that a solver that crashes
takes nothing with it: the worker is known by its pipe, its case is tried once more in a new one, and then recorded as
crashed. Light cases go in slices (`compare.sweep.case.run_cases`); those of a slice whose worker dies go alone. The
processes of an mpirun only carry cases: each has such a worker, where no MPI is loaded (Debian's Ipopt brings a dummy
MPI of its own, and a shell run is a process that starts its own MPI).
"""

from __future__ import annotations

import atexit
import contextlib
import multiprocessing
import os
import signal
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from dataclasses import dataclass, replace
from enum import Enum
from multiprocessing.connection import Connection
from multiprocessing.connection import wait as wait_for
from typing import Any, Protocol

from compare.sweep.case import COMPARE, Record, Task, crashed, run_case, run_cases
from ribbonbench import clock
from ribbonbench.start import Signals, end_with, one_thread_each, shielded

#: Tries of a case whose worker dies.
TRIES = 2
#: Cases on their way to each process of an mpirun.
AHEAD = 2
_PATIENCE = 3.0  # s that a worker gets to end its children before it is killed
_LAUNCHERS = ("OMPI_", "PMIX_", "PMI_", "PRTE_", "MPIR_", "HYDRA_", "MPI_LOCALNRANKS", "MPI_LOCALRANKID")


class Job(Protocol):
    """What a worker gets at once."""

    def work(self) -> Any:
        """What comes of it, made in the worker."""

    def apart(self) -> Sequence[Job]:
        """What it is made of, each to go alone after a worker died of it; nothing where it is one case."""

    def died(self, why: str) -> Any:
        """What comes of it where its worker dies again and again."""


class Word(Enum):
    """What a worker says before what comes of its job."""

    COMPILING = "kernels are being compiled for it"


@dataclass(frozen=True)
class Ended:
    """A job that ended: what came of it, the number of its worker, and whether kernels were compiled for it."""

    job: Job
    outcome: Any
    worker: int
    compiled: bool = False


def unheard(begins: bool) -> None:
    """Nobody is told that kernels are compiled."""


class Crew(Protocol):
    """Whoever runs cases. `flow` takes jobs when somebody has time for them, and yields them as they end, in any order;
    `run` yields (index of the task, record) likewise; the record names its worker. compiles: is told True when kernels
    begin to be compiled for a job, False when what came of that job has been taken."""

    size: int
    compiles: Callable[[bool], object]

    def flow(self, jobs: Iterable[Job]) -> Iterator[Ended]:
        """Runs all jobs."""

    def run(self, tasks: Sequence[Task]) -> Iterator[tuple[int, Record]]:
        """Runs all tasks."""


@dataclass(frozen=True)
class Cases:
    """Tasks that a worker gets at once, with their indices; what comes of them are their records."""

    indices: tuple[int, ...]
    tasks: tuple[Task, ...]

    def work(self) -> list[Record]:
        """The records."""
        if self.tasks[0].solver != COMPARE:
            return run_cases(self.tasks)
        from compare.sweep.pair import compared

        return [run_case(task, compared) for task in self.tasks]

    def apart(self) -> list[Cases]:
        """The cases of a slice, one by one."""
        if self.tasks[0].slice is None:
            return []
        return [
            Cases((index,), (replace(task, slice=None),)) for index, task in zip(self.indices, self.tasks, strict=True)
        ]

    def died(self, why: str) -> list[Record]:
        """Records of a crash."""
        return [crashed(why) for _ in self.tasks]


class TaskCrew(ABC):
    """A crew whose `run` goes through its `flow`."""

    size: int
    compiles: Callable[[bool], object] = staticmethod(unheard)

    @abstractmethod
    def flow(self, jobs: Iterable[Job]) -> Iterator[Ended]:
        """As of `Crew`."""

    def run(self, tasks: Sequence[Task]) -> Iterator[tuple[int, Record]]:
        """Runs all tasks."""
        jobs = [Cases(job, tuple(tasks[index] for index in job)) for job in jobs_of(tasks)]
        with contextlib.closing(self.flow(jobs)) as ends:  # type: ignore[type-var]
            for end in ends:
                assert isinstance(end.job, Cases)
                for index, record in zip(end.job.indices, end.outcome, strict=True):
                    yield index, {**record, "worker": end.worker}


class Died(Exception):
    """A worker ended without a record."""


def _serve(pipe: Connection, launched: bool, master: int) -> None:
    """The worker process: cases in, records out, until the pipe closes or the `master` (its process id) ends.

    SIGTERM ends it by an exception, so that a shell's process that runs for it is ended too.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the master says when to stop
    end_with(master, signal.SIGKILL)  # at once, whatever is being compiled; what runs for this process ends with it
    if launched:
        for name in [name for name in os.environ if name.startswith(_LAUNCHERS)]:
            del os.environ[name]
    # outside the signals: one may come while they are given back
    with contextlib.suppress(EOFError, OSError, KeyboardInterrupt), Signals() as signals:
        while True:
            job = pipe.recv()
            with _saying(pipe):
                found = job.work()
            pipe.send(found)
    if signals.seen is not None:
        raise SystemExit(1)


@contextlib.contextmanager
def _saying(pipe: Connection) -> Iterator[None]:
    """Inside, the first kernel that is compiled is told through the pipe."""

    def tell() -> None:
        clock.COMPILING.remove(tell)
        pipe.send(Word.COMPILING)

    clock.COMPILING.append(tell)
    try:
        yield
    finally:
        if tell in clock.COMPILING:
            clock.COMPILING.remove(tell)


def jobs_of(tasks: Sequence[Task]) -> list[tuple[int, ...]]:
    """The indices of the slices of the tasks, and of each of the others alone, in their order."""
    found: dict[tuple[str, int], list[int]] = {}
    for index, task in enumerate(tasks):
        key = ("case", index) if task.slice is None else ("slice", task.slice)
        found.setdefault(key, []).append(index)
    return [tuple(job) for job in found.values()]


class Worker:
    """A process that runs one job at a time."""

    def __init__(self, launched: bool = False) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs, launched, os.getpid()), daemon=False)
        with shielded():
            self.process.start()
        theirs.close()
        self.busy: Job | None = None
        self.compiled = False

    def give(self, job: Job) -> None:
        """Sends a job; a worker that is already dead is found out by `take`."""
        self.busy, self.compiled = job, False
        with contextlib.suppress(OSError):
            self.pipe.send(job)

    def take(self) -> Any:
        """What came of the job, or a `Word` while it goes on; `Died` when the process ended instead."""
        job, self.busy = self.busy, None
        try:
            found = self.pipe.recv()
        except (EOFError, OSError):
            self.process.join(_PATIENCE)
            raise Died(_ending(self.process.exitcode)) from None
        if isinstance(found, Word):
            self.busy, self.compiled = job, True
        return found

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


class LocalCrew(TaskCrew):
    """Worker processes on this machine."""

    def __init__(self, size: int) -> None:
        self.size = size

    def flow(self, jobs: Iterable[Job]) -> Iterator[Ended]:
        """Runs all jobs; a worker that dies is replaced."""
        one_thread_each()
        coming = iter(jobs)
        again: deque[tuple[Job, int]] = deque()  # with the tries that it has had
        tries: dict[int, int] = {}  # of what each worker has in hand
        crew: dict[int, Worker] = {}

        def hand(number: int) -> bool:
            """Gives a worker something to do, where there is something."""
            found = again.popleft() if again else (next(coming, None), 0)
            if found[0] is None:
                return False
            if number not in crew:
                crew[number] = Worker()
            tries[number] = found[1]
            crew[number].give(found[0])
            return True

        try:
            for number in range(self.size):
                if not hand(number):
                    break
            while any(worker.busy is not None for worker in crew.values()):
                ready = wait_for([worker.pipe for worker in crew.values() if worker.busy is not None])
                for number, worker in list(crew.items()):
                    job = worker.busy
                    if worker.pipe not in ready or job is None:
                        continue
                    ended: Ended | None = None
                    try:
                        found = worker.take()
                        if isinstance(found, Word):
                            self.compiles(True)
                            continue
                        ended = Ended(job, found, number, worker.compiled)
                    except Died as death:
                        worker.end()
                        del crew[number]
                        parts = job.apart()
                        if parts:
                            again.extendleft((part, 0) for part in reversed(parts))
                        elif tries[number] + 1 < TRIES:
                            again.appendleft((job, tries[number] + 1))
                        else:
                            ended = Ended(job, job.died(f"{death}, {TRIES} times"), number)
                    compiled = worker.compiled
                    hand(number)
                    if ended is not None:
                        yield ended
                    if compiled:
                        self.compiles(False)
        finally:
            for worker in crew.values():
                worker.pipe.close() if worker.busy is None else worker.process.terminate()
            for worker in crew.values():
                worker.end()


_BESIDE: list[Worker] = []
"""The worker beside this process of an mpirun."""


def run_beside(job: Job) -> list[Ended]:
    """Runs a job in the worker beside this process, which is made when absent or dead; its parts where that dies."""
    from ribbonbench.world import placed

    one_thread_each()
    parts = job.apart()
    death = ""
    for _ in range(1 if parts else TRIES):
        if not _BESIDE:
            atexit.register(end_beside)  # before the interpreter waits for its children
            _BESIDE.append(Worker(launched=True))
        _BESIDE[0].give(job)
        try:
            while isinstance(found := _BESIDE[0].take(), Word):
                pass
            return [Ended(job, found, placed()[0], _BESIDE[0].compiled)]
        except Died as died:
            death = str(died)
            _BESIDE.pop().end()
    if parts:
        return [end for part in parts for end in run_beside(part)]
    return [Ended(job, job.died(f"{death}, {TRIES} times"), placed()[0])]


def end_beside() -> None:
    """Ends the worker beside this process."""
    while _BESIDE:
        _BESIDE.pop().end()


class ClusterCrew(TaskCrew):
    """The other processes of an mpirun, through mpi4py.futures; the first one hands out the jobs."""

    def __init__(self, executor: Executor, size: int) -> None:
        self.executor = executor
        self.size = size

    def flow(self, jobs: Iterable[Job]) -> Iterator[Ended]:
        """Runs all jobs."""
        coming = iter(jobs)
        flying: set[Future[list[Ended]]] = set()
        try:
            while True:
                while len(flying) < AHEAD * self.size and (job := next(coming, None)) is not None:
                    flying.add(self.executor.submit(run_beside, job))
                if not flying:
                    return
                for future in wait(flying, return_when=FIRST_COMPLETED).done:
                    flying.remove(future)
                    found = future.result()
                    yield from found
                    if any(end.compiled for end in found):
                        self.compiles(False)
        finally:
            for future in flying:
                future.cancel()
