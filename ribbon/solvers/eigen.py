"""Lowest eigenvalue of a chained problem's Hessian in O(p), by the factors of `ribbon.solvers.riccati` (numba)."""

from __future__ import annotations

import numpy as np
from numba import njit

from ribbon.element.free_series import parameter_count
from ribbon.problems.chained_kernels import pairs
from ribbon.solvers import riccati

#: Powers of four tried for a bracket; its width over its size; steps of the inverse iteration and its tolerance.
_POWERS = 40
_BRACKET = 0.25
_STEPS = 100
_SAME = 1e-12
#: Steps after which the shift goes nearer to the eigenvalue, and to which part of its distance; how often at most.
_PATIENT, _NEARER, _SHIFTS = 6, 0.02, 8
#: How far below a guess of the eigenvalue the iteration begins, and below what was found none may lie, over its size.
_AROUND, _BELOW = 0.1, 1e-6


@njit(cache=True)
def _count(sigma, lengths, local, coupled, u, v, none, held, gains, inverses, first):
    return riccati.factor(lengths, local, coupled, u, v, -sigma, none, held, gains, inverses, first)


@njit(cache=True, nogil=True)
def largest(lengths, local, coupled, u, v, none, held, gains, inverses, first):
    """A bound of the largest eigenvalue (at least 1), at most four times it."""
    moving = 0
    for i in range(held.size):
        moving += not held[i]
    place = pairs(parameter_count(local.shape[1]))
    stiffest = 1.0
    for i in range(lengths.size):
        for f in range(inverses.shape[1]):
            stiffest = max(stiffest, abs(local[i, place[2 * f + 1, 2 * f + 1]]) / lengths[i])
    # from the power of four beside the stiffest segment up, or down as long as nothing is above
    bound = 4.0 ** min(np.floor(np.log2(stiffest) / 2.0), _POWERS) if stiffest < np.inf else 4.0**_POWERS
    if _count(bound, lengths, local, coupled, u, v, none, held, gains, inverses, first) == moving:
        while bound > 1.0:
            if _count(0.25 * bound, lengths, local, coupled, u, v, none, held, gains, inverses, first) < moving:
                break
            bound *= 0.25
        return bound
    while bound < 4.0**_POWERS:
        bound *= 4.0
        if _count(bound, lengths, local, coupled, u, v, none, held, gains, inverses, first) == moving:
            break
    return bound


@njit(cache=True, nogil=True)
def bracket(lengths, local, coupled, u, v, none, held, gains, inverses, first):
    """A number that no eigenvalue is below, close to the lowest."""
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
    return low


@njit(cache=True, nogil=True)
def lowest(low, lengths, local, coupled, u, v, none, held, gains, inverses, first, mode):
    """The lowest eigenvalue by inverse iteration from `low` (`bracket`), and whether it converged; `mode` (n,), filled
    with its mode, of unit length in the metric where it did."""
    _count(low, lengths, local, coupled, u, v, none, held, gains, inverses, first)
    for i in range(held.size):
        mode[i] = 0.0 if held[i] else 1.0 + (i * 0.6180339887498949) % 1.0
    return _iterated(low, lengths, local, coupled, u, v, none, held, gains, inverses, first, mode)


@njit(cache=True, nogil=True)
def nearby(guess, lengths, local, coupled, u, v, none, held, gains, inverses, first, mode):
    """As `lowest`, from a guess of the eigenvalue and of its mode (n,), and whether that is sure: no eigenvalue lies
    clearly below what was found."""
    low = guess - _AROUND * abs(guess)
    if _count(low, lengths, local, coupled, u, v, none, held, gains, inverses, first) > 0:
        return np.nan, False
    found, converged = _iterated(low, lengths, local, coupled, u, v, none, held, gains, inverses, first, mode)
    if not converged:
        return found, False
    below = found - _BELOW * max(abs(found), 1e-3)
    return found, _count(below, lengths, local, coupled, u, v, none, held, gains, inverses, first) == 0


@njit(cache=True, nogil=True)
def _iterated(low, lengths, local, coupled, u, v, none, held, gains, inverses, first, mode):
    """Inverse iteration by the factors at `low` from the `mode` (n,) given."""
    n = held.size
    fields = inverses.shape[1]
    right = np.empty(n)
    turned = np.empty(3)
    found = before = np.nan
    shifts = 0
    for step in range(_STEPS):
        if step > 0 and step % _PATIENT == 0 and shifts < _SHIFTS:
            # another eigenvalue is near: from nearer below the lowest one the two are told apart sooner
            shifts += 1
            nearer = found - _NEARER * (found - low)
            if _count(nearer, lengths, local, coupled, u, v, none, held, gains, inverses, first) == 0:
                low = nearer
            else:
                _count(low, lengths, local, coupled, u, v, none, held, gains, inverses, first)
        riccati.mass_times(lengths, fields, mode, right)
        size = 0.0
        for i in range(n):
            right[i] = 0.0 if held[i] else right[i]
            size += right[i] * mode[i]
        size = np.sqrt(size)
        for i in range(n):
            right[i] /= size
            mode[i] /= size
        if abs(found - before) <= _SAME * max(abs(found), 1e-3):
            return found, True
        before = found
        riccati.solve(lengths, coupled, u, gains, inverses, first, right, mode, turned)
        # at a mode of unit length y = (H - low M)^-1 M mode has the length 1 / (eigenvalue - low)
        product = 0.0
        riccati.mass_times(lengths, fields, mode, right)
        for i in range(n):
            product += 0.0 if held[i] else right[i] * mode[i]
        found = low + 1.0 / np.sqrt(product)
    return found, False
