"""Times of a solve in this process: the first call, with loading and compilation, apart from the warm ones; and what is
compiled in it, counted and said as soon as it begins."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, TypeVar

from compare.models.base import Seconds

if TYPE_CHECKING:
    from compare.store.progress import Reporter

T = TypeVar("T")

#: What is said while kernels are compiled.
WORDS = "compiling the ribbon's kernels, once after each installation (half a minute to a minute)"

#: A repeated solve is timed up to REPEATS times, while that takes less than REPEAT_BUDGET seconds; the median counts.
REPEATS = 5
REPEAT_BUDGET = 2.0


#: First calls that took as long (s) are not repeated without being asked for, and count as one that was asked for.
LONG = 2.0


def clocked(once: Callable[[], T], repeats: int | None = None) -> tuple[T, Seconds]:
    """The result of the first call of `once`, and the times (s) of all calls: nothing else is inside the clock."""
    clock = time.perf_counter()
    result = once()
    return result, repeated(once, time.perf_counter() - clock, repeats)


def repeated(once: Callable[[], object], first: float, repeats: int | None = None) -> Seconds:
    """`first` (s), the time of a call that has been made, and the times of `once` called again.

    repeats: calls beside the first, where one that took `LONG` or longer counts as the first of them: what it loads is
    then little beside it. None: as many as `REPEATS` and `REPEAT_BUDGET` allow, at least one, but none after a `LONG`
    first call.
    """
    if repeats is None and first >= LONG:
        return Seconds(first)
    most = REPEATS if repeats is None else repeats
    times = [first] if repeats and first >= LONG else []
    while len(times) < most and (repeats is not None or not times or sum(times) < REPEAT_BUDGET):
        clock = time.perf_counter()
        once()
        times.append(time.perf_counter() - clock)
    return Seconds(first, tuple(times))


@contextlib.contextmanager
def compiled() -> Iterator[Callable[[], int]]:
    """While inside, compilations of the ribbon's kernels are counted; yields what says how many there were."""
    from ribbon.element.kernel_cache import told

    counts = [0]
    with told(counts.append):
        yield lambda: counts[-1]


@contextlib.contextmanager
def compiling(say: Reporter | None) -> Iterator[None]:
    """Says that kernels are being compiled, as soon as the first of them is not found in the cache."""
    from ribbon.element.kernel_cache import told

    if say is None:
        yield
        return
    with told(lambda count: say.aside(WORDS if count == 1 else f"{WORDS}: {count} so far")):
        yield
