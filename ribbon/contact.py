"""Contact with planes and pressure plates (thesis, 6.2; docs/theory.md, eq. (5.3), (5.4)), with friction on a path."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ribbon.boundary import unit_vector
from ribbon.errors import RibbonInputError
from ribbon.obstacle import Obstacle, cross_matrix
from ribbon.strip import finite

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Wall:
    """A plane that the ribbon cannot cross, ``<x - point, normal> >= 0``, at both edges of the rulings at the joints.

    Parameters
    ----------
    point:
        a point of the plane, (3,), in the strip's unit of length.
    normal:
        unit vector (3,) towards the ribbon's side.
    stiffness:
        None: rigid. Otherwise the wall is a pressure plate on a spring (thesis, figure 6.12): it may move along its
        normal by h against the energy ``stiffness h^2 / 2``; in units of D w / l^3, and `point` is its place at rest.
    friction:
        Coulomb's coefficient mu >= 0, which acts along a path only (`ribbon.find.friction`).
    """

    point: ArrayLike
    normal: ArrayLike
    stiffness: float | None = None
    friction: float = 0.0

    def __post_init__(self) -> None:
        point = np.asarray(self.point, dtype=float)
        if point.shape != (3,) or not np.all(np.isfinite(point)):
            raise RibbonInputError("point", self.point, "three finite numbers are needed")
        object.__setattr__(self, "point", tuple(point.tolist()))
        object.__setattr__(self, "normal", tuple(unit_vector("normal", self.normal).tolist()))
        if self.stiffness is not None and finite("stiffness", self.stiffness) <= 0:
            raise RibbonInputError("stiffness", self.stiffness, "a spring needs a positive stiffness; None for a wall")
        if finite("friction", self.friction) < 0:
            raise RibbonInputError("friction", self.friction, "a coefficient of friction is not negative; 0 for none")

    def scaled(self, unit: float) -> Self:
        """The same with lengths in units of `unit`; the stiffness has no length to scale."""
        found = copy(self)  # the normal to the last digit
        object.__setattr__(found, "point", tuple((np.asarray(self.point) / unit).tolist()))
        return found

    def gaps(self, points: FloatArray) -> FloatArray:
        """Distances (k,) of points (k, 3) from the plane at rest; negative behind it."""
        return np.asarray((points - np.asarray(self.point)) @ np.asarray(self.normal))

    def motions(self) -> FloatArray:
        """Rows (k, 6), as `ribbon.obstacle.Obstacle.motions`: along the plane, and turned about its normal."""
        normal = np.asarray(self.normal)
        along = np.concatenate([normal, np.cross(np.asarray(self.point), normal)])
        return np.vstack([along, np.hstack([np.zeros((3, 3)), cross_matrix(normal)])])


#: What a strip cannot cross.
Barrier = Wall | Obstacle
