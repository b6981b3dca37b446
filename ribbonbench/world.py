"""All processes of an `mpirun` as one: what the first does is known to all, errors included."""

from __future__ import annotations

import contextlib
import os
import sys
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

from ribbonbench.errors import Missing

T = TypeVar("T")

#: (rank, size) as the launchers tell them: Open MPI, MPICH and Intel MPI.
_LAUNCHERS = (("OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"), ("PMI_RANK", "PMI_SIZE"))


#: Where mpi4py keeps the pool of `python -m mpi4py.futures`, in its versions 3 and 4.
_POOLS = ("mpi4py.futures._lib", "mpi4py.futures._core")


def pooled() -> bool:
    """Whether this process was begun by `python -m mpi4py.futures`, whose other processes wait for what it gives them.

    It stands alone, then: what it asks of the others goes through `mpi4py.futures.MPIPoolExecutor`.
    """
    return any(name in sys.modules and vars(sys.modules[name]).get("SharedPool") is not None for name in _POOLS)


def placed() -> tuple[int, int]:
    """(rank, size) of this process in its mpirun, from the environment; (0, 1) outside, and for the process that leads
    a pool (`pooled`)."""
    if pooled():
        return 0, 1
    for rank, size in _LAUNCHERS:
        with contextlib.suppress(KeyError, ValueError):
            return int(os.environ[rank]), int(os.environ[size])
    return 0, 1


@dataclass(frozen=True)
class World:
    """The processes of this run; `comm` is mpi4py's, None for a single one."""

    rank: int
    size: int
    comm: Any = None

    @property
    def first(self) -> bool:
        """True on the process that speaks and writes."""
        return self.rank == 0

    def on_first(self, do: Callable[[], T]) -> T:
        """What `do` returns, or raises, on the first process; on all of them."""
        if self.comm is None:
            return do()
        found: tuple[T | None, Exception | None] = (None, None)
        if self.first:
            try:
                found = (do(), None)
            except Exception as raised:
                found = (None, raised)
        value, error = self.comm.bcast(found, root=0)
        if error is not None:
            raise error
        return value  # type: ignore[no-any-return]

    def together(self) -> None:
        """Waits for all processes: the first one to end would end the others."""
        if self.comm is not None:
            self.comm.barrier()


def world() -> World:
    """This run's processes."""
    rank, size = placed()
    if size == 1:
        return World(0, 1)
    try:
        from mpi4py import MPI
    except ImportError as error:
        raise Missing(
            f"mpi4py ({error})", "sudo apt-get install --no-install-recommends python3-mpi4py; make setup"
        ) from None
    if MPI.COMM_WORLD.size != size:
        raise Missing("an mpirun of the same MPI as mpi4py's", f"use that of {MPI.Get_library_version().split(',')[0]}")
    return World(rank, size, MPI.COMM_WORLD)


@contextlib.contextmanager
def quiet_but_first() -> Iterator[None]:
    """Only the first process speaks; an error of one process that is none of the user's ends all of them."""
    rank, size = placed()
    if size == 1:
        yield
        return
    spoken = sys.stdout, sys.stderr
    with open(os.devnull, "w") as silence:
        if rank:
            sys.stdout = sys.stderr = silence
        try:
            yield
        except (SystemExit, KeyboardInterrupt):
            raise
        except BaseException:
            traceback.print_exc(file=spoken[1])
            spoken[1].flush()
            world().comm.Abort(1)
        finally:
            sys.stdout, sys.stderr = spoken
