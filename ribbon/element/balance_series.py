"""Power series of the vertical and of the weight's moment in a segment's frame, with first derivatives (numba).

Let e be the unit vector up, ``M = 1 - s`` the length behind s and ``W = int_s^1 (r(t) - r(s)) dt`` its first moment. In
the frame, ``g = R^T e`` and ``m = R^T (W x e)``. Balance of moments (Kirchhoff's equation without the elastic part;
docs/theory.md, eq. (4.12)) is::

    g' = g x kappa ,     m' = m x kappa - M e_z x g ,     kappa = (omega, 0, eta omega) .

What turns the strip at s by ``R dkappa ds`` lifts what is behind: ``d int <r, e> ds = int <dkappa, m> ds``. The
gradient by a segment's parameters is thus a few moments ``int s^k m ds``, and the second derivatives are those of m's
first ones: of six quantities 5 numbers are needed where jets of the frame, the chord and its integral have 15 of
fifteen (`ribbon.element.series`). omega and eta are linear, and as there only products with one linear factor are left.
With ``G = g_z - eta g_x`` and ``H = m_z - eta m_x``, in the scaled abscissa, ``mu = M L`` linear too::

    g_z' = -omega g_y ,  g_x' = -eta g_z' ,             g_y' = omega G ,
    m_z' = -omega m_y ,  m_x' = -eta m_z' + mu g_y ,    m_y' = omega H - mu g_x .

m is over the square of the length behind the start, so that its size is about 1 up to the free end. Derivatives are
taken with g and m held at the start of the segment; who calls moves m there (`ribbon.element.weight`).

Sub-segments fill the lanes of the processor's vector registers, or the three rows of their frames do (`frames`).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ribbon.element.series import FMA, LEAST_PAIR, MAX_TERMS, TINY_PAIR

#: Sub-segments side by side: twice as many as in `ribbon.element.series`, where each fills more registers (half of the
#: time of four).
LANES = 8
#: Numbers of a row of the frame: x, y, z at the end, and the moments ``int t^k x dt`` for k = 0, 1, ``int t^k z dt``
#: for k = 0, 1, 2, t from 0 to 1.
ROW = 8
#: Numbers of a jet: the value and its derivatives by a, b, n, m (scaled).
_JET = 5
#: Places of g and m in a term, one block each; G and H behind them.
_BLOCK = _JET * LANES
_GY, _GZ, _MX, _MY, _MZ, _G, _H = (k * _BLOCK for k in range(1, 8))
_TERM = 8 * _BLOCK
#: Two terms; sums of g and m; moments of m_x (2) and m_z (3); a, b, n, m of the lanes and mu = mu_0 - mu_1 t.
_ODD = _TERM
_SUMS = 2 * _TERM
_MOMENTS = _SUMS + 6 * _BLOCK
_PARAMETERS = _MOMENTS + 5 * _BLOCK
_WORK = _PARAMETERS + 6 * LANES
#: Numbers of a sub-segment's result: g and m at its end, then the moments, jets all.
RESULT = 11 * _JET

# The rows of frames, three for each sub-segment: two terms of x, y, z, g; sums; moments; parameters.
_ROWS = 3 * LANES
_ROW_TERM = 4 * _ROWS
_ROW_SUMS = 2 * _ROW_TERM
_ROW_PARAMETERS = _ROW_SUMS + ROW * _ROWS
_ROW_WORK = _ROW_PARAMETERS + 4 * _ROWS


@njit(forceinline=True, fastmath=FMA, error_model="numpy")
def _row_term(w, new, old, k):
    """Term k of rows of Q in all lanes (`ribbon.element.series`), from k-1 at `old` and k-2 at `new`, in its place."""
    f = 1.0 / k
    d = (k - 1) * f
    for l in range(_ROWS):
        a = w[_ROW_PARAMETERS + l] * f
        b = w[_ROW_PARAMETERS + _ROWS + l] * f
        n = w[_ROW_PARAMETERS + 2 * _ROWS + l]
        m = w[_ROW_PARAMETERS + 3 * _ROWS + l]
        z = -b * w[old + _ROWS + l] - a * w[new + _ROWS + l]
        x = -m * z - n * d * w[old + 2 * _ROWS + l]
        y = b * w[old + 3 * _ROWS + l] + a * w[new + 3 * _ROWS + l]
        g = z - m * x - n * w[old + l]
        w[new + l] = x
        w[new + _ROWS + l] = y
        w[new + 2 * _ROWS + l] = z
        w[new + 3 * _ROWS + l] = g


@njit(forceinline=True, fastmath={"contract", "reassoc"})
def _row_square(w):
    """Sum of squares of y and g in the even term."""
    s = 0.0
    for i in range(_ROWS):
        s += w[_ROWS + i] * w[_ROWS + i] + w[3 * _ROWS + i] * w[3 * _ROWS + i]
    return s


@njit(cache=True, fastmath=FMA, error_model="numpy")
def _row_series(w):
    """Sums of the series of rows in all lanes: lane l is row l // LANES; the parameters are in w already."""
    for i in range(_ROW_PARAMETERS):
        w[i] = 0.0
    for l in range(_ROWS):
        r = l // LANES
        w[r * _ROWS + l] = 1.0
        w[_ROW_SUMS + r * _ROWS + l] = 1.0
        if r == 0:
            w[3 * _ROWS + l] = -w[_ROW_PARAMETERS + 3 * _ROWS + l]
            w[_ROW_SUMS + 3 * _ROWS + l] = 1.0
            w[_ROW_SUMS + 4 * _ROWS + l] = 0.5
        elif r == 2:
            w[3 * _ROWS + l] = 1.0
            for k in range(3):
                w[_ROW_SUMS + (5 + k) * _ROWS + l] = 1.0 / (k + 1)
    for k in range(1, MAX_TERMS, 2):
        _row_term(w, _ROW_TERM, 0, k)
        _row_term(w, 0, _ROW_TERM, k + 1)
        f1, f2, f3, f4 = 1.0 / (k + 1), 1.0 / (k + 2), 1.0 / (k + 3), 1.0 / (k + 4)
        for i in range(3 * _ROWS):
            w[_ROW_SUMS + i] += w[_ROW_TERM + i] + w[i]
        for l in range(_ROWS):
            x, xx = w[_ROW_TERM + l], w[l]
            z, zz = w[_ROW_TERM + 2 * _ROWS + l], w[2 * _ROWS + l]
            w[_ROW_SUMS + 3 * _ROWS + l] += f1 * x + f2 * xx
            w[_ROW_SUMS + 4 * _ROWS + l] += f2 * x + f3 * xx
            w[_ROW_SUMS + 5 * _ROWS + l] += f1 * z + f2 * zz
            w[_ROW_SUMS + 6 * _ROWS + l] += f2 * z + f3 * zz
            w[_ROW_SUMS + 7 * _ROWS + l] += f3 * z + f4 * zz
        if k >= LEAST_PAIR and _row_square(w) < TINY_PAIR * TINY_PAIR:
            break


