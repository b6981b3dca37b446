"""The curve-angle rod as a strip in space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from compare.models.base import on_strip
from compare.models.line import Line

if TYPE_CHECKING:
    from ribbon.rods.result import RodShape

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class CurveAngleShape(Line):
    """The rod as a strip in space."""

    native: RodShape

    @property
    def bend(self) -> float:
        """Largest normal curvature, 1/l."""
        return float(np.abs(self.native.strains[:, 0]).max())

    def centreline(self, s: FloatArray) -> FloatArray:
        """Positions (k, 3)."""
        return self.native.centreline(on_strip(s))

    def frames(self, s: FloatArray) -> FloatArray:
        """Frames (k, 3, 3), columns t_x t_y t_z."""
        return self.native.frames(on_strip(s))

    def along(self, s: FloatArray) -> dict[str, FloatArray]:
        """omega, kappa_2, tau and energy_density."""
        strain, rest = self.native.strain(s), self.native.rod.at_rest(s)
        density = 0.5 * (strain - rest) ** 2 @ np.array(self.native.rod.stiffness) - 0.5 * rest[:, 0] ** 2
        return dict(zip(("omega", "kappa_2", "tau", "energy_density"), (*strain.T, density), strict=True))
