"""Power series of one segment of the curvature element, with first and second derivatives (numba).

On a segment of length L, with local abscissa s in [0, L], normal curvature and ruling are linear (thesis, section 3.1;
docs/theory.md, eq. (3.1), (1.3))::

    omega(s) = a s + b ,   eta(s) = n s + m ,   kappa = (omega, 0, eta omega)

and the frame Q and the chord p, both seen from the start of the segment, solve (thesis, eq. 2.4 and 2.1;
docs/theory.md, eq. (1.1), (3.2))::

    Q' = Q [kappa]_x ,  Q(0) = 1 ;      p' = Q e_z ,  p(0) = 0 ;      J' = p ,  J(0) = 0 .

kappa is quadratic in s with coefficients ``lambda_0 = (b, 0, m b)``, ``lambda_1 = (a, 0, n b + m a)``,
``lambda_2 = (0, 0, n a)``, so that (thesis, eq. 3.4; docs/theory.md, eq. (3.3), (3.4))::

    M_0 = 1 ,  M_k = (1/k) sum_{j=0..2} M_{k-1-j} [lambda_j]_x ,  Q = sum M_k s^k .

The recurrence is run in the scaled abscissa t = s/L (``a L^2, b L, n L, m``), where a coefficient is the size of its
own term. Terms obey ``||M_k s^k|| <= exp(C)``, ``C = 2 s sum_k ||lambda_k|| s^k``; a segment is walked in sub-segments
on which C stays below `EXPONENT_LIMIT`, so that no digits are lost by cancellation (thesis, 3.3; docs/theory.md,
eq. (3.6)), and whose ends compose (docs/theory.md, eq. (3.7)).

A row (x, y, z) of Q has ``x' = eta omega y``, ``y' = omega g``, ``z' = -omega y`` with ``g = z - eta x``, thus
``x' = -eta z'``. Only products with one linear factor are left, and nothing but old terms on the right (docs/theory.md,
eq. (3.5))::

    z_k = -(b y_{k-1} + a y_{k-2}) / k          x_k = -(m z_k + n z_{k-1} (k-1)/k)
    y_k =  (b g_{k-1} + a g_{k-2}) / k          g_k = z_k - m x_k - n x_{k-1}

Derivatives by (a, b, n, m) follow by the product rule. The three rows, and the rows of other segments, obey the same
recurrence: four rows fill the lanes of the processor's vector registers.

Jets
----
A *jet* holds a quantity and its derivatives by (a, b, n, m), 15 numbers::

    0 value | 1..4 d/da d/db d/dn d/dm | 5..14 aa ab an am bb bn bm nn nm mm

The jets of one segment are an array (15, 15): axis 0 the quantity (9 entries of Q by rows, 3 of p, 3 of J),
axis 1 the jet. Units: a 1/length^2, b and n 1/length, m 1; Q 1, p length, J length^2.
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
#: Most sub-segments of a segment, so that a call ends: what would need more (or is not finite) is nan everywhere.
MOST_PIECES = 100_000
#: Turn of a strip (rad) beyond which a trial point has no value: ten times what a strip may be asked to have at rest.
FURTHEST = 1e5
#: Longest series; a sub-segment with C <= 18.02 needs about 60 terms.
MAX_TERMS = 160
#: A series of values ends with three terms below this, one of jets with a pair of terms (y, g) below `TINY_PAIR`: each
#: term behind is smaller at least by a factor of about 10.
TINY = 1e-18
TINY_PAIR = 1e-15
#: First term of the last pair at the least: in term 4 begins the second derivative by slopes of a straight strip, whose
#: values are all zero.
LEAST_PAIR = 7
#: Multiplication and addition may be fused; no other liberty is taken with the arithmetic.
FMA = {"contract"}
#: Rows of the jets of `walk` by what is asked for: 9 entries of Q and 3 of p; and 3 of J; and 3 of T = int Q e_x ds.
STATES = (12, 15, 18)

#: Series that are summed side by side.
LANES = 4
# Workspace of a series of jets. A block is a jet of 15 components (and one of padding) in all lanes: x, y, z, g of the
# even and of the odd term, sums of x, y, z, integrals of z, of that of z, and of x; then the lanes' a, b, n, m.
_BLOCK = 16 * LANES
_Y = _BLOCK
_Z = 2 * _BLOCK
_G = 3 * _BLOCK
_ODD = 4 * _BLOCK
_SUMS = 8 * _BLOCK
_INTEGRALS = 11 * _BLOCK
_PARAMETERS = 14 * _BLOCK
_FACTORS = _PARAMETERS + 4 * LANES
_WORK = _FACTORS + COMPONENTS

# Pairs of the second derivatives, in the order of the jet: (a, b, n, m) = (0, 1, 2, 3).
PAIR_FIRST = np.array([0, 0, 0, 0, 1, 1, 1, 2, 2, 3])
PAIR_SECOND = np.array([0, 1, 2, 3, 1, 2, 3, 2, 3, 3])
#: PAIR_INDEX[i, j] is the place of d2/dq_i dq_j in the jet.
PAIR_INDEX = np.zeros((4, 4), dtype=np.int64)
for _k, (_i, _j) in enumerate(zip(PAIR_FIRST, PAIR_SECOND, strict=True)):
    PAIR_INDEX[_i, _j] = PAIR_INDEX[_j, _i] = 5 + _k


@njit(cache=True)
def step_length(a: float, b: float, n: float, m: float, left: float, limit: float) -> float:
    """Length of the next sub-segment: the whole rest `left`, or the root s of C(s) = `limit`; nan where the rest would
    take more than `MOST_PIECES`.

    ``C(s) = 2 s (|lambda_0| + |lambda_1| s + |lambda_2| s^2)`` (thesis, 3.3). The thesis solves it with s < 1 or s > 1
    bounded roughly; here the root itself is found by Newton's method on the convex cubic, from the right.
    """
    l0 = abs(b) * math.sqrt(1.0 + m * m)
    l1 = math.hypot(a, n * b + m * a)
    l2 = abs(n * a)
    s = left
    exponent = 2.0 * s * (l0 + s * (l1 + s * l2))
    if exponent <= limit:
        return left
    if not exponent <= limit * MOST_PIECES:
        return np.nan
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
def advance(a, b, n, m, done, length, limit):
    """End of the sub-segment that starts at `done`; the ends are rounded first and the lengths are their
    differences, so that the lengths add up to the segment's exactly (a slip of 1e-16 each counts at |K| = 1000)."""
    h = step_length(a, b + a * done, n, m + n * done, length - done, limit)
    end = done + h
    if end <= done or length - end <= 1e-14 * length:
        return length
    return end


