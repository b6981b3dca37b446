"""The corrector and the tangent: Newton's iteration on (G, one more condition), bordered by the condition's row.

The condition is a hyperplane ``<c, (z, t) - (z0, t0)> = e`` of the metric: across the tangent (pseudo-arclength: H. B.
Keller 1977), across a null vector (switching), or t itself (landing on a value).
"""

from __future__ import annotations

import numpy as np

from compare.continuation import bordered
from compare.continuation.journal import journalled
from compare.continuation.point import Point, length
from compare.continuation.system import FloatArray, System

#: Newton steps at the most, and those on other elements than where the start is from; a residual that grows by this
#: factor is going nowhere.
MOST, CARRIED, GROWTH = 12, 30, 1e4
#: Miss of the condition that is none, over its size.
_ON = 1e-10
#: Residual below which a last step that falls no more has met rounding.
ROUNDING = 1e3

Direction = tuple[FloatArray, float]


@journalled(
    lambda system, *asked: (type(system).__name__, *asked),
    lambda found: [] if found is None else [np.asarray(part) for part in found],
    lambda kept: (kept[0], float(kept[1]), int(kept[2]), float(kept[3])) if kept else None,
)
def corrected(
    system: System,
    z: FloatArray,
    t: float,
    across: Direction,
    origin: Direction,
    ahead: float,
    tolerance: float,
    most: int = MOST,
) -> tuple[FloatArray, float, int, float] | None:
    """The equilibrium on the hyperplane `ahead` of `origin` along `across`, from (z, t), in `most` Newton steps at the
    most: z, t, steps, norm of what is left; None where there is none."""
    row, d = system.mass(across[0]), across[1]
    first, last = None, np.inf
    for count in range(most + 1):
        left = system.residual(z, t)
        norm = system.norm(left)
        missed = float(row @ (z - origin[0])) + d * (t - origin[1]) - ahead
        if not np.isfinite(norm):
            return None
        first = norm if first is None else first
        if abs(missed) <= _ON * max(abs(ahead), 1e-3):
            if norm <= tolerance:
                return z, t, count, norm
            if norm <= ROUNDING * tolerance and norm >= last:
                return (z, t, count, norm) if norm <= 10.0 * tolerance else None
        if count and norm > GROWTH * max(first, 1.0):
            return None
        last = norm
        factor = system.factor(z, t)
        if factor is None or count == most:
            return None
        step = bordered.solve(factor, system.rate(z, t), row, d, -left, -missed)
        if step is None:
            return None
        z, t = system.stepped(z, step[0]), t + step[1]
    return None


@journalled(
    lambda system, *asked: (type(system).__name__, *asked),
    lambda found: [] if found is None else [found[0][0], np.asarray(found[0][1]), np.asarray(found[1])],
    lambda kept: ((kept[0], float(kept[1])), int(kept[2])) if kept else None,
)
def tangent(system: System, z: FloatArray, t: float, along: Direction) -> tuple[Direction, int] | None:
    """Unit tangent at an equilibrium on the side of `along`, and the number of unstable modes there."""
    factor = system.factor(z, t)
    if factor is None:
        return None
    found = bordered.solve(factor, system.rate(z, t), system.mass(along[0]), along[1], np.zeros(system.size), 1.0)
    if found is None:
        return None
    size = length(system, *found)
    return ((found[0] / size, found[1] / size), factor.unstable) if size > 0.0 and np.isfinite(size) else None


def first_point(
    system: System, z: FloatArray, t: float, tolerance: float, along: float = 1.0, *, check: bool = True
) -> Point | None:
    """The equilibrium at this t that Newton's iteration finds from z, its tangent towards larger (along = 1) or smaller
    t (-1); None where there is none. check: whether one without a tangent (a scene that does not move with t has none
    that could be asked for) is none."""
    flat = np.zeros(system.size)
    found = corrected(system, z, t, (flat, 1.0), (z, t), 0.0, tolerance, CARRIED)
    if found is None:
        return None
    if not check:
        factor = system.factor(found[0], t)
        return None if factor is None else Point(
            system, found[0], t, (flat, along), factor.unstable, 0.0, found[2], found[3]
        )  # fmt: skip
    ahead = tangent(system, found[0], found[1], (flat, along))
    return None if ahead is None else Point(system, found[0], t, ahead[0], ahead[1], 0.0, found[2], found[3])


def at(
    here: Point,
    ahead: float,
    tolerance: float,
    guess: tuple[FloatArray, float] | None = None,
    across: Direction | None = None,
) -> Point | None:
    """The equilibrium `ahead` along the tangent of `here` (or along `across`), from `guess`, else from the tangent."""
    system, along = here.system, here.tangent if across is None else across
    if guess is None:
        share = system.reach(here.z, ahead * along[0])
        guess = here.z + share * ahead * along[0], here.t + share * ahead * along[1]
    found = corrected(system, *guess, along, (here.z, here.t), ahead, tolerance)
    if found is None:
        return None
    z, t, count, norm = found
    forward = 1.0 if ahead >= 0.0 else -1.0
    side = along if across is None else (forward * along[0], forward * along[1])
    next_one = tangent(system, z, t, side)
    if next_one is None:
        return None
    return Point(system, z, t, next_one[0], next_one[1], here.arc + abs(ahead), count, norm)
