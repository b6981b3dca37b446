"""Newton's steps to the stationary point beside a shape of many segments that few have given, and what is sudden first.

From a shape that is prolonged from half as many segments (`ribbon.problems.prolonged`) two things are missing: what
bends smoothly, which one step settles, and events, where |eta'| comes near 2/w over a few segments and the energy is
far from quadratic. They would cost steps of the whole strip; so between those the windows around them are solved on
their own, what is beyond held (nonlinear elimination: Lanzkron, Rose and Wilkes 1996, doi:10.1137/S106482759325154X).
Slopes move in xi, ``n = 2/w tanh xi``, which knows no bound::

    K = H + diag(D) ,  D = dL/dn n'' / n'^2 = -2 dL/dn (n w/2) / (2/w (1 - (n w/2)^2)) ,   d xi = dn / n'

(n', n'': by xi; dL/dn: of the Lagrangian, zero at last). D is not followed below half of what it is added to. There is
no line search and no barrier: what does not end in a few steps, at a point with the inertia of a minimum, is not
followed (None), and who asks goes another way.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbon import law
from ribbon.problems import mixed_kernels as kernels
from ribbon.problems.layout import ETA, JOINT, OMEGA, STRIDE
from ribbon.problems.mixed import MixedProblem
from ribbon.solvers import budget
from ribbon.solvers.frontal import Factor
from ribbon.solvers.problem import NEWTON, FloatArray, Minimum
from ribbon.solvers.saddle import Saddle
from ribbon.strip import NATURAL

BoolArray = NDArray[np.bool_]

#: Steps of the whole strip and of a window, at the most.
MOST, _MOST_INSIDE = 12, 16
#: Largest change of xi in a step.
_LONGEST = 1.5
#: A segment is in a window where its residual exceeds this part of the largest, and so many beside it are.
_SUDDEN, _BESIDE = 1e-3, 8
#: Most of the segments that may be in windows, and the residual to which those are solved (over the largest before).
_SHARE, _INSIDE = 0.2, 1e-4
#: Part of the Hessian's diagonal that D may take away; mean of the multipliers above which residuals are over it.
_TAKES, _MEAN = 0.5, 100.0
#: Part of a bound within which an unknown stands on it.
_ON = 1e-6
#: Residual of the systems, over their right sides.
_SOLVED = 1e-11
#: Residual below which a step is made by the factor of the one before, and nothing is sudden any more; part of the
#: residual before to which it has to have fallen for that.
_ENDING, _FALLS = 1e-7, 0.1


class Iterate:
    """A point of a problem of equalities: x (n,), y (m,), and what is of first order there.

    free (n,), rows (m,): what is asked; the rest stays. negative: eigenvalues below zero of H on the rows at the point
    of the last `step`, which `again` leaves as they are (-1: not to be told)."""

    def __init__(self, problem: Any, free: BoolArray, rows: BoolArray) -> None:
        self.problem, self.free, self.rows = problem, free, rows
        self.saddle = Saddle(problem, free, rows)
        self.row, self.column = problem.jacobian_structure()
        self.target = problem.constraint_bounds()[0]
        steepest = problem.bounds()[1]
        slopes = np.zeros(problem.size, dtype=bool)
        slopes[problem.layout.slope] = True
        slopes &= np.isfinite(steepest) & free
        self.slopes = np.nonzero(slopes)[0]
        self.most = steepest[self.slopes]
        one, other = problem.hessian_structure()
        on = np.nonzero((one == other) & slopes[one])[0]
        self.on, self.on_slope = on, one[on]
        self.negative = 0
        self._factor: Factor | None = None
        self.pull = np.zeros(problem.size)

    def at(self, x: FloatArray, y: FloatArray) -> float:
        """The largest residual at x, y; nan where there is none."""
        problem = self.problem
        self.x, self.y = x, y
        self.jacobian = problem.jacobian(x)
        self.slope = problem.gradient(x) + self.pull
        self.slope += np.bincount(self.column, self.jacobian * y[self.row], minlength=problem.size)
        self.slope[~self.free] = 0.0
        self.missing = (problem.constraints(x) - self.target)[self.rows]
        worst = max(float(np.abs(self.slope).max(initial=0.0)), float(np.abs(self.missing).max(initial=0.0)))
        return worst if np.isfinite(self.slope).all() and np.isfinite(self.missing).all() else np.nan

    def step(self) -> tuple[FloatArray, FloatArray]:
        """The next x and y; `negative`: eigenvalues below zero of H on the rows here."""
        self._factor = None  # its room is that of the next
        self._factor = self._factored()
        return self.again()

    def again(self) -> tuple[FloatArray, FloatArray]:
        """The next x and y by the factor of the last `step`, which costs a fifth and near the end gains nearly as much
        (a chord: Ortega and Rheinboldt 1970, 7.2)."""
        factor = self._factor
        assert factor is not None
        here = self.x[self.slopes] / self.most
        rest = self.most * (1.0 - here * here)
        right = np.concatenate([-self.slope[self.free], -self.missing])
        found = factor.solve(right, 1, _SOLVED)
        x, y = self.x.copy(), self.y.copy()
        x[self.free] += found[: self.saddle.unknowns]
        change = np.clip((x[self.slopes] - self.x[self.slopes]) / rest, -_LONGEST, _LONGEST)
        x[self.slopes] = self.most * np.tanh(np.arctanh(here) + change)
        y[self.rows] += found[self.saddle.unknowns :]
        return x, y

    def _factored(self) -> Factor:
        """K at x, y."""
        problem, saddle = self.problem, self.saddle
        here = self.x[self.slopes] / self.most
        rest = self.most * (1.0 - here * here)
        hessian = problem.hessian(self.x, self.y)
        extra = np.zeros(problem.size)
        stiff = np.bincount(self.on_slope, hessian[self.on], minlength=problem.size)[self.slopes]
        extra[self.slopes] = np.maximum(-2.0 * self.slope[self.slopes] * here / rest, -_TAKES * np.maximum(stiff, 0.0))
        factor = saddle.factor(hessian, self.jacobian, extra[self.free])
        self.negative = factor.negative - saddle.count + factor.zero if factor.finite else -1
        return factor


def minimum_near(problem: MixedProblem, x: FloatArray, rows: FloatArray, tolerance: float) -> Minimum | None:
    """The minimum beside x (n,) with multipliers rows (m,), to a residual of `tolerance`; None where it is not found.

    Its `residual` is the largest, without scale. problem: without walls. No bound is active there: the energy is
    infinite on them, or there is none. Where multipliers are large so is their rounding: the residual is then measured
    as Ipopt does, over their mean. Its inertia is counted where the last system was factored: one step before x, or two
    and more where the last ones were made with the same factor (`Iterate.again`), which begin at residuals below
    `_ENDING`; never before windows were solved on their own.
    """
    return _near(problem, x, rows, tolerance, True)


def stationary_near(problem: MixedProblem, x: FloatArray, tolerance: float) -> Minimum | None:
    """The stationary point beside the shape x (n,), a minimum or not; else as `minimum_near`.

    Its first multipliers are those that leave the least of the gradient: of ``[1, A^T; A, 0] [d; y] = [-g; 0]``.
    Slopes that stand on their bounds stay there, where the energy is finite on them (Sadowsky's).
    """
    lower, upper = problem.bounds()
    x = np.where(x >= (1.0 - _ON) * upper, upper, np.where(x <= (1.0 - _ON) * lower, lower, x))
    free, rows = (lower < x) & (x < upper), np.ones(problem.row_count, dtype=bool)
    saddle = Saddle(problem, free, rows)
    factor = saddle.factor(np.zeros_like(problem.hessian_structure()[0], dtype=float), problem.jacobian(x), 1.0)
    found = factor.solve(np.concatenate([-problem.gradient(x)[free], np.zeros(saddle.count)]), 1, _SOLVED)
    return _near(problem, x, found[saddle.unknowns :], tolerance, False, free)


def _near(
    problem: MixedProblem,
    x: FloatArray,
    rows: FloatArray,
    tolerance: float,
    least: bool,
    free: BoolArray | None = None,
) -> Minimum | None:
    """The stationary point beside x (n,), a minimum where it has to be the `least`; free (n,): what is not held, None:
    all but what has no room between its bounds."""
    clock = time.perf_counter()
    lower, upper = problem.bounds()
    at = Iterate(problem, lower < upper if free is None else free, np.ones(problem.row_count, dtype=bool))
    if not np.all(np.abs(x[at.slopes]) < at.most):
        return None
    y = rows
    worst = at.at(x, y)
    count, last = 0, np.inf
    stale = True  # whether x was moved since the last factor by more than steps
    while True:
        scale = max(1.0, float(np.abs(y).mean()) / _MEAN)
        if worst <= tolerance * scale and (count == 0 or not stale):
            break
        if count == MOST or not np.isfinite(worst) or budget.spent():
            return None
        before = worst
        x, y = at.again() if not stale and worst <= min(_ENDING * scale, _FALLS * last) else at.step()
        count, last, stale = count + 1, before, False
        worst = at.at(x, y)
        if max(10.0 * tolerance, _ENDING) * scale < worst < np.inf:
            changed = _windows(at)
            if changed is not None:
                (x, y), stale = changed, True
                worst = at.at(x, y)
    if least and (at.negative != 0 or count == 0):
        return None
    pushed = np.zeros(problem.size)
    if free is not None and np.any(held := (lower < upper) & ~free):
        pushed[held] = (problem.gradient(x) + problem.jacobian_matrix(x).T @ y)[held]
    return Minimum(
        x=x, multipliers=pushed, rows=y, residual=worst, iterations=count, code=0,
        message="Newton's iteration converged from a shape beside.", finished=True,
        seconds=time.perf_counter() - clock, solver=NEWTON,
    )  # fmt: skip


def _windows(at: Iterate) -> tuple[FloatArray, FloatArray] | None:
    """x and y with what is sudden solved, window by window, what is beyond held; None where nothing stands out."""
    problem = at.problem
    p = problem.lengths.size
    sizes = np.abs(at.slope[: STRIDE * p]).reshape(p, STRIDE).max(axis=1)
    np.maximum(sizes, np.abs(at.missing[: kernels.ROWS * p]).reshape(p, kernels.ROWS).max(axis=1), out=sizes)
    loud = sizes > _SUDDEN * sizes.max()
    near = np.convolve(loud, np.ones(2 * _BESIDE + 1), "same") > 0.5
    if not 0 < near.sum() <= _SHARE * p:
        return None
    x, y = at.x.copy(), at.y.copy()
    least = _INSIDE * float(sizes.max())
    changed = False
    for first, last in _runs(near):
        changed |= _solved(at, x, y, first, last, least)
    return (x, y) if changed else None


def _runs(chosen: BoolArray) -> Iterator[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], chosen.astype(int), [0]])))
    return zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)


def _solved(at: Iterate, x: FloatArray, y: FloatArray, first: int, last: int, least: float) -> bool:
    """Solves segments first ... last - 1 in x and y, their end joints held; whether that was possible."""
    problem: MixedProblem = at.problem
    p, k = problem.lengths.size, last - first
    part = _part(problem, first, last)
    columns = _columns(problem, first, last)
    end = STRIDE * k
    free = np.zeros(part.size, dtype=bool)
    free[JOINT : end + JOINT] = True
    free[end + OMEGA] = False
    if problem.fields.in_plane:
        sideways = part.layout.sideways
        free[sideways.start + 1 : sideways.stop - 1] = True
    if problem.closure is None:
        free[OMEGA] |= first == 0
        free[ETA] |= first == 0
        free[end + OMEGA] |= last == p
    free &= at.free[columns]
    glue = slice(kernels.ROWS * first, kernels.ROWS * last)
    rows = np.zeros(part.row_count, dtype=bool)
    rows[: kernels.ROWS * k] = True
    inside = Iterate(part, free, rows)
    multipliers = np.zeros(part.row_count)
    multipliers[rows] = y[glue]
    z = x[columns]
    inside.at(z, multipliers)
    inside.pull[end : end + JOINT] = (at.slope[columns] - inside.slope)[end : end + JOINT]
    inside.pull[[OMEGA, ETA]] = (at.slope[columns] - inside.slope)[[OMEGA, ETA]]
    for _ in range(_MOST_INSIDE):
        worst = inside.at(z, multipliers)
        if not worst > least:
            break
        z, multipliers = inside.step()
    if not worst <= least or inside.negative != 0:
        return False
    x[columns], y[glue] = z, multipliers[rows]
    return True


def _part(problem: MixedProblem, first: int, last: int) -> MixedProblem:
    """The segments first ... last - 1 as a ribbon of their own that nothing holds, curved as they are."""
    strip = problem.strip
    if problem.has_natural_curvature:
        ends = [float(problem.lengths[:k].sum()) for k in (first, last)]
        own = [law.scaled(law.part(one, *ends), 1.0 / strip.length) for one in strip.rest]
        changed: dict[str, Any] = dict(zip(NATURAL, own, strict=True))
        strip = replace(strip, **changed)
    return problem.with_changes(
        strip=strip, lengths=problem.lengths[first:last], start=None, end=None, closure=None, tip=None, box=None
    )


def _columns(problem: MixedProblem, first: int, last: int) -> NDArray[np.int64]:
    """Columns in the whole problem of the unknowns of a part of it."""
    own = np.arange(STRIDE * first, STRIDE * last + JOINT)
    if not problem.fields.in_plane:
        return own
    sideways = problem.layout.sideways.start
    return np.concatenate([own, np.arange(sideways + first, sideways + last + 1)])
