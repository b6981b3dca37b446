"""Whether what holds a strip can hold it, asked of a scene when it is read and of a strip when it is solved; moments.

One set of tolerances for both, so that the command takes what the Python API takes and refuses what it refuses. These
are checks of what is given: no solution is computed from them, and each caller says in its own words what is wrong.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

BEHIND_WALL = 1e-6
"""How far, over the length, a held point may stand behind a rigid wall: as far as a solved strip may reach into one."""

UNSUPPORTED = 1e-8
"""Part of the weight's direction that walls may leave without support: rounding of unit vectors as people type them."""


def cross(one: ArrayLike, other: ArrayLike) -> NDArray[np.float64]:
    """The product a x b (3,) of two vectors (3,): the moment of a force, the third axis of a frame. `numpy.cross`
    is made for many pairs, and slow for one."""
    a, b, c = np.asarray(one, dtype=float).tolist()
    x, y, z = np.asarray(other, dtype=float).tolist()
    return np.array([b * z - c * y, c * x - a * z, a * y - b * x])


def depth(points: ArrayLike, place: ArrayLike, normal: ArrayLike) -> np.ndarray:
    """How far the points (n, 3) stand behind a wall through `place` (3,) with the unit vector `normal` (3,) on the
    strip's side: (n,), negative in front of it."""
    apart = np.atleast_2d(np.asarray(points, dtype=float)) - np.asarray(place, dtype=float)
    return np.asarray(-apart @ np.asarray(normal, dtype=float))


def is_carried(normals: ArrayLike, up: ArrayLike) -> bool:
    """Whether walls without friction carry a weight against the unit vector `up` (3,): it is a sum of their unit
    normals (n, 3), none of them pulling; otherwise there is a direction along which the strip falls or slides for ever
    (Farkas' lemma)."""
    known = np.asarray(normals, dtype=float).reshape(-1, 3)
    if not len(known):
        return False
    from scipy.optimize import nnls  # not before it is needed: it loads half of scipy

    return bool(nnls(known.T, np.asarray(up, dtype=float))[1] <= UNSUPPORTED)
