"""Energy of a discrete curve-angle rod with exact gradient and Hessian: compiled kernels.

A cell lies between two edges, or between an edge and a clamp: tangents t_a, t_b, angles p_a, p_b of the directors over
reference frames A = (a_1, a_2, t~) that are carried from the anchor's tangent t~ to t without spin (parallel transport
in time). With v_1 = cos p a_1 + sin p a_2, v_2 = -sin p a_1 + cos p a_2::

    d_k = v_k - r (t~ + t) ,   r = v_k.t / (1 + t~.t)
    q_k = kb.(d_k^a + d_k^b) / 2 ,   kb = 2 t_a x t_b / (1 + t_a.t_b)      (bending, times the cell's length)
    q_3 = p_b - p_a + m ,   m: angle from the frame of a, carried along the rod, to the frame of b      (twist)
    E = sum_k c_k (q_k - L q0_k)^2 / (2 L)

As (t_a x t_b).t_a = 0, q_k = (N_a + N_b) / (1 + t_a.t_b) with N = (t_a x t_b).w, w = v - r t~, dr/dt = w / (1 + t~.t).
A transport from p to q turns by X = (p x q) / (1 + p.q) per change of q: dm = X(t_a, t_b).(dt_a + dt_b) + ..., which
is how holonomy enters. Everything depends on the two edges alone: x_(i-1), p_(i-1), x_i, p_i, x_(i+1).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

#: Unknowns of a cell: t_a (3), p_a, t_b (3), p_b.
CELL = 8
#: Rows below the diagonal of the Hessian, unknowns in the order x_0, p_0, x_1, p_1, ...
BAND = 10


@njit(cache=True)
def cross(a, b, out):
    """out = a x b, all (3,)."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def dot(a, b):
    """a.b of (3,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def carried(v, p, q, out):
    """out = v, normal to the unit vector p, carried to the unit vector q without spin."""
    r = dot(v, q) / (1.0 + dot(p, q))
    for i in range(3):
        out[i] = v[i] - r * (p[i] + q[i])


@njit(cache=True)
def side(k, ta, tb, frame, angle, second, g, h, work):
    """Adds N = (t_a x t_b).w of one side's director k to gradient g (8,) and Hessian h (8, 8); returns N.

    second: the director is that of b.
    """
    cross_ab, w, wf, x, y, z = work[0], work[1], work[2], work[3], work[4], work[5]
    cross(ta, tb, cross_ab)
    t = tb if second else ta
    c, s = math.cos(angle), math.sin(angle)
    if k == 1:
        c, s = -s, c
    away = 1.0 / (1.0 + t[0] * frame[0, 2] + t[1] * frame[1, 2] + t[2] * frame[2, 2])
    r, rf = 0.0, 0.0
    for i in range(3):
        w[i] = c * frame[i, 0] + s * frame[i, 1]
        wf[i] = -s * frame[i, 0] + c * frame[i, 1]
        r += w[i] * t[i]
        rf += wf[i] * t[i]
    r *= away
    rf *= away
    turn = 0.0
    for i in range(3):
        w[i] -= r * frame[i, 2]
        wf[i] -= rf * frame[i, 2]
        turn += cross_ab[i] * frame[i, 2]
    own, other = (4, 0) if second else (0, 4)
    at = own + 3
    # z: derivative of `turn` by the own tangent
    if second:
        z[0] = frame[1, 2] * ta[2] - frame[2, 2] * ta[1]
        z[1] = frame[2, 2] * ta[0] - frame[0, 2] * ta[2]
        z[2] = frame[0, 2] * ta[1] - frame[1, 2] * ta[0]
    else:
        z[0] = tb[1] * frame[2, 2] - tb[2] * frame[1, 2]
        z[1] = tb[2] * frame[0, 2] - tb[0] * frame[2, 2]
        z[2] = tb[0] * frame[1, 2] - tb[1] * frame[0, 2]
    cross(tb, w, x)
    cross(w, ta, y)
    for i in range(3):
        g[i] += x[i]
        g[4 + i] += y[i]
        g[own + i] -= turn * away * w[i]
    cross(tb, wf, x)
    cross(wf, ta, y)
    for i in range(3):
        mixed = x[i] - (0.0 if second else turn * away * wf[i])
        h[i, at] += mixed
        h[at, i] += mixed
        mixed = y[i] - (turn * away * wf[i] if second else 0.0)
        h[4 + i, at] += mixed
        h[at, 4 + i] += mixed
    value = dot(cross_ab, w)
    g[at] += dot(cross_ab, wf)
    h[at, at] -= value
    # the derivative of `turn` by the other tangent
    if second:
        x[0] = tb[1] * frame[2, 2] - tb[2] * frame[1, 2]
        x[1] = tb[2] * frame[0, 2] - tb[0] * frame[2, 2]
        x[2] = tb[0] * frame[1, 2] - tb[1] * frame[0, 2]
    else:
        x[0] = frame[1, 2] * ta[2] - frame[2, 2] * ta[1]
        x[1] = frame[2, 2] * ta[0] - frame[0, 2] * ta[2]
        x[2] = frame[0, 2] * ta[1] - frame[1, 2] * ta[0]
    for i in range(3):
        for j in range(3):
            h[own + i, own + j] += turn * away * away * (w[i] * frame[j, 2] + frame[i, 2] * w[j])
            h[own + i, own + j] -= away * (z[i] * w[j] + w[i] * z[j])
            mixed = -away * w[i] * x[j]
            h[own + i, other + j] += mixed
            h[other + j, own + i] += mixed
    # dt_a.(dt_b x w)
    for i, j, e in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        h[i, 4 + j] += w[e]
        h[4 + j, i] += w[e]
        h[j, 4 + i] -= w[e]
        h[4 + i, j] -= w[e]
    return value


@njit(cache=True)
def bending(k, ta, tb, fa, fb, pa, pb, g, h, work):
    """q_k of a cell; fills gradient g (8,) and Hessian h (8, 8) by the tangents as free vectors."""
    g[:] = 0.0
    h[:, :] = 0.0
    n = side(k, ta, tb, fa, pa, False, g, h, work) + side(k, ta, tb, fb, pb, True, g, h, work)
    share = 1.0 / (1.0 + dot(ta, tb))
    q = n * share
    for i in range(3):
        g[i] -= q * tb[i]
        g[4 + i] -= q * ta[i]
        h[i, 4 + i] -= q
        h[4 + i, i] -= q
    for i in range(CELL):
        g[i] *= share
    for i in range(3):
        for j in range(CELL):
            h[i, j] -= tb[i] * g[j]
            h[j, i] -= g[j] * tb[i]
            h[4 + i, j] -= ta[i] * g[j]
            h[j, 4 + i] -= g[j] * ta[i]
    for i in range(CELL):
        for j in range(CELL):
            h[i, j] *= share
    return q


@njit(cache=True)
def turned(p, q, sign, g, at_p, at_q, h, work):
    """Adds sign X(p, q) to g at both places, and its derivatives to h (a place below 0: fixed)."""
    x = work[0]
    cross(p, q, x)
    share = 1.0 / (1.0 + dot(p, q))
    for i in range(3):
        x[i] *= share * sign
        if at_p >= 0:
            g[at_p + i] += x[i]
        if at_q >= 0:
            g[at_q + i] += x[i]
    for row in (at_p, at_q):
        if row < 0:
            continue
        for i in range(3):
            for j in range(3):
                if at_p >= 0:
                    h[row + i, at_p + j] -= share * x[i] * q[j]
                if at_q >= 0:
                    h[row + i, at_q + j] -= share * x[i] * p[j]
        for i, j, e in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            if at_p >= 0:
                h[row + i, at_p + j] += sign * share * q[e]
                h[row + j, at_p + i] -= sign * share * q[e]
            if at_q >= 0:
                h[row + i, at_q + j] -= sign * share * p[e]
                h[row + j, at_q + i] += sign * share * p[e]


@njit(cache=True)
def twist(ta, tb, fa, fb, pa, pb, near, g, h, work):
    """q_3 of a cell, its reference twist within pi of `near`; fills g (8,), h (8, 8)."""
    g[:] = 0.0
    h[:, :] = 0.0
    ua, ub, u, x = work[1], work[2], work[3], work[4]
    carried(fa[:, 0], fa[:, 2], ta, ua)
    carried(ua, ta, tb, u)
    carried(fb[:, 0], fb[:, 2], tb, ub)
    cross(u, ub, x)
    m = math.atan2(dot(x, tb), dot(u, ub))
    m += 2.0 * math.pi * round((near - m) / (2.0 * math.pi))
    turned(ta, tb, 1.0, g, 0, 4, h, work)
    turned(fa[:, 2], ta, 1.0, g, -1, 0, h, work)
    turned(fb[:, 2], tb, -1.0, g, -1, 4, h, work)
    g[3] = -1.0
    g[7] = 1.0
    return pb - pa + m


@njit(cache=True)
def cell(ta, tb, fa, fb, pa, pb, near, length, stiffness, rest, q, g, h, gq, hq, work):
    """Energy of a cell; fills q (3,), its gradient g (8,) and Hessian h (8, 8) by free tangents and the angles."""
    g[:] = 0.0
    h[:, :] = 0.0
    energy = 0.0
    for k in range(3):
        if k < 2:
            q[k] = bending(k, ta, tb, fa, fb, pa, pb, gq, hq, work)
        else:
            q[k] = twist(ta, tb, fa, fb, pa, pb, near, gq, hq, work)
        c = stiffness[k] / length
        moment = c * (q[k] - length * rest[k])
        energy += 0.5 * moment * moment / c
        for i in range(CELL):
            g[i] += moment * gq[i]
            for j in range(CELL):
                h[i, j] += c * gq[i] * gq[j] + moment * hq[i, j]
    return energy


@njit(cache=True)
def by_edges(t, size, g, h, at):
    """From derivatives by a free tangent, at rows `at` of g (8,) and h (8, 8), to those by the edge of this size."""
    gt = 0.0
    for i in range(3):
        gt += g[at + i] * t[i]
    for j in range(CELL):  # rows, then columns: the projector on both sides
        along = 0.0
        for i in range(3):
            along += t[i] * h[at + i, j]
        for i in range(3):
            h[at + i, j] = (h[at + i, j] - along * t[i]) / size
    for j in range(CELL):
        along = 0.0
        for i in range(3):
            along += h[j, at + i] * t[i]
        for i in range(3):
            h[j, at + i] = (h[j, at + i] - along * t[i]) / size
    for i in range(3):
        g[at + i] = (g[at + i] - gt * t[i]) / size
    for i in range(3):
        for j in range(3):
            spread = (1.0 if i == j else 0.0) - t[i] * t[j]
            h[at + i, at + j] -= (gt * spread / size + t[i] * g[at + j] + g[at + i] * t[j]) / size


@njit(cache=True)
def assemble(y, lengths, frames, near, stiffness, rest, first, last, gradient, band, strain, ends):
    """Elastic energy of the rod at y (4 n + 3,) = x_0, p_0, x_1, ..., x_n; frames (n + 2, 3, 3): anchors of the start
    clamp, the edges and the end clamp; near (n + 1,): reference twists; stiffness, rest (n + 1, 3).

    lengths (n + 1,): of the cells. first, last: range of cells (0 and n are those of the clamps). Fills gradient
    (4 n + 3,), band (11, 4 n + 3), the Hessian's lower half; strain (n + 1, 3): q; ends (n + 1, 8): every cell's
    gradient by its free tangents and angles. NaN where a tangent turned by nearly pi from its anchor.
    """
    n = frames.shape[0] - 2
    gradient[:] = 0.0
    band[:, :] = 0.0
    strain[:, :] = 0.0
    ends[:, :] = 0.0
    t = np.empty((n + 2, 3))
    size = np.ones(n + 2)
    angle = np.zeros(n + 2)
    t[0] = frames[0, :, 2]
    t[n + 1] = frames[n + 1, :, 2]
    for j in range(n):
        s = 0.0
        for i in range(3):
            t[j + 1, i] = y[4 * j + 4 + i] - y[4 * j + i]
            s += t[j + 1, i] ** 2
        s = math.sqrt(s)
        size[j + 1] = s
        angle[j + 1] = y[4 * j + 3]
        if s == 0.0:
            return math.nan
        t[j + 1] /= s
        if 1.0 + dot(t[j + 1], frames[j + 1, :, 2]) < 1e-2:
            return math.nan
    g, gq, q = np.empty(CELL), np.empty(CELL), np.empty(3)
    h, hq = np.empty((CELL, CELL)), np.empty((CELL, CELL))
    work = np.empty((6, 3))
    energy = 0.0
    for c in range(first, last):
        if 1.0 + dot(t[c], t[c + 1]) < 1e-2:
            return math.nan
        energy += cell(
            t[c], t[c + 1], frames[c], frames[c + 1], angle[c], angle[c + 1], near[c], lengths[c], stiffness[c],
            rest[c], q, g, h, gq, hq, work,
        )  # fmt: skip
        strain[c] = q
        ends[c] = g
        by_edges(t[c], size[c], g, h, 0)
        by_edges(t[c + 1], size[c + 1], g, h, 4)
        for i in range(CELL):
            if (i < 4 and c == 0) or (i >= 4 and c == n):
                continue
            for si in range(2):
                ri = _place(c, i, si)
                if ri < 0:
                    continue
                fi = -1.0 if si == 0 else 1.0
                gradient[ri] += fi * g[i]
                for j in range(CELL):
                    if (j < 4 and c == 0) or (j >= 4 and c == n):
                        continue
                    for sj in range(2):
                        rj = _place(c, j, sj)
                        if rj >= 0 and rj <= ri:
                            band[ri - rj, rj] += fi * (-1.0 if sj == 0 else 1.0) * h[i, j]
    return energy


@njit(cache=True)
def _place(c, i, end):
    """Row of the unknown at which entry i of cell c acts; end 0: at the edge's start, 1: at its end (or an angle)."""
    edge = c - 1 if i < 4 else c
    if i == 3 or i == 7:
        return 4 * edge + 3 if end == 1 else -1
    return 4 * (edge + end) + (i if i < 4 else i - 4)
