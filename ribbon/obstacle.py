"""Contact with round obstacles: cylinders and spheres, from outside or inside (docs/theory.md, (5.9)).

With u the part of ``x - point`` across the axis of a cylinder, all of it for a sphere, and rho = |u|, the gap of a
point x, its gradient and its second derivative are, from outside (from inside all three with the other sign)::

    g = rho - radius ,   n = u / rho ,   B = (P - n n^T) / rho ,   P = I - axis axis^T , or I.

Along a ruling ``u_0 + v u_1`` rho^2 is quadratic in v, and rho is convex: seen from inside a strip is nearest at one of
its edges, from outside it may be between them, at ``v = -<u_0, u_1> / <u_1, u_1>``.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ribbon.boundary import unit_vector
from ribbon.errors import RibbonInputError
from ribbon.strip import finite

FloatArray = NDArray[np.float64]

#: Part of the radius below which a point is on the axis, where no direction is the nearest.
_CENTRE = 1e-12


@dataclass(frozen=True)
class Obstacle:
    """A round body that the ribbon cannot enter, or with `inside` a round room that it cannot leave.

    Parameters
    ----------
    kind:
        "cylinder", which has no ends, or "sphere"; others: `ribbon.solid`.
    point:
        a point (3,) of the cylinder's axis, or the sphere's centre, in the strip's unit of length.
    radius:
        in the strip's unit of length, positive.
    axis:
        unit vector (3,) along a cylinder's axis; None for a sphere.
    inside:
        whether the ribbon is inside.
    friction:
        Coulomb's coefficient mu >= 0, which acts along a path only (`ribbon.find.friction`).
    """

    kind: Literal["cylinder", "sphere", "box", "edge", "face"]
    point: ArrayLike
    radius: float
    axis: ArrayLike | None = None
    inside: bool = False
    friction: float = field(default=0.0, kw_only=True)

    def __post_init__(self) -> None:
        if self.kind not in ("cylinder", "sphere"):
            raise RibbonInputError("kind", self.kind, 'use "cylinder" or "sphere"')
        point = np.asarray(self.point, dtype=float)
        if point.shape != (3,) or not np.all(np.isfinite(point)):
            raise RibbonInputError("point", self.point, "three finite numbers are needed")
        object.__setattr__(self, "point", tuple(point.tolist()))
        if finite("radius", self.radius) <= 0.0:
            raise RibbonInputError("radius", self.radius, "a round obstacle needs a positive radius")
        if finite("friction", self.friction) < 0:
            raise RibbonInputError("friction", self.friction, "a coefficient of friction is not negative; 0 for none")
        if self.kind == "sphere" and self.axis is not None:
            raise RibbonInputError("axis", self.axis, "a sphere has none; leave it out")
        if self.kind == "cylinder":
            if self.axis is None:
                raise RibbonInputError("axis", None, "a cylinder needs the direction of its axis")
            object.__setattr__(self, "axis", tuple(unit_vector("axis", self.axis).tolist()))

    @property
    def stiffness(self) -> None:
        """It is rigid."""
        return None

    @property
    def sign(self) -> float:
        """1 from outside, -1 from inside."""
        return -1.0 if self.inside else 1.0

    @property
    def between(self) -> bool:
        """Whether a ruling may be nearest between its ends."""
        return not self.inside

    def scaled(self, unit: float) -> Self:
        """The same with lengths in units of `unit`."""
        found = copy(self)  # the axis to the last digit
        object.__setattr__(found, "point", tuple((np.asarray(self.point) / unit).tolist()))
        object.__setattr__(found, "radius", self.radius / unit)
        return found

    @property
    def directions(self) -> FloatArray:
        """Unit vectors (k, 3) whose sums, none of them negative, are all directions in which it pushes."""
        _, _, rows = np.linalg.svd(self.across)
        own = rows[: 3 if self.axis is None else 2]
        return np.vstack([own, -own])

    @cached_property
    def across(self) -> FloatArray:
        """P (3, 3) of the module."""
        if self.axis is None:
            return np.eye(3)
        axis = np.asarray(self.axis)
        return np.asarray(np.eye(3) - np.outer(axis, axis))

    def _from_axis(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """u (k, 3) and rho (k,)."""
        u = points - np.asarray(self.point)
        u = u if self.axis is None else np.asarray(u @ self.across)
        return u, np.sqrt(np.sum(u * u, axis=1))

    def gaps(self, points: FloatArray) -> FloatArray:
        """Gaps (k,) of points (k, 3); negative behind the surface. Complex points stay complex."""
        return np.asarray(self.sign * (self._from_axis(points)[1] - self.radius))

    def derivatives(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Gaps (k,), their gradients (k, 3), unit vectors towards the ribbon's side, and second derivatives (k, 3, 3).

        On the axis itself no direction is the nearest: the gradient is then 0."""
        u, rho = self._from_axis(points)
        size = np.maximum(rho, _CENTRE * self.radius)
        normal = u / size[:, None]
        bend = (self.across - normal[:, :, None] * normal[:, None, :]) / size[:, None, None]
        return np.asarray(self.sign * (rho - self.radius)), self.sign * normal, np.asarray(self.sign * bend)

    def nearest(self, middle: FloatArray, ruling: FloatArray) -> FloatArray:
        """v (k,) where the lines ``middle + v ruling``, both (k, 3), are nearest to the axis; 0 along the axis."""
        u, along = (middle - np.asarray(self.point)) @ self.across, ruling @ self.across
        square = np.sum(along * along, axis=1)
        least = _CENTRE * np.sum(ruling * ruling, axis=1)
        return np.asarray(np.where(square > least, -np.sum(u * along, axis=1) / np.maximum(square, least), 0.0))

    def motions(self) -> FloatArray:
        """Rows (k, 6): conditions on translation v and rotation w, ``rows @ (v, w) = 0``, under which the motion
        ``v + w x r`` takes the obstacle into itself."""
        centre = np.asarray(self.point)
        # w x p = -[p] w
        moved = np.hstack([np.eye(3), -cross_matrix(centre)])
        if self.axis is None:
            return moved
        return np.vstack([self.across @ moved, np.hstack([np.zeros((3, 3)), cross_matrix(np.asarray(self.axis))])])


def cross_matrix(a: FloatArray) -> FloatArray:
    """(3, 3): ``[a] b = a x b``."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])
