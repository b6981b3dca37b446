"""A strip held on its walls' side between the joints too, where it would go through (docs/theory.md, eq. (5.7)).

Rows at joints alone let a strip through between them. Where an equilibrium reaches beyond a wall a point is held, at
the deepest place of its edge, and the equilibrium is found again from there: an exchange method for the condition at
every abscissa (R. Hettich and K. Kortanek 1993, doi:10.1137/1035089). Points that do not push are let go at the end,
which changes nothing. Where the strip touches a wall at one place and not along a line, that place is then looked for.

So held, a strip touches beside the place where it would touch, by up to half a segment or by what
`ribbon.judge.penetration.TOLERANCE` lets through, and forces and moments are as far from their limit. Where it pushes
at one place, that is at one joint or point or at two that are neighbours, the segments there are held by rows that
slide (`ribbon.problems.touching`), and the equilibrium is found again, until the place is inside a held segment and
nothing is behind the wall. Line contact is left on its points.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ribbon.contact import Wall
from ribbon.find import relax
from ribbon.find.tubes import wound
from ribbon.judge import penetration
from ribbon.obstacle import Obstacle
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.touching import Touch
from ribbon.solid import Face, Solid
from ribbon.solvers import choose
from ribbon.solvers.budget import spent
from ribbon.solvers.problem import RESIDUAL_TOLERANCE, Minimum, kkt_residual

FloatArray = NDArray[np.float64]
Progress = Callable[[int, float, float], None]

#: Depth (l) behind a wall from which points are held, where one is deeper than an equilibrium may be.
DEPTH = 0.3 * penetration.TOLERANCE
#: Rounds of holding and solving, and points that are held in a round, at the most, from one held point to the next.
ROUNDS = 20
MOST = 7
#: Iterations of a minimiser that begins with the multipliers of the round before.
_WARM_ITERATIONS = 150
#: Part of a wall's normal, of the weight or of an end force along t_y up to which none of them pushes a strip aside,
#: and amplitudes that are tried of a shape that is bent aside.
_HEAD_ON = 1e-12
_BENDS = tuple(0.05 * 1.25**k for k in range(28))
#: Nearest (in lengths of the segment) that a point stands to a joint, which is held anyway, or to another point.
_APART = 1e-4
#: Depth (l) behind a wall at which the place of contact is not in a held segment yet.
NEAREST = 1e-9
#: Times that a place is followed into the next segment.
FOLLOWED = 8
#: Iterations of a minimiser that begins with the multipliers of the round before.
_SLIDING = 60
#: Push (D w / l^2) below which what is held is let go; from which one counts, and part of the largest for that.
_PUSHES = 1e-9
_LEAST = 1e-5
_CLEARLY = 1e-4
#: Largest rounding of a body that is begun with, in segments (and in a box's least size), and by how much it falls.
_ROUND, _SHARPER = 0.5, 4.0
#: Neighbours are so many segments apart, at the most.
_NEXT = 1.01
#: Nearest (in lengths of the segment) that a place is kept to the joints of its segment, so that this is the same; how
#: near to a joint the segment beyond it is held too.
_INSIDE = 1e-9
_BESIDE = 0.1


def bent_aside(problem: MixedProblem, omega: FloatArray, eta: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Shapes to start from in the place of a straight one that meets a wall head on, of each kind the least bent that
    clears the walls; none for another shape, or where something pushes the strip to a side.

    The straight strip, its loads and its walls are then their own mirror images in the plane across t_y: so is every
    step of a minimiser, and the strip, which would buckle to either side, is pressed on along itself. Both sides are
    mirror images of each other and equally right. The shapes: the first mode of a clamped column whose tip slides,
    ``omega = A (pi / 2) cos(pi s / 2)`` (L. Euler 1744), and arcs ``omega = A``.
    """
    if not problem.walls or np.any(omega) or problem.has_natural_curvature:
        return []
    x = relax.placed(problem, omega, eta)
    across = problem.joints(x)[1][0][:, 1]
    first = problem.layout.positions(x)[0]
    aside = [
        np.asarray(wall.normal)
        if isinstance(wall, Wall)
        else np.asarray(wall.axis)
        if isinstance(wall, Face)
        else np.asarray(wall.point) / problem.strip.length - first
        for wall in problem.walls
    ]
    if problem.gravity is not None and problem.has_gravity:
        aside.append(np.asarray(problem.gravity.up))
    if problem.tip is not None:
        aside.append(np.asarray(problem.tip) / max(1.0, float(np.abs(problem.tip).max())))
    if any(abs(float(across @ v)) > _HEAD_ON for v in aside) or relax.misfit(problem, x) <= penetration.TOLERANCE:
        return []
    s = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    modes = 0.5 * np.pi * np.cos(0.5 * np.pi * s), np.ones_like(s)
    best = []
    for mode in modes:
        tried = [(relax.misfit(problem, relax.placed(problem, a * mode, eta)), a) for a in _BENDS]
        clear = [a for missed, a in tried if missed <= relax.NEAR]
        best.append((clear[0] if clear else min(tried)[1]) * mode)
    return [(shape, eta) for shape in best]


