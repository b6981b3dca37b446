"""The strip's mid-surface: material coordinates, flat reference placement, natural (weightless) shape. NumPy only.

Material coordinates X = (S, v): S in [0, 1] along, v in [-w/2, w/2] across. Clamp frame columns (t_x, t_y, t_z).
Flat reference:  phi_0 = r_0 + v t_x + S t_z ,  d_0 = t_y = t_z x t_x.
Sign (theory sheet, section 1): t_z' = -omega t_y , t_y' = omega t_z.
"""

from __future__ import annotations

import numpy as np

_GAUSS_POINTS, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(12)


def flat_strip(s: np.ndarray, v: np.ndarray, position: np.ndarray, frame: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and directors (n, 3) of the flat strip at s, v (n,); frame (3, 3) with columns t_x t_y t_z."""
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


CLAMP_LAYER = 0.1  # share of the elements along, over which a graded mesh comes back to even sizes


def knots_along(count: int, finest: float) -> np.ndarray:
    """(count + 1,) ends of the elements in S, refined towards the clamp: `finest` = first element over the even ones.

    Sizes follow 1 - (1 - finest) exp(-t / CLAMP_LAYER), t in [0, 1] the element's place in the count.
    """
    t = np.linspace(0.0, 1.0, count + 1)
    x = t + (1.0 - finest) * CLAMP_LAYER * np.expm1(-t / CLAMP_LAYER)
    return x / x[-1]


def knots_across(count: int, finest: float, width: float) -> np.ndarray:
    """(count + 1,) ends of the elements in v, symmetric about v = 0.

    Sizes are in geometric progression from `finest` at the edges to 1 in the middle.
    """
    t = np.linspace(0.0, 1.0, count + 1)
    tau = 2.0 * np.minimum(t, 1.0 - t)
    rate = -np.log(finest)
    x = tau if rate < 1e-9 else np.expm1(rate * tau) / np.expm1(rate)
    return 0.5 * width * np.where(t <= 0.5, x - 1.0, 1.0 - x)


def _places(x: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Number of the place nearest each x; places ascending."""
    right = np.clip(np.searchsorted(places, x), 1, len(places) - 1)
    return np.where(x - places[right - 1] < places[right] - x, right - 1, right)


class Grid:
    """The structured biquadratic grid of the strip: from unordered nodes and cells to rows and columns.

    s_knots (nx + 1,), v_knots (ny + 1,): ends of the elements; s_nodes (2 nx + 1,), v_nodes (2 ny + 1,): and middles.
    """

    def __init__(self, elements: tuple[int, int], width: float, grading: tuple[float, float] = (1.0, 1.0)):
        self.s_knots = knots_along(elements[0], grading[0])
        self.v_knots = knots_across(elements[1], grading[1], width)
        self.s_nodes, self.v_nodes = (self._with_middles(knots) for knots in (self.s_knots, self.v_knots))

    @staticmethod
    def _with_middles(knots: np.ndarray) -> np.ndarray:
        nodes = np.empty(2 * len(knots) - 1)
        nodes[::2], nodes[1::2] = knots, 0.5 * (knots[1:] + knots[:-1])
        return nodes

    def order(self, nodes: np.ndarray) -> np.ndarray:
        """(2 nx + 1, 2 ny + 1) numbers of the nodes (n, 2) on the grid."""
        order = np.full((len(self.s_nodes), len(self.v_nodes)), -1)
        order[_places(nodes[:, 0], self.s_nodes), _places(nodes[:, 1], self.v_nodes)] = np.arange(len(nodes))
        if np.any(order < 0):
            raise ValueError("the nodes do not form the strip's grid")
        return order

    def areas(self, midpoints: np.ndarray) -> np.ndarray:
        """(cells,) areas of the elements with these midpoints (cells, 2)."""
        i = np.searchsorted(self.s_knots, midpoints[:, 0]) - 1
        j = np.searchsorted(self.v_knots, midpoints[:, 1]) - 1
        return np.diff(self.s_knots)[i] * np.diff(self.v_knots)[j]

    def nodal_areas(self, nodes: np.ndarray) -> np.ndarray:
        """(n,) area lumped on each node (n, 2) by Simpson's rule in every element."""
        shares = []
        for knots, places, x in ((self.s_knots, self.s_nodes, nodes[:, 0]), (self.v_knots, self.v_nodes, nodes[:, 1])):
            share = np.zeros(len(places))
            for offset, weight in ((0, 1.0), (1, 4.0), (2, 1.0)):
                share[offset : offset + 2 * len(knots) - 2 : 2] += weight / 6.0 * np.diff(knots)
            shares.append(share[_places(x, places)])
        return shares[0] * shares[1]
