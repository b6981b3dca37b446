"""Power series of jets of segments with a curvature and a free twist, unrolled (numba).

The recurrence of `ribbon.element.free_series` for four parameters, kappa_1 = a s + b and kappa_3 = n s + m, without
kappa_2::

    x_k = (m y_(k-1) + n y_(k-2)) / k ,   z_k = -(b y_(k-1) + a y_(k-2)) / k ,
    y_k = (b z_(k-1) + a z_(k-2) - m x_(k-1) - n x_(k-2)) / k

(docs/theory.md, eq. (1.1), (3.3)), with derivatives by the product rule, component by component, as
`ribbon.element.series` has it for rulings: four rows of Q fill the lanes. Pure second derivatives are halved here.
"""

from __future__ import annotations

from numba import njit

from ribbon.element.series import FMA, LANES, LEAST_PAIR, MAX_TERMS, TINY_PAIR

#: Components of a jet.
COMPONENTS = 15

# Workspace: x, y, z of the even and of the odd term, sums of x, y, z, integrals of z, of that of z, and of x; then the
# lanes' a, b, n, m, in the scaled abscissa.
_BLOCK = 16 * LANES
_Y, _Z, _ODD = _BLOCK, 2 * _BLOCK, 3 * _BLOCK
#: Places of the sums, and of the lanes' parameters, in the workspace, and its size.
SUMS = 6 * _BLOCK
PARAMETERS = 12 * _BLOCK
WORK = PARAMETERS + 4 * LANES


@njit(forceinline=True, fastmath=FMA)
def _component(w, new, old, i, a, b, n, m, fx, fy, fz):
    """One component of term k, at place i: the recurrence, with what the parameters' derivatives add (f...)."""
    x1, y1, z1 = w[old + i], w[old + _Y + i], w[old + _Z + i]
    x2, y2, z2 = w[new + i], w[new + _Y + i], w[new + _Z + i]
    w[new + i] = m * y1 + n * y2 + fx
    w[new + _Y + i] = b * z1 + a * z2 - m * x1 - n * x2 + fy
    w[new + _Z + i] = fz - b * y1 - a * y2


@njit(forceinline=True)
def _head(w, i):
    """Value and first derivatives at place i."""
    return w[i], w[i + LANES], w[i + 2 * LANES], w[i + 3 * LANES], w[i + 4 * LANES]


@njit(forceinline=True, fastmath=FMA, error_model="numpy")
def _term(w, new, old, k):
    """Term k of (x, y, z) in all lanes, from term k-1 at `old` and term k-2 at `new`, in the latter's place.

    By parameters: a and n go with the terms k-2 (xx, yy, zz), b and m with the terms k-1 (x, y, z).
    """
    f = 1.0 / k
    for l in range(LANES):
        a, b = w[PARAMETERS + l] * f, w[PARAMETERS + LANES + l] * f
        n, m = w[PARAMETERS + 2 * LANES + l] * f, w[PARAMETERS + 3 * LANES + l] * f
        x, xa, xb, xn, xm = _head(w, old + l)
        y, ya, yb, yn, ym = _head(w, old + _Y + l)
        z, za, zb, zn, zm = _head(w, old + _Z + l)
        xx, xxa, xxb, xxn, xxm = _head(w, new + l)
        yy, yya, yyb, yyn, yym = _head(w, new + _Y + l)
        zz, zza, zzb, zzn, zzm = _head(w, new + _Z + l)
        _component(w, new, old, l, a, b, n, m, 0.0, 0.0, 0.0)
        _component(w, new, old, l + LANES, a, b, n, m, 0.0, f * zz, -f * yy)
        _component(w, new, old, l + 2 * LANES, a, b, n, m, 0.0, f * z, -f * y)
        _component(w, new, old, l + 3 * LANES, a, b, n, m, f * yy, -f * xx, 0.0)
        _component(w, new, old, l + 4 * LANES, a, b, n, m, f * y, -f * x, 0.0)
        _component(w, new, old, l + 5 * LANES, a, b, n, m, 0.0, f * zza, -f * yya)
        _component(w, new, old, l + 6 * LANES, a, b, n, m, 0.0, f * (zzb + za), -f * (yyb + ya))
        _component(w, new, old, l + 7 * LANES, a, b, n, m, f * yya, f * (zzn - xxa), -f * yyn)
        _component(w, new, old, l + 8 * LANES, a, b, n, m, f * ya, f * (zzm - xa), -f * yym)
        _component(w, new, old, l + 9 * LANES, a, b, n, m, 0.0, f * zb, -f * yb)
        _component(w, new, old, l + 10 * LANES, a, b, n, m, f * yyb, f * (zn - xxb), -f * yn)
        _component(w, new, old, l + 11 * LANES, a, b, n, m, f * yb, f * (zm - xb), -f * ym)
        _component(w, new, old, l + 12 * LANES, a, b, n, m, f * yyn, -f * xxn, 0.0)
        _component(w, new, old, l + 13 * LANES, a, b, n, m, f * (yym + yn), -f * (xxm + xn), 0.0)
        _component(w, new, old, l + 14 * LANES, a, b, n, m, f * ym, -f * xm, 0.0)


