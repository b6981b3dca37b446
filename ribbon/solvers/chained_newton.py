"""Newton's iteration of a chained problem as one kernel: Riccati steps, a barrier, a line search (numba).

Every iteration costs O(p): the jets of the segments, factorisations of `ribbon.solvers.riccati`, a few energies. Where
the Hessian is not positive it is shifted by the metric ``int (dfields)^2 ds`` until it is (its inertia comes with the
factorisation). Bounds |eta'| <= 2 l / w are kept by a primal-dual barrier with Ipopt's rules (Waechter and Biegler,
doi:10.1007/s10107-004-0559-y) as long as one is near; at last without it, with what is pressed against a bound on it
(projected Newton steps: Bertsekas 1982, doi:10.1137/0320018), so that a state is exact to rounding. The kernel releases
the interpreter's lock: batches run it in threads.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ribbon.element.series import FURTHEST
from ribbon.energies.codes import has_free_twist
from ribbon.problems import chained_kernels as kernels
from ribbon.solvers import riccati

#: Places of the numbers that go from one call of `descend` to the next: energy, residual, last shift, iterations,
#: how many energies and derivatives were evaluated, how the call ended, the barrier's parameter (0: none), the residual
#: below which Newton's own step is tried on an indefinite Hessian, whether the jets are those of the last x.
ENERGY, RESIDUAL, SHIFT, ITERATIONS, VALUES, DERIVATIVES, ENDED, BARRIER, SADDLE, FRESH = range(10)
STATE = 10
#: How a call of `descend` ended: stationary, not yet, no lower energy found along the step, not to be evaluated.
CONVERGED, GOING, STUCK, UNDEFINED = range(4)

#: Turn (rad) of all states that one call looks at, after which it returns: the longer the series, the more often the
#: clock is looked at, and signals (some 0.5 s, and one step at least).
_TURNED = 1e5
#: Longest step.
_LONGEST = 1e4
#: Part of the largest local stiffness by which the Hessian is always shifted: null rulings stand still.
_FLOOR = 1e-13
#: Least shift and the first one tried, over the largest local stiffness; how shifts grow and shrink, and how many times
#: too large the one taken may be.
_LEAST, _FIRST = 1e-10, 1e-3
_STRIDE = 9.0
_NARROW = 3.0
#: Sufficient decrease; shortest step; rounding of the energy, over its size and at least 1.
_ARMIJO = 1e-4
_SHORTEST = 1e-6
_ROUNDING = 1e-14
#: Largest rotation (rad) of the strip in one step.
_TURN = 2.0
#: Part of the decrease that its slope promises, above which a step was too short (half: a quadratic energy).
_TOO_SHORT = 0.6
#: Part of the way to a bound that a step takes an unknown to, and how often those that would go further are collected.
_SHARE, _ROUNDS = 0.5, 4
#: Weight that holds an unknown at a step, over the largest local stiffness.
_HEAVY = 1e6
#: A field whose gradient is less than this part of the others' does not move.
_UNMOVED = 1e-11
#: The barrier: its parameter at first, at last, and near the end; the part of the range from the
#: bounds at the start, and near the end; beyond which all
#: bounds count as far; part of the way to a bound that one step may go; how far multipliers may be from mu / distance.
MU = 1e-4
_LAST_MU = 1e-9
_NEAR_MU = 1e-7
_PUSH = 1e-2
_NEAR_PUSH = 1e-8
_FAR = 0.02
_FRACTION = 0.9
_KAPPA = 1e10
#: Distances over its size from which a bound stops a step, and draws what is pressed against it, without a barrier.
_ON_BOUND, _NEAR_BOUND = 1e-8, 1e-3
#: Residual below which Newton's own step is tried on an indefinite Hessian: the point is a saddle, if it converges.
_SADDLE = 1e-5


@njit(cache=True)
def _turn(free, q, lengths):
    """A bound of the turn (rad) of a strip with parameters q (`ribbon.problems.chained.too_far`)."""
    whole = 0.0
    for i in range(lengths.size):
        if free:
            turn = abs(q[i, 1]) + abs(q[i, 3]) + (abs(q[i, 0]) + abs(q[i, 2])) * lengths[i]
            if q.shape[1] == 6:
                turn += abs(q[i, 5]) + abs(q[i, 4]) * lengths[i]
        else:
            turn = abs(q[i, 1]) + abs(q[i, 0]) * lengths[i]
            turn *= 1.0 + abs(q[i, 3]) + abs(q[i, 2]) * lengths[i]
        whole += turn * lengths[i]
    return whole


class Bounds(NamedTuple):
    """Bounds (n,) of the unknowns, and the share of the way to one that a step may go without a barrier (1: the energy
    is finite on the bound)."""

    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    reach: float


class Linear(NamedTuple):
    """The Hessian at a point, and its factors, as `ribbon.solvers.riccati` takes them.

    lengths (p,); local (p, 15 or 28); u, v (p, 4 or 6, 3) where `coupled`; extra (n,): added to its diagonal; held
    (n,): what does not move; gains, inverses, first: the factors.
    """

    lengths: NDArray[np.float64]
    local: NDArray[np.float64]
    coupled: bool
    u: NDArray[np.float64]
    v: NDArray[np.float64]
    extra: NDArray[np.float64]
    held: NDArray[np.bool_]
    gains: NDArray[np.float64]
    inverses: NDArray[np.float64]
    first: NDArray[np.float64]


@njit(cache=True)
def _factor(linear, shift):
    """Factors the Hessian shifted by this; how many eigenvalues are negative."""
    return riccati.factor(
        linear.lengths, linear.local, linear.coupled, linear.u, linear.v, shift, linear.extra, linear.held,
        linear.gains, linear.inverses, linear.first,
    )  # fmt: skip


@njit(cache=True)
def _solve(linear, right, step, turned):
    """Fills `step` (n,), and the rotations `turned` (3,) that come with it."""
    riccati.solve(
        linear.lengths, linear.coupled, linear.u, linear.gains, linear.inverses, linear.first, right, step, turned
    )


@njit(cache=True)
def energy(x, q, lengths, material, loads, parts):
    """Energy (D w / l) of the unknowns x, up to the clamp's height; nan beyond what can be evaluated."""
    kernels.unpack(x, lengths, q)
    free = has_free_twist(material.code)
    if not _turn(free, q, lengths) <= FURTHEST:
        return np.nan
    kernels.energy_parts(q, lengths, material, loads, np.zeros(3), parts)
    total = parts[0] + parts[1] + parts[2]
    if loads.pulled:
        points = np.empty((lengths.size + 1, 3))
        frames = np.empty((lengths.size + 1, 3, 3))
        kernels.walk(free, q, lengths, np.zeros(3), loads.frame, loads.limit, points, frames, np.empty(3))
        for r in range(3):
            total -= loads.force[r] * points[lengths.size, r]
    return total


