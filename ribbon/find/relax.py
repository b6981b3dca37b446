"""From a starting shape to a stationary point of a mixed problem: coarse to fine, boxed first, several barriers.

A minimiser far from the constraints may turn the rulings along the strip (|eta| in the tens) and stop there, in a local
minimum that no ribbon of this width is meant to have. So eta and omega are boxed first; a point that touches the box is
no solution and is followed without it. Many segments from a far start are reached over a few (the shapes nest).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbon.find import doubling
from ribbon.find.tubes import wound
from ribbon.obstacle import Obstacle
from ribbon.problems.chained import ChainedProblem
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.problems.transfer import merged, resample, transferred
from ribbon.solid import Face
from ribbon.solvers import budget, choose, cyipopt_api, newton_rows
from ribbon.solvers.problem import RESIDUAL_TOLERANCE, Minimum

FloatArray = NDArray[np.float64]
Progress = Callable[[int, float, float], None]

#: Bounds of |eta| and, over the largest of the start, of |omega| l in the first attempt.
ETA_BOX = 3.0
OMEGA_BOX = 30.0
#: Segments on which the chained model starts a ribbon of more segments that is held at s = 0 only.
CHAINED_START = 100
#: Misfit (l, rad) up to which a start is near: it is relaxed where it stands.
NEAR = 0.02
#: Segments above which a far start is first solved on fewer.
COARSE = 40
#: Barriers tried in turn, from a far start.
ATTEMPTS: tuple[dict[str, Any], ...] = (
    {"mu_init": 1e-3},
    {"mu_init": 0.1},
    {"mu_strategy": "adaptive"},
    {"mu_init": 1e-4},
)
_ATTEMPT_ITERATIONS = 250


def is_far(problem: MixedProblem) -> bool:
    """Whether rows beside the glue make a start infeasible: an end held, a seam, walls."""
    return problem.end is not None or problem.closure is not None or bool(problem.walls)


def misfit(problem: MixedProblem, x: FloatArray) -> float:
    """How far the shape is from where it is held: largest violation of end or seam (l, rad) and of the walls (l)."""
    worst = 0.0
    for name, rows in problem.blocks().items():
        if name.startswith(("end_", "wall_", "touch_")):
            c = rows.values(x)
            worst = max(worst, float(np.max(np.maximum(rows.lower - c, c - rows.upper), initial=0.0)))
    return worst


def touches_box(problem: MixedProblem, x: FloatArray) -> bool:
    """Whether omega or eta lie on the problem's box."""
    if problem.box is None:
        return False
    omega, eta = (np.abs(values).max() for values in problem.joint_values(x))
    return bool(omega > 0.999 * problem.box[0] or eta > 0.999 * problem.box[1])


def placed(problem: Problem, omega: FloatArray, eta: FloatArray) -> FloatArray:
    """State of the shape with omega, eta (p + 1,); one whose ends are free is put on the free side of the walls."""
    x = problem.state(omega, eta)
    if problem.walls and all(clamp is None or clamp.position is None for clamp in (problem.start, problem.end)):
        assert isinstance(problem, MixedProblem)
        positions = problem.layout.positions(x)
        for wall in problem.walls:
            if isinstance(wall, Obstacle) and not isinstance(wall, Face):
                positions += _clear(wall.scaled(problem.strip.length), positions, problem.half_width)
                continue
            normal = np.asarray(wall.axis if isinstance(wall, Face) else wall.normal)
            depth = float(np.min((positions - np.asarray(wall.point) / problem.strip.length) @ normal))
            shift = max(0.0, problem.half_width - depth)
            positions += shift * normal
    return x


def _clear(surface: Obstacle, positions: FloatArray, margin: float) -> FloatArray:
    """The shift (3,) of a shape's points (k, 3) that puts it before an obstacle: out of it along the normal of its
    middle until all are half a width away; to the middle of what it is inside of."""
    gaps, _, _ = surface.derivatives(positions)
    if float(gaps.min()) >= 0.0:
        return np.zeros(3)
    middle = positions.mean(axis=0)
    if surface.inside:
        return np.asarray(surface.across @ (np.asarray(surface.point) - middle))
    normal = surface.derivatives(middle[None, :])[1][0]
    if not normal.any():
        normal = np.linalg.svd(surface.across)[2][0]
    along = positions @ normal
    top = float(np.asarray(surface.point) @ normal) + surface.radius + margin
    return np.asarray(max(0.0, top - float(along.min())) * normal)


