"""The shearable rod as a strip in space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from compare.models.base import on_strip
from compare.models.line import Line
from compare.scene.inputs.law import at

if TYPE_CHECKING:
    from shellref.rod.result import RodResult

FloatArray = NDArray[np.float64]

#: Fields at the particles: name -> index of the strain.
STRAINS = {"shear_x": 0, "shear_y": 1, "stretch": 2, "kappa_1": 3, "kappa_2": 4, "kappa_3": 5}


@dataclass(frozen=True)
class RodShape(Line):
    """The rod as a strip in space; width w / l."""

    result: RodResult
    width: float

    @property
    def bend(self) -> float:
        """Largest curvature about t_x, 1/l."""
        return float(np.abs(self.result.strains(np.linspace(0.0, 1.0, 501))[:, 3]).max())

    def centreline(self, s: FloatArray) -> FloatArray:
        """Positions (k, 3)."""
        return self.result.position(on_strip(s))

    def frames(self, s: FloatArray) -> FloatArray:
        """Frames (k, 3, 3), columns t_x t_y t_z; t_z normal to the section, which may shear."""
        return self.result.frames(on_strip(s))

    def along(self, s: FloatArray) -> dict[str, FloatArray]:
        """energy_density, omega (= kappa_1), and the six strains."""
        found = self.result.strains(s)
        problem = self.result.problem
        natural = at(problem.curvature, s)
        density = 0.5 * self.result.excess(s) ** 2 @ problem.section.stiffness - 0.5 * natural**2
        return {"energy_density": density, "omega": found[:, 3], **{k: found[:, i] for k, i in STRAINS.items()}}