def held(
    problem: MixedProblem, minimum: Minimum, options: dict[str, Any] | None = None, progress: Progress | None = None
) -> tuple[MixedProblem, Minimum]:
    """The problem with the points held that an equilibrium `minimum` of it needs, and the equilibrium then.

    Where none is found within the tolerance, the one that penetrates least is.
    """
    if not problem.walls or not minimum.residual <= RESIDUAL_TOLERANCE:
        return problem, minimum
    best, least = (problem, minimum), np.inf
    for _ in range(ROUNDS):
        minima = penetration.minima(problem, minimum.x, -DEPTH)
        depth = max((-distance for distance, _ in minima), default=0.0)
        if depth < least:
            best, least = (problem, minimum), depth
        beyond = points_beyond(problem, minimum.x, minima) if depth > penetration.TOLERANCE else ()
        if not beyond or spent():
            break
        fresh = problem.with_changes(touching=(*problem.touching, *beyond))  # those of old first, in their order
        again = _again(problem, fresh, minimum, options, progress)
        if again.residual > RESIDUAL_TOLERANCE:
            break
        again = replace(
            again, iterations=again.iterations + minimum.iterations, seconds=again.seconds + minimum.seconds
        )
        fresh.counters.add(problem.counters)
        problem, minimum = fresh, again
    return slid(*let_go(*best), options, progress)


def rounder(problem: MixedProblem) -> list[MixedProblem]:
    """The problem with ever less round edges and corners of its bodies, from half a segment on, down to its own, which
    is left out: a rounder body is inside the one, and what touches it has no particle that is far from its place."""
    own = [wall for wall in problem.walls if isinstance(wall, Solid)]
    found: list[MixedProblem] = []
    radius = _ROUND * float(problem.lengths.max()) * problem.strip.length
    while own and radius > _SHARPER * min(wall.radius for wall in own):
        walls = tuple(_at_least(wall, radius) if isinstance(wall, Solid) else wall for wall in problem.walls)
        found.append(problem.with_changes(walls=walls))
        radius /= _SHARPER
    return found


def _at_least(wall: Solid, radius: float) -> Solid:
    most = np.inf if wall.size is None else _ROUND * float(np.min(wall.size)) * (1.0 - 1e-3)
    return replace(wall, radius=max(wall.radius, min(radius, most)))


def sharpened(
    ways: list[MixedProblem], minimum: Minimum, options: dict[str, Any] | None, progress: Progress | None
) -> tuple[MixedProblem, Minimum] | None:
    """The last of these problems (`rounder`, and the problem itself) and its equilibrium, from that of the first; None
    where one on the way is not found."""
    problem = ways[0]
    for fresh in ways[1:]:
        problem, minimum = held(problem, minimum, options, progress)
        if not minimum.residual <= RESIDUAL_TOLERANCE or spent():
            return None
        fresh = fresh.with_changes(touching=problem.touching)
        fresh.counters.add(problem.counters)
        again = _again(problem, fresh, minimum, options, progress)
        minimum = replace(
            again, iterations=again.iterations + minimum.iterations, seconds=again.seconds + minimum.seconds
        )
        problem = fresh
    return problem, minimum


