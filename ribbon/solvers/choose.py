"""Which minimiser a problem gets: Newton's iteration along the strip, or Ipopt, the judge of both.

`using("ipopt")` around a solve makes Ipopt do all of it; "newton" lets nothing else have a try; "auto" is Newton's
where there is one for the problem, and Ipopt where it does not arrive or is given options that it does not know. Ipopt
is optional: where it is not installed Newton's answer stands, and says what was not tried.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from dataclasses import replace
from typing import Any

import numpy as np

from ribbon.errors import RibbonInputError
from ribbon.problems.chained import ChainedProblem
from ribbon.problems.mixed import MixedProblem
from ribbon.solvers import ipopt, newton, newton_rows
from ribbon.solvers.budget import spent
from ribbon.solvers.cyipopt_api import IpoptMissing
from ribbon.solvers.problem import BoundedProblem, ConstrainedProblem, FloatArray, Minimum

#: The minimisers that may be asked for.
SOLVERS = ("auto", "newton", "ipopt")
#: Residual (over `force_scale`) up to which a minimum of a problem without rows, or of one that touches itself, is
#: taken as found.
FOUND = 1e-8
_asked: ContextVar[str] = ContextVar("solver", default="auto")


@contextlib.contextmanager
def using(solver: str | None) -> Iterator[None]:
    """What is minimised inside is minimised by this one; None: as around it. Raises `RibbonInputError` for another
    name."""
    if solver is not None and solver not in SOLVERS:
        raise RibbonInputError("solver", solver, f"use one of {', '.join(SOLVERS)}")
    token = _asked.set(_asked.get() if solver is None else solver)
    try:
        yield
    finally:
        _asked.reset(token)


def asked() -> str:
    """The solver asked for."""
    return _asked.get()


def by_recursion(problem: object, options: dict[str, Any] | None = None) -> bool:
    """Whether the problem, with options of Ipopt's, goes to the recursion for problems without rows."""
    fits = isinstance(problem, ChainedProblem) and set(options or {}) <= set(newton.OPTIONS)
    return fits and _asked.get() != "ipopt"


def minimise(
    problem: BoundedProblem | ConstrainedProblem,
    start: FloatArray,
    options: dict[str, Any] | None = None,
    progress: Callable[[int, float, float], None] | None = None,
    warm: tuple[FloatArray, FloatArray] | None = None,
    **how: bool,
) -> Minimum:
    """As `ribbon.solvers.ipopt.minimise`, by what is asked for (`using`) or fits.

    Problems without rows go to `newton` (how: its `near`, `rough`), those with rows that can be eliminated along the
    strip to `newton_rows`; where that finds no step, and for options that it does not know, Ipopt begins at the same
    start, and the message says so. Raises `IpoptMissing` where nothing but Ipopt can be asked and it is not there.
    """
    with np.errstate(over="ignore", invalid="ignore"):  # what is not finite at a trial is not taken
        return _minimised(problem, start, options, progress, warm, how)


def _minimised(
    problem: BoundedProblem | ConstrainedProblem,
    start: FloatArray,
    options: dict[str, Any] | None,
    progress: Callable[[int, float, float], None] | None,
    warm: tuple[FloatArray, FloatArray] | None,
    how: dict[str, bool],
) -> Minimum:
    if isinstance(problem, ChainedProblem) and by_recursion(problem, options):
        minimum = newton.minimise(problem, start, options, progress, **how)
        arrived = minimum.residual <= FOUND or spent()
    else:
        known = set(options or {}) <= set(newton_rows.OPTIONS)
        by_newton = options
        if isinstance(problem, MixedProblem) and problem.round and problem.pairs:
            by_newton = {**(options or {}), "sliding": newton_rows.SLIDING}
        options = {key: value for key, value in (options or {}).items() if key not in newton_rows.OWN}
        if _asked.get() == "ipopt" or not isinstance(problem, MixedProblem) or not known:
            return ipopt.minimise(problem, start, options, progress, warm)
        minimum = newton_rows.minimise(problem, start, by_newton, progress, warm)
        # after as many steps as it was given Ipopt, which makes the same ones, has not arrived either
        arrived = minimum.code in (newton_rows.SOLVED, newton_rows.STOPPED, newton_rows.MOST)
        arrived |= (
            bool(problem.pairs) and minimum.residual <= FOUND
        )  # nearest places are known to rounding, and no better
    if arrived or _asked.get() == "newton":
        return minimum
    try:
        other = ipopt.minimise(problem, start, options, progress, warm)
    except IpoptMissing as missing:
        return replace(minimum, message=f"{minimum.message} (Ipopt might: {missing})")
    if minimum.residual <= other.residual:
        return minimum
    return replace(
        other,
        iterations=minimum.iterations + other.iterations,
        seconds=minimum.seconds + other.seconds,
        message=f"{other.message} (Ipopt; before: {minimum.message})",
    )
