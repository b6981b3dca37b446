"""A special point again, on elements half as long: begun beside it, located there anew."""

from __future__ import annotations

from compare.continuation import locate
from compare.continuation.correct import CARRIED, at, corrected, tangent
from compare.continuation.point import Options, Point, Special

#: Windows around the step in which it was found, in units of it, in which it is looked for.
WINDOWS = ((0.0, 1.0), (-0.5, 1.5), (-1.0, 2.0), (-2.0, 3.0))


def relocated(special: Special, options: Options | None = None) -> Special | None:
    """The same fold, branch point or event on every element cut in two; None where there is none like it."""
    options = options or Options()
    start = _carried(special.before, options)
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


def _found(first: Point, after: Point, reach: float, options: Options) -> list[Special]:
    slacks = after.system.slacks(after.z, after.t)
    if (slacks < -locate.BROKEN).any():
        event = locate.broken(first, after, reach, options)
        return [] if event is None else [event[0]]
    return locate.specials(first, after, reach, options) or []


def _carried(point: Point, options: Options) -> Point | None:
    """The point of the branch on finer elements across the tangent of one on coarser ones."""
    dz, dt = point.tangent
    system, z, directions = point.system.finer(point.z, point.t, dz[:, None])
    along = directions[:, 0], dt
    found = corrected(system, z, point.t, along, (z, point.t), 0.0, options.tolerance, CARRIED)
    if found is None:
        return None
    z, t, count, norm = found
    side = tangent(system, z, t, along)
    return None if side is None else Point(system, z, t, side[0], side[1], point.arc, count, norm)
