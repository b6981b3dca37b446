"""Newton's iteration for problems with rows: primal-dual interior point along the strip, by inertia.

The algorithm is Ipopt's (Waechter and Biegler 2006, doi:10.1007/s10107-004-0559-y; numbers of equations are theirs)
with its defaults and a monotone barrier, so that both go the same way from the same start; the linear algebra is
`ribbon.solvers.saddle`'s, and nothing is dense. With w = (x, t), t the slacks of one-sided rows (c(x) - t = 0), and
distances to bounds w - l, u - w > 0 the barrier problem is::

    min  phi(w) = f(x) - mu sum ln(w - l) - mu sum ln(u - w)    subject to  c(x) - t = 0

A step solves, after elimination of z and t (S = z_l / (w - l) + z_u / (u - w), per unknown)::

    [ H + S_x + delta , A^T                       ] [ dx ]     [ grad phi_x + A^T y      ]
    [ A               , -delta_c | -1/(S_t+delta) ] [ dy ] = - [ c | c + r_t/(S_t+delta) ]

delta is raised until the matrix has as many negative eigenvalues as rows (algorithm IC). Steps go to a fraction 1 - tau
of the bounds, and are accepted by a filter of (violation, phi), with second-order corrections. There is no restoration:
where no step is accepted delta is raised further, and where that does not help it ends, and says so
(`ribbon.solvers.choose` then asks Ipopt).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from ribbon.solvers import budget
from ribbon.solvers.frontal import Factor
from ribbon.solvers.problem import (
    NEWTON,
    OF_SLACK,
    ConstrainedProblem,
    FloatArray,
    Minimum,
    kkt_residual,
    slack_of,
)
from ribbon.solvers.saddle import Saddle

#: What it knows of Ipopt's options, with its defaults here; and "reach", of its own: how far an unknown may go in a
#: step, over 1 + its size. Longer steps are shortened by raising delta (Levenberg and Marquardt), which turns them
#: towards steepest descent along the rows: the iteration stays in the basin it begins in. "travel": the same, how far
#: (l) a place of the strip may go in a step. None: as far as they lead. "sliding": the least delta, with which it ends
#: at an error of `_SLIDES`.
OPTIONS: dict[str, Any] = {
    "tol": 1e-10,
    "max_iter": 1000,
    "mu_init": 1e-4,
    "reach": None,
    "travel": None,
    "sliding": 0.0,
}
#: Which of them Ipopt does not know.
OWN = ("reach", "travel", "sliding")
#: Ipopt's codes for how it ended.
SOLVED, SMALL, MOST, STOPPED, NO_STEP, NOT_FINITE = 0, 3, -1, 5, -2, -13
MESSAGES = {
    SOLVED: "Newton's iteration converged.",
    SMALL: "Newton's iteration ended where steps are lost in rounding.",
    MOST: "Newton's iteration made all the steps that were allowed.",
    STOPPED: "Newton's iteration ended with the budget of time.",
    NO_STEP: "Newton's iteration found no acceptable step.",
    NOT_FINITE: "Newton's iteration met numbers that are not finite.",
}
_EPS = float(np.finfo(float).eps)
_PUSH, _WARM_PUSH, _WARM_MU = 1e-2, 1e-10, 1e-10
_KAPPA_EPS, _KAPPA_MU, _THETA_MU, _TAU_MIN, _KAPPA_SIGMA, _KAPPA_D, _S_MAX = 10.0, 0.2, 1.5, 0.99, 1e10, 1e-5, 100.0
_GAMMA_THETA, _GAMMA_PHI, _S_PHI, _S_THETA, _ETA, _GAMMA_ALPHA, _KAPPA_SOC, _SOC = (
    1e-5, 1e-8, 2.3, 1.1, 1e-8, 0.05, 0.99, 4,
)  # fmt: skip
_DELTA_FIRST, _DELTA_LEAST, _DELTA_MOST, _MOST_MULTIPLIER = 1e-4, 1e-20, 1e20, 1e3
#: Error (5) at which it ends with strands that touch, and delta: they may slide along themselves at next to no energy,
#: and how far is then rounding's.
_SLIDES, SLIDING = 1e-8, 1e-7
_TINY_STEP, _LEAST = 10.0 * _EPS, 1e-20
#: Shifts delta that are tried where no step is accepted: they turn it to the nearest point that satisfies the rows.
_SHORTER = (1e-2, 1.0, 1e2, 1e4)
#: Shifts delta that keep a step within a reach: the first, their growth, the last.
_DELTA_REACH, _DAMPED, _DELTA_REACH_MOST = 1e-3, 4.0, 1e6


class _Problem:
    """The problem in w = (free x, slacks), with c(w) = 0."""

    def __init__(self, problem: Any, start: FloatArray) -> None:
        self.problem = problem
        lower, upper = problem.bounds()
        self.free = lower < upper
        self.whole = np.clip(start, lower, upper)
        below, above = problem.constraint_bounds()
        self.one_sided = np.nonzero(below < above)[0]
        self.target = np.where(below < above, 0.0, below)
        self.n, self.m, self.k = int(self.free.sum()), below.size, self.one_sided.size
        self.lower = np.concatenate([lower[self.free], below[self.one_sided]])
        self.upper = np.concatenate([upper[self.free], above[self.one_sided]])
        self.left, self.right = np.nonzero(np.isfinite(self.lower))[0], np.nonzero(np.isfinite(self.upper))[0]
        self.only_left = np.isin(self.left, self.right, invert=True)
        self.only_right = np.isin(self.right, self.left, invert=True)
        self.l, self.u = self.lower[self.left], self.upper[self.right]
        self.saddle = Saddle(problem, self.free)
        number = np.where(self.free, np.cumsum(self.free) - 1, -1)
        rows, columns = problem.jacobian_structure()
        self.kept = np.nonzero(number[columns] >= 0)[0]
        self.rows, self.columns = rows[self.kept], number[columns][self.kept]

    def x(self, w: FloatArray) -> FloatArray:
        out = self.whole.copy()
        out[self.free] = w[: self.n]
        return out

    def inside(self, w: FloatArray, push: float) -> FloatArray:
        """w at some distance from its bounds (3.6 of the paper)."""
        width = push * (self.upper - self.lower)
        low, high = self.lower.copy(), self.upper.copy()
        low[self.left] += np.minimum(push * np.maximum(1.0, np.abs(self.l)), width[self.left])
        high[self.right] -= np.minimum(push * np.maximum(1.0, np.abs(self.u)), width[self.right])
        return np.clip(w, low, high)

    def distances(self, w: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distances from lower and upper bounds; where rounding leaves none, a little."""
        return np.maximum(w[self.left] - self.l, _LEAST), np.maximum(self.u - w[self.right], _LEAST)

    def rows_of(self, x: FloatArray, w: FloatArray) -> FloatArray:
        """c(w) (m,)."""
        c: FloatArray = self.problem.constraints(x) - self.target
        c[self.one_sided] -= w[self.n :]
        return c

    def barrier(self, w: FloatArray, x: FloatArray, mu: float) -> float:
        """phi(w), with the small term that keeps one-sided unknowns bounded (section 3.7)."""
        a, b = self.distances(w)
        damping = float(a[self.only_left].sum() + b[self.only_right].sum())
        return float(self.problem.value(x) - mu * (np.log(a).sum() + np.log(b).sum()) + _KAPPA_D * mu * damping)

    def against(self, values: FloatArray, y: FloatArray) -> FloatArray:
        """A^T y in w."""
        out = np.empty(self.n + self.k)
        out[: self.n] = np.bincount(self.columns, values * y[self.rows], minlength=self.n)
        out[self.n :] = -y[self.one_sided]
        return out

    def reach(self, w: FloatArray, share: float | None, travel: float | None) -> FloatArray | None:
        """How far each of w may go in a step, by a share of its size and a travel of places; None: no end."""
        if share is None and travel is None:
            return None
        out = np.full(w.size, np.inf) if share is None else share * (1.0 + np.abs(w))
        if travel is not None:
            whole = self.problem.limits(travel)
            out[: self.n] = np.minimum(out[: self.n], whole[self.free])
        return out

    def spread(self, z_l: FloatArray, z_u: FloatArray) -> FloatArray:
        """z_l - z_u in w."""
        out = np.zeros(self.n + self.k)
        out[self.left] += z_l
        out[self.right] -= z_u
        return out


