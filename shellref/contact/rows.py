"""Places of a shell that something may push: nodes of its middle surface, or of both faces, with their gaps. NumPy,
SciPy.

The gap of node i from wall k, whose plane is at <x, n_k> = o_k + q_k (q_k: of a pressure plate, its way), is

    g = n_k . (phi_i + sigma (h/2) d_i) - o_k - q_k ,   sigma = 0 (middle surface) or +1 and -1 (faces)

(docs/theory.md, eq. (7.26)). It is linear in (phi, d): its row b = (n_k, sigma (h/2) n_k) is fixed. Second derivatives
come from the director's sphere alone and are in the constraint curvature, for the force dE/du - b lambda.

Nodes have Lagrange's functions of positive integral (Gauss-Lobatto weights), so that lambda_i >= 0 is a pressure of
lambda_i over the node's area. Nodes that supports hold altogether are no places: nothing moves them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any, Protocol, Self

import numpy as np
from scipy.sparse import csr_matrix

from shellref.contact.walls import FACES, Standing, WallPath

#: Part of a row that is left on the free increments, below which supports hold its node in the wall's direction.
HELD = 1e-9
#: Parts of one thing that a node may touch.
MOST_PARTS = 4096

#: Rows, columns and values of entries of a matrix.
Entries = tuple[np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Gradients:
    """Rows of gaps by the entries of nodal fields (n, 6) that each has: values (m, c) and columns (m, c), 6 times the
    node and the component; a column may stand twice in a row, and counts twice."""

    values: np.ndarray
    columns: np.ndarray

    def applied(self, fields: np.ndarray) -> np.ndarray:
        """b . field (m,), of nodal increments (n, 6)."""
        return np.asarray(np.sum(self.values * fields.ravel()[self.columns], axis=1))

    def forces(self, pushes: np.ndarray, n: int) -> np.ndarray:
        """sum of b lambda (n, 6) of pushes (m,)."""
        weights = (pushes[:, None] * self.values).ravel()
        return np.bincount(self.columns.ravel(), weights, 6 * n).reshape(n, 6)

    def matrix(self, some: np.ndarray, n: int) -> Any:
        """The rows `some`, (k, 6 n)."""
        values, columns = self.values[some], self.columns[some]
        count = values.shape[1] if len(some) else 0
        found = csr_matrix(
            (values.ravel(), columns.ravel(), count * np.arange(len(some) + 1)), shape=(len(some), 6 * n)
        )
        found.sum_duplicates()
        return found

    def entries(self, some: np.ndarray, blocks: np.ndarray) -> Entries:
        """Those of second derivatives (k, c, c) of the rows `some`, without zeros."""
        columns, shape = self.columns[some], blocks.shape
        rows = np.broadcast_to(columns[:, :, None], shape).ravel()
        across = np.broadcast_to(columns[:, None, :], shape).ravel()
        values = blocks.ravel()
        there = values != 0.0
        return rows[there], across[there], values[there]


class Block(Protocol):
    """Places of one kind, (m,) each: node, number of what is touched (walls, then bodies, then the strip itself), side
    sigma, and which part of that it is, 0 to `MOST_PARTS` - 1. Gradients are those of the state last seen (`at`)."""

    @property
    def nodes(self) -> np.ndarray:
        """(m,)."""
        ...

    @property
    def walls(self) -> np.ndarray:
        """(m,)."""
        ...

    @property
    def sides(self) -> np.ndarray:
        """(m,)."""
        ...

    @property
    def parts(self) -> np.ndarray:
        """(m,)."""
        ...

    @property
    def normals(self) -> np.ndarray:
        """(m, 3) directions of the pushes."""
        ...

    def at(self, state: np.ndarray, standing: Standing) -> tuple[Block, np.ndarray | None]:
        """The block at a state (n, 6), and which place of this one each of its is (m,), -1 none; None: the same."""
        ...

    def points(self, state: np.ndarray) -> np.ndarray:
        """Where the places are (m, 3)."""
        ...

    def passed(self, before: np.ndarray, after: np.ndarray, standing: tuple[Standing, Standing]) -> bool:
        """Whether something went through from one state (n, 6) to the next."""
        ...

    def crossing(self, state: np.ndarray) -> tuple[float, float] | None:
        """S of both parts where a state crosses itself; None: it does not, or this is of something else."""
        ...

    def gaps(self, state: np.ndarray, standing: Standing, heights: np.ndarray) -> np.ndarray:
        """(m,); heights: ways of plates (0 of what is rigid)."""
        ...

    def applied(self, field: np.ndarray) -> np.ndarray:
        """b . field (m,), of nodal increments (n, 6)."""
        ...

    def rates(self, rate: Standing) -> np.ndarray:
        """By what (m,) gaps fall while what is touched moves at a rate."""
        ...

    def forces(self, pushes: np.ndarray, n: int) -> np.ndarray:
        """sum of b lambda (n, 6)."""
        ...

    def matrix(self, some: np.ndarray, n: int) -> Any:
        """The rows `some` (numbers, k) over all components (k, 6 n), scipy.sparse."""
        ...

    def curvature(self, pushes: np.ndarray, n: int) -> Entries | None:
        """Entries of sum of lambda times the gap's second derivative (6 n, 6 n); None: it vanishes."""
        ...


