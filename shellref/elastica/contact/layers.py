r"""A planar elastica that lies on itself, or on barriers, along long lines: a least energy under many gaps at once.

An active set by exchange (`shellref.elastica.contact.solve`) goes round in circles where hundreds of places touch: what
is let go and taken in one by one moves all the others. Here every joint that could touch soon has its row, and each
step solves the quadratic problem with all of them as inequalities (R. Wilson 1963; J. Nocedal and S. Wright, Numerical
Optimization, 2nd ed., Springer 2006, chapter 18),

    min 1/2 d H d + dE d ,   B d = -b ,   dg_k d + g_k >= 0 ,   H = d^2 E - sum_k lambda_k d^2 g_k ,

whose multipliers are the pushes. Where H is not positive, 1/2 rho (dg d + g)^2 of what pushes is added, which is zero
where the step keeps it (so that the last steps are Newton's), and then a multiple of the mass. Steps go downhill in
energy and what is left of gaps (an exact penalty), and none is longer than half the reach within which places have
their rows: nothing passes through anything. The answer has no penalty in it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
import scipy.optimize
from numpy.typing import NDArray

from ribbonbench import clock
from shellref.elastica.contact.barrier import Barrier
from shellref.elastica.contact.near import finer
from shellref.elastica.contact.places import Moving
from shellref.elastica.contact.rows import Beside, Pair, Row
from shellref.elastica.contact.stations import Gaps, Stations, beside, openings, slid
from shellref.elastica.problem import Array, ElasticaProblem
from shellref.elastica.system import System

#: Steps of a search, halvings of one, rad that a section may turn in one.
STEPS, HALVINGS, TURN = 300, 12, 0.5
#: Gap (l) up to which a joint has its row.
REACH = 0.04
#: Depth (l) from which a place between joints has its row, and rounds of that.
SAG, BETWEEN = 2e-7, 6
#: What is left (D w / l) from which Newton's steps are tried with what pushes held.
NEAR = 1e-3
#: Gap, and push times gap, that is left where it is found.
CLOSED = 1e-10
#: rho, over the bending stiffness; the part of K^2 with which the mass begins, and its growth.
HOLDING, SHIFT, GROWTH = 1e6, 0.02, 5.0


@dataclass(frozen=True)
class Lying:
    """z (N + m,), stations with gaps and pushes (k,) in D w / l^2, what is left, steps, and whether it is found."""

    z: Array
    gaps: Gaps
    pushes: Array
    norm: float
    steps: int
    found: bool

    def rows(self, problem: ElasticaProblem) -> tuple[tuple[Row, ...], Array]:
        """What pushes, each place held, and the pushes (k,)."""
        stations, held = self.gaps.stations, np.flatnonzero(self.pushes > 0.0)
        rows: list[Row] = []
        for k in held:
            s, foot, barrier = float(stations.s[k]), float(stations.foot[k]), int(stations.barrier[k])
            if barrier < 0:
                rows.append(Pair(s, foot, float(stations.side[k]), problem.apart or 0.0, True))
            else:
                rows.append(Beside(s, problem.barriers[barrier], barrier, True))
        return tuple(rows), self.pushes[held]


class Layers:
    """One discretisation of the problem at t of its way; what it begins from has no part on the wrong side of another.

    degree: of the elements; tolerance: of what is left, D w / l.
    """

    def __init__(self, system: System, degree: int, tolerance: float, t: float = 1.0) -> None:
        self.system, self.degree, self.tolerance, self.t = system, degree, tolerance, t
        self.problem: ElasticaProblem = system.way.at(t)
        self._nodes, self._free = system.discrete.nodes, system.discrete.free
        self._places = self._nodes  # joints, and what is put between them
        self._mass = system.discrete.mass.toarray()

    @property
    def _barriers(self) -> Sequence[Barrier]:
        return self.problem.barriers

    def gaps(self, z: Array, stations: Stations | None = None) -> Gaps:
        """Gaps at z of all joints within reach, or of stations, where they have gone."""
        moving = Moving(self.system.discrete, self.degree, z[: self.system.count])
        if stations is None:
            stations = beside(moving, self._places, self._nodes, self.problem.apart, self._barriers, REACH)
        else:
            stations = slid(moving, stations)[0]
        return Gaps(moving, stations, self.problem.apart or 0.0, self._barriers)

    def settle(self, z: Array, pushes: dict[tuple[int, int, int], float] | None = None) -> Lying:
        """The equilibrium downhill of z (N + m,), with more places where it is too near between joints."""
        state = self._settled(z, dict(pushes or {}))
        for _ in range(BETWEEN):
            more = self._sags(state.z) if state.found else np.zeros(0)
            if not len(more) or clock.spent():
                break
            self._places = np.union1d(self._places, more)
            known = dict(zip(state.gaps.stations.keys, state.pushes.tolist(), strict=True))
            again = self._settled(state.z, known)
            if not again.found:
                break
            state = replace(again, steps=again.steps + state.steps)
        return state

    def _sags(self, z: Array) -> Array:
        """Places (k,) between those that have rows, the deepest of each stretch that is too near."""
        moving = Moving(self.system.discrete, self.degree, z[: self.system.count])
        places = finer(moving, self._places)
        inner = (places[:-1, None] + np.diff(places)[:, None] * np.arange(1, 8) / 8.0).ravel()
        every = np.union1d(self._places[[0, -1]], inner)
        near = beside(moving, every, self._nodes, self.problem.apart, self._barriers, 1e-3)
        gap = openings(moving, near, self.problem.apart or 0.0, self._barriers)
        cell = np.searchsorted(self._places, near.s)
        found: list[float] = []
        for one in np.unique(cell[gap < -SAG]):
            own = np.flatnonzero((cell == one) & (gap < -SAG))
            found.append(float(near.s[own[np.argmin(gap[own])]]))
        return np.array(found)

    def _settled(self, z: Array, known: dict[tuple[int, int, int], float]) -> Lying:
        z = z.copy()
        given = [angle for angle in (self.problem.start_angle, self.problem.end_angle) if angle is not None]
        z[self.system.discrete.given] = given
        gaps = self.gaps(z)
        for count in range(STEPS + 1):
            own = np.array([known.get(key, 0.0) for key in gaps.stations.keys])
            left = self._left(z, gaps, own)
            found = left <= self.tolerance and self._closed(gaps, own)
            kept = bool(gaps.gap[own == 0.0].min(initial=0.0) >= -CLOSED)
            if found or count == STEPS or clock.spent():
                break
            moved = (self._newton(z, gaps, own) if left < NEAR and kept else None) or self._step(z, gaps, own)
            if moved is None:
                break
            z, known = moved
            gaps = self.gaps(z)
        return Lying(z, gaps, own, left, count, found)

    def _closed(self, gaps: Gaps, pushes: Array) -> bool:
        """Whether no gap is below zero, nothing pulls, and what pushes touches."""
        open_by = np.abs(np.where(pushes > 0.0, gaps.gap, np.minimum(gaps.gap, 0.0)))
        return bool(open_by.max(initial=0.0) <= CLOSED and pushes.min(initial=0.0) >= 0.0)

    def _left(self, z: Array, gaps: Gaps, pushes: Array) -> float:
        residual = self.system.residual(z, self.t)
        residual[self._free] -= gaps.slope[:, self._free].T @ pushes
        return self.system.norm(residual)

    def _step(self, z: Array, gaps: Gaps, pushes: Array) -> tuple[Array, dict[tuple[int, int, int], float]] | None:
        """z and pushes after a step; None: none goes downhill."""
        step, fresh, reaction = self._quadratic(z, gaps, pushes)
        size = self._longest(z, step)
        penalty = 2.0 * max(float(np.max(fresh, initial=0.0)), float(np.max(np.abs(reaction), initial=0.0)), 1.0)
        before = self._merit(z, gaps, penalty)
        off = np.minimum(gaps.gap, 0.0)
        rate = float(self._slope(z) @ step) + penalty * float(off.sum()) - penalty * self._misfit(z)
        for _ in range(HALVINGS):
            there = z.copy()
            there[self._free] += size * step
            there[self.system.count :] += size * (reaction - z[self.system.count :])
            if self._merit(there, self.gaps(there, gaps.stations), penalty) <= (
                before + min(1e-4 * size * rate, 0.0) + 1e-12 * max(1.0, abs(before))
            ):
                mixed = pushes + size * (fresh - pushes)
                return there, dict(zip(gaps.stations.keys, mixed.tolist(), strict=True))
            size *= 0.5
        return None

    def _newton(self, z: Array, gaps: Gaps, pushes: Array) -> tuple[Array, dict[tuple[int, int, int], float]] | None:
        """z and pushes after Newton's step with what pushes held; None: something pulls, or what is left grows."""
        free, count = self._free, self.system.count
        held = np.flatnonzero(pushes > 0.0)
        rows = np.vstack([self.system.holding(z)[:, free], gaps.slope[np.ix_(held, free)]])
        hessian = self.system.discrete.tangent(z[:count], self.system.loads(z, self.t)).toarray()
        hessian -= gaps.bent(pushes)[np.ix_(free, free)]
        residual = self.system.residual(z, self.t)
        residual[free] -= gaps.slope[:, free].T @ pushes
        matrix = np.block([[hessian, -rows.T], [rows, np.zeros((len(rows), len(rows)))]])
        step = np.linalg.solve(matrix, -np.concatenate([residual[free], residual[count:], gaps.gap[held]]))
        there, fresh = z.copy(), pushes.copy()
        there[free] += step[: len(free)]
        there[count:] += step[len(free) : len(free) + len(z) - count]
        fresh[held] += step[len(free) + len(z) - count :]
        after = self.gaps(there, gaps.stations)
        if fresh.min(initial=0.0) < 0.0 or after.stations.keys != gaps.stations.keys:
            return None
        if not self._left(there, after, fresh) < max(0.5 * self._left(z, gaps, pushes), self.tolerance):
            return None
        return there, dict(zip(gaps.stations.keys, fresh.tolist(), strict=True))

    def _slope(self, z: Array) -> Array:
        """dE (F,), the support's force apart."""
        alone = z.copy()
        alone[self.system.count :] = 0.0
        return self.system.residual(alone, self.t)[self._free]

    def _misfit(self, z: Array) -> float:
        return float(np.abs(self.system.residual(z, self.t)[self.system.count :]).sum())

    def _merit(self, z: Array, gaps: Gaps, penalty: float) -> float:
        energy = sum(self.system.discrete.energies(z[: self.system.count], self.problem))
        return energy + penalty * (float(-np.minimum(gaps.gap, 0.0).sum()) + self._misfit(z))

    def _longest(self, z: Array, step: Array) -> float:
        """The part of a step within which no section turns and no joint moves by more than it may."""
        whole = np.zeros(self.system.count)
        whole[self._free] = step
        turned = self.system.discrete.turned(whole)
        size = min(1.0, TURN / max(turned, 1e-300))
        here = Moving(self.system.discrete, self.degree, z[: self.system.count]).shape(self._nodes)[2]
        for _ in range(8):
            there = Moving(self.system.discrete, self.degree, z[: self.system.count] + size * whole)
            gone = float(np.linalg.norm(there.shape(self._nodes)[2] - here, axis=1).max())
            if gone <= 0.5 * REACH:
                break
            size *= max(0.4 * REACH / gone, 0.1)
        return size

    def _quadratic(self, z: Array, gaps: Gaps, pushes: Array) -> tuple[Array, Array, Array]:
        """Step (F,), pushes (k,) and the support's force (m,) of the quadratic problem."""
        free, count = self._free, self.system.count
        hessian = self.system.discrete.tangent(z[:count], self.system.loads(z, self.t)).toarray()
        hessian -= gaps.bent(pushes)[np.ix_(free, free)]
        slope, rows = self._slope(z), self.system.holding(z)[:, free]
        missed = self.system.residual(z, self.t)[count:]
        hessian += HOLDING * rows.T @ rows
        slope = slope + HOLDING * rows.T @ missed
        held = np.flatnonzero(pushes > 0.0)
        matrix, added = _positive(hessian, gaps.slope[np.ix_(held, free)], self._mass, self._stiff())
        if added:
            slope = slope + added * gaps.slope[np.ix_(held, free)].T @ gaps.gap[held]
        moves = gaps.slope[:, free]
        solved = scipy.linalg.cho_solve(matrix, np.column_stack([slope, rows.T, moves.T]))
        own, by_rows, by_gaps = solved[:, 0], solved[:, 1 : 1 + len(rows)], solved[:, 1 + len(rows) :]
        if len(rows):
            small = rows @ by_rows
            first = np.linalg.solve(small, rows @ own - missed)
            across = np.linalg.solve(small, rows @ by_gaps)
            step, by_gaps = -own + by_rows @ first, by_gaps - by_rows @ across
        else:
            step, first, across = -own, np.zeros(0), np.zeros((0, len(moves)))
        fresh = complementary(moves @ by_gaps, gaps.gap + moves @ step, pushes > 0.0)
        step = step + by_gaps @ fresh
        reaction = first - across @ fresh
        if added:
            fresh[held] -= added * (moves[held] @ step + gaps.gap[held])
        return step, np.maximum(fresh, 0.0), reaction

    def _stiff(self) -> float:
        """Size of negative curvature that is expected (D w / l)."""
        bent = self.problem.natural_curvature(self._nodes)
        return SHIFT * max(10.0, float(np.max(bent**2)), self.problem.load)

    def eigenvalue(self, state: Lying) -> float:
        """Lowest eigenvalue of the tangent on what keeps the end and what pushes, against int v^2."""
        free, count = self._free, self.system.count
        hessian = self.system.discrete.tangent(state.z[:count], self.system.loads(state.z, self.t)).toarray()
        hessian -= state.gaps.bent(state.pushes)[np.ix_(free, free)]
        held = [self.system.holding(state.z)[:, free], state.gaps.slope[np.ix_(np.flatnonzero(state.pushes > 0), free)]]
        rows = np.vstack(held)
        basis = scipy.linalg.null_space(rows) if len(rows) else np.eye(len(free))
        return float(scipy.linalg.eigh(basis.T @ hessian @ basis, basis.T @ self._mass @ basis,
                                       eigvals_only=True, subset_by_index=[0, 0])[0])  # fmt: skip


