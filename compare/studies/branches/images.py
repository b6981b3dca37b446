"""Whether the first point of a branch lies on one that was followed, or is the image of a point of it.

A scene has the symmetries of what holds and loads it: mirrors, turns, and, where both ends are held alike, reading the
strip from its other end. They need not be known: two equilibria at one value of the number, with one energy and as many
unstable modes, are images where one surface can be laid on the other by a motion or a mirror in space, with particles
(s, v) on (s, v), (s, -v), (1 - s, v) or (1 - s, -v). The motion that fits best follows from the singular vectors of the
product of both (G. Wahba 1965, doi:10.1137/1007077; W. Kabsch 1976, doi:10.1107/S0567739476001873).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from compare.continuation.correct import first_point
from compare.continuation.point import Options, Point
from compare.models.base import Shape

FloatArray = NDArray[np.float64]

By = Literal["mirror", "half turn", "turn", "reversal", "mirror, reversed", "half turn, reversed", "turn, reversed"]
#: Difference of energies (relative, at least 1) of images; distance (l) of two that are one; the part of the distance
#: between them, and l, that may be left when one is laid on the other.
ALIKE, SAME, LEFT, LAID = 1e-6, 1e-6, 1e-2, 1e-7
#: Particles along the strip; cosines of a turn by half a turn, and by none.
_ALONG, _TURNED = 41, 1e-4
#: How far beyond its first point (over its first step) a branch is looked at too.
_BEFORE = 2.0


@dataclass(frozen=True)
class Image:
    """Of which branch (its number), and by what: None, it is a point of that branch itself."""

    of: int
    by: By | None


@dataclass
class Known:
    """Branches that were followed; shape: of a point; width: of the strip at t, l."""

    shape: Callable[[Point], Shape]
    width: Callable[[float], float]
    options: Options
    _branches: list[tuple[int, tuple[Point, ...]]] = field(default_factory=list)

    def add(self, number: int, points: tuple[Point, ...]) -> None:
        """A branch that was followed."""
        self._branches.append((number, points))

    def image(self, point: Point) -> Image | None:
        """What a point is of those that are known; None: another one."""
        energy = point.system.energy(point.z, point.t)
        surface: FloatArray | None = None
        found: Image | None = None
        for number, points in self._branches:
            for other in self._at(points, point.t):
                apart = abs(other.system.energy(other.z, other.t) - energy)
                if apart > ALIKE * max(1.0, abs(energy)) or other.unstable != point.unstable:
                    continue
                surface = self._surface(point) if surface is None else surface
                by = laid(self._surface(other), surface)
                if by == "same":
                    return Image(number, None)
                if by is not None and found is None:
                    found = Image(number, by)
        return found

    def _at(self, points: tuple[Point, ...], t: float) -> Iterator[Point]:
        """Where a branch has this t: between neighbours, and a little before its first point."""
        if len(points) > 1:
            one, other = points[0], points[1]
            ahead = (t - one.t) / (other.t - one.t) if other.t != one.t else 0.0
            if -_BEFORE <= ahead < 0.0:
                yield from self._between(one, other, ahead, t)
        for one, other in pairwise(points):
            if (one.t - t) * (other.t - t) <= 0.0 and one.t != other.t:
                yield from self._between(one, other, (t - one.t) / (other.t - one.t), t)

    def _between(self, one: Point, other: Point, share: float, t: float) -> Iterator[Point]:
        guess = (1.0 - share) * one.z + share * other.z if one.z.shape == other.z.shape else one.z
        found = first_point(one.system, guess, t, self.options.tolerance, check=False)
        if found is not None:
            yield found

    def _surface(self, point: Point) -> FloatArray:
        half = 0.5 * self.width(point.t)
        return self.shape(point).points(np.linspace(0.0, 1.0, _ALONG), np.array([-half, 0.0, half]))


def laid(one: FloatArray, other: FloatArray) -> By | Literal["same"] | None:
    """By what two surfaces (k, 3, 3), of particles at even distances along and across, are images; None: they are not.
    Mirrors go before turns, and what is not reversed before what is."""
    apart = float(np.linalg.norm(one - other, axis=2).max())
    if apart <= SAME:
        return "same"
    found: dict[By, float] = {}
    for back in (False, True):
        for over in (False, True):
            there = other[::-1] if back else other
            there = there[:, ::-1] if over else there
            for sign in (-1.0, 1.0):
                turn, left = _fitted(one.reshape(-1, 3), there.reshape(-1, 3), sign)
                if left <= max(LEFT * apart, LAID):
                    name = _named(turn, sign, back)
                    if name is not None:
                        found[name] = min(left, found.get(name, np.inf))
    order: tuple[By, ...] = (
        "mirror", "half turn", "turn", "reversal", "mirror, reversed", "half turn, reversed", "turn, reversed",
    )  # fmt: skip
    return next((name for name in order if name in found), None)


def _named(turn: FloatArray, sign: float, back: bool) -> By | None:
    if sign < 0.0:
        return "mirror, reversed" if back else "mirror"
    trace = float(np.trace(turn))
    if trace >= 3.0 - _TURNED:
        return "reversal" if back else None
    if trace <= -1.0 + _TURNED:
        return "half turn, reversed" if back else "half turn"
    return "turn, reversed" if back else "turn"


def _fitted(one: FloatArray, other: FloatArray, sign: float) -> tuple[FloatArray, float]:
    """The turn (3, 3), of determinant `sign`, that lays points (k, 3) about their middle best on others about theirs,
    and the largest distance that is left."""
    a, b = one - one.mean(axis=0), other - other.mean(axis=0)
    u, _, v = np.linalg.svd(b.T @ a)
    turn = u @ np.diag([1.0, 1.0, sign * float(np.linalg.det(u @ v))]) @ v
    return turn, float(np.linalg.norm(a @ turn.T - b, axis=1).max())
