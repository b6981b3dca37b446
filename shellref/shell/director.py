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

import numpy as np

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


class Increments:
    """The admissible increments of nodes: which of the five are free, and P in compressed rows.

    translations (n, 3): True where a component of the position is held. directors (n,): FREE, HELD, or the axis (0, 1,
    2) to which the director stays normal. `owned`: number of the first nodes, whose increments are unknowns here.
    together (n,): nodes that translate as one, which are three more unknowns, the last ones.
    """

    def __init__(
        self,
        translations: np.ndarray,
        directors: np.ndarray,
        owned: int | None = None,
        together: np.ndarray | None = None,
    ):
        n = len(translations)
        self.together = np.zeros(0, dtype=int) if together is None else np.flatnonzero(together)
        self.nodes, self.owned = n, n if owned is None else owned
        self.translations, self.directors = translations, directors
        self.active = np.concatenate(
            [~translations, (directors != HELD)[:, None], (directors == FREE)[:, None]], axis=1
        )
        self.active[self.owned :] = False
        self._own = int(self.active.sum())
        self.unknowns = self._own + (3 if len(self.together) else 0)
        self.held = np.concatenate([translations, np.repeat((directors == HELD)[:, None], 3, axis=1)], axis=1)
        self._axes = [(axis, np.flatnonzero(directors == axis)) for axis in (0, 1, 2)]
        self._structure()

    def _structure(self) -> None:
        """Pattern of P: for each entry its column and where its value comes from (0: one; else 1 + place in bases)."""
        number = np.cumsum(self.active.ravel()).reshape(self.active.shape) - 1
        n = self.owned
        active, number = self.active[:n], number[:n]
        row, column, source = [], [], []
        for c in range(3):
            at = np.flatnonzero(active[:, c])
            row += [6 * at + c, 6 * self.together + c]
            column += [number[at, c], np.full(len(self.together), self._own + c)]
            source.append(np.zeros(len(at) + len(self.together), dtype=np.int64))
            for k in (0, 1):
                at = np.flatnonzero(active[:, 3 + k])
                row.append(6 * at + 3 + c)
                column.append(number[at, 3 + k])
                source.append(1 + (at * 3 + c) * 2 + k)
        rows, columns, sources = (np.concatenate(x) for x in (row, column, source))
        order = np.lexsort((columns, rows))
        self._indptr = np.searchsorted(rows[order], np.arange(6 * n + 1)).astype(np.int32)
        self._columns, self._source = columns[order].astype(np.int32), sources[order]

    def bases(self, directors: np.ndarray) -> np.ndarray:
        """(n, 3, 2): the two directions in which each director (n, 3) may move; the second is unused on an axis."""
        bases = tangent_bases(directors)
        for axis, at in self._axes:
            if len(at):
                bases[at, :, 0] = np.cross(np.eye(3)[axis], directors[at])
        return bases

    def projection(self, bases: np.ndarray, offset: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """P as (indptr, indices, values) of the owned rows, shape (6 owned, unknowns); columns start at `offset`."""
        values = np.concatenate([[1.0], bases[: self.owned].ravel()])[self._source]
        return self._indptr, self._columns + np.int32(offset), values

    def reduce(self, full: np.ndarray, bases: np.ndarray) -> np.ndarray:
        """P^T f: nodal 6-vectors (n, 6) -> (unknowns,)."""
        rotations = np.einsum("nik,ni->nk", bases, full[:, 3:])
        own = np.concatenate([full[:, :3], rotations], axis=1)[self.active]
        return np.append(own, full[self.together, :3].sum(axis=0)) if len(self.together) else own

    def expand(self, reduced: np.ndarray, bases: np.ndarray) -> np.ndarray:
        """P q: (unknowns,) -> nodal 6-vectors (n, 6), zero where nothing is free and on ghosts."""
        five = np.zeros((self.nodes, 5))
        five[self.active] = reduced[: self._own]
        if len(self.together):
            five[self.together, :3] = reduced[self._own :]
        return np.concatenate([five[:, :3], np.einsum("nik,nk->ni", bases, five[:, 3:])], axis=1)

    def nodal(self, translation: np.ndarray, rotation: np.ndarray) -> np.ndarray:
        """One number per node for its positions (n,), one for its rotations (n,): (unknowns,)."""
        own = np.stack([translation] * 3 + [rotation] * 2, axis=1)[self.active]
        return np.append(own, [translation[self.together].sum()] * 3) if len(self.together) else own

    def constraint_curvature(self, state: np.ndarray, force: np.ndarray) -> np.ndarray:
        """-d . dE/dd on the rotations (unknowns,): state and force (= dE/d(phi, d)) are (n, 6)."""
        curvature = -np.einsum("ni,ni->n", state[:, 3:], force[:, 3:])
        return self.nodal(np.zeros(self.nodes), curvature)


def retract(state: np.ndarray, increment: np.ndarray) -> np.ndarray:
    """State plus increment (n, 6), directors brought back to unit length (docs/theory.md, eq. (7.8))."""
    new = state + increment
    new[:, 3:] /= np.linalg.norm(new[:, 3:], axis=1)[:, None]
    return new
