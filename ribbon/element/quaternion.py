"""Rotations as quaternions q = (w, x, y, z), homogeneous of degree two: R(q) is |q|^2 times a rotation.

With v = (x, y, z) (docs/theory.md, eq. (4.6))::

    R(q) u = w^2 u + 2 w v x u + 2 v (v . u) - |v|^2 u
    a . R(q) u = q^T N(a, u) q ,   N = [[a . u, (u x a)^T], [u x a, a u^T + u a^T - (a . u) 1]]

so that every derivative of a rotated vector by q is linear or constant. A small rotation by the vector phi changes q by
``phi o q / 2`` when phi is given in the fixed frame and by ``q o phi / 2`` when it is given in the moving one.
Composition: ``R(p o q) = R(p) R(q)``, Hamilton's product (K. Shoemake 1985, doi:10.1145/325165.325242).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


@njit(cache=True)
def product(p, q, out):
    """out (4,) = p o q."""
    out[0] = p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3]
    out[1] = p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2]
    out[2] = p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1]
    out[3] = p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0]


@njit(cache=True)
def left_matrix(p, out):
    """out (4, 4): p o q = out q."""
    w, x, y, z = p[0], p[1], p[2], p[3]
    out[0, 0], out[0, 1], out[0, 2], out[0, 3] = w, -x, -y, -z
    out[1, 0], out[1, 1], out[1, 2], out[1, 3] = x, w, -z, y
    out[2, 0], out[2, 1], out[2, 2], out[2, 3] = y, z, w, -x
    out[3, 0], out[3, 1], out[3, 2], out[3, 3] = z, -y, x, w


@njit(cache=True)
def right_matrix(q, out):
    """out (4, 4): p o q = out p."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    out[0, 0], out[0, 1], out[0, 2], out[0, 3] = w, -x, -y, -z
    out[1, 0], out[1, 1], out[1, 2], out[1, 3] = x, w, z, -y
    out[2, 0], out[2, 1], out[2, 2], out[2, 3] = y, -z, w, x
    out[3, 0], out[3, 1], out[3, 2], out[3, 3] = z, y, -x, w


@njit(cache=True)
def rotate(q, u, out):
    """out (3,) = R(q) u."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    d = x * u[0] + y * u[1] + z * u[2]
    s = w * w - x * x - y * y - z * z
    out[0] = s * u[0] + 2.0 * (w * (y * u[2] - z * u[1]) + x * d)
    out[1] = s * u[1] + 2.0 * (w * (z * u[0] - x * u[2]) + y * d)
    out[2] = s * u[2] + 2.0 * (w * (x * u[1] - y * u[0]) + z * d)


@njit(cache=True)
def unrotate(q, a, out):
    """out (3,) = R(q)^T a."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    d = x * a[0] + y * a[1] + z * a[2]
    s = w * w - x * x - y * y - z * z
    out[0] = s * a[0] + 2.0 * (w * (z * a[1] - y * a[2]) + x * d)
    out[1] = s * a[1] + 2.0 * (w * (x * a[2] - z * a[0]) + y * d)
    out[2] = s * a[2] + 2.0 * (w * (y * a[0] - x * a[1]) + z * d)


@njit(cache=True)
def form(a, u, out):
    """out (4, 4) = N(a, u): a . R(q) u = q^T N q."""
    d = a[0] * u[0] + a[1] * u[1] + a[2] * u[2]
    out[0, 0] = d
    out[0, 1] = out[1, 0] = u[1] * a[2] - u[2] * a[1]
    out[0, 2] = out[2, 0] = u[2] * a[0] - u[0] * a[2]
    out[0, 3] = out[3, 0] = u[0] * a[1] - u[1] * a[0]
    for i in range(3):
        for j in range(3):
            out[1 + i, 1 + j] = a[i] * u[j] + u[i] * a[j]
        out[1 + i, 1 + i] -= d


@njit(cache=True)
def rotate_by_q(q, u, out):
    """out (3, 4) = d (R(q) u) / dq."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    d = x * u[0] + y * u[1] + z * u[2]
    out[0, 0] = 2.0 * (w * u[0] + y * u[2] - z * u[1])
    out[1, 0] = 2.0 * (w * u[1] + z * u[0] - x * u[2])
    out[2, 0] = 2.0 * (w * u[2] + x * u[1] - y * u[0])
    v = (x, y, z)
    for k in range(3):
        for i in range(3):
            out[i, 1 + k] = 2.0 * (v[i] * u[k] - v[k] * u[i])
        out[k, 1 + k] += 2.0 * d
    # 2 w e_k x u
    out[1, 1] -= 2.0 * w * u[2]
    out[2, 1] += 2.0 * w * u[1]
    out[0, 2] += 2.0 * w * u[2]
    out[2, 2] -= 2.0 * w * u[0]
    out[0, 3] -= 2.0 * w * u[1]
    out[1, 3] += 2.0 * w * u[0]


def conjugate(q: ArrayLike) -> FloatArray:
    """(w, -x, -y, -z)."""
    return np.asarray(q, dtype=float) * np.array([1.0, -1.0, -1.0, -1.0])


def compose(p: ArrayLike, q: ArrayLike) -> FloatArray:
    """p o q, (4,)."""
    out = np.empty(4)
    product(np.asarray(p, dtype=float), np.asarray(q, dtype=float), out)
    return out


def matrix(q: ArrayLike) -> FloatArray:
    """R(q) / |q|^2, (..., 3, 3), from quaternions (..., 4)."""
    w, x, y, z = np.moveaxis(np.asarray(q, dtype=float), -1, 0)
    rows = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    unit = w * w + x * x + y * y + z * z
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2) / unit[..., None, None]


def from_matrix(frame: ArrayLike) -> FloatArray:
    """Unit quaternion (4,) of a rotation matrix (3, 3), w >= 0 (Shepperd's method: the largest component first)."""
    r = np.asarray(frame, dtype=float)
    squares = np.array(
        [
            1.0 + r[0, 0] + r[1, 1] + r[2, 2],
            1.0 + r[0, 0] - r[1, 1] - r[2, 2],
            1.0 - r[0, 0] + r[1, 1] - r[2, 2],
            1.0 - r[0, 0] - r[1, 1] + r[2, 2],
        ]
    )
    k = int(np.argmax(squares))
    d = 2.0 * math.sqrt(squares[k])
    if k == 0:
        q = [0.25 * d, (r[2, 1] - r[1, 2]) / d, (r[0, 2] - r[2, 0]) / d, (r[1, 0] - r[0, 1]) / d]
    elif k == 1:
        q = [(r[2, 1] - r[1, 2]) / d, 0.25 * d, (r[0, 1] + r[1, 0]) / d, (r[0, 2] + r[2, 0]) / d]
    elif k == 2:
        q = [(r[0, 2] - r[2, 0]) / d, (r[0, 1] + r[1, 0]) / d, 0.25 * d, (r[1, 2] + r[2, 1]) / d]
    else:
        q = [(r[1, 0] - r[0, 1]) / d, (r[0, 2] + r[2, 0]) / d, (r[1, 2] + r[2, 1]) / d, 0.25 * d]
    out = np.array(q)
    out /= np.linalg.norm(out)
    return -out if out[0] < 0 else out


def turn(axis: ArrayLike, angle: float) -> FloatArray:
    """Unit quaternion (4,) of the rotation by `angle` (rad) about the unit vector `axis`."""
    half = 0.5 * angle
    return np.concatenate([[math.cos(half)], math.sin(half) * np.asarray(axis, dtype=float)])
