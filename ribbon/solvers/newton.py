"""Newton's method for problems without rows: the recursion of `ribbon.solvers.riccati`, globalised."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from ribbon.energies import dispatch
from ribbon.problems.arguments import Loads, Material
from ribbon.problems.chained import ChainedProblem
from ribbon.solvers import budget, chained_newton
from ribbon.solvers.problem import NEWTON, FloatArray, Minimum, force_scale, kkt_residual

#: Residual (over `force_scale`) to which the iteration goes on at least; it ends where rounding lets it fall no more.
TOLERANCE = 1e-10
#: Part of it that is exact enough, and the residual of a state that is a start for another only.
EXACT = 1e-3
ROUGH = 1e-8
#: Options of Ipopt's that are known here too.
OPTIONS = ("max_iter",)
#: Most steps; between looks at the clock (and at signals) at least so many steps, and so many steps times segments.
MOST = 500
_TOGETHER, _WORK = 8, 4000
#: Share of the way to a bound that a step may go where the energy is infinite on it.
_REACH = 0.95
_descend: Any = chained_newton.descend


def reach(problem: ChainedProblem) -> float:
    """1 where the energy is finite on the bound |eta'| = 2 l / w, else a share of the way there."""
    return 1.0 if problem.fields.free else _reach(problem.fields.code, problem.fields.section)


@lru_cache(maxsize=64)
def _reach(code: int, section: tuple[float, ...]) -> float:
    """That of an energy with rulings and its arguments."""
    out = np.empty(1)
    one, none = np.ones(1), np.zeros(1)
    dispatch.values(code, one, none, one, section, out)
    return 1.0 if np.isfinite(out[0]) and out[0] < 1e6 else _REACH


def arguments(problem: ChainedProblem) -> tuple[FloatArray, Material, Loads, chained_newton.Bounds]:
    """What `chained_newton.descend` asks of a problem."""
    lower, upper = problem.bounds()
    return problem.lengths, problem.material, problem.loads, chained_newton.Bounds(lower, upper, reach(problem))


def minimise(
    problem: ChainedProblem,
    start: FloatArray,
    options: dict[str, Any] | None = None,
    progress: Callable[[int, float, float], None] | None = None,
    near: bool = False,
    rough: bool = False,
) -> Minimum:
    """Stationary point of `problem` from `start` (n,), moved inside its bounds.

    options: "max_iter"; `progress` is called with (iteration, energy, residual). near: the start is close to it; rough:
    only what comes after from here has to be exact.
    """
    most = int((options or {}).get("max_iter", MOST))
    clock = time.perf_counter()
    x = np.array(start, dtype=float)
    state, gradient = np.zeros(chained_newton.STATE), np.full(x.size, np.nan)
    below, above = np.zeros((2, x.size))
    own = chained_newton.jets(problem.lengths.size, problem.fields.count, problem.is_loaded)
    lengths, material, loads, bounds = arguments(problem)
    if near:
        state[chained_newton.BARRIER] = -1.0
    tolerance = (ROUGH if rough else TOLERANCE) * force_scale(problem)
    good = tolerance if rough else EXACT * tolerance
    stretch = max(_TOGETHER, _WORK // problem.lengths.size)
    # where someone looks on, or no time is left, the start is looked at alone
    together = 0 if progress is not None or budget.spent() else min(stretch, most)
    while True:
        _descend(x, lengths, material, loads, bounds, (tolerance, good), together, state, gradient, below, above, own)
        ended, steps = int(state[chained_newton.ENDED]), int(state[chained_newton.ITERATIONS])
        if progress is not None:
            progress(steps, float(state[chained_newton.ENERGY]), float(state[chained_newton.RESIDUAL]))
        if ended != chained_newton.GOING or steps >= most or budget.spent():
            break
        together = 1 if progress is not None else min(stretch, most - steps)
    if state[chained_newton.FRESH]:
        problem.keep(x, own)
    held = (x <= bounds.lower) & (gradient > 0.0) | (x >= bounds.upper) & (gradient < 0.0)
    multipliers = np.where(held, gradient, 0.0)
    values, derivatives = int(state[chained_newton.VALUES]), int(state[chained_newton.DERIVATIVES])
    problem.counters.value += values
    problem.counters.gradient += derivatives
    problem.counters.hessian += derivatives
    problem.counters.series += problem.lengths.size * (values * problem.has_gravity + derivatives * problem.is_loaded)
    return Minimum(
        x=x,
        multipliers=multipliers,
        rows=np.empty(0),
        residual=kkt_residual(problem, x, multipliers) if np.all(np.isfinite(gradient)) else np.nan,
        iterations=int(state[chained_newton.ITERATIONS]),
        code=ended,
        message=("stationary", "steps or time are spent", "no lower energy along the step", "no energy")[ended],
        finished=ended == chained_newton.CONVERGED,
        seconds=time.perf_counter() - clock,
        solver=NEWTON,
    )
