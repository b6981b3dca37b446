"""Mid-surfaces: material coordinates, reference placement, natural (weightless) shape of a strip. NumPy only.

Material coordinates X = (S, v) are orthogonal on the reference surface, with Lame factors |phi_0,S| and |phi_0,v|.
Strip: S in [0, 1] along, v in [-w/2, w/2] across. Clamp frame columns (t_x, t_y, t_z).
Flat reference:  phi_0 = r_0 + v t_x + S t_z ,  d_0 = t_y = t_z x t_x.
Sign (docs/theory.md, eq. (1.2)): t_z' = -omega t_y , t_y' = omega t_z.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

_GAUSS_POINTS, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(12)


def flat_strip(s: np.ndarray, v: np.ndarray, position: np.ndarray, frame: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and directors (n, 3) of the flat strip at s, v (n,); frame (3, 3) with columns t_x t_y t_z."""
    points = position + np.outer(v, frame[:, 0]) + np.outer(s, frame[:, 2])
    return points, np.tile(frame[:, 1], (len(s), 1))


def turning_angle(s: np.ndarray, curvature: tuple[float, float]) -> np.ndarray:
    """theta(S) = int_0^S K = K_0 S + (K_1 - K_0) S^2 / 2, radians (docs/theory.md, eq. (7.5)).

    curvature: K at S = 0 and 1 (units 1/l).
    """
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


class MidSurface(Protocol):
    """A reference surface in orthogonal coordinates (S, v)."""

    def place(self, s: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions and unit normals (n, 3) at s, v (n,)."""
        ...

    def lame(self, s: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(n, 2) lengths of phi_0,S and phi_0,v."""
        ...


@dataclass(frozen=True)
class Cylinder:
    """A cylinder, or a plane: straight along one coordinate, of curvature 1/R along the other; both are arc lengths.

    Local axes (e_1, e_2, e_3): at (0, 0) the surface runs along e_1 = d/dv, its normal is e_2, and e_3 = d/dS.
    curvature_along: t_z' = -k t_y as for a strip (normal curvature of S-lines). curvature_across: the same law for the
    v-lines, d(phi,v)/dv = -k normal: a tape spring with k > 0 is convex towards its normal. At most one is not zero.
    """

    curvature_along: float = 0.0
    curvature_across: float = 0.0

    def __post_init__(self) -> None:
        if self.curvature_along and self.curvature_across:
            raise ValueError("a cylinder is curved along S or along v, not both")

    def place(self, s: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions and unit normals (n, 3) in the axes (e_1, e_2, e_3)."""
        zero, one = np.zeros(len(s)), np.ones(len(s))
        if self.curvature_along:
            k, x = self.curvature_along, s
            points = np.stack([v, (np.cos(k * x) - 1.0) / k, np.sin(k * x) / k], axis=1)
            return points, np.stack([zero, np.cos(k * x), np.sin(k * x)], axis=1)
        if self.curvature_across:
            k, x = self.curvature_across, v
            points = np.stack([np.sin(k * x) / k, (np.cos(k * x) - 1.0) / k, s], axis=1)
            return points, np.stack([np.sin(k * x), np.cos(k * x), zero], axis=1)
        return np.stack([v, zero, s], axis=1), np.stack([zero, one, zero], axis=1)

    def lame(self, s: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Ones: both coordinates are arc lengths."""
        return np.ones((len(s), 2))


@dataclass(frozen=True)
class Annulus:
    """A flat ring in the plane of e_1 and e_3: S the polar angle (radians), v the radius; normal e_2.

    phi_0 = v (cos S e_1 + sin S e_3).
    """

    def place(self, s: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions and unit normals (n, 3)."""
        points = np.stack([v * np.cos(s), np.zeros(len(s)), v * np.sin(s)], axis=1)
        return points, np.tile([0.0, 1.0, 0.0], (len(s), 1))

    def lame(self, s: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(radius, 1)."""
        return np.stack([np.abs(v), np.ones(len(v))], axis=1)
