"""Mid-surfaces: material coordinates, reference placement, natural (weightless) shape of a strip. NumPy only.

Material coordinates X = (S, v) are orthogonal on the reference surface, with Lame factors |phi_0,S| and |phi_0,v|.
Strip: S in [0, 1] along, v in [-w/2, w/2] across. Clamp frame columns (t_x, t_y, t_z).
Flat reference:  phi_0 = r_0 + v t_x + S t_z ,  d_0 = t_y = t_z x t_x.
Sign (docs/theory.md, eq. (1.2)): t_z' = -omega t_y , t_y' = omega t_z.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Protocol

import numpy as np

from shellref import law
from shellref.law import Law

_GAUSS_POINTS, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(12)


def flat_strip(s: np.ndarray, v: np.ndarray, position: np.ndarray, frame: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and directors (n, 3) of the flat strip at s, v (n,); frame (3, 3) with columns t_x t_y t_z."""
    points = position + np.outer(v, frame[:, 0]) + np.outer(s, frame[:, 2])
    return points, np.tile(frame[:, 1], (len(s), 1))


def turning_angle(s: np.ndarray, curvature: Law) -> np.ndarray:
    """theta(S) = int_0^S K, of a linear law K_0 S + (K_1 - K_0) S^2 / 2, radians (docs/theory.md, eq. (7.5)).

    curvature: K along S (units 1/l; `shellref.law`).
    """
    return law.integral(curvature, s)


def natural_curve(s: np.ndarray, curvature: Law) -> tuple[np.ndarray, np.ndarray]:
    """(z, y) (n,) of the planar curve of natural curvature: int cos theta along t_z, -int sin theta along t_y.

    12-point Gauss on pieces that turn by at most a quarter radian: machine precision for a law that is linear on each.
    Pieces end at the points of a table.
    """
    nodes, where = np.unique(s, return_inverse=True)
    turn = max(*law.sizes(curvature), 1e-300)
    kinks = law.knots(curvature)[0]
    knots = np.unique(np.concatenate([[0.0], nodes, kinks, np.linspace(0.0, 1.0, int(np.ceil(4.0 * turn)) + 2)]))
    half = 0.5 * np.diff(knots)
    abscissae = (knots[:-1] + half)[:, None] + half[:, None] * _GAUSS_POINTS
    theta = turning_angle(abscissae, curvature)
    z = np.concatenate([[0.0], np.cumsum(half * (np.cos(theta) @ _GAUSS_WEIGHTS))])
    y = -np.concatenate([[0.0], np.cumsum(half * (np.sin(theta) @ _GAUSS_WEIGHTS))])
    at = np.searchsorted(knots, nodes)
    return z[at][where], y[at][where]


