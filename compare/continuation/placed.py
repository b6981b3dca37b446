"""A special point on elements that stand where its own shape has what is sudden.

Elements that move stand where a branch's last point had what is sudden in its shape; at the special point behind it
that is elsewhere, by a part of the step. So it is located once more from a point close to it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from compare.continuation import locate
from compare.continuation.correct import CARRIED, Direction, at, corrected, tangent
from compare.continuation.point import Options, Point, Special
from compare.continuation.system import FloatArray, System

#: Windows around the step in which it was found, in units of it, in which it is looked for.
WINDOWS = ((0.0, 1.0), (-0.5, 1.5), (-1.0, 2.0), (-2.0, 3.0))
#: How far before a special point, over the step in which it was found, elements move to it.
BESIDE = 0.1
#: Rounds in which conditions of one side change with the elements, at the most.
CHANGES = 12
#: Times that elements move at one point at the most.
ROUNDS = 4


def on_its_elements(special: Special, options: Options | None = None) -> Special:
    """The same special point located on elements that stand where a point close to it on its branch has what is sudden
    in its shape; itself where its elements stay, or where it is not found on those."""
    options = options or Options()
    point, (dz, _) = special.point, special.before.tangent
    if special.kind == "event" or point.system.moved(point.z, point.t, dz[:, None])[0] is point.system:
        return special
    near = _close_to(special, options)
    if near is None:
        return special
    here = on_moved_elements(near, options)
    if here.system is near.system:
        return special
    found = around(here, special, 2.0 * BESIDE * special.reach, options)
    return special if found is None else found


def _close_to(special: Special, options: Options) -> Point | None:
    """The point of its branch `BESIDE` of the step before it."""
    before, point = special.before, special.point
    ahead = before.ahead(point.z, point.t)
    if not ahead > 0.0:
        return None
    wanted = ahead - BESIDE * special.reach
    share = wanted / ahead
    guess = before.z + share * (point.z - before.z), before.t + share * (point.t - before.t)
    return at(before, wanted, options.tolerance, guess)


def on_moved_elements(point: Point, options: Options, landed: bool = False) -> Point:
    """The point on elements that follow what is sudden in its shape, across its tangent, or, where it has landed on an
    end of the range, at its t; itself where they need not move, it is not found there, or is so with another number of
    unstable modes."""
    found = _moved(point, options, landed)
    return point if found is None or found.unstable != point.unstable else found


def carried_on(here: Point, there: Point, options: Options, landed: bool) -> tuple[Point, list[Special]]:
    """The next point `there` of a branch on moved elements, and the special points that these put between it and `here`
    and those of `here` behind it: on elements that stay a fork may be held shut."""
    found = _moved(there, options, landed)
    if found is None:
        return there, []
    if found.unstable == there.unstable:
        return found, []
    back = at(found, -(there.arc - here.arc), options.tolerance)
    if back is None or back.unstable != here.unstable:
        return there, []
    between = locate.specials(back, found, back.ahead(found.z, found.t), options)
    return (found, between) if between else (there, [])


def _moved(point: Point, options: Options, landed: bool) -> Point | None:
    """The point on moved elements, again while these do not resolve it: what is sudden may be thinner than the elements
    that it is seen on. None where they need not move, or it is not found there."""
    found: Point | None = None
    for _ in range(ROUNDS):
        here = found or point
        there = _moved_once(here, options, landed)
        if there is None:
            break
        found = there
        if found.system.resolved(found.z, found.t):
            break
    return found


def _moved_once(point: Point, options: Options, landed: bool) -> Point | None:
    dz, dt = point.tangent
    system, z, directions = point.system.moved(point.z, point.t, dz[:, None])
    if system is point.system:
        return None
    found = _put(system, z, (directions[:, 0], dt), point, options, landed)
    for _ in range(CHANGES):
        if found is None:
            return None
        slacks = found.system.slacks(found.z, found.t)
        broken = np.flatnonzero(slacks < -locate.BROKEN)
        if not broken.size:
            return found
        system, z, directions = found.system, found.z, found.tangent[0][:, None]
        for condition in broken:  # those that push a little on these elements may pull on those: they change together
            system, z, directions, _ = system.beyond(z, found.t, int(condition), directions)
        found = _put(system, z, (directions[:, 0], found.tangent[1]), found, options, landed)
    return None


def _put(system: System, z: FloatArray, along: Direction, point: Point, options: Options, landed: bool) -> Point | None:
    """The equilibrium of a system beside z across a tangent, or, where `landed`, at the t of `point`."""
    across = (np.zeros(system.size), 1.0) if landed else along
    found = corrected(system, z, point.t, across, (z, point.t), 0.0, options.tolerance, CARRIED)
    side = None if found is None else tangent(system, found[0], found[1], along)
    if found is None or side is None:
        return None
    return replace(
        point, system=system, z=found[0], t=found[1], tangent=side[0], unstable=side[1], norm=found[3]
    )  # fmt: skip


def around(start: Point, special: Special, step: float, options: Options) -> Special | None:
    """What is like `special`, and nearest to it, within some steps around the one from `start`."""
    for back, ahead in WINDOWS:
        first = start if back == 0.0 else at(start, back * step, options.tolerance)
        if first is None:
            continue
        reach = (ahead - back) * step
        after = at(first, reach, options.tolerance)
        if after is None:
            continue
        same = [one for one in _found(first, after, reach, options) if one.kind == special.kind]
        if special.modes.shape[1] == 1:  # of two that finer elements no longer tell apart the one that it is
            same = [part for one in same for part in one.apart or (one,)]
        if same:
            return min(same, key=lambda one: abs(one.point.t - special.point.t))
    return None


def _found(first: Point, after: Point, reach: float, options: Options) -> list[Special]:
    if locate.leaves_convexity(first, after):
        lost = locate.unposed(first, after, reach, options)
        return [] if lost is None else [*_met(first, lost.point, lost.point.arc - first.arc, options), lost]
    return _met(first, after, reach, options)


def _met(first: Point, after: Point, reach: float, options: Options) -> list[Special]:
    slacks = after.system.slacks(after.z, after.t)
    if (slacks < -locate.BROKEN).any():
        event = locate.broken(first, after, reach, options)
        return [] if event is None else event[0]
    return locate.specials(first, after, reach, options) or []
