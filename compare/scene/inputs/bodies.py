"""The bodies of `[[obstacle]]` as geometry: which keys each kind has, gaps of points and the normals there.

No solver's code is used. A round body is where its axis or centre is `radius` away. Of a box or an edge, the nearest
point of the core (the body less its rounding) is a clipped point, or the nearest of those on two half planes; from
inside every face of a room is a plane.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ribbonbench.errors import BadInput

FloatArray = NDArray[np.float64]

#: Keys of each kind beside kind, point, inside and name: those that must be there, and those that may be.
NEEDS = {"cylinder": ("axis", "radius"), "sphere": ("radius",), "box": ("axis", "normal", "size"),
         "edge": ("axis", "normal")}  # fmt: skip
MAY = {"cylinder": (), "sphere": (), "box": ("rounding",), "edge": ("angle", "rounding")}
#: The key that says how large each is.
SIZE = {"cylinder": "radius", "sphere": "radius", "box": "size", "edge": "normal"}
#: Rounding of edges and corners where a scene does not say, over the strip's length.
ROUNDING = 1e-3
_RIGHT_ANGLE = 90.0
#: Cosine between axis and normal up to which they are at right angles; distance (l) from a face at which a point of a
#: room is on it.
_SQUARE, _ON = 1e-9, 1e-5


def check_keys(prefix: str, one: Any) -> None:
    """`BadInput` for an obstacle (`compare.scene.spec.ObstacleSpec`) whose keys do not go with its kind."""
    for key in ("radius", "axis", "normal", "size", "angle", "rounding"):
        value = getattr(one, key)
        if value is None and key in NEEDS[one.kind]:
            raise BadInput(f"{prefix}.{key}", None, f'is missing: kind = "{one.kind}" needs it', f"add {key} = ...")
        if value is not None and key not in (*NEEDS[one.kind], *MAY[one.kind]):
            raise BadInput(f"{prefix}.{key}", value, f'is given for kind = "{one.kind}", which has none', "remove it")
    if one.rounding is not None and one.inside:
        raise BadInput(f"{prefix}.rounding", one.rounding, "is given with inside = true, where edges and corners are "
                       "sharp", "remove it")  # fmt: skip
    if one.normal is not None and abs(float(np.dot(one.axis, one.normal))) > _SQUARE:
        raise BadInput(f"{prefix}.normal", list(one.normal), f"is not at right angles to {prefix}.axis",
                       "give a unit vector across the axis")  # fmt: skip


def rounding(one: Any, length: float) -> float:
    """Radius of the edges and corners of a box or an edge; length: the strip's."""
    if one.inside:
        return 0.0
    return float(ROUNDING * length if one.rounding is None else one.rounding)


def check_rounding(prefix: str, one: Any, length: float) -> None:
    """`BadInput` for a box that its rounding leaves nothing of."""
    if one.kind == "box" and not one.inside and 2.0 * rounding(one, length) >= min(one.size):
        raise BadInput(
            f"{prefix}.rounding", rounding(one, length),
            f"leaves nothing of a box whose least size is {min(one.size):g}", "give less than half of it",
        )  # fmt: skip


