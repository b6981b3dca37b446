"""Neighbouring chained problems, one kernel for a line of them: each begins where those before it lead (numba).

The problems differ in Gamma and in a constant natural curvature, by little from one to the next. The unknowns of a case
are extrapolated from at most `_BEFORE` cases before it (Lagrange's polynomial at equal steps), brought to rest by
`ribbon.solvers.chained_newton.descend`, and judged by the factors at their last derivatives (`ribbon.solvers.eigen`).
A case that Newton steps of a positive Hessian do not bring to rest, whose rulings come onto their bounds or whose
lowest eigenvalue is not clearly positive is not taken: the kernel returns.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ribbon.element.kinematics import segment_values
from ribbon.energies.codes import has_free_twist
from ribbon.problems import chained_kernels as kernels
from ribbon.problems.arguments import Loads, Material
from ribbon.solvers import chained_newton, eigen
from ribbon.solvers.chained_newton import BARRIER, ENDED, ENERGY, ITERATIONS, RESIDUAL, SADDLE, SHIFT, VALUES

#: Places of the numbers of a case: lowest eigenvalue, residual over its scale, Newton's steps, bending, natural and
#: weight's energy (D w / l), position of end and middle (l), int (r - r(0)) ds (l^2), largest abs(eta).
LOWEST, REST, STEPS, BENDING, NATURAL, WEIGHT, END, MIDDLE, MOMENT, STEEPEST = 0, 1, 2, 3, 4, 5, 6, 9, 12, 15
NUMBERS = 16

#: Cases that are extrapolated from; most Newton steps of a case.
_BEFORE, _MOST = 5, 5
#: Share of a bound's range from which it counts as near: where the energy is finite on it, and where it is not.
_NEAR, _NEAR_STEEP = 0.02, 1e-6
#: Residual below which Newton's own step is tried on an indefinite Hessian: never, as such a case is not taken.
_NEVER = 0.0
#: Eigenvalue below which the largest one is asked for, and part of that which is rounding, as in
#: `ribbon.judge.stability`.
_SMALL, _INDIFFERENT = 1e-4, 1e-11
_nearby: Any = eigen.nearby
_from_bracket: Any = eigen.lowest


class Line(NamedTuple):
    """What the cases of a line have of their own: gamma (k,), curvature K l (k,), scale (k,) of their residuals."""

    gamma: NDArray[np.float64]
    curvature: NDArray[np.float64]
    scale: NDArray[np.float64]


@njit(cache=True)
def _extrapolated(x, first, i, y):
    """Fills y (n,) with case i by the polynomial through the cases before it, from `first` on."""
    many = min(i - first, _BEFORE)
    y[:] = 0.0
    weight = 1.0
    for j in range(1, many + 1):
        weight *= (many - j + 1) / j  # binomial coefficients with alternating signs
        sign = 1.0 if j % 2 == 1 else -1.0
        for a in range(y.size):
            y[a] += sign * weight * x[i - j, a]


@njit(cache=True)
def _material(curvature, material):
    """The material with this natural curvature (1/l)."""
    pieces = np.zeros(material.curvature.shape)
    pieces[:, 0] = curvature
    return Material(material.code, material.section, curvature != 0.0, pieces, material.poisson, material.rest)


@njit(cache=True)
def _begun(x, q, lengths, material, loads, bounds, state, parts):
    """The `state` of a descent at x (n,). Without a barrier where the energy itself keeps off the bounds: a case
    extrapolated onto one has no energy, and is not taken."""
    state[:] = 0.0
    state[BARRIER] = -1.0
    if bounds.reach < 1.0:
        state[BARRIER], state[SADDLE], state[VALUES] = 0.0, _NEVER, 1.0
        inside = True
        for i in range(x.size):
            inside = inside and bounds.lower[i] <= x[i] <= bounds.upper[i]
        state[ENERGY] = chained_newton.energy(x, q, lengths, material, loads, parts) if inside else np.nan


@njit(cache=True)
def _at_rest(x, state, bounds, tolerance):
    """Whether steps of a positive Hessian, hardly one of them shortened, came to rest off all bounds."""
    plain = state[SHIFT] == 0.0 and state[VALUES] <= state[ITERATIONS] + 2.0 and state[BARRIER] == 0.0
    if not (plain and state[ENDED] == chained_newton.CONVERGED and state[RESIDUAL] <= tolerance):
        return False
    near = _NEAR_STEEP if bounds.reach < 1.0 else _NEAR
    for i in range(x.size):
        low, high = bounds.lower[i], bounds.upper[i]
        if low < high and np.isfinite(high) and min(x[i] - low, high - x[i]) < near * (high - low):
            return False
    return True


@njit(cache=True)
def _turns(q, lengths):
    """The largest turn (rad) of the tangent in a segment with parameters q (p, 4)."""
    found = 0.0
    for i in range(lengths.size):
        found = max(found, abs(2.0 * q[i, 1] + q[i, 0] * lengths[i]) * 0.5 * lengths[i])
    return found


@njit(cache=True)
def _lowest(guess, given, mode):
    """The lowest eigenvalue, and whether it is clearly positive; `mode` (n,): of the case before, then its own."""
    found, sure = _nearby(guess, *given, mode)
    if not sure:
        low = eigen.bracket(*given)
        found, sure = _from_bracket(low, *given, mode)
    if not sure or not found > 0.0:
        return found, False
    return found, found > _SMALL or found > _INDIFFERENT * eigen.largest(*given)


@njit(cache=True)
def measured(q, lengths, material, loads, position, numbers):
    """Fills the numbers of a case that its shape alone says, at the parameters q (p, 4); position (3,): of the clamp,
    in l."""
    p = lengths.size
    free = has_free_twist(material.code)
    parts, moment = np.empty(3), np.empty(3)
    points, frames = np.empty((p + 1, 3)), np.empty((p + 1, 3, 3))
    weightless = Loads(0.0, loads.up, loads.force, loads.pulled, loads.frame, loads.limit)
    kernels.energy_parts(q, lengths, material, weightless, position, parts)
    kernels.walk(free, q, lengths, np.zeros(3), loads.frame, loads.limit, points, frames, moment)
    numbers[BENDING], numbers[NATURAL], numbers[WEIGHT] = parts[0], parts[1], 0.0
    behind = 0.0
    middle = 0
    while middle < p - 1 and behind + lengths[middle] <= 0.5:
        behind += lengths[middle]
        middle += 1
    f, chord, j = np.empty((3, 3)), np.zeros(3), np.empty(3)
    if 0.5 - behind > 0.0:
        segment_values(free, q[middle], 0.5 - behind, loads.limit, f, chord, j)
    for r in range(3):
        numbers[WEIGHT] += loads.gamma * loads.up[r] * (moment[r] + position[r])
        numbers[END + r] = position[r] + points[p, r]
        numbers[MIDDLE + r] = position[r] + points[middle, r]
        numbers[MOMENT + r] = moment[r]
        for c in range(3):
            numbers[MIDDLE + r] += frames[middle, r, c] * chord[c]
    steepest = abs(q[p - 1, 2] * lengths[p - 1] + q[p - 1, 3])
    for i in range(p):
        steepest = max(steepest, abs(q[i, 3]))
    numbers[STEEPEST] = steepest


@njit(cache=True, nogil=True)
def follow(x, begin, first, mode, line, lengths, material, loads, bounds, exact, turned, position, numbers):
    """Brings the cases from `begin` on to rest, each from those before it; returns how far it came: the number of the
    first case that is not taken, or k.

    x (k, n): unknowns, those of the cases `first` to begin - 1 known; mode (n,): of case begin - 1, numbers (k,
    NUMBERS): its lowest eigenvalue known. lengths, material, loads, bounds: as of `chained_newton.descend`, of any
    case, with rulings and weight; exact (2,): tolerances of the residual over the scale of a case; turned: turn of a
    segment (rad) up to which a case is taken; position (3,): of the clamp, in l.
    """
    n, p = x.shape[1], lengths.size
    fields = 2
    own = (np.empty((p, 15)), np.zeros((p, 4, 3)), np.zeros((p, 4, 3)))
    y, gradient, below, above = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    state, none, q, parts = np.empty(chained_newton.STATE), np.zeros(n), np.empty((p, 4)), np.empty(3)
    held = bounds.lower == bounds.upper
    most = np.int64(_MOST)  # no constant: `descend` would be compiled once more for it
    work = np.empty((p, fields, fields + 3)), np.empty((p, fields, fields)), np.empty((fields, fields))
    for i in range(begin, x.shape[0]):
        stuff = _material(line.curvature[i], material)
        load = Loads(line.gamma[i], loads.up, loads.force, loads.pulled, loads.frame, loads.limit)
        tolerances = (exact[0] * line.scale[i], exact[1] * line.scale[i])
        _extrapolated(x, first, i, y)
        below[:] = above[:] = 0.0
        _begun(y, q, lengths, stuff, load, bounds, state, parts)
        chained_newton.descend(y, lengths, stuff, load, bounds, tolerances, most, state, gradient, below, above, own)
        if not _at_rest(y, state, bounds, tolerances[0]):
            return i
        kernels.unpack(y, lengths, q)
        if not _turns(q, lengths) <= turned:
            return i
        given = (lengths, own[0], True, own[1], own[2], none, held, work[0], work[1], work[2])
        lowest, plain = _lowest(numbers[i - 1, LOWEST], given, mode)
        if not plain:
            return i
        x[i] = y
        largest = 0.0
        for a in range(n):
            if not held[a]:
                largest = max(largest, abs(gradient[a]))
        numbers[i, LOWEST], numbers[i, REST] = lowest, largest / line.scale[i]
        numbers[i, STEPS] = state[ITERATIONS]
        measured(q, lengths, stuff, load, position, numbers[i])
    return x.shape[0]
