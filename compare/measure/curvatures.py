"""Curvatures of a strip whose frames are known: how they turn along it, whatever the model."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Half the distance (l) over which a turn is measured: frames of a mesh jump between its elements.
WINDOW = 1e-3


def curvatures(frames: Callable[[FloatArray], FloatArray], s: FloatArray, window: float = WINDOW) -> FloatArray:
    """Curvatures (k, 3) in 1/l at abscissae s (k,) in [0, 1]: about t_x (bending), t_y (in the strip's plane), t_z
    (twist).

    frames: s (m,) -> (m, 3, 3), columns t_x t_y t_z. With F the frame, F' = F [kappa]_x: kappa is the rotation vector
    of F(a)^T F(b) over b - a, of second order in the `window` (l) that lies on either side of s (one side at the ends).
    """
    from scipy.spatial.transform import Rotation

    before, after = np.clip(s - window, 0.0, 1.0), np.clip(s + window, 0.0, 1.0)
    turned = np.einsum("kji,kjl->kil", frames(before), frames(after))
    return np.asarray(Rotation.from_matrix(turned).as_rotvec() / (after - before)[:, None])
