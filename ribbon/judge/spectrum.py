"""Lowest eigenvalue of the second variation of a glued ribbon on the tangent of what is active, sparse, by inertia.

With H the Hessian of the Lagrangian, M the metric (`ribbon.judge.reduction.metric`) and A the rows in force, the
eigenvalues of H on the null space of A below a shift t are counted by the factor of::

    K(t) = [ H - t M , A^T ]
           [ A       , 0   ]

which has as many negative eigenvalues as there are rows, and those (Gould 1985, doi:10.1007/BF01585660). The lowest one
comes by Lanczos's iteration with the upper part of ``K(t)^-1 [M v; 0]``, which stays in the null space and is symmetric
in M there (Ericsson and Ruhe 1980, doi:10.1090/S0025-5718-1980-0583502-2), from a t with nothing below it. Rows beside
the glue may repeat one another: they are soft by a rounding. Time and memory are linear in the number of segments.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy  # its parts are loaded where they are first used

from ribbon.judge.reduction import Tangent, metric
from ribbon.problems import mixed_kernels as kernels
from ribbon.problems.mixed import MixedProblem
from ribbon.solvers.frontal import Factor
from ribbon.solvers.problem import FloatArray
from ribbon.solvers.saddle import Saddle

#: Steps of Lanczos's iteration at the most, those for the largest eigenvalue, and the error (relative to the distance
#: from the shift) at which it ends.
_STEPS = 120
_LARGEST_STEPS = 6
_ERROR = 1e-12
#: Residual of the systems in between, over their right sides.
_SOLVED = 1e-11
#: The first shifts, and the factor to further ones; least length of a direction that may move.
_SHIFTS = (-2e-5, -1.0)
_FURTHER = 8.0
#: Part of an eigenvalue by which the counts below it have to agree with it.
_NEAR = 0.02
_MOST = 1e30
_NOTHING = 1e-12


class SecondVariation:
    """H on the tangent at x (n,) with the multipliers rows (m,); `held`: what is active there; `weights`: the metric
    (n, n), that of `ribbon.judge.reduction` where none is given."""

    def __init__(
        self,
        problem: MixedProblem,
        x: FloatArray,
        rows: FloatArray,
        held: Tangent,
        weights: scipy.sparse.csr_matrix | None = None,
    ) -> None:
        glue = kernels.ROWS * problem.lengths.size
        force = np.zeros(problem.row_count, dtype=bool)
        force[:glue] = True
        force[held.rows] = True
        weights = metric(problem) if weights is None else weights
        lower = scipy.sparse.tril(weights).tocoo()
        self._held = held
        self._weights = weights[held.free][:, held.free]
        self._entries = lower.data
        self._saddle = Saddle(problem, held.free, force, (lower.row, lower.col))
        self._hessian, self._jacobian = problem.hessian(x, rows), problem.jacobian(x)
        self._matrix = lambda: problem.hessian_matrix(x, rows)[held.free][:, held.free]
        self._soft = np.arange(glue, self._saddle.count)

    def _factor(self, shift: float) -> tuple[Factor, int]:
        """The factor of K(shift), and the number of eigenvalues below it."""
        factor = self._saddle.factor(self._hessian, self._jacobian, extra=-shift * self._entries, soft=self._soft)
        if factor.negative < self._saddle.count:  # rows of the glue that repeat others too
            self._soft = np.arange(self._saddle.count)
            factor = self._saddle.factor(self._hessian, self._jacobian, extra=-shift * self._entries, soft=self._soft)
        return factor, factor.negative - self._saddle.count

    def below(self, shift: float) -> int:
        """Number of eigenvalues below `shift` (D w / l)."""
        return self._factor(shift)[1]

    def lowest(self) -> tuple[float, FloatArray]:
        """The lowest eigenvalue (D w / l), and its mode (n,), of length 1 in the metric.

        It is inf where nothing can move, nan where no shift has nothing below it, or what the iteration finds is not
        what the inertia counts."""
        shift, shifts = _SHIFTS[0], iter(_SHIFTS[1:])
        factor, count = self._factor(shift)
        while count > 0 and abs(shift) < _MOST:
            shift = next(shifts, _FURTHER * shift)
            factor, count = self._factor(shift)
        mode = np.zeros(self._held.free.size)
        if count != 0:
            return np.nan, mode
        inverse, found = self._lanczos(lambda v: self._upper(factor, self._weights @ v), _STEPS)
        if inverse == 0.0:
            return np.inf, mode
        value = shift + 1.0 / inverse
        if self.below(value - _NEAR * abs(value)) > 0:  # of a wide spectrum Lanczos's iteration may end above others
            low = self._beneath(shift, value)
            factor, _ = self._factor(low)
            inverse, found = self._lanczos(lambda v: self._upper(factor, self._weights @ v), _STEPS)
            value = low + 1.0 / inverse
            if self.below(value - _NEAR * abs(value)) > 0 or not self.below(value + _NEAR * abs(value)) > 0:
                return np.nan, mode
        mode[self._held.free] = found
        return value, mode

    def _beneath(self, low: float, high: float) -> float:
        """A shift with nothing below it, close to the lowest eigenvalue, by counting between two others."""
        while high - low > _NEAR * max(abs(low), abs(high)):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if self.below(middle) > 0 else (middle, high)
        return low

    def largest(self) -> float:
        """The largest eigenvalue (D w / l), or somewhat less."""
        none = np.zeros_like(self._hessian)
        factor = self._saddle.factor(none, self._jacobian, extra=self._entries, soft=self._soft)
        matrix = self._matrix()
        return self._lanczos(lambda v: self._upper(factor, matrix @ v), _LARGEST_STEPS)[0]

    def _upper(self, factor: Factor, b: FloatArray) -> FloatArray:
        """Upper part (k,) of ``K^-1 [b; 0]``."""
        return factor.solve(np.concatenate([b, np.zeros(self._saddle.count)]), 1, _SOLVED)[: b.size]

    def _lanczos(self, apply: Callable[[FloatArray], FloatArray], steps: int) -> tuple[float, FloatArray]:
        """Largest eigenvalue and its vector (k,) of an operator that is symmetric in the metric and maps into the
        tangent; 0 where that is a point. Every vector is made orthogonal to all before."""
        rng = np.random.default_rng(0)
        v = apply(rng.normal(size=self._weights.shape[0]))
        size = float(np.abs(v).max(initial=0.0))
        length = np.sqrt(max(0.0, float(v @ (self._weights @ v))))
        if not length > _NOTHING * max(1.0, size):
            return 0.0, v
        v = v / length
        basis, weighed = [v], [self._weights @ v]
        diagonal: list[float] = []
        beside: list[float] = []
        while True:
            w = apply(basis[-1])
            diagonal.append(float(w @ weighed[-1]))
            for _ in range(2):
                for u, mu in zip(basis, weighed, strict=True):
                    w -= (w @ mu) * u
            mw = self._weights @ w
            length = np.sqrt(max(0.0, float(w @ mw)))
            values, vectors = _eigenpairs(diagonal, beside)
            value, vector = float(values[-1]), vectors[:, -1]
            error = length * abs(vector[-1])
            if error <= _ERROR * abs(value) or len(basis) >= min(steps, v.size):
                return value, np.array(basis).T @ vector
            beside.append(length)
            basis.append(w / length)
            weighed.append(mw / length)


def _eigenpairs(diagonal: list[float], beside: list[float]) -> tuple[FloatArray, FloatArray]:
    """Of a symmetric tridiagonal matrix, ascending; by QR where relatively robust representations break down, as they
    may where numbers lie a hundred powers of ten apart."""
    try:
        return scipy.linalg.eigh_tridiagonal(diagonal, beside)
    except np.linalg.LinAlgError:
        return scipy.linalg.eigh_tridiagonal(diagonal, beside, lapack_driver="stev")
