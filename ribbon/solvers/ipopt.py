"""Ipopt through cyipopt, with the exact Hessian (thesis, 3.5.2; Waechter and Biegler, doi:10.1007/s10107-004-0559-y).

Exceptions in a callback would be swallowed by Ipopt's C loop; they are kept, Ipopt is told that the point cannot be
evaluated, and the first of them is raised with its own traceback after the solve.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from ribbon.solvers import budget
from ribbon.solvers.cyipopt_api import wrapper
from ribbon.solvers.problem import (
    IPOPT,
    OF_SLACK,
    BoundedProblem,
    ConstrainedProblem,
    FloatArray,
    Minimum,
    kkt_residual,
    slack_of,
)

#: The same for every scene; none is tuned. The mu-strategy is Ipopt's monotone default.
DEFAULT_OPTIONS: dict[str, Any] = {
    "print_level": 0,
    "sb": "yes",
    "tol": 1e-10,
    "max_iter": 1000,
    "linear_solver": "mumps",
    "nlp_scaling_method": "none",  # the problem is dimensionless (thesis, 4.1)
    "bound_relax_factor": 0.0,  # |n| = 2/w is a wall: Wunderlich's energy is infinite there
    "mu_init": 1e-4,
    "acceptable_iter": 0,
    "hessian_approximation": "exact",
}
_SOLVED = 0


class _Callbacks:
    """Adapter from a problem to cyipopt's methods: a dense Hessian without rows, a sparse one with them."""

    def __init__(
        self, problem: BoundedProblem | ConstrainedProblem, progress: Callable[[int, float, float], None] | None
    ) -> None:
        self.problem = problem
        self.progress = progress
        self.iterations = 0
        self.error: Exception | None = None
        self._refused = wrapper().CyIpoptEvaluationError
        self.constrained = problem.rows
        if self.constrained is None:
            self._structure: tuple[Any, Any] = np.tril_indices(problem.size)
        else:
            self._structure = self.constrained.hessian_structure()

    def _guard(self, function: Callable[..., Any], *arguments: Any) -> Any:
        if self.error is not None:
            raise self._refused()
        try:
            result = function(*arguments)
        except Exception as error:
            self.error = error
            raise self._refused() from error
        if not np.all(np.isfinite(result)):
            raise self._refused()
        return result

    def objective(self, x: FloatArray) -> float:
        return self._guard(self.problem.value, x)

    def gradient(self, x: FloatArray) -> FloatArray:
        return self._guard(self.problem.gradient, x)

    def constraints(self, x: FloatArray) -> FloatArray:
        return np.empty(0) if self.constrained is None else self._guard(self.constrained.constraints, x)

    def jacobian(self, x: FloatArray) -> FloatArray:
        return np.empty(0) if self.constrained is None else self._guard(self.constrained.jacobian, x)

    def jacobianstructure(self) -> tuple[Any, Any]:
        if self.constrained is None:
            return np.empty(0, dtype=int), np.empty(0, dtype=int)
        return self.constrained.jacobian_structure()  # type: ignore[no-any-return]

    def hessianstructure(self) -> tuple[Any, Any]:
        return self._structure

    def hessian(self, x: FloatArray, multipliers: FloatArray, factor: float) -> FloatArray:
        if self.constrained is not None:
            return self._guard(self.constrained.hessian, x, multipliers, factor)  # type: ignore[no-any-return]
        dense = self._guard(self.problem.hessian, x)
        return factor * dense[self._structure]

    def intermediate(self, *values: Any) -> bool:
        # alg_mod, iter, objective, inf_pr, inf_du, mu, ...
        self.iterations = int(values[1])
        if self.progress is not None:
            self.progress(self.iterations, float(values[2]), float(values[4]))
        return self.error is None and not budget.spent()


#: Over the defaults with rows: approximate minimum degree; MUMPS's own choice was slower wherever tried.
SPARSE_OPTIONS: dict[str, Any] = {"mumps_pivot_order": 0}
#: Over the defaults when multipliers are given: the point is trusted and the barrier starts small.
WARM_OPTIONS: dict[str, Any] = {
    "warm_start_init_point": "yes",
    "mu_init": 1e-8,
    "warm_start_bound_push": 1e-10,
    "warm_start_bound_frac": 1e-10,
    "warm_start_slack_bound_push": 1e-10,
    "warm_start_slack_bound_frac": 1e-10,
    "warm_start_mult_bound_push": 1e-10,
}


def minimise(
    problem: BoundedProblem | ConstrainedProblem,
    start: FloatArray,
    options: dict[str, Any] | None = None,
    progress: Callable[[int, float, float], None] | None = None,
    warm: tuple[FloatArray, FloatArray] | None = None,
) -> Minimum:
    """Minimises `problem` from `start` (n,), moved inside its bounds; `options` are Ipopt's, over `DEFAULT_OPTIONS`.

    `progress` is called with (iteration, energy, dual infeasibility); `warm`: multipliers of the rows (m,) and of the
    bounds (n,) to start from. Raises what a callback of the problem raised, and `cyipopt_api.IpoptMissing`.
    """
    lower, upper = problem.bounds()
    below, above = np.empty(0), np.empty(0)
    constrained = problem.rows
    if constrained is not None:
        below, above = constrained.constraint_bounds()
    x0 = np.clip(start, lower, upper)
    callbacks = _Callbacks(problem, progress)
    clock = time.perf_counter()
    nlp = wrapper().Problem(n=problem.size, m=below.size, problem_obj=callbacks, lb=lower, ub=upper, cl=below, cu=above)
    sparse = SPARSE_OPTIONS if constrained is not None else {}
    slack = slack_of(problem)
    if slack is not None:
        sparse = {**sparse, "constr_viol_tol": OF_SLACK * slack}
    chosen = {**DEFAULT_OPTIONS, **sparse, **(WARM_OPTIONS if warm is not None else {}), **(options or {})}
    for key, value in chosen.items():
        nlp.add_option(key, value)
    guess: dict[str, FloatArray] = {}
    if warm is not None:
        rows, bounds = warm
        guess = {"lagrange": rows, "zl": np.maximum(bounds, 0.0), "zu": np.maximum(-bounds, 0.0)}
    try:
        x, info = nlp.solve(x0, **guess)
    except Exception:
        if callbacks.error is not None:
            raise callbacks.error from None
        raise
    finally:
        nlp.close()
    if callbacks.error is not None:
        raise callbacks.error
    x = np.clip(np.asarray(x, dtype=float), lower, upper)
    multipliers = np.asarray(info["mult_x_L"]) - np.asarray(info["mult_x_U"])
    rows = np.asarray(info["mult_g"], dtype=float)
    message = info["status_msg"]
    return Minimum(
        x=x,
        multipliers=multipliers,
        rows=rows,
        residual=kkt_residual(problem, x, multipliers, rows),
        iterations=callbacks.iterations,
        code=int(info["status"]),
        message=message.decode() if isinstance(message, bytes) else str(message),
        finished=int(info["status"]) == _SOLVED,
        seconds=time.perf_counter() - clock,
        solver=IPOPT,
    )
