"""What a shell may touch: planes, rigid or pressure plates on springs, and how they move along its path. NumPy only."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from shellref.inputs import FRAME_TOLERANCE, ShellInputError, Vector, build, numbers, positive

#: What of the strip meets a wall: its middle surface, as a ribbon does, or both faces, at h / 2 along the director.
SURFACES = MIDSURFACE, FACES = ("midsurface", "faces")


@dataclass(frozen=True)
class Wall:
    """A plane that the strip cannot cross, <x - point, normal> >= q, without friction.

    point (3,), units l; normal (3,): unit vector towards the strip. stiffness: None, the wall is rigid (q = 0); else
    it is a pressure plate that may move along its normal by q against the energy stiffness q^2 / 2 (D w / l^3), and
    `point` is its place at rest. Raises ShellInputError.
    """

    point: Vector
    normal: Vector
    stiffness: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", numbers("walls.point", self.point, 3))
        object.__setattr__(self, "normal", numbers("walls.normal", self.normal, 3))
        if abs(math.hypot(*self.normal) - 1.0) > FRAME_TOLERANCE:
            raise ShellInputError("walls.normal", self.normal, "must be a unit vector (to 1e-9)")
        if self.stiffness is not None:
            try:
                object.__setattr__(self, "stiffness", positive("walls.stiffness", self.stiffness))
            except ShellInputError as error:
                remedy = f"{error.remedy}: None is a rigid wall"
                raise ShellInputError(error.key, error.value, remedy) from None

    @classmethod
    def read(cls, value: Any) -> Wall:
        """A wall from itself or from a mapping of its fields."""
        if isinstance(value, Wall):
            return value
        if isinstance(value, Mapping) and not {"point", "normal"} <= set(value):
            raise ShellInputError("walls", dict(value), "a wall needs point and normal")
        wall: Wall = build(cls, "walls", value)
        return wall

    @property
    def offset(self) -> float:
        """<point, normal>."""
        return float(np.dot(self.point, self.normal))


@dataclass(frozen=True)
class WallPath:
    """Walls along a path: normals (k, 3), stiffnesses (k,) (None: rigid), offsets (m, k), <point, normal> at every
    place 0, 1, ... of `Control.move`; between them they move on straight, and straight on beyond the ends of a leg.

    surface: what of the strip meets them (`SURFACES`).
    """

    normals: np.ndarray
    stiffness: tuple[float | None, ...]
    offsets: np.ndarray
    surface: str

    def at(self, move: float, leg: int) -> np.ndarray:
        """Offsets (k,)."""
        return np.asarray(self.offsets[self._leg(leg)] + (move - self._leg(leg)) * self.rate(leg))

    def rate(self, leg: int) -> np.ndarray:
        """d(offsets)/d(move) (k,) on a leg."""
        here = self._leg(leg)
        if len(self.offsets) < 2:
            return np.zeros(self.offsets.shape[1])
        return np.asarray(self.offsets[here + 1] - self.offsets[here])

    def _leg(self, leg: int) -> int:
        return int(np.clip(leg, 0, max(len(self.offsets) - 2, 0)))


def depth(wall: Wall, points: ArrayLike) -> float:
    """How far the deepest of the points (n, 3) is behind a wall at rest; negative: all are before it."""
    return float(-np.min(np.asarray(points) @ np.asarray(wall.normal) - wall.offset))
