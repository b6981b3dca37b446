"""Unit directors at the nodes: tangent bases, the projection P from 6 components to the free increments, the update.

A node carries (phi, d), six components with |d| = 1. Its admissible increments are three translations and two
components in the plane normal to d; supports take some of the five away. For the energy E(phi, d) the Riemannian
Hessian on the sphere is

    P^T (E'' - (d . dE/dd) I_d) P ,   I_d: identity on the director components only

(Absil, Mahony & Sepulchre 2008, section 5.5, embedded submanifold; docs/theory.md, eq. (7.9)). There is no singular
rotation. A director that
stays normal to an axis e (a symmetry plane, a hinge) moves on a circle: its one increment is along e x d.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from shellref.seam.ties import Tie
from shellref.shell.clamps import Control

FREE, HELD = -1, 3  # values of `Increments.directors`; 0, 1, 2: the director stays normal to that axis


def tangent_bases(directors: np.ndarray) -> np.ndarray:
    """Two orthonormal vectors normal to each unit director: (n, 3) -> (n, 3, 2).

    Householder reflection that sends e_k to -+d, with k the largest component: its other two columns.
    """
    n = len(directors)
    rows = np.arange(n)
    k = np.argmax(np.abs(directors), axis=1)
    sign = np.where(directors[rows, k] < 0, -1.0, 1.0)
    u = directors.copy()
    u[rows, k] += sign
    h = np.eye(3) - 2.0 * u[:, :, None] * u[:, None, :] / np.einsum("ni,ni->n", u, u)[:, None, None]
    columns = np.stack([(k + 1) % 3, (k + 2) % 3], axis=1)
    return np.stack([h[rows, :, columns[:, 0]], h[rows, :, columns[:, 1]]], axis=2)


class Edge(Protocol):
    """The nodes of a held edge, which move by `unknowns` numbers and by its clamp.

    nodes (m,): their numbers. columns (m, c): which of the edge's unknowns moves a node, -1 for none.
    """

    @property
    def name(self) -> str:
        """Of its clamp, "start" or "end"."""
        ...

    @property
    def nodes(self) -> np.ndarray:
        """(m,)."""
        ...

    @property
    def columns(self) -> np.ndarray:
        """(m, c)."""
        ...

    @property
    def unknowns(self) -> int:
        """How many."""
        ...

    def placed(self, state: np.ndarray, control: Control) -> np.ndarray:
        """The admissible state (m, 6) nearest to that of all nodes (n, 6), for the clamp at `control`."""
        ...

    def tangents(self, state: np.ndarray, control: Control) -> np.ndarray:
        """(m, 6, c): derivative of the nodes by the unknowns in `columns`."""
        ...

    def curvature(self, state: np.ndarray, force: np.ndarray, control: Control) -> np.ndarray:
        """(unknowns,): second derivative of the nodes by each unknown, times the force (n, 6)."""
        ...

    def coupling(self, state: np.ndarray, force: np.ndarray, control: Control) -> np.ndarray | None:
        """(unknowns, unknowns): the mixed second derivatives, times the force (n, 6); None: they vanish."""
        ...

    def masses(self, translation: np.ndarray, turn: np.ndarray, state: np.ndarray) -> np.ndarray:
        """(unknowns,): inertia of each unknown from that of the nodes (n,), at a state (n, 6)."""
        ...

    def point(self, state: np.ndarray) -> np.ndarray:
        """The held point (3,)."""
        ...


class Bases(NamedTuple):
    """Tangent vectors at a state: of the directors (n, 3, 2), and of the nodes of every edge (m, 6, c)."""

    directors: np.ndarray
    edges: tuple[np.ndarray, ...] = ()


class Increments:
    """The admissible increments of nodes: which of the five are free, and P in compressed rows.

    translations (n, 3): True where a component of the position is held. directors (n,): FREE, HELD, or the axis (0, 1,
    2) to which the director stays normal. `owned`: number of the first nodes, whose increments are unknowns here.
    edges: whose nodes, held in `translations` and `directors`, move by unknowns of their own, the last ones. tie: nodes
    whose unknowns are those of others that this process owns too (no edges).
    """

    def __init__(
        self,
        translations: np.ndarray,
        directors: np.ndarray,
        owned: int | None = None,
        edges: Sequence[Edge] = (),
        tie: Tie | None = None,
    ):
        n = len(translations)
        self.edges, self.tie = tuple(edges), tie
        self.nodes, self.owned = n, n if owned is None else owned
        self.translations, self.directors = translations, directors
        self.active = np.concatenate(
            [~translations, (directors != HELD)[:, None], (directors == FREE)[:, None]], axis=1
        )
        self.active[self.owned :] = False
        if tie is not None:
            self.active[tie.nodes] = False
        self._own = int(self.active.sum())
        self._first = self._own + np.cumsum([0] + [edge.unknowns for edge in self.edges])  # unknown of each edge
        self.unknowns = int(self._first[-1])
        self.held = np.concatenate([translations, np.repeat((directors == HELD)[:, None], 3, axis=1)], axis=1)
        self._axes = [(axis, np.flatnonzero(directors == axis)) for axis in (0, 1, 2)]
        self._structure()

    def _structure(self) -> None:
        """Pattern of P: for each entry its column and where its value comes from (0: one; then the directors' bases,
        then the edges' tangents).
        """
        n = self.owned
        number = self.numbers()[:n]
        active = number >= 0
        row, column, source = [], [], []
        for c in range(3):
            at = np.flatnonzero(active[:, c])
            row.append(6 * at + c)
            column.append(number[at, c])
            source.append(np.zeros(len(at), dtype=np.int64))
            for k in (0, 1):
                at = np.flatnonzero(active[:, 3 + k])
                row.append(6 * at + 3 + c)
                column.append(number[at, 3 + k])
                source.append(1 + (at * 3 + c) * 2 + k)
        place = 1 + 6 * n
        for first, edge in zip(self._first, self.edges, strict=False):
            shape = (len(edge.nodes), 6, edge.columns.shape[1])
            columns = np.broadcast_to(edge.columns[:, None, :], shape)
            there = columns.ravel() >= 0
            rows = np.broadcast_to((6 * edge.nodes[:, None] + np.arange(6))[:, :, None], shape)
            row.append(rows.ravel()[there])
            column.append(first + columns.ravel()[there])
            source.append((place + np.arange(columns.size))[there])
            place += columns.size
        rows, columns, sources = (np.concatenate(x) for x in (row, column, source))
        order = np.lexsort((columns, rows))
        self._indptr = np.searchsorted(rows[order], np.arange(6 * n + 1)).astype(np.int32)
        self._columns, self._source = columns[order].astype(np.int32), sources[order]

    @property
    def owners(self) -> np.ndarray | None:
        """(n,) the node whose unknowns each node has; None: its own."""
        return None if self.tie is None else self.tie.owners(self.nodes)

    def numbers(self) -> np.ndarray:
        """(n, 5) which unknown each increment of a node is, -1: none."""
        number = np.where(self.active, np.cumsum(self.active.ravel()).reshape(self.active.shape) - 1, -1)
        return number if self.tie is None else number[self.tie.owners(self.nodes)]

    def bases(self, state: np.ndarray, control: Control) -> Bases:
        """The directions in which a state (n, 6) may move, clamps where `control` has them; the second one of a
        director is unused on an axis.
        """
        directors = state[:, 3:]
        bases = tangent_bases(directors)
        for axis, at in self._axes:
            if len(at):
                bases[at, :, 0] = np.cross(np.eye(3)[axis], directors[at])
        if self.tie is not None:
            bases[self.tie.nodes] = self.tie.sign * bases[self.tie.partners]
        return Bases(bases, self.edge_tangents(state, control))

    def edge_tangents(self, state: np.ndarray, control: Control) -> tuple[np.ndarray, ...]:
        """Those of the edges (m, 6, c)."""
        return tuple(edge.tangents(state, control) for edge in self.edges)

    def projection(self, bases: Bases, offset: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """P as (indptr, indices, values) of the owned rows, shape (6 owned, unknowns); columns start at `offset`."""
        parts = [np.ones(1), bases.directors[: self.owned].ravel(), *(edge.ravel() for edge in bases.edges)]
        return self._indptr, self._columns + np.int32(offset), np.concatenate(parts)[self._source]

    def reduce(self, full: np.ndarray, bases: Bases) -> np.ndarray:
        """P^T f: nodal 6-vectors (n, 6) -> (unknowns,)."""
        rotations = np.einsum("nik,ni->nk", bases.directors, full[:, 3:])
        own = self._joined(np.concatenate([full[:, :3], rotations], axis=1))[self.active]
        if not self.edges:
            return own
        out = np.append(own, np.zeros(self.unknowns - self._own))
        for first, edge, tangents in zip(self._first, self.edges, bases.edges, strict=False):
            there = edge.columns >= 0
            np.add.at(out, first + edge.columns[there], np.einsum("mic,mi->mc", tangents, full[edge.nodes])[there])
        return out

    def expand(self, reduced: np.ndarray, bases: Bases) -> np.ndarray:
        """P q: (unknowns,) -> nodal 6-vectors (n, 6), zero where nothing is free and on ghosts."""
        five = np.zeros((self.nodes, 5))
        five[self.active] = reduced[: self._own]
        if self.tie is not None:
            five[self.tie.nodes] = five[self.tie.partners]
        out = np.concatenate([five[:, :3], np.einsum("nik,nk->ni", bases.directors, five[:, 3:])], axis=1)
        for first, edge, tangents in zip(self._first, self.edges, bases.edges, strict=False):
            q = np.where(edge.columns >= 0, np.append(reduced, 0.0)[first + edge.columns], 0.0)
            out[edge.nodes] = np.einsum("mic,mc->mi", tangents, q)
        return out

    def _joined(self, five: np.ndarray) -> np.ndarray:
        return five if self.tie is None else self.tie.joined(five)

    def nodal(self, translation: np.ndarray, rotation: np.ndarray, state: np.ndarray) -> np.ndarray:
        """One number per node for its positions (n,), one for its rotations (n,): (unknowns,), as inertia at a state
        (n, 6)."""
        own = self._joined(np.stack([translation] * 3 + [rotation] * 2, axis=1))[self.active]
        return np.concatenate([own, *(edge.masses(translation, rotation, state) for edge in self.edges)])

    def constraint_curvature(self, state: np.ndarray, force: np.ndarray, control: Control) -> np.ndarray:
        """-d . dE/dd on the rotations, and what edges have (unknowns,): state and force (= dE/d(phi, d)) are (n, 6)."""
        curvature = -np.einsum("ni,ni->n", state[:, 3:], force[:, 3:])
        own = self._joined(np.stack([np.zeros(self.nodes)] * 3 + [curvature] * 2, axis=1))[self.active]
        return np.concatenate([own, *(edge.curvature(state, force, control) for edge in self.edges)])

    def couplings(self, state: np.ndarray, force: np.ndarray, control: Control) -> list[tuple[int, np.ndarray]]:
        """What the edges' mixed second derivatives add to the tangent: first unknown and block of each."""
        found = [
            (int(first), edge.coupling(state, force, control))
            for first, edge in zip(self._first, self.edges, strict=False)
        ]
        return [(first, block) for first, block in found if block is not None]


def retract(state: np.ndarray, increment: np.ndarray) -> np.ndarray:
    """State plus increment (n, 6), directors brought back to unit length (docs/theory.md, eq. (7.8))."""
    new = state + increment
    new[:, 3:] /= np.linalg.norm(new[:, 3:], axis=1)[:, None]
    return new
