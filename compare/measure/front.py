"""Work-precision on paper: which runs are worth their time, and how long a given error takes. Times in s, lengths in l.

The Pareto front holds the runs that no other one beats in both time and error. Between two neighbours of the front the
time for an error is interpolated in log-log (both follow powers of the size); outside the front nothing is said.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

#: A run joins the front when its error is below this share of the error of the faster ones: less is no gain.
GAIN = 0.99


@dataclass(frozen=True)
class Mark:
    """A run as a point of the diagram: its label, time (s) and error (l), both above zero."""

    label: str
    seconds: float
    error: float


@dataclass(frozen=True)
class Reach:
    """What reaching an error takes. seconds: None when no run reaches it; bound: the fastest run reaches it already, so
    that the time is an upper bound; between: the runs interpolated; best: the most accurate run."""

    target: float
    seconds: float | None
    bound: bool
    between: tuple[Mark, ...]
    best: Mark


def front(marks: Sequence[Mark]) -> list[Mark]:
    """The Pareto front, faster runs first: times rise, errors fall (by one per cent at least)."""
    found: list[Mark] = []
    for mark in sorted(marks, key=lambda m: (m.seconds, m.error)):
        if not found or mark.error < GAIN * found[-1].error:
            found.append(mark)
    return found


def reach(marks: Sequence[Mark], target: float) -> Reach | None:
    """What the error `target` (l) takes, on the front of `marks`; None without marks."""
    line = front(marks)
    if not line:
        return None
    best = line[-1]
    if best.error > target:
        return Reach(target, None, False, (), best)
    after = next(k for k, mark in enumerate(line) if mark.error <= target)
    there = line[after]
    if after == 0 or there.error == target:
        return Reach(target, there.seconds, after == 0 and there.error < target, (there,), best)
    before = line[after - 1]
    share = math.log(before.error / target) / math.log(before.error / there.error)
    seconds = math.exp((1.0 - share) * math.log(before.seconds) + share * math.log(there.seconds))
    return Reach(target, seconds, False, (before, there), best)
