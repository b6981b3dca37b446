"""What a shell may touch: planes, rigid or pressure plates on springs, bodies (shellref.contact.obstacles), and itself;
and how they move along its path. NumPy only."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from shellref.contact.obstacles import Obstacle
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


class Standing(NamedTuple):
    """Where everything stands: <point, normal> (walls,) of the walls, points (bodies, 3) of the bodies."""

    offsets: np.ndarray
    centres: np.ndarray


@dataclass(frozen=True)
class WallPath:
    """What may be touched, along a path: normals (k, 3), stiffnesses (k,) (None: rigid), offsets (m, k), <point,
    normal>, of walls, bodies and their points (m, bodies, 3), at every place 0, 1, ... of `Control.move`; between them
    they move on straight, and straight on beyond the ends of a leg.

    surface: what of the strip meets them (`SURFACES`). apart: distance (l) that parts of the strip keep from each
    other; None: they do not know of each other.
    """

    normals: np.ndarray
    stiffness: tuple[float | None, ...]
    offsets: np.ndarray
    surface: str
    bodies: tuple[Obstacle, ...] = ()
    centres: np.ndarray | None = None
    apart: float | None = None

    @property
    def springs(self) -> np.ndarray:
        """Of walls, bodies and, where parts keep apart, the strip itself: stiffness, 0 of what is rigid."""
        rest = len(self.bodies) + (self.apart is not None)
        return np.array([0.0 if c is None else c for c in (*self.stiffness, *(None,) * rest)])

    def at(self, move: float, leg: int) -> Standing:
        """Where they are."""
        here, rate = self._leg(leg), self.rate(leg)
        way = move - here
        centres = np.zeros((0, 3)) if self.centres is None else self.centres[here]
        return Standing(self.offsets[here] + way * rate.offsets, centres + way * rate.centres)

    def rate(self, leg: int) -> Standing:
        """d(at)/d(move) on a leg."""
        here = self._leg(leg)
        none = Standing(np.zeros(self.offsets.shape[1]), np.zeros((len(self.bodies), 3)))
        if len(self.offsets) < 2:
            return none
        moved = none.centres if self.centres is None else self.centres[here + 1] - self.centres[here]
        return Standing(self.offsets[here + 1] - self.offsets[here], moved)

    def _leg(self, leg: int) -> int:
        return int(np.clip(leg, 0, max(len(self.offsets) - 2, 0)))


def depth(wall: Wall, points: ArrayLike) -> float:
    """How far the deepest of the points (n, 3) is behind a wall at rest; negative: all are before it."""
    return float(-np.min(np.asarray(points) @ np.asarray(wall.normal) - wall.offset))