@njit(cache=True)
def _logarithms(x, lower, upper, mu):
    """The barrier's part of the merit function, -mu sum ln(distance to a bound); inf beyond one."""
    total = 0.0
    for i in range(x.size):
        if lower[i] < upper[i] and np.isfinite(upper[i]):
            if not (x[i] > lower[i] and x[i] < upper[i]):
                return np.inf
            total -= np.log(x[i] - lower[i]) + np.log(upper[i] - x[i])
    return mu * total


@njit(cache=True)
def _pressed(x, gradient, lower, upper, held):
    """Marks fixed unknowns, and those on a bound that the energy presses against it: they do not move."""
    for i in range(x.size):
        pressed = (x[i] <= lower[i] and gradient[i] > 0.0) or (x[i] >= upper[i] and gradient[i] < 0.0)
        held[i] = pressed or lower[i] == upper[i]


@njit(cache=True)
def _residual(gradient, fields, held, unmoved):
    """Largest component of the gradient on what is not held; marks as held the fields that nothing moves while others
    move (a strip that bends in a plane)."""
    worst = np.zeros(3)
    for i in range(gradient.size):
        if not held[i]:
            if np.isnan(gradient[i]):
                return np.nan
            worst[i % fields] = max(worst[i % fields], abs(gradient[i]))
    for f in range(fields):
        if worst[f] <= unmoved * worst.max():
            for i in range(f, gradient.size, fields):
                held[i] = True
    return worst.max()


@njit(cache=True)
def _stopped(x, gradient, step, lower, upper, reach, held, jump):
    """What the step would take beyond a bound that is near is held; where the energy presses it there and is finite,
    `jump` takes it onto the bound."""
    found = False
    for i in range(x.size):
        if not held[i] and np.isfinite(upper[i]):
            left = upper[i] - x[i] if step[i] > 0.0 else x[i] - lower[i]
            if left < _NEAR_BOUND * upper[i] and abs(step[i]) > left:
                if reach == 1.0 and gradient[i] * step[i] < 0.0:
                    jump[i] = left if step[i] > 0.0 else -left
                    held[i] = found = True
                elif left < _ON_BOUND * upper[i]:
                    held[i] = found = True
    return found


