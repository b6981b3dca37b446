"""A tape between its two ends: unknowns, energy, equations and their derivative.

Unknowns in the order of the tape: node 0, the multipliers of its holds, nodes 1 to n, the multipliers of the last; a
node has values and slopes of x, y and kappa^i (`ribbon.tape.kernel`). The equations are the derivative of

    L = E - sum_j mu_j (c_j - target_j).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

from ribbon.element import kernel_cache
from ribbon.tape.held import Hold
from ribbon.tape.section import FloatArray, Section

with kernel_cache.in_use():
    from ribbon.tape.kernel import assemble, hermite, line

GAUSS = 4
"""Gauss points of an element: exact for the squares of the fields."""


@dataclass(frozen=True)
class Rod:
    """A tape of length 1 on elements of the given lengths (elements,), held at its ends.

    dent: by how much the curvature across at rest is smaller in the middle (a part of it), over `dent_length` (l).
    """

    section: Section
    lengths: FloatArray
    start: Hold
    end: Hold
    dent: float = 0.0
    dent_length: float = 0.1

    @property
    def fields(self) -> int:
        """Unknowns of a node."""
        return 4 + 2 * self.section.terms

    @cached_property
    def s(self) -> FloatArray:
        """Abscissae of the nodes, (elements + 1,)."""
        return np.concatenate([[0.0], np.cumsum(self.lengths)])

    @cached_property
    def column(self) -> NDArray[np.int64]:
        """First unknown of every node."""
        found = np.arange(len(self.lengths) + 1) * self.fields
        found[1:] += self.start.count
        return found

    @property
    def size(self) -> int:
        """Unknowns and multipliers."""
        return int(self.column[-1]) + self.fields + self.end.count

    @cached_property
    def gauss(self) -> tuple[FloatArray, FloatArray]:
        """Points in [0, 1] and weights."""
        t, weight = leggauss(GAUSS)
        return 0.5 * (t + 1.0), 0.5 * weight

    @cached_property
    def tables(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """a^2 r (8, terms), `Section.warping` and weights (8,) over the section."""
        t, weight = self.section.points
        return np.ascontiguousarray(self.section.tables(t)[2]), self.section.warping(t), weight

    @cached_property
    def rest(self) -> FloatArray:
        """kappa^i at rest at the Gauss points, (elements, GAUSS, terms)."""
        s = self.s[:-1, None] + self.lengths[:, None] * self.gauss[0]
        return np.asarray(self.rest_at(s)[:, :, None] * self.section.rest)

    def rest_at(self, s: FloatArray) -> FloatArray:
        """The curvature across at rest over that of the section, at s."""
        return np.asarray(1.0 - self.dent * np.exp(-(((s - 0.5) / self.dent_length) ** 2)))

    @cached_property
    def middle(self) -> FloatArray:
        """a^2 r_i(0) (terms,): the middle's height over the centroid, by kappa^i."""
        return self.section.tables(np.zeros(1))[2][0]

    @cached_property
    def fixed(self) -> FloatArray:
        """The unknowns that nothing moves: curvatures of undeformed ends and their slopes."""
        curvatures = np.arange(4, self.fields)
        parts = [curvatures] if self.start.undeformed else []
        parts += [self.column[-1] + curvatures] if self.end.undeformed else []
        return np.concatenate([*parts, np.empty(0, dtype=np.int64)]).astype(np.int64)

    @cached_property
    def multipliers(self) -> tuple[slice, slice]:
        """Places of the multipliers of both ends."""
        last = int(self.column[-1]) + self.fields
        return slice(self.fields, self.fields + self.start.count), slice(last, last + self.end.count)

    @property
    def rows(self) -> int:
        """Rows of the band."""
        return 2 * self.fields + max(self.start.count, self.end.count)

    def nodes(self, x: FloatArray) -> FloatArray:
        """The nodes' unknowns (nodes, fields) of all unknowns x (size,)."""
        return np.asarray(x[self.column[:, None] + np.arange(self.fields)])

    def straight(self) -> FloatArray:
        """The tape at rest, its start at point and angle of its hold (origin and 0 where it has none), (size,)."""
        angle = self.start.angle or 0.0
        along, normal = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        origin = np.array(self.start.point or (0.0, 0.0)) + self.middle[0] * self.section.curvature * normal
        nodes = np.zeros((len(self.s), self.fields))
        for j in range(2):
            nodes[:, 2 * j], nodes[:, 2 * j + 1] = origin[j] + self.s * along[j], along[j]
        nodes[:, 4] = self.section.curvature
        x = np.zeros(self.size)
        x[self.column[:, None] + np.arange(self.fields)] = nodes
        return x

    def energy(self, x: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        """Elastic energy (D w / l), its gradient (size,) and its Hessian in a band (size, rows), no row held."""
        band, gradient = np.zeros((self.size, self.rows)), np.zeros(self.size)
        energy = assemble(
            self.nodes(x), self.lengths, self.section.stretching, self.section.bending, self.rest, *self.tables,
            *self.gauss, self.column, band, gradient,
        )  # fmt: skip
        return float(energy), gradient, band

    def equations(self, x: FloatArray, targets: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Derivative of L (size,) and its derivative in a band; targets: of both ends' rows."""
        _, gradient, band = self.energy(x)
        split = self.start.count
        for hold, node, places, target in (
            (self.start, 0, self.multipliers[0], targets[:split]),
            (self.end, -1, self.multipliers[1], targets[split:]),
        ):
            first = int(self.column[node])
            here = slice(first, first + self.fields)
            values, slopes, bends = hold.rows(x[here], self.middle)
            mu = x[places]
            gradient[here] -= mu @ slopes
            gradient[places] -= values - target
            block = -np.tensordot(mu, bends, 1)
            for j in range(self.fields):
                band[first + j, : self.fields - j] += block[j:, j]
                for row, place in enumerate(range(places.start, places.stop)):
                    band[first + j, place - first - j] -= slopes[row, j]
        gradient[self.fixed] = 0.0
        for i in self.fixed:
            band[i] = 0.0
            reach = np.arange(max(0, i - self.rows + 1), i)
            band[reach, i - reach] = 0.0
            band[i, 0] = 1.0
        return gradient, band

    def targets(self, start: Hold, end: Hold) -> FloatArray:
        """Targets of holds that hold the same things as this tape's."""
        return np.concatenate([start.targets, end.targets])

    def push(self, rate: FloatArray) -> FloatArray:
        """Derivative (size,) of the equations where the targets (count,) move with `rate`."""
        found = np.zeros(self.size)
        split = self.start.count
        found[self.multipliers[0]], found[self.multipliers[1]] = rate[:split], rate[split:]
        return found

    def at(self, x: FloatArray, s: FloatArray) -> FloatArray:
        """x, y, kappa^i and their first and second derivatives at s (k,): (k, 2 + terms, 3)."""
        nodes = self.nodes(x)
        element = np.clip(np.searchsorted(self.s, s, side="right") - 1, 0, len(self.lengths) - 1)
        found = np.empty((len(s), self.fields // 2, 3))
        shape = np.empty((3, 4))
        for k, e in enumerate(element):
            hermite((s[k] - self.s[e]) / self.lengths[e], self.lengths[e], shape)
            values = np.concatenate([nodes[e].reshape(-1, 2), nodes[e + 1].reshape(-1, 2)], axis=1)
            found[k] = values @ shape.T
        return found


def bent(fields: FloatArray) -> FloatArray:
    """k (k,) of the line where `Rod.at` gives the fields (k, 2 + terms, 3)."""
    (_, dx, ddx), (_, dy, ddy) = fields[:, 0].T, fields[:, 1].T
    return np.asarray((dx * ddy - dy * ddx) / (dx * dx + dy * dy))


__all__ = ["GAUSS", "Rod", "bent", "line"]
