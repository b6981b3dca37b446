"""Planes as rectangles around points, for pictures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Margin of a plane around the points, over their largest extent; cells along it.
_MARGIN, CELLS = 0.08, 8


def box(cloud: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Lowest and highest corner (3,) of points (k, 3) with a margin, and their largest extent."""
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    extent = float((high - low).max())
    return low - _MARGIN * extent, high + _MARGIN * extent, extent


def clipped(point: FloatArray, normal: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """The plane through `point` as a rectangle (4, 3) around the box from `low` to `high` (3,) seen along `normal`."""
    first = np.zeros(3)
    first[int(np.argmin(np.abs(normal)))] = 1.0
    first -= (first @ normal) * normal
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)
    corners = np.array([[(low, high)[(k >> a) & 1][a] for a in range(3)] for k in range(8)])
    u, v = (corners - point) @ first, (corners - point) @ second
    around = ((u.min(), v.min()), (u.max(), v.min()), (u.max(), v.max()), (u.min(), v.max()))
    return np.array([point + a * first + b * second for a, b in around])


def plane_net(point: FloatArray, normal: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """The rectangle of `clipped` as a grid (`CELLS` + 1, `CELLS` + 1, 3)."""
    a, b, _, d = clipped(point, normal, low, high)
    u, v = (np.linspace(0.0, 1.0, CELLS + 1)[:, None] * side for side in (b - a, d - a))
    return np.asarray(a + u[:, None] + v[None, :])
