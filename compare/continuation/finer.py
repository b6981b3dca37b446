"""A point of a branch again, on elements half as long: a special one is located there anew, a regular one is put where
it was."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from compare.continuation import locate
from compare.continuation.correct import CARRIED, corrected, tangent
from compare.continuation.follow import follow
from compare.continuation.placed import around, on_its_elements, on_moved_elements
from compare.continuation.point import Options, Point, Special
from compare.continuation.system import FloatArray, System

#: Least |dt/darc| of a branch that is compared at one t; along a steeper one t is what the mesh moves.
LEVEL = 0.03
#: Conditions of one side that may change with the elements, at the most.
CHANGES = 12
#: Points, and arc length over the step in which it was found, within which a special point is walked to.
_WALK, _FAR = 40, 24.0


def relocated(special: Special, options: Options | None = None) -> Special | None:
    """The same fold, branch point or event on every element cut in two; None where there is none like it."""
    options = options or Options()
    start = _carried(special.before, options, level=False)
    if start is None:
        return None
    found = around(start, special, special.reach, options)
    return _walked(start, special, options) if found is None else on_its_elements(found, options)


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


def _walked(start: Point, special: Special, options: Options) -> Special | None:
    """The same one on the branch through `start`, its elements moving with it: on the side on which it has to be, or,
    where `start` is on another branch through it, on either. Where the parameter turns back, an error of the elements
    in it is a long way along the branch."""
    first = on_moved_elements(start, options)
    first = first if first.unstable == special.before.unstable else first.turned()
    short = replace(options, step=0.25 * special.reach, most=special.reach, steps=_WALK)
    for way in (first, first.turned()) if special.kind == "branch_point" else (first,):
        run = follow(way, options=short, on_point=lambda point: point.arc - first.arc < _FAR * special.reach)
        alike = next((one for one in run.specials if one.kind == special.kind), None)
        if alike is not None:
            return alike
    return None


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
