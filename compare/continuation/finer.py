"""A special point again, on elements half as long: begun beside it, located there anew."""

from __future__ import annotations

from dataclasses import replace

from compare.continuation.correct import CARRIED, corrected, tangent
from compare.continuation.follow import follow
from compare.continuation.placed import around, on_its_elements, on_moved_elements
from compare.continuation.point import Options, Point, Special

#: Points, and arc length over the step in which it was found, within which a special point is walked to.
_WALK, _FAR = 24, 8.0


def relocated(special: Special, options: Options | None = None) -> Special | None:
    """The same fold, branch point or event on every element cut in two; None where there is none like it."""
    options = options or Options()
    start = _carried(special.before, options)
    if start is None:
        return None
    found = around(start, special, special.reach, options)
    return _walked(start, special, options) if found is None else on_its_elements(found, options)


def _walked(start: Point, special: Special, options: Options) -> Special | None:
    """The same one on the branch through `start`, its elements moving with it: on the side on which it has to be.
    None for elements that stay: there it would have been within reach."""
    point, (dz, _) = special.point, special.before.tangent
    if point.system.moved(point.z, point.t, dz[:, None])[0] is point.system:
        return None
    first = on_moved_elements(start, options)
    first = first if first.unstable == special.before.unstable else first.turned()
    short = replace(options, step=0.25 * special.reach, most=special.reach, steps=_WALK)
    run = follow(first, options=short, on_point=lambda point: point.arc - first.arc < _FAR * special.reach)
    return next((one for one in run.specials if one.kind == special.kind), None)


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