@njit(forceinline=True, fastmath=FMA)
def next_term(x, y, z, yy, g, gg, a, b, e, n, m):
    """Term k of (x, y, z), y of term k-1, g of terms k and k-1, from those of the term before.

    a and b are over k, e is n (k-1)/k, all in the scaled abscissa.
    """
    new_z = -b * y - a * yy
    new_x = -m * new_z - e * z
    return new_x, b * g + a * gg, new_z, y, new_z - m * new_x - n * x, g


@njit(cache=True, fastmath=FMA, error_model="numpy")
def _values(a, b, n, m, length, q, p, j):
    """Q (3, 3), p (3,), J (3,) at the end of one sub-segment of `length`, without derivatives.

    The recurrence of the module for the rows u, v, w of Q at once.
    """
    ha = a * length * length
    hb = b * length
    hn = n * length
    ux, uy, uz, uyy, ug, ugg = 1.0, 0.0, 0.0, 0.0, -m, 0.0
    vx, vy, vz, vyy, vg, vgg = 0.0, 1.0, 0.0, 0.0, 0.0, 0.0
    wx, wy, wz, wyy, wg, wgg = 0.0, 0.0, 1.0, 0.0, 1.0, 0.0
    s00, s01, s02, p0, j0 = 1.0, 0.0, 0.0, 0.0, 0.0
    s10, s11, s12, p1, j1 = 0.0, 1.0, 0.0, 0.0, 0.0
    s20, s21, s22, p2, j2 = 0.0, 0.0, 1.0, 1.0, 0.5
    small = 0
    for k in range(1, MAX_TERMS):
        inv = 1.0 / k
        f1 = 1.0 / (k + 1)
        f2 = f1 / (k + 2)
        kb = hb * inv
        ka = ha * inv
        kn = hn * (k - 1) * inv
        ux, uy, uz, uyy, ug, ugg = next_term(ux, uy, uz, uyy, ug, ugg, ka, kb, kn, hn, m)
        vx, vy, vz, vyy, vg, vgg = next_term(vx, vy, vz, vyy, vg, vgg, ka, kb, kn, hn, m)
        wx, wy, wz, wyy, wg, wgg = next_term(wx, wy, wz, wyy, wg, wgg, ka, kb, kn, hn, m)
        s00, s01, s02 = s00 + ux, s01 + uy, s02 + uz
        s10, s11, s12 = s10 + vx, s11 + vy, s12 + vz
        s20, s21, s22 = s20 + wx, s21 + wy, s22 + wz
        p0, p1, p2 = p0 + f1 * uz, p1 + f1 * vz, p2 + f1 * wz
        j0, j1, j2 = j0 + f2 * uz, j1 + f2 * vz, j2 + f2 * wz
        size = abs(ux) + abs(uy) + abs(uz) + abs(vx) + abs(vy) + abs(vz) + abs(wx) + abs(wy) + abs(wz)
        small = small + 1 if size < TINY else 0
        if small == 3:
            break
    q[0, 0], q[0, 1], q[0, 2] = s00, s01, s02
    q[1, 0], q[1, 1], q[1, 2] = s10, s11, s12
    q[2, 0], q[2, 1], q[2, 2] = s20, s21, s22
    p[0], p[1], p[2] = p0 * length, p1 * length, p2 * length
    square = length * length
    j[0], j[1], j[2] = j0 * square, j1 * square, j2 * square


