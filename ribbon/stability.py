"""Second-order check: is the stationary point a minimum (thesis, 7.1: Ipopt may stop on a saddle)?

Where the normal curvature vanishes the ruling moves nothing: the Hessian has null modes in eta, and the point is a
whole family of points that are one shape. Its second variation by omega does depend on which ruling is taken (a
straight strip on edge under its weight is a minimum for eta = 0 and a saddle for an oblique ruling), so that the shape
is stable only if no ruling of the family gives a negative eigenvalue. `check` looks for the worst one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.optimize

from ribbon.chained import ChainedProblem
from ribbon.solvers.problem import FloatArray

#: A bound counts as active when the point is this close to it, relative to the bound's size.
ACTIVE_DISTANCE = 1e-7
#: Eigenvalues within INDIFFERENT * (largest eigenvalue, at least 1) of zero count as zero: rounding, or a null mode.
INDIFFERENT = 1e-11
#: Change of the energy (relative, at least 1) below which a move along null modes is no change of shape.
_SAME_ENERGY = 1e-11
#: Largest component of the gradient there: still a stationary point.
_STATIONARY = 1e-8
#: Rulings (eta) from which the search starts, where they are free to choose; pieces on which eta is linear in it; share
#: of the eigenvalue at eta = 0 below zero at which the search is over.
_RULINGS = (0.6, -0.6)
_PIECES = 12
_CLEARLY = 1e-3


@dataclass(frozen=True)
class Stability:
    """Lowest eigenvalue of the Hessian on the unknowns that no active bound holds.

    eigenvalue: in the metric ``int (domega^2 + deta^2) ds`` (units D w / l), so that it hardly depends on the segments,
    and for the worst ruling where rulings are free to choose; mode: its eigenvector (n,), zero on held unknowns; at:
    the unknowns (n,) with that ruling (the same shape); stable: not negative beyond rounding; indifferent: zero to
    rounding; active: number of held bounds.
    """

    eigenvalue: float
    mode: FloatArray
    at: FloatArray
    stable: bool
    indifferent: bool
    active: int


@dataclass(frozen=True)
class _Spectrum:
    values: FloatArray
    vectors: FloatArray
    tolerance: float

    @property
    def null(self) -> FloatArray:
        """Modes (free, k) whose eigenvalue is zero to rounding."""
        return self.vectors[:, np.abs(self.values) <= self.tolerance]


def _spectrum(problem: ChainedProblem, metric: FloatArray, x: FloatArray, free: FloatArray) -> _Spectrum:
    values, vectors = scipy.linalg.eigh(problem.hessian(x)[np.ix_(free, free)], metric)
    return _Spectrum(values, vectors, INDIFFERENT * max(1.0, float(np.abs(values).max())))


def check(problem: ChainedProblem, x: FloatArray) -> Stability:
    """Lowest eigenvalue at the stationary point x (n,)."""
    lower, upper = problem.bounds()
    fixed = lower == upper
    reach = np.where(np.isfinite(upper), ACTIVE_DISTANCE * np.maximum(np.abs(upper), np.abs(lower)), -1.0)
    held = fixed | (np.minimum(x - lower, upper - x) <= reach)
    free = ~held
    active = int(held.sum() - fixed.sum())
    mode = np.zeros(x.size)
    if not free.any():
        return Stability(np.inf, mode, x, True, False, active)
    metric = problem.metric()[np.ix_(free, free)]
    spectrum = _spectrum(problem, metric, x, free)
    at = x
    if spectrum.values[0] >= -spectrum.tolerance and spectrum.null.shape[1] > 0:
        at, spectrum = _worst_ruling(problem, metric, x, free, spectrum)
    lowest = float(spectrum.values[0])
    mode[free] = spectrum.vectors[:, 0]
    tolerance = spectrum.tolerance
    return Stability(lowest, mode, at, lowest >= -tolerance, abs(lowest) <= tolerance, active)


def _worst_ruling(
    problem: ChainedProblem, metric: FloatArray, x: FloatArray, free: FloatArray, spectrum: _Spectrum
) -> tuple[FloatArray, _Spectrum]:
    """Among points of the same energy along the null modes, the one with the lowest eigenvalue found, and its spectrum.

    The ruling eta(s), piecewise linear on a few equal pieces, is projected on the null modes and chosen to make the
    lowest eigenvalue of the Hessian in omega least (quasi-Newton from a constant ruling of either sign; the search ends
    as soon as the eigenvalue is negative beyond rounding).
    """
    null = spectrum.null
    dual = null.T @ metric
    energy = problem.value(x)
    allowed = _SAME_ENERGY * max(1.0, abs(energy))
    lower, upper = problem.bounds()
    bending = free & (np.arange(x.size) % 2 == 0)
    bending_metric = problem.metric()[np.ix_(bending, bending)]
    joints = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    pieces = np.linspace(0.0, 1.0, min(problem.lengths.size, _PIECES) + 1)

    def moved(values: FloatArray) -> FloatArray:
        """x with the ruling through `values` at `pieces`, as far as null modes can take it there."""
        eta = np.interp(joints, pieces, values)
        if not free[1]:
            eta[0] = x[1]
        target = x.copy()
        target[1], target[3::2] = eta[0], np.diff(eta) / problem.lengths
        y = x.copy()
        y[free] += null @ (dual @ (target - x)[free])
        return np.clip(y, 0.9 * lower, 0.9 * upper)

    def same_shape(y: FloatArray) -> bool:
        slope = float(np.abs(problem.gradient(y)[free]).max())
        return abs(problem.value(y) - energy) <= allowed and slope <= _STATIONARY

    def softest(values: FloatArray) -> float:
        y = moved(values)
        if not same_shape(y):
            return level  # not better than no ruling at all
        return float(_spectrum(problem, bending_metric, y, bending).values[0])

    def stop(values: FloatArray) -> None:
        if softest(values) < -_CLEARLY * scale:
            raise StopIteration

    level = float(_spectrum(problem, bending_metric, x, bending).values[0])
    scale = max(1.0, abs(level))
    best = x, spectrum
    for ruling in _RULINGS:
        values = np.full(pieces.size, ruling)
        found = scipy.optimize.minimize(softest, values, method="L-BFGS-B", callback=stop, options={"maxiter": 60})
        y = moved(found.x)
        worst = _spectrum(problem, metric, y, free)
        if same_shape(y) and worst.values[0] < best[1].values[0] - worst.tolerance:
            best = y, worst
            break
    return best