@njit(cache=True)
def _begin(x, lower, upper, near):
    """Moves x off its bounds; returns the barrier's parameter: 0 without bounds, and for a start that is `near` its end
    and far from all of them."""
    mu = 0.0
    pushes = _NEAR_PUSH if near else _PUSH
    for i in range(x.size):
        if lower[i] < upper[i] and np.isfinite(upper[i]):
            push = pushes * (upper[i] - lower[i])
            x[i] = min(max(x[i], lower[i] + push), upper[i] - push)
            if not near:
                mu = MU
            elif min(x[i] - lower[i], upper[i] - x[i]) < _FAR * (upper[i] - lower[i]):
                mu = _NEAR_MU
        else:
            x[i] = min(max(x[i], lower[i]), upper[i])
    return mu


@njit(cache=True)
def _next_barrier(x, gradient, lower, upper, below, above, mu):
    """The barrier's parameter after this point: the same while its problem is not solved, then a smaller one, and 0
    when no bound is near or the last one is done ."""
    worst = 0.0
    nearest = np.inf
    for i in range(x.size):
        if lower[i] == upper[i]:
            continue
        total = gradient[i]
        if np.isfinite(upper[i]):
            left, right = x[i] - lower[i], upper[i] - x[i]
            total += above[i] - below[i]
            worst = max(worst, abs(below[i] * left - mu), abs(above[i] * right - mu))
            nearest = min(nearest, min(left, right) / (upper[i] - lower[i]))
        worst = max(worst, abs(total))
    if not worst <= 10.0 * mu:
        return mu
    if nearest > _FAR:
        return 0.0
    return max(_LAST_MU, min(0.2 * mu, mu**1.5)) if mu > _LAST_MU else 0.0


@njit(cache=True)
def _least_shift(last, stiffest, linear):
    """A shift of an indefinite Hessian that makes it positive, at most _NARROW times what is needed, beginning at the
    `last` one (0: none); the factors are those of the Hessian shifted by it."""
    least = _LEAST * stiffest
    used = max(last, least) if last > 0.0 else _FIRST * stiffest
    low = used
    positive = False
    while used < 1e12 * stiffest:
        positive = _factor(linear, used) == 0
        if positive:
            break
        low, used = used, used * _STRIDE
    if low == used:
        while used > least:
            low = max(used / _STRIDE, least)
            positive = _factor(linear, low) == 0
            if not positive:
                break
            used = low
    while used > _NARROW * low and used > least:
        shift = np.sqrt(low * used)
        positive = _factor(linear, shift) == 0
        if positive:
            used = shift
        else:
            low = shift
    if not positive:
        _factor(linear, used)
    return used


@njit(cache=True)
def _inside(linear, shift, x, slopes, bounds, heavy, right, step, turned):
    """What a `step` (n,) takes more than _SHARE of the way to its bound goes so far and no further, and the others step
    as suits that: one ruling at its bound does not shorten the step of all.

    `right` (n,), the negative `slopes`, and `extra` (n,) of the factors are changed. The step stays where the new one
    does not lead down.
    """
    lower, upper, extra = bounds.lower, bounds.upper, linear.extra
    whole, turns = step.copy(), turned.copy()
    for _ in range(_ROUNDS):
        found = False
        for i in range(x.size):
            if not linear.held[i] and np.isfinite(upper[i]) and extra[i] < heavy:
                reach = _SHARE * (upper[i] - x[i] if step[i] > 0.0 else lower[i] - x[i])
                if abs(step[i]) > 1.001 * abs(reach):
                    extra[i] += heavy
                    right[i] += heavy * reach
                    found = True
        if not found:
            break
        _factor(linear, shift)
        _solve(linear, right, step, turned)
    slope = 0.0
    for i in range(x.size):
        slope += slopes[i] * step[i]
    if not slope < 0.0:
        step[:] = whole
        turned[:] = turns


def jets(segments, fields, coupled):
    """Room for the jets of a strip of so many fields, and for the factors of its loads (`Linear`)."""
    count = 2 * fields
    loaded = (segments if coupled else 1, count, 3)
    return np.empty((segments, 15 if fields == 2 else 28)), np.zeros(loaded), np.zeros(loaded)