@njit(cache=True)
def segment_values(a, b, n, m, length, limit, q, p, j):
    """End frame Q (3, 3), chord p (3,) and its integral J (3,) of a segment, walked in sub-segments.

    Parameters are those of the module; `limit` bounds C on every sub-segment. Returns the number of sub-segments.
    """
    h = step_length(a, b, n, m, length, limit)
    _values(a, b, n, m, h, q, p, j)
    if h >= length:
        return 1
    tq = np.empty((3, 3))
    tp = np.empty(3)
    tj = np.empty(3)
    done = h
    count = 1
    while done < length:
        end = advance(a, b, n, m, done, length, limit)
        h = end - done
        _values(a, b + a * done, n, m + n * done, h, tq, tp, tj)
        for r in range(3):
            x, y, z = q[r, 0], q[r, 1], q[r, 2]
            j[r] += p[r] * h + x * tj[0] + y * tj[1] + z * tj[2]
            p[r] += x * tp[0] + y * tp[1] + z * tp[2]
            for c in range(3):
                q[r, c] = x * tq[0, c] + y * tq[1, c] + z * tq[2, c]
        done = end
        count += 1
    return count


@njit(forceinline=True, fastmath=FMA)
def _component(w, new, old, i, a, b, m, n, e, fz, fx, fy, fg):
    """One component of term k, at place i: the recurrence, with what the parameters' derivatives add (f...)."""
    z = -b * w[old + _Y + i] - a * w[new + _Y + i] - fz
    x = -m * z - e * w[old + _Z + i] - fx
    y = b * w[old + _G + i] + a * w[new + _G + i] + fy
    g = z - m * x - n * w[old + i] - fg
    w[new + i] = x
    w[new + _Y + i] = y
    w[new + _Z + i] = z
    w[new + _G + i] = g
    return z, x


@njit(forceinline=True)
def _head(w, i):
    """Value and first derivatives at place i."""
    return w[i], w[i + LANES], w[i + 2 * LANES], w[i + 3 * LANES], w[i + 4 * LANES]


