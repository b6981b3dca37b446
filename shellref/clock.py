"""The time that a solve of an elastica or a rod may take, looked at wherever steps are made.

It is that of the thread on the processor, so that a busy machine shortens nothing.
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Iterator
from contextvars import ContextVar

SPENT = "the budget of time is spent"

_deadline: ContextVar[float] = ContextVar("deadline", default=math.inf)


@contextlib.contextmanager
def within(seconds: float) -> Iterator[None]:
    """What is solved inside has this much time (s > 0), and no more than what is around it."""
    token = _deadline.set(min(_deadline.get(), time.thread_time() + seconds))
    try:
        yield
    finally:
        _deadline.reset(token)


def spent() -> bool:
    """Whether the time is over."""
    deadline = _deadline.get()
    return deadline < math.inf and time.thread_time() > deadline
