"""Times of a solve in this process: the first call, with loading and compilation, apart from the warm ones."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")

#: A repeated solve is timed up to REPEATS times, while that takes less than REPEAT_BUDGET seconds; the median counts.
REPEATS = 5
REPEAT_BUDGET = 2.0


def timed(once: Callable[[], T], repeat: bool = True) -> tuple[T, float, float]:
    """The result, the time of the first call (s) and the median time of repeated calls (s), at least one of them;
    without `repeat` the first time again."""
    clock = time.perf_counter()
    result = once()
    first = time.perf_counter() - clock
    return result, first, repeated(once) if repeat else first


def repeated(once: Callable[[], object]) -> float:
    """Median time (s) of calls, repeated within the budget."""
    times: list[float] = []
    while not times or (len(times) < REPEATS and sum(times) < REPEAT_BUDGET):
        clock = time.perf_counter()
        once()
        times.append(time.perf_counter() - clock)
    return statistics.median(times)
