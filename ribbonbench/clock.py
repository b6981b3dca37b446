"""The time that a solve may take, looked at wherever steps are made: between iterations, attempts, refinements.

It is that of the thread on the processor, so that a busy machine shortens nothing. This is ground that the solvers
share: no mechanics and no numerics.
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterator
from contextvars import ContextVar

SPENT = "the budget of time is spent"

#: Each gives time (s) of this process that counts for no solve: kernels that are compiled, once after an installation.
UNCOUNTED: list[Callable[[], float]] = []
_deadline: ContextVar[float] = ContextVar("deadline", default=math.inf)


def _now() -> float:
    return time.thread_time() - sum(seconds() for seconds in UNCOUNTED)


@contextlib.contextmanager
def within(seconds: float | None) -> Iterator[None]:
    """What is solved inside has this much time (s > 0), and no more than what is around it; None: as much as that."""
    left = _deadline.get() if seconds is None else min(_deadline.get(), _now() + seconds)
    token = _deadline.set(left)
    try:
        yield
    finally:
        _deadline.reset(token)


def spent() -> bool:
    """Whether the time is over."""
    deadline = _deadline.get()
    return deadline < math.inf and _now() > deadline
