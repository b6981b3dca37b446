"""Lowest eigenvalue of a chained problem's Hessian in O(p): inertia brackets it, the same factorisation iterates.

The factorisation of Hessian - sigma * metric (`ribbon.solvers.riccati`) tells how many eigenvalues lie below sigma.
Bisection by it brackets the lowest one, and Lanczos's iteration with the inverse at the lower end of the bracket, where
everything is positive, finds it and its mode. Nothing dense is made.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon.problems.chained import ChainedProblem
from ribbon.solvers import eigen, riccati

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_bracket: Any = eigen.bracket
_largest: Any = eigen.largest
_lowest: Any = eigen.lowest

#: Unknowns up to which the whole spectrum is computed where no iteration tells its lowest from the next ones.
_DENSE = 1500


@dataclass
class Pencil:
    """Hessian and metric of a chained problem at x (n,), on the unknowns that are not held (n,)."""

    problem: ChainedProblem
    x: FloatArray
    held: BoolArray
    _jets: tuple[FloatArray, FloatArray, FloatArray] = field(init=False, repr=False)
    _work: tuple[FloatArray, FloatArray, FloatArray] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        p, f = self.problem.lengths.size, self.problem.fields.count
        self._jets = self.problem.jets(self.x)
        self._work = np.empty((p, f, f + 3)), np.empty((p, f, f)), np.empty((f, f))
        self._none = np.zeros(self.x.size)

    @property
    def free(self) -> int:
        """Number of unknowns that are not held."""
        return int((~self.held).sum())

    def below(self, sigma: float) -> int:
        """How many eigenvalues are not above sigma (D w / l); the factors stay for `solve`."""
        local, u, v = self._jets
        return int(
            riccati.factor(
                self.problem.lengths, local, self.problem.is_loaded, u, v, -float(sigma), self._none, self.held,
                *self._work,
            )
        )  # fmt: skip

    def solve(self, right: FloatArray) -> FloatArray:
        """Solution (n,) with the factors of the last `below`; held unknowns are zero."""
        step, turned = np.empty(self.x.size), np.empty(3)
        riccati.solve(
            self.problem.lengths, self.problem.is_loaded, self._jets[1], *self._work, np.where(self.held, 0.0, right),
            step, turned,
        )  # fmt: skip
        return step

    def mass(self, y: FloatArray) -> FloatArray:
        """The metric times y (n,), on what is not held."""
        out = np.empty(y.size)
        riccati.mass_times(self.problem.lengths, self.problem.fields.count, np.where(self.held, 0.0, y), out)
        out[self.held] = 0.0
        return out

    @property
    def _given(self) -> tuple[Any, ...]:
        local, u, v = self._jets
        return self.problem.lengths, local, self.problem.is_loaded, u, v, self._none, self.held, *self._work

    def largest(self) -> float:
        """A bound of the largest eigenvalue (at least 1), at most four times it."""
        return float(_largest(*self._given))

    def lowest(self) -> tuple[float, FloatArray]:
        """The lowest eigenvalue and its mode (n,), of unit length in the metric."""
        low = _bracket(*self._given)
        found, converged = _lowest(low, *self._given, mode := np.empty(self.x.size))
        if converged:
            return float(found), mode
        self.below(low)  # two of about the same size: Lanczos's iteration tells them apart
        where = np.flatnonzero(~self.held)

        def spread(y: FloatArray) -> FloatArray:
            full = np.zeros(self.x.size)
            full[where] = y
            return full

        size = where.size
        if size < 3:
            return self._small(where)
        operator = scipy.sparse.linalg.LinearOperator
        inverse = operator((size, size), matvec=lambda y: self.solve(spread(y.ravel()))[where], dtype=float)
        metric = operator((size, size), matvec=lambda y: self.mass(spread(y.ravel()))[where], dtype=float)
        start = self.solve(self.mass(spread(_rough(size))))[where]
        try:
            values, modes = scipy.sparse.linalg.eigsh(
                metric, k=1, M=metric, sigma=low, OPinv=inverse, which="LM", v0=start, tol=1e-11
            )
        except scipy.sparse.linalg.ArpackNoConvergence:  # more than two of about the same size
            return self._small(where) if size <= _DENSE else (np.nan, np.zeros(self.x.size))
        mode = spread(modes[:, 0])
        return float(values[0]), mode / np.sqrt(mode @ self.mass(mode))

    def _small(self, where: NDArray[np.int64]) -> tuple[float, FloatArray]:
        hessian, metric = (m[np.ix_(where, where)] for m in (self.problem.hessian(self.x), self.problem.metric()))
        values, modes = scipy.linalg.eigh(hessian, metric)
        mode = np.zeros(self.x.size)
        mode[where] = modes[:, 0]
        return float(values[0]), mode


def _rough(size: int) -> FloatArray:
    """A vector (size,) with a part of every mode, the same on every machine."""
    return 1.0 + np.modf(np.arange(size) * 0.6180339887498949)[0]