@njit(forceinline=True, fastmath=FMA, error_model="numpy")
def _term(w, new, old, k):
    """Term k of (x, y, z, g) in all lanes, from term k-1 at `old` and term k-2 at `new`, in the latter's place.

    The product rule, by parameters: omega's are a, with the terms k-2 (yy, gg), and b, with the terms k-1 (y, g);
    eta's are n, with the older term (zz, xx), and m, with the newer one (z, x).
    """
    f = 1.0 / k
    d = (k - 1) * f
    for l in range(LANES):
        a = w[_PARAMETERS + l] * f
        b = w[_PARAMETERS + LANES + l] * f
        n = w[_PARAMETERS + 2 * LANES + l]
        m = w[_PARAMETERS + 3 * LANES + l]
        e = n * d
        y, ya, yb, yn, ym = _head(w, old + _Y + l)
        g, ga, gb, gn, gm = _head(w, old + _G + l)
        yy, yya, yyb, yyn, yym = _head(w, new + _Y + l)
        gg, gga, ggb, ggn, ggm = _head(w, new + _G + l)
        zz, zza, zzb, zzn, zzm = _head(w, old + _Z + l)
        xx, xxa, xxb, xxn, xxm = _head(w, old + l)
        z, x = _component(w, new, old, l, a, b, m, n, e, 0.0, 0.0, 0.0, 0.0)
        za, xa = _component(w, new, old, l + LANES, a, b, m, n, e, f * yy, 0.0, f * gg, 0.0)
        zb, xb = _component(w, new, old, l + 2 * LANES, a, b, m, n, e, f * y, 0.0, f * g, 0.0)
        zn, xn = _component(w, new, old, l + 3 * LANES, a, b, m, n, e, 0.0, d * zz, 0.0, xx)
        zm, xm = _component(w, new, old, l + 4 * LANES, a, b, m, n, e, 0.0, z, 0.0, x)
        _component(w, new, old, l + 5 * LANES, a, b, m, n, e, f * yya, 0.0, f * gga, 0.0)
        _component(w, new, old, l + 6 * LANES, a, b, m, n, e, f * (yyb + ya), 0.0, f * (ggb + ga), 0.0)
        _component(w, new, old, l + 7 * LANES, a, b, m, n, e, f * yyn, d * zza, f * ggn, xxa)
        _component(w, new, old, l + 8 * LANES, a, b, m, n, e, f * yym, za, f * ggm, xa)
        _component(w, new, old, l + 9 * LANES, a, b, m, n, e, f * yb, 0.0, f * gb, 0.0)
        _component(w, new, old, l + 10 * LANES, a, b, m, n, e, f * yn, d * zzb, f * gn, xxb)
        _component(w, new, old, l + 11 * LANES, a, b, m, n, e, f * ym, zb, f * gm, xb)
        _component(w, new, old, l + 12 * LANES, a, b, m, n, e, 0.0, d * zzn, 0.0, xxn)
        _component(w, new, old, l + 13 * LANES, a, b, m, n, e, 0.0, d * zzm + zn, 0.0, xxm + xn)
        _component(w, new, old, l + 14 * LANES, a, b, m, n, e, 0.0, zm, 0.0, xm)


@njit(forceinline=True, fastmath={"contract", "reassoc"})
def _square(w):
    """Sum of squares of the jets of y and g in the even term."""
    s = 0.0
    for i in range(_BLOCK):
        y = w[_Y + i]
        g = w[_G + i]
        s += y * y + g * g
    return s


@njit(cache=True, fastmath=FMA, error_model="numpy")
def _series(w, first, level):
    """Sums of the series of jets in all lanes: lane l is row (first + l) % 3 of Q; the parameters are in w already.

    level: 0 for Q and p, 1 for J too, 2 for T too.
    """
    for i in range(_PARAMETERS):
        w[i] = 0.0
    for l in range(LANES):
        r = (first + l) % 3
        w[r * _BLOCK + l] = 1.0
        w[_SUMS + r * _BLOCK + l] = 1.0
        if r == 2:
            w[_G + l] = 1.0
            w[_INTEGRALS + l] = 1.0
            w[_INTEGRALS + _BLOCK + l] = 0.5
        elif r == 0:
            w[_G + l] = -w[_PARAMETERS + 3 * LANES + l]
            w[_G + 4 * LANES + l] = -1.0
            w[_INTEGRALS + 2 * _BLOCK + l] = 1.0
    for k in range(1, MAX_TERMS, 2):
        _term(w, _ODD, 0, k)
        _term(w, 0, _ODD, k + 1)
        for i in range(3 * _BLOCK):
            w[_SUMS + i] += w[_ODD + i] + w[i]
        f = 1.0 / (k + 1)
        g = 1.0 / (k + 2)
        ff = f * g
        gg = g / (k + 3)
        if level == 0:
            for i in range(_BLOCK):
                w[_INTEGRALS + i] += f * w[_ODD + _Z + i] + g * w[_Z + i]
        else:
            for i in range(_BLOCK):
                w[_INTEGRALS + i] += f * w[_ODD + _Z + i] + g * w[_Z + i]
                w[_INTEGRALS + _BLOCK + i] += ff * w[_ODD + _Z + i] + gg * w[_Z + i]
        if level >= 2:
            for i in range(_BLOCK):
                w[_INTEGRALS + 2 * _BLOCK + i] += f * w[_ODD + i] + g * w[i]
        if k >= LEAST_PAIR and _square(w) < TINY_PAIR * TINY_PAIR:
            break


