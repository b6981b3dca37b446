"""What a strip cannot cross, read as data: gaps of points and the direction in which they grow, no solver code."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from compare.scene.inputs.bodies import Body

FloatArray = NDArray[np.float64]


@runtime_checkable
class Kinded(Protocol):
    """What is no wall: "cylinder", "sphere", "box", "edge", or "face", a plane of a room."""

    kind: str
    axis: Any


def _flat(wall: Any) -> bool:
    """Whether it is a plane: a wall, or a face of a room."""
    return not isinstance(wall, Kinded) or wall.kind == "face"


def _body(wall: Any, length: float) -> Body:
    size = None if wall.size is None else np.asarray(wall.size, dtype=float)
    own = Body(
        wall.kind, np.asarray(wall.point, dtype=float), wall.radius, np.asarray(wall.axis), np.asarray(wall.normal),
        size, wall.angle, wall.inside,
    )  # fmt: skip
    return own.scaled(length)


def facing(wall: Any, points: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
    """Gaps (k,) in l of points (k, 3) from what a strip cannot cross, unit normals (k, 3); length: the strip's."""
    if isinstance(wall, Kinded) and wall.kind in ("box", "edge"):
        return _body(wall, length).facing(points)
    apart = points - np.asarray(wall.point, dtype=float) / length
    if _flat(wall):
        normal = np.asarray(wall.axis if isinstance(wall, Kinded) else wall.normal, dtype=float)
        return apart @ normal, np.broadcast_to(normal, apart.shape)
    if wall.axis is not None:
        axis = np.asarray(wall.axis, dtype=float)
        apart = np.cross(axis, np.cross(apart, axis))
    distance = np.linalg.norm(apart, axis=1)
    sign = -1.0 if wall.inside else 1.0
    return sign * (distance - wall.radius / length), sign * apart / distance[:, None]


def sides(wall: Any) -> tuple[float, ...]:
    """Where across (-1 to 1) a strip is looked at: its edges; beside what bulges between them too."""
    bulges = not _flat(wall) and not wall.inside
    return tuple(np.linspace(-1.0, 1.0, 41).tolist()) if bulges else (1.0, -1.0)


def lowest(wall: Any, middle: FloatArray, ruling: FloatArray, length: float) -> tuple[float, ...]:
    """Where across a strip touches, if it does at this ruling: its edges, and where it is nearest to what bulges, of
    points ``middle + side ruling`` (3,)."""
    if _flat(wall) or wall.inside:
        return (1.0, -1.0)
    if wall.kind in ("box", "edge"):
        tried = np.linspace(-1.0, 1.0, 2001)
        gaps, _ = facing(wall, middle + tried[:, None] * np.array(ruling), length)
        return (1.0, -1.0, float(tried[np.argmin(gaps)]))
    apart, along = middle - np.asarray(wall.point, dtype=float) / length, np.array(ruling)
    if wall.axis is not None:
        axis = np.asarray(wall.axis, dtype=float)
        apart, along = (np.cross(axis, np.cross(v, axis)) for v in (apart, along))
    square = float(along @ along)
    side = -float(apart @ along) / square if square > 1e-12 * float(ruling @ ruling) else 1.0
    return (1.0, -1.0) if abs(side) >= 1.0 else (1.0, -1.0, side)
