"""Newton's iteration for a few unknowns between bounds and without rows: a primal-dual interior point, dense.

With distances to bounds x - l, u - x > 0 and multipliers z_l, z_u of them the barrier problem is::

    min  phi(x) = f(x) - mu sum ln(x - l) - mu sum ln(u - x)

and a step solves (Waechter and Biegler 2006, doi:10.1007/s10107-004-0559-y, section 3.1, without rows)::

    [ H + z_l / (x - l) + z_u / (u - x) + delta ] dx = - grad phi

delta is raised until the matrix is positive definite; the step goes to a fraction of the bounds and lowers phi
(Armijo).
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import scipy

from ribbon.solvers import budget
from ribbon.solvers.problem import DENSE, BoundedProblem, FloatArray, Minimum, kkt_residual

#: What may be asked for, as of Ipopt.
OPTIONS: dict[str, Any] = {"tol": 1e-10, "max_iter": 200}
#: Codes and messages of how it ended (Ipopt's codes).
SOLVED, MOST, STOPPED, NO_STEP = 0, -1, 5, -2
MESSAGES = {
    SOLVED: "Newton's iteration converged.",
    MOST: "Newton's iteration made all the steps that were allowed.",
    STOPPED: "Newton's iteration ended with the budget of time.",
    NO_STEP: "Newton's iteration found no acceptable step.",
}
_COLD_MU, _WARM_MU, _COLD_PUSH, _WARM_PUSH = 1e-4, 1e-8, 1e-2, 1e-10
_KAPPA_EPS, _KAPPA_MU, _THETA_MU, _TAU, _KAPPA_SIGMA, _ARMIJO = 10.0, 0.2, 1.5, 0.99, 1e10, 1e-8
_DELTA_FIRST, _DELTA_MORE, _DELTA_MOST, _SHORTEST = 1e-6, 10.0, 1e20, 1e-10


class _Barrier:
    """The problem in its free unknowns w (k,), with what its bounds add."""

    def __init__(self, problem: BoundedProblem, start: FloatArray, push: float) -> None:
        self.problem = problem
        lower, upper = problem.bounds()
        self.free = lower < upper
        self.whole = np.clip(start, lower, upper)
        self.l, self.u = lower[self.free], upper[self.free]
        w = self.whole[self.free]
        width = push * (self.u - self.l)
        low, high = self.l.copy(), self.u.copy()
        for bound, sign in ((low, 1.0), (high, -1.0)):
            there = np.isfinite(bound)
            bound[there] += sign * np.minimum(push * np.maximum(1.0, np.abs(bound[there])), width[there])
        self.start = np.clip(w, low, high)

    def x(self, w: FloatArray) -> FloatArray:
        """All unknowns (n,)."""
        out = self.whole.copy()
        out[self.free] = w
        return out

    def phi(self, w: FloatArray, mu: float) -> float:
        """The barrier problem's value; inf where the energy has none."""
        below, above = w - self.l, self.u - w
        logs = np.log(below[np.isfinite(below)]).sum() + np.log(above[np.isfinite(above)]).sum()
        value = float(self.problem.value(self.x(w)) - mu * logs)
        return value if np.isfinite(value) else np.inf


