"""The same scene through another formulation, for comparison: the thesis's matrices, or the chained model with an end.

The other model finds the point; the mixed model takes its shape over, gives the multipliers and judges stability.
Iterations, residual and time are the other model's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbon.contact import Wall
from ribbon.find import relax
from ribbon.problems.layout import at_joints
from ribbon.problems.mixed import MixedProblem
from ribbon.solvers import ipopt
from ribbon.solvers.problem import RESIDUAL_TOLERANCE, Minimum
from ribbon.thesis.chained_clamped import ChainedClampedProblem
from ribbon.thesis.matrix import MatrixProblem

FloatArray = NDArray[np.float64]

#: Code of a minimum whose frames are flipped.
FLIPPED = 9001


def twin(problem: MixedProblem) -> MatrixProblem | ChainedClampedProblem:
    """The problem in the formulation that its `model` names."""
    if problem.model == "matrix":
        planes = tuple(wall for wall in problem.walls if isinstance(wall, Wall))  # it is asked for with no others
        return MatrixProblem(
            problem.strip, problem.start, problem.end, problem.closure, planes, problem.gravity, problem.energy,
            problem.lengths, problem.held_by, problem.reference, problem.origin, problem.exponent_limit,
        )  # fmt: skip
    assert problem.start is not None
    assert problem.end is not None
    return ChainedClampedProblem(
        problem.strip, problem.start, problem.end, problem.gravity, problem.energy, problem.lengths
    )


def minimum(
    problem: MixedProblem,
    x: FloatArray,
    options: dict[str, Any] | None = None,
    progress: Callable[[int, float, float], None] | None = None,
) -> Minimum:
    """Stationary point found by the other model from the shape x, as unknowns of `problem`."""
    other = twin(problem)
    point = ipopt.minimise(other, other.state(*problem.joint_values(x)), options, progress)
    mixed = problem.with_changes(model="mixed")
    y = mixed.state(*at_joints(other.parameters(point.x), problem.lengths))
    if other.flipped(point.x):
        return _as_found(point, problem, y, FLIPPED)
    if point.residual > RESIDUAL_TOLERANCE:
        return _as_found(point, problem, y, point.code)
    near = relax.from_near(mixed, y)
    if near.residual > RESIDUAL_TOLERANCE:
        return _as_found(point, problem, y, point.code)
    return replace(
        near, iterations=point.iterations, residual=max(point.residual, near.residual), code=point.code,
        message=point.message, seconds=point.seconds,
    )  # fmt: skip


def _as_found(point: Minimum, problem: MixedProblem, y: FloatArray, code: int) -> Minimum:
    return replace(
        point, x=y, multipliers=np.zeros(problem.size), rows=np.zeros(problem.constraint_bounds()[0].size), code=code
    )