class Body(NamedTuple):
    """An obstacle: kind "cylinder", "sphere", "box", "edge"; radius: of its roundness; axis, normal (3,), size (3,) and
    angle (degrees) where it has them; all lengths in one unit."""

    kind: str
    point: FloatArray
    radius: float
    axis: FloatArray | None
    normal: FloatArray | None
    size: FloatArray | None
    angle: float
    inside: bool

    @classmethod
    def of(cls, one: Any, length: float) -> Body:
        """An obstacle of a scene, lengths as the scene has them; length: the strip's."""
        axis, normal, size = (
            None if v is None else np.asarray(v, dtype=float) for v in (one.axis, one.normal, one.size)
        )
        if axis is not None:
            axis = axis / np.linalg.norm(axis)
        if normal is not None and axis is not None:
            normal = normal - (normal @ axis) * axis
            normal = normal / np.linalg.norm(normal)
        radius = rounding(one, length) if one.radius is None else one.radius
        angle = _RIGHT_ANGLE if one.angle is None else one.angle
        return cls(one.kind, np.asarray(one.point, dtype=float), radius, axis, normal, size, angle, one.inside)

    def scaled(self, unit: float) -> Body:
        """The same with lengths in units of `unit`."""
        size = None if self.size is None else self.size / unit
        return self._replace(point=self.point / unit, radius=self.radius / unit, size=size)

    @property
    def faces(self) -> tuple[FloatArray, FloatArray]:
        """Outward normals (m, 3) of the faces of a box or an edge, and how far (m,) they stand before the point."""
        assert self.axis is not None
        assert self.normal is not None
        third = np.cross(self.axis, self.normal)
        if self.size is not None:
            rows = np.array([self.axis, self.normal, third])
            return np.vstack([rows, -rows]), 0.5 * np.tile(self.size, 2)
        turn = np.deg2rad(180.0 - self.angle)
        return np.array([self.normal, np.cos(turn) * self.normal + np.sin(turn) * third]), np.zeros(2)

    def facing(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Gaps (k,) of points (k, 3) and unit normals (k, 3) towards the strip's side."""
        apart = points - self.point
        if self.kind in ("cylinder", "sphere"):
            if self.axis is not None:
                apart = apart - np.outer(apart @ self.axis, self.axis)
            distance = np.linalg.norm(apart, axis=1)
            sign = -1.0 if self.inside else 1.0
            with np.errstate(invalid="ignore", divide="ignore"):
                return sign * (distance - self.radius), sign * apart / distance[:, None]
        normals, far = self.faces
        over = apart @ normals.T - far
        deepest = np.argmax(over, axis=1)
        if self.inside:
            return -over.max(axis=1), -normals[deepest]
        core = self._nearest_of_core(apart)
        away = apart - core
        distance = np.linalg.norm(away, axis=1)
        outside = distance > _SQUARE * self.radius  # a projection comes back to rounding
        normal = np.where(outside[:, None], away / np.where(outside, distance, 1.0)[:, None], normals[deepest])
        return np.where(outside, distance - self.radius, over.max(axis=1)), normal

    def _nearest_of_core(self, apart: FloatArray) -> FloatArray:
        """Points (k, 3) of the core, from the body's point, that are nearest to `apart` (k, 3)."""
        normals, far = self.faces
        if self.size is not None:
            rows, half = normals[:3], far[:3] - self.radius
            return np.asarray(np.clip(apart @ rows.T, -half, half) @ rows)
        assert self.axis is not None
        bisector = normals.sum(axis=0)
        apex = -self.radius * bisector / (1.0 + normals[0] @ normals[1])
        u = apart - apex
        along = np.outer(u @ self.axis, self.axis)
        best = along + apex  # on the edge
        least = np.linalg.norm(apart - best, axis=1)
        for n, other in (normals, normals[::-1]):
            way = (n @ other) * n - other
            way /= np.linalg.norm(way)
            reach = np.maximum(u @ way, 0.0)
            tried = along + apex + np.outer(reach, way)
            distance = np.linalg.norm(apart - tried, axis=1)
            best = np.where((distance < least)[:, None], tried, best)
            least = np.minimum(least, distance)
        inner = np.all(u @ normals.T <= 0.0, axis=1)
        return np.where(inner[:, None], apart, best)

    def pushes(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Points (m, 3) of those (k, 3) that touch, with the normal (m, 3) along which each may be pushed; a point in a
        room's edge or corner stands once for every face; lengths in l."""
        if not self.inside or self.kind in ("cylinder", "sphere"):
            return points, self.facing(points)[1]
        normals, far = self.faces
        k, face = np.nonzero((points - self.point) @ normals.T - far > -_ON)
        return points[k], -normals[face]


def directions(body: Body) -> FloatArray:
    """Unit vectors (k, 3) whose sums, none of them negative, are all directions in which a body pushes."""
    if body.kind in ("box", "edge"):
        return -body.faces[0] if body.inside else body.faces[0]
    axis = body.axis
    basis = np.eye(3) if axis is None else np.linalg.svd(np.eye(3) - np.outer(axis, axis))[0].T[:2]
    return np.vstack([basis, -basis])
