"""Newton's iteration of a chained problem as one kernel: Riccati steps, a barrier, a line search (numba).

Every iteration costs O(p): the jets of the segments, factorisations of `ribbon.solvers.riccati`, a few energies. Where
the Hessian is not positive it is shifted by the metric ``int (dfields)^2 ds`` until it is (its inertia comes with the
factorisation). Bounds |eta'| <= 2 l / w are kept by a primal-dual barrier with Ipopt's rules (Waechter and Biegler,
doi:10.1007/s10107-004-0559-y) as long as one is near; at last without it, with what is pressed against a bound on it
(projected Newton steps: Bertsekas 1982, doi:10.1137/0320018), so that a state is exact to rounding. The kernel releases
the interpreter's lock: batches run it in threads.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ribbon.element.series import FURTHEST
from ribbon.energies.names import FREE_CODE
from ribbon.problems import chained_kernels as kernels
from ribbon.solvers import riccati

#: Places of the numbers that go from one call of `descend` to the next: energy, residual, last shift, iterations,
#: how many energies and derivatives were evaluated, how the call ended, the barrier's parameter (0: none), the residual
#: below which Newton's own step is tried on an indefinite Hessian.
ENERGY, RESIDUAL, SHIFT, ITERATIONS, VALUES, DERIVATIVES, ENDED, BARRIER, SADDLE = range(9)
STATE = 9
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


@njit(cache=True)
def energy(x, q, lengths, code, section, natural, curvature, poisson, gamma, up, force, pulled, frame, limit, parts):
    """Energy (D w / l) of the unknowns x, up to the clamp's height; nan beyond what can be evaluated."""
    kernels.unpack(x, lengths, q)
    free = code >= FREE_CODE
    if not _turn(free, q, lengths) <= FURTHEST:
        return np.nan
    kernels.energy_parts(
        q, lengths, code, section, natural, curvature, poisson, gamma, up, np.zeros(3), frame, limit, parts
    )
    total = parts[0] + parts[1] + parts[2]
    if pulled:
        points = np.empty((lengths.size + 1, 3))
        frames = np.empty((lengths.size + 1, 3, 3))
        kernels.walk(free, q, lengths, np.zeros(3), frame, limit, points, frames)
        for r in range(3):
            total -= force[r] * points[lengths.size, r]
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
def _least_shift(last, stiffest, lengths, local, coupled, u, v, extra, held, gains, inverses, first):
    """A shift of an indefinite Hessian that makes it positive, at most _NARROW times what is needed, beginning at the
    `last` one (0: none); the factors are those of the Hessian shifted by it."""
    least = _LEAST * stiffest
    used = max(last, least) if last > 0.0 else _FIRST * stiffest
    low = used
    positive = False
    while used < 1e12 * stiffest:
        positive = riccati.factor(lengths, local, coupled, u, v, used, extra, held, gains, inverses, first) == 0
        if positive:
            break
        low, used = used, used * _STRIDE
    if low == used:
        while used > least:
            low = max(used / _STRIDE, least)
            positive = riccati.factor(lengths, local, coupled, u, v, low, extra, held, gains, inverses, first) == 0
            if not positive:
                break
            used = low
    while used > _NARROW * low and used > least:
        shift = np.sqrt(low * used)
        positive = riccati.factor(lengths, local, coupled, u, v, shift, extra, held, gains, inverses, first) == 0
        if positive:
            used = shift
        else:
            low = shift
    if not positive:
        riccati.factor(lengths, local, coupled, u, v, used, extra, held, gains, inverses, first)
    return used


@njit(cache=True)
def _inside(
    lengths, local, coupled, u, v, shift, extra, held, gains, inverses, first, x, slopes, lower, upper, heavy, right,
    step, turned,
):  # fmt: skip
    """What a `step` (n,) takes more than _SHARE of the way to its bound goes so far and no further, and the others step
    as suits that: one ruling at its bound does not shorten the step of all.

    `right` (n,), the negative `slopes`, and `extra` (n,) of the factors are changed. The step stays where the new one
    does not lead down.
    """
    whole, turns = step.copy(), turned.copy()
    for _ in range(_ROUNDS):
        found = False
        for i in range(x.size):
            if not held[i] and np.isfinite(upper[i]) and extra[i] < heavy:
                way = _SHARE * (upper[i] - x[i] if step[i] > 0.0 else lower[i] - x[i])
                if abs(step[i]) > 1.001 * abs(way):
                    extra[i] += heavy
                    right[i] += heavy * way
                    found = True
        if not found:
            break
        riccati.factor(lengths, local, coupled, u, v, shift, extra, held, gains, inverses, first)
        riccati.solve(lengths, coupled, u, gains, inverses, first, right, step, turned)
    slope = 0.0
    for i in range(x.size):
        slope += slopes[i] * step[i]
    if not slope < 0.0:
        step[:] = whole
        turned[:] = turns


