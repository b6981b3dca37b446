"""Where a branch loses its stability to what is free on it, such as the rulings of a straight strip.

No eigenvalue of the branch's own unknowns changes its sign there, so nothing is seen by their inertia: every point is
asked (`compare.models.capabilities.Freed`), and the place between a stable one and the next is bisected. The worst
choice is searched for and not solved for: the strip falls there at the latest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from compare.continuation.correct import at
from compare.continuation.point import Options, Point
from compare.continuation.system import FloatArray, System
from compare.models.capabilities import Freed

#: To what the place is bisected, in t.
LOCATED = 1e-4
#: How far behind it, in t, the state that the strip falls to is looked for, one after the other.
BEHIND = (0.01, 0.03, 0.1, 0.3)

Asks = Callable[[Point], Freed | None]


@dataclass(frozen=True)
class Lost:
    """The first point at which a choice was found by which the shape is unstable, to `LOCATED`; systems and z of the
    states that it falls to, and the t of these."""

    point: Point
    states: tuple[tuple[System, FloatArray], ...]
    t: float


def unstable(points: Sequence[Point], asks: Asks, spent: Callable[[], bool]) -> list[bool | None]:
    """Which of the points are unstable though none of their own modes is; None: not known, or there was no time left to
    ask."""
    found: list[bool | None] = []
    for point in points:
        if point.unstable:
            found.append(False)
        elif spent():
            found.append(None)
        else:
            told = asks(point)
            found.append(False if told is None else None if told.stable is None else not told.stable)
    return found


def lost(here: Point, there: Point, asks: Asks, options: Options) -> Lost | None:
    """The place between a point that is stable and the next, which is not; None where a point between is not found."""
    low, high = 0.0, there.arc - here.arc
    rate = max(abs(there.t - here.t) / high, 1e-12)
    first = there
    while (high - low) * rate > LOCATED:
        middle = 0.5 * (low + high)
        point = at(here, middle, options.tolerance)
        told = None if point is None else asks(point)
        if point is None or told is None or told.stable is None:
            return None
        if told.stable:
            low = middle
        else:
            high, first = middle, point
    for share in BEHIND:
        behind = at(here, low + share / rate, options.tolerance) if 0.0 <= first.t + share <= 1.0 else None
        told = None if behind is None else asks(behind)
        states = () if told is None else tuple(told.beside())
        if behind is not None and states:
            return Lost(first, states, behind.t)
    return Lost(first, (), first.t)
