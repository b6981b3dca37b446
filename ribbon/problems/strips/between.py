"""Places of two different strips that are held apart: one row a pair, which slides (`ribbon.problems.itself.pairs`).

The nearest places of two strips are looked for as those of one strip are, each on its own segment and ruling; lengths
are in l_0, abscissae and places across each over the length of its own strip: ``X = sigma X_own(x_own, t)``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ribbon.problems.itself.pairs import BEYOND, Pair, PairRows, Side
from ribbon.problems.mixed import MixedProblem

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


#: How far, over half the width, the place that slides may go past an edge, where the other place stays: edges right
#: above each other are neither the nearest nor beyond, and the row has its second derivatives there.
PAST_EDGE = 1e-4


class Touching(NamedTuple):
    """Places of the strips `one` < `other` that are held apart: abscissae and places across (`Pair`), each over the
    length of its own strip. Where the first place stays (`Pair.stays`) it is of the strip `one`, whichever that is."""

    one: int
    other: int
    pair: Pair


class Of(NamedTuple):
    """One of two strips: its problem, the first of its unknowns, sigma."""

    part: MixedProblem
    first: int
    over: float


@dataclass(frozen=True)
class BetweenRows(PairRows):
    """Places of two strips at least `distance` (l_0) apart; sides: each strip's rows by itself, of: what it is."""

    sides: tuple[PairRows, ...] = ()
    of: tuple[Of, ...] = ()

    @classmethod
    def between(cls, pairs: tuple[Pair, ...], distance: float, one: Of, other: Of) -> BetweenRows:
        """The rows of pairs whose first place is on `one` and whose second one is on `other`."""
        both = (one, other)
        places = ([pair.s for pair in pairs], [pair.s_other for pair in pairs])
        segments = np.array(
            [[of.part.segment_at(s) for s in along] for of, along in zip(both, places, strict=True)], dtype=np.int64
        )
        sides = tuple(
            PairRows(
                pairs, distance, np.array([own, own]), of.part.lengths, of.part.half_width, of.part.exponent_limit,
                of.part.fields.components, of.part.fields.free, of.part.sideways,
            )
            for of, own in zip(both, segments, strict=True)
        )  # fmt: skip
        part = one.part
        return cls(
            pairs, distance, segments, part.lengths, part.half_width, part.exponent_limit, part.fields.components,
            part.fields.free, part.sideways, sides=sides, of=both,
        )  # fmt: skip

    @cached_property
    def _from(self) -> FloatArray:
        return np.stack([own._starts[own.segments[0]] for own in self.sides], axis=1)

    @cached_property
    def long(self) -> FloatArray:
        return np.stack([own.lengths[own.segments[0]] for own in self.sides], axis=1)

    @cached_property
    def _stay(self) -> NDArray[np.bool_]:
        return np.array([pair.stays for pair in self.pairs])

    @cached_property
    def _room(self) -> tuple[FloatArray, FloatArray]:
        low, high = [], []
        for own in self.sides:
            segment = own.segments[0]
            length, edge = own.lengths[segment], own.half_width * (1.0 + PAST_EDGE * self._stay)
            before = np.where(segment == 0, 0.0, BEYOND)  # nothing is beyond a strip's ends
            behind = np.where(segment == own.lengths.size - 1, 0.0, BEYOND)
            low += [-before * length, -edge]
            high += [(1.0 + behind) * length, edge]
        return np.stack(low, axis=1), np.stack(high, axis=1)

    def _side(self, x: FloatArray, side: int, t: FloatArray, second: bool) -> Side:
        of = self.of[side]
        own = np.ascontiguousarray(x[of.first : of.first + of.part.size])
        return Side(*(of.over * each for each in self.sides[side]._side(own, 0, t, second)))

    @cached_property
    def _all(self) -> IntArray:
        both = zip(self.sides, self.of, strict=True)
        return np.concatenate([own._columns[0] + of.first for own, of in both], axis=1)
