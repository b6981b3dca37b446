"""Dead loads on the ribbon: its weight, and a force at its end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ribbon.boundary import unit_vector
from ribbon.errors import RibbonInputError


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


def tip_force(value: ArrayLike | None) -> tuple[float, float, float] | None:
    """A dead force (3,) at s = l in D w / l^2; None: none, or zero. `RibbonInputError` for what is no vector."""
    if value is None:
        return None
    try:
        x, y, z = (float(c) for c in np.asarray(value, dtype=float))
    except (TypeError, ValueError):
        raise RibbonInputError("tip", value, "three numbers, a force in D w / l^2") from None
    if not np.all(np.isfinite([x, y, z])):
        raise RibbonInputError("tip", value, "three finite numbers, a force in D w / l^2")
    return (x, y, z) if x or y or z else None