@njit(cache=True)
def _linear(lengths, fields, coupled, own):
    """Room for the Hessian of a strip of so many fields, whose jets are in `own`, and for its factors."""
    p, size = lengths.size, fields * (lengths.size + 1)
    return Linear(
        lengths,
        own[0],
        coupled,
        own[1],
        own[2],
        np.zeros(size),
        np.empty(size, dtype=np.bool_),
        np.empty((p, fields, fields + 3)),
        np.empty((p, fields, fields)),
        np.empty((fields, fields)),
    )


@njit(cache=True)
def _started(x, bounds, state, below, above):
    """The barrier, and the bounds' multipliers `below`, `above` (n,) for it, at a start moved off its bounds."""
    lower, upper = bounds.lower, bounds.upper
    mu = _begin(x, lower, upper, state[BARRIER] < 0.0)
    state[BARRIER], state[SADDLE] = mu, _SADDLE
    for i in range(x.size):
        below[i] = above[i] = 0.0
        if mu > 0.0 and lower[i] < upper[i] and np.isfinite(upper[i]):
            below[i], above[i] = mu / (x[i] - lower[i]), mu / (upper[i] - x[i])


@njit(cache=True)
def _derived(q, material, loads, linear, gradient):
    """Fills the Hessian and the `gradient` (n,) at the parameters q; the largest local stiffness, at least 1."""
    lengths, local = linear.lengths, linear.local
    kernels.local_derivatives(q, lengths, material, local)
    if linear.coupled:
        kernels.load_derivatives(has_free_twist(material.code), q, lengths, loads, local, linear.u, linear.v)
    kernels.assemble_gradient(lengths, local, gradient)
    fields = q.shape[1] // 2
    place = kernels.pairs(2 * fields)
    stiffest = 1.0
    for i in range(lengths.size):
        for f in range(fields):
            stiffest = max(stiffest, abs(local[i, place[2 * f + 1, 2 * f + 1]]) / lengths[i])
    return stiffest


@njit(cache=True)
def _sloped(x, gradient, bounds, below, above, mu, linear, slopes):
    """Fills the slopes (n,) of the merit function, what a barrier adds to the Hessian's diagonal, what is held."""
    lower, upper, held, extra = bounds.lower, bounds.upper, linear.held, linear.extra
    slopes[:] = gradient
    extra[:] = 0.0
    if mu == 0.0:
        _pressed(x, gradient, lower, upper, held)
        return
    for i in range(x.size):
        held[i] = lower[i] == upper[i]
        if not held[i] and np.isfinite(upper[i]):
            left, rest = x[i] - lower[i], upper[i] - x[i]
            slopes[i] += mu / rest - mu / left
            extra[i] = below[i] / left + above[i] / rest


@njit(cache=True)
def _stepped(x, gradient, slopes, bounds, linear, used, stiffest, bounded, walled, right, step, jump, turned):
    """Fills the `step` (n,) that goes down the slopes, what of it `jump`s onto bounds, and the rotations with it.

    bounded: there are bounds and no barrier; walled: a step must not reach them."""
    for i in range(x.size):
        right[i] = -slopes[i]
    _solve(linear, right, step, turned)
    jump[:] = 0.0
    while bounded and _stopped(x, gradient, step, bounds.lower, bounds.upper, bounds.reach, linear.held, jump):
        _factor(linear, used)
        _solve(linear, right, step, turned)
    for i in range(x.size):
        step[i] += jump[i]
    if walled:
        _inside(linear, used, x, slopes, bounds, _HEAVY * stiffest, right, step, turned)


@njit(cache=True)
def _furthest(x, step, bounds, held, walled, turned):
    """How many times the step may be gone: as its rotations, and bounds where they must not be reached, allow."""
    most = _LONGEST
    for r in range(3):
        if turned[r] * most > _TURN:
            most = _TURN / turned[r]
    if walled:
        for i in range(x.size):
            if not held[i] and np.isfinite(bounds.upper[i]):
                left = bounds.upper[i] - x[i] if step[i] > 0.0 else x[i] - bounds.lower[i]
                if abs(step[i]) * most > _FRACTION * left:
                    most = _FRACTION * left / abs(step[i])
    return most


@njit(cache=True)
def _gone(x, step, length, jump, slopes, bounds, mu, y):
    """Fills y (n,) with x after this length of the step, bounds kept; its slope."""
    lower, upper, reach = bounds.lower, bounds.upper, bounds.reach
    slope = 0.0
    for i in range(x.size):
        y[i] = x[i]
        if step[i] != 0.0:
            y[i] += length * step[i]
            if mu == 0.0:
                y[i] = max(y[i], lower[i] if reach == 1.0 else x[i] + reach * (lower[i] - x[i]))
                y[i] = min(y[i], upper[i] if reach == 1.0 else x[i] + reach * (upper[i] - x[i]))
                if jump[i] != 0.0 and length == 1.0:
                    y[i] = upper[i] if jump[i] > 0.0 else lower[i]
            slope += slopes[i] * (y[i] - x[i])
    return slope


