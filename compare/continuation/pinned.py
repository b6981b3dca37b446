"""A system on one branch of a circle of branches: what turns the shape and costs nothing is held.

Every point of such a branch has a null vector, p, along the circle, and its residual has no part there. With u = M p of
the first point, K + c u u^T has none; Newton's iteration with it goes nowhere along the circle, and its inertia counts
the modes beside it (bordered: [K u; u^T -1/c], by Haynsworth's law).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from compare.continuation import bordered
from compare.continuation.system import Factor, FloatArray, System

#: c, in the metric of shapes (D w / l).
_HELD = 1e2


@dataclass(frozen=True)
class _Transposed:
    of: Factor

    @property
    def unstable(self) -> int:
        return self.of.unstable

    def solve(self, b: FloatArray) -> FloatArray:
        return self.of.solve_transposed(b)

    def solve_transposed(self, b: FloatArray) -> FloatArray:
        return self.of.solve(b)


@dataclass(frozen=True)
class PinnedFactor:
    """of: the factor of K; u (n,)."""

    of: Factor
    u: FloatArray = field(repr=False)

    def _one(self, factor: Factor, b: FloatArray) -> FloatArray:
        found = bordered.solve(factor, self.u, self.u, -1.0 / _HELD, b, 0.0)
        return np.full_like(b, np.nan) if found is None else found[0]

    @property
    def unstable(self) -> int:
        """Of K + c u u^T: negative eigenvalues of K, one less where the one along u is among them."""
        along = float(self.u @ self.of.solve(self.u))
        return self.of.unstable - (along < -1.0 / _HELD)

    def solve(self, b: FloatArray) -> FloatArray:
        """(K + c u u^T)^-1 b, (n,) or (n, k)."""
        if b.ndim == 1:
            return self._one(self.of, b)
        return np.column_stack([self._one(self.of, column) for column in b.T])

    def solve_transposed(self, b: FloatArray) -> FloatArray:
        """The same of the transpose."""
        return self._one(_Transposed(self.of), b)


@dataclass(frozen=True, eq=False)
class Pinned:
    """own: the system; along (n,): the direction along the circle at its first point."""

    own: System
    along: FloatArray = field(repr=False)

    def _with(self, found: tuple[System, FloatArray, FloatArray]) -> tuple[Self, FloatArray, FloatArray]:
        own, z, directions = found
        if own is self.own:
            return self, z, directions[:, :-1]
        return replace(self, own=own, along=directions[:, -1]), z, directions[:, :-1]

    def _beside(self, directions: FloatArray) -> FloatArray:
        return np.column_stack([directions, self.along])

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.own.size

    def residual(self, z: FloatArray, t: float) -> FloatArray:
        """G."""
        return self.own.residual(z, t)

    def norm(self, residual: FloatArray) -> float:
        """What of it counts."""
        return self.own.norm(residual)

    def rate(self, z: FloatArray, t: float) -> FloatArray:
        """dG/dt."""
        return self.own.rate(z, t)

    def factor(self, z: FloatArray, t: float) -> PinnedFactor | None:
        """K + c u u^T, factored."""
        found = self.own.factor(z, t)
        return None if found is None else PinnedFactor(found, self.own.mass(self.along))

    def mass(self, v: FloatArray) -> FloatArray:
        """M v."""
        return self.own.mass(v)

    def reach(self, z: FloatArray, dz: FloatArray) -> float:
        """The part of a step that stays."""
        return self.own.reach(z, dz)

    def stepped(self, z: FloatArray, dz: FloatArray) -> FloatArray:
        """z + dz."""
        return self.own.stepped(z, dz)

    def slacks(self, z: FloatArray, t: float) -> FloatArray:
        """Conditions of one side."""
        return self.own.slacks(z, t)

    def beyond(
        self, z: FloatArray, t: float, condition: int, directions: FloatArray
    ) -> tuple[Self, FloatArray, FloatArray, str]:
        """With a condition changed."""
        own, there, carried, what = self.own.beyond(z, t, condition, self._beside(directions))
        return *self._with((own, there, carried)), what

    def renewed(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[Self, FloatArray, FloatArray]:
        """With what moves nothing told anew."""
        return self._with(self.own.renewed(z, t, self._beside(directions)))

    def moved(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[Self, FloatArray, FloatArray]:
        """On elements that stand where the shape has what is sudden."""
        return self._with(self.own.moved(z, t, self._beside(directions)))

    def resolved(self, z: FloatArray, t: float) -> bool:
        """Whether they are fine enough."""
        return self.own.resolved(z, t)

    def finer(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[Self, FloatArray, FloatArray]:
        """On elements half as long."""
        return self._with(self.own.finer(z, t, self._beside(directions)))

    def energy(self, z: FloatArray, t: float) -> float:
        """Total energy, D w / l."""
        return self.own.energy(z, t)
