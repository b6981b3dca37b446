"""Second-order check: is the stationary point a minimum (thesis, 7.1: Ipopt may stop on a saddle)?

Where the normal curvature vanishes the ruling moves nothing: the Hessian has null modes in eta, and the point is a
whole family of points that are one shape. Its second variation by omega does depend on which ruling is taken (a
straight strip on edge under its weight is a minimum for eta = 0 and a saddle for an oblique ruling), so that the shape
is stable only if no ruling of the family gives a negative eigenvalue. `check` looks for the worst one (docs/theory.md,
eq. (6.1), (6.2)).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy  # its parts are loaded where they are first used

from ribbon.judge import reduction
from ribbon.judge.inertia import BoolArray, Pencil
from ribbon.judge.spectrum import SecondVariation
from ribbon.problems import transfer
from ribbon.problems.chained import ChainedProblem
from ribbon.problems.layout import at_joints
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.solvers import choose
from ribbon.solvers.budget import spent
from ribbon.solvers.problem import RESIDUAL_TOLERANCE, FloatArray, Minimum

#: A bound counts as active when the point is this close to it, relative to the bound's size.
ACTIVE_DISTANCE = 1e-7
#: Eigenvalues within INDIFFERENT * (largest eigenvalue, at least 1) of zero count as zero: rounding, or a null mode.
INDIFFERENT = 1e-11
#: The same for a mixed problem, whose multipliers carry rounding of their own.
MIXED_INDIFFERENT = 1e-10
_MOST_TOLERANCE = 1e-5
#: Eigenvalue of the scaled Hessian (`_is_negative`) below which it is negative, and least part of the metric's diagonal
#: that its own is not taken for rounding with. True ones were found at -700 and beyond, rounding at -1e-6.
_SCALED_NEGATIVE = 1e-2
_LEAST_STIFFNESS = 1e-6
#: Segments up to which all eigenvalues of a chained ribbon are found at once (dense) where one of them is zero to
#: rounding; more are joined first.
_DENSE_LIMIT = 400
#: |omega| l below which a joint counts as straight.
STRAIGHT = 1e-7
#: Segments up to which a ribbon held at s = 0 only is checked in the chained unknowns (dense).
_CHAINED_LIMIT = 400
#: Change of the energy (relative, at least 1) below which a move along null modes is no change of shape.
_SAME_ENERGY = 1e-11
#: Largest component of the gradient there: still a stationary point.
_STATIONARY = 1e-8
#: Rulings (eta) from which the search starts, where they are free to choose; pieces on which eta is linear in it; share
#: of the eigenvalue at eta = 0 below zero at which the search is over.
_RULINGS = (0.6, -0.6)
_PIECES = 12
#: Further ends of pieces, in half widths from a straight ruling; how steep the ruling is there at most, over the bound.
_WIDTHS = (0.5, 1.0, 2.0, 4.0)
_STEEP = 0.85
_CLEARLY = 1e-3


@dataclass(frozen=True)
class Stability:
    """Lowest eigenvalue of the Hessian on the unknowns that no active bound holds.

    eigenvalue: in the metric ``int (domega^2 + deta^2) ds`` (units D w / l), so that it hardly depends on the segments,
    and for the worst ruling where rulings are free to choose; mode: its eigenvector (n,), zero on held unknowns; at:
    the unknowns (n,) with that ruling (the same shape); stable: not negative beyond rounding, None: not known;
    indifferent: zero to rounding; active: number of held bounds; negative: number of unstable modes, by inertia, None:
    not counted.
    """

    eigenvalue: float
    mode: FloatArray
    at: FloatArray
    stable: bool | None
    indifferent: bool
    active: int
    negative: int | None = None


@dataclass(frozen=True)
class _Spectrum:
    values: FloatArray
    vectors: FloatArray
    tolerance: float

    @property
    def null(self) -> FloatArray:
        """Modes (free, k) whose eigenvalue is zero to rounding."""
        return self.vectors[:, np.abs(self.values) <= self.tolerance]


def _spectrum(problem: ChainedProblem, metric: FloatArray, x: FloatArray, free: BoolArray) -> _Spectrum:
    values, vectors = scipy.linalg.eigh(problem.hessian(x)[np.ix_(free, free)], metric)
    return _Spectrum(values, vectors, INDIFFERENT * max(1.0, float(np.abs(values).max())))


def _lowest(problem: ChainedProblem, metric: FloatArray, x: FloatArray, free: BoolArray) -> float:
    """The lowest eigenvalue alone, which is found in a fraction of the time of all."""
    hessian = problem.hessian(x)[np.ix_(free, free)]
    return float(scipy.linalg.eigh(hessian, metric, eigvals_only=True, subset_by_index=[0, 0])[0])


def _is_negative(problem: ChainedProblem, x: FloatArray) -> bool:
    """Whether the Hessian has a negative direction, told where its spectrum is too wide for its own eigenvalues.

    A heavy strip's short segments are 1e13 times as stiff as its long ones, and a negative eigenvalue is lost among the
    rounding of the largest. In omega and eta at the joints, scaled to a diagonal of 1, the matrix has the same inertia
    (Sylvester), and its eigenvalues are known to the rounding of its entries (Demmel and Veselic 1992,
    doi:10.1137/0613074). Not told (False) with an in-plane curvature.
    """
    if problem.fields.in_plane:
        return False
    lower, upper = problem.bounds()
    units = np.eye(2 * (problem.lengths.size + 1))
    count = len(units) // 2
    chain = np.array([problem.state(unit[:count], unit[count:]) for unit in units]).T
    chain = chain[:, ~np.any(chain[lower == upper] != 0.0, axis=0)]
    return negative(chain.T @ problem.hessian(x) @ chain, np.diag(chain.T @ problem.metric() @ chain))


def negative(hessian: FloatArray, weights: FloatArray) -> bool:
    """Whether the Hessian (k, k), scaled to a diagonal of 1, is clearly negative somewhere; weights (k,): the metric's
    diagonal, of which a direction has to have some part as its stiffness."""
    size = np.sqrt(np.maximum(np.diag(hessian), _LEAST_STIFFNESS * weights))
    return bool(np.linalg.eigvalsh(hessian / np.outer(size, size))[0] < -_SCALED_NEGATIVE)


def judge(problem: Problem, minimum: Minimum) -> Stability:
    """Second-order check of a stationary point, in the unknowns of its problem."""
    if isinstance(problem, ChainedProblem):
        return check(problem, minimum.x)
    assert isinstance(problem, MixedProblem)
    return check_mixed(problem, minimum.x, minimum.multipliers, minimum.rows)


def check_mixed(problem: MixedProblem, x: FloatArray, multipliers: FloatArray, rows: FloatArray) -> Stability:
    """Second-order check of a stationary point of the mixed model on the tangent of its active constraints.

    x, multipliers (n,); rows (m,); by the inertia of a factor along the strip (`ribbon.judge.spectrum`), not known
    where none was found. A ribbon held at s = 0 only is checked in the unknowns of the chained model, null
    modes of the ruling included.
    """
    plain = problem.start is not None and problem.start.is_whole and problem.end is None and problem.closure is None
    exact = problem.gravity is not None and problem.gravity.exact
    plain = plain and set(problem.blocks()) <= {"start_position", "start_frame"}  # nothing else holds it
    if plain and not exact and problem.lengths.size <= _CHAINED_LIMIT:
        assert problem.start is not None
        twin = ChainedProblem.twin(problem, problem.lengths)
        found = check(twin, twin.state(*problem.joint_values(x), problem.in_plane_values(x)))
        mode, at = np.zeros(problem.size), x.copy()
        mode[problem.layout.omega], mode[problem.layout.eta] = twin.joint_values(found.mode)
        if problem.fields.free:
            return replace(found, mode=mode, at=at)
        at[problem.layout.eta] = at_joints(twin.parameters(found.at), problem.lengths)[1]
        return replace(found, mode=mode, at=at)
    held = reduction.tangent(problem, x, multipliers, rows)
    best = _mixed_once(problem, x, rows, held)
    if best.stable is True:
        for y in other_rulings(problem, x):
            other = _mixed_once(problem, y, rows, held)
            if other.eigenvalue < best.eigenvalue:
                best = other
            if not best.stable:
                break
    return best


def _mixed_once(problem: MixedProblem, x: FloatArray, rows: FloatArray, held: reduction.Tangent) -> Stability:
    return of_variation(SecondVariation(problem, x, rows, held), x, held)


def of_variation(second: SecondVariation, x: FloatArray, held: reduction.Tangent) -> Stability:
    """The verdict of a second variation at x (n,)."""
    lowest, mode = second.lowest()
    if not np.isfinite(lowest):
        return Stability(lowest, mode, x, None if np.isnan(lowest) else True, False, held.bounds)
    tolerance = 0.0
    if abs(lowest) <= _MOST_TOLERANCE:
        tolerance = min(MIXED_INDIFFERENT * max(1.0, second.largest()), _MOST_TOLERANCE)
    stable = lowest >= -tolerance
    negative = 0
    if not stable:  # motions that nothing resists, such as a band's along itself, are zero to rounding
        negative = second.below(-min(MIXED_INDIFFERENT * max(1.0, second.largest()), _MOST_TOLERANCE))
    return Stability(lowest, mode, x, stable, abs(lowest) <= tolerance, held.bounds, negative)


def other_rulings(problem: MixedProblem, x: FloatArray) -> list[FloatArray]:
    """The same shape with other rulings where the normal curvature vanishes and they move nothing."""
    layout = problem.layout
    if problem.fields.free:
        return []
    straight = np.abs(x[layout.omega]) < STRAIGHT
    if straight.sum() < 2:
        return []
    # a joint's ruling is free when both its neighbours are straight too
    inner = straight.copy()
    inner[1:] &= straight[:-1]
    inner[:-1] &= straight[1:]
    lower, upper = problem.bounds()
    inner &= lower[layout.eta] < upper[layout.eta]
    if not inner.any():
        return []
    found = []
    for ruling in (*_RULINGS, 0.2, -0.2):
        eta = x[layout.eta].copy()
        eta[inner] = ruling
        slope = np.diff(eta) / problem.lengths
        steep = 0.9 / problem.half_width
        for i in range(1, eta.size):  # no crossing rulings between the straight part and the rest
            if abs(slope[i - 1]) > steep and inner[i]:
                eta[i] = eta[i - 1] + np.clip(eta[i] - eta[i - 1], -steep, steep) * problem.lengths[i - 1]
        slope = np.diff(eta) / problem.lengths
        if np.abs(slope).max() * problem.half_width >= 1.0:
            continue
        y = x.copy()
        y[layout.eta] = eta
        y[layout.slope] = slope
        found.append(y)
    return found


def held_at(problem: ChainedProblem, x: FloatArray) -> BoolArray:
    """Which unknowns (n,) are fixed, or stand on a bound at x (n,)."""
    lower, upper = problem.bounds()
    reach = np.where(np.isfinite(upper), ACTIVE_DISTANCE * np.maximum(np.abs(upper), np.abs(lower)), -1.0)
    return np.asarray((lower == upper) | (np.minimum(x - lower, upper - x) <= reach))


def check(problem: ChainedProblem, x: FloatArray) -> Stability:
    """Lowest eigenvalue at the stationary point x (n,).

    Where the spectrum is so wide (segments of very different lengths) that a dense eigenvalue is lost in the rounding
    of the largest, eigenvalue and verdict both come from the inertia of `Pencil`, whose factors are of one segment
    each: at a grading of 1e8 to 1e12 it is right to 2 %, where the dense one was -9 to -4e8.
    """
    lower, upper = problem.bounds()
    fixed = lower == upper
    held = held_at(problem, x)
    free = ~held
    active = int(held.sum() - fixed.sum())
    mode = np.zeros(x.size)
    if not free.any():
        return Stability(np.inf, mode, x, True, False, active)
    clear = _by_inertia(problem, x, held, active)
    if clear is not None:
        return clear
    if problem.lengths.size > _DENSE_LIMIT:
        return _on_fewer_chained(problem, x, active)
    metric = problem.metric()[np.ix_(free, free)]
    spectrum = _spectrum(problem, metric, x, free)
    at = x
    rulings = not problem.fields.free
    if (
        rulings
        and spectrum.values[0] >= -spectrum.tolerance
        and spectrum.null.shape[1] > 0
        and not _is_least(problem, x)
    ):
        at, spectrum = _worst_ruling(problem, metric, x, free, spectrum)
    lowest = float(spectrum.values[0])
    mode[free] = spectrum.vectors[:, 0]
    tolerance = spectrum.tolerance
    if -tolerance <= lowest < 0.0 and not active and _is_negative(problem, at):
        tolerance = 0.0
    elif abs(lowest) <= tolerance and tolerance > _MOST_TOLERANCE:
        lowest, mode = Pencil(problem, at, held).lowest()
        tolerance = _MOST_TOLERANCE
    if lowest >= -tolerance and spent():  # the search for a worse ruling may have been cut short
        return Stability(lowest, mode, at, None, abs(lowest) <= tolerance, active)
    return Stability(lowest, mode, at, lowest >= -tolerance, abs(lowest) <= tolerance, active)


def _by_inertia(problem: ChainedProblem, x: FloatArray, held: BoolArray, active: int) -> Stability | None:
    """The check in O(p); None where an eigenvalue is zero to rounding."""
    pencil = Pencil(problem, x, held)
    tolerance = INDIFFERENT * pencil.largest()
    negative = pencil.below(-tolerance)
    if not negative and pencil.below(tolerance) > 0:
        return None
    lowest, mode = pencil.lowest()
    return Stability(lowest, mode, x, not negative, False, active, negative)


def _on_fewer_chained(problem: ChainedProblem, x: FloatArray, active: int) -> Stability:
    """The check on neighbouring segments joined until they are few enough for all eigenvalues; open (None) where the
    shape does not converge there."""
    lengths = problem.lengths
    while lengths.size > _DENSE_LIMIT:
        lengths = transfer.merged(lengths)
    few = problem.with_changes(lengths=lengths)
    minimum = choose.minimise(few, transfer.on_joints(problem, x, few))
    if not minimum.residual <= RESIDUAL_TOLERANCE:
        return Stability(np.nan, np.zeros(problem.size), x, None, False, active)
    few_check = check(few, minimum.x)
    mode, at = (transfer.on_joints(few, y, problem) for y in (few_check.mode, few_check.at))
    return replace(few_check, mode=mode, at=at, active=active)


def _is_least(problem: ChainedProblem, x: FloatArray) -> bool:
    """Whether no shape at all has less energy: a flat strip that is straight, weightless or hanging straight down, and
    pulled at its end that way if it is pulled.

    No ruling can then give a negative eigenvalue, and none has to be looked for.
    """
    bending, natural, weight = problem.energy_parts(x)[:3]
    if problem.tip is not None:
        points, _ = problem.joints(x)
        pull = np.asarray(problem.tip)
        size = float(np.linalg.norm(pull))
        if size - float(pull @ (points[-1] - points[0])) > _SAME_ENERGY * max(1.0, size):
            return False
    if problem.has_natural_curvature or natural or bending > _SAME_ENERGY:
        return False
    if problem.gravity is None or not problem.has_gravity:
        return True
    gamma = problem.strip.gamma
    height = float(np.asarray(problem.clamp.position) @ np.asarray(problem.gravity.up)) / problem.strip.length
    return bool(weight - gamma * (height - 0.5) <= _SAME_ENERGY * max(1.0, gamma))


def _worst_ruling(
    problem: ChainedProblem, metric: FloatArray, x: FloatArray, free: BoolArray, spectrum: _Spectrum
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
    layout = problem.layout
    bending = np.zeros(x.size, dtype=bool)
    bending[layout.bending] = free[layout.bending]
    bending_metric = problem.metric()[np.ix_(bending, bending)]
    joints = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    pieces = np.linspace(0.0, 1.0, min(problem.lengths.size, _PIECES) + 1)
    held = not free[layout.eta]
    if held:  # the ruling turns over some widths from a clamp that holds it straight
        near = problem.half_width * np.array(_WIDTHS)
        pieces = np.union1d(pieces, near[near < pieces[1]])

    def moved(values: FloatArray) -> FloatArray:
        """x with the ruling through `values` at `pieces`, as far as null modes can take it there."""
        eta = np.interp(joints, pieces, values)
        if held:
            reach = _STEEP / problem.half_width * joints
            eta = x[layout.eta] + np.clip(eta - x[layout.eta], -reach, reach)
        target = x.copy()
        target[layout.eta], target[layout.eta_slope] = eta[0], np.diff(eta) / problem.lengths
        y = x.copy()
        y[free] += null @ (dual @ (target - x)[free])
        return np.clip(y, 0.9 * lower, 0.9 * upper)

    def same_shape(y: FloatArray) -> bool:
        slope = float(np.abs(problem.gradient(y)[free]).max())
        return abs(problem.value(y) - energy) <= allowed and slope <= _STATIONARY

    def softest(values: FloatArray) -> float:
        y = moved(values)
        if spent() or not same_shape(y):
            return level  # not better than no ruling at all
        return _lowest(problem, bending_metric, y, bending)

    def stop(values: FloatArray) -> None:
        if softest(values) < -_CLEARLY * scale:
            raise StopIteration

    level = _lowest(problem, bending_metric, x, bending)
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
