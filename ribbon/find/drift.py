"""Where an equilibrium goes when a small term is added to its energy: the term's own gradient pulls at the curvatures.

Same unknowns, bounds and constraints; the energy gains ``g . q``, q the parameters of the segments (linear in the
unknowns), g the term's derivative at the equilibrium: a first-order picture, without the term's own curvature.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbon.result import Equilibrium
from ribbon.solvers.ipopt import minimise

FloatArray = NDArray[np.float64]

#: Gradient up to which the new minimum is found; it is an estimate, not a solution.
_TOLERANCE = 1e-7
_MOST_ITERATIONS = 40


class PulledProblem:
    """A problem with a constant gradient (n,) added."""

    def __init__(self, inner: Any, pull: FloatArray) -> None:
        self._inner = inner
        self._pull = pull
        if inner.row_count:
            self.constraint_bounds = inner.constraint_bounds

    def __getattr__(self, name: str) -> Any:
        if name == "constraint_bounds":  # absent, like the inner problem's
            raise AttributeError(name)
        return getattr(self._inner, name)

    def value(self, x: FloatArray) -> float:
        """Energy, D w / l."""
        return float(self._inner.value(x)) + float(self._pull @ x)

    def gradient(self, x: FloatArray) -> FloatArray:
        """Gradient (n,)."""
        return np.asarray(self._inner.gradient(x) + self._pull)


def drifted(equilibrium: Equilibrium, gradient: FloatArray) -> Equilibrium | None:
    """The equilibrium beside this one when the energy gains a term with this `gradient` (p, 4 or 6) by the parameters
    of the segments; None where it was not found. Only the unknowns, and what follows from them, belong to it."""
    problem: Any = equilibrium.problem
    columns, slopes = problem.parameter_map()
    pull = np.zeros(problem.size)
    if problem.row_count:
        np.add.at(pull, columns, np.einsum("pj,pjk->pk", gradient, slopes[:, : gradient.shape[1]]))
    else:
        pull = slopes[:, : gradient.shape[1]].reshape(gradient.size, -1).T @ gradient.ravel()
    warm = (equilibrium.rows, equilibrium.multipliers)
    options = {"tol": _TOLERANCE, "max_iter": _MOST_ITERATIONS}
    found = minimise(PulledProblem(problem, pull), equilibrium.x, options, warm=warm)  # type: ignore[arg-type]
    if not found.residual < 100.0 * _TOLERANCE:
        return None
    return replace(equilibrium, x=found.x, rows=found.rows, multipliers=found.multipliers, at=None)