def minimise(
    problem: BoundedProblem,
    start: FloatArray,
    options: dict[str, Any] | None = None,
    warm: FloatArray | None = None,
) -> Minimum:
    """Minimum of `problem` from `start` (n,), moved inside its bounds; options: over `OPTIONS`.

    warm: multipliers of the bounds (n,), lower minus upper, of a state beside it.
    """
    requested = {**OPTIONS, **(options or {})}
    clock = time.perf_counter()
    mu = _COLD_MU if warm is None else _WARM_MU
    at = _Barrier(problem, start, _COLD_PUSH if warm is None else _WARM_PUSH)
    w = at.start
    guess = np.zeros(at.whole.size) if warm is None else warm
    z_l = np.where(np.isfinite(at.l), np.maximum(guess[at.free], mu / (w - at.l)), 0.0)
    z_u = np.where(np.isfinite(at.u), np.maximum(-guess[at.free], mu / (at.u - w)), 0.0)
    code, count = MOST, 0
    for count in range(int(requested["max_iter"]) + 1):
        gradient = problem.gradient(at.x(w))[at.free]
        below, above = w - at.l, at.u - w
        slope = float(np.abs(gradient - z_l + z_u).max(initial=0.0))
        if max(slope, _gap(z_l, below, 0.0), _gap(z_u, above, 0.0)) <= requested["tol"]:
            code = SOLVED
            break
        if count == int(requested["max_iter"]) or budget.spent():
            code = STOPPED if budget.spent() else MOST
            break
        while (
            mu > requested["tol"] / 10.0 and max(slope, _gap(z_l, below, mu), _gap(z_u, above, mu)) <= _KAPPA_EPS * mu
        ):
            mu = max(requested["tol"] / 10.0, min(_KAPPA_MU * mu, mu**_THETA_MU))
        towards = gradient - mu / below + mu / above
        matrix = problem.hessian(at.x(w))[np.ix_(at.free, at.free)] + np.diag(z_l / below + z_u / above)
        step = _step(matrix, -towards)
        if step is None:
            code = NO_STEP
            break
        tau = max(_TAU, 1.0 - mu)
        length = _searched(at, w, step, mu, float(towards @ step), tau)
        if length is None:
            code = NO_STEP
            break
        d_l, d_u = mu / below - z_l - z_l / below * step, mu / above - z_u + z_u / above * step
        w = w + length * step
        z_l, z_u = _kept(z_l, d_l, w - at.l, mu, tau), _kept(z_u, d_u, at.u - w, mu, tau)
    x, multipliers = at.x(w), np.zeros(at.whole.size)
    multipliers[at.free] = z_l - z_u
    residual = kkt_residual(problem, x, multipliers)
    return Minimum(
        x=x, multipliers=multipliers, rows=np.empty(0), residual=residual, iterations=count, code=code,
        message=MESSAGES[code], finished=code == SOLVED, seconds=time.perf_counter() - clock, solver=DENSE,
    )  # fmt: skip


def _gap(z: FloatArray, distance: FloatArray, mu: float) -> float:
    """Largest violation of z distance = mu."""
    bounded = np.isfinite(distance)
    return float(np.abs(z[bounded] * distance[bounded] - mu).max(initial=0.0))


def _step(matrix: FloatArray, right: FloatArray) -> FloatArray | None:
    """matrix + delta solved with the least delta tried that makes it positive definite; None where none does."""
    delta, one = 0.0, np.eye(right.size)
    if not np.isfinite(matrix).all():
        return None
    while delta <= _DELTA_MOST:
        try:
            return np.asarray(scipy.linalg.cho_solve(scipy.linalg.cho_factor(matrix + delta * one), right))
        except np.linalg.LinAlgError:
            size = float(np.abs(matrix.diagonal()).max(initial=1.0))
            delta = _DELTA_FIRST * size if delta == 0.0 else _DELTA_MORE * delta
    return None


def _searched(at: _Barrier, w: FloatArray, step: FloatArray, mu: float, slope: float, tau: float) -> float | None:
    """How far along `step` the barrier problem's value falls, inside the bounds; None: nowhere."""
    length = min(_furthest(w - at.l, step, tau), _furthest(at.u - w, -step, tau))
    value = at.phi(w, mu)
    rounding = 1e-14 * max(1.0, abs(value))
    while length > _SHORTEST:
        if at.phi(w + length * step, mu) <= value + _ARMIJO * length * slope + rounding:
            return length
        length *= 0.5
    return None


def _furthest(distance: FloatArray, step: FloatArray, tau: float) -> float:
    """The largest length up to 1 that leaves 1 - tau of every distance."""
    towards = (step < 0.0) & np.isfinite(distance)
    return float(min(1.0, (tau * distance[towards] / -step[towards]).min(initial=1.0)))


def _kept(z: FloatArray, step: FloatArray, distance: FloatArray, mu: float, tau: float) -> FloatArray:
    """Multipliers after their own step, near mu / distance (equation 16 of the paper); 0 where there is no bound."""
    bounded = np.isfinite(distance)
    out = np.zeros(z.size)
    length = _furthest(z[bounded], step[bounded], tau)
    at = mu / distance[bounded]
    out[bounded] = np.clip(z[bounded] + length * step[bounded], at / _KAPPA_SIGMA, at * _KAPPA_SIGMA)
    return out
