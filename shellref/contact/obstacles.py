"""Round and finite bodies that a shell cannot cross, by a signed distance with its derivatives. NumPy only.

The body is convex: all points within `radius` of a core K, c(x) the nearest point of K (docs/theory.md, eq. (7.29)):

    g = |x - c| - radius ,   n = (x - c) / |x - c| ,   H = (P - n n^T) / |x - c| ,

P: I less the directions along which K is straight at c. K is a point (sphere), a line (cylinder), a cuboid (box) or a
wedge (edge); seen from inside a sphere or a cylinder all three have the other sign. From inside a box or an edge is the
room before its faces: planes, sharp where they meet.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np

from shellref.inputs import FRAME_TOLERANCE, ShellInputError, Vector, build, choice, number, numbers, positive

KINDS = SPHERE, CYLINDER, BOX, EDGE = ("sphere", "cylinder", "box", "edge")
#: Opening angles of an edge, degrees.
ANGLES = (10.0, 170.0)
#: Part of the radius within which a point is on the core itself, where no direction leads away from it.
ON_CORE = 1e-12


class Gap(NamedTuple):
    """Of points (m, 3): gaps (m,), negative behind the surface, gradients (m, 3), second derivatives (m, 3, 3)."""

    value: np.ndarray
    normal: np.ndarray
    bend: np.ndarray


#: Gaps of points (m, 3) from the body's own point.
GapFunction = Callable[[np.ndarray], Gap]


@dataclass(frozen=True)
class Obstacle:
    """A body that the strip cannot enter, or with `inside` a room that it cannot leave, without friction.

    kind: "sphere", "cylinder" (without ends), "box" or "edge" (the wedge between two faces, without ends). point (3,),
    units l: of a cylinder's axis or where an edge's faces would meet, a sphere's or a box's centre. radius, units l: of
    a sphere or a cylinder, or of the rounding of a box's or an edge's edges and corners (from inside not used). axis
    (3,): unit vector along a cylinder, an edge, a box's first size. normal (3,): unit vector across it, along a box's
    second size, out of an edge's first face; the second face looks along it turned about the axis by 180 degrees less
    the angle. size (3,), units l: of a box along axis, normal, axis x normal. angle: of an edge's body, degrees. Raises
    ShellInputError.
    """

    kind: str
    point: Vector
    radius: float
    axis: Vector | None = None
    normal: Vector | None = None
    size: Vector | None = None
    angle: float = 90.0
    inside: bool = False

    def __post_init__(self) -> None:
        def put(name: str, value: object) -> None:
            object.__setattr__(self, name, value)

        put("kind", choice("obstacles.kind", self.kind, KINDS))
        put("point", numbers("obstacles.point", self.point, 3))
        if not isinstance(self.inside, bool):
            raise ShellInputError("obstacles.inside", self.inside, "must be true or false")
        sharp = self.inside and self.kind in (BOX, EDGE)  # its planes meet where they stand
        put("radius", (number if sharp else positive)("obstacles.radius", self.radius))
        put("angle", number("obstacles.angle", self.angle))
        for key, kinds in (("axis", (CYLINDER, BOX, EDGE)), ("normal", (BOX, EDGE)), ("size", (BOX,))):
            value = getattr(self, key)
            if (value is None) == (self.kind in kinds):
                what = "is needed by" if value is None else "is nothing that it has: leave it out of"
                raise ShellInputError(f"obstacles.{key}", value, f"{what} a {self.kind}")
            if value is not None:
                put(key, numbers(f"obstacles.{key}", value, 3))
        self._check()

    def _check(self) -> None:
        for key in ("axis", "normal"):
            value = getattr(self, key)
            if value is not None and abs(math.hypot(*value) - 1.0) > FRAME_TOLERANCE:
                raise ShellInputError(f"obstacles.{key}", value, "must be a unit vector (to 1e-9)")
        if self.normal is not None and abs(float(np.dot(self.axis or (), self.normal))) > FRAME_TOLERANCE:
            raise ShellInputError("obstacles.normal", self.normal, "must be at right angles to the axis (to 1e-9)")
        if self.size is not None:
            if min(self.size) <= 0.0:
                raise ShellInputError("obstacles.size", self.size, "must be three lengths above 0")
            if not self.inside and 2.0 * self.radius >= min(self.size):
                remedy = f"must be below half of the least size, {0.5 * min(self.size):g}"
                raise ShellInputError("obstacles.radius", self.radius, remedy)
        if self.kind == EDGE and not ANGLES[0] <= self.angle <= ANGLES[1]:
            raise ShellInputError("obstacles.angle", self.angle, f"must be {ANGLES[0]:g} to {ANGLES[1]:g} degrees")

    @classmethod
    def read(cls, value: Any) -> Obstacle:
        """An obstacle from itself or from a mapping of its fields."""
        if isinstance(value, Obstacle):
            return value
        needed = [field.name for field in fields(cls)][:3]
        if isinstance(value, Mapping) and not set(needed) <= set(value):
            raise ShellInputError("obstacles", dict(value), "an obstacle needs " + ", ".join(needed))
        obstacle: Obstacle = build(cls, "obstacles", value)
        return obstacle

    @property
    def faces(self) -> np.ndarray:
        """Outward unit normals (m, 3) of the faces of a box or an edge."""
        axis, normal = np.array(self.axis), np.array(self.normal)
        third = np.cross(axis, normal)
        if self.kind == BOX:
            return np.array([axis, normal, third, -axis, -normal, -third])
        turn = math.radians(180.0 - self.angle)
        return np.array([normal, math.cos(turn) * normal + math.sin(turn) * third])

    @property
    def heart(self) -> float | None:
        """Depth (l) at which what goes on comes out on the other side; None: there is no other side."""
        if self.inside or self.kind == EDGE:
            return None
        return 0.5 * self.radius if self.size is None else 0.25 * min(self.size)

    def parts(self) -> list[GapFunction]:
        """The gap functions, all of which a place must keep from: one, or those of a room's planes."""
        if self.inside and self.kind in (BOX, EDGE):
            far = 0.5 * np.tile(np.array(self.size), 2) if self.kind == BOX else np.zeros(2)
            return [_plane(-normal, -a) for normal, a in zip(self.faces, far, strict=True)]
        away = {SPHERE: _from_point, CYLINDER: _from_line, BOX: _from_cuboid, EDGE: _from_wedge}[self.kind](self)
        sign, radius = -1.0 if self.inside else 1.0, self.radius

        def gap(points: np.ndarray) -> Gap:
            distance, normal, bend = away(points)
            return Gap(sign * (distance - radius), sign * normal, sign * bend)

        return [gap]

    def gaps(self, points: np.ndarray, centre: np.ndarray) -> np.ndarray:
        """Least gaps (m,) of points (m, 3) where the body's point is at `centre` (3,)."""
        return np.asarray(np.min([part(points - centre).value for part in self.parts()], axis=0))


