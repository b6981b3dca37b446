"""Equilibrium of the discrete rod at one problem: mixed Newton on what is free, and the inertia of its tangent.

What is held follows: the way of a held point or frame to its place enters the linear solve as a given part of the step.
The stress of the geometric stiffness is an unknown of its own, sigma_(j+1) = C (e(u_j) + e'(u_j) du - e_0), so that
stretch and shear, however stiff, do not shorten the steps; the solution is Newton's (D. Magisano, L. Leonetti,
G. Garcea 2017, doi:10.1016/j.cma.2016.10.026; docs/theory.md, eq. (7.10)). `fade` (n, 6): forces that act besides, by
which a state that is out of balance is made one of equilibrium, to be taken away bit by bit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

from shellref.rod.elements import Elements, State
from shellref.rod.problem import RodProblem
from shellref.rod.quaternion import Array, quaternion, turn_between, turned

TOLERANCE = 1e-10
"""Largest correction, in l and radians, at which a state counts as found."""

STALLED = 1e-7
"""A correction that small and no longer falling is rounding: the state counts as found."""

LARGEST = 3.0
"""A larger correction is a failed solve."""

ITERATIONS = 40


@dataclass
class Solved:
    """state None: not found, why says it; stress: of the last step; residual: of the free forces, relative; negative:
    number of negative eigenvalues of the last tangent, None where it is not known; turn: largest turn of a node in it,
    rad."""

    state: State | None
    stress: Array | None
    iterations: int
    residual: float = np.inf
    negative: int | None = None
    why: str = ""


class Factor:
    """Factors of a reduced tangent and its inertia (Sylvester: the signs of D in L D L^T, of the same pivots)."""

    def __init__(self, matrix: scipy.sparse.csc_matrix, symmetric: bool):
        options = {"SymmetricMode": True} if symmetric else {}
        self.negative: int | None = None
        try:
            self._lu = scipy.sparse.linalg.splu(
                matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0 if symmetric else 1.0, options=options
            )
        except RuntimeError:  # exactly singular
            self._lu = None
            return
        diagonal = self._lu.U.diagonal()
        if symmetric and np.array_equal(self._lu.perm_r, self._lu.perm_c) and np.all(np.isfinite(diagonal)):
            self.negative = int(np.sum(diagonal < 0.0))

    def solve(self, right: Array) -> Array | None:
        """K^-1 right; None where K is singular."""
        if self._lu is None:
            return None
        found = self._lu.solve(right)
        return found if np.all(np.isfinite(found)) else None


class Balance:
    """The balance of a discrete rod on the steps that its supports leave free."""

    def __init__(self, elements: Elements, problem: RodProblem):
        self.elements = elements
        self.free = _free(elements, problem)  # (6 n, unknowns)
        self.held = scipy.sparse.identity(elements.size, format="csr") - self.free @ self.free.T
        self.unknowns = self.free.shape[1]

    def gap(self, state: State, problem: RodProblem) -> Array:
        """The step (n, 6) that puts what is held in its place, and moves nothing else."""
        out = np.zeros((len(self.elements.s), 6))
        for index, held in ((0, problem.start), (-1, problem.end)):
            if held.position is not None:
                out[index, :3] = held.position - state.r[index]
            if held.frame is not None:
                out[index, 3:] = turn_between(state.q[index], quaternion(held.frame))
        return np.asarray((self.held @ out.ravel()).reshape(-1, 6))

    def factor(self, state: State, problem: RodProblem, stress: Array, shift: Array | None = None) -> tuple[
        scipy.sparse.csc_matrix, Factor
    ]:  # fmt: skip
        """The whole tangent (6 n, 6 n), with a shift (6 n,) on its diagonal, and the factors of its free part."""
        whole = self.elements.tangent(state, problem, stress)
        if shift is not None:
            whole = (whole + scipy.sparse.diags(shift)).tocsc()
        reduced = (self.free.T @ whole @ self.free).tocsc()
        return whole, Factor(reduced, problem.conservative)

    def residual(self, state: State, problem: RodProblem, fade: Array | float = 0.0) -> Array:
        """Out-of-balance forces on what is free (unknowns,)."""
        return np.asarray(self.free.T @ (self.elements.residual(state, problem) - fade).ravel())

    def relative(self, state: State, problem: RodProblem, fade: Array | float = 0.0) -> float:
        """Its largest component, over the largest force or moment that a section carries, or 1."""
        size = max(1.0, float(np.abs(self.elements.stress(state, problem)).max()), problem.load)
        return float(np.abs(self.residual(state, problem, fade)).max(initial=0.0)) / size

    def solve(
        self, state: State, problem: RodProblem, stress: Array | None = None, fade: Array | float = 0.0
    ) -> Solved:
        """From `state` to equilibrium, with the stress (e, g, 6) that belongs to it, or that of the last step."""
        elements = self.elements
        stress = elements.stress(state, problem) if stress is None else stress
        before = np.inf
        negative: int | None = None
        for iteration in range(1, ITERATIONS + 1):
            gap = self.gap(state, problem)
            whole, factor = self.factor(state, problem, stress)
            negative = factor.negative
            right = (elements.residual(state, problem) - fade).ravel() + whole @ gap.ravel()
            change = factor.solve(self.free.T @ right)
            if change is None:
                return Solved(None, None, iteration, why="the tangent is singular")
            step = gap - (self.free @ change).reshape(-1, 6)
            size = float(np.abs(step).max())
            if not size <= LARGEST:
                return Solved(None, None, iteration, why="the corrections grow")
            stress = elements.stress(state, problem, step)
            state = state.moved(step)
            if size <= TOLERANCE or (size <= STALLED and size >= 0.3 * before):
                return Solved(state, stress, iteration, self.relative(state, problem, fade), negative)
            before = size
        return Solved(None, None, ITERATIONS, why="the corrections do not fall")


def _free(elements: Elements, problem: RodProblem) -> scipy.sparse.csr_matrix:
    """Orthonormal columns: the steps that the supports leave free."""
    count = len(elements.s)
    blocks: list[Array] = [np.eye(6)] * count
    for index, held in ((0, problem.start), (count - 1, problem.end)):
        columns = []
        if held.position is None:
            columns += [np.eye(6)[:, k] for k in range(3)]
        elif held.slide is not None:
            columns += [np.append(held.slide / np.linalg.norm(held.slide), np.zeros(3))]
        if held.frame is None:
            columns += [np.eye(6)[:, k] for k in range(3, 6)]
        blocks[index] = np.array(columns).T if columns else np.zeros((6, 0))
    return scipy.sparse.block_diag(blocks, format="csr")


def held_exactly(state: State, problem: RodProblem) -> State:
    """The state with held points and frames put in place to the last digit (slides are not)."""
    r, q = state.r.copy(), state.q.copy()
    for index, held in ((0, problem.start), (-1, problem.end)):
        if held.position is not None and held.slide is None:
            r[index] = held.position
        if held.frame is not None:
            q[index] = turned(q[index], turn_between(q[index], quaternion(held.frame)))
    return State(r, q)
