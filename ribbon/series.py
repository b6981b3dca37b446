"""Power series of one segment of the curvature element, with first and second derivatives (numba).

On a segment of length L, with local abscissa s in [0, L], normal curvature and ruling are linear
(thesis, section 3.1)::

    omega(s) = a s + b ,   eta(s) = n s + m ,   kappa = (omega, 0, eta omega)

and the frame Q and the chord p, both seen from the start of the segment, solve (thesis, eq. 2.4 and 2.1)::

    Q' = Q [kappa]_x ,  Q(0) = 1 ;      p' = Q e_z ,  p(0) = 0 ;      J' = p ,  J(0) = 0 .

kappa is quadratic in s with coefficients ``lambda_0 = (b, 0, m b)``, ``lambda_1 = (a, 0, n b + m a)``,
``lambda_2 = (0, 0, n a)``, so that (thesis, eq. 3.4)::

    M_0 = 1 ,  M_k = (1/k) sum_{j=0..2} M_{k-1-j} [lambda_j]_x ,  Q = sum M_k s^k .

The recurrence is run in the scaled abscissa t = s/L (``a L^2, b L, n L, m``), where a coefficient is the size of
its own term. Terms obey ``||M_k s^k|| <= exp(C)``, ``C = 2 s sum_k ||lambda_k|| s^k``; a segment is walked in
sub-segments on which C stays below `EXPONENT_LIMIT`, so that no digits are lost by cancellation (thesis, 3.3).

Jets
----
A *jet* holds a quantity and its derivatives by (a, b, n, m), 15 numbers::

    0 value | 1..4 d/da d/db d/dn d/dm | 5..14 aa ab an am bb bn bm nn nm mm

The jets of one segment are an array (15, 15): axis 0 the quantity (9 entries of Q by rows, 3 of p, 3 of J),
axis 1 the jet.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

#: Largest C on a sub-interval. The thesis keeps half the digits, C <= 26 ln 2 = 18.02; terms then reach 2^26. We keep
#: (almost) all of them: results/series.md has the error and the time of either choice.
EXPONENT_LIMIT = 6.0
#: The thesis's own limit (section 3.3), for comparison.
EXPONENT_LIMIT_THESIS = 26.0 * math.log(2.0)

#: Number of quantities in the jets of a segment, and of components in a jet.
QUANTITIES = 15
COMPONENTS = 15
#: Longest series; a sub-segment with C <= 18.02 needs about 60 terms.
MAX_TERMS = 160
_TINY = 1e-18

# Pairs of the second derivatives, in the order of the jet: (a, b, n, m) = (0, 1, 2, 3).
PAIR_FIRST = np.array([0, 0, 0, 0, 1, 1, 1, 2, 2, 3])
PAIR_SECOND = np.array([0, 1, 2, 3, 1, 2, 3, 2, 3, 3])
#: PAIR_INDEX[i, j] is the place of d2/dq_i dq_j in the jet.
PAIR_INDEX = np.zeros((4, 4), dtype=np.int64)
for _k, (_i, _j) in enumerate(zip(PAIR_FIRST, PAIR_SECOND, strict=True)):
    PAIR_INDEX[_i, _j] = PAIR_INDEX[_j, _i] = 5 + _k


@njit(cache=True)
def step_length(a: float, b: float, n: float, m: float, left: float, limit: float) -> float:
    """Length of the next sub-segment: the whole rest `left`, or the root s of C(s) = `limit`.

    ``C(s) = 2 s (|lambda_0| + |lambda_1| s + |lambda_2| s^2)`` (thesis, 3.3). The thesis solves it with s < 1 or s > 1
    bounded roughly; here the root itself is found by Newton's method on the convex cubic, from the right.
    """
    l0 = abs(b) * math.sqrt(1.0 + m * m)
    l1 = math.hypot(a, n * b + m * a)
    l2 = abs(n * a)
    s = left
    if 2.0 * s * (l0 + s * (l1 + s * l2)) <= limit:
        return left
    for _ in range(60):
        f = 2.0 * s * (l0 + s * (l1 + s * l2)) - limit
        d = 2.0 * (l0 + s * (2.0 * l1 + 3.0 * s * l2))
        step = f / d
        s -= step
        if step <= 1e-3 * s:
            break
    # equal shares of what is left would be as good; never leave a sliver behind
    if s < left < 1.5 * s:
        s = 0.5 * left
    return s


@njit(cache=True)
def _advance(a, b, n, m, done, length, limit):
    """End of the sub-segment that starts at `done`; the ends are rounded first and the lengths are their
    differences, so that the lengths add up to the segment's exactly (a slip of 1e-16 each counts at |K| = 1000)."""
    h = step_length(a, b + a * done, n, m + n * done, length - done, limit)
    end = done + h
    if end <= done or length - end <= 1e-14 * length:
        return length
    return end


