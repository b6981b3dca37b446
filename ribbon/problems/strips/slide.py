"""Friction between strips: a place of contact as a point of both, and how far one goes along the other.

Where strips touch, X of one and X' of the other are `distance` apart along n; the contact is at the point halfway, as
far as it is fixed to the material of each (docs/theory.md, eq. (5.21))::

    Y = X(S, v) + R(s) a ,   a = R(s)^T (X' - X) / 2 ,   Y' alike: Y = Y' where they touch ,
    u = (Y - Y') - (Y - Y' at the end of the last increment) ,   along two directions across n

with the particle (S, v), the frame R of the centreline at the foot s of its ruling, and S, v, s, a as they are there.
A force at Y on one and its opposite at Y' on the other balance in moment too, and no motion of both together slides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ribbon.problems import mixed_kernels as kernels
from ribbon.problems.friction.particles import ParticleRows, Vector
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.strips.between import Of
from ribbon.problems.touching import Nearest

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class Spot(NamedTuple):
    """A point fixed to a strip: foot s of its ruling, particle (S, v), arm a from there in the frame at s; in its l."""

    s: float
    particle: float
    v: float
    arm: Vector


class Slide(NamedTuple):
    """Spots of the strips `one` < `other` that push each other: normal, from the second to the first; place: Y - Y' at
    the end of the last increment, l_0; bound: the largest friction, mu N, force: what the first exerts on the other
    along it, as far as it is known, both in D_0 w_0 / l_0^2; stiffness: r of `ribbon.problems.friction.term`."""

    one: int
    other: int
    spots: tuple[Spot, Spot]
    normal: Vector
    place: Vector
    bound: float
    force: Vector
    stiffness: float = 1e4


@dataclass(frozen=True)
class SpotRows(ParticleRows):
    """Where spots are along `normal`: particles with arms (k, 3) in frames `feet` (k,) behind segments' starts."""

    arms: FloatArray | None = None
    feet: FloatArray | None = None

    def _nearest(self, x: FloatArray) -> Nearest:
        found = super()._nearest(x)
        assert self.arms is not None
        assert self.feet is not None
        frames = self._walked(self._own(x), self.feet)[:, :9].reshape(self.count, 3, 3, self.components)
        arm = np.ascontiguousarray(np.einsum("kijc,kj->kic", frames, self.arms))
        for row, length in enumerate(self.lengths[self.segments]):
            for r in range(3):
                kernels.by_unknowns(arm[row, r], length)
        return found._replace(jets=found.jets + arm)


def spot_rows(part: MixedProblem, spots: Sequence[Spot], along: FloatArray) -> SpotRows:
    """Rows of spots of a strip along a direction (3,)."""
    starts = np.concatenate([[0.0], np.cumsum(part.lengths)])
    i = np.array([part.segment_at(spot.s) for spot in spots])
    return SpotRows(
        i, np.array([spot.particle for spot in spots]) - starts[i],
        np.array([spot.v for spot in spots]) / part.half_width, np.zeros(len(spots), dtype=bool), part.lengths,
        np.zeros(3), along, part.half_width, part.exponent_limit, part.fields.components, part.fields.free,
        part.sideways, arms=np.array([spot.arm for spot in spots]),
        feet=np.array([spot.s for spot in spots]) - starts[i],
    )  # fmt: skip


@dataclass(frozen=True)
class SlideRows:
    """Y - Y' of slides between two strips along a direction, one row each; sides: each strip's, of: what it is. Both
    may be one strip; a column that both spots depend on then carries the sum where it is first, and nothing again."""

    sides: tuple[SpotRows, SpotRows]
    of: tuple[Of, Of]

    @property
    def count(self) -> int:
        """One row a slide."""
        return self.sides[0].count

    def _each(self, x: FloatArray) -> list[tuple[float, SpotRows, FloatArray]]:
        """Factor (sigma, minus that of the second), rows and own unknowns of both sides."""
        return [
            (sign * of.over, rows, np.ascontiguousarray(x[of.first : of.first + of.part.size]))
            for sign, rows, of in zip((1.0, -1.0), self.sides, self.of, strict=True)
        ]

    def values(self, x: FloatArray) -> FloatArray:
        """(k,), l_0."""
        return np.asarray(sum(factor * rows.values(own) for factor, rows, own in self._each(x)))

    @property
    def columns(self) -> IntArray:
        """Columns (k, n) on which each depends."""
        both = zip(self.sides, self.of, strict=True)
        return np.concatenate([rows.columns + of.first for rows, of in both], axis=1)

    def jacobian(self, x: FloatArray) -> FloatArray:
        """By these columns, row after row."""
        each = [factor * rows.jacobian(own).reshape(rows.count, -1) for factor, rows, own in self._each(x)]
        if self.of[0].first == self.of[1].first:
            same = self.sides[0].columns[:, :, None] == self.sides[1].columns[:, None, :]
            each[0] = each[0] + np.einsum("kij,kj->ki", same, each[1])
            each[1] = np.where(same.any(axis=1), 0.0, each[1])
        return np.concatenate(each, axis=1).ravel()

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """Of one side, then of the other."""
        each = [(rows.hessian_structure(), of.first) for rows, of in zip(self.sides, self.of, strict=True)]
        return (
            np.concatenate([rows + first for (rows, _), first in each]),
            np.concatenate([columns + first for (_, columns), first in each]),
        )

    def hessian(self, x: FloatArray, multipliers: FloatArray) -> FloatArray:
        """In the order of the structure."""
        return np.concatenate([rows.hessian(own, factor * multipliers) for factor, rows, own in self._each(x)])

    def points(self, x: FloatArray) -> FloatArray:
        """Y (k, 3), l_0."""
        factor, rows, own = self._each(x)[0]
        return factor * rows.points(own)