@njit(cache=True)
def _unload(w, l, h, row, level, part):
    """Copies lane l, row `row` of a sub-segment of length h, to the state `part`, by unscaled parameters."""
    h2 = h * h
    h3 = h2 * h
    # d/da = h^2 d/d(a h^2), d/db = h d/d(bh), d/dn = h d/d(nh), d/dm unchanged; the series' pure seconds are halves
    w[_FACTORS], w[_FACTORS + 1], w[_FACTORS + 2], w[_FACTORS + 3], w[_FACTORS + 4] = 1.0, h2, h, h, 1.0
    w[_FACTORS + 5], w[_FACTORS + 6], w[_FACTORS + 7], w[_FACTORS + 8] = 2.0 * h2 * h2, h3, h3, h2
    w[_FACTORS + 9], w[_FACTORS + 10], w[_FACTORS + 11] = 2.0 * h2, h2, h
    w[_FACTORS + 12], w[_FACTORS + 13], w[_FACTORS + 14] = 2.0 * h2, h, 2.0
    for c in range(COMPONENTS):
        f = w[_FACTORS + c]
        i = _SUMS + c * LANES + l
        part[3 * row, c] = f * w[i]
        part[3 * row + 1, c] = f * w[i + _BLOCK]
        part[3 * row + 2, c] = f * w[i + 2 * _BLOCK]
        part[9 + row, c] = f * h * w[i + 3 * _BLOCK]
        if level >= 1:
            part[12 + row, c] = f * h2 * w[i + 4 * _BLOCK]
        if level >= 2:
            part[15 + row, c] = f * h * w[i + 5 * _BLOCK]


@njit(cache=True)
def _shift(jets, d):
    """Jets of a sub-segment that starts at d, by the parameters of its segment, in place.

    The sub-segment's own parameters are (a, b + a d, n, m + n d), so that d/da gains d times d/db, d/dn d times d/dm.
    """
    for q in range(jets.shape[0]):
        t = jets[q]
        t[1] += d * t[2]
        t[3] += d * t[4]
        # an entry is moved before those it takes from
        t[5] += 2.0 * d * t[6] + d * d * t[9]
        t[6] += d * t[9]
        t[7] += d * (t[8] + t[10]) + d * d * t[11]
        t[8] += d * t[11]
        t[10] += d * t[11]
        t[12] += 2.0 * d * t[13] + d * d * t[14]
        t[13] += d * t[14]


@njit(cache=True, fastmath=FMA)
def product(x, y, out):
    """out += jet of the product of two jets."""
    x0, xa, xb, xn, xm = x[0], x[1], x[2], x[3], x[4]
    y0, ya, yb, yn, ym = y[0], y[1], y[2], y[3], y[4]
    out[0] += x0 * y0
    for c in range(1, COMPONENTS):
        out[c] += x0 * y[c] + y0 * x[c]
    out[5] += 2.0 * xa * ya
    out[6] += xa * yb + xb * ya
    out[7] += xa * yn + xn * ya
    out[8] += xa * ym + xm * ya
    out[9] += 2.0 * xb * yb
    out[10] += xb * yn + xn * yb
    out[11] += xb * ym + xm * yb
    out[12] += 2.0 * xn * yn
    out[13] += xn * ym + xm * yn
    out[14] += 2.0 * xm * ym


