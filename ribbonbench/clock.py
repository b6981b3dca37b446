"""The time that a solve may take, looked at wherever steps are made: between iterations, attempts, refinements.

It is that of the thread on the processor, so that a busy machine shortens nothing. This is ground that the solvers
share: no mechanics and no numerics.
"""

from __future__ import annotations

import contextlib
import math
import threading
import time
from collections.abc import Callable, Iterator
from contextvars import ContextVar

SPENT = "the budget of time is spent"

#: Each gives time (s) of this process that counts for no solve: kernels that are compiled, once after an installation.
UNCOUNTED: list[Callable[[], float]] = []
#: Each is told when the compilation of a kernel begins in this process (`ribbonbench.kernel_cache`).
COMPILING: list[Callable[[], object]] = []
_deadline: ContextVar[float] = ContextVar("deadline", default=math.inf)
#: Time (s) on the clock of the wall for which a look at the thread's is not repeated: that one asks the system, which
#: took a tenth of a sweep's case where it was profiled.
_COARSE = 0.01


class _Looked(threading.local):
    """When (s) a thread's clock was looked at last, on the wall, and what it told."""

    at = -math.inf, 0.0


_looked = _Looked()


def _now() -> float:
    return time.thread_time() - _uncounted()


def _uncounted() -> float:
    return sum(seconds() for seconds in UNCOUNTED)


def _at_most_now() -> float:
    """At least `_now`, and by no more than `_COARSE`: a thread is never longer on the processor than time has gone."""
    wall = time.perf_counter()
    looked, there = _looked.at
    if not 0.0 <= wall - looked < _COARSE:
        looked, there = _looked.at = (wall, time.thread_time())
    return float(there + (wall - looked) - _uncounted())


@contextlib.contextmanager
def within(seconds: float | None) -> Iterator[None]:
    """What is solved inside has this much time (s > 0), and no more than what is around it; None: as much as that."""
    left = _deadline.get() if seconds is None else min(_deadline.get(), _begun(seconds) + seconds)
    token = _deadline.set(left)
    try:
        yield
    finally:
        _deadline.reset(token)


def spent() -> bool:
    """Whether the time is over."""
    deadline = _deadline.get()
    return deadline < math.inf and _at_most_now() > deadline and _now() > deadline


def _begun(seconds: float) -> float:
    """When a budget begins; a small one to the digit."""
    return _at_most_now() if seconds > 100.0 * _COARSE else _now()
