"""Line elements of degree 1 to 3 for positions and quaternions, integrated with as many Gauss points as the degree.

That reduced rule is exact for a rod at rest of any curvature and lets no strain lock: an element of degree p has 6 p
unknowns beyond a rigid motion's and 6 p strains. Unknowns of a node: position (3), then a turn theta (3) in its own
frame, q exp(theta / 2); derivatives are those with respect to both at theta = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse

from shellref.rod.problem import RodProblem
from shellref.rod.quaternion import PRODUCT, Array, rotation, turned
from shellref.rod.strains import DQ, DR, SIZE, Q, second, strains

DEGREES = (1, 2, 3)
_TURN = 0.5 * PRODUCT[:, :, 1:].transpose(1, 0, 2)  # (i, k, m): dq_k = sum_i q_i _TURN[i, k, m] theta_m


@dataclass(frozen=True)
class State:
    """Positions r (n, 3) and unit quaternions q (n, 4) of the nodes."""

    r: Array
    q: Array

    def moved(self, step: Array) -> State:
        """By a step (n, 6)."""
        return State(self.r + step[:, :3], turned(self.q, step[:, 3:]))


def lagrange(degree: int, x: Array) -> tuple[Array, Array]:
    """Shape functions (k, degree + 1) at x (k,) in [-1, 1], nodes evenly spaced, and their derivatives by x."""
    nodes = np.linspace(-1.0, 1.0, degree + 1)
    powers = np.vander(nodes, increasing=True)
    coefficients = np.linalg.inv(powers)
    k = np.arange(degree + 1)
    values = x[:, None] ** k @ coefficients
    slopes = (k * np.where(k > 0, x[:, None] ** np.maximum(k - 1, 0), 0.0)) @ coefficients
    return values, slopes


class Elements:
    """The discrete rod on `joints` (E + 1,) from 0 to 1. Index letters: e element, g Gauss point, a node of it."""

    def __init__(self, joints: Array, degree: int):
        if degree not in DEGREES:
            raise ValueError(f"degree = {degree}: must be one of {DEGREES}")
        self.joints, self.degree = joints, degree
        count, p = len(joints) - 1, degree
        sizes = np.diff(joints)
        self.s = np.append((joints[:-1, None] + sizes[:, None] * np.arange(p) / p).ravel(), 1.0)  # (n,)
        self.connect = p * np.arange(count)[:, None] + np.arange(p + 1)  # (e, a)
        x, weights = np.polynomial.legendre.leggauss(p)
        self.values, slopes = lagrange(p, x)  # (g, a)
        self.slopes = slopes * 2.0 / sizes[:, None, None]  # (e, g, a)
        self.weights = 0.5 * sizes[:, None] * weights  # (e, g)
        self.points = joints[:-1, None] + 0.5 * sizes[:, None] * (1.0 + x)  # (e, g), abscissae of the Gauss points
        columns = (6 * self.connect[:, :, None] + np.arange(6)).reshape(count, -1)  # (e, 6 (p + 1))
        width = columns.shape[1]
        self.columns = columns
        self._rows = np.repeat(columns, width, axis=1).ravel()
        self._cols = np.tile(columns, (1, width)).ravel()
        self.size = 6 * len(self.s)

    def interpolated(self, state: State) -> Array:
        """Z (e, g, 11) of `shellref.rod.strains`."""
        q, r = state.q[self.connect], state.r[self.connect]
        values = np.broadcast_to(self.values, self.slopes.shape)
        return np.concatenate([values @ q, self.slopes @ q, self.slopes @ r], axis=-1)

    def rest(self, problem: RodProblem) -> Array:
        """Strains at rest (e, g, 6)."""
        out = np.zeros((*self.points.shape, 6))
        out[..., 3:] = problem.at_rest(self.points)
        return out

    def strains(self, state: State) -> Array:
        """(e, g, 6)."""
        return strains(self.interpolated(state))[0]

    def tangents(self, state: State) -> Array:
        """(e, a, 4, 3): dq of a node by its turn."""
        return np.einsum("...i,ikm->...km", state.q[self.connect], _TURN)

    def spread(self, state: State) -> Array:
        """B (e, g, 11, 6 (p + 1)): dz by the unknowns of an element."""
        turns = self.tangents(state)
        count, points, nodes = self.slopes.shape
        out = np.zeros((count, points, SIZE, nodes, 6), dtype=turns.dtype)
        out[:, :, Q, :, 3:] = np.einsum("ga,eakm->egkam", self.values, turns)
        out[:, :, DQ, :, 3:] = np.einsum("ega,eakm->egkam", self.slopes, turns)
        for k in range(3):
            out[:, :, DR.start + k, :, k] = self.slopes
        return out.reshape(count, points, SIZE, 6 * nodes)

    def energy(self, state: State, problem: RodProblem) -> Array:
        """(6,): the energy stored by each strain, D w / l."""
        excess = self.strains(state) - self.rest(problem)
        return 0.5 * problem.section.stiffness * np.einsum("eg,egi->i", self.weights, excess**2)

    def stress(self, state: State, problem: RodProblem, step: Array | None = None) -> Array:
        """Force and moment in the section's frame (e, g, 6); step (n, 6): those at the state moved by it, to first
        order."""
        strain, slope = strains(self.interpolated(state))
        excess = strain - self.rest(problem)
        if step is not None:
            local = step.ravel()[self.columns]
            excess = excess + np.einsum("egij,ej->egi", slope @ self.spread(state), local)
        return np.asarray(problem.section.stiffness * excess)

    def residual(self, state: State, problem: RodProblem, stress: Array | None = None) -> Array:
        """Internal minus external force and moment (n, 6) of every node; stress (e, g, 6): another than the state's."""
        _, slope = strains(self.interpolated(state))
        used = self.stress(state, problem) if stress is None else stress
        local = np.einsum("eg,egi,egij->ej", self.weights, used, slope @ self.spread(state), optimize=True)
        return self._gathered(local) - self.loads(state, problem)

    def loads(self, state: State, problem: RodProblem) -> Array:
        """External forces, and moments in the nodes' frames (n, 6)."""
        out = np.zeros((len(self.s), 6))
        shares = np.einsum("eg,ga->ea", self.weights, self.values)
        np.add.at(out[:, :3], self.connect, shares[..., None] * problem.weight)
        out[-1, :3] += problem.force
        out[-1, 3:] += rotation(state.q[-1]).T @ problem.moment
        return out

    def tangent(self, state: State, problem: RodProblem, stress: Array) -> scipy.sparse.csc_matrix:
        """Derivative of the residual (6 n, 6 n) at this stress (e, g, 6); symmetric but for a moment at the tip.

        A turn changes q to second order by -|theta|^2 q / 8, which adds -(dE/dq . q) / 4 to the turns' diagonal
        (docs/theory.md, eq. (12.6)). A moment of fixed direction M adds -[R^T M]_x / 2, in the chart q exp(theta / 2)
        (docs/theory.md, eq. (12.7)).
        """
        z = self.interpolated(state)
        strain, slope = strains(z)
        spread = self.spread(state)
        moved = slope @ spread  # (e, g, 6, 6 (p + 1))
        weighted = self.weights[..., None] * problem.section.stiffness
        geometric = self.weights[..., None, None] * second(z, stress, strain, slope)
        back = np.swapaxes(spread, -1, -2)
        local = (np.swapaxes(moved * weighted[..., None], -1, -2) @ moved + back @ (geometric @ spread)).sum(axis=1)
        pull = np.einsum("eg,egi,egiz->egz", self.weights, stress, slope, optimize=True)
        ambient = np.einsum("ga,egk->eak", self.values, pull[..., Q]) + np.einsum(
            "ega,egk->eak", self.slopes, pull[..., DQ]
        )
        along = -0.25 * np.sum(ambient * state.q[self.connect], axis=-1)
        for a in range(self.degree + 1):
            for k in range(3, 6):
                local[:, 6 * a + k, 6 * a + k] += along[:, a]
        whole = scipy.sparse.coo_matrix((local.ravel(), (self._rows, self._cols)), shape=(self.size, self.size))
        if np.any(problem.moment):
            m = 0.5 * rotation(state.q[-1]).T @ problem.moment
            turn = np.array([[0.0, -m[2], m[1]], [m[2], 0.0, -m[0]], [-m[1], m[0], 0.0]])
            corner = scipy.sparse.lil_matrix((self.size, self.size))
            corner[self.size - 3 :, self.size - 3 :] = -turn
            whole = whole + corner
        return whole.tocsc()

    def mass(self, problem: RodProblem) -> Array:
        """(n, 6): mass of the nodes, mass per length 1, and their rotary inertia."""
        shares = np.zeros(len(self.s))
        np.add.at(shares, self.connect, np.einsum("eg,ga->ea", self.weights, self.values))
        return shares[:, None] * np.concatenate([np.ones(3), problem.section.inertia])

    def _gathered(self, local: Array) -> Array:
        out = np.zeros(self.size, dtype=local.dtype)
        np.add.at(out, self.columns, local)
        return out.reshape(-1, 6)

    def local(self, s: Array) -> tuple[Array, Array]:
        """The element (k,) of every s (k,), and its place in [-1, 1] there."""
        element = np.clip(np.searchsorted(self.joints, s, side="right") - 1, 0, len(self.joints) - 2)
        return element, 2.0 * (s - self.joints[element]) / np.diff(self.joints)[element] - 1.0

    def at(self, state: State, s: Array) -> tuple[Array, Array]:
        """Position (k, 3) and unit quaternion (k, 4) at s (k,)."""
        element, x = self.local(s)
        values, _ = lagrange(self.degree, x)
        nodes = self.connect[element]
        q = np.einsum("ka,kai->ki", values, state.q[nodes])
        return np.einsum("ka,kai->ki", values, state.r[nodes]), q / np.linalg.norm(q, axis=1, keepdims=True)
