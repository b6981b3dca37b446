"""The elastica as a strip in space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from compare.models.base import on_strip
from compare.models.line import Line
from compare.scene.inputs.law import at

if TYPE_CHECKING:
    from shellref.elastica.result import ElasticaResult

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class ElasticaShape(Line):
    """The elastica as a strip in space; `width` is w / l."""

    result: ElasticaResult
    position: FloatArray
    frame: FloatArray
    width: float

    @property
    def bend(self) -> float:
        """Largest curvature, 1/l, from the turn between samples."""
        s = np.linspace(0.0, 1.0, 2001)
        return float(np.abs(np.gradient(self.result.angle(s), s)).max())

    def centreline(self, s: FloatArray) -> FloatArray:
        """Positions (k, 3)."""
        from shellref.elastica.result import embed

        return embed(self.result, self.position, self.frame, on_strip(s))

    def frames(self, s: FloatArray) -> FloatArray:
        """Frames (k, 3, 3), columns t_x t_y t_z."""
        from shellref.elastica.result import embed_frames

        return embed_frames(self.result, self.frame, on_strip(s))

    def along(self, s: FloatArray) -> dict[str, FloatArray]:
        """omega, by central differences of theta over 1e-4, one-sided at the ends; energy_density."""
        low, high = np.clip(s - 5e-5, 0.0, 1.0), np.clip(s + 5e-5, 0.0, 1.0)
        omega = (self.result.angle(high) - self.result.angle(low)) / (high - low)
        return {"omega": omega, "energy_density": 0.5 * omega**2 - at(self.result.problem.curvature, s) * omega}
