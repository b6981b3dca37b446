"""A point of a branch again, on elements half as long: a special one is located there anew, a regular one is put where
it was."""

from __future__ import annotations

import numpy as np

from compare.continuation import locate
from compare.continuation.correct import CARRIED, at, corrected, tangent
from compare.continuation.follow import follow
from compare.continuation.point import Options, Point, Special
from compare.continuation.system import FloatArray, System

#: Windows around the step in which it was found, in units of it, in which it is looked for.
WINDOWS = ((0.0, 1.0), (-0.5, 1.5), (-1.0, 2.0), (-2.0, 3.0))
#: Least |dt/darc| of a branch that is compared at one t; along a steeper one t is what the mesh moves.
LEVEL = 0.03
#: Conditions of one side that may change with the elements, at the most.
CHANGES = 12


def relocated(special: Special, options: Options | None = None) -> Special | None:
    """The same fold, branch point or event on every element cut in two; None where there is none like it."""
    options = options or Options()
    start = _carried(special.before, options, level=False)
    if start is None:
        return None
    for back, ahead in WINDOWS:
        first = start if back == 0.0 else at(start, back * special.reach, options.tolerance)
        if first is None:
            continue
        reach = (ahead - back) * special.reach
        after = at(first, reach, options.tolerance)
        if after is None:
            continue
        same = [one for one in _found(first, after, reach, options) if one.kind == special.kind]
        if same:
            return min(same, key=lambda one: abs(one.point.t - special.point.t))
    return None


def is_level(point: Point) -> bool:
    """Whether a branch goes along t there, and not all but across it, as at a fold."""
    return abs(point.tangent[1]) >= LEVEL


def refined(point: Point, level: bool, options: Options | None = None) -> Point | None:
    """The same branch on every element cut in two: at its t where `level`, else across its tangent, with what touches
    there. None where none is found."""
    options = options or Options()
    found = _carried(point, options, level)
    for _ in range(CHANGES):
        if found is None:
            return None
        slacks = found.system.slacks(found.z, found.t)
        if not (slacks < -locate.BROKEN).any():
            return found
        dz, dt = found.tangent
        system, z, directions, _ = found.system.beyond(found.z, found.t, int(slacks.argmin()), dz[:, None])
        found = _put(system, z, (directions[:, 0], dt), found, options, level)
    return None


def continued(before: Point, t: float, options: Options | None = None) -> Point | None:
    """The branch from an equilibrium on to a t where it does not turn back on the way; None where it does."""
    if t == before.t:
        return before
    ahead = before if before.tangent[1] * (t - before.t) > 0.0 else before.turned()
    run = follow(ahead, (min(before.t, t), max(before.t, t)), options)
    last = run.points[-1]
    return last if run.ended == "range" and last.t == t else None


def _found(first: Point, after: Point, reach: float, options: Options) -> list[Special]:
    slacks = after.system.slacks(after.z, after.t)
    if (slacks < -locate.BROKEN).any():
        event = locate.broken(first, after, reach, options)
        return [] if event is None else [event[0]]
    return locate.specials(first, after, reach, options) or []


def _carried(point: Point, options: Options, level: bool) -> Point | None:
    """The point of the branch on finer elements across the tangent of one on coarser ones, or at its t."""
    dz, dt = point.tangent
    system, z, directions = point.system.finer(point.z, point.t, dz[:, None])
    return _put(system, z, (directions[:, 0], dt), point, options, level)


def _put(
    system: System, z: FloatArray, along: tuple[FloatArray, float], point: Point, options: Options, level: bool
) -> Point | None:
    """The equilibrium of a system beside z, across a tangent or at the t of `point`."""
    across = (np.zeros(system.size), 1.0) if level else along
    found = corrected(system, z, point.t, across, (z, point.t), 0.0, options.tolerance, CARRIED)
    if found is None:
        return None
    z, t, count, norm = found
    side = tangent(system, z, t, along)
    return None if side is None else Point(system, z, t, side[0], side[1], point.arc, count, norm)
