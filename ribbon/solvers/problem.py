"""Where a minimiser stops, and how exact that is (what it may ask of a problem: `ribbon.problems.protocol`)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon import law
from ribbon.problems.protocol import BoundedProblem as BoundedProblem
from ribbon.problems.protocol import ConstrainedProblem as ConstrainedProblem
from ribbon.problems.protocol import SmoothProblem as SmoothProblem

FloatArray = NDArray[np.float64]

#: Residual (unscaled) of an equilibrium, and below which no further attempt is made.
RESIDUAL_TOLERANCE = 1e-8


def violation(problem: SmoothProblem, x: FloatArray) -> float:
    """Largest violation of the rows; 0 for a problem without rows."""
    if problem.rows is None:
        return 0.0
    below, above = problem.rows.constraint_bounds()
    c = problem.rows.constraints(x)
    return float(np.max(np.maximum(below - c, c - above), initial=0.0))


#: What a stationary point may have been found by: Newton's recursion along the strip (`newton`, `newton_rows`,
#: `newton_near`), Newton's iteration with a dense Hessian (`approach`), Ipopt; or by nothing, where it was known.
NEWTON, DENSE, IPOPT, KNOWN = SOLVERS = ("Newton", "Newton, dense", "Ipopt", "none")


@dataclass(frozen=True)
class Minimum:
    """Where a minimiser stopped.

    x: unknowns (n,); multipliers: of the bounds, (n,), lower minus upper: gradient = multipliers at a KKT point;
    rows: multipliers of the constraints (m,): gradient + Jacobian^T rows = multipliers; residual: largest violation of
    stationarity, of the rows and of complementarity; iterations; code and message of the minimiser; `finished` when it
    met its own tolerance; seconds of wall time; solver: which it was (one of `SOLVERS`); moved: how far (l) the joints
    went in the last doubling of the segments, None where there was none.
    """

    x: FloatArray
    multipliers: FloatArray
    rows: FloatArray
    residual: float
    iterations: int
    code: int
    message: str
    finished: bool
    seconds: float
    solver: str
    moved: float | None = None


def polish(problem: BoundedProblem, x: FloatArray, steps: int = 12) -> FloatArray:
    """Newton's iteration with the unmodified Hessian from x (n,), as long as the gradient falls; bounds stay inactive.

    A minimiser that shifts the Hessian to make it positive converges slowly, if at all, where it is not: on a saddle
    that a symmetric start cannot leave. Newton's own step gets there, so that it can be called a saddle.
    """
    lower, upper = problem.bounds()
    free = lower < upper
    best = float(np.max(np.abs(problem.gradient(x)[free]), initial=0.0))
    for _ in range(steps):
        hessian = problem.hessian(x)[np.ix_(free, free)]
        try:
            step = np.linalg.solve(hessian, problem.gradient(x)[free])
        except np.linalg.LinAlgError:
            break
        y = x.copy()
        y[free] -= step
        if not np.all(np.isfinite(y)) or np.any(y[free] <= lower[free]) or np.any(y[free] >= upper[free]):
            break
        norm = float(np.max(np.abs(problem.gradient(y)[free]), initial=0.0))
        if not norm < best:
            break
        x, best = y, norm
    return x


def approach(problem: BoundedProblem, x: FloatArray, tolerance: float, steps: int = 12) -> tuple[FloatArray, int]:
    """Newton's iteration with a line search on the value from x (n,), close to a minimum with no bound active.

    Returns the point and the number of steps. Ends when the gradient falls below `tolerance`, and at x as it is where
    the Hessian is not positive, a bound is in the way or the value cannot be lowered.
    """
    lower, upper = problem.bounds()
    free = lower < upper
    value = problem.value(x)
    count = 0
    for _ in range(steps):
        gradient = problem.gradient(x)[free]
        if float(np.max(np.abs(gradient), initial=0.0)) <= tolerance:
            break
        try:
            factor = scipy.linalg.cho_factor(problem.hessian(x)[np.ix_(free, free)])
        except np.linalg.LinAlgError:
            break
        step = scipy.linalg.cho_solve(factor, gradient)
        length = 1.0
        while length > 1e-3:
            y = x.copy()
            y[free] -= length * step
            inside = bool(np.all(y[free] > lower[free]) and np.all(y[free] < upper[free]))
            new = problem.value(y) if inside else np.inf
            if new <= value + 1e-14 * max(1.0, abs(value)):
                break
            length *= 0.5
        else:
            break
        x, value, count = y, new, count + 1
    return x, count


def kkt_residual(
    problem: SmoothProblem, x: FloatArray, multipliers: FloatArray, rows: FloatArray | None = None
) -> float:
    """First-order optimality of x, in units of D w / l per unit of an unknown, over `force_scale`.

    Largest of ``|gradient + Jacobian^T rows - z|`` over the unknowns that are not fixed, of ``|z| * distance to the
    bound`` (the sign of z tells which bound), of the rows' violation (l, over `row_scale`) and of the rows'
    complementarity.
    """
    scale = force_scale(problem)
    lower, upper = problem.bounds()
    free = lower < upper
    gradient = problem.gradient(x)
    violation = 0.0
    constrained = problem.rows
    if constrained is not None and rows is not None and rows.size:
        gradient = gradient + constrained.jacobian_matrix(x).T @ rows
        below, above = constrained.constraint_bounds()
        c = constrained.constraints(x)
        violation = float(np.max(np.maximum(below - c, c - above), initial=0.0)) / row_scale(problem)
        open_rows = (below < above) & (rows != 0)
        slack = np.where(rows < 0, c - below, above - c)
        violation = max(violation, float(np.max(np.abs(rows[open_rows] * slack[open_rows]), initial=0.0)) / scale)
    stationarity = float(np.max(np.abs(gradient - multipliers)[free], initial=0.0))
    gap = np.where(multipliers > 0, x - lower, upper - x)
    active = free & (multipliers != 0)
    complementarity = float(np.max(np.abs(multipliers[active] * gap[active]), initial=0.0))
    return max(stationarity / scale, complementarity / scale, violation)


#: Part of Gamma + K^2 that is the unit of residuals where it is more than 1: 1e-8 of it are some 50 roundings of forces
#: of that size, and no double has more to give.
_FORCES = 1e-6
#: Slack (l) below which rows are met the better the less there is, and part of it that they may miss in a solve.
SLACK = 1e-4
OF_SLACK = 1e-4


def slack_of(problem: SmoothProblem) -> float | None:
    """Slack (l) between held ends where there is little (`SLACK`) and more than none; None otherwise."""
    slack = problem.slack
    return slack if slack is not None and 0.0 < slack < SLACK else None


def force_scale(problem: SmoothProblem) -> float:
    """The unit of a problem's residual: 1, or for a strip of great weight or curl a millionth of Gamma + K^2.

    Between ends that leave a slack d the weight pulls like a string's: half of int v'^2 is d, whence a tension of up to
    Gamma / sqrt(24 d) (H. M. Irvine, Cable Structures, 1981, eq. 2.21), which counts like Gamma.
    """
    strip = problem.strip
    if strip is None:
        return 1.0
    slack = slack_of(problem)
    pull = 0.0 if slack is None else strip.gamma / math.sqrt(24.0 * slack)
    return scale_of(strip.gamma + pull + max(k * k for k in law.values(strip.curvature)))


def scale_of(forces: float) -> float:
    """The unit of the residual of a strip of this Gamma + K^2."""
    return max(1.0, _FORCES * forces)


def row_scale(problem: SmoothProblem) -> float:
    """The unit of the rows' violation: 1, or where held ends leave a slack below `SLACK` its part of that.

    A row missed by e changes a slack d, and with it the energy of an arch and the square of its height, by the part
    e / d; a residual of 1e-8 is then a ten-thousandth of the slack.
    """
    slack = slack_of(problem)
    return 1.0 if slack is None else slack / SLACK
