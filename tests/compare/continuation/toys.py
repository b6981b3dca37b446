"""Systems of a few unknowns whose branches are known in closed form (`compare.continuation.system.System`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Dense:
    """A dense symmetric K."""

    matrix: FloatArray

    @property
    def unstable(self) -> int:
        return int((np.linalg.eigvalsh(self.matrix) < 0.0).sum())

    def solve(self, b: FloatArray) -> FloatArray:
        try:
            return np.linalg.solve(self.matrix, b)
        except np.linalg.LinAlgError:
            return np.linalg.solve(self.matrix + 1e-18 * np.eye(len(self.matrix)), b)

    solve_transposed = solve


@dataclass(frozen=True)
class Toy:
    """The gradient of an energy: G(z, t), its K by complex steps of G, dG/dt likewise; conditions: slacks (z, t)."""

    gradient: Callable[[FloatArray, float], FloatArray]
    size: int

    def residual(self, z: FloatArray, t: float) -> FloatArray:
        return np.asarray(np.real(self.gradient(z, t)), dtype=float)

    def norm(self, residual: FloatArray) -> float:
        return float(np.abs(residual).max())

    def rate(self, z: FloatArray, t: float) -> FloatArray:
        return np.imag(self.gradient(z.astype(complex), t + 1e-30j)) / 1e-30

    def factor(self, z: FloatArray, t: float) -> Dense:
        steps = 1e-30j * np.eye(self.size)
        return Dense(np.array([np.imag(self.gradient(z + step, t)) / 1e-30 for step in steps]).T)

    def mass(self, v: FloatArray) -> FloatArray:
        return v

    def reach(self, z: FloatArray, dz: FloatArray) -> float:
        return 1.0

    def stepped(self, z, dz):
        return z + dz

    def slacks(self, z: FloatArray, t: float) -> FloatArray:
        return np.zeros(0)

    def beyond(self, z, t, condition, directions):
        raise AssertionError

    def renewed(self, z, t, directions):
        return self, z, directions

    def moved(self, z, t, directions):
        return self, z, directions

    def resolved(self, z, t):
        return True

    def convexity(self, z, t):
        return np.inf

    def finer(self, z, t, directions):
        return self, z, directions

    def energy(self, z: FloatArray, t: float) -> float:
        return float(z @ z)