def _plane(normal: np.ndarray, offset: float) -> GapFunction:
    def gap(points: np.ndarray) -> Gap:
        return Gap(points @ normal - offset, np.tile(normal, (len(points), 1)), np.zeros((len(points), 3, 3)))

    return gap


def _round(w: np.ndarray, across: np.ndarray, least: float) -> Gap:
    """|w|, its gradient and second derivative by w (m, 3); across (m, 3, 3) or (3, 3): P of the module."""
    size = np.linalg.norm(w, axis=1)
    safe = np.maximum(size, least)
    n = w / safe[:, None]
    return Gap(size, n, (across - n[:, :, None] * n[:, None, :]) / safe[:, None, None])


def _from_point(body: Obstacle) -> GapFunction:
    return lambda points: _round(points, np.eye(3), ON_CORE * body.radius)


def _from_line(body: Obstacle) -> GapFunction:
    across = np.eye(3) - np.outer(body.axis or (), body.axis or ())
    return lambda points: _round(points @ across, across, ON_CORE * body.radius)


def _from_cuboid(body: Obstacle) -> GapFunction:
    """Of the rounded box: in its axes the nearest point of the core is the place cut off at its faces."""
    frame, half = body.faces[:3], 0.5 * np.array(body.size) - body.radius

    def gap(points: np.ndarray) -> Gap:
        local = points @ frame.T
        beyond = local - np.clip(local, -half, half)
        free = np.where(np.abs(local) > half, 1.0, 0.0)
        found = _round(beyond, free[:, :, None] * np.eye(3), ON_CORE * body.radius)
        value, n, bend = (x.copy() for x in found)
        within = ~free.any(axis=1)  # inside the core: the nearest face
        if within.any():
            depth = half - np.abs(local[within])
            face = np.argmin(depth, axis=1)
            value[within] = -depth[np.arange(len(face)), face]
            n[within] = np.where(local[within] < 0.0, -1.0, 1.0) * np.eye(3)[face]
            bend[within] = 0.0
        return Gap(value, n @ frame, frame.T @ bend @ frame)

    return gap


def _from_wedge(body: Obstacle) -> GapFunction:
    """Of the rounded wedge, whose core stands back by the radius from both faces."""
    one, two = body.faces
    across = np.eye(3) - np.outer(body.axis or (), body.axis or ())
    tip = -body.radius * (one + two) / (1.0 + one @ two)

    def gap(points: np.ndarray) -> Gap:
        u = (points - tip) @ across
        value, n, bend = (x.copy() for x in _round(u, across, ON_CORE * body.radius))
        before = np.column_stack([u @ one, u @ two])
        within = np.all(before <= 0.0, axis=1)
        for k, (normal, other) in enumerate(((one, two), (two, one))):
            foot = u - before[:, [k]] * normal
            on = (before[:, k] > 0.0) & (foot @ other <= 0.0)
            on |= within & (before[:, k] == before.max(axis=1))
            value[on], n[on], bend[on] = before[on, k], normal, 0.0
        return Gap(value, n, bend)

    return gap
