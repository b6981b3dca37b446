"""Which minimiser a problem gets: Newton's iteration along the strip, or Ipopt, the judge of both."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from dataclasses import replace
from typing import Any

from ribbon.errors import RibbonInputError
from ribbon.solvers import ipopt, newton_rows
from ribbon.solvers.problem import BoundedProblem, ConstrainedProblem, FloatArray, Minimum, is_constrained

#: The minimisers that may be asked for.
SOLVERS = ("auto", "newton", "ipopt")
_asked: ContextVar[str] = ContextVar("solver", default="auto")


@contextlib.contextmanager
def using(solver: str) -> Iterator[None]:
    """What is minimised inside is minimised by this one. Raises `RibbonInputError` for another name."""
    if solver not in SOLVERS:
        raise RibbonInputError("solver", solver, f"use one of {', '.join(SOLVERS)}")
    token = _asked.set(solver)
    try:
        yield
    finally:
        _asked.reset(token)


def minimise(
    problem: BoundedProblem | ConstrainedProblem,
    start: FloatArray,
    options: dict[str, Any] | None = None,
    progress: Callable[[int, float, float], None] | None = None,
    warm: tuple[FloatArray, FloatArray] | None = None,
) -> Minimum:
    """As `ribbon.solvers.ipopt.minimise`, by what is asked for (`using`) or fits.

    Problems with rows that can be eliminated along the strip go to `newton_rows`; where that finds no step, and for
    options that it does not know, Ipopt begins at the same start, and the message says so.
    """
    known = set(options or {}) <= set(newton_rows.OPTIONS)
    fits = is_constrained(problem) and hasattr(problem, "elimination")
    if _asked.get() == "ipopt" or not fits or not known:
        return ipopt.minimise(problem, start, options, progress, warm)
    rows: Any = problem
    found = newton_rows.minimise(rows, start, options, progress, warm)
    if found.code in (newton_rows.SOLVED, newton_rows.STOPPED, newton_rows.MOST):
        return found  # after as many steps as it was given Ipopt, which makes the same ones, has not arrived either
    other = ipopt.minimise(problem, start, options, progress, warm)
    if found.residual <= other.residual:
        return found
    return replace(
        other,
        iterations=found.iterations + other.iterations,
        seconds=found.seconds + other.seconds,
        message=f"{other.message} (Ipopt; before: {found.message})",
    )
