r"""A strip that bends in a plane about rulings square to it: its joints' curvatures omega are all that is unknown.

Ruling and twist are zero, position and frame of the start are given, and the glue (`ribbon.problems.mixed`) makes the
rest of the unknowns x (n,) of omega (p + 1,). With the glue c(x) = 0, Z = dx / domega from C Z = 0 (C its Jacobian) and
the energy E and the gaps g_k of `ribbon.problems.itself.pairs` (docs/theory.md, eq. (5.22)),

    dE/domega = Z^T E_x ,   dg/domega = g_x Z ,   C_y^T lambda = - (E_y - sum_k mu_k g_k,y) ,
    H = Z^T (E_xx + sum_i lambda_i c_i,xx - sum_k mu_k g_k,xx) Z ,

y what the glue makes: exact, dense, as large as the strip has joints. A row f = (|D|^2 - d^2) / 2d tells the gap
g = |D| - d = (d^2 + 2 d f)^(1/2) - d, with g_x = (d / |D|) f_x and g_xx = (d / |D|) f_xx - g_x g_x / |D|.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon.problems.itself.pairs import PairRows
from ribbon.problems.layout import OMEGA, STRIDE
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.mixed_kernels import ROWS

FloatArray = NDArray[np.float64]

#: The row of a segment's glue that is its ruling's.
_RULING = 7


class Bent:
    """A shape x (n,) of the plane and its derivatives by omega (p + 1,); the problem has no pairs."""

    def __init__(self, problem: MixedProblem, x: FloatArray) -> None:
        self.problem, self.x = problem, x
        p = problem.lengths.size
        self._omega = np.arange(p + 1) * STRIDE + OMEGA
        later = STRIDE * np.arange(1, p + 1)[:, None]
        self._made = (later + np.arange(OMEGA)).ravel()
        self._rows = (ROWS * np.arange(p)[:, None] + np.arange(_RULING)).ravel()
        glue = problem.jacobian_matrix(x).tocsr()[self._rows]
        self._glue = scipy.sparse.linalg.splu(glue[:, self._made].tocsc())
        self.moves = np.zeros((problem.size, p + 1))
        self.moves[self._omega, np.arange(p + 1)] = 1.0
        self.moves[self._made] = -self._glue.solve(glue[:, self._omega].toarray())
        self._slope = problem.gradient(x)

    @property
    def gradient(self) -> FloatArray:
        """dE / domega (p + 1,)."""
        return np.asarray(self._slope @ self.moves)

    def multipliers(self, pull: FloatArray) -> FloatArray:
        """Those of the problem's rows, where pull (n,) is added to E_x."""
        found = np.zeros(self.problem.row_count)
        found[self._rows] = self._glue.solve(-(self._slope + pull)[self._made], "T")
        return found

    def hessian(self, gaps: Gaps, pushes: FloatArray, pull: FloatArray | None = None) -> FloatArray:
        """H (p + 1, p + 1) with pushes mu (k,), D w / l^2, and the pull (n,) of rows that are linear in x."""
        held = np.zeros(self.x.size) if pull is None else -pull
        if not pushes.any():
            inner = self.problem.hessian_matrix(self.x, self.multipliers(held))
            return np.asarray(self.moves.T @ (inner @ self.moves))
        assert gaps.rows is not None
        by_row = pushes * gaps.share
        inner = self.problem.hessian_matrix(self.x, self.multipliers(held - gaps.jacobian.T @ by_row))
        one, other = gaps.rows.hessian_structure()
        lower = scipy.sparse.csr_matrix((gaps.rows.hessian(self.x, -by_row), (one, other)), shape=inner.shape)
        inner = inner + lower + scipy.sparse.tril(lower, -1).T
        slopes = gaps.slopes(self)
        return np.asarray(self.moves.T @ (inner @ self.moves) + slopes.T @ ((pushes / gaps.distance)[:, None] * slopes))


@dataclass(frozen=True)
class Gaps:
    """Gaps (k,) over the distance to be kept of pairs of places at a shape x (n,), l; rows: None without any."""

    rows: PairRows | None
    x: FloatArray

    @property
    def gap(self) -> FloatArray:
        """(k,)."""
        return np.zeros(0) if self.rows is None else self.rows.gaps(self.x)

    @property
    def distance(self) -> FloatArray:
        """|D| (k,)."""
        assert self.rows is not None
        return self.gap + self.rows.distance

    @property
    def share(self) -> FloatArray:
        """d / |D| (k,)."""
        assert self.rows is not None
        return np.asarray(self.rows.distance / self.distance)

    @property
    def jacobian(self) -> scipy.sparse.csr_matrix:
        """f_x (k, n)."""
        assert self.rows is not None
        shape = (self.rows.count, self.x.size)
        return scipy.sparse.csr_matrix((self.rows.jacobian(self.x), self.rows.jacobian_structure()), shape=shape)

    def slopes(self, bent: Bent) -> FloatArray:
        """dg / domega (k, p + 1)."""
        if self.rows is None:
            return np.zeros((0, bent.moves.shape[1]))
        return np.asarray(self.share[:, None] * (self.jacobian @ bent.moves))


def planar_mass(lengths: FloatArray) -> FloatArray:
    """int v^2 of the turns v (rad) that curvatures at the joints make, (p + 1, p + 1), trapezoids."""
    p = lengths.size
    turns = np.zeros((p + 1, p + 1))
    half = 0.5 * lengths
    for j in range(p):
        turns[j + 1] = turns[j]
        turns[j + 1, j] += half[j]
        turns[j + 1, j + 1] += half[j]
    weight = np.zeros(p + 1)
    weight[:-1] += half
    weight[1:] += half
    return np.asarray(turns.T @ (weight[:, None] * turns))
