"""From a strip, its clamp and its loads to an `Equilibrium`."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ribbon import stability
from ribbon.boundary import Clamp
from ribbon.chained import ChainedProblem, segment_lengths
from ribbon.errors import RibbonInputError
from ribbon.loads import Gravity
from ribbon.result import Energy, Equilibrium, Status
from ribbon.solvers import ipopt
from ribbon.solvers.problem import kkt_residual, polish
from ribbon.strip import Strip, finite

#: KKT residual (unscaled, dimensionless) above which a point is not an equilibrium.
RESIDUAL_TOLERANCE = 1e-8

Seed = tuple[float, float]
Progress = Callable[[int, float, float], None]


def solve(
    strip: Strip,
    clamp: Clamp | None = None,
    gravity: Gravity | None = None,
    *,
    energy: str = "wunderlich",
    segments: int | ArrayLike = 20,
    seed_curvature: float | Seed | str = "natural",
    seed_ruling: float | Seed = 0.0,
    options: dict[str, Any] | None = None,
    progress: Progress | None = None,
) -> Equilibrium:
    """Equilibrium of a clamped-free ribbon in the chained model (thesis, chapter 3).

    Parameters
    ----------
    strip, clamp, gravity: what it is, how s = 0 is held (default: at the origin, tangent e_z, normal e_y), and which
        way is up; no `gravity`, no weight.
    energy: "wunderlich" (finite width) or "sadowsky".
    segments: how many equal ones, or their lengths in units of l (they add up to 1).
    seed_curvature, seed_ruling: omega (in 1/length) and eta to start from, a number or (at s = 0, at s = l);
        "natural" is the stress-free shape.
    options: Ipopt's options, over `ribbon.solvers.ipopt.DEFAULT_OPTIONS`.
    progress: called with (iteration, energy, dual infeasibility).

    Raises `RibbonInputError` on bad input. Whatever the minimiser meets is a status of the result.
    """
    problem = ChainedProblem(strip, clamp or Clamp(), gravity, energy, segment_lengths(segments))
    if isinstance(seed_curvature, str):
        if seed_curvature != "natural":
            raise RibbonInputError("seed_curvature", seed_curvature, 'a number, a pair, or "natural"')
        curvature = strip.curvature
    else:
        start, end = _pair("seed_curvature", seed_curvature)
        curvature = (start * strip.length, end * strip.length)
    start_x = problem.state(curvature, _pair("seed_ruling", seed_ruling))
    return solve_from(problem, start_x, options=options, progress=progress)


def _pair(key: str, value: float | Seed) -> Seed:
    if isinstance(value, (tuple, list)):
        if len(value) != 2:
            raise RibbonInputError(key, value, "one number, or two (at s = 0 and s = l)")
        return finite(key, value[0]), finite(key, value[1])
    return finite(key, value), finite(key, value)


def solve_from(
    problem: ChainedProblem,
    x: np.ndarray,
    *,
    options: dict[str, Any] | None = None,
    progress: Progress | None = None,
) -> Equilibrium:
    """Equilibrium of `problem` from the unknowns x (2 p + 2,); residual and stability are not taken from Ipopt."""
    minimum = ipopt.minimise(problem, x, options, progress)
    if not minimum.finished and minimum.residual > RESIDUAL_TOLERANCE and np.all(np.isfinite(minimum.x)):
        none = np.zeros_like(minimum.x)
        polished = polish(problem, minimum.x)
        residual = kkt_residual(problem, polished, none)
        if residual < minimum.residual:
            minimum = replace(minimum, x=polished, multipliers=none, residual=residual)
    evaluations = {k: getattr(problem.counters, k) for k in ("value", "gradient", "hessian", "series")}
    parts = problem.energy_parts(minimum.x)
    clock = time.perf_counter()
    finite_point = bool(np.all(np.isfinite(minimum.x)) and np.all(np.isfinite(parts)))
    check = None
    if finite_point:
        check = stability.check(problem, minimum.x)
    steepest = float(np.abs(minimum.x[3::2]).max() * problem.half_width)
    if check is None or not np.isfinite(minimum.residual):
        status = Status.FAILED
    elif steepest > 1.0:
        status = Status.RULINGS_CROSS
    elif minimum.residual > RESIDUAL_TOLERANCE:
        status = Status.NOT_CONVERGED
    else:
        status = Status.CONVERGED if check.stable else Status.SADDLE
    known = status in (Status.CONVERGED, Status.SADDLE)
    message = status.value if known else f"{status.value} (Ipopt: {minimum.message})"
    if known and check is not None and check.indifferent:
        message += "; indifferent to at least one mode (eigenvalue zero to rounding)"
    return Equilibrium(
        problem=problem,
        status=status,
        message=message,
        x=minimum.x,
        multipliers=minimum.multipliers,
        residual=minimum.residual,
        iterations=minimum.iterations,
        evaluations=evaluations,
        energy=Energy(*(float(v) for v in parts)),
        stable=check.stable if known and check is not None else None,
        lowest_eigenvalue=check.eigenvalue if check is not None else float("nan"),
        mode=check.mode if check is not None else np.zeros_like(minimum.x),
        active_bounds=check.active if check is not None else 0,
        seconds={"solve": minimum.seconds, "stability": time.perf_counter() - clock},
        options={**ipopt.DEFAULT_OPTIONS, **(options or {})},
    )


def split_state(lengths: np.ndarray, x: np.ndarray, parts: int) -> tuple[np.ndarray, np.ndarray]:
    """Segments cut into `parts` equal pieces and the unknowns of the same shape on them (exactly the same ribbon)."""
    finer = np.repeat(lengths / parts, parts)
    y = np.empty(2 * finer.size + 2)
    y[:2] = x[:2]
    y[2::2] = np.repeat(x[2::2], parts)
    y[3::2] = np.repeat(x[3::2], parts)
    return finer, y


def refine(equilibrium: Equilibrium, parts: int = 2, **keywords: Any) -> Equilibrium:
    """The same scene on segments cut into `parts`, started from `equilibrium`: the same branch, a smaller error.

    The distance to the coarser result estimates the coarser result's discretisation error.
    """
    if parts < 1:
        raise RibbonInputError("parts", parts, "cut every segment into at least one piece")
    old = equilibrium.problem
    lengths, x = split_state(old.lengths, equilibrium.x, parts)
    fresh = replace(old, lengths=lengths, counters=type(old.counters)(), _cache={})
    return solve_from(fresh, x, **keywords)
