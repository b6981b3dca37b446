"""Power series of one segment whose twist is free, with first and second derivatives (numba).

With local abscissa s in [0, L] all curvatures are linear, which is the super-clothoid's element (thesis, 4.4)::

    kappa_1 = a s + b ,   kappa_3 = n s + m ,   kappa_2 = c s + d   (the latter with six parameters only, else 0)

and frame, chord and integrals of the chord obey the equations of `ribbon.element.series`, whose symbols, lanes and jets
are meant here. A row (x, y, z) of Q has ``Q' = Q [kappa]_x``::

    x' = kappa_3 y - kappa_2 z ,   y' = kappa_1 z - kappa_3 x ,   z' = kappa_2 x - kappa_1 y ,

so that term k follows from the terms k-1 (parameters b, m, d) and k-2 (a, n, c), all over k. ``C = 2 s (|lambda_0| +
|lambda_1| s)``, lambda_0 = (b, d, m), lambda_1 = (a, c, n), bounds a sub-segment (docs/theory.md, eq. (3.6)).

Jets by (a, b, n, m) have 15 components, by (a, b, n, m, c, d) 28: value, first derivatives, second derivatives of the
pairs in order. Units: a, n, c 1/length^2; b, m, d 1/length.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ribbon.element import twist_series
from ribbon.element.free_values import advance
from ribbon.element.series import FMA, LANES, MAX_TERMS, STATES, TINY

#: Terms at least: of a straight strip all values are zero, and the second derivative by slopes first in term 4.
_LEAST = 4
#: Components of a jet by four and by six parameters.
COMPONENTS = (15, 28)
# axis (0, 1, 2) of the curvature that a parameter belongs to, and whether it multiplies s; order a, b, n, m, c, d
_AXIS = np.array([0, 0, 2, 2, 1, 1])
_SLOPE = np.array([1, 0, 1, 0, 1, 0])


@njit(cache=True)
def parameter_count(components):
    """Parameters of jets with 15 or 28 components."""
    return 4 if components == 15 else 6


@njit(forceinline=True)
def _turn(new, axis, to, source, at, f):
    """new[:, to] += f source[:, at] x-ed with the axis, in all lanes."""
    if axis == 0:
        for l in range(LANES):
            new[1, to, l] += f[l] * source[2, at, l]
            new[2, to, l] -= f[l] * source[1, at, l]
    elif axis == 1:
        for l in range(LANES):
            new[2, to, l] += f[l] * source[0, at, l]
            new[0, to, l] -= f[l] * source[2, at, l]
    else:
        for l in range(LANES):
            new[0, to, l] += f[l] * source[1, at, l]
            new[1, to, l] -= f[l] * source[0, at, l]


@njit(cache=True, fastmath=FMA)
def _term(new, one, two, lam, count, k):
    """Term k of the jets in all lanes, in `new` (3, components, lanes), from the terms k-1 `one` and k-2 `two`.

    lam (6, lanes): a, b, n, m, c, d in the scaled abscissa; count: parameters.
    """
    f = 1.0 / k
    components = new.shape[1]
    for i in range(components):
        for l in range(LANES):
            x1, y1, z1 = one[0, i, l], one[1, i, l], one[2, i, l]
            x2, y2, z2 = two[0, i, l], two[1, i, l], two[2, i, l]
            a, b, n, m = lam[0, l], lam[1, l], lam[2, l], lam[3, l]
            new[0, i, l] = f * (m * y1 + n * y2)
            new[1, i, l] = f * (b * z1 + a * z2 - m * x1 - n * x2)
            new[2, i, l] = -f * (b * y1 + a * y2)
    if count == 6:
        for i in range(components):
            for l in range(LANES):
                c, d = lam[4, l], lam[5, l]
                new[0, i, l] -= f * (d * one[2, i, l] + c * two[2, i, l])
                new[2, i, l] += f * (d * one[0, i, l] + c * two[0, i, l])
    unit = np.empty(LANES)
    unit[:] = f
    at = 1 + count
    for p in range(count):
        source_p = two if _SLOPE[p] == 1 else one
        _turn(new, _AXIS[p], 1 + p, source_p, 0, unit)
        for q in range(p, count):
            source_q = two if _SLOPE[q] == 1 else one
            _turn(new, _AXIS[p], at, source_p, 1 + q, unit)
            _turn(new, _AXIS[q], at, source_q, 1 + p, unit)
            at += 1


@njit(cache=True, fastmath=FMA)
def _series(lam, first, count, work, sums):
    """Sums of the series of four lanes: rows first, first + 1, ... of the group's sub-segments.

    lam (6, lanes); work (3, 3, components, lanes): terms, taken in turn; sums (6, components, lanes): x, y, z, integral
    of z, of that of z, and of x.
    """
    work[:] = 0.0
    sums[:] = 0.0
    for l in range(LANES):
        row = (first + l) % 3
        work[0, row, 0, l] = 1.0
        sums[row, 0, l] = 1.0
        if row == 2:
            sums[3, 0, l], sums[4, 0, l] = 1.0, 0.5
        if row == 0:
            sums[5, 0, l] = 1.0
    components = work.shape[2]
    small = 0
    for k in range(1, MAX_TERMS):
        new, one, two = work[k % 3], work[(k + 2) % 3], work[(k + 1) % 3]
        _term(new, one, two, lam, count, k)
        f1 = 1.0 / (k + 1)
        f2 = f1 / (k + 2)
        for i in range(components):
            for l in range(LANES):
                x, z = new[0, i, l], new[2, i, l]
                sums[0, i, l] += x
                sums[1, i, l] += new[1, i, l]
                sums[2, i, l] += z
                sums[3, i, l] += f1 * z
                sums[4, i, l] += f2 * z
                sums[5, i, l] += f1 * x
        size = 0.0
        for l in range(LANES):
            size = max(size, abs(new[0, 0, l]) + abs(new[1, 0, l]) + abs(new[2, 0, l]))
        small = small + 1 if size * k * k < 10.0 * TINY else 0
        if small >= 3 and k >= _LEAST:
            break


@njit(cache=True)
def _shift(jets, d, count):
    """Jets of a sub-segment that starts at d, by the parameters of its segment, in place: an own b of a sub-segment is
    b + a d, so that d/da gains d times d/db, and so on for every curvature."""
    for i in range(jets.shape[0]):
        t = jets[i]
        at = 1 + count
        # second derivatives: T^T H T with T = 1 + d (slope <- value); by rows p <= q, larger entries first read
        for p in range(count):
            for q in range(p, count):
                add = 0.0
                if p % 2 == 0:
                    add += d * t[_pair(count, p + 1, q)]
                if q % 2 == 0:
                    add += d * t[_pair(count, p, q + 1)]
                    if p % 2 == 0:
                        add += d * d * t[_pair(count, p + 1, q + 1)]
                t[at] += add
                at += 1
        for p in range(0, count, 2):
            t[1 + p] += d * t[2 + p]


@njit(cache=True)
def _pair(count, i, j):
    """Place in the jet of the second derivative by the parameters i and j."""
    if i > j:
        i, j = j, i
    return 1 + count + i * count - i * (i - 1) // 2 + j - i


@njit(cache=True, fastmath=FMA)
def product(x, y, out):
    """out += jet of the product of two jets of any number of parameters."""
    components = x.size
    count = parameter_count(components)
    out[0] += x[0] * y[0]
    for c in range(1, components):
        out[c] += x[0] * y[c] + y[0] * x[c]
    at = 1 + count
    for i in range(1, 1 + count):
        for j in range(i, 1 + count):
            out[at] += x[i] * y[j] + x[j] * y[i]
            at += 1


@njit(cache=True)
def _append(state, part, h, new):
    """Appends a sub-segment `part` of length h to the walked `state`, both (18, components); `new` is scratch."""
    size, components = state.shape
    new[:] = 0.0
    for r in range(3):
        for column in range(size // 3):
            to = 3 * r + column if column < 3 else 3 * column + r
            for k in range(3):
                at = 3 * k + column if column < 3 else 3 * column + k
                product(state[3 * r + k], part[at], new[to])
    for r in range(size - 1, -1, -1):
        for c in range(components):
            old = state[r, c] if r >= 9 else 0.0
            if 12 <= r < 15:
                old += h * state[r - 3, c]
            state[r, c] = old + new[r, c]


@njit(cache=True)
def _unload(sums, l, row, h, factors, part):
    """Writes the lane l, which is `row` of its sub-segment of length h, to the jets `part` (rows, components)."""
    for c in range(part.shape[1]):
        f = factors[c]
        part[3 * row, c] = f * sums[0, c, l]
        part[3 * row + 1, c] = f * sums[1, c, l]
        part[3 * row + 2, c] = f * sums[2, c, l]
        part[9 + row, c] = f * h * sums[3, c, l]
        if part.shape[0] > 12:
            part[12 + row, c] = f * h * h * sums[4, c, l]
        if part.shape[0] > 15:
            part[15 + row, c] = f * h * sums[5, c, l]


@njit(cache=True)
def _factors(h, count, out):
    """d/da = h^2 d/d(a h^2), d/db = h d/d(b h), and so on, for all components."""
    out[0] = 1.0
    at = 1 + count
    for p in range(count):
        fp = h * h if _SLOPE[p] == 1 else h
        out[1 + p] = fp
        for q in range(p, count):
            out[at] = fp * (h * h if _SLOPE[q] == 1 else h)
            at += 1


@njit(cache=True)
def walk(q, lengths, limit, states):
    """Jets `states` (p, 12, 15 or 18, components) at the ends of segments with q (p, 4 or 6) and lengths (p,).

    Rows: `ribbon.element.series.STATES`. Returns the number of sub-segments.
    """
    p, size, components = states.shape
    count = q.shape[1]
    level = (size - STATES[0]) // 3
    unrolled = count == 4
    w = np.empty(twist_series.WORK)
    lam = np.zeros((6, LANES))
    work = np.empty((3, 3, components, LANES))
    sums = np.empty((6, components, LANES))
    factors = np.empty(components)
    owner = np.empty(LANES, dtype=np.int64)
    group = np.empty((LANES, 2))  # start, length of the sub-segments of the group
    parts = np.empty((LANES + 1, size, components))
    total = 0
    i = 0
    done = 0.0
    while i < p:
        jobs = 0
        while jobs < LANES and i < p:
            end = advance(q[i], done, lengths[i], limit)
            group[jobs, 0], group[jobs, 1] = done, end - done
            owner[jobs] = i
            jobs += 1
            done = end
            if not done < lengths[i]:  # also if it is not a number
                i += 1
                done = 0.0
        total += jobs
        for first in range(0, 3 * jobs, LANES):
            for l in range(LANES):
                job = min((first + l) // 3, jobs - 1)
                s, h = group[job, 0], group[job, 1]
                own = q[owner[job]]
                for k in range(0, count, 2):
                    lam[k, l], lam[k + 1, l] = own[k] * h * h, (own[k + 1] + own[k] * s) * h
            if unrolled:
                for k in range(4):
                    for l in range(LANES):
                        w[twist_series.PARAMETERS + k * LANES + l] = lam[k, l]
                twist_series.series(w, first, level)
            else:
                _series(lam, first, count, work, sums)
            for l in range(min(LANES, 3 * jobs - first)):
                j, row = (first + l) // 3, (first + l) % 3
                _factors(group[j, 1], count, factors)
                part = states[owner[j]] if group[j, 0] == 0.0 else parts[j]
                if unrolled:
                    twist_series.unload(w, l, group[j, 1], row, level, factors, part)
                else:
                    _unload(sums, l, row, group[j, 1], factors, part)
        for j in range(jobs):
            if group[j, 0] > 0.0:
                _shift(parts[j], group[j, 0], count)
                _append(states[owner[j]], parts[j], group[j, 1], parts[LANES])
    return total


#: Rows of the jets of `walk`, as in `ribbon.element.series`.
ROWS = STATES