@njit(cache=True)
def frames(pieces, rows):
    """Fills rows (k, 3, ROW): of the frame at the end of each sub-segment, seen from its start.

    pieces (k, 4 or more): the scaled ``a h^2, b h, n h, m`` of each, by its length h.
    """
    w = np.empty(_ROW_WORK)
    count = pieces.shape[0]
    for first in range(0, count, LANES):
        for l in range(_ROWS):
            piece = pieces[min(first + l % LANES, count - 1)]
            for k in range(4):
                w[_ROW_PARAMETERS + k * _ROWS + l] = piece[k]
        _row_series(w)
        for l in range(min(LANES, count - first)):
            for r in range(3):
                row = rows[first + l, r]
                for k in range(ROW):
                    row[k] = w[_ROW_SUMS + k * _ROWS + r * LANES + l]


@njit(forceinline=True, fastmath=FMA)
def _component(w, new, old, i, a, b, m, n, e, own, past, fgz, fgx, fgy, fg, fmz, fmx, fmy, fm):
    """One component of term k, at place i; a, b, own (mu_0), past (mu_1) are over k, e is n (k-1)/k; what the
    derivatives by the parameters add is in f..."""
    z = -b * w[old + _GY + i] - a * w[new + _GY + i] - fgz
    x = -m * z - e * w[old + _GZ + i] - fgx
    y = b * w[old + _G + i] + a * w[new + _G + i] + fgy
    mz = -b * w[old + _MY + i] - a * w[new + _MY + i] - fmz
    mx = -m * mz - e * w[old + _MZ + i] + own * w[old + _GY + i] - past * w[new + _GY + i] - fmx
    my = b * w[old + _H + i] + a * w[new + _H + i] - own * w[old + i] + past * w[new + i] + fmy
    g = z - m * x - n * w[old + i] - fg
    h = mz - m * mx - n * w[old + _MX + i] - fm
    w[new + i], w[new + _GY + i], w[new + _GZ + i], w[new + _G + i] = x, y, z, g
    w[new + _MX + i], w[new + _MY + i], w[new + _MZ + i], w[new + _H + i] = mx, my, mz, h
    return z, x, mz, mx