def points_beyond(problem: MixedProblem, x: FloatArray, minima: list[tuple[float, Touch]]) -> tuple[Touch, ...]:
    """Points to hold where the edges are deep behind walls (`penetration.minima`): between the two held points on
    either side.

    A strip that bends over a wall lies between two points at a depth that falls with the square of their distance: so
    many points are held at once that it falls to DEPTH, if MOST allow; of a round obstacle outside the deepest alone.
    On the round edge of a body, which may be as thin as nothing beside a segment, the deepest slides from the start.
    """
    starts = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    starts[-1] = 1.0
    touches: set[Touch] = set()
    for distance, touch in minima:
        if isinstance(problem.walls[touch.wall], Solid) and penetration.bends(problem, x, touch):
            touches |= _on_edge(problem, touch)
            continue
        known = [t.s for t in problem.touching if t.wall == touch.wall and line(t.side) == line(touch.side)]
        i = int(np.clip(np.searchsorted(starts, touch.s, side="right") - 1, 0, problem.lengths.size - 1))
        if line(touch.side) == penetration.BETWEEN:  # joints are held at their edges alone
            if np.abs(np.subtract(known, touch.s)).min(initial=np.inf) > _APART * problem.lengths[i]:
                inside = _INSIDE * problem.lengths[i]
                s = float(np.clip(touch.s, starts[i] + inside, starts[i + 1] - inside))
                touches.add(Touch(touch.wall, s, touch.side))
            continue
        places = np.union1d(starts, known)
        k = int(np.clip(np.searchsorted(places, touch.s, side="right") - 1, 0, places.size - 2))
        low, high = places[k], places[k + 1]
        if min(touch.s - low, high - touch.s) <= _APART * problem.lengths[i]:
            continue
        wall = problem.walls[touch.wall]
        most = 1 if isinstance(wall, Obstacle) and wall.between else MOST  # what bulges is met at a place, not a line
        count = int(np.clip(np.ceil(np.sqrt(-distance / DEPTH)) - 1, 1, most))
        inner = low + (high - low) * np.arange(1, count + 1) / (count + 1)
        inner[np.argmin(np.abs(inner - touch.s))] = touch.s
        touches |= {Touch(touch.wall, float(s), touch.side) for s in inner}
    return tuple(sorted(touches))


def _on_edge(problem: MixedProblem, touch: Touch) -> set[Touch]:
    """What is to slide on a body's round edge or corner: around a place, in segments where nothing slides there yet."""
    starts = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    side = line(touch.side)
    sliding = {
        problem.segment_at(t.s) for t in problem.touching if t.slides and (t.wall, line(t.side)) == (touch.wall, side)
    }
    return {
        Touch(touch.wall, float(np.clip(touch.s, starts[i] + _INSIDE * own, starts[i + 1] - _INSIDE * own)), side, True)
        for i in _around(problem, touch.s)
        for own in [problem.lengths[i]]
        if i not in sliding
    }


def line(side: float) -> float:
    """Which of the lines along the strip a point at `side` is on: an edge (1 or -1), or what is between them (0)."""
    return side if abs(side) == 1.0 else 0.0


def _by_newton(problem: MixedProblem) -> AbstractContextManager[None]:
    """Beside round obstacles Newton's answer is enough: where it does not arrive there is another way."""
    return choose.using("newton" if problem.obstacles and choose.asked() == "auto" else None)