@njit(cache=True)
def _values(a, b, n, m, length, q, p, j):
    """Q (3, 3), p (3,), J (3,) at the end of one sub-segment of `length`, without derivatives."""
    ha = a * length * length
    hb = b * length
    hn = n * length
    k3_0 = m * hb
    k3_1 = hn * hb + m * ha
    k3_2 = hn * ha
    for row in range(3):
        x0 = x1 = y0 = y1 = z1 = 0.0
        x2 = y2 = 0.0
        x = 1.0 if row == 0 else 0.0
        y = 1.0 if row == 1 else 0.0
        z = 1.0 if row == 2 else 0.0
        sx = x
        sy = y
        sz = z
        sp = z
        sj = 0.5 * z
        small = 0
        for k in range(1, MAX_TERMS):
            x0, y0, z0 = x, y, z
            inv = 1.0 / k
            x = (k3_0 * y0 + k3_1 * y1 + k3_2 * y2) * inv
            y = (hb * z0 + ha * z1 - k3_0 * x0 - k3_1 * x1 - k3_2 * x2) * inv
            z = -(hb * y0 + ha * y1) * inv
            x2, y2 = x1, y1
            x1, y1, z1 = x0, y0, z0
            sx += x
            sy += y
            sz += z
            sp += z / (k + 1)
            sj += z / ((k + 1) * (k + 2))
            if abs(x) + abs(y) + abs(z) < _TINY:
                small += 1
                if small == 3:
                    break
            else:
                small = 0
        q[row, 0] = sx
        q[row, 1] = sy
        q[row, 2] = sz
        p[row] = sp * length
        j[row] = sj * length * length


@njit(cache=True)
def segment_values(a, b, n, m, length, limit, q, p, j):
    """End frame Q (3, 3), chord p (3,) and its integral J (3,) of a segment, walked in sub-segments.

    Parameters are those of the module; `limit` bounds C on every sub-segment. Returns the number of sub-segments.
    """
    tq = np.empty((3, 3))
    tp = np.empty(3)
    tj = np.empty(3)
    h = step_length(a, b, n, m, length, limit)
    _values(a, b, n, m, h, q, p, j)
    done = h
    count = 1
    new = np.empty((3, 3))
    while done < length:
        end = _advance(a, b, n, m, done, length, limit)
        h = end - done
        _values(a, b + a * done, n, m + n * done, h, tq, tp, tj)
        for r in range(3):
            j[r] += p[r] * h + q[r, 0] * tj[0] + q[r, 1] * tj[1] + q[r, 2] * tj[2]
            p[r] += q[r, 0] * tp[0] + q[r, 1] * tp[1] + q[r, 2] * tp[2]
            for c in range(3):
                new[r, c] = q[r, 0] * tq[0, c] + q[r, 1] * tq[1, c] + q[r, 2] * tq[2, c]
        q[:, :] = new
        done = end
        count += 1
    return count


@njit(cache=True)
def _scale(factor, source, out, times):
    """out += times * d(factor * source): the jet of a product with a number `factor` that has no derivative."""
    for c in range(COMPONENTS):
        out[c] += times * factor * source[c]


