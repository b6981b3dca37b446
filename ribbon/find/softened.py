"""The ribbon with the energy that a strip of finite thickness gains across its width (`ribbon.energies.edge_layer`).

A problem around the ribbon's: same unknowns, bounds and constraints, and the term `softening` added to the energy, its
gradient and its Hessian. Its minimum, warm started from the ribbon's, is a first-order picture of where the shell goes.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbon.energies import ENERGIES
from ribbon.result import Equilibrium
from ribbon.solvers.ipopt import minimise

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)
_NODES, _WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS
#: Gradient up to which the minimum is found; it is an estimate, not a solution.
_TOLERANCE = 1e-7
_MOST_ITERATIONS = 60


class SoftenedProblem:
    """A ribbon's problem with the softening of a strip of thickness h (in l)."""

    def __init__(self, inner: Any, thickness: float) -> None:
        self._inner = inner
        strip = inner.strip
        self.relaxed = ENERGIES[inner.energy].relaxed(strip.poisson, strip.relative_width, thickness)
        self.lengths: FloatArray = inner.lengths
        joints = np.concatenate([[0.0], np.cumsum(self.lengths)])
        s = joints[:-1, None] + self.lengths[:, None] * _NODES
        start, end = strip.curvature
        self.natural = start + (end - start) * s
        self._columns, self._slopes = inner.parameter_map()
        if inner.row_count:
            pairs = [(i, j) for i in range(4) for j in range(i + 1)]
            self._pairs = pairs
            ends = [self._columns[:, i] for i in range(4)]
            rows = np.concatenate([np.maximum(ends[i], ends[j]) for i, j in pairs])
            columns = np.concatenate([np.minimum(ends[i], ends[j]) for i, j in pairs])
            known = inner.hessian_structure()
            self._structure = np.concatenate([known[0], rows]), np.concatenate([known[1], columns])
            self.constraint_bounds = inner.constraint_bounds

    def __getattr__(self, name: str) -> Any:
        if name == "constraint_bounds":  # absent, like the inner problem's
            raise AttributeError(name)
        return getattr(self._inner, name)

    def _terms(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Value (p,), gradient (p, 4), Hessian (p, 4, 4) by (a, b, n, m) of every segment."""
        q = self._inner.parameters(x)
        t = self.lengths[:, None] * _NODES
        omega = q[:, 0:1] * t + q[:, 1:2]
        eta = q[:, 2:3] * t + q[:, 3:4]
        value, gradient, hessian = self.relaxed.softening(omega, eta, self.natural)
        one, zero = np.ones_like(t), np.zeros_like(t)
        by = np.stack([np.stack([t, one, zero, zero], -1), np.stack([zero, zero, t, one], -1)], -2)  # (p, g, 2, 4)
        weight = self.lengths[:, None] * _WEIGHTS
        return (
            (weight * value).sum(axis=1),
            np.einsum("pg,pgi,pgij->pj", weight, gradient, by),
            np.einsum("pg,pgij,pgik,pgjl->pkl", weight, hessian, by, by),
        )

    def value(self, x: FloatArray) -> float:
        """Energy, D w / l."""
        return float(self._inner.value(x)) + float(self._terms(x)[0].sum())

    def gradient(self, x: FloatArray) -> FloatArray:
        """Gradient (n,)."""
        added = self._terms(x)[1]
        found = np.array(self._inner.gradient(x))
        if self._inner.row_count:
            np.add.at(found, self._columns, np.einsum("pj,pjk->pk", added, self._slopes))
            return found
        return np.asarray(found + self._slopes.reshape(added.size, -1).T @ added.ravel())

    def hessian(self, x: FloatArray, multipliers: FloatArray | None = None, factor: float = 1.0) -> FloatArray:
        """Dense Hessian (n, n), or its entries in `hessian_structure` for a problem with constraints."""
        added = self._terms(x)[2]
        if self._inner.row_count:
            local = np.einsum("pij,pik,pjl->pkl", added, self._slopes, self._slopes)
            entries = [local[:, i, j] for i, j in self._pairs]
            inner = self._inner.hessian(x, multipliers, factor)
            return np.concatenate([inner, factor * np.concatenate(entries)])
        wide = np.einsum("pij,pik,pjl->kl", added, self._slopes, self._slopes, optimize=True)
        return np.asarray(self._inner.hessian(x) + wide)

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """Rows and columns of the entries; some places come twice and add."""
        return self._structure


def soften(equilibrium: Equilibrium, thickness: float) -> Equilibrium | None:
    """The ribbon at the minimum of its softened energy near `equilibrium`; None where it has not been found.

    thickness: h in l. Only the unknowns (and what follows from them) belong to the new state. The formulations
    "chained" (one clamp) and "mixed" are possible.
    """
    if equilibrium.problem.formulation not in ("chained", "mixed"):
        return None
    if equilibrium.problem.formulation == "chained" and equilibrium.problem.row_count:
        return None
    problem = SoftenedProblem(equilibrium.problem, thickness)
    warm = (equilibrium.rows, equilibrium.multipliers)
    options = {"tol": _TOLERANCE, "max_iter": _MOST_ITERATIONS}
    found = minimise(problem, equilibrium.x, options, warm=warm)
    if not found.residual < 100.0 * _TOLERANCE:
        return None
    return replace(equilibrium, x=found.x, rows=found.rows, multipliers=found.multipliers, at=None)