def _again(
    old: MixedProblem, fresh: MixedProblem, minimum: Minimum, options: dict[str, Any] | None, progress: Progress | None
) -> Minimum:
    """The equilibrium with more points held, from the one without: with its multipliers, so that it stays on its
    branch, and else without."""
    rows = carried_rows(old, fresh, minimum, {})
    with _by_newton(fresh):
        warm = choose.minimise(
            fresh, minimum.x, {"max_iter": _WARM_ITERATIONS, **(options or {})}, progress, (rows, minimum.multipliers)
        )
    if warm.residual <= RESIDUAL_TOLERANCE:
        return warm
    rolled = wound.minimum(fresh, minimum.x, options, progress, relax.from_near)
    if rolled is not None:
        return replace(rolled, iterations=rolled.iterations + warm.iterations, seconds=rolled.seconds + warm.seconds)
    with _by_newton(fresh):
        cold = relax.from_near(fresh, minimum.x, options, progress)
    return replace(cold, iterations=cold.iterations + warm.iterations, seconds=cold.seconds + warm.seconds)


# -- at one place ----------------------------------------------------------------------------------------------------


class _Place(NamedTuple):
    """Where one edge pushes against a wall, at one place: abscissa and total push (D w / l^2)."""

    wall: int
    side: float
    s: float
    push: float


def slid(
    problem: MixedProblem, minimum: Minimum, options: dict[str, Any] | None = None, progress: Progress | None = None
) -> tuple[MixedProblem, Minimum]:
    """The problem whose single places of contact slide, and its equilibrium beside `minimum`; both as they are where
    nothing touches at one place, and where none is found from there."""
    if not problem.walls or not minimum.residual <= RESIDUAL_TOLERANCE or spent():
        return problem, minimum
    places = single_places(problem, minimum)
    if not places or all(place_slides(problem, place) for place in places):
        return problem, minimum
    now, here = with_sliding(problem, minimum, places)
    spent_on = minimum
    for _ in range(FOLLOWED):
        with _by_newton(now):
            again = choose.minimise(
                now, here.x, {"max_iter": _SLIDING, **(options or {})}, progress, (here.rows, here.multipliers)
            )
        if again.residual > RESIDUAL_TOLERANCE:
            return problem, minimum
        spent_on = replace(
            again, iterations=again.iterations + spent_on.iterations, seconds=again.seconds + spent_on.seconds
        )
        now.counters.add(problem.counters)
        minima = penetration.minima(now, again.x, -NEAREST)
        beyond = next_to_slide(now, [touch for _, touch in minima])
        if not beyond:
            if max((-distance for distance, _ in minima), default=0.0) > penetration.TOLERANCE:
                return problem, minimum
            return let_go(now, spent_on)
        now, here = with_more(now, again, beyond)
    return problem, minimum


def single_places(problem: MixedProblem, minimum: Minimum) -> list[_Place]:
    """Where edges push at one place each: one joint or point, or two that are neighbours, off the strip's ends."""
    starts = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    places: list[_Place] = []
    every = [pushed(problem, minimum.x, minimum.rows, k) for k in range(len(problem.walls))]
    least = max(_LEAST, _CLEARLY * max((push for points in every for _, _, push in points), default=0.0))
    for k, points in enumerate(every):
        for side in (1.0, -1.0, 0.0):
            own = sorted((s, push) for s, edge, push in points if edge == side and push > least)
            for group in _groups(problem, own):
                total = sum(push for _, push in group)
                first, last = group[0][0], group[-1][0]
                wide = problem.lengths[problem.segment_at(first)] * _NEXT
                if last - first <= wide and first > 0.0 and last < starts[-1]:
                    places.append(_Place(k, side, sum(s * push for s, push in group) / total, total))
    return places


