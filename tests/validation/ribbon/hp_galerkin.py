"""Prototype: a coil of Sadowsky's energy whose omega and eta are continuous piecewise polynomials of any degree.

Galerkin's method for the gradient of the energy, with the frame of the fields integrated to rounding: of degree 1 it is
the ribbon element's own discrete problem, and its states are `ribbon.solve`'s. In the frame ``R' = R [kappa]_x``,
``kappa = (omega, 0, eta omega)``, a variation of kappa turns what lies beyond it (docs/theory.md, chapter 4), so that
with the arm ``a(s) = int_s^1 (r(t) - r(s)) dt`` and ``n = R^T Gamma a x e_up``::

    dE = int domega (e_omega + n_1 + eta n_3) + deta (e_eta + omega n_3) ds .

Frame, position and its integral are one matrix ``G = [R r J; 0 1 s; 0 0 1]`` with ``G' = G A(kappa)``, and the arm is
``J(1) - J(s) - (1 - s) r(s)``; G is integrated by Magnus's expansion of order six (Blanes et al. 2009,
doi:10.1016/j.physrep.2008.11.001).
"""

from __future__ import annotations

import itertools

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tests.peers.cases import Case

FloatArray = NDArray[np.float64]

#: Gauss points of an element; most turn (rad) in one step of the frame; terms of its exponential.
_GAUSS = 16
_TURN = 0.12
_TERMS = 13
#: The residual at which a state is one; Newton steps; by how much a step has to lessen it to keep the Jacobian.
_SMALL = 1e-11
_STEPS = 15
_LESS = 0.2


def _nodes(degree: int) -> FloatArray:
    """Gauss-Lobatto nodes (degree + 1,) on [0, 1]."""
    inner = np.polynomial.legendre.Legendre.basis(degree).deriv().roots()
    return np.asarray(0.5 * (1.0 + np.concatenate([[-1.0], np.sort(inner.real), [1.0]])))


def _lagrange(nodes: FloatArray, x: FloatArray) -> FloatArray:
    """Values (k, m) at x (k,) of the m polynomials that are 1 at one of the nodes (m,)."""
    found = np.ones((x.size, nodes.size))
    for j in range(nodes.size):
        for k in range(nodes.size):
            if k != j:
                found[:, j] *= (x - nodes[k]) / (nodes[j] - nodes[k])
    return found


@njit
def _commutator(a, b):
    return b @ a - a @ b  # G' = G A: that of the transposes


@njit
def _walk(h, first, third, begin, out):
    """out (n + 1, 5, 5): G after each of the steps h (n,); kappa_1, kappa_3 (n, 3) at their Gauss points."""
    out[0] = begin
    a = np.zeros((3, 5, 5))
    root = np.sqrt(15.0) / 3.0
    for i in range(h.size):
        for m in range(3):
            a[m, 0, 1], a[m, 1, 0] = -third[i, m], third[i, m]
            a[m, 1, 2], a[m, 2, 1] = -first[i, m], first[i, m]
            a[m, 2, 3] = a[m, 3, 4] = 1.0
        one = h[i] * a[1]
        two = root * h[i] * (a[2] - a[0])
        three = 10.0 / 3.0 * h[i] * (a[2] - 2.0 * a[1] + a[0])
        inner = _commutator(one, two)
        outer = _commutator(one, 2.0 * three + inner) / -60.0
        turn = one + three / 12.0 + _commutator(-20.0 * one - three + inner, two + outer) / 240.0
        whole, term = np.eye(5), np.eye(5)
        for k in range(1, _TERMS + 1):
            term = term @ turn / k
            whole = whole + term
        out[i + 1] = out[i] @ whole