class _Iteration:
    """State of the iteration: w, y, z_l, z_u, and what is known there."""

    def __init__(self, p: _Problem, w: FloatArray, mu: float, tolerance: float) -> None:
        self.p, self.w, self.mu, self.tolerance = p, w, mu, tolerance
        self.tau = max(_TAU_MIN, 1.0 - mu)
        self.y, self.z_l, self.z_u = np.zeros(p.m), np.ones(p.left.size), np.ones(p.right.size)
        self.filter: list[tuple[float, float]] = []
        self.last_delta = self.damping = 0.0
        self.theta_most = self.theta_least = -1.0
        self.moved()

    def moved(self) -> None:
        """Everything of first order at the new w."""
        p = self.p
        self.xx = p.x(self.w)
        self.c = p.rows_of(self.xx, self.w)
        self.slope = np.zeros(p.n + p.k)
        self.slope[: p.n] = p.problem.gradient(self.xx)[p.free]
        self.jacobian = p.problem.jacobian(self.xx)
        self.values = self.jacobian[p.kept]
        self.a, self.b = p.distances(self.w)

    def error(self, mu: float) -> float:
        """E_mu (5)."""
        p = self.p
        dual = self.slope + p.against(self.values, self.y) - p.spread(self.z_l, self.z_u)
        z = float(self.z_l.sum() + self.z_u.sum())
        count = p.left.size + p.right.size
        s_d = max(_S_MAX, (float(np.abs(self.y).sum()) + z) / max(1, p.m + count)) / _S_MAX
        s_c = max(_S_MAX, z / max(1, count)) / _S_MAX
        self.dual = float(np.abs(dual).max(initial=0.0))
        complementary = max(
            float(np.abs(self.a * self.z_l - mu).max(initial=0.0)),
            float(np.abs(self.b * self.z_u - mu).max(initial=0.0)),
        )
        return max(self.dual / s_d, float(np.abs(self.c).max(initial=0.0)), complementary / s_c)

    def barrier_slope(self) -> FloatArray:
        """grad phi in w."""
        p, mu = self.p, self.mu
        out = self.slope.copy()
        out[p.left] -= mu / self.a
        out[p.right] += mu / self.b
        out[p.left[p.only_left]] += _KAPPA_D * mu
        out[p.right[p.only_right]] -= _KAPPA_D * mu
        return out

    def least_squares_multipliers(self) -> None:
        """y that makes the gradient of the Lagrangian small (36), or zero where that is large."""
        p = self.p
        soft = np.zeros(p.m)
        soft[p.one_sided] = 1.0
        none = np.zeros(p.problem.hessian_structure()[0].size)
        factor = p.saddle.factor(none, self.jacobian, 1.0, soft)
        rest = self.slope - p.spread(self.z_l, self.z_u)
        right = np.zeros(p.n + p.m)
        right[: p.n] = -rest[: p.n]
        right[p.n + p.one_sided] = -rest[p.n :]
        y = factor.solve(right)[p.n :]
        small = np.all(np.isfinite(y)) and float(np.abs(y).max(initial=0.0)) <= _MOST_MULTIPLIER
        self.y = y if small else np.zeros(p.m)

    def warm(self, distances: FloatArray, rows: FloatArray, bounds: FloatArray) -> None:
        """Multipliers of rows (m,) and bounds (n,) of a neighbouring problem, distances (k,) of one-sided rows here.

        Distance d and multiplier z of a one-sided row become ``d' = (v + sqrt(v^2 + 4 mu)) / 2, z' = d' - v`` with
        v = d - z, so that d' z' = mu, whichever of both is small, and where the row is violated."""
        p, mu = self.p, self.mu
        self.y = rows.copy()
        z = np.concatenate([bounds[p.free], -rows[p.one_sided]])
        self.z_l = np.maximum(z[p.left], mu / self.a)
        self.z_u = np.maximum(-z[p.right], mu / self.b)
        for of, sides, sign, z_of in ((p.left, p.only_left, 1.0, self.z_l), (p.right, p.only_right, -1.0, self.z_u)):
            one = np.nonzero(sides & (of >= p.n))[0]
            limit = (p.lower if sign > 0.0 else p.upper)[of[one]]
            v = sign * (distances[of[one] - p.n] - limit) - np.maximum(sign * z[of[one]], 0.0)
            root = np.sqrt(v * v + 4.0 * mu)
            near = np.where(v > 0.0, 0.5 * (v + root), 2.0 * mu / (root + np.abs(v)))
            self.w[of[one]] = limit + sign * near
            z_of[one] = mu / near
        self.y[p.one_sided] = -p.spread(self.z_l, self.z_u)[p.n :]
        self.moved()

    def factor(self, least: float = 0.0) -> tuple[Factor, FloatArray] | None:
        """The matrix with the inertia of a descent, and S_t + delta (k,); least: of delta."""
        p = self.p
        sigma = np.zeros(p.n + p.k)
        sigma[p.left] += self.z_l / self.a
        sigma[p.right] += self.z_u / self.b
        hessian = p.problem.hessian(self.xx, self.y)
        delta, delta_c = least, 0.0
        soft = np.zeros(p.m)
        while True:
            soft[:] = delta_c
            soft[p.one_sided] = 1.0 / (sigma[p.n :] + delta)
            found = p.saddle.factor(hessian, self.jacobian, sigma[: p.n] + delta, soft)
            if not found.finite:
                return None
            if found.negative == p.m and found.zero == 0:
                if delta > 0.0:
                    self.last_delta = delta
                return found, sigma[p.n :] + delta
            if (found.negative < p.m or found.zero > 0) and delta_c == 0.0:
                delta_c = 1e-8 * self.mu**0.25
                continue
            if delta == 0.0:
                delta = _DELTA_FIRST if self.last_delta == 0.0 else max(_DELTA_LEAST, self.last_delta / 3.0)
            else:
                delta *= 100.0 if self.last_delta == 0.0 else 8.0
            if delta > _DELTA_MOST:
                return None

    def step(self, factor: Factor, weights: FloatArray, c: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(dw, dy) for the rows' right side c."""
        p = self.p
        rest = self.barrier_slope() + p.against(self.values, self.y)
        right = np.empty(p.n + p.m)
        right[: p.n] = -rest[: p.n]
        right[p.n :] = -c
        right[p.n + p.one_sided] -= rest[p.n :] / weights
        found = factor.solve(right, 3)
        dy = found[p.n :]
        dw = np.empty(p.n + p.k)
        dw[: p.n] = found[: p.n]
        dw[p.n :] = (dy[p.one_sided] - rest[p.n :]) / weights
        return dw, dy

    def longest(self, dw: FloatArray) -> float:
        """Longest step that leaves the part 1 - tau of the distances to the bounds (15a)."""
        p = self.p
        return min(_longest(self.a, dw[p.left], self.tau), _longest(self.b, -dw[p.right], self.tau))

    def reduce(self, tiny: bool) -> None:
        """The barrier becomes smaller as long as its problem is solved well enough (7)."""
        least = self.tolerance / (_KAPPA_EPS + 1.0)
        while tiny or self.error(self.mu) <= _KAPPA_EPS * self.mu:
            tiny = False
            fresh = max(least, min(_KAPPA_MU * self.mu, self.mu**_THETA_MU))
            if fresh == self.mu:
                break
            self.mu, self.tau = fresh, max(_TAU_MIN, 1.0 - fresh)
            self.filter.clear()

    # -- acceptance -------------------------------------------------------------------------------------------------

    def begin_search(self, dw: FloatArray) -> None:
        """What trial points are compared with."""
        self.theta = float(np.abs(self.c).sum())
        self.phi = self.p.barrier(self.w, self.xx, self.mu)
        self.descent = float(self.barrier_slope() @ dw)
        if self.theta_most < 0.0:
            self.theta_most, self.theta_least = 1e4 * max(1.0, self.theta), 1e-4 * max(1.0, self.theta)

    def shortest(self) -> float:
        """Length of a step below which there is none (23)."""
        if self.descent >= 0.0:
            return _GAMMA_ALPHA * _GAMMA_THETA
        least = min(_GAMMA_THETA, _GAMMA_PHI * self.theta / -self.descent)
        if self.theta <= self.theta_least:
            least = min(least, self.theta**_S_THETA / (-self.descent) ** _S_PHI)
        return _GAMMA_ALPHA * least

    def _switches(self, alpha: float) -> bool:
        return self.descent < 0.0 and alpha * (-self.descent) ** _S_PHI > self.theta**_S_THETA

    def _falls(self, alpha: float, phi: float) -> bool:
        return phi - self.phi - _ETA * alpha * self.descent <= 10.0 * _EPS * abs(self.phi)

    def accepts(self, alpha: float, theta: float, phi: float) -> bool:
        """Whether a trial point with this violation and phi is better (18 to 20)."""
        if not (np.isfinite(theta) and np.isfinite(phi)) or theta > self.theta_most:
            return False
        slack = 10.0 * _EPS
        if self._switches(alpha) and self.theta <= self.theta_least:
            if not self._falls(alpha, phi):
                return False
        else:
            if phi > self.phi and np.log10(phi - self.phi) > 5.0 + max(1.0, np.log10(max(abs(self.phi), 10.0))):
                return False
            nearer = theta - (1.0 - _GAMMA_THETA) * self.theta <= slack * self.theta
            if not nearer and not phi - self.phi + _GAMMA_PHI * self.theta <= slack * abs(self.phi):
                return False
        return all(
            phi - old_phi <= slack * abs(old_phi) or theta - old_theta <= slack * old_theta
            for old_theta, old_phi in self.filter
        )

    def remember(self, alpha: float, phi: float) -> None:
        """The filter grows by where it was, unless phi has fallen (22)."""
        if not (self._switches(alpha) and self._falls(alpha, phi)):
            theta, least = (1.0 - _GAMMA_THETA) * self.theta, self.phi - _GAMMA_PHI * self.theta
            self.filter = [(t, f) for t, f in self.filter if t < theta or f < least]
            self.filter.append((theta, least))

    def take(self, w: FloatArray, dw: FloatArray, dy: FloatArray, alpha: float) -> None:
        """The new point; multipliers of bounds go as far as they stay positive (14, 16)."""
        p, mu = self.p, self.mu
        dz_l = mu / self.a - self.z_l - self.z_l / self.a * dw[p.left]
        dz_u = mu / self.b - self.z_u + self.z_u / self.b * dw[p.right]
        length = min(_longest(self.z_l, dz_l, self.tau), _longest(self.z_u, dz_u, self.tau))
        self.w, self.y = w, self.y + alpha * dy
        self.z_l, self.z_u = self.z_l + length * dz_l, self.z_u + length * dz_u
        self.moved()
        self.z_l = np.clip(self.z_l, mu / (_KAPPA_SIGMA * self.a), _KAPPA_SIGMA * mu / self.a)
        self.z_u = np.clip(self.z_u, mu / (_KAPPA_SIGMA * self.b), _KAPPA_SIGMA * mu / self.b)


def _longest(distance: FloatArray, change: FloatArray, tau: float) -> float:
    falls = change < 0.0
    if not falls.any():
        return 1.0
    return min(1.0, float((-tau * distance[falls] / change[falls]).min()))


def _searched(at: _Iteration, factor: Factor, weights: FloatArray, dw: FloatArray, dy: FloatArray) -> bool:
    """Whether a step along (dw, dy) was accepted, and made (algorithm A, 5)."""
    p = at.p
    at.begin_search(dw)
    most = at.longest(dw)
    alpha, least = most, at.shortest()
    first = True
    while alpha >= least:
        w = at.w + alpha * dw
        x = p.x(w)
        phi, c = p.barrier(w, x, at.mu), p.rows_of(x, w)
        theta = float(np.abs(c).sum())
        if at.accepts(alpha, theta, phi):
            at.remember(alpha, phi)
            at.take(w, dw, dy, alpha)
            return True
        if first and np.isfinite(theta) and theta >= at.theta:
            corrected, before, length, right = theta, at.theta, alpha, at.c
            for _ in range(_SOC):
                right = c + length * right
                more, other = at.step(factor, weights, right)
                length = at.longest(more)
                w = at.w + length * more
                x = p.x(w)
                phi, c = p.barrier(w, x, at.mu), p.rows_of(x, w)
                before, corrected = corrected, float(np.abs(c).sum())
                if at.accepts(alpha, corrected, phi):
                    at.remember(alpha, phi)
                    at.take(w, more, other, length)
                    return True
                if not corrected <= _KAPPA_SOC * before:
                    break
        first = False
        alpha *= 0.5
    return False


def _within(
    at: _Iteration, reach: FloatArray, factor: Factor, weights: FloatArray, dw: FloatArray, dy: FloatArray
) -> tuple[Factor, FloatArray, FloatArray, FloatArray]:
    """Factor, weights and step with the first shift delta that keeps the step within `reach` (of each of w), from a
    little below the last one on, growing by _DAMPED."""
    delta = max(_DELTA_REACH, at.damping / _DAMPED**2)
    while float((np.abs(dw) / reach).max(initial=0.0)) > 1.0 and delta < _DELTA_REACH_MOST:
        found = at.factor(delta)
        if found is None:
            break
        factor, weights = found
        dw, dy = at.step(factor, weights, at.c)
        at.damping = delta
        delta *= _DAMPED
    return factor, weights, dw, dy


def minimise(
    problem: ConstrainedProblem,
    start: FloatArray,
    options: dict[str, Any] | None = None,
    progress: Callable[[int, float, float], None] | None = None,
    warm: tuple[FloatArray, FloatArray] | None = None,
) -> Minimum:
    """Minimises `problem` from `start` (n,), as `ribbon.solvers.ipopt.minimise`; options: those of `OPTIONS`."""
    clock = time.perf_counter()
    chosen = {**OPTIONS, **({"mu_init": _WARM_MU} if warm is not None else {}), **(options or {})}
    p = _Problem(problem, start)
    push = _PUSH if warm is None else _WARM_PUSH
    x = p.whole.copy()
    x[p.free] = p.inside(np.concatenate([p.whole[p.free], np.zeros(p.k)]), push)[: p.n]
    slacks = problem.constraints(x)[p.one_sided]
    at = _Iteration(p, p.inside(np.concatenate([x[p.free], slacks]), push), chosen["mu_init"], chosen["tol"])
    if warm is None:
        at.least_squares_multipliers()
    else:
        rows, bounds = warm
        at.warm(slacks, rows, bounds)
    slack = slack_of(problem)
    missed = np.inf if slack is None else OF_SLACK * slack  # by the rows, at the most
    count, tiny, code = 0, 0, MOST
    slides = chosen["sliding"]
    while True:
        if not np.all(np.isfinite(at.c)):
            code = NOT_FINITE
            break
        error = at.error(0.0)
        if progress is not None:
            progress(count, float(problem.value(at.xx)), at.dual)
        enough = max(chosen["tol"], _SLIDES) if slides and at.mu <= at.tolerance else chosen["tol"]
        if error <= enough and np.abs(at.c).max(initial=0.0) <= missed:
            code = SOLVED
            break
        if budget.spent():
            code = STOPPED
            break
        if count >= chosen["max_iter"]:
            break
        at.reduce(tiny == 1)
        found = at.factor(slides)
        if found is None:
            code = NO_STEP
            break
        factor, weights = found
        dw, dy = at.step(factor, weights, at.c)
        reach = p.reach(at.w, chosen["reach"], chosen["travel"])
        if reach is not None:
            factor, weights, dw, dy = _within(at, reach, factor, weights, dw, dy)
        if not np.all(np.isfinite(dw)):
            code = NOT_FINITE
            break
        count += 1
        if float((np.abs(dw) / (1.0 + np.abs(at.w))).max(initial=0.0)) <= _TINY_STEP and np.abs(at.c).max() < 1e-4:
            tiny += 1
            if tiny > 2:
                code = SMALL
                break
            alpha = at.longest(dw)
            at.take(at.w + alpha * dw, dw, dy, alpha)
            continue
        tiny = 0
        made = _searched(at, factor, weights, dw, dy)
        for delta in () if made else _SHORTER:
            found = at.factor(delta)
            if found is None:
                break
            made = _searched(at, *found, *at.step(*found, at.c))
            if made:
                break
        if not made:
            code = NO_STEP
            break
    multipliers = np.zeros(problem.size)
    bounds = p.spread(at.z_l, at.z_u)
    multipliers[p.free] = bounds[: p.n]
    at.y[p.one_sided] = -bounds[p.n :]
    residual = kkt_residual(problem, at.xx, multipliers, at.y)
    return Minimum(
        x=at.xx,
        multipliers=multipliers,
        rows=at.y,
        residual=residual,
        iterations=count,
        code=code,
        message=MESSAGES[code],
        finished=code == SOLVED,
        seconds=time.perf_counter() - clock,
        solver=NEWTON,
    )
