"""Values of one segment whose twist is free, by power series: frame, chord and its integrals, quaternion (numba).

Symbols and recurrence are those of `ribbon.element.free_series`, without derivatives: the three rows of Q at once.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ribbon.element.series import FMA, MAX_TERMS, MOST_PIECES, TINY


@njit(cache=True)
def _step(q, start, left, limit):
    """Length of the next sub-segment of a segment with parameters q (4 or 6,) from `start`: C stays below `limit`; nan
    where the rest would take more than `MOST_PIECES`."""
    square = (q[1] + q[0] * start) ** 2 + (q[3] + q[2] * start) ** 2
    slope = q[0] * q[0] + q[2] * q[2]
    if q.size == 6:
        square += (q[5] + q[4] * start) ** 2
        slope += q[4] * q[4]
    l0, l1 = math.sqrt(square), math.sqrt(slope)
    exponent = 2.0 * left * (l0 + l1 * left)
    if exponent <= limit:
        return left
    if not exponent <= limit * MOST_PIECES:
        return np.nan
    s = limit / (l0 + math.sqrt(l0 * l0 + 2.0 * l1 * limit))
    if s < left < 1.5 * s:
        s = 0.5 * left
    return s


@njit(cache=True)
def advance(q, done, length, limit):
    """End of the sub-segment that starts at `done`; ends are rounded first (`ribbon.element.series.advance`)."""
    h = _step(q, done, length - done, limit)
    end = done + h
    if end <= done or length - end <= 1e-14 * length:
        return length
    return end


@njit(forceinline=True, fastmath=FMA)
def _row_term(x1, y1, z1, x2, y2, z2, a, b, n, m, c, d):
    """Term k of a row (x, y, z), with the term before it; curvatures over k, in the scaled abscissa."""
    x = m * y1 + n * y2 - d * z1 - c * z2
    y = b * z1 + a * z2 - m * x1 - n * x2
    z = d * x1 + c * x2 - b * y1 - a * y2
    return x, y, z, x1, y1, z1


@njit(forceinline=True)
def _scaled(q, start, h):
    """The curvatures a, b, n, m, c, d of a sub-segment of length h that begins at `start`, in the scaled abscissa."""
    d, c = 0.0, 0.0
    if q.size == 6:
        d, c = (q[5] + q[4] * start) * h, q[4] * h * h
    return q[0] * h * h, (q[1] + q[0] * start) * h, q[2] * h * h, (q[3] + q[2] * start) * h, c, d


@njit(cache=True, fastmath=FMA, error_model="numpy")
def _values(q, start, h, out):
    """Of one sub-segment of length h that begins at `start` of its segment: Q (9 by rows), p, J, T (3 each) in `out`
    (18 or more,). The rows u, v, w of Q at once."""
    a, b, n, m, c, d = _scaled(q, start, h)
    u1, u2, u3, uu1, uu2, uu3 = 1.0, 0.0, 0.0, 0.0, 0.0, 0.0
    v1, v2, v3, vv1, vv2, vv3 = 0.0, 1.0, 0.0, 0.0, 0.0, 0.0
    w1, w2, w3, ww1, ww2, ww3 = 0.0, 0.0, 1.0, 0.0, 0.0, 0.0
    s00, s01, s02, p0, j0, t0 = 1.0, 0.0, 0.0, 0.0, 0.0, 1.0
    s10, s11, s12, p1, j1, t1 = 0.0, 1.0, 0.0, 0.0, 0.0, 0.0
    s20, s21, s22, p2, j2, t2 = 0.0, 0.0, 1.0, 1.0, 0.5, 0.0
    small = 0
    for k in range(1, MAX_TERMS):
        f = 1.0 / k
        f1 = 1.0 / (k + 1)
        f2 = f1 / (k + 2)
        ka, kb, kn, km, kc, kd = f * a, f * b, f * n, f * m, f * c, f * d
        u1, u2, u3, uu1, uu2, uu3 = _row_term(u1, u2, u3, uu1, uu2, uu3, ka, kb, kn, km, kc, kd)
        v1, v2, v3, vv1, vv2, vv3 = _row_term(v1, v2, v3, vv1, vv2, vv3, ka, kb, kn, km, kc, kd)
        w1, w2, w3, ww1, ww2, ww3 = _row_term(w1, w2, w3, ww1, ww2, ww3, ka, kb, kn, km, kc, kd)
        s00, s01, s02 = s00 + u1, s01 + u2, s02 + u3
        s10, s11, s12 = s10 + v1, s11 + v2, s12 + v3
        s20, s21, s22 = s20 + w1, s21 + w2, s22 + w3
        p0, p1, p2 = p0 + f1 * u3, p1 + f1 * v3, p2 + f1 * w3
        j0, j1, j2 = j0 + f2 * u3, j1 + f2 * v3, j2 + f2 * w3
        t0, t1, t2 = t0 + f1 * u1, t1 + f1 * v1, t2 + f1 * w1
        size = abs(u1) + abs(u2) + abs(u3) + abs(v1) + abs(v2) + abs(v3) + abs(w1) + abs(w2) + abs(w3)
        small = small + 1 if size < TINY else 0
        if small == 3:
            break
    out[0], out[1], out[2] = s00, s01, s02
    out[3], out[4], out[5] = s10, s11, s12
    out[6], out[7], out[8] = s20, s21, s22
    out[9], out[10], out[11] = h * p0, h * p1, h * p2
    out[12], out[13], out[14] = h * h * j0, h * h * j1, h * h * j2
    out[15], out[16], out[17] = h * t0, h * t1, h * t2


@njit(cache=True, fastmath=FMA, error_model="numpy")
def _quaternion(q, start, h, out):
    """Of the same sub-segment: its quaternion, in out[18:22]."""
    ha, hb, hn, hm, hc, hd = _scaled(q, start, h)
    w1, i1, j1, k1 = 1.0, 0.0, 0.0, 0.0
    w2 = i2 = j2 = k2 = 0.0
    sw, si, sj, sk = 1.0, 0.0, 0.0, 0.0
    small = 0
    for k in range(1, MAX_TERMS):
        f = 0.5 / k
        w = -f * (hb * i1 + ha * i2 + hd * j1 + hc * j2 + hm * k1 + hn * k2)
        i = f * (hb * w1 + ha * w2 + hm * j1 + hn * j2 - hd * k1 - hc * k2)
        j = f * (hd * w1 + hc * w2 + hb * k1 + ha * k2 - hm * i1 - hn * i2)
        v = f * (hm * w1 + hn * w2 + hd * i1 + hc * i2 - hb * j1 - ha * j2)
        w2, i2, j2, k2, w1, i1, j1, k1 = w1, i1, j1, k1, w, i, j, v
        sw, si, sj, sk = sw + w, si + i, sj + j, sk + v
        small = small + 1 if abs(w) + abs(i) + abs(j) + abs(v) < TINY else 0
        if small == 3:
            break
    out[18], out[19], out[20], out[21] = sw, si, sj, sk


@njit(cache=True)
def _whole(q, length, limit, state, part, turned):
    """`_values` of a whole segment in `state` (22,), walked in sub-segments, and its quaternion where `turned`; `part`
    (22,) is scratch; returns their number."""
    end = advance(q, 0.0, length, limit)
    _values(q, 0.0, end, state)
    if turned:
        _quaternion(q, 0.0, end, state)
    done = end
    count = 1
    while done < length:
        end = advance(q, done, length, limit)
        h = end - done
        _values(q, done, h, part)
        for r in range(3):
            x, y, z = state[3 * r], state[3 * r + 1], state[3 * r + 2]
            state[12 + r] += state[9 + r] * h + x * part[12] + y * part[13] + z * part[14]
            state[9 + r] += x * part[9] + y * part[10] + z * part[11]
            state[15 + r] += x * part[15] + y * part[16] + z * part[17]
            for c in range(3):
                state[3 * r + c] = x * part[c] + y * part[3 + c] + z * part[6 + c]
        if turned:
            _quaternion(q, done, h, part)
            a, b, c, d = state[18], state[19], state[20], state[21]
            e, f, g, i = part[18], part[19], part[20], part[21]
            state[18] = a * e - b * f - c * g - d * i
            state[19] = a * f + b * e + c * i - d * g
            state[20] = a * g + c * e + d * f - b * i
            state[21] = a * i + d * e + b * g - c * f
        done = end
        count += 1
    return count


@njit(cache=True)
def segment_values(q, length, limit, frame, p, j):
    """End frame (3, 3), chord p (3,) and its integral J (3,) of a segment with parameters q (4 or 6,); returns the
    number of sub-segments."""
    state, part = np.empty(18), np.empty(18)
    count = _whole(q, length, limit, state, part, False)
    for r in range(3):
        p[r], j[r] = state[9 + r], state[12 + r]
        for c in range(3):
            frame[r, c] = state[3 * r + c]
    return count


@njit(cache=True)
def body_values(q, length, limit, level, out):
    """Quaternion, u, v, t seen from the end, in `out` (13,) (`ribbon.element.body_series`), of a segment with
    parameters q (4 or 6,); `level` 0: quaternion and u alone, 1: and v, 2: and t. Returns the number of
    sub-segments."""
    state, part = np.empty(22), np.empty(22)
    count = _whole(q, length, limit, state, part, True)
    for k in range(4):
        out[k] = state[18 + k]
    for block in range(level + 1):
        for c in range(3):
            out[4 + 3 * block + c] = (
                state[c] * state[9 + 3 * block]
                + state[3 + c] * state[10 + 3 * block]
                + state[6 + c] * state[11 + 3 * block]
            )
    return count