class Galerkin:
    """A coil on `segments` equal elements of a degree; unknowns x: omega, then eta, at the nodes."""

    def __init__(self, found: Case, segments: int, degree: int) -> None:
        self.found, self.p, h = found, segments, 1.0 / segments
        self.n = segments * degree + 1
        gauss, weights = np.polynomial.legendre.leggauss(_GAUSS)
        gauss, self.weights = 0.5 * (1.0 + gauss), 0.5 * h * weights
        steps: list[float] = []
        at: list[float] = []
        marks = []
        stops = np.concatenate([[0.0], gauss, [1.0]])
        for low, high in itertools.pairwise(stops):
            parts = max(1, int(np.ceil((high - low) * h * 1.5 * abs(found.curvature) / _TURN)))
            edges = np.linspace(low, high, parts + 1)
            for a, b in itertools.pairwise(edges):
                steps.append(b - a)
                at += list(a + (b - a) * (0.5 + np.array([-0.5, 0.0, 0.5]) * np.sqrt(0.6)))
            marks.append(len(steps))
        nodes = _nodes(degree)
        self.steps, self.marks = h * np.array(steps), np.array(marks[:-1])
        self.on_steps, self.on_gauss = _lagrange(nodes, np.array(at)), _lagrange(nodes, gauss)
        self.places = np.arange(segments)[:, None] * degree + np.arange(degree + 1)[None, :]
        begin = h * np.arange(segments)[:, None]
        self.s = (begin + h * gauss).ravel()
        self.nodes = np.append((begin + h * nodes[:-1]).ravel(), 1.0)

    @property
    def unknowns(self) -> int:
        """Number of unknowns."""
        return 2 * self.n

    def _shape(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """G (k, 5, 5) after all steps; omega and eta (p, degree + 1) of the elements."""
        omega, eta = x[: self.n][self.places], x[self.n :][self.places]
        first, ruling = (v @ self.on_steps.T for v in (omega, eta))
        count = self.p * self.steps.size
        begin = np.eye(5)
        begin[:3, :3] = self.found.frame
        out = np.empty((count + 1, 5, 5))
        _walk(
            np.tile(self.steps, self.p), np.ascontiguousarray(first.reshape(count, 3)),
            np.ascontiguousarray((first * ruling).reshape(count, 3)), begin, out,
        )  # fmt: skip
        return out, omega, eta

    def tip(self, x: FloatArray) -> FloatArray:
        """r(1) - r(0) (3,)."""
        return np.asarray(self._shape(x)[0][-1][:3, 3])

    def residual(self, x: FloatArray) -> FloatArray:
        """The energy's gradient (n,)."""
        out, omega, eta = self._shape(x)
        k, nu, up = self.found.curvature, self.found.poisson, np.asarray(self.found.up)
        g = out[(np.arange(self.p)[:, None] * self.steps.size + self.marks).ravel()]
        arm = out[-1][:3, 4] - g[:, :3, 4] - (1.0 - self.s)[:, None] * g[:, :3, 3]
        n = np.einsum("kji,kj->ki", g[:, :3, :3], self.found.gamma * np.cross(arm, up))
        w, e = ((v @ self.on_gauss.T).ravel() for v in (omega, eta))
        u = 1.0 + e * e
        by_omega = w * u * u - k * (1.0 + nu * e * e) + n[:, 0] + e * n[:, 2]
        by_eta = 2.0 * w * w * u * e - 2.0 * k * nu * w * e + w * n[:, 2]
        found = np.zeros(self.unknowns)
        for part, values in zip((found[: self.n], found[self.n :]), (by_omega, by_eta), strict=True):
            np.add.at(part, self.places, (self.weights * values.reshape(self.p, _GAUSS)) @ self.on_gauss)
        return found

    def _jacobian(self, x: FloatArray) -> FloatArray:
        found = np.empty((x.size, x.size))
        for i in range(x.size):
            step = np.zeros(x.size)
            step[i] = 1e-6 * max(1.0, abs(x[i]))
            found[:, i] = (self.residual(x + step) - self.residual(x - step)) / (2.0 * step[i])
        return found

    def solve(self, x: FloatArray) -> FloatArray:
        """The state (n,) near x (n,). Raises `AssertionError` where Newton's iteration does not end."""
        jacobian, before = self._jacobian(x), np.inf
        for _ in range(_STEPS):
            residual = self.residual(x)
            size = float(np.abs(residual).max())
            if size <= _SMALL * max(1.0, self.found.gamma / 100.0):
                return x
            if size > _LESS * before:
                jacobian = self._jacobian(x)
            before = size
            x = x - np.linalg.solve(jacobian, residual)
        raise AssertionError(f"no state: residual {size:g}")
