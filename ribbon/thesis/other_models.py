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

from ribbon.find import relax
from ribbon.problems.mixed import STRIDE, MixedProblem
from ribbon.solvers import ipopt
from ribbon.solvers.problem import Minimum
from ribbon.thesis.chained_clamped import ChainedClampedProblem
from ribbon.thesis.matrix import MatrixProblem

FloatArray = NDArray[np.float64]

#: Code of a minimum whose frames are flipped.
FLIPPED = 9001


def twin(problem: MixedProblem) -> Any:
    """The problem in the formulation that its `model` names."""
    if problem.model == "matrix":
        return MatrixProblem(
            problem.strip, problem.start, problem.end, problem.closure, problem.walls, problem.gravity, problem.energy,
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
    omega, eta = x[7 : problem.last + 9 : STRIDE], x[8 : problem.last + 9 : STRIDE]
    if problem.model == "matrix":
        start = other.state(omega, eta)
    else:
        start = np.empty(2 * problem.lengths.size + 2)
        start[0], start[1] = omega[0], eta[0]
        start[2::2], start[3::2] = np.diff(omega) / problem.lengths, np.diff(eta) / problem.lengths
    found = ipopt.minimise(other, start, options, progress)
    q = other.parameters(found.x)
    there = np.append(q[:, 1], q[-1, 1] + q[-1, 0] * problem.lengths[-1])
    turned = np.append(q[:, 3], q[-1, 3] + q[-1, 2] * problem.lengths[-1])
    mixed = problem.with_changes(model="mixed")
    y = mixed.state(there, turned)
    if other.flipped(found.x):
        return _as_found(found, problem, y, FLIPPED)
    if found.residual > relax.RESIDUAL_TOLERANCE:
        return _as_found(found, problem, y, found.code)
    near = relax.from_near(mixed, y)
    if near.residual > relax.RESIDUAL_TOLERANCE:
        return _as_found(found, problem, y, found.code)
    return replace(
        near, iterations=found.iterations, residual=max(found.residual, near.residual), code=found.code,
        message=found.message, seconds=found.seconds,
    )  # fmt: skip


def _as_found(found: Minimum, problem: MixedProblem, y: FloatArray, code: int) -> Minimum:
    return replace(
        found, x=y, multipliers=np.zeros(problem.size), rows=np.zeros(problem.constraint_bounds()[0].size), code=code
    )