@njit(cache=True)
def _first(d, i, source, out):
    """Adds to `out` what the first derivative `d` of the factor by parameter `i` brings (product rule)."""
    out[1 + i] += d * source[0]
    # d2/dq_i dq_j gains d * source_j; the pure second derivative gains twice
    if i == 0:
        out[5] += 2.0 * d * source[1]
        out[6] += d * source[2]
        out[7] += d * source[3]
        out[8] += d * source[4]
    elif i == 1:
        out[6] += d * source[1]
        out[9] += 2.0 * d * source[2]
        out[10] += d * source[3]
        out[11] += d * source[4]
    elif i == 2:
        out[7] += d * source[1]
        out[10] += d * source[2]
        out[12] += 2.0 * d * source[3]
        out[13] += d * source[4]
    else:
        out[8] += d * source[1]
        out[11] += d * source[2]
        out[13] += d * source[3]
        out[14] += 2.0 * d * source[4]


@njit(cache=True)
def _times_k3_0(s, b, m, jet, out):
    """out += s * (m b) * jet, with derivatives."""
    _scale(m * b, jet, out, s)
    _first(s * m, 1, jet, out)
    _first(s * b, 3, jet, out)
    out[11] += s * jet[0]


@njit(cache=True)
def _times_k3_1(s, a, b, n, m, jet, out):
    """out += s * (n b + m a) * jet, with derivatives."""
    _scale(n * b + m * a, jet, out, s)
    _first(s * m, 0, jet, out)
    _first(s * n, 1, jet, out)
    _first(s * b, 2, jet, out)
    _first(s * a, 3, jet, out)
    out[10] += s * jet[0]
    out[8] += s * jet[0]


@njit(cache=True)
def _times_k3_2(s, a, n, jet, out):
    """out += s * (n a) * jet, with derivatives."""
    _scale(n * a, jet, out, s)
    _first(s * n, 0, jet, out)
    _first(s * a, 2, jet, out)
    out[7] += s * jet[0]


@njit(cache=True)
def _times_parameter(s, value, i, jet, out):
    """out += s * q_i * jet, with derivatives (q_i = `value` is a parameter itself)."""
    _scale(value, jet, out, s)
    _first(s, i, jet, out)


@njit(cache=True)
def _jets(a, b, n, m, length, jets, work):
    """Jets (15, 15) of one sub-segment of `length`; `work` is scratch of shape (4, 3, 15)."""
    ha = a * length * length
    hb = b * length
    hn = n * length
    jets[:, :] = 0.0
    for row in range(3):
        work[:, :, :] = 0.0
        newest = 0
        work[0, row, 0] = 1.0
        for c in range(3):
            jets[3 * row + c, 0] = work[0, c, 0]
        jets[9 + row, 0] = work[0, 2, 0]
        jets[12 + row, 0] = 0.5 * work[0, 2, 0]
        small = 0
        for k in range(1, MAX_TERMS):
            w0 = work[newest]
            w1 = work[(newest + 3) % 4]
            w2 = work[(newest + 2) % 4]
            newest = (newest + 1) % 4
            out = work[newest]
            out[:, :] = 0.0
            # x' = k3 y ;  y' = k1 z - k3 x ;  z' = -k1 y
            _times_k3_0(1.0, hb, m, w0[1], out[0])
            _times_parameter(1.0, hb, 1, w0[2], out[1])
            _times_k3_0(-1.0, hb, m, w0[0], out[1])
            _times_parameter(-1.0, hb, 1, w0[1], out[2])
            if k >= 2:
                _times_k3_1(1.0, ha, hb, hn, m, w1[1], out[0])
                _times_parameter(1.0, ha, 0, w1[2], out[1])
                _times_k3_1(-1.0, ha, hb, hn, m, w1[0], out[1])
                _times_parameter(-1.0, ha, 0, w1[1], out[2])
            if k >= 3:
                _times_k3_2(1.0, ha, hn, w2[1], out[0])
                _times_k3_2(-1.0, ha, hn, w2[0], out[1])
            inv = 1.0 / k
            largest = 0.0
            f1 = 1.0 / (k + 1)
            f2 = f1 / (k + 2)
            for q in range(3):
                for c in range(COMPONENTS):
                    t = out[q, c] * inv
                    out[q, c] = t
                    jets[3 * row + q, c] += t
                    largest = max(largest, abs(t))
            for c in range(COMPONENTS):
                jets[9 + row, c] += f1 * out[2, c]
                jets[12 + row, c] += f2 * out[2, c]
            if largest < _TINY:
                small += 1
                if small == 3:
                    break
            else:
                small = 0
    # back from scaled parameters: d/da = L^2 d/d(a L^2), d/db = L d/d(bL), d/dn = L d/d(nL), d/dm unchanged
    f = (length * length, length, length, 1.0)
    for q in range(QUANTITIES):
        unit = 1.0
        if q >= 12:
            unit = length * length
        elif q >= 9:
            unit = length
        jets[q, 0] *= unit
        for i in range(4):
            jets[q, 1 + i] *= unit * f[i]
        for k in range(10):
            jets[q, 5 + k] *= unit * f[PAIR_FIRST[k]] * f[PAIR_SECOND[k]]


