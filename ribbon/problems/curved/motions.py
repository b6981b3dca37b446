"""Rigid motions that change neither energy nor constraints of a strip beside obstacles, which turn about themselves."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from ribbon.contact import Barrier
from ribbon.obstacle import cross_matrix

FloatArray = NDArray[np.float64]

#: Singular value below which a condition on a motion is rounding.
_ROUNDING = 1e-9


def free(
    surfaces: Sequence[Barrier], loads: Iterable[FloatArray], points: Iterable[FloatArray], turns: bool
) -> tuple[FloatArray, FloatArray]:
    """Unit translations (k, 3) and axes of rotation (m, 3): of the motions ``v + w x r`` that all surfaces (lengths in
    l), dead loads (unit vectors) and held points (l) leave, those without w, and the turns of the others; turns:
    whether there may be any."""
    rows = [surface.motions() for surface in surfaces]
    for load in loads:
        rows += [np.append(load, np.zeros(3))[None, :], np.hstack([np.zeros((3, 3)), cross_matrix(load)])]
    rows += [np.hstack([np.eye(3), -cross_matrix(point)]) for point in points]
    if not turns:
        rows.append(np.hstack([np.zeros((3, 3)), np.eye(3)]))
    left = _null(np.vstack(rows))
    still = _null(left[:, 3:].T)
    shifts = still @ left
    others = _null(still) @ left if len(still) else left
    return shifts[:, :3], others[:, 3:] / np.linalg.norm(others[:, 3:], axis=1, keepdims=True)


def _null(matrix: FloatArray) -> FloatArray:
    """Orthonormal rows (k, n) with ``matrix @ row = 0``."""
    if not matrix.size:
        return np.eye(matrix.shape[1])
    _, singular, rows = np.linalg.svd(matrix)
    return np.asarray(rows[int((singular > _ROUNDING).sum()) :])
