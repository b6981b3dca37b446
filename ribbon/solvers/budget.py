"""A budget of time for a solve, looked at wherever time is spent: between iterations, attempts, refinements, searches.

The time is that of the thread on the processor, so that a busy machine shortens nothing; compiling kernels, once after
an installation, does not count.
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Iterator
from contextvars import ContextVar
from typing import Any

from numba.core import event

from ribbon.errors import RibbonInputError

SPENT = "the budget of time is spent"


class _Compiling(event.Listener):  # type: ignore[misc]
    """Time (s) that this process has spent in compiling, and in making ready for it."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self._depth, self._begun = 0, 0.0

    def on_start(self, event: Any) -> None:
        if self._depth == 0:
            self._begun = time.thread_time()
        self._depth += 1

    def on_end(self, event: Any) -> None:
        self._depth = max(0, self._depth - 1)
        if self._depth == 0:
            self.seconds += max(0.0, time.thread_time() - self._begun)


_compiling = _Compiling()
event.register("numba:compiler_lock", _compiling)  # held while kernels are compiled, and while kept ones are loaded
_deadline: ContextVar[float] = ContextVar("deadline", default=math.inf)


def _now() -> float:
    return time.thread_time() - _compiling.seconds


@contextlib.contextmanager
def within(seconds: float | None) -> Iterator[None]:
    """What is solved inside has this much time (s), and no more than what is around it; None: as much as that.

    Raises `RibbonInputError` for a budget that is not positive.
    """
    if seconds is not None and not seconds > 0.0:
        raise RibbonInputError("budget", seconds, "a time in seconds greater than zero")
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