def minimum(
    problem: MixedProblem,
    x: FloatArray,
    options: dict[str, Any] | None = None,
    progress: Progress | None = None,
    warm: tuple[FloatArray, FloatArray] | None = None,
) -> Minimum:
    """Stationary point from x; `warm`: multipliers of rows and bounds of a neighbouring problem, same structure."""
    if warm is not None:
        return choose.minimise(problem, x, options, progress, warm)
    if not is_far(problem):
        plain = problem.start is not None and problem.start.is_whole
        if plain and problem.lengths.size > CHAINED_START:
            return _through_chained(problem, x, options, progress)
        direct = choose.minimise(problem, x, options, progress)
        if plain and direct.residual > RESIDUAL_TOLERANCE:
            other = _through_chained(problem, x, options, progress)
            return other if other.residual < direct.residual else direct
        return direct
    rolled = wound.minimum(problem, x, options, progress, from_near)
    if rolled is not None:
        return rolled
    if problem.lengths.size > COARSE:
        if misfit(problem, x) <= NEAR:  # few segments would lose a delicate state, such as a band on its edge
            near = from_near(problem, x, options, progress)
            if near.residual <= RESIDUAL_TOLERANCE:
                return near
        lengths = merged(problem.lengths)
        coarse = problem.with_changes(lengths=lengths)
        first = minimum(coarse, transferred(problem, x, coarse), options, progress)
        if first.residual <= RESIDUAL_TOLERANCE:
            above = doubling.doubled(coarse, first, problem) if doubling.is_possible(problem, options) else None
            if above is not None:
                return above
            y = transferred(coarse, first.x, problem)
            near = from_near(problem, y, options, progress)
            if near.residual <= RESIDUAL_TOLERANCE:
                return replace(
                    near, iterations=near.iterations + first.iterations, seconds=near.seconds + first.seconds
                )
    return from_far(problem, x, options, progress)


def _through_chained(
    problem: MixedProblem, x: FloatArray, options: dict[str, Any] | None, progress: Progress | None
) -> Minimum:
    """Many segments held at s = 0 only: the chained model on few of them first, which has no constraints to violate."""
    lengths = problem.lengths
    while lengths.size > CHAINED_START:
        lengths = merged(lengths)
    assert problem.start is not None
    few = ChainedProblem.twin(problem, lengths)
    shape = resample(problem, x, lengths)
    first = choose.minimise(few, few.state(*shape), options, progress)
    if first.residual > RESIDUAL_TOLERANCE and not np.any(shape[1]):
        first = choose.minimise(replace(few, planar=True, _cache={}), few.state(*shape), options, progress)
    problem.counters.add(few.counters)
    if first.residual > RESIDUAL_TOLERANCE:
        return choose.minimise(problem, x, options, progress)
    s = np.concatenate([[0.0], np.cumsum(lengths)])
    there = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    omega, eta = few.joint_values(first.x)
    bent = few.in_plane_values(first.x)
    sideways = None if bent is None else np.interp(there, s, bent)
    shape = np.interp(there, s, omega), np.interp(there, s, eta)
    near = from_near(problem, problem.state(*shape, sideways), options, progress)
    if near.residual > RESIDUAL_TOLERANCE:
        return choose.minimise(problem, x, options, progress)
    return replace(near, iterations=near.iterations + first.iterations, seconds=near.seconds + first.seconds)


def from_near(
    problem: MixedProblem, x: FloatArray, options: dict[str, Any] | None = None, progress: Progress | None = None
) -> Minimum:
    """From a shape close to the solution: small barrier, boxed, one attempt."""
    return once(problem, x, {"mu_init": 1e-5, **(options or {})}, progress)


def from_far(
    problem: MixedProblem, x: FloatArray, options: dict[str, Any] | None = None, progress: Progress | None = None
) -> Minimum:
    """Attempts with different barriers until one converges; otherwise the one with the smallest residual."""
    best: Minimum | None = None
    iterations, seconds = 0, 0.0
    for attempt in ATTEMPTS:
        if best is not None and not (set(attempt) <= set(newton_rows.OPTIONS) or cyipopt_api.is_there()):
            continue  # one that only Ipopt knows
        point = once(problem, x, {**attempt, "max_iter": _ATTEMPT_ITERATIONS, **(options or {})}, progress)
        iterations += point.iterations
        seconds += point.seconds
        if best is None or not best.residual <= point.residual:
            best = point
        if point.residual <= RESIDUAL_TOLERANCE or budget.spent():
            break
    assert best is not None
    return replace(best, iterations=iterations, seconds=seconds)


def once(problem: MixedProblem, x: FloatArray, options: dict[str, Any], progress: Progress | None = None) -> Minimum:
    """Boxed minimum; where it touches the box, the minimum without it from there."""
    omega, eta = (float(np.abs(values).max()) for values in problem.joint_values(x))
    steepest = max(OMEGA_BOX, 3.0 * eta) if problem.fields.free else max(ETA_BOX, 2.0 * eta)
    boxed = problem.with_changes(box=(max(OMEGA_BOX, 3.0 * omega), steepest))
    point = choose.minimise(boxed, x, options, progress)
    problem.counters.add(boxed.counters)
    if not touches_box(boxed, point.x):
        return point
    free = choose.minimise(problem, point.x, {**options, "mu_init": 1e-4}, progress)
    return replace(free, iterations=free.iterations + point.iterations, seconds=free.seconds + point.seconds)
