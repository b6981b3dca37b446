"""Where particles of the strip's edges are: rows that stay with a particle while the ruling through it turns.

A ruling's end at the foot s is the particle ``S = s + v eta(s)``, v = +- w / 2 (docs/theory.md, eq. (5.14)). On the
segment that starts at s_i, with eta = n h + m, the particle's foot is at h behind the start::

    h = (S - s_i - v m) / (1 + v n) ,   h_m = -v / (1 + v n) ,   h_n = h h_m ,
    h_mn = -v h_m / (1 + v n) ,   h_nn = -2 v h_n / (1 + v n) ,   h_mm = 0 ,

so that with y(h; a, b, n, m) of `ribbon.problems.touching` its place Y = y(h(n, m); ...) has the derivatives::

    Y_i = y_i + y_h h_i ,   Y_ij = y_ij + y_hi h_j + y_hj h_i + y_hh h_i h_j + y_h h_ij .

Where the twist is free sections stay with their particles, and h = S - s_i.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ribbon.element import quaternion
from ribbon.problems import mixed_kernels as kernels
from ribbon.problems.layout import OMEGA, POSITION, QUATERNION
from ribbon.problems.touching import Nearest, TouchRows

FloatArray = NDArray[np.float64]
Vector = tuple[float, float, float]

#: Places of n and m among the parameters of a segment.
_N, _M = 2, 3


class Rub(NamedTuple):
    """A particle of the strip that a wall with friction pushes, in an increment of a path.

    wall: its number; s, side: abscissa of the particle's ruling (its segment's choice) and where across, in half
    widths; particle: S in l; normal: of the wall there; place: where on the wall, as it stands now, the particle was at
    the end of the last increment, in l; bound: the largest friction, mu N, in D w / l^2; force: what the particle
    exerts on the wall along it, as far as it is known, in D w / l^2; stiffness: r of `ribbon.problems.friction.term`.
    """

    wall: int
    s: float
    side: float
    particle: float
    normal: Vector
    place: Vector
    bound: float
    force: Vector
    stiffness: float = 1e4


@dataclass(frozen=True)
class ParticleRows(TouchRows):
    """Distances of particles from a plane through `point` across `normal`; along: S - s_i of each (k,)."""

    def _nearest(self, x: FloatArray) -> Nearest:
        q = self._own(x)
        v = self.half_width * self.sides
        stretch = np.ones(self.count) if self.free else 1.0 + v * q[:, _N]
        h = self.along if self.free else (self.along - v * q[:, _M]) / stretch
        states = self._walked(q, h)
        jets = self._jets_of(states, q, h, self.sides)
        if not self.free:
            self._follow(jets, states, q, h, v / stretch)
        for row, length in enumerate(self.lengths[self.segments]):
            for r in range(3):
                kernels.by_unknowns(jets[row, r], length)
        return Nearest(h, jets, np.zeros((self.count, 3, 1 + self._parameters)), np.zeros(self.count))

    def _follow(self, jets: FloatArray, states: FloatArray, q: FloatArray, h: FloatArray, ratio: FloatArray) -> None:
        """Adds to the jets (k, 3, components) at fixed feet that the feet move; ratio (k,): v / (1 + v n)."""
        count = self._parameters
        slopes = self._along_edge(states, q, h)
        first, mixed, second = slopes[:, :, 0], slopes[:, :, 1 : 1 + count], self._curved_edge(states, q, h)
        by, twice = np.zeros((self.count, count)), np.zeros((self.count, count, count))
        by[:, _M], by[:, _N] = -ratio, -h * ratio
        twice[:, _N, _M] = twice[:, _M, _N] = ratio * ratio
        twice[:, _N, _N] = 2.0 * h * ratio * ratio
        one, other = np.triu_indices(count)
        jets[:, :, 1 : 1 + count] += first[:, :, None] * by[:, None, :]
        jets[:, :, 1 + count :] += (
            mixed[:, :, one] * by[:, None, other]
            + mixed[:, :, other] * by[:, None, one]
            + second[:, :, None] * (by[:, one] * by[:, other])[:, None, :]
            + first[:, :, None] * twice[:, one, other][:, None, :]
        )

    @property
    def columns(self) -> NDArray[np.int64]:
        """Columns (k, 7 + parameters) on which each place depends."""
        return self._columns

    def points(self, x: FloatArray) -> FloatArray:
        """Where (k, 3) the particles are, in l."""
        own = x[self._columns]
        turned = quaternion.matrix(own[:, QUATERNION:OMEGA])
        return np.asarray(own[:, POSITION:QUATERNION] + np.einsum("kij,kj->ki", turned, self._at(x).jets[:, :, 0]))
