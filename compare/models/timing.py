"""Times of a solve in this process: the first call, with loading and compilation, apart from the warm ones."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

from compare.models.base import Seconds

T = TypeVar("T")

#: A repeated solve is timed up to REPEATS times, while that takes less than REPEAT_BUDGET seconds; the median counts.
REPEATS = 5
REPEAT_BUDGET = 2.0


def clocked(once: Callable[[], T], repeats: int | None = None) -> tuple[T, Seconds]:
    """The result of the first call of `once`, and the times (s) of all calls: nothing else is inside the clock.

    repeats: calls beside the first; None: as many as `REPEATS` and `REPEAT_BUDGET` allow, at least one, but none after
    a first call that took longer than the budget.
    """
    clock = time.perf_counter()
    result = once()
    first = time.perf_counter() - clock
    most = REPEATS if repeats is None else repeats
    times: list[float] = []
    while len(times) < most and (repeats is not None or not times or sum(times) < REPEAT_BUDGET):
        if repeats is None and first >= LONG:
            break
        clock = time.perf_counter()
        once()
        times.append(time.perf_counter() - clock)
    return result, Seconds(first, tuple(times))


LONG = 2.0
"""First calls that took as long (s) are not repeated without being asked for."""
