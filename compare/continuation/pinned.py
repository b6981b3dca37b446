"""A system on one branch of a circle of branches: what turns the shape and costs nothing is held.

Every point of such a branch has a null vector, p, along the circle, and its residual has no part there. On elements
that are not turned with it the circle is one but for what they miss: a small force along it is left. With u = M p of
the first point a point is an equilibrium but for a multiple of u, G = m u, beside which <u, dz> = 0 (Lyapunov and
Schmidt, as in `compare.continuation.ring`); its inertia is that of K on what is left, [K u; u^T 0] (Haynsworth's law).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from compare.continuation import bordered
from compare.continuation.system import Factor, FloatArray, System


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
        found = bordered.solve(factor, self.u, self.u, 0.0, b, 0.0)
        return np.full_like(b, np.nan) if found is None else found[0]

    @property
    def unstable(self) -> int:
        """Beside u: negative eigenvalues of K, one less where u^T K^-1 u is below zero."""
        return self.of.unstable - bool(float(self.u @ self.of.solve(self.u)) < 0.0)

    def solve(self, b: FloatArray) -> FloatArray:
        """x (n,) or (n, k) of K x + m u = b, u^T x = 0."""
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
        """What of it counts: not its part along the circle."""
        u = self.own.mass(self.along)
        return self.own.norm(residual - float(self.along @ residual) / float(self.along @ u) * u)

    def rate(self, z: FloatArray, t: float) -> FloatArray:
        """dG/dt."""
        return self.own.rate(z, t)

    def factor(self, z: FloatArray, t: float) -> PinnedFactor | None:
        """K on what is left beside u, factored."""
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

    def convexity(self, z: FloatArray, t: float) -> float:
        """Its own."""
        return self.own.convexity(z, t)

    def finer(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[Self, FloatArray, FloatArray]:
        """On elements half as long."""
        return self._with(self.own.finer(z, t, self._beside(directions)))

    def energy(self, z: FloatArray, t: float) -> float:
        """Total energy, D w / l."""
        return self.own.energy(z, t)
