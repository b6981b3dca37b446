"""The strip's mid-surface: material coordinates, flat reference placement, natural (weightless) shape. NumPy only.

Material coordinates X = (S, v): S in [0, 1] along, v in [-w/2, w/2] across. Clamp frame columns (t_x, t_y, t_z).
Flat reference:  phi_0 = r_0 + v t_x + S t_z ,  d_0 = t_y = t_z x t_x.
Sign (theory sheet, section 1): t_z' = -omega t_y , t_y' = omega t_z.
"""

from __future__ import annotations

import numpy as np

_GAUSS_POINTS, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(12)


def flat_strip(s: np.ndarray, v: np.ndarray, position: np.ndarray, frame: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and directors (n, 3) of the flat strip at material points s, v (n,); frame (3, 3), columns t_x t_y t_z."""
    points = position + np.outer(v, frame[:, 0]) + np.outer(s, frame[:, 2])
    return points, np.tile(frame[:, 1], (len(s), 1))


def turning_angle(s: np.ndarray, curvature: tuple[float, float]) -> np.ndarray:
    """theta(S) = int_0^S K = K_0 S + (K_1 - K_0) S^2 / 2, radians; curvature: K at S = 0 and 1 (units 1/l)."""
    start, end = curvature
    return start * s + 0.5 * (end - start) * s**2


def natural_curve(s: np.ndarray, curvature: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """(z, y) (n,) of the planar curve of natural curvature: int cos theta along t_z, -int sin theta along t_y.

    12-point Gauss on pieces that turn by at most a quarter radian: machine precision for the linear law.
    """
    nodes, where = np.unique(s, return_inverse=True)
    turn = max(abs(curvature[0]), abs(curvature[1]), 1e-300)
    knots = np.unique(np.concatenate([[0.0], nodes, np.linspace(0.0, 1.0, int(np.ceil(4.0 * turn)) + 2)]))
    half = 0.5 * np.diff(knots)
    abscissae = (knots[:-1] + half)[:, None] + half[:, None] * _GAUSS_POINTS
    theta = turning_angle(abscissae, curvature)
    z = np.concatenate([[0.0], np.cumsum(half * (np.cos(theta) @ _GAUSS_WEIGHTS))])
    y = -np.concatenate([[0.0], np.cumsum(half * (np.sin(theta) @ _GAUSS_WEIGHTS))])
    at = np.searchsorted(knots, nodes)
    return z[at][where], y[at][where]


def natural_strip(
    s: np.ndarray, v: np.ndarray, position: np.ndarray, frame: np.ndarray, curvature: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Positions and directors (n, 3) of the weightless equilibrium: a cylinder over the natural planar curve.

    Its bending strain is exactly k_nat and its membrane and shear strains vanish, so its energy is zero.
    """
    z, y = natural_curve(s, curvature)
    theta = turning_angle(s, curvature)
    points = position + np.outer(v, frame[:, 0]) + np.outer(z, frame[:, 2]) + np.outer(y, frame[:, 1])
    directors = np.outer(np.cos(theta), frame[:, 1]) + np.outer(np.sin(theta), frame[:, 2])
    return points, directors
