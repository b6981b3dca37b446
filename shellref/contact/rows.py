"""Places of a shell that a wall may push: nodes of its middle surface, or of both faces, with their gaps. NumPy, SciPy.

The gap of node i from wall k, whose plane is at <x, n_k> = o_k + q_k (q_k: of a pressure plate, its way), is

    g = n_k . (phi_i + sigma (h/2) d_i) - o_k - q_k ,   sigma = 0 (middle surface) or +1 and -1 (faces)

(docs/theory.md, eq. (7.26)). It is linear in (phi, d): its row b = (n_k, sigma (h/2) n_k) is fixed. Second derivatives
come from the director's sphere alone and are in the constraint curvature, for the force dE/du - b lambda.

Nodes have Lagrange's functions of positive integral (Gauss-Lobatto weights), so that lambda_i >= 0 is a pressure of
lambda_i over the node's area. Nodes that supports hold altogether are no places: a wall does not move them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from shellref.contact.walls import FACES, WallPath

#: Part of a row that is left on the free increments, below which supports hold its node in the wall's direction.
HELD = 1e-9


@dataclass(frozen=True)
class Rows:
    """Every place that may touch, (m,) each: its node, its wall, its side sigma; lever: h / 2."""

    nodes: np.ndarray
    walls: np.ndarray
    sides: np.ndarray
    lever: float
    path: WallPath

    @classmethod
    def of(cls, path: WallPath, places: np.ndarray, thickness: float) -> Rows:
        """places: nodes that may touch."""
        sides = (1.0, -1.0) if path.surface == FACES else (0.0,)
        kinds = [(k, side) for k in range(len(path.normals)) for side in sides]
        return cls(
            np.tile(places, len(kinds)),
            np.repeat([k for k, _ in kinds], len(places)).astype(int),
            np.repeat([side for _, side in kinds], len(places)).astype(float),
            0.5 * thickness,
            path,
        )

    def __len__(self) -> int:
        return len(self.nodes)

    @property
    def normals(self) -> np.ndarray:
        """(m, 3)."""
        return np.asarray(self.path.normals[self.walls])

    def points(self, state: np.ndarray) -> np.ndarray:
        """Where the places are (m, 3), of a state (n, 6)."""
        at = state[self.nodes]
        return np.asarray(at[:, :3] + (self.lever * self.sides)[:, None] * at[:, 3:])

    def gaps(self, state: np.ndarray, offsets: np.ndarray, heights: np.ndarray) -> np.ndarray:
        """(m,); offsets, heights (walls,): where the walls are at rest, and the ways of plates (0 of rigid ones)."""
        wall = (offsets + heights)[self.walls]
        return np.asarray(np.einsum("mi,mi->m", self.points(state), self.normals) - wall)

    def applied(self, field: np.ndarray) -> np.ndarray:
        """b . field (m,), of nodal increments (n, 6)."""
        return np.asarray(np.einsum("mi,mi->m", self.points(field), self.normals))

    def forces(self, pushes: np.ndarray, n: int) -> np.ndarray:
        """sum of b lambda (n, 6), what the walls exert with pushes (m,) on the nodes."""
        out = np.zeros((n, 6))
        force = pushes[:, None] * self.normals
        np.add.at(out[:, :3], self.nodes, force)
        np.add.at(out[:, 3:], self.nodes, (self.lever * self.sides)[:, None] * force)
        return out

    def matrix(self, some: np.ndarray, n: int) -> Any:
        """The rows `some` (numbers, k) over all components (k, 6 n), scipy.sparse."""
        normals, lever = self.normals[some], (self.lever * self.sides[some])[:, None]
        values = np.hstack([normals, lever * normals]).ravel()
        columns = (6 * self.nodes[some][:, None] + np.arange(6)).ravel()
        return csr_matrix((values, columns, 6 * np.arange(len(some) + 1)), shape=(len(some), 6 * n))


def movable(rows: Rows, projection: Any) -> np.ndarray:
    """Mask (m,) of the rows that some free increment moves; projection (6 n, unknowns): P, scipy.sparse."""
    reduced = rows.matrix(np.arange(len(rows)), projection.shape[0] // 6) @ projection
    size = np.sqrt(np.asarray(reduced.multiply(reduced).sum(axis=1)).ravel())
    return np.asarray(size > HELD)


def independent(matrix: Any, own: int) -> np.ndarray:
    """Mask (k,) of rows (k, unknowns) to keep where several act on the same few unknowns, those from `own` on (of an
    edge that moves as a whole): a set that is not linearly dependent, the earlier rows first."""
    rest = np.asarray(matrix[:, own:].todense())
    shared = np.flatnonzero(np.any(rest != 0.0, axis=1))
    keep = np.ones(matrix.shape[0], dtype=bool)
    basis = np.zeros((0, rest.shape[1]))
    for row in shared:
        if matrix[row, :own].nnz:
            continue
        left = rest[row] - basis.T @ (basis @ rest[row])
        left = left - basis.T @ (basis @ left)
        size = float(np.linalg.norm(left))
        if size <= 1e-9 * float(np.linalg.norm(rest[row])):
            keep[row] = False
        else:
            basis = np.vstack([basis, left / size])
    return keep