@njit(cache=True)
def _merit(x, q, lengths, material, loads, bounds, mu, state, parts):
    """The energy at x, and with the barrier."""
    new = energy(x, q, lengths, material, loads, parts)
    state[VALUES] += 1.0
    return new, new + (_logarithms(x, bounds.lower, bounds.upper, mu) if mu > 0.0 else 0.0)


@njit(cache=True)
def _searched(
    x, q, lengths, material, loads, bounds, mu, value, slopes, step, jump, most, untried, walled, state, parts, y
):  # fmt: skip
    """The length of the step that is gone, to y (n,), the energy there, and whether the gradient alone can judge it; a
    length of 0: nothing lower was found.

    most: times that the step may be gone; untried: the Hessian is indefinite and was not shifted."""
    longest = min(1.0, most)
    length = longest
    merit = value + (_logarithms(x, bounds.lower, bounds.upper, mu) if mu > 0.0 else 0.0)
    rounding = _ROUNDING * max(1.0, abs(value))
    accepted = blind = False
    new = total = slope = 0.0
    while length > _SHORTEST * longest:
        slope = _gone(x, step, length, jump, slopes, bounds, mu, y)
        new, total = _merit(y, q, lengths, material, loads, bounds, mu, state, parts)
        if np.isfinite(total):
            if abs(slope) <= 100.0 * rounding or untried:
                accepted = blind = True  # judged by the gradient
            elif slope < 0.0 and total <= merit + _ARMIJO * slope + rounding:
                accepted = True
        if accepted:
            break
        length *= 0.5
    if not accepted:
        return 0.0, value, False
    longer = np.empty(x.size if walled else 0)
    while walled and not blind and length >= longest and merit - total > _TOO_SHORT * abs(slope):
        if not 1.5 * length < most:
            break
        further = min(2.0 * length, most)
        slope = 0.0
        for i in range(x.size):
            longer[i] = x[i] + further * step[i]
            slope += slopes[i] * (longer[i] - x[i])
        reached, lowered = _merit(longer, q, lengths, material, loads, bounds, mu, state, parts)
        if not lowered < total:
            break
        total, new, length = lowered, reached, further
        y[:] = longer
    return length, new, blind


@njit(cache=True)
def _bounded(bounds):
    """Whether an unknown that moves has a bound."""
    return np.any(np.isfinite(bounds.upper) & (bounds.lower < bounds.upper))


