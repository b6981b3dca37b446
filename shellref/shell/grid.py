"""The structured grid of the shell: knots, graded or placed, and the order of nodes and cells. NumPy only."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shellref.kernels.lagrange import lobatto

#: Into how many equal ones elements are cut: all of them, or each column (row).
Parts = int | Sequence[int]

CLAMP_LAYER = 0.1  # share of the elements along, over which a mesh graded by ratio comes back to even sizes


def knots_along(count: int, finest: float, both: bool = False) -> np.ndarray:
    """(count + 1,) ends of the elements in S in [0, 1], refined towards the clamp: `finest` = first over even element.

    Sizes follow 1 - (1 - finest) exp(-t / CLAMP_LAYER), t in [0, 1] the element's place in the count; `both`: the same
    towards S = 1.
    """
    t = np.linspace(0.0, 1.0, count + 1)
    x = t + (1.0 - finest) * CLAMP_LAYER * np.expm1(-t / CLAMP_LAYER)
    if both:
        x = x + (1.0 - finest) * CLAMP_LAYER * (np.exp(-1.0 / CLAMP_LAYER) - np.exp(-(1.0 - t) / CLAMP_LAYER))
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


def snapped(knots: np.ndarray, places: list[float]) -> np.ndarray:
    """Knots with the nearest inner one moved onto each place, so that a boundary between materials or supports fits.

    Raises ValueError when two places want the same knot (the mesh is too coarse for them).
    """
    knots = knots.copy()
    taken: set[int] = set()
    for place in places:
        inner = np.arange(1, len(knots) - 1)
        if not len(inner):
            raise ValueError(f"there is no inner knot to put at {place:g}: use more elements")
        k = int(inner[np.argmin(np.abs(knots[inner] - place))])
        low, high = knots[k - 1], knots[k + 1]
        if k in taken or not low < place < high:
            raise ValueError(f"the mesh is too coarse for a knot at {place:g}: use more elements")
        knots[k] = place
        taken.add(k)
    return knots


def _places(x: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Number of the place nearest each x; places ascending."""
    right = np.clip(np.searchsorted(places, x), 1, len(places) - 1)
    return np.where(x - places[right - 1] < places[right] - x, right - 1, right)


class Grid:
    """The structured grid of elements of degree k: from unordered nodes and cells to rows and columns.

    s_knots (nx + 1,), v_knots (ny + 1,): ends of the elements; s_nodes (k nx + 1,), v_nodes (k ny + 1,): all nodes, at
    the Gauss-Lobatto points of every element.
    """

    def __init__(self, s_knots: np.ndarray, v_knots: np.ndarray, degree: int = 2):
        self.degree = degree
        self.s_knots, self.v_knots = np.asarray(s_knots, dtype=float), np.asarray(v_knots, dtype=float)
        self.s_nodes, self.v_nodes = (self._with_inner(knots) for knots in (self.s_knots, self.v_knots))

    @property
    def elements(self) -> tuple[int, int]:
        """(along, across)."""
        return len(self.s_knots) - 1, len(self.v_knots) - 1

    @property
    def cells(self) -> int:
        """Number of elements."""
        return self.elements[0] * self.elements[1]

    def _with_inner(self, knots: np.ndarray) -> np.ndarray:
        inner = knots[:-1, None] + np.diff(knots)[:, None] * lobatto(self.degree)[0][:-1]
        return np.append(inner.ravel(), knots[-1])

    def refined(self, along: Parts, across: Parts) -> Grid:
        """Every element cut into `along` x `across` equal ones (the meshes are nested); a number for all columns (rows)
        or one for each of them."""

        def cut(knots: np.ndarray, parts: Parts) -> np.ndarray:
            each = np.broadcast_to(np.asarray(parts, dtype=int), len(knots) - 1)
            inner = [a + (b - a) * np.arange(n) / n for a, b, n in zip(knots[:-1], knots[1:], each, strict=True)]
            return np.append(np.concatenate(inner), knots[-1])

        return Grid(cut(self.s_knots, along), cut(self.v_knots, across), self.degree)

    def positions(self, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(row, column) of each node (n, 2) on the grid."""
        return _places(nodes[:, 0], self.s_nodes), _places(nodes[:, 1], self.v_nodes)

    def order(self, nodes: np.ndarray) -> np.ndarray:
        """(k nx + 1, k ny + 1) numbers of the nodes (n, 2) on the grid."""
        order = np.full((len(self.s_nodes), len(self.v_nodes)), -1)
        order[self.positions(nodes)] = np.arange(len(nodes))
        if np.any(order < 0):
            raise ValueError("the nodes do not form the grid")
        return order

    @property
    def nodes(self) -> np.ndarray:
        """(n, 2) all nodes, along v first."""
        return np.stack(np.meshgrid(self.s_nodes, self.v_nodes, indexing="ij"), axis=2).reshape(-1, 2)

    def numbers(self, nodes: np.ndarray) -> np.ndarray:
        """(n,) which of `nodes` each node (n, 2) is."""
        rows, columns = self.positions(nodes)
        return rows * len(self.v_nodes) + columns

    def areas(self, midpoints: np.ndarray) -> np.ndarray:
        """(cells,) areas in the (S, v) plane of the elements with these midpoints (cells, 2)."""
        i = np.searchsorted(self.s_knots, midpoints[:, 0]) - 1
        j = np.searchsorted(self.v_knots, midpoints[:, 1]) - 1
        return np.diff(self.s_knots)[i] * np.diff(self.v_knots)[j]

    def nodal_shares(self, axis: int) -> np.ndarray:
        """(nodes,) length lumped by the Gauss-Lobatto rule on the nodes along S (axis 0) or v (axis 1)."""
        knots, places = ((self.s_knots, self.s_nodes), (self.v_knots, self.v_nodes))[axis]
        share = np.zeros(len(places))
        k = self.degree
        for offset, weight in enumerate(lobatto(k)[1]):
            share[offset : offset + k * (len(knots) - 1) : k] += weight * np.diff(knots)
        return share

    def nodal_areas(self, nodes: np.ndarray) -> np.ndarray:
        """(n,) area of the (S, v) plane lumped on each node (n, 2) by the Gauss-Lobatto rule in every element."""
        rows, columns = self.positions(nodes)
        return self.nodal_shares(0)[rows] * self.nodal_shares(1)[columns]
