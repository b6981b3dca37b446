"""Following a branch: predictor of second order, corrector across the tangent, steps by iterations and by curvature.

    z_p = z + h dz + h^2 / 2 (dz - dz_before) / h_before        and t likewise

A step is repeated shorter where the corrector fails, the tangents of its ends differ too much, an eigenvalue leaps over
zero, or the number of unstable modes changes by what its special points do not explain.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from compare.continuation import bordered, locate
from compare.continuation.correct import at, corrected, tangent
from compare.continuation.placed import carried_on, on_its_elements
from compare.continuation.point import Options, Point, Run, Special, length, product
from compare.continuation.ring import around
from compare.continuation.system import FloatArray

#: Growth of an easy step, and cut of one that is repeated.
GROW, CUT = 1.6, 0.4
#: Sizes at which what leaves a branch point is looked for, over the first.
SHRUNK = (1.0, 0.3, 0.1, 0.03, 0.01)
#: Steps behind which a branch may be found closed; distance from its first point, over the step, at which it is.
_EARLY, _NEAR = 6, 0.6
#: Times that one condition changes at one place (arc length, over the shortest step) behind which nothing keeps to it.
#: Many may change there once: a uniform state lets go of a wall everywhere.
_REPEATS = 4
#: How a branch ends at an event of such a condition.
_ENDED: dict[int | None, str] = {locate.LOST: "unposed", locate.ENDS: "spread"}


def follow(
    start: Point,
    span: tuple[float, float] = (0.0, 1.0),
    options: Options | None = None,
    on_point: Callable[[Point], bool] | None = None,
) -> Run:
    """The branch from `start` along its tangent until t leaves `span` or it closes; on_point: called with every point
    behind the first, ends it with False."""
    options = options or Options()
    points: list[Point] = [start]
    found: list[Special] = []
    step, refused, bent = options.step, 0, None
    met: list[Special] = []
    while len(points) < options.steps:
        here = points[-1]
        moved = _step(here, step, bent, span, options)
        if moved is None:
            refused += 1
            step *= CUT
            if step < options.least:
                return Run(tuple(points), tuple(found), "stuck", refused)
            continue
        there, ahead, between, landed = moved
        found += [on_its_elements(special, options) for special in between]
        events = [special for special in between if special.kind == "event"]
        met = [one for one in (*met, *events) if there.arc - one.point.arc <= options.least]
        if _chatters(met):
            return Run(tuple(points), tuple(found), "stuck", refused)
        if events and events[-1].condition in _ENDED:
            points.append(there)
            return Run(tuple(points), tuple(found), _ENDED[events[-1].condition], refused)
        if not events:
            there, more = carried_on(here, there, options, landed)
            found += [on_its_elements(special, options) for special in more]
        if not there.system.resolved(there.z, there.t):
            return Run(tuple(points), tuple(found), "unresolved", refused)
        points.append(there)
        if on_point is not None and not on_point(there):
            return Run(tuple(points), tuple(found), "stopped", refused)
        if landed:
            return Run(tuple(points), tuple(found), "range", refused)
        if len(points) > _EARLY and _closes(start, here, there):
            return Run(tuple(points), tuple(found), "closed", refused)
        bent = None if events else _bend(here, there)
        if there.iterations <= options.easy:
            step = min(GROW * max(step, ahead if not events else 0.0), options.most)
        else:
            step = min(step, options.most) * (1.0 if there.iterations <= options.easy + 2 else 0.7)
    return Run(tuple(points), tuple(found), "steps", refused)


def _chatters(met: list[Special]) -> bool:
    """Whether of the events at one place too many are changes of one condition."""
    return max(Counter(one.condition for one in met).values(), default=0) > _REPEATS


def _bend(here: Point, there: Point) -> tuple[FloatArray, float] | None:
    """Change of the tangent per arc length behind a step."""
    ahead = there.arc - here.arc
    if not ahead > 0.0 or here.tangent[0].shape != there.tangent[0].shape:
        return None
    return (there.tangent[0] - here.tangent[0]) / ahead, (there.tangent[1] - here.tangent[1]) / ahead


def _step(
    here: Point, step: float, bent: tuple[FloatArray, float] | None, span: tuple[float, float], options: Options
) -> tuple[Point, float, list[Special], bool] | None:
    """The next point, how far along the tangent it is, what is special in between, whether it lies on an end of the
    range; None where the step has to be shorter."""
    system, (dz, dt) = here.system, here.tangent
    move, rise = step * dz, step * dt
    if bent is not None:
        move, rise = move + 0.5 * step * step * bent[0], rise + 0.5 * step * step * bent[1]
    share = system.reach(here.z, move)
    guess = here.z + share * move, here.t + share * rise
    if not span[0] <= guess[1] <= span[1]:  # beyond there may be no scene
        return _last(here, guess, step, span, options)
    there = at(here, step, options.tolerance, guess)
    if there is None or product(system, here.tangent, there.tangent) < options.turn:
        return None
    if length(system, there.z - here.z, there.t - here.t) > 1.5 * step:
        return None
    if not span[0] <= there.t <= span[1]:
        return _last(here, (there.z, there.t), step, span, options)
    return _passed(here, there, step, False, options)


def _last(
    here: Point, beyond: tuple[FloatArray, float], step: float, span: tuple[float, float], options: Options
) -> tuple[Point, float, list[Special], bool] | None:
    """The step to the end of the range that (z, t) is beyond of."""
    bound = span[1] if beyond[1] > span[1] else span[0]
    landed = _landed(here, beyond, step, bound, options)
    return None if landed is None else _passed(here, *landed, True, options)


def _passed(
    here: Point, there: Point, ahead: float, landed: bool, options: Options
) -> tuple[Point, float, list[Special], bool] | None:
    """A step with what is special in it; it ends at the first condition that is broken, or where the density ceases to
    be convex."""
    if not locate.leaves_convexity(here, there):
        return _met(here, there, ahead, landed, options)
    lost = locate.unposed(here, there, ahead, options)
    if lost is None:
        return None
    found = _met(here, lost.point, lost.point.arc - here.arc, False, options)
    if found is None or found[0] is not lost.point:
        return found
    return lost.point, ahead, [*found[2], lost], False


def _met(
    here: Point, there: Point, ahead: float, landed: bool, options: Options
) -> tuple[Point, float, list[Special], bool] | None:
    """A step up to the first condition that is broken."""
    slacks = there.system.slacks(there.z, there.t)
    if np.any(slacks < -locate.BROKEN):
        event = locate.broken(here, there, ahead, options)
        if event is None:
            return None
        met, there = event
        place = met[0].point
        before_it = locate.specials(here, place, place.arc - here.arc, options)
        return None if before_it is None else (there, ahead, [*before_it, *met], False)
    between = locate.specials(here, there, ahead, options)
    return None if between is None else (there, ahead, between, landed)


def _landed(
    here: Point, beyond: tuple[FloatArray, float], step: float, bound: float, options: Options
) -> tuple[Point, float] | None:
    """The point of the branch with t on the bound, between `here` and (z, t), and how far along the tangent it is."""
    share = (bound - here.t) / (beyond[1] - here.t)
    guess = (1.0 - share) * here.z + share * beyond[0], bound
    system = here.system
    flat = np.zeros(system.size)
    found = corrected(system, *guess, (flat, 1.0), (here.z, bound), 0.0, options.tolerance)
    if found is None:
        return None
    z, t, count, norm = found
    ahead = here.ahead(z, t)
    if not 0.0 <= ahead <= 1.05 * step or length(system, z - here.z, t - here.t) > 1.5 * step:
        return None
    side = tangent(system, z, t, here.tangent)
    if side is None or product(system, here.tangent, side[0]) < options.turn:
        return None
    return Point(system, z, bound, side[0], side[1], here.arc + ahead, count, norm), ahead


def _closes(start: Point, here: Point, there: Point) -> bool:
    """Whether the branch passes its first point in the last step, the same way."""
    if there.z.shape != start.z.shape or there.system is not start.system:
        return False
    system, step = start.system, there.arc - here.arc
    if length(system, there.z - start.z, there.t - start.t) > 2.0 * step:
        return False
    if product(system, there.tangent, start.tangent) < 0.8:
        return False
    before, after = -start.ahead(here.z, here.t), -start.ahead(there.z, there.t)
    off = length(system, there.z - start.z - (-after) * start.tangent[0], there.t - start.t + after * start.tangent[1])
    return before > 0.0 >= after and off <= _NEAR * step


def switched(special: Special, options: Options | None = None, size: float = 0.03) -> list[Point]:
    """First points of the branches that leave a branch point, tangents away from it: two of every null vector, of two
    null vectors all that are seen around it (`compare.continuation.ring`); fewer where none is found."""
    return leaving(special, options, size)[0]


def leaving(special: Special, options: Options | None = None, size: float = 0.03) -> tuple[list[Point], bool]:
    """The same, and whether they are a circle of branches, of which one is given."""
    options = options or Options()
    if special.modes.shape[1] == 2:
        for shrink in SHRUNK:
            ring = around(special, shrink * size, options)
            if ring is not None and ring.points:
                renewed = [_renewed(point) for point in ring.points]
                return [point for point in renewed if point is not None], ring.circle
    return _each_way(special, size, options), False


def _each_way(special: Special, size: float, options: Options) -> list[Point]:
    point = special.point
    found: list[Point] = []
    for mode in _directions(special.modes):
        for sign in (1.0, -1.0):
            first = _off(point, sign * mode, size, options)
            if first is not None and not any(_same(first, other) for other in found):
                found.append(first)
    return found


def _directions(modes: FloatArray) -> list[FloatArray]:
    each = [modes[:, k] for k in range(modes.shape[1])]
    if len(each) == 2:
        each += [(each[0] + each[1]) / np.sqrt(2.0), (each[0] - each[1]) / np.sqrt(2.0)]
    return each


def _off(point: Point, mode: FloatArray, size: float, options: Options) -> Point | None:
    """The first point beside `point` along a null vector made perpendicular to the tangent, ever nearer to it."""
    system = point.system
    across = _across(point, mode)
    if across is None:
        return None
    for shrink in SHRUNK:
        step = size * shrink * system.reach(point.z, size * shrink * across[0])
        first = at(point, step, options.tolerance, across=across)
        if first is None:
            continue
        away = first.z - point.z, first.t - point.t
        if length(system, *away) > 3.0 * step or product(system, away, across) < 0.3 * step:
            continue
        ahead = product(system, away, first.tangent)
        return _renewed(first if ahead > 0.0 else first.turned())
    return None


def _across(point: Point, mode: FloatArray) -> tuple[FloatArray, float] | None:
    """The direction of unit length in the null space of (K, dG/dt) that is perpendicular to the tangent: of the null
    vector, or, where that is the tangent itself, of the one along which t changes."""
    system = point.system
    sign = 1.0
    direction = _perpendicular(point, mode, 0.0)
    if direction is None:
        factor = system.factor(point.z, point.t)
        held = system.mass(mode)
        if factor is None:
            return None
        found = bordered.solve(factor, held, held, 0.0, -system.rate(point.z, point.t), 0.0)
        if found is None:
            return None
        sign = 1.0 if product(system, (mode, 0.0), point.tangent) >= 0.0 else -1.0  # both ways, as of a null vector
        direction = _perpendicular(point, found[0], 1.0)
    return None if direction is None else (sign * direction[0], sign * direction[1])


def _perpendicular(point: Point, dz: FloatArray, dt: float) -> tuple[FloatArray, float] | None:
    system = point.system
    whole = length(system, dz, dt)
    along = product(system, (dz, dt), point.tangent)
    across = dz - along * point.tangent[0], dt - along * point.tangent[1]
    left = length(system, *across)
    return None if left < 0.05 * whole else (across[0] / left, across[1] / left)


def _renewed(first: Point) -> Point | None:
    """The first point of a branch in a system of its own, arc length 0."""
    dz, dt = first.tangent
    system, z, directions = first.system.renewed(first.z, first.t, dz[:, None])
    if system is first.system:
        return replace(first, arc=0.0)
    found = tangent(system, z, first.t, (directions[:, 0], dt))
    return None if found is None else replace(first, system=system, z=z, tangent=found[0], unstable=found[1], arc=0.0)


def _same(one: Point, other: Point) -> bool:
    if one.z.shape != other.z.shape:
        return False
    return length(one.system, one.z - other.z, one.t - other.t) < 1e-6
