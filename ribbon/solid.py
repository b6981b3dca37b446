"""Frictionless contact with boxes and edges: bodies of flat faces (docs/theory.md, eq. (5.11), (5.12)).

**From outside** a body is a convex core K and all that is nearer to it than its `radius`, the rounding of its edges
and corners; its faces stand where they are stated. With c(x) the point of K nearest to x and d = |x - c|::

    g = d - radius ,   n = (x - c) / d ,   B = (P - n n^T) / d ,   P the projection across what K is there,

n n^T before a face (B = 0), across an edge (a cylinder), or I at a corner (a sphere). g is convex; its gradient is
continuous outside the core, and B jumps where a face turns into its round edge. Inside the core, where no equilibrium
is, g is that of the nearest face. Along a line ``m + v r`` the slope of d^2 is linear between the places where c passes
from face to edge to corner, so that its zero is exact.

**From inside** a room is the meeting of the half spaces of its faces: each is a plane with rows of its own (`Face`),
its edges and corners are sharp, and nothing is rounded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ribbon.boundary import unit_vector
from ribbon.contact import Barrier
from ribbon.errors import RibbonInputError
from ribbon.obstacle import Obstacle, cross_matrix
from ribbon.strip import finite

FloatArray = NDArray[np.float64]

#: Cosine between a body's axis and its normal up to which they are at right angles.
_SQUARE = 1e-9
#: Opening angles (degrees) of an edge.
ANGLES = (10.0, 170.0)
#: Least share of a box's least size that is left to its core by the rounding of its edges.
_CORE = 1e-6


@dataclass(frozen=True)
class Solid(Obstacle):
    """A box, or a half space with an edge; with `inside` a room.

    Parameters
    ----------
    kind:
        "box", or "edge", the wedge between two faces that meet in a straight edge without ends.
    point:
        the box's centre, or a point (3,) of the edge where its faces would meet, in the strip's unit of length.
    radius:
        of the rounding of edges and corners, in the strip's unit of length; not asked inside.
    axis:
        unit vector (3,) along the box's first size, or along the edge.
    normal:
        unit vector (3,) at right angles to it: along the box's second size, or out of the edge's first face. The
        outward normal of the second face is this one turned about the axis by 180 degrees less the angle.
    size:
        of the box (3,) along axis, normal and axis x normal, in the strip's unit of length.
    angle:
        of the body at its edge, in degrees.
    """

    normal: ArrayLike | None = None
    size: ArrayLike | None = None
    angle: float = 90.0

    def __post_init__(self) -> None:
        if self.kind not in ("box", "edge"):
            raise RibbonInputError("kind", self.kind, 'use "box" or "edge"')
        point = np.asarray(self.point, dtype=float)
        if point.shape != (3,) or not np.all(np.isfinite(point)):
            raise RibbonInputError("point", self.point, "three finite numbers are needed")
        object.__setattr__(self, "point", tuple(point.tolist()))
        for key in ("axis", "normal"):
            value = getattr(self, key)
            if value is None:
                raise RibbonInputError(key, None, f'kind "{self.kind}" needs an axis and a normal')
            object.__setattr__(self, key, tuple(unit_vector(key, value).tolist()))
        if abs(float(np.dot(self.axis, self.normal))) > _SQUARE:  # type: ignore[arg-type]
            raise RibbonInputError("normal", self.normal, "must be at right angles to the axis")
        self._check_size()

    def _check_size(self) -> None:
        if not self.inside and finite("radius", self.radius) <= 0.0:
            raise RibbonInputError("radius", self.radius, "edges and corners need a positive rounding")
        if self.kind == "edge":
            if self.size is not None:
                raise RibbonInputError("size", self.size, "an edge has none; leave it out")
            if not ANGLES[0] <= finite("angle", self.angle) <= ANGLES[1]:
                raise RibbonInputError("angle", self.angle, f"use {ANGLES[0]:g} to {ANGLES[1]:g} degrees")
            return
        size = np.asarray(() if self.size is None else self.size, dtype=float)
        if size.shape != (3,) or not np.all(np.isfinite(size)) or not np.all(size > 0.0):
            raise RibbonInputError("size", self.size, "a box needs three positive lengths")
        object.__setattr__(self, "size", tuple(size.tolist()))
        if not self.inside and 2.0 * self.radius > (1.0 - _CORE) * float(size.min()):
            raise RibbonInputError("radius", self.radius, f"use less than half of the least size, {size.min():g}")

    def scaled(self, unit: float) -> Solid:
        """The same with lengths in units of `unit`."""
        size = None if self.size is None else np.asarray(self.size) / unit
        return replace(self, point=np.asarray(self.point) / unit, radius=self.radius / unit, size=size)

    @cached_property
    def frame(self) -> FloatArray:
        """Rows (3, 3): axis, normal, axis x normal."""
        one, two = np.asarray(self.axis), np.asarray(self.normal)
        return np.array([one, two, np.cross(one, two)])

    @cached_property
    def normals(self) -> FloatArray:
        """Outward unit normals (m, 3) of the faces."""
        if self.kind == "box":
            return np.vstack([self.frame, -self.frame])
        turn = np.deg2rad(180.0 - self.angle)
        return np.array([self.frame[1], np.cos(turn) * self.frame[1] + np.sin(turn) * self.frame[2]])

    @cached_property
    def across(self) -> FloatArray:
        """(3, 3): the projection across an edge; a box has directions of all kinds."""
        if self.kind == "box":
            return np.eye(3)
        axis = self.frame[0]
        return np.asarray(np.eye(3) - np.outer(axis, axis))

    @property
    def directions(self) -> FloatArray:
        """Unit vectors (k, 3) whose sums, none of them negative, are all directions in which it pushes."""
        return -self.normals if self.inside else self.normals

    @cached_property
    def _half(self) -> FloatArray:
        """Half sizes (3,) of a box's core."""
        return np.asarray(0.5 * np.asarray(self.size) - self.radius)

    @cached_property
    def _apex(self) -> FloatArray:
        """A point (3,) of the core's edge."""
        one, two = self.normals
        return np.asarray(np.asarray(self.point) - self.radius * (one + two) / (1.0 + one @ two))

    @cached_property
    def _along_faces(self) -> FloatArray:
        """Unit vectors (2, 3) from the edge along its faces."""
        one, two = self.normals
        ways = np.array([(one @ two) * one - two, (one @ two) * two - one])
        return np.asarray(ways / np.linalg.norm(ways, axis=1)[:, None])

    def _from_core(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Of points (k, 3): distance d (k,) from the core, negative inside, n (k, 3) and B (k, 3, 3)."""
        return self._from_box(points) if self.kind == "box" else self._from_wedge(points)

    def _from_box(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        local = (points - np.asarray(self.point)) @ self.frame.T
        over = np.abs(local) - self._half
        beyond = np.maximum(over, 0.0)
        d = np.linalg.norm(beyond, axis=1)
        outside = d > 0.0
        size = np.where(outside, d, 1.0)[:, None]
        face = np.eye(3)[np.argmax(over, axis=1)]
        sign = np.where(local < 0.0, -1.0, 1.0)
        normal = sign * np.where(outside[:, None], beyond / size, face)
        held = np.where((over > 0.0) & outside[:, None], 1.0, 0.0)
        bend = (held[:, :, None] * np.eye(3) - normal[:, :, None] * normal[:, None, :]) / size[:, :, None]
        bend[~outside] = 0.0
        bend = self.frame.T @ bend @ self.frame
        return np.where(outside, d, over.max(axis=1)), normal @ self.frame, bend

    def _from_wedge(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        u = (points - self._apex) @ self.across
        before, along = u @ self.normals.T, u @ self._along_faces.T
        at_edge = np.all(along < 0.0, axis=1) & np.any(before > 0.0, axis=1)
        inner = np.all(before <= 0.0, axis=1)
        on_face = (along >= 0.0) & (before > 0.0)
        face = np.where(inner, np.argmax(before, axis=1), np.argmax(on_face, axis=1))
        rho = np.maximum(np.linalg.norm(u, axis=1), np.finfo(float).tiny)
        normal = np.where(at_edge[:, None], u / rho[:, None], self.normals[face])
        bend = (self.across - normal[:, :, None] * normal[:, None, :]) / rho[:, None, None]
        bend[~at_edge] = 0.0
        return np.where(at_edge, rho, before[np.arange(len(u)), face]), normal, bend

    def gaps(self, points: FloatArray) -> FloatArray:
        """Gaps (k,) of points (k, 3); negative behind the surface."""
        if self.inside:
            return np.asarray(np.min([face.gaps(points) for face in self.faces()], axis=0))
        return np.asarray(self._from_core(points)[0] - self.radius)

    def derivatives(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Gaps (k,), their gradients (k, 3) and second derivatives (k, 3, 3)."""
        if self.inside:
            gaps = np.array([face.gaps(points) for face in self.faces()])
            return gaps.min(axis=0), self.directions[np.argmin(gaps, axis=0)], np.zeros((len(points), 3, 3))
        d, normal, bend = self._from_core(points)
        return np.asarray(d - self.radius), normal, bend

    def nearest(self, middle: FloatArray, ruling: FloatArray) -> FloatArray:
        """v (k,) from -1 to 1 where the lines ``middle + v ruling``, both (k, 3), are nearest; the middle of
        what is so."""
        ends = np.tile([-1.0, 1.0], (len(middle), 1))
        knots = np.sort(np.hstack([self._knots(middle, ruling), ends]))
        slopes = np.empty_like(knots)
        for j, v in enumerate(knots.T):
            d, normal, _ = self._from_core(middle + v[:, None] * ruling)
            slopes[:, j] = np.maximum(d, 0.0) * np.sum(normal * ruling, axis=1)
        low = np.maximum(np.sum(slopes < -self._rounding(ruling)[:, None], axis=1) - 1, 0)
        high = np.minimum(low + 1, knots.shape[1] - 1)
        first = self._zero(knots, slopes, low, high)
        over = np.minimum(knots.shape[1] - np.sum(slopes > self._rounding(ruling)[:, None], axis=1), knots.shape[1] - 1)
        last = self._zero(knots, slopes, np.maximum(over - 1, 0), over)
        return np.asarray(0.5 * (first + last))

    def _rounding(self, ruling: FloatArray) -> FloatArray:
        """Slopes (k,) of d^2 / 2 that are 0."""
        return np.asarray(1e-14 * self.radius * np.linalg.norm(ruling, axis=1))

    @staticmethod
    def _zero(knots: FloatArray, slopes: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
        """Where (k,) the slope is 0 between two knots, or the end that is nearer to it."""
        each = np.arange(len(knots))
        a, b, one, two = knots[each, low], knots[each, high], slopes[each, low], slopes[each, high]
        rise = two - one
        part = np.where(rise > 0.0, -one / np.where(rise > 0.0, rise, 1.0), np.where(one < 0.0, 1.0, 0.0))
        return np.asarray(a + np.clip(part, 0.0, 1.0) * (b - a))

    def _knots(self, middle: FloatArray, ruling: FloatArray) -> FloatArray:
        """v (k, m) within -1 to 1 where the lines pass from one part of the core to another."""
        if self.kind == "box":
            start, way = (middle - np.asarray(self.point)) @ self.frame.T, ruling @ self.frame.T
            levels = [start - self._half, start + self._half]
            start, way = np.hstack(levels), np.hstack([way, way])
        else:
            planes = np.vstack([self.normals, self._along_faces]).T
            start, way = (middle - self._apex) @ planes, ruling @ planes
        crosses = np.abs(way) > 1e-300
        return np.asarray(np.clip(np.where(crosses, -start / np.where(crosses, way, 1.0), 1.0), -1.0, 1.0))

    def motions(self) -> FloatArray:
        """Rows (k, 6), as of an obstacle: an edge slides along itself, a box does not move."""
        if self.kind == "box":
            return np.eye(6)
        axis = self.frame[0]
        shift = np.hstack([self.across, -self.across @ cross_matrix(np.asarray(self.point))])
        return np.vstack([shift, np.hstack([np.zeros((3, 3)), np.eye(3)]), 0.0 * np.append(axis, axis)[None, :]])

    def faces(self, room: int = 0) -> tuple[Face, ...]:
        """The planes of a room, numbered `room` in the list of what the strip cannot cross."""
        far = np.zeros(len(self.normals)) if self.size is None else np.tile(0.5 * np.asarray(self.size), 2)
        middle = np.asarray(self.point)
        return tuple(
            Face("face", middle + a * normal, 1.0, -normal, inside=True, room=room, body=self)
            for a, normal in zip(far, self.normals, strict=True)
        )


@dataclass(frozen=True)
class Face(Obstacle):
    """A plane of a room: `axis` is its unit normal (3,) towards the ribbon, `point` one of its points; radius: unused;
    room, body: the number of the obstacle that it is a part of, and that."""

    room: int = 0
    body: Solid | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", tuple(np.asarray(self.point, dtype=float).tolist()))
        object.__setattr__(self, "axis", tuple(np.asarray(self.axis, dtype=float).tolist()))

    def scaled(self, unit: float) -> Face:
        """The same with lengths in units of `unit`."""
        body = None if self.body is None else self.body.scaled(unit)
        return replace(self, point=np.asarray(self.point) / unit, body=body)

    @property
    def directions(self) -> FloatArray:
        """The direction (1, 3) in which it pushes."""
        return np.array([self.axis])

    def gaps(self, points: FloatArray) -> FloatArray:
        """Gaps (k,) of points (k, 3)."""
        return np.asarray((points - np.asarray(self.point)) @ np.asarray(self.axis))

    def derivatives(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Gaps (k,), the normal (k, 3) and zeros (k, 3, 3)."""
        normal = np.tile(np.asarray(self.axis), (len(points), 1))
        return self.gaps(points), normal, np.zeros((len(points), 3, 3))

    def motions(self) -> FloatArray:
        """Rows (k, 6): along the plane, and turned about its normal."""
        normal = np.asarray(self.axis)
        along = np.concatenate([normal, np.cross(np.asarray(self.point), normal)])
        return np.vstack([along, np.hstack([np.zeros((3, 3)), cross_matrix(normal)])])


def in_planes(walls: Sequence[Barrier]) -> tuple[Barrier, ...]:
    """What the strip cannot cross, with the planes of rooms in their place."""
    found: list[Barrier] = []
    for k, wall in enumerate(walls):
        found += wall.faces(k) if isinstance(wall, Solid) and wall.inside else [wall]
    return tuple(found)
