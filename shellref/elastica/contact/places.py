r"""Places of a discrete elastica and how they move: r(s) = int_0^s t(theta), theta(s) = sum_j c_j phi_j(s).

    dr(s)/dc_j = int_0^s t_perp phi_j ,   <a, d^2 r(s)/dc_i dc_j> = - int_0^s <a, t> phi_i phi_j ,

by Gauss points on every element before s, and on what lies before s of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shellref.elastica.fem import ELEMENTS, Array, Discretisation


@dataclass(frozen=True)
class Places:
    """Abscissae s (k,), angles theta and curvatures theta' (k,), tangents, normals (turned left) and positions (k, 2);
    values phi (k, N) of the basis functions, and the derivatives dr (k, 2, N) of the positions."""

    s: Array
    theta: Array
    curvature: Array
    tangent: Array
    normal: Array
    position: Array
    phi: Array
    moves: Array


class Moving:
    """Places of one discretisation at one state c (N,)."""

    def __init__(self, discrete: Discretisation, degree: int, coefficients: Array) -> None:
        self._c, self._degree = coefficients, degree
        self._nodes, self._dofs = discrete.nodes, np.asarray(discrete.basis.element_dofs)  # (k, n)
        self._length = np.diff(discrete.nodes)
        x, w = np.polynomial.legendre.leggauss(12)
        self._gauss = 0.5 * (x + 1.0), 0.5 * w
        values, _ = self._shapes(self._gauss[0])  # (k, 12)
        self._phi = values
        theta = np.einsum("ke,kg->eg", coefficients[self._dofs], values)
        self._cos, self._sin = np.cos(theta), np.sin(theta)
        weights = self._length[:, None] * self._gauss[1]
        self._weights = weights
        chords = np.stack([np.sum(weights * self._cos, axis=1), np.sum(weights * self._sin, axis=1)], axis=1)
        self._joints = np.concatenate([np.zeros((1, 2)), np.cumsum(chords, axis=0)])
        own = np.stack(
            [np.einsum("eg,kg->ek", weights * part, values) for part in (-self._sin, self._cos)]
        )  # (2, n, k)
        count, size = len(self._length), len(coefficients)
        spread = np.zeros((count, 2, size))
        for local in range(self._dofs.shape[0]):
            spread[np.arange(count), :, self._dofs[local]] += own[:, :, local].T
        self._swept = np.concatenate([np.zeros((1, 2, size)), np.cumsum(spread, axis=0)])

    def _shapes(self, x: Array) -> tuple[Array, Array]:
        """Basis functions and their derivatives (k, q) at x (q,) of 0 to 1; by an element of their own (see
        `Discretisation._shapes`)."""
        if not x.size:
            return np.zeros((self._dofs.shape[0], 0)), np.zeros((self._dofs.shape[0], 0))
        element = ELEMENTS[self._degree]()
        pairs = [element.lbasis(x[None, :], k) for k in range(self._dofs.shape[0])]
        values = np.stack([np.broadcast_to(value, x.shape) for value, _ in pairs])
        rates = np.stack([np.broadcast_to(rate[0], x.shape) for _, rate in pairs])
        return values, rates

    def cells(self, s: Array) -> Array:
        """Numbers (k,) of the elements of abscissae."""
        return np.asarray(np.clip(np.searchsorted(self._nodes, s, side="right") - 1, 0, len(self._length) - 1))

    def shape(self, s: Array) -> tuple[Array, Array, Array]:
        """theta, theta' (k,) and positions (k, 2) alone."""
        cell = self.cells(s)
        h, x = self._length[cell], (s - self._nodes[cell]) / self._length[cell]
        own = self._c[self._dofs[:, cell]]  # (k, places)
        values, rates = self._shapes(x)
        theta, curvature = np.sum(own * values, axis=0), np.sum(own * rates, axis=0) / h
        inner, _ = self._shapes((x[:, None] * self._gauss[0]).ravel())
        angle = np.einsum("kp,kpg->pg", own, inner.reshape(len(own), len(s), len(self._gauss[0])))
        weights = (x * h)[:, None] * self._gauss[1]
        rest = np.stack([np.sum(weights * np.cos(angle), axis=1), np.sum(weights * np.sin(angle), axis=1)], axis=1)
        return theta, curvature, self._joints[cell] + rest

    def _before(self, s: Array, cell: Array) -> tuple[Array, Array, Array, Array]:
        """Of Gauss points between the joint before each place and the place: basis functions (n, k, g), weights, cosine
        and sine of theta (k, g)."""
        part = (s - self._nodes[cell]) / self._length[cell]
        inner, _ = self._shapes((part[:, None] * self._gauss[0]).ravel())
        inner = inner.reshape(len(inner), len(s), len(self._gauss[0]))
        angle = np.einsum("kp,kpg->pg", self._c[self._dofs[:, cell]], inner)
        return inner, (part * self._length[cell])[:, None] * self._gauss[1], np.cos(angle), np.sin(angle)

    def at(self, s: Array) -> Places:
        """Everything at abscissae (k,)."""
        theta, curvature, position = self.shape(s)
        cell = self.cells(s)
        x = (s - self._nodes[cell]) / self._length[cell]
        values, _ = self._shapes(x)
        phi = np.zeros((len(s), len(self._c)))
        moves = self._swept[cell].copy()
        inner, weights, cos, sin = self._before(s, cell)
        each, dofs = np.arange(len(s))[:, None], self._dofs[:, cell].T  # an element's unknowns differ
        phi[each, dofs] = values.T
        moves[each, 0, dofs] += np.einsum("kpg,pg->pk", inner, -weights * sin)
        moves[each, 1, dofs] += np.einsum("kpg,pg->pk", inner, weights * cos)
        tangent = np.stack([np.cos(theta), np.sin(theta)], axis=1)
        normal = np.stack([-np.sin(theta), np.cos(theta)], axis=1)
        return Places(s, theta, curvature, tangent, normal, position, phi, moves)

    @property
    def size(self) -> int:
        """N."""
        return len(self._c)

    def bent_by(self, s: Array, force: Array) -> Array:
        """sum_k <force_k, d^2 r(s_k)>, shape (N, N), of forces (k, 2) at s (k,)."""
        cell, size = self.cells(s), len(self._c)
        behind = np.zeros((len(self._length), 2))
        np.add.at(behind, cell.astype(np.int64), force)
        behind = np.cumsum(behind[::-1], axis=0)[::-1] - behind  # all that acts beyond each element
        pull = self._weights * (behind[:, :1] * self._cos + behind[:, 1:] * self._sin)
        blocks = -np.einsum("eg,ig,jg->eij", pull, self._phi, self._phi)
        inner, weights, cos, sin = self._before(s, cell)
        carried = weights * (force[:, :1] * cos + force[:, 1:] * sin)
        np.add.at(blocks, cell.astype(np.int64), -np.einsum("pg,ipg,jpg->pij", carried, inner, inner))
        found = np.zeros((size, size))
        rows = self._dofs.T
        np.add.at(found, (rows[:, :, None], rows[:, None, :]), blocks)
        return found

    def bent(self, s: float, along: Array) -> Array:
        """<along, d^2 r(s)>, shape (N, N); along (2,)."""
        cell = int(self.cells(np.array([s]))[0])
        size = len(self._c)
        pull = self._weights * (along[0] * self._cos + along[1] * self._sin)  # (n, g)
        blocks = -np.einsum("eg,ig,jg->eij", pull[:cell], self._phi, self._phi)
        found = np.zeros((size, size))
        rows = self._dofs[:, :cell].T  # (cell, k)
        np.add.at(found, (rows[:, :, None], rows[:, None, :]), blocks)
        part = (s - self._nodes[cell]) / self._length[cell]
        inner, _ = self._shapes(part * self._gauss[0])
        own = self._dofs[:, cell]
        angle = self._c[own] @ inner
        weight = part * self._length[cell] * self._gauss[1] * (along[0] * np.cos(angle) + along[1] * np.sin(angle))
        found[np.ix_(own, own)] -= (inner * weight) @ inner.T
        return found
