"""What holds the ribbon: the clamp at s = 0 (thesis, chapter 2: initial condition of eq. 2.4)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ribbon.errors import RibbonInputError

ORTHONORMAL_TOLERANCE = 1e-9


def unit_vector(key: str, value: ArrayLike) -> NDArray[np.float64]:
    """`value` as a unit vector (3,); RibbonInputError when it is none to 1e-9."""
    try:
        vector = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise RibbonInputError(key, value, "three numbers are needed") from None
    if vector.shape != (3,) or not np.all(np.isfinite(vector)):
        raise RibbonInputError(key, value, "three finite numbers are needed")
    norm = float(np.linalg.norm(vector))
    if abs(norm - 1.0) > ORTHONORMAL_TOLERANCE:
        hint = f"use {(vector / norm).tolist()}" if norm > 0 else "the zero vector has no direction"
        raise RibbonInputError(key, value, f"a unit vector is needed; {hint}")
    return vector / norm


@dataclass(frozen=True)
class Clamp:
    """Position and material frame held at an end.

    Parameters
    ----------
    position:
        r, (3,), in the strip's unit of length.
    tangent, normal:
        t_z and t_y, unit and orthogonal, (3,) each; t_x = t_y x t_z completes the right-handed frame.
    ruling:
        "free", or "straight": eta = 0, as a physical clamp that holds the whole edge (thesis, 7.1).
    """

    position: ArrayLike = (0.0, 0.0, 0.0)
    tangent: ArrayLike = (0.0, 0.0, 1.0)
    normal: ArrayLike = (0.0, 1.0, 0.0)
    ruling: str = "free"
    frame: NDArray[np.float64] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        position = np.asarray(self.position, dtype=float)
        if position.shape != (3,) or not np.all(np.isfinite(position)):
            raise RibbonInputError("position", self.position, "three finite numbers are needed")
        tangent = unit_vector("tangent", self.tangent)
        normal = unit_vector("normal", self.normal)
        if abs(float(tangent @ normal)) > ORTHONORMAL_TOLERANCE:
            raise RibbonInputError("normal", self.normal, "the normal must be orthogonal to the tangent")
        if self.ruling not in ("free", "straight"):
            raise RibbonInputError("ruling", self.ruling, 'use "free" or "straight"')
        across = np.cross(normal, tangent)
        across /= np.linalg.norm(across)
        normal = np.cross(tangent, across)
        object.__setattr__(self, "frame", np.column_stack([across, normal, tangent]))
        object.__setattr__(self, "position", tuple(position.tolist()))
