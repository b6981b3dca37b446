"""What holds a tape's ends: a point of its middle line, the angle of its section, the section itself.

In the plane (X, Y) of the section's tangent and normal at angle 0, with phi the angle of r' and z_m = a^2 kappa^i
r_i(0) the height of the middle over the centroid (away from the normal), the middle stands at

    P = r - z_m n(phi),   n = (-sin phi, cos phi).

Rows are c - target = 0; a row's multiplier is the derivative of the energy by its target: the force on the held point
along a direction, the moment about it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Hold:
    """How one end is held; lengths in l, angles in rad.

    point: where the middle of the section is held, None: nowhere; slide: angle of the direction along which it may
    slide, None: it stays; angle: of the section's tangent, None: it may turn; undeformed: the section keeps its shape
    (kappa = kappa0, kappa' = 0), otherwise it is free.
    """

    point: tuple[float, float] | None = None
    slide: float | None = None
    angle: float | None = None
    undeformed: bool = True

    @property
    def directions(self) -> FloatArray:
        """Directions (k, 2) along which the point is held."""
        if self.point is None:
            return np.empty((0, 2))
        if self.slide is None:
            return np.eye(2)
        return np.array([[-math.sin(self.slide), math.cos(self.slide)]])

    @property
    def count(self) -> int:
        """Rows."""
        return len(self.directions) + (self.angle is not None)

    @property
    def targets(self) -> FloatArray:
        """Targets (count,): the point along its directions, then the angle."""
        along = self.directions @ np.array(self.point if self.point is not None else (0.0, 0.0))
        return np.append(along, self.angle) if self.angle is not None else along

    def alike(self, other: Hold) -> bool:
        """Whether the two hold the same things, so that one can become the other continuously."""
        return (
            (self.point is None) == (other.point is None)
            and self.slide == other.slide
            and (self.angle is None) == (other.angle is None)
            and self.undeformed == other.undeformed
        )

    def rows(self, node: FloatArray, middle: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Values (count,), gradients (count, fields) and Hessians (count, fields, fields) by a node's unknowns
        (x, x', y, y', kappa^0, kappa^0', ...); middle: a^2 r_i(0) (terms,). The angle is that nearest to `angle`."""
        size = node.size
        x, dx, y, dy = node[:4]
        g = dx * dx + dy * dy
        cosine, sine = dx / math.sqrt(g), dy / math.sqrt(g)
        turn, bend = np.zeros(size), np.zeros((size, size))
        turn[1], turn[3] = -dy / g, dx / g
        bend[1, 1], bend[3, 3] = 2.0 * dx * dy / g**2, -2.0 * dx * dy / g**2
        bend[1, 3] = bend[3, 1] = (dy * dy - dx * dx) / g**2
        rise = np.zeros(size)
        rise[4::2] = middle
        z = float(middle @ node[4::2])
        mixed, square = np.outer(rise, turn) + np.outer(turn, rise), np.outer(turn, turn)
        across, along = np.zeros(size), np.zeros(size)
        across[0], along[2] = 1.0, 1.0
        point = np.array([x + z * sine, y - z * cosine])
        first = np.array([across + sine * rise + z * cosine * turn, along - cosine * rise + z * sine * turn])
        second = np.array(
            [
                cosine * mixed - z * sine * square + z * cosine * bend,
                sine * mixed + z * cosine * square + z * sine * bend,
            ]
        )
        m = self.directions
        values, gradients, hessians = m @ point, m @ first, np.tensordot(m, second, 1)
        if self.angle is None:
            return values, gradients, hessians
        c, s = math.cos(self.angle), math.sin(self.angle)
        phi = self.angle + math.atan2(c * dy - s * dx, c * dx + s * dy)
        return np.append(values, phi), np.vstack([gradients, turn]), np.concatenate([hessians, bend[None]])