@njit(forceinline=True, fastmath={"contract", "reassoc"})
def _square(w):
    """Sum of squares of the jets of x, y, z in the even term."""
    s = 0.0
    for i in range(3 * _BLOCK):
        s += w[i] * w[i]
    return s


@njit(cache=True, fastmath=FMA, error_model="numpy")
def series(w, first, level):
    """Sums of the series of jets in all lanes: lane l is row (first + l) % 3 of Q; the parameters are in w (WORK,)
    already. level: 0 for Q and p, 1 for J too, 2 for T too (`ribbon.element.series.STATES`)."""
    for i in range(PARAMETERS):
        w[i] = 0.0
    for l in range(LANES):
        r = (first + l) % 3
        w[r * _BLOCK + l] = 1.0
        w[SUMS + r * _BLOCK + l] = 1.0
        if r == 2:
            w[SUMS + 3 * _BLOCK + l] = 1.0
            w[SUMS + 4 * _BLOCK + l] = 0.5
        elif r == 0:
            w[SUMS + 5 * _BLOCK + l] = 1.0
    for k in range(1, MAX_TERMS, 2):
        _term(w, _ODD, 0, k)
        _term(w, 0, _ODD, k + 1)
        for i in range(3 * _BLOCK):
            w[SUMS + i] += w[_ODD + i] + w[i]
        f = 1.0 / (k + 1)
        g = 1.0 / (k + 2)
        ff = f * g
        gg = g / (k + 3)
        for i in range(_BLOCK):
            w[SUMS + 3 * _BLOCK + i] += f * w[_ODD + _Z + i] + g * w[_Z + i]
        if level >= 1:
            for i in range(_BLOCK):
                w[SUMS + 4 * _BLOCK + i] += ff * w[_ODD + _Z + i] + gg * w[_Z + i]
        if level >= 2:
            for i in range(_BLOCK):
                w[SUMS + 5 * _BLOCK + i] += f * w[_ODD + i] + g * w[i]
        if k >= LEAST_PAIR and _square(w) < TINY_PAIR * TINY_PAIR:
            break


@njit(cache=True)
def unload(w, l, h, row, level, factors, part):
    """Copies lane l, row `row` of a sub-segment of length h, to the jets `part` (12, 15 or 18, 15), by unscaled
    parameters: factors (15,) are those of `ribbon.element.free_series`."""
    for c in range(COMPONENTS):
        f = factors[c]
        if c == 5 or c == 9 or c == 12 or c == 14:
            f *= 2.0
        i = SUMS + c * LANES + l
        part[3 * row, c] = f * w[i]
        part[3 * row + 1, c] = f * w[i + _BLOCK]
        part[3 * row + 2, c] = f * w[i + 2 * _BLOCK]
        part[9 + row, c] = f * h * w[i + 3 * _BLOCK]
        if level >= 1:
            part[12 + row, c] = f * h * h * w[i + 4 * _BLOCK]
        if level >= 2:
            part[15 + row, c] = f * h * w[i + 5 * _BLOCK]
