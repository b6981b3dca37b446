"""The second variation of a glued ribbon on its tangent as dense matrices: the judge of `ribbon.judge.spectrum`.

The glue determines positions, quaternions and eta of joints 1 ... p from the start and from omega, n of the segments;
the tangent of the glue is the range of ``Z = [1; -G_d^{-1} G_i]``, G_d and G_i being the glue's columns of dependent
and independent unknowns. What else is active are rows N on the latter, and the tangent is their null space.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from ribbon.judge.reduction import Tangent, dependent_columns, metric
from ribbon.problems import mixed_kernels as kernels
from ribbon.problems.mixed import MixedProblem

FloatArray = NDArray[np.float64]


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
