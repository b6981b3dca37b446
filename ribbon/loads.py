"""Dead loads on the ribbon."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike

from ribbon.boundary import unit_vector


@dataclass(frozen=True)
class Gravity:
    """Weight; `up` is the unit vector against gravity, e_g in the thesis.

    exact: over the whole surface (thesis, eq. 2.9; docs/theory.md, eq. (2.9)) instead of along the centreline (thesis,
    eq. 2.10; docs/theory.md, eq. (2.8)).

    Its strength is the strip's `gamma`. Without a `Gravity` the scene is weightless and no series is evaluated.
    """

    up: ArrayLike = (0.0, 0.0, 1.0)
    exact: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "up", tuple(unit_vector("up", self.up).tolist()))
