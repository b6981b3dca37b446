"""What a model says of its equilibria so that a branch of them can be followed: a residual, its factor, a metric.

G(z, t) = 0: z holds unknowns and the multipliers of what holds; t, without unit, is 0 and 1 at the two ends of the
range that was asked for. K = dG/dz is the second variation of a Lagrangian: its inertia counts unstable modes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Step in t of a rate by differences: the error of second order and what rounding leaves are both below 1e-8.
_STEP = 1e-4


class Factor(Protocol):
    """K at a point, factored."""

    @property
    def unstable(self) -> int:
        """Number of negative eigenvalues of the second variation on the tangent of what is active."""

    def solve(self, b: FloatArray) -> FloatArray:
        """K^-1 b, (n,) or (n, k)."""

    def solve_transposed(self, b: FloatArray) -> FloatArray:
        """K^-T b, (n,)."""


class System(Protocol):
    """Equilibria of one model on one mesh with one set of conditions in force."""

    @property
    def size(self) -> int:
        """Number of unknowns n."""

    def residual(self, z: FloatArray, t: float) -> FloatArray:
        """G (n,); not finite where there is none."""

    def norm(self, residual: FloatArray) -> float:
        """What of it counts, 1 being a force of the strip's own size."""

    def rate(self, z: FloatArray, t: float) -> FloatArray:
        """dG/dt (n,)."""

    def factor(self, z: FloatArray, t: float) -> Factor | None:
        """K, factored; None where it has an entry that is not finite."""

    def mass(self, v: FloatArray) -> FloatArray:
        """M v (n,), M the positive semidefinite metric of shapes (multipliers weigh nothing)."""

    def reach(self, z: FloatArray, dz: FloatArray) -> float:
        """The part of a step dz, at most 1, that stays where the energy is finite."""

    def stepped(self, z: FloatArray, dz: FloatArray) -> FloatArray:
        """z + dz to first order, bent where that would leave what the energy is finite on."""

    def slacks(self, z: FloatArray, t: float) -> FloatArray:
        """Conditions of one side (k,), each at least 0 as long as the same ones are in force; (0,) without any."""

    def beyond(
        self, z: FloatArray, t: float, condition: int, directions: FloatArray
    ) -> tuple[System, FloatArray, FloatArray, str]:
        """The system in which a condition whose slack is zero has come into force, or gone out: its z, directions
        (n, k) carried over, and in words what happened. The condition keeps its number. Itself where no branch goes
        on."""

    def renewed(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[System, FloatArray, FloatArray]:
        """The system with what moves nothing at z told anew, z and directions (n, k) in it; itself where that is the
        same."""

    def moved(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[System, FloatArray, FloatArray]:
        """The system on elements that stand where the shape z has what is sudden, z and directions (n, k) carried over,
        not yet an equilibrium; itself where they need not move."""

    def resolved(self, z: FloatArray, t: float) -> bool:
        """Whether its elements are fine enough for the shape z that what they say of it is believed."""

    def convexity(self, z: FloatArray, t: float) -> float:
        """Least slack of Legendre's condition, above zero where the density is convex all along: else waves as short as
        one likes lower the energy, and modes and branch points are those of the elements. inf: it cannot be lost."""

    def finer(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[System, FloatArray, FloatArray]:
        """The system on elements half as long, z and directions (n, k) carried over, not yet an equilibrium."""

    def energy(self, z: FloatArray, t: float) -> float:
        """Total energy, D w / l."""


class Unbounded:
    """What a `System` says that has no conditions of one side, nothing that moves nothing, and elements that stay."""

    def reach(self, z: FloatArray, dz: FloatArray) -> float:
        """Nothing bounds a step."""
        return 1.0

    def slacks(self, z: FloatArray, t: float) -> FloatArray:
        """No conditions of one side: (0,)."""
        return np.zeros(0)

    def beyond(
        self, z: FloatArray, t: float, condition: int, directions: FloatArray
    ) -> tuple[Self, FloatArray, FloatArray, str]:
        """There is none to go beyond: ValueError."""
        raise ValueError(f"condition = {condition}: there are no conditions of one side")

    def renewed(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[Self, FloatArray, FloatArray]:
        """Everything moves something."""
        return self, z, directions

    def moved(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[Self, FloatArray, FloatArray]:
        """Its elements stay where they are."""
        return self, z, directions

    def resolved(self, z: FloatArray, t: float) -> bool:
        """They are."""
        return True

    def convexity(self, z: FloatArray, t: float) -> float:
        """It cannot be lost."""
        return np.inf


def rate_by_differences(residual: Callable[[FloatArray, float], FloatArray], z: FloatArray, t: float) -> FloatArray:
    """dG/dt (n,) of second order, from one side at an end of what is possible, where a residual is not finite."""
    after, before = residual(z, t + _STEP), residual(z, t - _STEP)
    if np.all(np.isfinite(after)) and np.all(np.isfinite(before)):
        return (after - before) / (2.0 * _STEP)
    side = _STEP if np.all(np.isfinite(after)) else -_STEP
    near, far = residual(z, t + side), residual(z, t + 2.0 * side)
    return (4.0 * near - 3.0 * residual(z, t) - far) / (2.0 * side)
