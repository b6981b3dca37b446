"""A strip held on its walls' side between the joints too, where it touches them (docs/theory.md, eq. (5.7)).

Rows at joints alone let a strip through between them, and hold it at joints where it would touch beside them. Where an
equilibrium reaches beyond a wall, or a joint of it pushes by itself, the whole segment is held at each edge that does:
where it is nearest to the wall (`ribbon.problems.touching`), and the equilibrium is found again from there: an exchange
method for the condition at every abscissa, with the points of contact as functions of the shape (R. Hettich and K.
Kortanek 1993, doi:10.1137/1035089). What does not push is let go at the end, which changes nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbon import penetration
from ribbon.find import relax
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.touching import Touch
from ribbon.solvers import choose
from ribbon.solvers.budget import spent
from ribbon.solvers.problem import Minimum, kkt_residual

FloatArray = NDArray[np.float64]
Progress = Callable[[int, float, float], None]

#: Depth (l) behind a wall from which a segment is held.
DEPTH = 1e-9
#: Rounds of holding and solving, at the most.
ROUNDS = 20
#: Iterations of a minimiser that begins with the multipliers of the round before.
_WARM_ITERATIONS = 150
#: Part of a wall's normal, of the weight or of an end force along t_y up to which none of them pushes a strip aside,
#: and amplitudes that are tried of a shape that is bent aside.
_HEAD_ON = 1e-12
_BENDS = tuple(0.05 * 1.25**k for k in range(28))
#: Push (D w / l^2) below which what is held is let go; part of the wall's largest push that counts as one.
_PUSHES = 1e-9
_CLEARLY = 1e-4
#: Nearest (in lengths of the segment) that a point of contact is kept to the joint behind it, so that the segment is
#: the same.
_APART = 1e-9


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
    aside = [np.asarray(wall.normal) for wall in problem.walls]
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
    problem: MixedProblem, found: Minimum, options: dict[str, Any] | None = None, progress: Progress | None = None
) -> tuple[MixedProblem, Minimum]:
    """The problem with the segments held that an equilibrium `found` of it needs, and the equilibrium then.

    Where none is found within the tolerance, the one that penetrates least is.
    """
    if not problem.walls or not found.residual <= relax.RESIDUAL_TOLERANCE:
        return problem, found
    best, least = (problem, found), np.inf
    for _ in range(ROUNDS):
        minima = penetration.minima(problem, found.x, -DEPTH)
        depth = max((-distance for distance, _ in minima), default=0.0)
        if depth < least:
            best, least = (problem, found), depth
        fresh = _fresh(problem, [touch for _, touch in minima] + _alone(problem, found))
        if not fresh or spent():
            break
        more = problem.with_changes(touching=(*problem.touching, *fresh))  # those of old first, in their order
        again = _again(problem, more, found, options, progress)
        if again.residual > relax.RESIDUAL_TOLERANCE:
            break
        again = replace(again, iterations=again.iterations + found.iterations, seconds=again.seconds + found.seconds)
        more.counters.add(problem.counters)
        problem, found = more, again
    else:
        minima = penetration.minima(problem, found.x, -DEPTH)
        if max((-distance for distance, _ in minima), default=0.0) < least:
            best = problem, found
    return let_go(*best)


def _fresh(problem: MixedProblem, touches: list[Touch]) -> tuple[Touch, ...]:
    """One touch for each segment and edge that is not held yet."""
    held = {(touch.wall, problem.segment_at(touch.s), touch.side) for touch in problem.touching}
    found: dict[tuple[int, int, float], Touch] = {}
    for touch in touches:
        place = touch.wall, problem.segment_at(touch.s), touch.side
        if place not in held:
            found.setdefault(place, touch)
    return tuple(sorted(found.values()))


def _alone(problem: MixedProblem, found: Minimum) -> list[Touch]:
    """Of joints that push on a wall and whose neighbours do not: the segments on both sides of them."""
    touches: list[Touch] = []
    starts = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    slices, blocks = problem.block_slices(), problem.blocks()
    for k in range(len(problem.walls)):
        block: Any = blocks[f"wall_{k}"]
        push = np.zeros((starts.size, 2))
        push[block.joints] = -found.rows[slices[f"wall_{k}"]].reshape(-1, 2)
        pushes = push > max(_PUSHES, _CLEARLY * float(push.max(initial=0.0)))
        inner = pushes[1:-1] & ~pushes[:-2] & ~pushes[2:]
        for i, edge in zip(*np.nonzero(inner), strict=True):
            middles = 0.5 * (starts[i] + starts[i + 1]), 0.5 * (starts[i + 1] + starts[i + 2])
            touches += [Touch(k, float(s), 1.0 - 2.0 * float(edge)) for s in middles]
    return touches


def _again(
    old: MixedProblem, fresh: MixedProblem, found: Minimum, options: dict[str, Any] | None, progress: Progress | None
) -> Minimum:
    """The equilibrium with more points held, from the one without: with its multipliers, so that it stays on its
    branch, and else without."""
    rows = _carried(old, fresh, found)
    warm = choose.minimise(
        fresh, found.x, {"max_iter": _WARM_ITERATIONS, **(options or {})}, progress, (rows, found.multipliers)
    )
    if warm.residual <= relax.RESIDUAL_TOLERANCE:
        return warm
    cold = relax.from_near(fresh, found.x, options, progress)
    return replace(cold, iterations=cold.iterations + warm.iterations, seconds=cold.seconds + warm.seconds)


def _carried(old: MixedProblem, fresh: MixedProblem, found: Minimum) -> FloatArray:
    """Multipliers of the rows of `fresh`, which holds more than `old`: what a joint pushed whose rows are gone goes to
    the segments beside it."""
    rows = np.zeros(fresh.row_count)
    slices, blocks = fresh.block_slices(), fresh.blocks()
    glue = fresh.row_count - sum(block.count for block in blocks.values())
    rows[:glue] = found.rows[:glue]
    for name, where in old.block_slices().items():
        own: Any = old.blocks()[name]
        if not name.startswith("wall_"):
            rows[slices[name].start : slices[name].start + where.stop - where.start] = found.rows[where]
            continue
        here: Any = blocks[name]
        place = {int(joint): k for k, joint in enumerate(here.joints)}
        push = rows[slices[name]].reshape(-1, 2)
        heirs: Any = blocks.get(f"touch_{name.removeprefix('wall_')}")
        for joint, pair in zip(own.joints, found.rows[where].reshape(-1, 2), strict=True):
            if joint in place:
                push[place[int(joint)]] = pair
                continue
            first = slices[f"touch_{name.removeprefix('wall_')}"].start
            for side, value in zip((1.0, -1.0), pair, strict=True):
                beside = np.nonzero((heirs.sides == side) & np.isin(heirs.segments, (joint - 1, joint)))[0]
                rows[first + beside] += value / beside.size
    return rows


def let_go(problem: MixedProblem, found: Minimum) -> tuple[MixedProblem, Minimum]:
    """Without what does not push, each touch at its place: the same equilibrium."""
    if not problem.touching:
        return problem, found
    slices, blocks = problem.block_slices(), problem.blocks()
    starts = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    kept: list[Touch] = []
    pushes: dict[int, list[float]] = {}
    for k in range(len(problem.walls)):
        touches = [touch for touch in problem.touching if touch.wall == k]
        if not touches:
            continue
        block: Any = blocks[f"touch_{k}"]
        own = problem.lengths[block.segments]
        places = starts[block.segments] + np.clip(block.places(found.x), _APART * own, (1.0 - _APART) * own)
        rows = found.rows[slices[f"touch_{k}"]]
        pushing = np.nonzero(-rows > _PUSHES)[0]
        kept += [touches[j]._replace(s=float(places[j])) for j in pushing]
        pushes[k] = [float(rows[j]) for j in pushing]
    fewer = problem.with_changes(touching=tuple(kept))
    fewer.counters.add(problem.counters)
    rows = np.zeros(fewer.row_count)
    here = fewer.block_slices()
    glue = problem.row_count - sum(block.count for block in blocks.values())
    rows[:glue] = found.rows[:glue]
    for name, where in slices.items():
        if name.startswith("touch_"):
            if name in here:
                rows[here[name]] = pushes[int(name.removeprefix("touch_"))]
        elif name.startswith("wall_"):
            mine: Any = fewer.blocks()[name]
            theirs: Any = blocks[name]
            push = rows[here[name]].reshape(-1, 2)
            push[np.isin(mine.joints, theirs.joints)] = found.rows[where].reshape(-1, 2)
        else:
            rows[here[name]] = found.rows[where]
    residual = kkt_residual(fewer, found.x, found.multipliers, rows)
    if residual > relax.RESIDUAL_TOLERANCE:
        return problem, found
    return fewer, replace(found, rows=rows, residual=residual)