@njit(forceinline=True, fastmath=FMA, error_model="numpy")
def _term(w, new, old, k):
    """Term k in all lanes, from term k-1 at `old` and term k-2 at `new`, in the latter's place."""
    f = 1.0 / k
    d = (k - 1) * f
    for l in range(LANES):
        a = w[_PARAMETERS + l] * f
        b = w[_PARAMETERS + LANES + l] * f
        n = w[_PARAMETERS + 2 * LANES + l]
        m = w[_PARAMETERS + 3 * LANES + l]
        own = w[_PARAMETERS + 4 * LANES + l] * f
        past = w[_PARAMETERS + 5 * LANES + l] * f
        e = n * d
        # terms k-2 go with a, those of k-1 with b; the older x and z with n, the newer with m
        gyy, ggg, myy, hhh = f * w[new + _GY + l], f * w[new + _G + l], f * w[new + _MY + l], f * w[new + _H + l]
        gy, gg, my, hh = f * w[old + _GY + l], f * w[old + _G + l], f * w[old + _MY + l], f * w[old + _H + l]
        xx, zz, mxx, mzz = w[old + l], d * w[old + _GZ + l], w[old + _MX + l], d * w[old + _MZ + l]
        z, x, mz, mx = _component(
            w, new, old, l, a, b, m, n, e, own, past, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        )  # fmt: skip
        _component(
            w, new, old, l + LANES, a, b, m, n, e, own, past, gyy, 0.0, ggg, 0.0, myy, 0.0, hhh, 0.0
        )  # fmt: skip
        _component(
            w, new, old, l + 2 * LANES, a, b, m, n, e, own, past, gy, 0.0, gg, 0.0, my, 0.0, hh, 0.0
        )  # fmt: skip
        _component(
            w, new, old, l + 3 * LANES, a, b, m, n, e, own, past, 0.0, zz, 0.0, xx, 0.0, mzz, 0.0, mxx
        )  # fmt: skip
        _component(
            w, new, old, l + 4 * LANES, a, b, m, n, e, own, past, 0.0, z, 0.0, x, 0.0, mz, 0.0, mx
        )  # fmt: skip


@njit(forceinline=True, fastmath={"contract", "reassoc"})
def _square(w):
    """Sum of squares of the jets of g_y, G, m_y and H in the even term."""
    s = 0.0
    for i in range(_BLOCK):
        s += w[_GY + i] * w[_GY + i] + w[_G + i] * w[_G + i] + w[_MY + i] * w[_MY + i] + w[_H + i] * w[_H + i]
    return s


@njit(cache=True, fastmath=FMA, error_model="numpy")
def _series(w):
    """Sums and moments in all lanes; term 0 and the parameters are in w already, term -1 is zero."""
    for i in range(6 * _BLOCK):
        w[_SUMS + i] = w[i]
    for i in range(_BLOCK):
        w[_MOMENTS + i] = w[_MX + i]
        w[_MOMENTS + _BLOCK + i] = 0.5 * w[_MX + i]
        w[_MOMENTS + 2 * _BLOCK + i] = w[_MZ + i]
        w[_MOMENTS + 3 * _BLOCK + i] = 0.5 * w[_MZ + i]
        w[_MOMENTS + 4 * _BLOCK + i] = w[_MZ + i] / 3.0
    for k in range(1, MAX_TERMS, 2):
        _term(w, _ODD, 0, k)
        _term(w, 0, _ODD, k + 1)
        for i in range(6 * _BLOCK):
            w[_SUMS + i] += w[_ODD + i] + w[i]
        f1, f2, f3, f4 = 1.0 / (k + 1), 1.0 / (k + 2), 1.0 / (k + 3), 1.0 / (k + 4)
        for i in range(_BLOCK):
            w[_MOMENTS + i] += f1 * w[_ODD + _MX + i] + f2 * w[_MX + i]
            w[_MOMENTS + _BLOCK + i] += f2 * w[_ODD + _MX + i] + f3 * w[_MX + i]
            w[_MOMENTS + 2 * _BLOCK + i] += f1 * w[_ODD + _MZ + i] + f2 * w[_MZ + i]
            w[_MOMENTS + 3 * _BLOCK + i] += f2 * w[_ODD + _MZ + i] + f3 * w[_MZ + i]
            w[_MOMENTS + 4 * _BLOCK + i] += f3 * w[_ODD + _MZ + i] + f4 * w[_MZ + i]
        if k >= LEAST_PAIR and _square(w) < TINY_PAIR * TINY_PAIR:
            break


@njit(cache=True)
def balance(pieces, starts, results):
    """Fills results (k, 11, 5) with jets of g and m (3 each) at the end of each sub-segment, and of its moments
    ``int t^k m_x dt`` (k = 0, 1) and ``int t^k m_z dt`` (k = 0, 1, 2), t from 0 to 1.

    pieces (k, 4 or more): as in `frames`; starts (k, 8): g and m at its start (3 each), and mu_0, mu_1: its length over
    that behind its start, and the square of it. m is over the square of the length behind the start.
    """
    w = np.empty(_WORK)
    count = pieces.shape[0]
    for first in range(0, count, LANES):
        w[: 2 * _TERM] = 0.0
        for l in range(LANES):
            at = min(first + l, count - 1)
            for k in range(4):
                w[_PARAMETERS + k * LANES + l] = pieces[at, k]
            for k in range(2):
                w[_PARAMETERS + (4 + k) * LANES + l] = starts[at, 6 + k]
            for k in range(6):
                w[k * _BLOCK + l] = starts[at, k]
            m = pieces[at, 3]
            w[_G + l] = starts[at, 2] - m * starts[at, 0]
            w[_G + 4 * LANES + l] = -starts[at, 0]
            w[_H + l] = starts[at, 5] - m * starts[at, 3]
            w[_H + 4 * LANES + l] = -starts[at, 3]
        _series(w)
        for l in range(min(LANES, count - first)):
            result = results[first + l]
            for k in range(11):
                for c in range(_JET):
                    result[k, c] = w[_SUMS + k * _BLOCK + c * LANES + l]