@njit(cache=True)
def _append(state, part, h, new):
    """Appends a sub-segment `part` of length h to the walked `state`, both (12, 15 or 18, 15); `new` is scratch."""
    size = state.shape[0]
    for r in range(size):
        for c in range(COMPONENTS):
            new[r, c] = 0.0
    # columns 0, 1, 2 of Q, then p (and J, T), with Q from the left (3 not as a constant: unrolled, this compiles for
    # seconds)
    for r in range(state.shape[1] // 5):
        for column in range(size // 3):
            to = 3 * r + column if column < 3 else 3 * column + r
            for k in range(3):
                at = 3 * k + column if column < 3 else 3 * column + k
                product(state[3 * r + k], part[at], new[to])
    # p = p1 + Q1 p2, J = J1 + h p1 + Q1 J2, T = T1 + Q1 T2
    for r in range(size - 1, -1, -1):
        for c in range(COMPONENTS):
            old = state[r, c] if r >= 9 else 0.0
            if 12 <= r < 15:
                old += h * state[r - 3, c]
            state[r, c] = old + new[r, c]


@njit(cache=True)
def walk(q, lengths, limit, states):
    """Jets `states` at the ends of segments with parameters q (p, 4) and lengths (p,).

    `states` is (p, 15, 15), rows as in the module, or (p, 12, 15): without J, which weight alone needs and which is
    then not computed, or (p, 18, 15): with ``T = int Q e_x ds`` behind them (`STATES`). Sub-segments of all segments
    are taken in groups and their rows fill the lanes. Returns the number of sub-segments.
    """
    p, size = states.shape[:2]
    level = (size - STATES[0]) // 3
    w = np.empty(_WORK)
    owner = np.empty(LANES, dtype=np.int64)
    # a h^2, b h, n h, m at the start, start, length h of the sub-segments of the group
    group = np.empty((LANES, 6))
    parts = np.empty((LANES + 1, size, COMPONENTS))
    count = 0
    i = 0
    done = 0.0
    while i < p:
        jobs = 0
        while jobs < LANES and i < p:
            a, b, n, m = q[i, 0], q[i, 1], q[i, 2], q[i, 3]
            end = advance(a, b, n, m, done, lengths[i], limit)
            h = end - done
            job = group[jobs]
            job[0], job[1], job[2], job[3] = a * h * h, (b + a * done) * h, n * h, m + n * done
            job[4], job[5] = done, h
            owner[jobs] = i
            jobs += 1
            done = end
            if not done < lengths[i]:  # also if it is not a number
                i += 1
                done = 0.0
        count += jobs
        for first in range(0, 3 * jobs, LANES):
            for l in range(LANES):
                job = group[min((first + l) // 3, jobs - 1)]
                for k in range(4):
                    w[_PARAMETERS + k * LANES + l] = job[k]
            _series(w, first, level)
            for l in range(min(LANES, 3 * jobs - first)):
                j = (first + l) // 3
                part = states[owner[j]] if group[j, 4] == 0.0 else parts[j]
                _unload(w, l, group[j, 5], (first + l) % 3, level, part)
        for j in range(jobs):
            if group[j, 4] > 0.0:
                _shift(parts[j], group[j, 4])
                _append(states[owner[j]], parts[j], group[j, 5], parts[LANES])
    return count


@njit(cache=True)
def segment_jets(a, b, n, m, length, limit, jets):
    """Jets (15, 15), C-contiguous, of end frame, chord and chord integral of a segment (layout: see the module).

    `limit` bounds C on every sub-segment. Returns the number of sub-segments.
    """
    q = np.empty((1, 4))
    q[0, 0], q[0, 1], q[0, 2], q[0, 3] = a, b, n, m
    lengths = np.empty(1)
    lengths[0] = length
    return walk(q, lengths, limit, jets.reshape(1, QUANTITIES, COMPONENTS))


@njit(cache=True)
def segment_jets_many(q, lengths, limit, jets):
    """Jets (p, 15, 15), or (p, 12, 15) without J, of segments with q (p, 4), lengths (p,); returns `walk`'s count."""
    return walk(q, lengths, limit, jets)
