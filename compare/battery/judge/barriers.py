"""What a strip cannot cross, read as data: gaps of points and the direction in which they grow, no solver code."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@runtime_checkable
class Flat(Protocol):
    """A plane: what has one normal."""

    normal: Any


def facing(wall: Any, points: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
    """Gaps (k,) in l of points (k, 3) from a plane, cylinder or sphere, unit normals (k, 3); length: the strip's."""
    apart = points - np.asarray(wall.point, dtype=float) / length
    if isinstance(wall, Flat):
        normal = np.asarray(wall.normal, dtype=float)
        return apart @ normal, np.broadcast_to(normal, apart.shape)
    if wall.axis is not None:
        axis = np.asarray(wall.axis, dtype=float)
        apart = np.cross(axis, np.cross(apart, axis))
    distance = np.linalg.norm(apart, axis=1)
    sign = -1.0 if wall.inside else 1.0
    return sign * (distance - wall.radius / length), sign * apart / distance[:, None]


def sides(wall: Any) -> tuple[float, ...]:
    """Where across (-1 to 1) a strip is looked at: its edges; beside what bulges between them too."""
    bulges = not isinstance(wall, Flat) and not wall.inside
    return tuple(np.linspace(-1.0, 1.0, 41).tolist()) if bulges else (1.0, -1.0)


def lowest(wall: Any, middle: FloatArray, ruling: FloatArray, length: float) -> tuple[float, ...]:
    """Where across a strip touches, if it does at this ruling: its edges, and where it is nearest to what bulges, of
    points ``middle + side ruling`` (3,)."""
    if isinstance(wall, Flat) or wall.inside:
        return (1.0, -1.0)
    apart, along = middle - np.asarray(wall.point, dtype=float) / length, np.array(ruling)
    if wall.axis is not None:
        axis = np.asarray(wall.axis, dtype=float)
        apart, along = (np.cross(axis, np.cross(v, axis)) for v in (apart, along))
    square = float(along @ along)
    side = -float(apart @ along) / square if square > 1e-12 * float(ruling @ ruling) else 1.0
    return (1.0, -1.0) if abs(side) >= 1.0 else (1.0, -1.0, side)
