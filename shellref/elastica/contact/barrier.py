"""What a planar elastica cannot cross: circles and lines. NumPy only."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Barrier:
    """What the strip cannot cross, in the plane: a circle, outside (side 1) or inside it (-1), or a line (radius inf).

    point (2,): the centre, or a point of the line; normal (2,): unit vector of a line towards the strip.
    """

    point: tuple[float, float]
    radius: float = math.inf
    side: float = 1.0
    normal: tuple[float, float] = (0.0, 1.0)

    def gaps(self, r: Array) -> Array:
        """Distances (k,) of points (k, 2), negative behind it."""
        apart = r - np.array(self.point)
        if math.isinf(self.radius):
            return np.asarray(apart @ np.array(self.normal))
        return np.asarray(self.side * (np.linalg.norm(apart, axis=1) - self.radius))

    def outward(self, r: Array) -> tuple[Array, float]:
        """u (2,) at a point (2,) and 1 / rho."""
        if math.isinf(self.radius):
            return np.array(self.normal), 0.0
        apart = r - np.array(self.point)
        rho = float(np.linalg.norm(apart))
        return apart / rho, 1.0 / rho

    def between(self, other: Barrier, t: float) -> Barrier:
        """The barrier on the straight way of its point to another's."""
        a, b = self.point, other.point
        return replace(
            other,
            point=(a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])),
            radius=other.radius if math.isinf(other.radius) else self.radius + t * (other.radius - self.radius),
        )
