"""Dead loads on the ribbon."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike

from ribbon.boundary import unit_vector


@dataclass(frozen=True)
class Gravity:
    """Weight along the centreline (thesis, eq. 2.10); `up` is the unit vector against gravity, e_g in the thesis.

    Its strength is the strip's `gamma`. Without a `Gravity` the scene is weightless and no series is evaluated.
    """

    up: ArrayLike = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "up", tuple(unit_vector("up", self.up).tolist()))