def pushed(problem: MixedProblem, x: FloatArray, rows: FloatArray, k: int) -> list[tuple[float, float, float]]:
    """Abscissa, edge and push of all joints and points that wall k holds."""
    starts = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    slices, blocks = problem.block_slices(), problem.blocks()
    joints = problem.wall_rows(k).joints
    pairs = -rows[slices[f"wall_{k}"]].reshape(-1, 2)
    points = [
        (float(starts[joint]), side, float(push))
        for joint, pair in zip(joints, pairs, strict=True)
        for side, push in zip((1.0, -1.0), pair, strict=True)
    ]
    if f"touch_{k}" in blocks:
        held = problem.touch_rows(k)
        along = starts[held.segments] + held.places(x)
        pushes = -rows[slices[f"touch_{k}"]]
        points += [(float(s), line(float(v)), float(p)) for s, v, p in zip(along, held.sides, pushes, strict=True)]
    return points


def across(problem: MixedProblem, x: FloatArray, k: int) -> list[float]:
    """Where across, from -1 to 1, each of the points of `pushed` is: round obstacles push between the edges too."""
    sides = [side for _ in problem.wall_rows(k).joints for side in (1.0, -1.0)]
    if f"touch_{k}" in problem.blocks():
        sides += [float(v) for v in problem.touch_rows(k).across(x)]
    return sides


def _groups(problem: MixedProblem, points: list[tuple[float, float]]) -> list[list[tuple[float, float]]]:
    """Points (s, push) in order of s, those together that are neighbours."""
    groups: list[list[tuple[float, float]]] = []
    for s, push in points:
        if groups and s - groups[-1][-1][0] <= _NEXT * problem.lengths[problem.segment_at(groups[-1][-1][0])]:
            groups[-1].append((s, push))
        else:
            groups.append([(s, push)])
    return groups


def place_slides(problem: MixedProblem, place: _Place) -> bool:
    """Whether a place is one that slides already, and is held by nothing else."""
    i = problem.segment_at(place.s)
    near = [
        touch
        for touch in problem.touching
        if (touch.wall, line(touch.side)) == (place.wall, place.side) and abs(problem.segment_at(touch.s) - i) <= 1
    ]
    return bool(near) and all(touch.slides for touch in near)


def _around(problem: MixedProblem, s: float) -> list[int]:
    """The segment around s, and the next one where s is near its joint."""
    i = problem.segment_at(s)
    starts = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    share = (s - starts[i]) / problem.lengths[i]
    minimum = [i]
    if share < _BESIDE and i > 0:
        minimum.append(i - 1)
    if share > 1.0 - _BESIDE and i < problem.lengths.size - 1:
        minimum.append(i + 1)
    return sorted(minimum)


def with_sliding(problem: MixedProblem, minimum: Minimum, places: list[_Place]) -> tuple[MixedProblem, Minimum]:
    """The problem with its places sliding instead of what holds them, and multipliers to begin with."""
    starts = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    shares: dict[Touch, float] = {}
    replaced: set[tuple[int, float, int]] = set()
    for place in places:
        segments = _around(problem, place.s)
        for i in segments:
            s = float(np.clip(place.s, starts[i] + _INSIDE * problem.lengths[i],
                              starts[i + 1] - _INSIDE * problem.lengths[i]))  # fmt: skip
            touch = Touch(place.wall, s, place.side, True)
            shares[touch] = shares.get(touch, 0.0) - place.push / len(segments)
        reach = range(min(segments) - 1, max(segments) + 2)
        replaced |= {(place.wall, place.side, i) for i in reach}
    kept = [
        touch
        for touch in problem.touching
        if (touch.wall, line(touch.side), problem.segment_at(touch.s)) not in replaced
    ]
    fresh = problem.with_changes(touching=(*kept, *sorted(shares)))
    rows = carried_rows(problem, fresh, minimum, shares)
    slices = fresh.block_slices()
    for place in places:  # what joints beside a place pushed is its own now
        block = fresh.wall_rows(place.wall)
        push = rows[slices[f"wall_{place.wall}"]].reshape(-1, 2)
        near = np.abs(starts[block.joints] - place.s) <= _NEXT * problem.lengths[problem.segment_at(place.s)]
        if place.side:
            push[near, int(place.side < 0.0)] = 0.0
    return fresh, replace(minimum, rows=rows)


