"""The minimisers that the thesis compares (3.5.2, algorithm 1), behind one interface.

Every method takes a problem (`ribbon.solvers.problem.BoundedProblem`), a start x (n,) and `Limits`, and returns a
`Descent`. It stops when the largest component of the gradient is below `Limits.tolerance`; to run out of steps or of
time, to meet a point that cannot be evaluated, or to stall is a message of the result, never an exception.

Algorithm 1: x <- x + alpha d with ``A d = -gradient``; the methods differ in A and in the step length alpha. Bounds
shorten the step of the methods with a line search (unknowns that bounds hold fixed stall them); the others do not know
bounds at all. The comparison of 3.5.2 drops them.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import scipy  # its parts are loaded where they are first used

from ribbon.solvers import ipopt
from ribbon.solvers.problem import BoundedProblem, FloatArray

#: Armijo's share of the predicted decrease, factor of a backtracking step, most of them (Nocedal and Wright, 3.1).
ARMIJO, BACKTRACK, MOST_BACKTRACKS = 1e-4, 0.5, 60
#: A change of the energy within ROUNDING * max(1, |energy|) is no ascent.
ROUNDING = 1e-14
#: NEWTONR's shift (thesis, 3.5.2): where the lowest eigenvalue mu is below SHIFT_BELOW, SHIFT |mu| is added to all.
SHIFT_BELOW, SHIFT = 1e-8, 10.0


@dataclass(frozen=True)
class Limits:
    """When to stop: gradient (largest component, in the problem's units), steps, wall time in s."""

    tolerance: float = 1e-8
    steps: int = 1000
    seconds: float = 30.0


@dataclass(frozen=True)
class Descent:
    """Where a method stopped.

    x: unknowns (n,); value: there; gradient_norm: largest component; iterations: accepted steps; evaluations: of
    "value", "gradient" and "hessian"; finished: whether the tolerance was met; seconds: wall time.
    """

    x: FloatArray
    value: float
    gradient_norm: float
    iterations: int
    evaluations: dict[str, int]
    finished: bool
    message: str
    seconds: float


@dataclass(frozen=True)
class Unbounded:
    """`problem` without its bounds; value and derivatives are nan where `admissible` says no.

    The thesis drops the bounds for its comparison (3.5.2); `admissible` keeps a diverging method from points whose
    evaluation would not end (a ribbon coiled a million times).
    """

    problem: BoundedProblem
    admissible: Callable[[FloatArray], bool] = lambda x: True

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.problem.size

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Minus and plus infinity, (n,) each."""
        return np.full(self.size, -np.inf), np.full(self.size, np.inf)

    def _allowed(self, x: FloatArray) -> bool:
        return bool(np.all(np.isfinite(x))) and self.admissible(x)

    def value(self, x: FloatArray) -> float:
        """The problem's value, or nan."""
        return self.problem.value(x) if self._allowed(x) else float("nan")

    def gradient(self, x: FloatArray) -> FloatArray:
        """The problem's gradient (n,), or nan."""
        return self.problem.gradient(x) if self._allowed(x) else np.full(self.size, np.nan)

    def hessian(self, x: FloatArray) -> FloatArray:
        """The problem's Hessian (n, n), or nan."""
        return self.problem.hessian(x) if self._allowed(x) else np.full((self.size, self.size), np.nan)


@dataclass
class _Counted:
    """A problem that counts its evaluations and knows when to give up."""

    problem: BoundedProblem
    limits: Limits
    counts: dict[str, int] = field(default_factory=lambda: {"value": 0, "gradient": 0, "hessian": 0})
    clock: float = field(default_factory=time.perf_counter)

    #: No rows, and residuals as they are.
    rows: ClassVar[None] = None
    strip: ClassVar[None] = None
    slack: ClassVar[None] = None

    @property
    def size(self) -> int:
        return self.problem.size

    @property
    def seconds(self) -> float:
        return time.perf_counter() - self.clock

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        return self.problem.bounds()

    def value(self, x: FloatArray) -> float:
        self.counts["value"] += 1
        return self.problem.value(x)

    def gradient(self, x: FloatArray) -> FloatArray:
        self.counts["gradient"] += 1
        return self.problem.gradient(x)

    def hessian(self, x: FloatArray) -> FloatArray:
        self.counts["hessian"] += 1
        return self.problem.hessian(x)

    def result(self, x: FloatArray, iterations: int, message: str) -> Descent:
        """The result at x; its own value and gradient are not counted."""
        seconds = self.seconds
        norm = _largest(self.problem.gradient(x))
        finished = norm <= self.limits.tolerance
        if not finished and not np.isfinite(norm):
            message = f"diverged: {message}"
        return Descent(
            x=x,
            value=float(self.problem.value(x)),
            gradient_norm=norm,
            iterations=iterations,
            evaluations=dict(self.counts),
            finished=finished,
            message="converged" if finished else message,
            seconds=seconds,
        )


def _largest(gradient: FloatArray) -> float:
    return float(np.max(np.abs(gradient), initial=0.0))


#: x (n,), gradient (n,) -> direction d (n,), or None when there is none.
_Direction = Callable[[_Counted, FloatArray, FloatArray], FloatArray | None]


def _room(problem: _Counted, x: FloatArray, d: FloatArray) -> float:
    """The full step 1, or 99 per cent of the way to the first bound where the full step would reach it."""
    lower, upper = problem.bounds()
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = np.where(d > 0, (upper - x) / d, np.where(d < 0, (lower - x) / d, np.inf))
    reach = float(np.min(ratios, initial=np.inf))
    return 1.0 if reach > 1.0 else 0.99 * reach


def _backtrack(problem: _Counted, x: FloatArray, here: float, slope: float, d: FloatArray) -> tuple[FloatArray, float]:
    """Armijo's backtracking from the full step: the new point (n,) and its value; x itself when no step descends."""
    step, noise = _room(problem, x, d), ROUNDING * max(1.0, abs(here))
    for _ in range(MOST_BACKTRACKS):
        y = x + step * d
        value = problem.value(y)
        if value <= here + ARMIJO * step * slope + noise:  # False for nan
            return y, value
        step *= BACKTRACK
    return x, here


def _iterate(
    problem: BoundedProblem, start: FloatArray, limits: Limits, direction: _Direction, search: bool
) -> Descent:
    """Algorithm 1 of the thesis, step length 1 or from a line search."""
    counted = _Counted(problem, limits)
    x = np.array(start, dtype=float)
    value = counted.value(x) if search else float("nan")
    stalled = np.inf
    for iteration in range(limits.steps + 1):
        gradient = counted.gradient(x)
        norm = _largest(gradient)
        if norm <= limits.tolerance:
            return counted.result(x, iteration, "converged")
        if not np.isfinite(norm):
            return counted.result(x, iteration, "the energy cannot be evaluated where the last step led")
        if iteration == limits.steps:
            break
        if counted.seconds > limits.seconds:
            return counted.result(x, iteration, f"stopped after {limits.seconds:g} s")
        d = direction(counted, x, gradient)
        if d is None or not np.all(np.isfinite(d)):
            return counted.result(x, iteration, "the linear system has no solution")
        if not search:
            x = x + d
            continue
        y, below = _backtrack(counted, x, value, float(gradient @ d), d)
        # within rounding the energy says nothing: go on only as long as the gradient falls
        if np.array_equal(y, x) or (below >= value and norm >= stalled):
            return counted.result(x, iteration, "stalled: no step along the direction lowers the energy")
        stalled = norm if below >= value else np.inf
        x, value = y, below
    return counted.result(x, limits.steps, f"not converged after {limits.steps} steps")


def _solve(matrix: FloatArray, gradient: FloatArray) -> FloatArray | None:
    try:
        return -np.linalg.solve(matrix, gradient)
    except np.linalg.LinAlgError:
        return None


def _newton_direction(problem: _Counted, x: FloatArray, gradient: FloatArray) -> FloatArray | None:
    return _solve(problem.hessian(x), gradient)


def _newton_or_gradient(problem: _Counted, x: FloatArray, gradient: FloatArray) -> FloatArray | None:
    d = _newton_direction(problem, x, gradient)
    # d^T H d = -d^T gradient: negative where d climbs
    return -gradient if d is None or not d @ gradient < 0 else d


def _shifted(problem: _Counted, x: FloatArray, gradient: FloatArray) -> FloatArray | None:
    hessian = problem.hessian(x)
    if not np.all(np.isfinite(hessian)):
        return None
    lowest = float(scipy.linalg.eigvalsh(hessian, subset_by_index=[0, 0])[0])
    if lowest < SHIFT_BELOW:
        hessian = hessian + max(SHIFT * abs(lowest), SHIFT_BELOW) * np.eye(x.size)
    return _solve(hessian, gradient)


def gradient_descent(problem: BoundedProblem, start: FloatArray, limits: Limits | None = None) -> Descent:
    """GRADDESC with Armijo's backtracking: d = -gradient (thesis, 3.5.2, first order)."""
    return _iterate(problem, start, limits or Limits(), lambda _p, _x, g: -g, search=True)


def gradient_descent_unit(problem: BoundedProblem, start: FloatArray, limits: Limits | None = None) -> Descent:
    """GRADDESC as the thesis prints it (3.5.2): d = -gradient, step length 1."""
    return _iterate(problem, start, limits or Limits(), lambda _p, _x, g: -g, search=False)


def newton(problem: BoundedProblem, start: FloatArray, limits: Limits | None = None) -> Descent:
    """NEWTON (thesis, 3.5.2): ``H d = -gradient``, step length 1; goes to any stationary point, or away."""
    return _iterate(problem, start, limits or Limits(), _newton_direction, search=False)


def newton_or_gradient(problem: BoundedProblem, start: FloatArray, limits: Limits | None = None) -> Descent:
    """NEWTONC (thesis, 3.5.2): Newton's direction, -gradient where that climbs (d^T H d < 0); line search."""
    return _iterate(problem, start, limits or Limits(), _newton_or_gradient, search=True)


def newton_shifted(problem: BoundedProblem, start: FloatArray, limits: Limits | None = None) -> Descent:
    """NEWTONR (thesis, 3.5.2): Hessian plus 10 |mu| I where its lowest eigenvalue mu is below 1e-8; line search."""
    return _iterate(problem, start, limits or Limits(), _shifted, search=True)


class _OutOfTimeError(Exception):
    """Raised in scipy's callback."""


def _scipy(problem: BoundedProblem, start: FloatArray, limits: Limits, method: str, **options: object) -> Descent:
    counted = _Counted(problem, limits)
    last, steps = np.array(start, dtype=float), 0

    def after(x: FloatArray) -> None:
        nonlocal last, steps
        last, steps = np.array(x), steps + 1
        if counted.seconds > limits.seconds:
            raise _OutOfTimeError

    keywords = {"hess": counted.hessian} if method == "trust-exact" else {}
    try:
        with np.errstate(all="ignore"):
            found = scipy.optimize.minimize(
                counted.value, last, jac=counted.gradient, method=method, callback=after,
                options={"gtol": limits.tolerance, "maxiter": limits.steps, **options}, **keywords,
            )  # fmt: skip
    except _OutOfTimeError:
        return counted.result(last, steps, f"stopped after {limits.seconds:g} s")
    except (ValueError, np.linalg.LinAlgError) as error:  # trust-exact on a Hessian that is not finite
        return counted.result(last, steps, f"scipy: {error}")
    return counted.result(found.x, int(found.nit), f"not converged ({found.message.rstrip('.')})")


def bfgs(problem: BoundedProblem, start: FloatArray, limits: Limits | None = None) -> Descent:
    """BFGS of scipy.optimize, Wolfe line search (thesis, 3.5.2, quasi-Newton)."""
    return _scipy(problem, start, limits or Limits(), "BFGS", norm=np.inf)


def trust_region(problem: BoundedProblem, start: FloatArray, limits: Limits | None = None) -> Descent:
    """trust-exact of scipy.optimize with the exact Hessian (not in the thesis; Nocedal and Wright, 4.3)."""
    # scipy's gtol is on the 2-norm here
    return _scipy(problem, start, limits or Limits(), "trust-exact")


def _ipopt(problem: BoundedProblem, start: FloatArray, limits: Limits, options: dict[str, object]) -> Descent:
    counted = _Counted(problem, limits)
    stop = {"tol": float(limits.tolerance), "max_iter": limits.steps, "max_cpu_time": float(limits.seconds)}
    minimum = ipopt.minimise(counted, np.array(start, dtype=float), {**stop, **options})
    counted.counts["gradient"] -= 1  # the residual that ipopt.minimise reports
    reason = minimum.message.split("(")[0].strip(" .")
    return counted.result(minimum.x, minimum.iterations, f"not converged (Ipopt: {reason})")


def ipopt_exact(problem: BoundedProblem, start: FloatArray, limits: Limits | None = None) -> Descent:
    """IPOPT-HESS (thesis, 3.5.2): Ipopt with the exact Hessian and `ribbon.solvers.ipopt.DEFAULT_OPTIONS`."""
    return _ipopt(problem, start, limits or Limits(), {})


def ipopt_lbfgs(
    problem: BoundedProblem, start: FloatArray, limits: Limits | None = None, vectors: int | None = None
) -> Descent:
    """IPOPT-L-BFGS (thesis, 3.5.2) with `vectors` of memory; None: as many as unknowns (its footnote 8)."""
    memory = {"hessian_approximation": "limited-memory", "limited_memory_max_history": vectors or problem.size}
    return _ipopt(problem, start, limits or Limits(), memory)


#: The methods by the thesis's names (table 3.2; last one: ours).
METHODS: dict[str, Callable[..., Descent]] = {
    "GRADDESC": gradient_descent,
    "GRADDESC, unit step": gradient_descent_unit,
    "BFGS": bfgs,
    "NEWTON": newton,
    "NEWTONC": newton_or_gradient,
    "NEWTONR": newton_shifted,
    "IPOPT-HESS": ipopt_exact,
    "IPOPT-L-BFGS": ipopt_lbfgs,
    "trust-exact": trust_region,
}
