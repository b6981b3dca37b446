"""Gap of points ``x = r + R(q) y(z)`` from a curved surface and its derivatives by r, q, z (docs/theory.md, (5.10)).

R is quadratic in q: ``R_ab = q^T F_ab q`` with constant F. With the surface's gap g, gradient n and second derivative
B at x and J the derivative of x by c = (r, q, z)::

    g_c = J^T n ,   g_cc = J^T B J + n . x_cc ,

    n . x_qq = 2 sum n_a y_b F_ab ,   n . x_qz = 2 sum n_a F_ab q (y_b)_z ,   n . x_zz = (R^T n) . y_zz .
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ribbon.element.quaternion import form
from ribbon.obstacle import Obstacle

FloatArray = NDArray[np.float64]


def _forms() -> FloatArray:
    """F (3, 3, 4, 4)."""
    out = np.empty((3, 3, 4, 4))
    for a, one in enumerate(np.eye(3)):
        for b, other in enumerate(np.eye(3)):
            form(one, other, out[a, b])
    return out


FORMS = _forms()


class Placed(NamedTuple):
    """Points on a curved surface's side: gap (k,), normal (k, 3), bend (k, 3, 3) of the surface there; matrix (k, 3, 3)
    is R(q), turned (k, 3) R^T n, slopes (k, 3, 7 + z) J, second (k, 7 + z, 7 + z) g_cc."""

    gap: FloatArray
    normal: FloatArray
    bend: FloatArray
    matrix: FloatArray
    turned: FloatArray
    slopes: FloatArray
    second: FloatArray


_FLAT_FORMS = FORMS.reshape(9, 16)


def rotations(q: FloatArray) -> FloatArray:
    """R(q) (k, 3, 3)."""
    return np.asarray(((q[:, :, None] * q[:, None, :]).reshape(-1, 16) @ _FLAT_FORMS.T).reshape(-1, 3, 3))


def times(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Matrices (k, m, n) times vectors (k, n): (k, m)."""
    return np.asarray((matrices @ vectors[:, :, None])[:, :, 0])


def form_of(normal: FloatArray, y: FloatArray) -> FloatArray:
    """``sum n_a y_b F_ab`` (k, 4, 4): n . R(q) y is its quadratic form in q."""
    return np.asarray(((normal[:, :, None] * y[:, None, :]).reshape(-1, 9) @ _FLAT_FORMS).reshape(-1, 4, 4))


def placed(
    surface: Obstacle, r: FloatArray, q: FloatArray, y: FloatArray, by_z: FloatArray, second: FloatArray | None
) -> Placed:
    """Of points with r (k, 3), q (k, 4), y (k, 3), y_z (k, 3, z) and y_zz (k, 3, z, z), None for 0."""
    by_q = 2.0 * (q @ FORMS.reshape(36, 4).T).reshape(-1, 3, 3, 4)  # R_q
    matrix = 0.5 * (by_q @ q[:, None, :, None])[..., 0]
    gap, normal, bend = surface.derivatives(r + times(matrix, y))
    count, z = len(r), by_z.shape[2]
    slopes = np.empty((count, 3, 7 + z))
    slopes[:, :, :3] = np.eye(3)
    slopes[:, :, 3:7] = (y[:, None, None, :] @ by_q)[:, :, 0]
    slopes[:, :, 7:] = matrix @ by_z
    full = np.swapaxes(slopes, 1, 2) @ bend @ slopes
    full[:, 3:7, 3:7] += 2.0 * form_of(normal, y)
    turned_by_q = (normal[:, None, :] @ by_q.reshape(-1, 3, 12)).reshape(-1, 3, 4)
    mixed = np.swapaxes(turned_by_q, 1, 2) @ by_z
    full[:, 3:7, 7:] += mixed
    full[:, 7:, 3:7] += np.swapaxes(mixed, 1, 2)
    turned = times(np.swapaxes(matrix, 1, 2), normal)
    if second is not None:
        full[:, 7:, 7:] += np.einsum("kb,kbij->kij", turned, second)
    return Placed(gap, normal, bend, matrix, turned, slopes, full)
