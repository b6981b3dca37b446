"""Second variation of a glued ribbon on the tangent of its active constraints.

The glue determines positions, quaternions and eta of joints 1 ... p from the start and from omega, n of the segments;
the tangent of the glue is the range of ``Z = [1; -G_d^{-1} G_i]``, G_d and G_i being the glue's columns of dependent
and independent unknowns. What else is active (held ends, seams, contacts, bounds, gauges) are rows N on the latter.
Second-order condition: the Hessian of the Lagrangian is positive on the null space of N (Nocedal and Wright 2006,
section 12.5). Eigenvalues are taken in the metric ``int (domega^2 + deta^2) ds + |dr_0|^2 + |dq_0|^2`` (the latter two
where the start is free).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon.problems import mixed_kernels as kernels
from ribbon.problems.layout import ETA, OMEGA, POSITION
from ribbon.problems.mixed import MixedProblem

FloatArray = NDArray[np.float64]

#: A bound or a one-sided row holds when it is this close, relative to its size, and pushes.
ACTIVE_DISTANCE = 1e-7
_PUSHES = 1e-9


@dataclass(frozen=True)
class Tangent:
    """What is held at a point: `free` columns of the unknowns, `rows` active rows beside the glue, `bounds` active."""

    free: NDArray[np.bool_]
    rows: NDArray[np.int64]
    bounds: int
    contacts: int


def tangent(problem: MixedProblem, x: FloatArray, multipliers: FloatArray, rows: FloatArray) -> Tangent:
    """Active set at x from the multipliers of bounds (n,) and rows (m,)."""
    lower, upper = problem.bounds()
    fixed = lower == upper
    reach = np.where(np.isfinite(upper), ACTIVE_DISTANCE * np.maximum(np.abs(upper), np.abs(lower)), -1.0)
    held = ~fixed & (np.minimum(x - lower, upper - x) <= reach) & (np.abs(multipliers) > _PUSHES)
    below, above = problem.constraint_bounds()
    glue = kernels.ROWS * problem.lengths.size
    equal = below == above
    values = problem.constraints(x)
    slack = np.minimum(values - below, above - values)
    pushing = ~equal & (np.abs(rows) > _PUSHES) & (slack <= ACTIVE_DISTANCE)
    active = np.nonzero(equal | pushing)[0]
    return Tangent(~(fixed | held), active[active >= glue], int(held.sum()), int(pushing.sum()))


def metric(problem: MixedProblem) -> scipy.sparse.csr_matrix:
    """Gram matrix (size, size) of the metric of the module; zero on what the metric does not see."""
    lengths = problem.lengths
    p = lengths.size
    diagonal = np.zeros(p + 1)
    diagonal[:-1] += lengths / 3.0
    diagonal[1:] += lengths / 3.0
    off = lengths / 6.0
    entries, rows, columns = [], [], []
    fields = [problem.layout.columns(place) for place in (OMEGA, ETA)]
    if problem.fields.count == 3:
        fields.append(np.arange(problem.size)[problem.layout.sideways])
    for joints in fields:
        entries += [diagonal, off, off]
        rows += [joints, joints[:-1], joints[1:]]
        columns += [joints, joints[1:], joints[:-1]]
    extra = np.concatenate([np.arange(POSITION, OMEGA), np.arange(problem.layout.ribbon, problem.size)])
    entries.append(np.ones(extra.size))
    rows.append(extra)
    columns.append(extra)
    return scipy.sparse.csr_matrix(
        (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))), shape=(problem.size,) * 2
    )


@dataclass(frozen=True)
class Reduced:
    """Hessian and metric (k, k) on a basis (size, k) of the tangent space."""

    hessian: FloatArray
    metric: FloatArray
    basis: FloatArray

    def spectrum(self) -> tuple[FloatArray, FloatArray]:
        """Eigenvalues (k,), ascending, and modes (size, k) in the unknowns."""
        values, vectors = scipy.linalg.eigh(self.hessian, self.metric)
        return values, self.basis @ vectors


def dependent_columns(problem: MixedProblem) -> NDArray[np.int64]:
    """Columns that the glue determines: r, q and eta of joints 1 ... p."""
    return problem.layout.columns(*range(POSITION, OMEGA), ETA)[1:].ravel()


def reduce(problem: MixedProblem, x: FloatArray, rows: FloatArray, held: Tangent) -> Reduced:
    """Dense second variation on the tangent of the glue and of all that is active."""
    n = problem.size
    dependent = dependent_columns(problem)
    independent = np.setdiff1d(np.nonzero(held.free)[0], dependent)
    jacobian = problem.jacobian_matrix(x)
    glue = kernels.ROWS * problem.lengths.size
    solver = scipy.sparse.linalg.splu(scipy.sparse.csc_matrix(jacobian[:glue][:, dependent]))
    z = np.zeros((n, independent.size))
    z[independent, np.arange(independent.size)] = 1.0
    z[dependent] = -solver.solve(jacobian[:glue][:, independent].toarray())
    extra = jacobian[held.rows] @ z
    blocked = dependent[~held.free[dependent]]
    restriction = np.vstack([extra, z[blocked]])
    basis = z @ null_space(restriction)
    hessian = problem.hessian_matrix(x, rows)
    return Reduced(_symmetric(basis.T @ (hessian @ basis)), _symmetric(basis.T @ (metric(problem) @ basis)), basis)


def _symmetric(a: FloatArray) -> FloatArray:
    return 0.5 * (a + a.T)


def null_space(rows: FloatArray) -> FloatArray:
    """Orthonormal basis (k, k - rank) of the null space of `rows` (m, k)."""
    k = rows.shape[1]
    if rows.shape[0] == 0:
        return np.eye(k)
    scale = np.linalg.norm(rows, axis=1)
    rows = rows[scale > 1e-12] / scale[scale > 1e-12][:, None]
    if rows.shape[0] == 0:
        return np.eye(k)
    q, r, _ = scipy.linalg.qr(rows.T, mode="full", pivoting=True)
    diagonal = np.abs(np.diag(r))
    rank = int((diagonal > 1e-9 * max(1.0, diagonal.max(initial=0.0))).sum())
    return np.asarray(q[:, rank:])
