"""Frictionless contact with planes and pressure plates (thesis, 6.2; docs/theory.md, eq. (5.3), (5.4))."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ribbon.boundary import unit_vector
from ribbon.errors import RibbonInputError
from ribbon.strip import finite


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
    """

    point: ArrayLike
    normal: ArrayLike
    stiffness: float | None = None

    def __post_init__(self) -> None:
        point = np.asarray(self.point, dtype=float)
        if point.shape != (3,) or not np.all(np.isfinite(point)):
            raise RibbonInputError("point", self.point, "three finite numbers are needed")
        object.__setattr__(self, "point", tuple(point.tolist()))
        object.__setattr__(self, "normal", tuple(unit_vector("normal", self.normal).tolist()))
        if self.stiffness is not None and finite("stiffness", self.stiffness) <= 0:
            raise RibbonInputError("stiffness", self.stiffness, "a spring needs a positive stiffness; None for a wall")