def natural_strip(
    s: np.ndarray, v: np.ndarray, position: np.ndarray, frame: np.ndarray, curvature: Law
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


@dataclass(frozen=True)
class Ruled:
    """A strip at rest that is no plane: a centreline of curvatures kappa_1, kappa_2 and twist kappa_3, and on it the
    straight lines t_x (docs/theory.md, eq. (7.28)).

        phi_0 = r(S) + v t_x(S) ,  r' = t_z ,  R' = R [kappa]_x ,  phi_0,S = (1 - kappa_2 v) t_z + kappa_3 v t_y

    S and v are orthogonal whatever the laws are. kappa_2 alone is a flat annular strip, kappa_3 alone a helicoid, both
    constant. The axes (e_1, e_2, e_3) are the frame (t_x, t_y, t_z) at S = `origin`, whose point is theirs.
    """

    curvature: Law = (0.0, 0.0)
    in_plane: Law = (0.0, 0.0)
    twist: Law = (0.0, 0.0)
    origin: float = 0.0

    def _at(self, s: np.ndarray) -> np.ndarray:
        """kappa (..., 3)."""
        return np.stack([law.value(one, s) for one in (self.curvature, self.in_plane, self.twist)], axis=-1)

    def frames(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points (n, 3) and frames (n, 3, 3) of the centreline at s (n,), in the axes."""
        at_ends = np.clip(np.append(s, self.origin), 0.0, 1.0)  # a mesh's last node may lie beyond by rounding
        places, where = np.unique(at_ends, return_inverse=True)
        points, turns = _centreline(self, tuple(places.tolist()))
        at, axes = points[where[-1]], turns[where[-1]]
        return (points[where[:-1]] - at) @ axes, np.einsum("ij,njk->nik", axes.T, turns[where[:-1]])

    def section(self, s: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions and unit normals (n, 3) from the point of the centreline at s, in the frame there."""
        _, second, third = self._at(s).T
        zero = np.zeros(len(s))
        normal = np.stack([zero, 1.0 - second * v, -third * v], axis=1)
        return np.stack([v, zero, zero], axis=1), normal / np.linalg.norm(normal, axis=1)[:, None]

    def place(self, s: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions and unit normals (n, 3) in the axes."""
        points, frames = self.frames(s)
        arms, normals = self.section(s, v)
        return points + np.einsum("nij,nj->ni", frames, arms), np.einsum("nij,nj->ni", frames, normals)

    def lame(self, s: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(|phi_0,S|, 1)."""
        _, second, third = self._at(s).T
        return np.stack([np.hypot(1.0 - second * v, third * v), np.ones(len(v))], axis=1)


@lru_cache(maxsize=32)
def _centreline(surface: Ruled, places: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Points and frames of a `Ruled` at ascending places, from the identity at S = 0.

    Constant curvatures: the helix in closed form. Else Runge-Kutta of order 8 (Hairer, Norsett, Wanner 1993) to 1e-13,
    from point to point of the laws.
    """
    s = np.array(places)
    laws = (surface.curvature, surface.in_plane, surface.twist)
    if not any(map(law.is_table, laws)) and all(one[0] == one[1] for one in laws):
        return _helix(surface._at(np.array(0.0)), s)
    knots = np.unique(np.concatenate([law.knots(one)[0] for one in laws]))
    y, found = np.concatenate([np.zeros(3), np.eye(3).ravel()]), np.empty((s.size, 12))
    from scipy.integrate import solve_ivp  # not before it is needed: it loads half of scipy

    for a, b in pairwise(knots):
        inside = (s >= a) & (s <= b)

        def rate(at: float, y: np.ndarray) -> np.ndarray:
            frame, k = y[3:].reshape(3, 3), surface._at(np.array(at))
            return np.concatenate([frame[:, 2], (frame @ _skew(k)).ravel()])

        at = np.union1d(s[inside], [a, b])
        steps = solve_ivp(rate, (a, b), y, method="DOP853", t_eval=at, rtol=1e-13, atol=1e-14).y.T
        found[inside] = steps[np.searchsorted(at, s[inside])]
        y = steps[-1]
    left, _, right = np.linalg.svd(found[:, 3:].reshape(-1, 3, 3))  # orthonormal to rounding
    return found[:, :3], left @ right


def _skew(k: np.ndarray) -> np.ndarray:
    """[k]_x (3, 3)."""
    x, y, z = k
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _helix(k: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """exp(s [k]_x) and the integral of its last column (Rodrigues), at s (n,)."""
    skew, size = _skew(k), float(np.linalg.norm(k))
    x = size * s
    one = s * np.sinc(x / np.pi)
    two = 0.5 * s**2 * np.sinc(0.5 * x / np.pi) ** 2
    small = np.abs(x) < 1e-2
    safe = np.where(small, 1.0, x)
    three = s**3 * np.where(small, 1.0 / 6.0 - x**2 / 120.0 + x**4 / 5040.0, (safe - np.sin(safe)) / safe**3)
    frames = np.eye(3) + one[:, None, None] * skew + two[:, None, None] * (skew @ skew)
    moved = s[:, None, None] * np.eye(3) + two[:, None, None] * skew + three[:, None, None] * (skew @ skew)
    return moved[:, :, 2], frames
