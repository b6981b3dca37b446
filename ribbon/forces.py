"""What a support exerts on the ribbon, as data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Force:
    """Force (3,) in D w / l^2 and moment (3,) in D w / l that a support exerts on the ribbon."""

    force: FloatArray
    moment: FloatArray


@dataclass(frozen=True)
class WallForce:
    """What a wall exerts on the ribbon: force (3,) in D w / l^2, abscissae (k,) of the points in contact, ends (m, 2)
    of the rulings that it pushes: their abscissa and where across, v = w / 2 or -w / 2, in l; height of a pressure
    plate above its place at rest, in l (None: a rigid wall)."""

    force: FloatArray
    contacts: FloatArray
    ends: FloatArray
    height: float | None = None
