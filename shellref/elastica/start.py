r"""The planar elastica from a given shape, or along given problems: for strips that have several equilibria.

`solve_near` takes theta(s) from elsewhere (another model's equilibrium) and finds the equilibrium beside it by Newton;
the force of a held end begins at the one that balances the given shape best (least squares: the residual is affine in
it). `solve_along` begins at the natural shape of the first problem and goes on to each of the others in turn, so that
the branch is that of the way and not of the natural shape of the last.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from shellref import law
from shellref.elastica.arc import ArcOptions, point_at, trace
from shellref.elastica.contact import ways
from shellref.elastica.fem import Array
from shellref.elastica.held import Arrival, best_end, natural_state, not_begun, plain_steps
from shellref.elastica.path import ElasticaOptions
from shellref.elastica.problem import ElasticaProblem, LoadPath
from shellref.elastica.result import ElasticaResult, ElasticaStatus
from shellref.elastica.solve import arrived, graded_nodes
from shellref.elastica.system import System
from shellref.law import Law

DEGREE = 3
"""Degree of the elements here."""

STEPS = 60
"""Newton iterations from a given shape, each turning no section by more than HALF_TURN in all."""

HALF_TURN = math.pi


def joints_for(problem: ElasticaProblem, elements: int, degree: int = DEGREE) -> Array:
    """Joints (n + 1,): graded towards the clamp's layer and, where the end is held too, towards that end alike."""
    if problem.cantilever:
        return graded_nodes(elements, problem, degree)
    half = graded_nodes(max(1, elements // 2), replace(problem, curvature=(0.0, 0.0)), degree)
    return law.cut(np.concatenate([0.5 * half, 1.0 - 0.5 * half[-2::-1]]), problem.curvature)


def halved(joints: Array) -> Array:
    """Every element cut in two."""
    return np.sort(np.concatenate([joints, 0.5 * (joints[1:] + joints[:-1])]))


def solve_near(
    problem: ElasticaProblem,
    s: ArrayLike,
    theta: ArrayLike,
    nodes: int | ArrayLike = 40,
    degree: int = DEGREE,
    options: ElasticaOptions | None = None,
    estimate_error: bool = True,
) -> ElasticaResult | None:
    """The equilibrium beside the shape theta (k,) at abscissae s (k,) ascending; None when Newton finds none there.

    Raises ValueError as `ElasticaProblem.check_reach`.
    """
    options = options or ElasticaOptions()
    problem.check_reach()
    joints = joints_for(problem, int(nodes), degree) if isinstance(nodes, int) else np.asarray(nodes, dtype=float)
    result = _near(problem, joints, degree, options, np.asarray(s, dtype=float), np.asarray(theta, dtype=float))
    if result is None or not estimate_error:
        return result
    finer = _near(problem, halved(joints), degree, options, result.nodes, result.theta)
    return result if finer is None else with_error(result, finer)


def solve_along(
    problems: Sequence[ElasticaProblem],
    nodes: int = 40,
    degree: int = DEGREE,
    options: ElasticaOptions | None = None,
    estimate_error: bool = True,
) -> ElasticaResult:
    """The end of the way from the natural shape of the first problem, without its loads, to the others in order.

    `options.arc_length`: "always" follows every way by arc length; "auto" the first one, and one whose end is held;
    "never" none. A way that does not arrive ends the solve there: its status and message say where.
    Raises ValueError for fewer than two problems, or ones held differently (`LoadPath`).
    """
    if len(problems) < 2:
        raise ValueError(f"problems: {len(problems)}, must be two or more")
    options = options or ElasticaOptions()
    problems[-1].check_reach()
    heaviest = max(problems, key=lambda p: p.load)
    joints = law.cut(joints_for(heaviest, nodes, degree), *(problem.curvature for problem in problems))
    result = _along(problems, joints, degree, options)
    if not estimate_error or result.load_factor < 1.0:
        return result
    finer = _along(problems, halved(joints), degree, options)
    return result if finer.load_factor < 1.0 else with_error(result, finer)


def with_error(result: ElasticaResult, finer: ElasticaResult) -> ElasticaResult:
    """`result` with the largest distance of its centreline to that of the halved elements, in l."""
    distance = np.linalg.norm(finer.position(finer.nodes) - result.position(finer.nodes), axis=1)
    return replace(result, error=float(distance.max()))


def natural_start(problem: ElasticaProblem, curvature: Law) -> ElasticaProblem:
    """The same strip, unloaded and naturally bent by this law (1/l), its end where that shape has it."""
    bent = replace(problem, curvature=curvature, gamma=0.0, force=(0.0, 0.0))
    start = problem.start_angle or 0.0
    chord = bent.natural_chord() * complex(math.cos(start), math.sin(start))
    own = start + float(bent.natural_turn(np.array(1.0)))
    return replace(
        bent,
        end=None if problem.end is None else (chord.real, chord.imag),
        end_angle=None if problem.end_angle is None else own,
    )


def _tolerance(problem: ElasticaProblem, options: ElasticaOptions) -> float:
    return options.tolerance * max(1.0, *law.sizes(problem.curvature), math.sqrt(problem.load))


def _near(
    problem: ElasticaProblem, joints: Array, degree: int, options: ElasticaOptions, s: Array, theta: Array
) -> ElasticaResult | None:
    if problem.touching:
        return ways.near(problem, joints, degree, _tolerance(problem, options), s, theta)
    began = time.perf_counter()
    system = System(joints, degree, LoadPath(problem, problem))
    z = np.zeros(system.size)
    z[: system.count] = system.discrete.projected(np.interp(system.discrete.s, s, theta))
    angles = [a for a in (problem.start_angle, problem.end_angle) if a is not None]
    z[system.discrete.given] = angles
    if len(system.normals):
        free = system.discrete.free
        rows = system.residual(z, 1.0)[free]
        z[system.count :] = np.linalg.lstsq(system.holding(z)[:, free].T, rows, rcond=None)[0]
    tolerance = _tolerance(problem, options)
    solved = system.newton(z, 1.0, tolerance, STEPS, most_turn=HALF_TURN)
    point = None if solved.z is None else point_at(system, solved.z, 1.0, ArcOptions(tolerance=tolerance))
    if point is None:
        return None
    end = Arrival(system, replace(point, norm=solved.norm), solved.iterations, 1, 0, 0, "")
    return arrived(problem, degree, False, end, began)


def _along(problems: Sequence[ElasticaProblem], joints: Array, degree: int, options: ElasticaOptions) -> ElasticaResult:
    if problems[-1].touching:
        return ways.along(problems, joints, degree, [_tolerance(problem, options) for problem in problems])
    began = time.perf_counter()
    z: Array | None = None
    iterations = steps = limits = switches = 0
    result: ElasticaResult | None = None
    for index, (first, last) in enumerate(pairwise(problems)):
        system = System(joints, degree, LoadPath(first, last))
        tolerance = max(_tolerance(first, options), _tolerance(last, options))
        arc = ArcOptions(tolerance=tolerance, steps=options.arc_steps)
        first_z = natural_state(system) if z is None else z
        start = point_at(system, first_z, 0.0, arc)
        by_arc = options.arc_length == "always" or (
            options.arc_length == "auto" and (index == 0 or last.end is not None)
        )
        if start is None:
            end = not_begun(system, first_z)
        elif by_arc:
            end = best_end(system, trace(system, start, 1.0, (-1.0, 1.0), arc), arc, options)
        else:
            end = plain_steps(system, start, tolerance, options)
        iterations, steps = iterations + end.iterations, steps + end.steps
        limits, switches = limits + end.limits, switches + end.switches
        end = replace(end, iterations=iterations, steps=steps, limits=limits, switches=switches)
        result = arrived(last, degree, False, end, began)
        if end.stopped:
            where = f"stage {index} of {len(problems) - 2}: " if len(problems) > 2 and index else ""
            said = result.message
            if by_arc and end.limits:
                said = (
                    f"the branch turns round at a limit point ({end.limits} in all) and does not come to the end of "
                    "the way: begin on another branch"
                )
            return replace(result, message=f"{where}{said}")
        z = end.point.z
    assert result is not None  # there are two problems or more
    if result.status is ElasticaStatus.UNSTABLE and len(problems) > 2:
        return replace(result, message=f"{result.message} (at the end of the path)")
    return result
