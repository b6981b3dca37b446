"""The elements of a shell on one process: strains, forces and reduced tangents by the compiled kernels."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from scipy import sparse

from shellref.fenics import dolfinx_api as api
from shellref.kernels import element, lagrange
from shellref.shell.body import Body
from shellref.shell.grid import Grid

Pattern = tuple[np.ndarray, np.ndarray]
Rule = tuple[np.ndarray, np.ndarray, np.ndarray]


class Discrete(Protocol):
    """What the elements are made from, of a model (`shellref.shell.naghdi.NaghdiModel`); cells in its order."""

    body: Body
    grid: Grid
    nodes: np.ndarray
    midpoints: np.ndarray
    sizes: np.ndarray
    degrees: tuple[int, int]
    scales: list[np.ndarray]
    weights: list[np.ndarray]
    alpha: np.ndarray

    @property
    def stiffness(self) -> np.ndarray:
        """(nu, factor of the membrane's, of the shear's stiffness)."""
        ...


def shapes(degree: int, points: np.ndarray) -> np.ndarray:
    """(q, 3, (k + 1)^2): values and slopes along S and v of the nodes' functions at points (q, 2) of the unit square.

    Nodes along S outside, across inside.
    """
    (s, ds), (v, dv) = ((lagrange.values(degree, x), lagrange.slopes(degree, x)) for x in (points[:, 0], points[:, 1]))
    products = [np.einsum("qi,qj->qij", a, b).reshape(len(points), -1) for a, b in ((s, v), (ds, v), (s, dv))]
    return np.ascontiguousarray(np.stack(products, axis=1))


class Cells:
    """Elements of a model (cells in its order): nodes (c, (k + 1)^2) of each, and the two rules."""

    def __init__(self, model: Discrete):
        grid, k = model.grid, model.grid.degree
        order = grid.order(model.nodes)
        self.along = np.searchsorted(grid.s_knots, model.midpoints[:, 0]) - 1
        self.across = np.searchsorted(grid.v_knots, model.midpoints[:, 1]) - 1
        near = np.arange(k + 1)
        rows, columns = k * self.along[:, None] + near, k * self.across[:, None] + near
        self.nodes = order[rows[:, :, None], columns[:, None, :]].reshape(len(rows), -1)
        self.count, self.degree, self.elements = len(model.nodes), k, grid.elements
        self.alpha, self.law = model.alpha, model.stiffness
        self.rules: list[Rule] = []
        for degree, scale, weights in zip(model.degrees, model.scales, model.weights, strict=True):
            points, _ = api.gauss_rule(degree)
            slopes = scale[..., :2] / model.sizes[:, None]
            over = np.ascontiguousarray(weights / model.body.normaliser)
            self.rules.append((shapes(k, points), np.ascontiguousarray(slopes), over))

        self._all = [
            np.concatenate(pair, axis=k) for k, pair in zip((0, 1, 1), zip(*self.rules, strict=True), strict=True)
        ]

    def strains(self, state: np.ndarray, step: np.ndarray | None, own: float = 0.5) -> list[np.ndarray]:
        """As `Forms.strains`: own T(u, u) + T(u, step)."""
        found, step = [], np.zeros_like(state) if step is None else step
        for first, (shape, slopes, weights) in zip((0, 3), self.rules, strict=True):
            out = np.empty((*weights.shape, 8 - first))
            element.strains(state, step, own, self.nodes, shape, slopes, first, out)
            found.append(out)
        return found

    def internal(self, state: np.ndarray, full: np.ndarray, reduced: np.ndarray) -> np.ndarray:
        """As `Forms.internal`."""
        out = np.zeros_like(state)
        for first, stress, (shape, slopes, weights) in zip((0, 3), (full, reduced), self.rules, strict=True):
            element.forces(state, stress, self.nodes, shape, slopes, weights, first, out)
        return out

    def areas(self) -> np.ndarray:
        """As `Forms.areas`."""
        out = np.zeros(self.count)
        shape, _, weights = self.rules[0]
        np.add.at(out, self.nodes, weights @ shape[:, 0])
        return out

    def numbers(self, active: np.ndarray, owners: np.ndarray | None = None) -> np.ndarray:
        """(c, 5 n) number of each element's unknowns, increment outside, node inside, -1: held; active (nodes, 5).

        owners (nodes,): the node whose unknowns a node has; None: its own.
        """
        number = np.where(active, np.cumsum(active.ravel()).reshape(active.shape) - 1, -1).astype(np.int64)
        number = number if owners is None else number[owners]
        return np.ascontiguousarray(np.swapaxes(number[self.nodes], 1, 2)).reshape(len(self.nodes), -1)

    def pattern(self, active: np.ndarray, owners: np.ndarray | None = None) -> Pattern:
        """Compressed rows (indptr, indices) over the unknowns, as `numbers` has them."""
        number = np.where(active, np.cumsum(active.ravel()).reshape(active.shape) - 1, -1).astype(np.int64)
        nodes = self.nodes if owners is None else owners[self.nodes]
        cells = np.repeat(np.arange(len(nodes)), nodes.shape[1])
        shape = (len(self.nodes), self.count)
        own = sparse.csr_matrix((np.ones(len(cells), np.int32), (cells, nodes.ravel())), shape=shape)
        joined = (own.T @ own).tocsr()
        joined.sort_indices()
        found: Pattern = element.rows(joined.indptr, joined.indices, number)
        return found

    def stresses(self, full: np.ndarray, reduced: np.ndarray) -> np.ndarray:
        """(c, q, 8) at the points of both rules, the full ones first."""
        points = full.shape[1]
        stress = np.zeros((len(full), points + reduced.shape[1], 8))
        stress[:, :points], stress[:, points:, 3:] = full, reduced
        return stress

    def tangents(self, state: np.ndarray, stress: np.ndarray, bases: np.ndarray, some: np.ndarray) -> np.ndarray:
        """P^T K P of the elements `some` (m,): (m, 5 n, 5 n) as in `numbers`; stress (c, q, 8), bases (nodes, 3, 2)."""
        n = 5 * self.nodes.shape[1]
        out = np.empty((len(some), n, n))
        shapes, slopes, weights = self._all
        points = len(self.rules[0][0])
        element.tangents(
            state, bases, some, self.nodes, shapes, slopes, weights, stress, points, self.alpha, self.law, out
        )
        return out