@njit(cache=True, nogil=True)
def descend(x, lengths, material, loads, bounds, exact, iterations, state, gradient, below, above, own):
    """At most `iterations` steps of Newton's iteration from x (n,), in place, and fewer where their series are long;
    `state` (STATE,), zeros at first, goes on from call to call, as do the bounds' multipliers `below`, `above` (n,);
    `gradient` (n,) is that of the last x, and so are the `jets` in `own` where the state says FRESH.

    material, loads: `ribbon.problems.arguments`; bounds: `Bounds`; exact (2,): tolerance of the residual, which ends at
    the second number, where rounding lets it fall no more, or where two whole Newton steps in a row (no barrier, no
    shift, not shortened) say that quadratic convergence has already brought it below the second number. A state that
    begins with a barrier of -1 is near its end.
    """
    fields = x.size // (lengths.size + 1)
    q, parts = np.empty((lengths.size, 2 * fields)), np.empty(3)
    linear = _linear(lengths, fields, loads.gamma != 0.0 or loads.pulled, own)
    step, right, y = np.empty(x.size), np.empty(x.size), np.empty(x.size)
    kept, slopes, jump = np.empty(x.size), np.empty(x.size), np.empty(x.size)
    turned = np.empty(3)
    tolerance, good = exact
    if state[VALUES] == 0.0:
        _started(x, bounds, state, below, above)
        state[ENERGY] = energy(x, q, lengths, material, loads, parts)
        state[VALUES] += 1.0
    value = before_value = state[ENERGY]
    if not np.isfinite(value):
        state[ENDED] = UNDEFINED
        return
    bounded = _bounded(bounds)
    steep = bounded and bounds.reach < 1.0  # the energy is infinite on a bound
    blind = False  # whether the last step was taken by the gradient, its energy being rounding or a saddle's
    before = np.inf
    earlier = 0.0  # the residual before that, where the last two steps are whole Newton steps, else 0
    whole = False  # whether the last step is one
    negative = turn = 0
    turned_so_far = 0.0
    while True:
        kernels.unpack(x, lengths, q)
        turned_so_far += _turn(has_free_twist(material.code), q, lengths)
        stiffest = _derived(q, material, loads, linear, gradient)
        state[DERIVATIVES] += 1.0
        state[FRESH] = 1.0
        mu = state[BARRIER]
        if mu > 0.0:
            following = _next_barrier(x, gradient, bounds.lower, bounds.upper, below, above, mu)
            blind = blind and following == mu
            mu = state[BARRIER] = following
        _sloped(x, gradient, bounds, below, above, mu, linear, slopes)
        residual = _residual(slopes, fields, linear.held, _UNMOVED)
        if blind and not residual < before:
            x[:] = kept
            gradient[:] = right
            state[FRESH] = 0.0
            state[ENERGY] = value = before_value
            state[RESIDUAL] = before
            if negative == 0:  # rounding has the last word
                state[ENDED] = CONVERGED if before <= tolerance and mu == 0.0 else STUCK
                return
            state[SADDLE], blind = 0.1 * before, False  # no saddle here: down again
            continue
        state[RESIDUAL] = residual
        # as the last two steps converged, quadratically, this one is exact: what is left is rounding
        if mu == 0.0 and (residual <= good or (residual <= tolerance and before**3 <= good * earlier * earlier)):
            state[ENDED] = CONVERGED
            return
        if turn == iterations or (turn > 0 and turned_so_far > _TURNED):
            state[ENDED] = CONVERGED if residual <= tolerance and mu == 0.0 else GOING
            return
        turn += 1
        used = _FLOOR * stiffest
        negative = _factor(linear, used)
        shifted = negative > 0 and (residual > state[SADDLE] or mu > 0.0)
        if shifted:
            used = state[SHIFT] = _least_shift(state[SHIFT], stiffest, linear)
        walled = mu > 0.0 or steep
        free = bounded and mu == 0.0
        _stepped(x, gradient, slopes, bounds, linear, used, stiffest, free, walled, y, step, jump, turned)
        most = _furthest(x, step, bounds, linear.held, walled, turned)
        right[:], kept[:] = gradient, x
        before_value, earlier, before = value, before if whole else 0.0, residual
        untried = negative > 0 and not shifted
        length, value, blind = _searched(
            x, q, lengths, material, loads, bounds, mu, value, slopes, step, jump, most, untried, walled, state, parts,
            y,
        )  # fmt: skip
        if length == 0.0:
            state[ENDED] = CONVERGED if residual <= tolerance and mu == 0.0 else STUCK
            return
        if mu > 0.0:
            _move_multipliers(x, step, length, bounds.lower, bounds.upper, linear.held, below, above, mu, y)
        whole = mu == 0.0 and negative == 0 and length == 1.0
        if not whole:
            earlier = 0.0
        x[:] = y
        state[ENERGY] = value
        state[ITERATIONS] += 1.0


@njit(cache=True)
def _move_multipliers(x, step, length, lower, upper, held, below, above, mu, y):
    """Newton's step of the bounds' multipliers, as long as they stay positive, and near mu / distance at the new y."""
    share = 1.0
    for i in range(x.size):
        if not held[i] and np.isfinite(upper[i]):
            left, rest = x[i] - lower[i], upper[i] - x[i]
            move = mu / left - below[i] - below[i] / left * step[i]
            if move < -_FRACTION * below[i] / share:
                share = -_FRACTION * below[i] / move
            move = mu / rest - above[i] + above[i] / rest * step[i]
            if move < -_FRACTION * above[i] / share:
                share = -_FRACTION * above[i] / move
    for i in range(x.size):
        if lower[i] < upper[i] and np.isfinite(upper[i]):
            moved = step[i] if not held[i] else 0.0
            left, rest = x[i] - lower[i], upper[i] - x[i]
            below[i] += share * (mu / left - below[i] - below[i] / left * moved)
            above[i] += share * (mu / rest - above[i] + above[i] / rest * moved)
            near = mu / (y[i] - lower[i])
            below[i] = min(max(below[i], near / _KAPPA), near * _KAPPA)
            near = mu / (upper[i] - y[i])
            above[i] = min(max(above[i], near / _KAPPA), near * _KAPPA)
