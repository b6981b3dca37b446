"""Material coordinates on which surfaces are compared, and their triangles. Lengths in l."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


class Wide(Protocol):
    """Whatever has a width, in l: a scene, a strip."""

    @property
    def width(self) -> float: ...


class Surfaced(Protocol):
    """Whatever gives positions (k, m, 3) of the particles s (k,) x v (m,) of a strip."""

    def points(self, s: FloatArray, v: FloatArray) -> FloatArray: ...


#: Largest distance between a triangle and the arc it stands for, in units of l.
SAGITTA = 2e-6
#: Fewest and most cells along the strip.
CELLS = (400, 4000)


def cells_along(largest_curvature: float, sagitta: float = SAGITTA) -> int:
    """Cells along the strip so that ``kappa ds^2 / 8 <= sagitta``; `largest_curvature` in 1/l, `sagitta` in l."""
    wanted = math.sqrt(max(abs(largest_curvature), 1e-12) / (8.0 * sagitta))
    return int(min(max(math.ceil(wanted / 50.0) * 50, CELLS[0]), CELLS[1]))


def cells_across(width: float, along: int) -> int:
    """Cells across the strip: as along, but between 4 and 12 (rulings are straight); `width` is w / l."""
    return int(min(max(2 * round(0.25 * width * along), 4), 12))


def triangles(along: int, across: int) -> NDArray[np.int64]:
    """Triangles (2 (along - 1) (across - 1), 3) of a grid of `along` x `across` points, last index fastest."""
    corner = (np.arange(along - 1)[:, None] * across + np.arange(across - 1)[None, :]).ravel()
    lower = np.column_stack([corner, corner + across, corner + 1])
    upper = np.column_stack([corner + 1, corner + across, corner + across + 1])
    return np.concatenate([lower, upper])


@dataclass(frozen=True)
class Grid:
    """Material coordinates s (k,) in [0, 1] and v (m,) in [-w/2, w/2], equally spaced, units of l."""

    s: FloatArray
    v: FloatArray

    @classmethod
    def for_shape(cls, strip: Wide, largest_curvature: float, sagitta: float = SAGITTA) -> Grid:
        """Fine enough for shapes of this curvature (1/l) of a strip, or of a scene's: to `sagitta` (l)."""
        along = cells_along(largest_curvature, sagitta)
        across = cells_across(strip.width, along)
        half = 0.5 * strip.width
        return cls(np.linspace(0.0, 1.0, along + 1), np.linspace(-half, half, across + 1))

    def of(self, shape: Surfaced) -> FloatArray:
        """Points (k, m, 3) of a shape, units of l."""
        return shape.points(self.s, self.v)
