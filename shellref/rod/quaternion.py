"""Unit quaternions (w, x, y, z) and the rotations that they stand for; arrays (..., 4), (..., 3), (..., 3, 3).

A frame R has columns t_x, t_y, t_z; v in space and its components V in the frame:  v = R V = Im(q V q*). A turn by the
vector theta, of components in the frame, changes q into q exp(theta / 2).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def _product_tensor() -> Array:
    """P with (a b)_k = P[k, i, j] a_i b_j."""
    table = np.zeros((4, 4, 4))
    table[0] = np.diag([1.0, -1.0, -1.0, -1.0])
    for k, i, j in ((1, 2, 3), (2, 3, 1), (3, 1, 2)):
        table[k, 0, k] = table[k, k, 0] = 1.0
        table[k, i, j], table[k, j, i] = 1.0, -1.0
    return table


PRODUCT = _product_tensor()
CONJUGATE = np.diag([1.0, -1.0, -1.0, -1.0])


def product(a: Array, b: Array) -> Array:
    """A b."""
    return np.asarray(np.einsum("kij,...i,...j->...k", PRODUCT, a, b))


def right(b: Array) -> Array:
    """The matrix (4, 4) of the product with b (4,) from the right: a b = right(b) a."""
    return np.asarray(PRODUCT @ b)


def conjugate(q: Array) -> Array:
    """q*."""
    return np.asarray(q @ CONJUGATE)


def turned(q: Array, theta: Array) -> Array:
    """Q exp(theta / 2), of unit length."""
    angle = np.linalg.norm(theta, axis=-1, keepdims=True)
    turn = np.concatenate([np.cos(0.5 * angle), 0.5 * np.sinc(angle / (2.0 * np.pi)) * theta], axis=-1)
    found = product(q, turn)
    return np.asarray(found / np.linalg.norm(found, axis=-1, keepdims=True))


def turn_between(a: Array, b: Array) -> Array:
    """The shortest theta (..., 3), in the frame of a, with b = +- a exp(theta / 2)."""
    relative = product(conjugate(a), b)
    relative = np.where(relative[..., :1] < 0.0, -relative, relative)
    sine = np.linalg.norm(relative[..., 1:], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, relative[..., :1])
    return np.asarray(np.where(sine > 1e-12, angle / np.where(sine > 0.0, sine, 1.0), 2.0) * relative[..., 1:])


def rotation(q: Array) -> Array:
    """R (..., 3, 3) of unit quaternions."""
    w, x, y, z = np.moveaxis(np.asarray(q), -1, 0)
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion(frame: Array) -> Array:
    """One of the two unit quaternions (4,) of a rotation (3, 3): the largest component is taken first."""
    r = np.asarray(frame)
    trace = float(np.trace(r))
    squares = 0.25 * np.array([1.0 + trace, *(1.0 + 2.0 * np.diag(r) - trace)])
    k = int(np.argmax(squares))
    axial = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    q = np.empty(4)
    if k == 0:
        q[0], q[1:] = 4.0 * squares[0], axial
    else:
        q[0] = axial[k - 1]
        q[1:] = r[k - 1] + r[:, k - 1]
        q[k] = 4.0 * squares[k]
    return np.asarray(q / np.linalg.norm(q))


def continuous(q: Array) -> Array:
    """Quaternions (n, 4) with signs such that neighbours are the nearer ones of the two."""
    signs = np.where(np.sum(q[1:] * q[:-1], axis=1) < 0.0, -1.0, 1.0)
    return np.asarray(q * np.concatenate([[1.0], np.cumprod(signs)])[:, None])
