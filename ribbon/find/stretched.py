"""Ends one length apart: the straight strip is the only shape there is, and its tension is not determined.

No multipliers exist there (the rows' derivatives are dependent), so that no minimiser can be asked.
"""

from __future__ import annotations

import numpy as np

from ribbon import penetration
from ribbon.boundary import Clamp
from ribbon.errors import RibbonInputError
from ribbon.problems.protocol import Problem
from ribbon.result import Energy, Equilibrium, Status
from ribbon.solvers.problem import KNOWN, violation
from ribbon.strip import Strip

#: Mismatch of the frames at the ends of a stretched strip that counts as rounding.
STRETCHED_MISMATCH = 1e-4
#: Distance of the ends over l, from below 1, at which the strip counts as stretched straight.
STRETCHED = 1.0 - 1e-9


def ends_apart(strip: Strip, start: Clamp | None, end: Clamp | None) -> float:
    """Distance of the held ends over l; 0 where one is free."""
    if start is None or end is None or start.position is None or end.position is None:
        return 0.0
    return float(np.linalg.norm(np.asarray(end.position) - np.asarray(start.position))) / strip.length


def check_distance(strip: Strip, start: Clamp | None, end: Clamp | None) -> None:
    apart = ends_apart(strip, start, end)
    if apart > 2.0 - STRETCHED:
        assert end is not None
        raise RibbonInputError(
            "end.position", end.position, f"it is {apart:.9g} lengths from the start; at most 1 can be reached"
        )


def is_stretched(problem: Problem) -> bool:
    """Whether the ends are held as far apart as the strip is long, so that `straight` is the only shape."""
    return ends_apart(problem.strip, problem.start, problem.end) >= STRETCHED


def straight(problem: Problem) -> Equilibrium:
    """The straight strip between ends that are one length apart: the only shape there is, whatever its tension."""
    none = np.zeros(problem.lengths.size + 1)
    x = problem.state(none, none)
    missing = violation(problem, x)
    beyond = penetration.deepest(problem, x)
    fits = missing <= STRETCHED_MISMATCH and not (beyond is not None and beyond > penetration.TOLERANCE)
    status = Status.CONVERGED if fits else Status.INFEASIBLE
    message = (
        "stretched straight: the only shape there is, no freedom is left to be unstable; its tension is undetermined, "
        "no forces are given"
    )
    return Equilibrium(
        problem=problem,
        status=status,
        message=f"{status.value}; {message}" if fits else status.value,
        x=x,
        multipliers=np.zeros(problem.size),
        rows=np.full(problem.row_count, np.nan),
        residual=missing,
        iterations=0,
        evaluations={k: getattr(problem.counters, k) for k in ("value", "gradient", "hessian", "series")},
        energy=Energy(*(float(v) for v in problem.energy_parts(x))),
        stable=True if fits else None,
        lowest_eigenvalue=float("inf") if fits else float("nan"),
        mode=np.zeros(problem.size),
        active_bounds=0,
        seconds={"solve": 0.0, "stability": 0.0},
        options={},
        solver=KNOWN,
        penetration=beyond,
    )
