"""Where small terms pull a strip that is held at s = 0 only: to first order, by the factors of its chained Hessian.

The glued strip's tangent on the shapes that the glue allows is the chained Hessian (docs/theory.md, eq. (4.3)), whose
factors are of one segment each (`ribbon.solvers.riccati`): its unknowns move by ``-H^-1 g``, and positions and
quaternions from joint to joint as the glue has it. So the moves are those of `ribbon.sensitivity.system`, where one
matrix of all unknowns and rows is factored.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ribbon.judge.inertia import Pencil
from ribbon.problems import chained_kernels as kernels
from ribbon.problems.chained import ChainedProblem
from ribbon.problems.mixed import MixedProblem
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
        move[layout.omega], move[layout.eta] = problem.joint_values(step)
        move[layout.slope] = np.diff(move[layout.eta]) / problem.lengths
        move[layout.sideways] = problem.in_plane_values(step)
    bent = moves[:, mixed.parameter_map()[0]]  # (k, p, 6)
    place, turn = _glue(mixed, start, bent.shape[2])
    turned = np.zeros((len(problem.lengths) + 1, 4, len(steps)))
    by_fields = -np.einsum("pij,kpj->pik", turn[:, :, 5:], bent)
    for i, own in enumerate(-turn[:, :, 1:5]):
        turned[i + 1] = own @ turned[i] + by_fields[i]
    moved = -np.einsum("pij,kpj->kpi", place[:, :, 6:], bent)
    moved -= np.einsum("pij,pjk->kpi", place[:, :, 2:6], turned[1:])
    for move, positions, quaternions in zip(moves, np.cumsum(moved, axis=1), turned.transpose(2, 0, 1), strict=True):
        layout.positions(move)[1:], layout.quaternions(move)[:] = positions, quaternions
    return moves


def _glue(problem: MixedProblem, x: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """The glue's Jacobian segment by segment, as `ribbon.problems.mixed_kernels.jacobian` fills it: of positions (p, 3,
    6 + count) by r, the next r, the next q and the parameters, of quaternions (p, 4, 5 + count) by the next q, q and
    the parameters."""
    p = problem.lengths.size
    wide, high = 3 * (6 + count), 4 * (5 + count)
    entries = problem.jacobian(x)[: (wide + high + 3) * p].reshape(p, -1)
    return entries[:, :wide].reshape(p, 3, -1), entries[:, wide : wide + high].reshape(p, 4, -1)
