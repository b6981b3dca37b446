"""Places of a shell that something may push: nodes of its middle surface, or of both faces, with their gaps. NumPy,
SciPy.

The gap of node i from wall k, whose plane is at <x, n_k> = o_k + q_k (q_k: of a pressure plate, its way), is

    g = n_k . (phi_i + sigma (h/2) d_i) - o_k - q_k ,   sigma = 0 (middle surface) or +1 and -1 (faces)

(docs/theory.md, eq. (7.26)). It is linear in (phi, d): its row b = (n_k, sigma (h/2) n_k) is fixed. Second derivatives
come from the director's sphere alone and are in the constraint curvature, for the force dE/du - b lambda.

Of a body (shellref.contact.obstacles) g is its signed distance at the same place: the row is that of its normal there,
and its second derivative H gives the tangent - lambda [[H, s H], [s H, s^2 H]] on (phi_i, d_i), s = sigma h / 2.

Nodes have Lagrange's functions of positive integral (Gauss-Lobatto weights), so that lambda_i >= 0 is a pressure of
lambda_i over the node's area. Nodes that supports hold altogether are no places: nothing moves them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol, Self

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, vstack

from shellref.contact.obstacles import GapFunction
from shellref.contact.walls import FACES, Standing, WallPath

#: Part of a row that is left on the free increments, below which supports hold its node in the wall's direction.
HELD = 1e-9
#: Places on the way of a node at which bodies are looked for.
STOPS = 17
#: Parts of one thing that a node may touch.
MOST_PARTS = 4096

#: Rows, columns and values of entries of a matrix.
Entries = tuple[np.ndarray, np.ndarray, np.ndarray]


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

    def passed(self, before: np.ndarray, after: np.ndarray) -> bool:
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
class NodeRows:
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
    def normals(self) -> np.ndarray:
        """(m, 3)."""
        raise NotImplementedError

    def passed(self, before: np.ndarray, after: np.ndarray) -> bool:
        """Nothing goes through a plane: what is behind it is pushed back."""
        return False

    def crossing(self, state: np.ndarray) -> None:
        """Of the strip itself."""

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


@dataclass(frozen=True)
class BodyRows(NodeRows):
    """Every place that may touch a body; parts (m,): of its gap functions, see `Obstacle.parts`; toward (m, 3), bends
    (m, 3, 3): gradients and second derivatives of the gaps at the state last seen."""

    parts: np.ndarray
    functions: tuple[GapFunction, ...]
    toward: np.ndarray
    bends: np.ndarray
    centres: np.ndarray

    @classmethod
    def of(cls, path: WallPath, places: np.ndarray, thickness: float) -> BodyRows:
        """places: nodes that may touch."""
        sides = (1.0, -1.0) if path.surface == FACES else (0.0,)
        functions = [(len(path.normals) + k, part) for k, body in enumerate(path.bodies) for part in body.parts()]
        kinds = [(k, part, side) for part, (k, _) in enumerate(functions) for side in sides]
        walls, parts, side = (np.repeat([kind[i] for kind in kinds], len(places)) for i in range(3))
        m = len(walls)
        return cls(
            np.tile(places, len(kinds)), walls.astype(int), side.astype(float), 0.5 * thickness, path,
            parts.astype(int), tuple(part for _, part in functions), np.zeros((m, 3)), np.zeros((m, 3, 3)),
            np.array([body.point for body in path.bodies]),
        )  # fmt: skip

    def chosen(self, mask: np.ndarray) -> BodyRows:
        """Those of a mask (m,)."""
        found = super().chosen(mask)
        return replace(found, parts=self.parts[mask], toward=self.toward[mask], bends=self.bends[mask])

    @property
    def normals(self) -> np.ndarray:
        """(m, 3)."""
        return self.toward

    def at(self, state: np.ndarray, standing: Standing) -> tuple[BodyRows, None]:
        """The same places with their derivatives at a state."""
        _, toward, bends = self._seen(state, standing)
        return replace(self, toward=toward, bends=bends, centres=standing.centres), None

    def passed(self, before: np.ndarray, after: np.ndarray) -> bool:
        """Whether a place went through a body from one state (n, 6) to the next, each straight on: from its outside to
        its outside, within its `Obstacle.heart` on the way."""
        ways = before[:, :3] + np.linspace(0.0, 1.0, STOPS)[:, None, None] * (after - before)[:, :3]
        for body, centre in zip(self.path.bodies, self.centres, strict=True):
            if body.heart is None:
                continue
            gaps = body.gaps(ways.reshape(-1, 3), centre).reshape(STOPS, -1)
            if np.any((gaps.min(axis=0) < -body.heart) & (np.minimum(gaps[0], gaps[-1]) > -0.5 * body.heart)):
                return True
        return False

    def _seen(self, state: np.ndarray, standing: Standing) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        points = self.points(state) - standing.centres[self.walls - len(self.path.normals)]
        value, toward, bends = np.zeros(len(self)), np.zeros((len(self), 3)), np.zeros((len(self), 3, 3))
        for k, function in enumerate(self.functions):
            own = self.parts == k
            value[own], toward[own], bends[own] = function(points[own])
        return value, toward, bends

    def gaps(self, state: np.ndarray, standing: Standing, heights: np.ndarray) -> np.ndarray:
        """(m,)."""
        return self._seen(state, standing)[0]

    def rates(self, rate: Standing) -> np.ndarray:
        """(m,)."""
        moved = rate.centres[self.walls - len(self.path.normals)]
        return np.asarray(np.einsum("mi,mi->m", self.toward, moved))

    def curvature(self, pushes: np.ndarray, n: int) -> Entries | None:
        """Of those that push."""
        some = np.flatnonzero(pushes)
        if not len(some):
            return None
        lever = self.lever * self.sides[some]
        weights = np.stack([np.ones_like(lever), lever], axis=1)
        blocks = np.einsum("m,ma,mb,mij->maibj", pushes[some], weights, weights, self.bends[some])
        at = 6 * self.nodes[some][:, None] + np.arange(6)
        shape = (len(some), 6, 6)
        rows, columns = np.broadcast_to(at[:, :, None], shape), np.broadcast_to(at[:, None, :], shape)
        return rows.ravel(), columns.ravel(), blocks.reshape(shape).ravel()


class Touching:
    """All places of a shell, of blocks one after the other: (m,) their nodes, what they touch, their sides, and two
    numbers that tell them from each other, `keys` (both faces of a node have one) and `labels`."""

    def __init__(self, blocks: tuple[Block, ...], lever: float):
        """lever: h / 2."""
        self.blocks, self.lever = blocks, lever
        self.nodes, self.walls, self.sides, parts = (
            np.concatenate([getattr(block, name) for block in blocks]) for name in ("nodes", "walls", "sides", "parts")
        )
        self.keys = (self.nodes.astype(np.int64) * MOST_PARTS + parts) * (
            int(self.walls.max(initial=0)) + 1
        ) + self.walls
        self.labels = 3 * self.keys + self.sides.astype(np.int64) + 1
        self._ends = np.cumsum([0] + [len(block.nodes) for block in blocks])

    def __len__(self) -> int:
        return len(self.nodes)

    @property
    def normals(self) -> np.ndarray:
        """(m, 3)."""
        return np.concatenate([block.normals for block in self.blocks])

    def at(self, state: np.ndarray, standing: Standing) -> tuple[Touching, np.ndarray | None]:
        """The places with their gradients at a state, and which of these each is (m,), -1 none; None: the same."""
        found = [block.at(state, standing) for block in self.blocks]
        if all(one is block for (one, _), block in zip(found, self.blocks, strict=True)):
            return self, None
        new = Touching(tuple(block for block, _ in found), self.lever)
        if all(old is None for _, old in found):
            return new, None
        before = [
            np.arange(len(one.nodes)) + first if old is None else np.where(old < 0, -1, old + first)
            for one, (_, old), first in zip(self.blocks, found, self._ends, strict=False)
        ]
        return new, np.concatenate(before)

    def passed(self, before: np.ndarray, after: np.ndarray) -> bool:
        """Whether from one state (n, 6) to the next the strip went through a body, or parts of it each other."""
        return any(block.passed(before, after) for block in self.blocks)

    def crossing(self, state: np.ndarray) -> tuple[float, float] | None:
        """S of a place where a state crosses itself, and S of the other part there; None: it does not, or may."""
        found = (block.crossing(state) for block in self.blocks)
        return next((place for place in found if place is not None), None)

    def _joined(self, name: str, *given: Any) -> np.ndarray:
        return np.concatenate([getattr(block, name)(*given) for block in self.blocks])

    def _split(self, values: np.ndarray) -> list[np.ndarray]:
        return np.split(values, self._ends[1:-1])

    def points(self, state: np.ndarray) -> np.ndarray:
        """Where the places are (m, 3), of a state (n, 6)."""
        return self._joined("points", state)

    def gaps(self, state: np.ndarray, standing: Standing, heights: np.ndarray) -> np.ndarray:
        """(m,)."""
        return self._joined("gaps", state, standing, heights)

    def applied(self, field: np.ndarray) -> np.ndarray:
        """b . field (m,), of nodal increments (n, 6)."""
        return self._joined("applied", field)

    def rates(self, rate: Standing) -> np.ndarray:
        """By what (m,) gaps fall while what is touched moves at a rate."""
        return self._joined("rates", rate)

    def forces(self, pushes: np.ndarray, n: int) -> np.ndarray:
        """sum of b lambda (n, 6)."""
        parts = [block.forces(own, n) for block, own in zip(self.blocks, self._split(pushes), strict=True)]
        return np.asarray(sum(parts, np.zeros((n, 6))))

    def matrix(self, some: np.ndarray, n: int) -> Any:
        """The rows `some` (numbers, ascending) over all components (k, 6 n), scipy.sparse."""
        parts = [
            block.matrix(some[(some >= first) & (some < last)] - first, n)
            for block, first, last in zip(self.blocks, self._ends, self._ends[1:], strict=False)
        ]
        return vstack(parts, format="csr") if len(parts) > 1 else parts[0]

    def curvature(self, pushes: np.ndarray, n: int) -> Any:
        """Sum of lambda times the gaps' second derivatives (6 n, 6 n), scipy.sparse; None: it vanishes."""
        found = [block.curvature(own, n) for block, own in zip(self.blocks, self._split(pushes), strict=True)]
        entries = [one for one in found if one is not None]
        if not entries:
            return None
        rows, columns, values = (np.concatenate([one[k] for one in entries]) for k in range(3))
        return coo_matrix((values, (rows, columns)), shape=(6 * n, 6 * n)).tocsr()


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