def next_to_slide(problem: MixedProblem, touches: list[Touch]) -> list[Touch]:
    """What is to slide besides: places behind a wall in segments next to one that slides."""
    sliding = {(t.wall, line(t.side), problem.segment_at(t.s)) for t in problem.touching if t.slides}
    minimum = {}
    for touch in touches:
        i = problem.segment_at(touch.s)
        side = line(touch.side)
        near = {(touch.wall, side, j) for j in (i - 1, i + 1)}
        if near & sliding and (touch.wall, side, i) not in sliding:
            minimum[touch.wall, side, i] = touch._replace(slides=True)
    return sorted(minimum.values())


def with_more(problem: MixedProblem, minimum: Minimum, touches: list[Touch]) -> tuple[MixedProblem, Minimum]:
    """The problem with more that slides."""
    fresh = problem.with_changes(touching=(*problem.touching, *touches))
    return fresh, replace(minimum, rows=carried_rows(problem, fresh, minimum, dict.fromkeys(touches, 0.0)))


def carried_rows(old: MixedProblem, fresh: MixedProblem, minimum: Minimum, own: dict[Touch, float]) -> FloatArray:
    """Multipliers of the rows of `fresh`: those of `old` at the same joints and touches, `own` of others."""
    rows = np.zeros(fresh.row_count)
    slices, blocks = fresh.block_slices(), fresh.blocks()
    glue = fresh.row_count - sum(block.count for block in blocks.values())
    rows[:glue] = minimum.rows[:glue]
    known = dict(own)
    for name, where in old.block_slices().items():
        if name.startswith("touch_"):
            touches = [touch for touch in old.touching if touch.wall == int(name.removeprefix("touch_"))]
            known |= dict(zip(touches, map(float, minimum.rows[where]), strict=True))
        elif name.startswith("wall_"):
            wall = int(name.removeprefix("wall_"))
            here, there = fresh.wall_rows(wall), old.wall_rows(wall)
            push = {int(j): pair for j, pair in zip(there.joints, minimum.rows[where].reshape(-1, 2), strict=True)}
            rows[slices[name]] = np.ravel([push.get(int(j), np.zeros(2)) for j in here.joints])
        else:
            rows[slices[name]] = minimum.rows[where]
    for k in range(len(fresh.walls)):
        touches = [touch for touch in fresh.touching if touch.wall == k]
        if touches:
            rows[slices[f"touch_{k}"]] = [known.get(touch, 0.0) for touch in touches]
    return rows


def let_go(problem: MixedProblem, minimum: Minimum) -> tuple[MixedProblem, Minimum]:
    """Without what does not push, each touch where it has gone: the same equilibrium."""
    if not problem.touching:
        return problem, minimum
    fewer, rows = without_idle(problem, minimum)
    residual = kkt_residual(fewer, minimum.x, minimum.multipliers, rows)
    if residual > RESIDUAL_TOLERANCE:
        return problem, minimum
    return fewer, replace(minimum, rows=rows, residual=residual)


def without_idle(problem: MixedProblem, minimum: Minimum) -> tuple[MixedProblem, FloatArray]:
    """The problem without touches that do not push, each where it has gone, and the multipliers of its rows."""
    slices = problem.block_slices()
    starts = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    kept: dict[Touch, float] = {}
    for k in range(len(problem.walls)):
        touches = [touch for touch in problem.touching if touch.wall == k]
        if not touches:
            continue
        block = problem.touch_rows(k)
        own = problem.lengths[block.segments]
        places = starts[block.segments] + np.clip(block.places(minimum.x), _INSIDE * own, (1.0 - _INSIDE) * own)
        for touch, s, row in zip(touches, places, minimum.rows[slices[f"touch_{k}"]], strict=True):
            if -row > _PUSHES:
                kept[touch._replace(s=float(s)) if touch.slides else touch] = float(row)
    fewer = problem.with_changes(touching=tuple(kept))
    fewer.counters.add(problem.counters)
    return fewer, carried_rows(problem, fewer, minimum, kept)