@dataclass(frozen=True)
class NodeRows(ABC):
    """Places at nodes, (m,) each: node, what is touched, side; lever: h / 2."""

    nodes: np.ndarray
    walls: np.ndarray
    sides: np.ndarray
    lever: float
    path: WallPath

    def __len__(self) -> int:
        return len(self.nodes)

    def kept(self, projection: Any) -> Self:
        """Without the nodes whose position no free increment moves; projection (6 n, unknowns): P, scipy.sparse."""
        size = np.asarray(abs(projection).sum(axis=1)).reshape(-1, 6)[:, :3].max(axis=1)
        return self.chosen(size[self.nodes] > HELD)

    def chosen(self, mask: np.ndarray) -> Self:
        """Those of a mask (m,)."""
        own = {name: getattr(self, name)[mask] for name in ("nodes", "walls", "sides")}
        return replace(self, **own)

    @property
    @abstractmethod
    def normals(self) -> np.ndarray:
        """Unit normals (m, 3) along which the places are pushed."""

    def passed(self, before: np.ndarray, after: np.ndarray, standing: tuple[Standing, Standing]) -> bool:
        """Nothing goes through a plane: what is behind it is pushed back."""
        return False

    def crossing(self, state: np.ndarray) -> None:
        """None: where the strip goes through itself is not asked of what it meets."""
        return None

    def points(self, state: np.ndarray) -> np.ndarray:
        """Where the places are (m, 3), of a state (n, 6)."""
        at = state[self.nodes]
        return np.asarray(at[:, :3] + (self.lever * self.sides)[:, None] * at[:, 3:])

    def applied(self, field: np.ndarray) -> np.ndarray:
        """b . field (m,), of nodal increments (n, 6)."""
        return np.asarray(np.einsum("mi,mi->m", self.points(field), self.normals))

    def forces(self, pushes: np.ndarray, n: int) -> np.ndarray:
        """sum of b lambda (n, 6), what is exerted with pushes (m,) on the nodes."""
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


@dataclass(frozen=True)
class Rows(NodeRows):
    """Every place that may touch a wall."""

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

    def kept(self, projection: Any) -> Rows:
        """Without the rows that no free increment moves."""
        reduced = self.matrix(np.arange(len(self)), projection.shape[0] // 6) @ projection
        return self.chosen(lengths(reduced) > HELD)

    @property
    def parts(self) -> np.ndarray:
        """(m,)."""
        return np.zeros_like(self.nodes)

    @property
    def normals(self) -> np.ndarray:
        """(m, 3)."""
        return np.asarray(self.path.normals[self.walls])

    def at(self, state: np.ndarray, standing: Standing) -> tuple[Rows, None]:
        """These: nothing of them changes with the state."""
        return self, None

    def gaps(self, state: np.ndarray, standing: Standing, heights: np.ndarray) -> np.ndarray:
        """(m,)."""
        wall = (standing.offsets + heights[: len(standing.offsets)])[self.walls]
        return np.asarray(np.einsum("mi,mi->m", self.points(state), self.normals) - wall)

    def rates(self, rate: Standing) -> np.ndarray:
        """(m,)."""
        return np.asarray(rate.offsets[self.walls])

    def curvature(self, pushes: np.ndarray, n: int) -> None:
        """A plane has none."""


def lengths(rows: Any) -> np.ndarray:
    """2-norms (k,) of the rows of a matrix of scipy.sparse."""
    return np.sqrt(np.asarray(rows.multiply(rows).sum(axis=1)).ravel())


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
