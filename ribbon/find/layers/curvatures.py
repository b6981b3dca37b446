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
from numpy.typing import NDArray

from ribbon import law
from ribbon.find.layers import quadratic
from ribbon.find.layers.bent import Bent, Gaps, planar_mass
from ribbon.find.layers.ends import Ends, Tied
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
#: Gap (l), and what is missing at a clamped end (l, rad), that is left where it is found; steps back to that clamp.
_CLOSED, _BACK = 1e-12, 30
#: The part of K^2 with which the mass begins.
_SHIFT = 0.02


@dataclass(frozen=True)
class Lain:
    """Unknowns x (n,) of a plane shape, what its places face, gaps and pushes (k,), D w / l^2, what holds its end, what
    is left of the equations, D w / l, and steps; found: whether nothing more is."""

    x: FloatArray
    faced: Faced
    gaps: Gaps
    pushes: FloatArray
    nu: FloatArray
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
        self.ends = Ends(problem)
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
        now = self._seen(self._begun(x[self.problem.layout.omega]))
        own = _given(now[0], known)
        for count in range(self._steps + 1):
            there, gaps = now
            bent = Bent(self.problem, gaps.x)
            slopes = gaps.slopes(bent)
            free = bent.gradient - slopes.T @ own
            tied = self.ends.tied(bent.moves, free)
            left = float(np.abs(free - tied.nu @ tied.slopes).max())
            found = left <= tolerance and _closed(gaps.gap, own) and self._is_tied(gaps.x)
            if self._progress is not None:
                self._progress(count, self.problem.value(gaps.x), left)
            if found or count == self._steps or spent():
                break
            kept = gaps.gap[own == 0.0].min(initial=0.0) >= -_CLOSED
            moved = self._newton(bent, now, slopes, own, tied, left, tolerance) if left < _NEAR and kept else None
            moved = moved or self._step(bent, now, slopes, own, tied)
            if moved is None:
                break
            now, own = moved
        return Lain(gaps.x, there, gaps, own, tied.nu, left, count, found)

    def _is_tied(self, x: FloatArray) -> bool:
        """Whether the end is where its clamp is."""
        return bool(np.abs(self.ends.off(x)).max(initial=0.0) <= _CLOSED)

    def _begun(self, omega: FloatArray) -> FloatArray:
        """Unknowns (n,) of the shape of curvatures (p + 1,) with its end brought to its clamp, as far as it goes."""
        x = self.problem.state(omega, self._none)
        for _ in range(_BACK if self.ends.count else 0):
            if self._is_tied(x):
                break
            slopes, off = self.ends.slopes(Bent(self.problem, x).moves), self.ends.off(x)
            step = -np.linalg.lstsq(slopes, off, rcond=None)[0]
            size, _ = self._longest(x, step)
            x = self.problem.state(x[self.problem.layout.omega] + size * step, self._none)
        return x

    def _back(self, omega: FloatArray, tied: Tied) -> FloatArray | None:
        """Unknowns (n,) of curvatures (p + 1,) put back on the clamp at the end, with what was tied beside them; None:
        they are too far from it."""
        x = self.problem.state(omega, self._none)
        if not self.ends.count:
            return x
        before, inverse = np.inf, np.linalg.pinv(tied.slopes)
        for _ in range(_BACK):
            off = self.ends.off(x)
            much = float(np.abs(off).max())
            if much < 1e-2 * _CLOSED or not much < before:
                break
            before, omega = much, omega - inverse @ off
            x = self.problem.state(omega, self._none)
        return x if self._is_tied(x) else None

    def _seen(self, x: FloatArray) -> tuple[Faced, Gaps]:
        there = faced(self.problem, x, self.places, _REACH)
        rows = self.problem.with_changes(pairs=there.pairs).pair_rows() if there.pairs else None
        return there, Gaps(rows, x)

    def _merit(self, gaps: Gaps, penalty: float) -> float:
        return self.problem.value(gaps.x) - penalty * float(np.minimum(gaps.gap, 0.0).sum())

    def _step(
        self, bent: Bent, now: tuple[Faced, Gaps], slopes: FloatArray, own: FloatArray, tied: Tied
    ) -> tuple[tuple[Faced, Gaps], FloatArray] | None:
        """What is seen and pushes after a step; None: none goes downhill."""
        there, gaps = now
        held = np.flatnonzero(own > 0.0)
        hessian = bent.hessian(gaps, own, self.ends.pull(tied.nu))
        try:
            factor, added = quadratic.positive(
                tied.along.T @ hessian @ tied.along, slopes[held] @ tied.along,
                tied.along.T @ self._mass @ tied.along, self._stiff,
            )  # fmt: skip
        except np.linalg.LinAlgError:
            return None
        gradient = bent.gradient
        gap = gaps.gap
        if added:
            gradient = gradient + added * slopes[held].T @ gap[held]
        along, fresh = quadratic.least(factor, gradient @ tied.along, slopes @ tied.along, gap, own > 0.0)
        step = tied.along @ along
        if added:
            fresh[held] = np.maximum(fresh[held] - added * (slopes[held] @ step + gap[held]), 0.0)
        size, far = self._longest(gaps.x, step)
        penalty = 2.0 * max(float(fresh.max(initial=0.0)), 1.0)
        before = self._merit(gaps, penalty)
        rate = float(bent.gradient @ step) + penalty * float(np.minimum(gap, 0.0).sum())
        omega = gaps.x[self.problem.layout.omega]
        for _ in range(_HALVINGS):
            there_x = self._back(omega + size * step, tied)
            if there_x is None:
                size, far = 0.5 * size, 0.5 * far
                continue
            after = self._seen(there_x)
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
        self, bent: Bent, now: tuple[Faced, Gaps], slopes: FloatArray, own: FloatArray, tied: Tied, left: float,
        tolerance: float,
    ) -> tuple[tuple[Faced, Gaps], FloatArray] | None:  # fmt: skip
        """The same after Newton's step with what pushes held; None: something pulls, or what is left grows."""
        there, gaps = now
        held = np.flatnonzero(own > 0.0)
        rows, m = np.concatenate([slopes[held], tied.slopes]), self._none.size
        hessian = bent.hessian(gaps, own, self.ends.pull(tied.nu))
        matrix = np.block([[hessian, -rows.T], [rows, np.zeros((len(rows), len(rows)))]])
        free = bent.gradient - slopes.T @ own - tied.nu @ tied.slopes
        residual = np.concatenate([free, gaps.gap[held], self.ends.off(gaps.x)])
        try:
            step = np.linalg.solve(matrix, -residual)
        except np.linalg.LinAlgError:
            return None
        fresh = own.copy()
        fresh[held] += step[m : m + held.size]
        if self._longest(gaps.x, step[:m])[0] < 1.0 or fresh.min(initial=0.0) < 0.0:
            return None
        x = self._back(gaps.x[self.problem.layout.omega] + step[:m], tied)
        if x is None:
            return None
        after = self._seen(x)
        fresh = _given(after[0], _by_place(there, fresh))
        behind = Bent(self.problem, after[1].x)
        free = behind.gradient - after[1].slopes(behind).T @ fresh
        held_there = self.ends.tied(behind.moves, free)
        again = float(np.abs(free - held_there.nu @ held_there.slopes).max())
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