@njit(cache=True)
def _shift(jets, done):
    """Jets of a sub-segment that starts at `done`, by the parameters of its segment, in place.

    The sub-segment's own parameters are (a, b + a done, n, m + n done), so that d/da gains done d/db and
    d/dn gains done d/dm.
    """
    d = done
    for q in range(QUANTITIES):
        t = jets[q]
        aa = t[5] + 2.0 * d * t[6] + d * d * t[9]
        ab = t[6] + d * t[9]
        an = t[7] + d * (t[8] + t[10]) + d * d * t[11]
        am = t[8] + d * t[11]
        bn = t[10] + d * t[11]
        nn = t[12] + 2.0 * d * t[13] + d * d * t[14]
        nm = t[13] + d * t[14]
        t[1] += d * t[2]
        t[3] += d * t[4]
        t[5] = aa
        t[6] = ab
        t[7] = an
        t[8] = am
        t[10] = bn
        t[12] = nn
        t[13] = nm


@njit(cache=True)
def _product(x, y, out):
    """out += jet of the product of two jets."""
    x0 = x[0]
    y0 = y[0]
    for c in range(COMPONENTS):
        out[c] += x0 * y[c]
    for c in range(1, COMPONENTS):
        out[c] += y0 * x[c]
    k = 5
    for i in range(1, 5):
        for j in range(i, 5):
            out[k] += x[i] * y[j] + x[j] * y[i]
            k += 1


@njit(cache=True)
def segment_jets(a, b, n, m, length, limit, jets):
    """Jets (15, 15) of the end frame, chord and chord integral of a segment (layout: see the module).

    `limit` bounds C on every sub-segment. Returns the number of sub-segments.
    """
    work = np.empty((4, 3, COMPONENTS))
    h = step_length(a, b, n, m, length, limit)
    _jets(a, b, n, m, h, jets, work)
    if h >= length:
        return 1
    done = h
    count = 1
    part = np.empty((QUANTITIES, COMPONENTS))
    new = np.empty((QUANTITIES, COMPONENTS))
    while done < length:
        end = _advance(a, b, n, m, done, length, limit)
        h = end - done
        _jets(a, b + a * done, n, m + n * done, h, part, work)
        _shift(part, done)
        new[:, :] = 0.0
        for r in range(3):
            for k in range(3):
                left = jets[3 * r + k]
                for c in range(3):
                    _product(left, part[3 * k + c], new[3 * r + c])
                _product(left, part[9 + k], new[9 + r])
                _product(left, part[12 + k], new[12 + r])
            for c in range(COMPONENTS):
                new[9 + r, c] += jets[9 + r, c]
                new[12 + r, c] += jets[12 + r, c] + h * jets[9 + r, c]
        jets[:, :] = new
        done = end
        count += 1
    return count
