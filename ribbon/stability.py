"""Second-order check: is the stationary point a minimum (thesis, 7.1: Ipopt may stop on a saddle)?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from ribbon.solvers.problem import BoundedProblem, FloatArray

#: A bound counts as active when the point is this close to it, relative to the bound's size.
ACTIVE_DISTANCE = 1e-7
#: Eigenvalues above -INDIFFERENT * (largest eigenvalue, at least 1) count as not negative: rounding, or a null mode.
INDIFFERENT = 1e-11


@dataclass(frozen=True)
class Stability:
    """Lowest eigenvalue of the Hessian on the unknowns that no active bound holds.

    eigenvalue: in the metric ``int (domega^2 + deta^2) ds`` (units D w / l), so that it hardly depends on the segments;
    mode: its eigenvector (n,), zero on held unknowns; stable: eigenvalue not negative beyond rounding; indifferent: it
    is zero to rounding (e.g. the ruling where normal curvature vanishes, which moves nothing); active: number of held
    bounds.
    """

    eigenvalue: float
    mode: FloatArray
    stable: bool
    indifferent: bool
    active: int


def check(problem: BoundedProblem, metric: FloatArray, x: FloatArray, multipliers: FloatArray) -> Stability:
    """Lowest eigenvalue at x (n,) with bound `multipliers` (n,); `metric` (n, n) is the Gram matrix of the unknowns."""
    lower, upper = problem.bounds()
    near = np.minimum(x - lower, upper - x)
    size = np.where(np.isfinite(upper), np.maximum(np.abs(upper), np.abs(lower)), np.inf)
    fixed = lower == upper
    with np.errstate(invalid="ignore"):
        held = fixed | (near <= ACTIVE_DISTANCE * np.where(np.isfinite(size), size, 0.0))
    free = ~held
    mode = np.zeros(x.size)
    if not free.any():
        return Stability(np.inf, mode, True, False, int(held.sum() - fixed.sum()))
    hessian = problem.hessian(x)[np.ix_(free, free)]
    values, vectors = scipy.linalg.eigh(hessian, metric[np.ix_(free, free)])
    scale = max(1.0, float(values[-1]))
    lowest = float(values[0])
    mode[free] = vectors[:, 0]
    tolerance = INDIFFERENT * scale
    return Stability(lowest, mode, lowest >= -tolerance, abs(lowest) <= tolerance, int(held.sum() - fixed.sum()))
