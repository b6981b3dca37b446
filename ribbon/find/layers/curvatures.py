r"""Layers that lie on each other, found by the curvatures at the joints alone, with all gaps as inequalities.

Each step solves the quadratic problem (`ribbon.find.layers.quadratic`) of the energy and of all gaps within reach
(`ribbon.find.layers.bent`; J. Nocedal and S. Wright, Numerical Optimization, 2nd ed., Springer 2006, chapter 18),

    min 1/2 d H d + dE d ,   dg d + g >= 0 ,

goes downhill in energy and what is left of gaps (an exact penalty), and moves no joint by more than half the reach:
layers are seen before they are met. Where H is not positive on the way, rho/2 (dg d + g)^2 of what pushes is added,
which is zero where a step keeps it, and then a multiple of the turns' mass. The last steps are Newton's, with what
pushes held.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon import law
from ribbon.find.layers import quadratic
from ribbon.find.layers.bent import Bent, Gaps, planar_mass
from ribbon.find.layers.facing import Faced, crossed, faced
from ribbon.find.solving.request import Options, Progress
from ribbon.problems.mixed import MixedProblem
from ribbon.solvers.budget import spent

FloatArray = NDArray[np.float64]

#: Steps of a search, halvings of one, turn (rad) that a section may make in one.
_STEPS, _HALVINGS, _TURN = 300, 12, 0.5
#: Gap (l) up to which a place has its rows.
_REACH = 0.04
#: What is left of the equations, D w / l, at which it is found, over their unit, and from which steps are Newton's.
_FOUND, _NEAR = 1e-10, 1e-2
#: Gap (l) that is left where it is found.
_CLOSED = 1e-12
#: rho (D w / l^3); the part of K^2 with which the mass begins, and its growth.
_HOLDING, _SHIFT, _GROWTH = 1e6, 0.02, 5.0


@dataclass(frozen=True)
class Lain:
    """Unknowns x (n,) of a plane shape, what its places face, gaps and pushes (k,), D w / l^2, what is left of the
    equations, D w / l, and steps; found: whether nothing more is."""

    x: FloatArray
    faced: Faced
    gaps: Gaps
    pushes: FloatArray
    left: float
    steps: int
    found: bool

    @property
    def by_place(self) -> dict[tuple[float, int], float]:
        """Pushes by place and side."""
        return _by_place(self.faced, self.pushes)


class Search:
    """Of one problem, whose places are its joints and what is put between them."""

    def __init__(
        self, problem: MixedProblem, more: FloatArray, options: Options | None = None, progress: Progress | None = None
    ) -> None:
        self.problem, self._progress = problem, progress
        self._steps = int((options or {}).get("max_iter", _STEPS))
        joints = np.concatenate([[0.0], np.cumsum(problem.lengths)])
        joints[-1] = 1.0
        self.places = np.union1d(joints, more)
        self._mass = planar_mass(problem.lengths)
        bent = max(k * k for k in law.values(problem.strip.curvature))
        self._stiff = _SHIFT * max(10.0, bent, problem.strip.gamma if problem.has_gravity else 0.0)
        self._none = np.zeros(problem.lengths.size + 1)

    def settle(self, x: FloatArray, known: dict[tuple[float, int], float], tolerance: float) -> Lain:
        """The equilibrium downhill of x (n,), whose places push by `known` (by place and side) to begin with."""
        now = self._seen(self.problem.state(x[self.problem.layout.omega], self._none))
        own = _given(now[0], known)
        for count in range(self._steps + 1):
            there, gaps = now
            bent = Bent(self.problem, gaps.x)
            slopes = gaps.slopes(bent)
            left = float(np.abs(bent.gradient - slopes.T @ own).max())
            found = left <= tolerance and _closed(gaps.gap, own)
            if self._progress is not None:
                self._progress(count, self.problem.value(gaps.x), left)
            if found or count == self._steps or spent():
                break
            kept = gaps.gap[own == 0.0].min(initial=0.0) >= -_CLOSED
            moved = self._newton(bent, now, slopes, own, left, tolerance) if left < _NEAR and kept else None
            moved = moved or self._step(bent, now, slopes, own)
            if moved is None:
                break
            now, own = moved
        return Lain(gaps.x, there, gaps, own, left, count, found)

    def _seen(self, x: FloatArray) -> tuple[Faced, Gaps]:
        there = faced(self.problem, x, self.places, _REACH)
        rows = self.problem.with_changes(pairs=there.pairs).pair_rows() if there.pairs else None
        return there, Gaps(rows, x)

    def _merit(self, gaps: Gaps, penalty: float) -> float:
        return self.problem.value(gaps.x) - penalty * float(np.minimum(gaps.gap, 0.0).sum())

    def _step(
        self, bent: Bent, now: tuple[Faced, Gaps], slopes: FloatArray, own: FloatArray
    ) -> tuple[tuple[Faced, Gaps], FloatArray] | None:
        """What is seen and pushes after a step; None: none goes downhill."""
        there, gaps = now
        held = np.flatnonzero(own > 0.0)
        factor, added = self._positive(bent.hessian(gaps, own), slopes[held])
        gradient = bent.gradient
        gap = gaps.gap
        if added:
            gradient = gradient + added * slopes[held].T @ gap[held]
        step, fresh = quadratic.least(factor, gradient, slopes, gap, own > 0.0)
        if added:
            fresh[held] = np.maximum(fresh[held] - added * (slopes[held] @ step + gap[held]), 0.0)
        size, far = self._longest(gaps.x, step)
        penalty = 2.0 * max(float(fresh.max(initial=0.0)), 1.0)
        before = self._merit(gaps, penalty)
        rate = float(bent.gradient @ step) + penalty * float(np.minimum(gap, 0.0).sum())
        omega = gaps.x[self.problem.layout.omega]
        for _ in range(_HALVINGS):
            after = self._seen(self.problem.state(omega + size * step, self._none))
            less = before + min(1e-4 * size * rate, 0.0) + 1e-12 * max(1.0, abs(before))
            if self._merit(after[1], penalty) <= less and not crossed(there, after[0], 2.0 * far + self._long):
                mixed = _by_place(there, own + size * (fresh - own))
                return after, _given(after[0], mixed)
            size, far = 0.5 * size, 0.5 * far
        return None

    @property
    def _long(self) -> float:
        return float(self.problem.lengths.max())

    def _newton(
        self, bent: Bent, now: tuple[Faced, Gaps], slopes: FloatArray, own: FloatArray, left: float, tolerance: float
    ) -> tuple[tuple[Faced, Gaps], FloatArray] | None:
        """The same after Newton's step with what pushes held; None: something pulls, or what is left grows."""
        there, gaps = now
        held = np.flatnonzero(own > 0.0)
        rows, m = slopes[held], self._none.size
        matrix = np.block([[bent.hessian(gaps, own), -rows.T], [rows, np.zeros((held.size, held.size))]])
        residual = np.concatenate([bent.gradient - slopes.T @ own, gaps.gap[held]])
        try:
            step = np.linalg.solve(matrix, -residual)
        except np.linalg.LinAlgError:
            return None
        fresh = own.copy()
        fresh[held] += step[m:]
        if self._longest(gaps.x, step[:m])[0] < 1.0 or fresh.min(initial=0.0) < 0.0:
            return None
        after = self._seen(self.problem.state(gaps.x[self.problem.layout.omega] + step[:m], self._none))
        fresh = _given(after[0], _by_place(there, fresh))
        behind = Bent(self.problem, after[1].x)
        again = float(np.abs(behind.gradient - after[1].slopes(behind).T @ fresh).max())
        return (after, fresh) if again < max(0.5 * left, tolerance) else None

    def _longest(self, x: FloatArray, step: FloatArray) -> tuple[float, float]:
        """The part of a step in which no section turns and no joint goes farther than it may, and how far one goes."""
        layout, lengths = self.problem.layout, self.problem.lengths
        turned = np.cumsum(0.5 * (step[1:] + step[:-1]) * lengths)
        size = min(1.0, _TURN / max(float(np.abs(turned).max()), 1e-300))
        here, omega = layout.positions(x), x[layout.omega]
        for _ in range(8):
            there = layout.positions(self.problem.state(omega + size * step, self._none))
            far = float(np.linalg.norm(there - here, axis=1).max())
            if far <= 0.5 * _REACH:
                break
            size *= max(0.4 * _REACH / far, 0.1)
        return size, far

    def _positive(self, hessian: FloatArray, held: FloatArray) -> tuple[tuple[FloatArray, bool], float]:
        """A Cholesky factor of H, of H with what pushes held, or with so much of the mass as it needs; and rho."""
        added, by = 0.0, 0.0
        while True:
            try:
                return scipy.linalg.cho_factor(hessian + by * self._mass), added
            except np.linalg.LinAlgError:
                if not added and len(held):
                    added = _HOLDING
                    hessian = hessian + added * held.T @ held
                else:
                    by = max(_GROWTH * by, self._stiff)
            if not by < 1e12:
                raise np.linalg.LinAlgError("not to be made positive")


def _closed(gap: FloatArray, pushes: FloatArray) -> bool:
    """Whether nothing is too near, nothing pulls, and what pushes touches."""
    off = np.abs(np.where(pushes > 0.0, gap, np.minimum(gap, 0.0)))
    return bool(off.max(initial=0.0) <= _CLOSED and pushes.min(initial=0.0) >= 0.0)


def _by_place(there: Faced, pushes: FloatArray) -> dict[tuple[float, int], float]:
    """Pushes by place and side."""
    return {(pair.s, int(side)): float(push) for pair, side, push in zip(there.pairs, there.side, pushes, strict=True)}


def _given(there: Faced, known: dict[tuple[float, int], float]) -> FloatArray:
    """Pushes (k,) of what is faced, zero where none is known."""
    return np.array([known.get((pair.s, int(side)), 0.0) for pair, side in zip(there.pairs, there.side, strict=True)])
