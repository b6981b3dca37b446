"""What the dimensionless numbers of a result are in SI, where the strip was made from its material."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ribbon.errors import RibbonInputError
from ribbon.strip import Strip, abscissae

Equilibrium = Any
"""A `ribbon.Equilibrium`, which is built on this module."""

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class StripUnits:
    """l in m, D w / l^2 in N, D w / l in J and N m."""

    length: float
    force: float
    energy: float

    @classmethod
    def of(cls, strip: Strip) -> StripUnits:
        """The units of a strip that knows its stiffness; `RibbonInputError` for another one."""
        if strip.bending_stiffness is None:
            raise RibbonInputError(
                "strip", None, "has no numbers in SI: make it by Strip.from_material, or give bending_stiffness in N m"
            )
        stiffness = strip.bending_stiffness * strip.width
        return cls(strip.length, stiffness / strip.length**2, stiffness / strip.length)


@dataclass(frozen=True)
class InSI:
    """A result in m, N, N m and J; the numbers of `Equilibrium` under the same names, asked at abscissae in m.

    `RibbonInputError` for an abscissa that is not in [0, length] (a closed band goes on behind its seam).
    """

    result: Equilibrium
    units: StripUnits

    @property
    def energy(self) -> Mapping[str, float]:
        """Energies by part, elastic and total, J."""
        found = self.result.energy
        names = ("bending", "natural", "gravity", "plates", "tip", "elastic", "total")
        return {name: self.units.energy * getattr(found, name) for name in names}

    def _at(self, s: ArrayLike) -> FloatArray:
        at = np.asarray(s, dtype=float) if self.result.seam else abscissae(s, self.units.length, "m")
        return at / self.units.length

    def position(self, s: ArrayLike) -> FloatArray:
        """r (k, 3) in m at abscissae s (k,) in m from the start."""
        return self.units.length * self.result.position(self._at(s))

    def frame(self, s: ArrayLike) -> FloatArray:
        """Material frames (k, 3, 3), columns t_x t_y t_z, at abscissae s (k,) in m."""
        return self.result.frame(self._at(s))

    def omega(self, s: ArrayLike) -> FloatArray:
        """Normal curvature (k,) in 1/m at abscissae s (k,) in m."""
        return self.result.omega(self._at(s)) / self.units.length

    def eta(self, s: ArrayLike) -> FloatArray:
        """Ruling direction eta = tan(theta) (k,) at abscissae s (k,) in m."""
        return self.result.eta(self._at(s))

    def tau(self, s: ArrayLike) -> FloatArray:
        """Twist kappa_3 (k,) in 1/m at abscissae s (k,) in m."""
        return self.result.tau(self._at(s)) / self.units.length

    def in_plane(self, s: ArrayLike) -> FloatArray:
        """In-plane curvature kappa_2 (k,) in 1/m at abscissae s (k,) in m."""
        return self.result.in_plane(self._at(s)) / self.units.length

    @property
    def end_position(self) -> FloatArray:
        """The end of the centreline (3,), m."""
        return self.units.length * self.result.end.position

    @property
    def start_force(self) -> FloatArray | None:
        """What the support at s = 0 exerts on the ribbon (3,), N; None where it is not determined."""
        found = self.result.start
        return None if found is None else self.units.force * found.force

    @property
    def start_moment(self) -> FloatArray | None:
        """Its moment (3,), N m."""
        found = self.result.start
        return None if found is None else self.units.energy * found.moment

    @property
    def end_force(self) -> FloatArray | None:
        """What the clamp at s = l exerts on the ribbon (3,), N; None for a free or closed end, and where it is not
        determined."""
        found = self.result.end_support
        return None if found is None else self.units.force * found.force

    @property
    def end_moment(self) -> FloatArray | None:
        """Its moment (3,), N m."""
        found = self.result.end_support
        return None if found is None else self.units.energy * found.moment

    @property
    def wall_forces(self) -> tuple[FloatArray, ...]:
        """What every wall exerts on the ribbon (3,), N."""
        return tuple(self.units.force * wall.force for wall in self.result.walls)
