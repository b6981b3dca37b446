r"""A quadratic problem with many inequalities, most of which hold with equality: dense, by its dual.

    min 1/2 d H d + e d   over d (m,) with   G d + g >= 0

H positive definite. With d = H^-1 (G^T mu - e) the multipliers solve mu >= 0, v = g - G H^-1 e + G H^-1 G^T mu >= 0,
mu v = 0: by sets that are exchanged as a whole (M. Hintermueller, K. Ito, K. Kunisch 2003,
doi:10.1137/S1052623401383558), and where that goes round in circles by non-negative least squares (C. Lawson,
R. Hanson 1974).
"""

from __future__ import annotations

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Exchanges, and what is added to the diagonal of G H^-1 G^T, over its mean: rows may repeat each other.
_EXCHANGES, _ADDED = 25, 1e-13
#: rho (D w / l^3) by which what pushes is held, and growth of what is added of the mass.
_HOLDING, _GROWTH = 1e6, 5.0


def least(
    factor: tuple[FloatArray, bool], gradient: FloatArray, rows: FloatArray, gap: FloatArray, pushes: NDArray[np.bool_]
) -> tuple[FloatArray, FloatArray]:
    """d (m,) and mu (k,); factor: of Cholesky, of H; pushes (k,): which rows are thought to push."""
    solved = scipy.linalg.cho_solve(factor, np.column_stack([gradient, rows.T]))
    alone, by_rows = -solved[:, 0], solved[:, 1:]
    if not gap.size:
        return alone, np.zeros(0)
    matrix = rows @ by_rows
    matrix = 0.5 * (matrix + matrix.T)
    matrix[np.diag_indices_from(matrix)] += _ADDED * float(np.trace(matrix)) / gap.size
    push = _complementary(matrix, gap + rows @ alone, pushes)
    return alone + by_rows @ push, push


def positive(
    hessian: FloatArray, held: FloatArray, mass: FloatArray, shift: float
) -> tuple[tuple[FloatArray, bool], float]:
    """A Cholesky factor of H (m, m), of H with what pushes (held (k, m)) held, or with so much of the mass (m, m) as it
    needs, `shift` of it first; and rho, 0.0 where nothing is held. `LinAlgError` where no mass makes it positive."""
    added, by = 0.0, 0.0
    while True:
        try:
            return scipy.linalg.cho_factor(hessian + by * mass), added
        except np.linalg.LinAlgError:
            if not added and len(held):
                added = _HOLDING
                hessian = hessian + added * held.T @ held
            else:
                by = max(_GROWTH * by, shift)
        if not by < 1e12:
            raise np.linalg.LinAlgError("not to be made positive")


def _complementary(matrix: FloatArray, left: FloatArray, pushes: NDArray[np.bool_]) -> FloatArray:
    """mu (k,) >= 0 with left + matrix mu >= 0, and one of both zero."""
    on = pushes.copy()
    for _ in range(_EXCHANGES):
        try:
            push = _closed(matrix, left, on)
        except np.linalg.LinAlgError:  # rows that repeat each other to the last digit
            break
        again = np.where(on, push > 0.0, left + matrix @ push < -1e-14)
        if (again == on).all():
            return push
        on = again
    root = scipy.linalg.cholesky(matrix + 10.0 * _ADDED * np.trace(matrix) / left.size * np.eye(left.size))
    push, _ = scipy.optimize.nnls(root, -scipy.linalg.solve_triangular(root, left, trans="T"), maxiter=30 * left.size)
    sharp = _closed(matrix, left, push > 0.0)
    return sharp if sharp.min() >= 0.0 else np.asarray(push)


def _closed(matrix: FloatArray, left: FloatArray, on: NDArray[np.bool_]) -> FloatArray:
    """mu (k,) with which the rows `on` hold with equality."""
    push = np.zeros(left.size)
    k = np.flatnonzero(on)
    if k.size:
        push[k] = scipy.linalg.solve(matrix[np.ix_(k, k)], -left[k], assume_a="pos")
    return push