@njit(cache=True, nogil=True)
def descend(
    x, lengths, code, section, natural, curvature, poisson, gamma, up, force, pulled, frame, limit, lower, upper, reach,
    tolerance, good, iterations, state, gradient, below, above,
):  # fmt: skip
    """At most `iterations` steps of Newton's iteration from x (n,), in place, and fewer where their series are long;
    `state` (STATE,), zeros at first, goes on from call to call, as do the bounds' multipliers `below`, `above` (n,);
    `gradient` (n,) is that of the last x.

    Arguments as in `ribbon.problems.chained_kernels`; force (3,) where `pulled`; lower, upper (n,); reach: share of the
    way to a bound that one step may go without a barrier (1: the energy is finite on the bound); tolerance: of the
    residual, which ends at `good` or where rounding lets it fall no more. A state that begins with a barrier of -1 is
    near its end.
    """
    p = lengths.size
    fields = x.size // (p + 1)
    count = 2 * fields
    place = kernels.pairs(count)
    q = np.empty((p, count))
    parts = np.empty(3)
    local = np.empty((p, 15 if fields == 2 else 28))
    coupled = gamma != 0.0 or pulled
    u = np.zeros((p if coupled else 1, count, 3))
    v = np.zeros((p if coupled else 1, count, 3))
    gains = np.empty((p, fields, fields + 3))
    inverses = np.empty((p, fields, fields))
    first = np.empty((fields, fields))
    held = np.empty(x.size, dtype=np.bool_)
    extra = np.zeros(x.size)
    step, right, y = np.empty(x.size), np.empty(x.size), np.empty(x.size)
    kept, slopes, jump = np.empty(x.size), np.empty(x.size), np.empty(x.size)
    longer = np.empty(x.size)
    turned = np.empty(3)
    free = code >= FREE_CODE
    if state[VALUES] == 0.0:
        mu = _begin(x, lower, upper, state[BARRIER] < 0.0)
        state[BARRIER], state[SADDLE] = mu, _SADDLE
        for i in range(x.size):
            below[i] = above[i] = 0.0
            if mu > 0.0 and lower[i] < upper[i] and np.isfinite(upper[i]):
                below[i], above[i] = mu / (x[i] - lower[i]), mu / (upper[i] - x[i])
        state[ENERGY] = energy(
            x, q, lengths, code, section, natural, curvature, poisson, gamma, up, force, pulled, frame, limit, parts
        )
        state[VALUES] += 1.0
    value = before_value = state[ENERGY]
    if not np.isfinite(value):
        state[ENDED] = UNDEFINED
        return
    bounded = False
    for i in range(x.size):
        bounded = bounded or (np.isfinite(upper[i]) and lower[i] < upper[i])
    steep = bounded and reach < 1.0  # the energy is infinite on a bound
    blind = False  # whether the last step was taken by the gradient, its energy being rounding or a saddle's
    before = np.inf
    negative = 0
    turn = 0
    turned_so_far = 0.0
    while True:
        kernels.unpack(x, lengths, q)
        turned_so_far += _turn(free, q, lengths)
        kernels.local_derivatives(q, lengths, code, section, natural, curvature, poisson, local)
        if coupled:
            kernels.load_derivatives(free, q, lengths, gamma, up, force, frame, limit, local, u, v)
        kernels.assemble_gradient(lengths, local, gradient)
        state[DERIVATIVES] += 1.0
        stiffest = 1.0
        for i in range(p):
            for f in range(fields):
                stiffest = max(stiffest, abs(local[i, place[2 * f + 1, 2 * f + 1]]) / lengths[i])
        mu = state[BARRIER]
        if mu > 0.0:
            following = _next_barrier(x, gradient, lower, upper, below, above, mu)
            if following != mu:
                blind = False
                state[BARRIER] = following
                mu = state[BARRIER]
        slopes[:] = gradient
        if mu > 0.0:
            for i in range(x.size):
                held[i] = lower[i] == upper[i]
                extra[i] = 0.0
                if not held[i] and np.isfinite(upper[i]):
                    left, rest = x[i] - lower[i], upper[i] - x[i]
                    slopes[i] += mu / rest - mu / left
                    extra[i] = below[i] / left + above[i] / rest
        else:
            extra[:] = 0.0
            _pressed(x, gradient, lower, upper, held)
        residual = _residual(slopes, fields, held, _UNMOVED)
        if blind and not residual < before:
            x[:] = kept
            gradient[:] = right
            state[ENERGY] = value = before_value
            state[RESIDUAL] = before
            if negative == 0:  # rounding has the last word
                state[ENDED] = CONVERGED if before <= tolerance and mu == 0.0 else STUCK
                return
            state[SADDLE], blind = 0.1 * before, False  # no saddle here: down again
            continue
        state[RESIDUAL] = residual
        if mu == 0.0 and residual <= good:
            state[ENDED] = CONVERGED
            return
        if turn == iterations or (turn > 0 and turned_so_far > _TURNED):
            state[ENDED] = CONVERGED if residual <= tolerance and mu == 0.0 else GOING
            return
        turn += 1
        used = _FLOOR * stiffest
        negative = riccati.factor(lengths, local, coupled, u, v, used, extra, held, gains, inverses, first)
        shifted = negative > 0 and (residual > state[SADDLE] or mu > 0.0)
        if shifted:
            used = _least_shift(
                state[SHIFT], stiffest, lengths, local, coupled, u, v, extra, held, gains, inverses, first
            )
            state[SHIFT] = used
        for i in range(x.size):
            y[i] = -slopes[i]
        riccati.solve(lengths, coupled, u, gains, inverses, first, y, step, turned)
        jump[:] = 0.0
        while mu == 0.0 and bounded and _stopped(x, gradient, step, lower, upper, reach, held, jump):
            riccati.factor(lengths, local, coupled, u, v, used, extra, held, gains, inverses, first)
            riccati.solve(lengths, coupled, u, gains, inverses, first, y, step, turned)
        for i in range(x.size):
            step[i] += jump[i]
        if mu > 0.0 or steep:
            _inside(
                lengths, local, coupled, u, v, used, extra, held, gains, inverses, first, x, slopes, lower, upper,
                _HEAVY * stiffest, y, step, turned,
            )  # fmt: skip
        most = _LONGEST
        for r in range(3):
            if turned[r] * most > _TURN:
                most = _TURN / turned[r]
        if mu > 0.0 or steep:
            for i in range(x.size):
                if not held[i] and np.isfinite(upper[i]):
                    left = upper[i] - x[i] if step[i] > 0.0 else x[i] - lower[i]
                    if abs(step[i]) * most > _FRACTION * left:
                        most = _FRACTION * left / abs(step[i])
        longest = min(1.0, most)
        right[:] = gradient
        kept[:] = x
        before_value = value
        before = residual
        length = longest
        merit = value + (_logarithms(x, lower, upper, mu) if mu > 0.0 else 0.0)
        accepted = False
        blind = False
        while length > _SHORTEST * longest:
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
            new = energy(
                y, q, lengths, code, section, natural, curvature, poisson, gamma, up, force, pulled, frame, limit, parts
            )
            state[VALUES] += 1.0
            total = new + (_logarithms(y, lower, upper, mu) if mu > 0.0 else 0.0)
            rounding = _ROUNDING * max(1.0, abs(value))
            if np.isfinite(total):
                if abs(slope) <= 100.0 * rounding or (not shifted and negative > 0):
                    accepted = blind = True  # judged by the gradient
                elif slope < 0.0 and total <= merit + _ARMIJO * slope + rounding:
                    accepted = True
            if accepted:
                break
            length *= 0.5
        if not accepted:
            state[ENDED] = CONVERGED if residual <= tolerance and mu == 0.0 else STUCK
            return
        while (mu > 0.0 or steep) and not blind and length >= longest and merit - total > _TOO_SHORT * abs(slope):
            if not 1.5 * length < most:
                break
            further = min(2.0 * length, most)
            slope = 0.0
            for i in range(x.size):
                longer[i] = x[i] + further * step[i]
                slope += slopes[i] * (longer[i] - x[i])
            reached = energy(
                longer, q, lengths, code, section, natural, curvature, poisson, gamma, up, force, pulled, frame, limit,
                parts,
            )  # fmt: skip
            state[VALUES] += 1.0
            lowered = reached + (_logarithms(longer, lower, upper, mu) if mu > 0.0 else 0.0)
            if not lowered < total:
                break
            total, new, length = lowered, reached, further
            y[:] = longer
        if mu > 0.0:
            _move_multipliers(x, step, length, lower, upper, held, below, above, mu, y)
        x[:] = y
        state[ENERGY] = value = new
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