def _positive(hessian: Array, held: Array, mass: Array, shift: float) -> tuple[tuple[Array, bool], float]:
    """A Cholesky factor of H, or of H with what pushes held and so much of the mass as it needs; and rho."""
    added, by = 0.0, 0.0
    while True:
        try:
            return scipy.linalg.cho_factor(hessian + by * mass), added
        except np.linalg.LinAlgError:
            if not added and len(held):
                added = HOLDING
                hessian = hessian + added * held.T @ held
            else:
                by = max(GROWTH * by, shift)
        if not math.isfinite(by) or by > 1e12:
            raise np.linalg.LinAlgError("not to be made positive")


def complementary(matrix: Array, gap: Array, guess: NDArray[np.bool_]) -> Array:
    """lambda >= 0 with gap + matrix lambda >= 0, their product zero; guess (k,): what may push.

    By sets that are exchanged as a whole (M. Hintermueller, K. Ito, K. Kunisch 2003) while that settles in a few
    rounds, and else by non-negative least squares (C. Lawson, R. Hanson 1974), which always does.
    """
    count = len(gap)
    if not count:
        return np.zeros(0)
    matrix = 0.5 * (matrix + matrix.T)
    scale = float(np.trace(matrix)) / count
    matrix = matrix + 1e-13 * scale * np.eye(count)
    active = guess.copy()
    for _ in range(20):
        found = _on(matrix, gap, active)
        off = gap + matrix @ found
        again = np.where(active, found > 0.0, off < -1e-14)
        if np.array_equal(again, active):
            return found
        active = again
    factor = scipy.linalg.cholesky(matrix + 1e-12 * scale * np.eye(count))
    found, _ = scipy.optimize.nnls(factor, -scipy.linalg.solve_triangular(factor, gap, trans="T"), maxiter=20 * count)
    polished = _on(matrix, gap, found > 0.0)
    return polished if polished.min() >= 0.0 else found


def _on(matrix: Array, gap: Array, active: NDArray[np.bool_]) -> Array:
    """lambda (k,) with the gaps of a set closed, zero elsewhere."""
    found = np.zeros(len(gap))
    k = np.flatnonzero(active)
    if len(k):
        found[k] = scipy.linalg.solve(matrix[np.ix_(k, k)], -gap[k], assume_a="sym")
    return found
