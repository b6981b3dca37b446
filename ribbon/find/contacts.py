"""A strip held on its walls' side between the joints too, where it would go through (docs/theory.md, eq. (5.7)).

Rows at joints alone let a strip through between them. Where an equilibrium reaches beyond a wall a point is held, at
the deepest place of its edge, and the equilibrium is found again from there: an exchange method for the condition at
every abscissa (R. Hettich and K. Kortanek 1993, doi:10.1137/1035089). Points that do not push are let go at the end,
which changes nothing.
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

#: Depth (l) behind a wall from which points are held, where one is deeper than an equilibrium may be.
DEPTH = 0.3 * penetration.TOLERANCE
#: Rounds of holding and solving, and points that are held in a round, at the most, from one held point to the next.
ROUNDS = 20
MOST = 7
#: Iterations of a minimiser that begins with the multipliers of the round before.
_WARM_ITERATIONS = 150
#: Nearest (in lengths of the segment) that a point stands to a joint, which is held anyway, or to another point.
_APART = 1e-4
#: Part of a wall's normal, of the weight or of an end force along t_y up to which none of them pushes a strip aside,
#: and amplitudes that are tried of a shape that is bent aside.
_HEAD_ON = 1e-12
_BENDS = tuple(0.05 * 1.25**k for k in range(28))
#: Push (D w / l^2) below which a point is let go.
_PUSHES = 1e-9


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
    """The problem with the points held that an equilibrium `found` of it needs, and the equilibrium then.

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
        beyond = _beyond(problem, minima) if depth > penetration.TOLERANCE else ()
        if not beyond or spent():
            break
        fresh = problem.with_changes(touching=(*problem.touching, *beyond))  # those of old first, in their order
        again = _again(problem, fresh, found, options, progress)
        if again.residual > relax.RESIDUAL_TOLERANCE:
            break
        again = replace(again, iterations=again.iterations + found.iterations, seconds=again.seconds + found.seconds)
        fresh.counters.add(problem.counters)
        problem, found = fresh, again
    return let_go(*best)


def _beyond(problem: MixedProblem, minima: list[tuple[float, Touch]]) -> tuple[Touch, ...]:
    """Points to hold where the edges are deep behind walls (`penetration.minima`): between the two held points on
    either side.

    A strip that bends over a wall lies between two points at a depth that falls with the square of their distance: so
    many points are held at once that it falls to DEPTH, if MOST allow.
    """
    starts = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    starts[-1] = 1.0
    found: set[Touch] = set()
    for distance, touch in minima:
        known = [t.s for t in problem.touching if (t.wall, t.side) == (touch.wall, touch.side)]
        places = np.union1d(starts, known)
        k = int(np.clip(np.searchsorted(places, touch.s, side="right") - 1, 0, places.size - 2))
        low, high = places[k], places[k + 1]
        i = int(np.clip(np.searchsorted(starts, touch.s, side="right") - 1, 0, problem.lengths.size - 1))
        if min(touch.s - low, high - touch.s) <= _APART * problem.lengths[i]:
            continue
        count = int(np.clip(np.ceil(np.sqrt(-distance / DEPTH)) - 1, 1, MOST))
        inner = low + (high - low) * np.arange(1, count + 1) / (count + 1)
        inner[np.argmin(np.abs(inner - touch.s))] = touch.s
        found |= {Touch(touch.wall, float(s), touch.side) for s in inner}
    return tuple(sorted(found))


def _again(
    old: MixedProblem, fresh: MixedProblem, found: Minimum, options: dict[str, Any] | None, progress: Progress | None
) -> Minimum:
    """The equilibrium with more points held, from the one without: with its multipliers, so that it stays on its
    branch, and else without."""
    rows = np.zeros(fresh.row_count)
    glue = fresh.row_count - sum(block.count for block in fresh.blocks().values())
    rows[:glue] = found.rows[:glue]
    slices = fresh.block_slices()
    for name, where in old.block_slices().items():
        first = slices[name].start
        rows[first : first + where.stop - where.start] = found.rows[where]
    warm = choose.minimise(
        fresh, found.x, {"max_iter": _WARM_ITERATIONS, **(options or {})}, progress, (rows, found.multipliers)
    )
    if warm.residual <= relax.RESIDUAL_TOLERANCE:
        return warm
    cold = relax.from_near(fresh, found.x, options, progress)
    return replace(cold, iterations=cold.iterations + warm.iterations, seconds=cold.seconds + warm.seconds)


def let_go(problem: MixedProblem, found: Minimum) -> tuple[MixedProblem, Minimum]:
    """Without the points that do not push: the same equilibrium."""
    if not problem.touching:
        return problem, found
    slices, keep = problem.block_slices(), np.ones(found.rows.size, dtype=bool)
    kept: list[Touch] = []
    for k in range(len(problem.walls)):
        touches = [touch for touch in problem.touching if touch.wall == k]
        if touches:
            where = slices[f"touch_{k}"]
            pushes = -found.rows[where] > _PUSHES
            keep[where] = pushes
            kept += [touch for touch, pushing in zip(touches, pushes, strict=True) if pushing]
    fewer = problem.with_changes(touching=tuple(kept))
    fewer.counters.add(problem.counters)
    rows = found.rows[keep]
    residual = kkt_residual(fewer, found.x, found.multipliers, rows)
    if residual > relax.RESIDUAL_TOLERANCE:
        return problem, found
    return fewer, replace(found, rows=rows, residual=residual)
