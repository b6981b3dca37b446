"""Where small terms pull a strip that is held at s = 0 only: to first order, by the factors of its chained Hessian.

The glued strip's tangent on the shapes that the glue allows is the chained Hessian (docs/theory.md, eq. (4.3)), whose
factors are of one segment each (`ribbon.solvers.riccati`): its unknowns move by ``-H^-1 g``, and positions and
quaternions as the glue has it, ``J_d dd = -J_f df``, d what the glue determines, f what is free. So the moves are those
of `ribbon.sensitivity.system`, where one matrix of all unknowns and rows is factored.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon.judge.inertia import Pencil
from ribbon.judge.reduction import dependent_columns
from ribbon.problems import chained_kernels as kernels
from ribbon.problems.chained import ChainedProblem
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.mixed_kernels import ROWS
from ribbon.sensitivity.system import glued

FloatArray = NDArray[np.float64]

#: Largest eigenvalue over the lowest one, both in the metric of `Pencil`, up to which factors without pivoting are
#: trusted; beyond it the tangent of all unknowns is asked, which tells whether it is singular.
_CONDITION = 1e11


def along_the_chain(
    problem: ChainedProblem, x: FloatArray, gradients: Sequence[FloatArray]
) -> tuple[MixedProblem, FloatArray, FloatArray] | None:
    """The glued problem with bending in its plane, its unknowns (n,), and where they go (k + 1, n): by each of the
    gradients (p, 4 or 6) by the segments' parameters, D w / l, and by what bends the strip in its plane. x: of the
    chained one. None where the Hessian is not positive, or its condition is too large."""
    omega, eta = problem.joint_values(x)
    sideways = problem.in_plane_values(x)
    freed = problem if problem.fields.in_plane else problem.with_changes(in_plane=True)
    x = freed.state(omega, eta, sideways)
    lower, upper = freed.bounds()
    held = lower == upper
    pencil = Pencil(freed, x, held)
    if pencil.below(pencil.largest() / _CONDITION) or pencil.below(0.0):
        return None
    pulls = [_by_unknowns(freed, gradient) for gradient in gradients] + [freed.gradient(x)]
    steps = np.array([pencil.solve(-pull) for pull in pulls])
    mixed = glued(freed)
    start = mixed.state(omega, eta, freed.in_plane_values(x))
    return mixed, start, _glued_steps(freed, mixed, start, steps)


def _by_unknowns(problem: ChainedProblem, gradient: FloatArray) -> FloatArray:
    """Derivative (n,) by the chained unknowns of what has the gradient (p, 4 or 6) by the segments' parameters."""
    jets = np.zeros((problem.lengths.size, problem.fields.components))
    jets[:, 1 : 1 + gradient.shape[1]] = gradient
    found = np.empty(problem.size)
    kernels.assemble_gradient(problem.lengths, jets, found)
    return found


def _glued_steps(problem: ChainedProblem, mixed: MixedProblem, start: FloatArray, steps: FloatArray) -> FloatArray:
    """Steps (k, n) of the chained unknowns as those of the glued ones, which stand at `start` (n,)."""
    layout = mixed.layout
    moves = np.zeros((len(steps), mixed.size))
    for move, step in zip(moves, steps, strict=True):
        omega, eta = problem.joint_values(step)
        move[layout.omega], move[layout.joint(0).eta] = omega, eta[0]
        move[layout.slope] = np.diff(eta) / problem.lengths
        move[layout.sideways] = problem.in_plane_values(step)
    glue = mixed.jacobian_matrix(start)[: ROWS * problem.lengths.size]
    dependent = dependent_columns(mixed)
    factors = scipy.sparse.linalg.splu(scipy.sparse.csc_matrix(glue[:, dependent]), permc_spec="NATURAL")
    moves[:, dependent] = factors.solve(-(glue @ moves.T)).T
    return moves
