"""Many chained problems of one size, each solved and judged inside one kernel: nothing is done in Python between them.

The kernel releases the interpreter's lock; `ribbon.find.many` runs it in threads, a slice of the cases each.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ribbon.energies.names import FREE_CODE
from ribbon.problems import chained_kernels as kernels
from ribbon.solvers import riccati
from ribbon.solvers.chained_newton import CONVERGED, ENDED, descend

#: Places in `found`: number of the end (`chained_newton`), residual, iterations, lowest eigenvalue (nan: not judged),
#: and whether it is clearly positive.
END, RESIDUAL, ITERATIONS, LOWEST, STABLE = range(5)
FOUND = 5
#: Powers of four tried for a bracket; its width over its size; steps of the inverse iteration and its tolerance.
_POWERS = 40
_BRACKET = 0.25
_STEPS = 200
_SAME = 1e-9


@njit(cache=True)
def _count(sigma, lengths, local, coupled, u, v, none, held, gains, inverses, first):
    return riccati.factor(lengths, local, coupled, u, v, -sigma, none, held, gains, inverses, first)


@njit(cache=True)
def bracket(lengths, local, coupled, u, v, none, held, gains, inverses, first):
    """A number that no eigenvalue is below, close to the lowest, and a bound of the largest, at most four times it."""
    moving = 0
    for i in range(held.size):
        moving += not held[i]
    largest = 1.0
    for _ in range(_POWERS):
        if _count(largest, lengths, local, coupled, u, v, none, held, gains, inverses, first) == moving:
            break
        largest *= 4.0
    low, high = 0.0, 1.0
    if _count(0.0, lengths, local, coupled, u, v, none, held, gains, inverses, first) > 0:
        low, high = -1.0, 0.0
        while _count(low, lengths, local, coupled, u, v, none, held, gains, inverses, first) > 0:
            low, high = 4.0 * low, low
    else:
        while _count(high, lengths, local, coupled, u, v, none, held, gains, inverses, first) == 0:
            low, high = high, 4.0 * high
    while high - low > _BRACKET * max(1e-3, max(abs(low), abs(high))):
        middle = 0.5 * (low + high)
        if _count(middle, lengths, local, coupled, u, v, none, held, gains, inverses, first) > 0:
            high = middle
        else:
            low = middle
    while _count(low, lengths, local, coupled, u, v, none, held, gains, inverses, first) > 0:  # rounding
        low -= _BRACKET * max(1.0, abs(low))
    return low, largest


@njit(cache=True)
def lowest(low, lengths, local, coupled, u, v, none, held, gains, inverses, first, mode):
    """The lowest eigenvalue by inverse iteration from `low` (`bracket`); `mode` (n,) is filled with its mode."""
    n = held.size
    fields = inverses.shape[1]
    right = np.empty(n)
    turned = np.empty(3)
    _count(low, lengths, local, coupled, u, v, none, held, gains, inverses, first)
    for i in range(n):
        mode[i] = 0.0 if held[i] else 1.0 + (i * 0.6180339887498949) % 1.0
    found = np.inf
    for _ in range(_STEPS):
        riccati.mass_times(lengths, fields, mode, right)
        size = 0.0
        for i in range(n):
            right[i] = 0.0 if held[i] else right[i]
            size += right[i] * mode[i]
        size = np.sqrt(size)
        for i in range(n):
            right[i] /= size
            mode[i] /= size
        before = found
        riccati.solve(lengths, coupled, u, gains, inverses, first, right, mode, turned)
        # at a mode of unit length y = (H - low M)^-1 M mode has the length 1 / (eigenvalue - low)
        product = 0.0
        riccati.mass_times(lengths, fields, mode, right)
        for i in range(n):
            product += 0.0 if held[i] else right[i] * mode[i]
        found = low + 1.0 / np.sqrt(product)
        if abs(found - before) <= _SAME * max(abs(found), 1e-3):
            break
    return found


@njit(cache=True, nogil=True)
def run(
    cases, xs, lengths, code, sections, natural, curvatures, poissons, gammas, ups, forces, pulled, frames, limit,
    lowers, uppers, reach, tolerances, goods, most, indifferent, near_bound, warm, gradients, found,
):  # fmt: skip
    """Solves the cases numbered `cases` from xs (k, n), in place, and judges what converged.

    Arguments as of `descend`, a row for each case; most: steps; indifferent, near_bound: what counts as an eigenvalue
    of zero (over the largest), and as a bound that is active (over its size); warm: whether a case starts from the
    solution of the one before it, where that was stable; found (k, FOUND), gradients (k, n) are filled.
    """
    n = xs.shape[1]
    p = lengths.size
    fields = n // (p + 1)
    count = 2 * fields
    free = code >= FREE_CODE
    q = np.empty((p, count))
    local = np.empty((p, 15 if fields == 2 else 28))
    gains = np.empty((p, fields, fields + 3))
    inverses = np.empty((p, fields, fields))
    first = np.empty((fields, fields))
    held = np.empty(n, dtype=np.bool_)
    none = np.zeros(n)
    state = np.empty(9)
    before = np.empty(n)
    start = np.empty(n)
    mode = np.empty(n)
    below = np.empty(n)
    above = np.empty(n)
    has_before = False
    for i in cases:
        start[:] = xs[i]
        for attempt in range(2):
            is_warm = attempt == 0 and warm and has_before
            if attempt == 0 and not is_warm:
                continue
            xs[i] = before if is_warm else start
            state[:] = 0.0
            state[7] = -1.0 if is_warm else 0.0
            descend(
                xs[i], lengths, code, (sections[i, 0], sections[i, 1], sections[i, 2], sections[i, 3]), natural[i],
                curvatures[i], poissons[i], gammas[i], ups[i], forces[i], pulled[i], frames[i], limit, lowers[i],
                uppers[i], reach, tolerances[i], goods[i], most, state, gradients[i], below, above,
            )  # fmt: skip
            found[i, END], found[i, RESIDUAL] = state[ENDED], state[1]
            found[i, ITERATIONS] = state[3]
            found[i, LOWEST], found[i, STABLE] = np.nan, 0.0
            if state[ENDED] != CONVERGED:
                continue
            for k in range(n):
                span = near_bound * max(abs(lowers[i, k]), abs(uppers[i, k]))
                held[k] = lowers[i, k] == uppers[i, k] or (
                    np.isfinite(span) and min(xs[i, k] - lowers[i, k], uppers[i, k] - xs[i, k]) <= span
                )
            kernels.unpack(xs[i], lengths, q)
            section = (sections[i, 0], sections[i, 1], sections[i, 2], sections[i, 3])
            kernels.local_derivatives(q, lengths, code, section, natural[i], curvatures[i], poissons[i], local)
            coupled = gammas[i] != 0.0 or pulled[i]
            u = np.zeros((p if coupled else 1, count, 3))
            v = np.zeros((p if coupled else 1, count, 3))
            if coupled:
                kernels.load_derivatives(free, q, lengths, gammas[i], ups[i], forces[i], frames[i], limit, local, u, v)
            low, largest = bracket(lengths, local, coupled, u, v, none, held, gains, inverses, first)
            least = lowest(low, lengths, local, coupled, u, v, none, held, gains, inverses, first, mode)
            found[i, LOWEST] = least
            found[i, STABLE] = 1.0 if least > indifferent * max(1.0, largest) else 0.0
            if found[i, STABLE] == 1.0:
                before[:] = xs[i]
                has_before = True
                break
