"""Energy, gradient and exact Hessian of the chained ribbon in O(p) plus the filling of the dense matrix (numba).

Unknowns (thesis, 3.1), 2 p + 2 of them, in the order ``b_1, m_1, a_1, n_1, a_2, n_2, ... a_p, n_p``. Segment i has the
parameters ``q_i = (a_i, b_i, n_i, m_i)``; b and m are continuous: ``b_(i+1) = b_i + L_i a_i``,
``m_(i+1) = m_i + L_i n_i`` (docs/theory.md, eq. (4.1)).

Gravity. Let ``R_i`` be the frame at the start of segment i, ``Q_i, p_i, J_i`` its end frame, chord and chord integral
(`ribbon.element.series`), e the unit vector up, ``M_i`` the length of ribbon behind segment i. Then (thesis, eq. 2.10;
docs/theory.md, eq. (4.2))::

    int <r, e> ds = <r_1, e> + sum_i <g_i, c_i> ,   g_i = R_i^T e ,   c_i = J_i + M_i p_i ,   g_(i+1) = Q_i^T g_i .

With the backward recursion ``C_i = c_i + Q_i C_(i+1)``, ``C_(p+1) = 0``, the sum is ``<g_1, C_1>``, its derivative by a
parameter of segment j is ``<g_j, d c_j + d Q_j C_(j+1)>``, and its second derivatives are the same with second
derivatives on the diagonal and, for j < k, the product of two vectors of the fixed frame (docs/theory.md, eq. (4.3))::

    d2 / dq_j dq_k = <u_j, v_k> ,  u_j = R_(j+1) (dQ_j)^T g_j ,  v_k = R_k (d c_k + dQ_k C_(k+1)) .

The Hessian is thus semi-separable of rank 3. An unknown X = a_j (or n_j; b_1 and m_1 count as j = 0 with L = 1 and no
part of its own) moves ``a_j`` itself and every later b by ``L_j``; with suffix sums of u, v and of the diagonal blocks
each entry of the Hessian by the unknowns costs O(1), where the thesis reports cubic cost (3.5.1).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ribbon.element.element import bending_jet, bending_value, natural_jet, natural_value
from ribbon.element.series import PAIR_INDEX, segment_jets_many, segment_values

# own and tail parameter of the two types of unknowns: a -> (a, then b), n -> (n, then m)
_OWN = (0, 2)
_TAIL = (1, 3)


@njit(cache=True)
def unpack(x, lengths, q):
    """Parameters q (p, 4) = (a, b, n, m) of every segment from the unknowns x (2 p + 2,) (thesis, eq. 3.1, 3.2)."""
    b = x[0]
    m = x[1]
    for i in range(lengths.size):
        q[i, 0] = x[2 * i + 2]
        q[i, 1] = b
        q[i, 2] = x[2 * i + 3]
        q[i, 3] = m
        b += lengths[i] * q[i, 0]
        m += lengths[i] * q[i, 2]


@njit(cache=True)
def energy_parts(q, lengths, code, section, natural, curvature, poisson, gamma, up, position, frame, limit, parts):
    """Fills `parts` (3,) with bending, natural-curvature and gravity energy (units D w / l).

    q (p, 4) from `unpack`; lengths (p,) in units of l; `natural` and ``gamma != 0`` switch the terms on;
    curvature (2,): K l at both ends; up (3,) unit; position (3,) and frame (3, 3) of the clamp. A term that is off is
    not computed.
    """
    parts[:] = 0.0
    s = 0.0
    slope = curvature[1] - curvature[0]
    for i in range(lengths.size):
        a, b, n, m = q[i, 0], q[i, 1], q[i, 2], q[i, 3]
        parts[0] += bending_value(code, a, b, n, m, lengths[i], section)
        if natural:
            parts[1] += natural_value(a, b, n, m, lengths[i], curvature[0] + slope * s, slope, poisson)
        s += lengths[i]
    if gamma != 0.0:
        parts[2] = gamma * _height(q, lengths, up, position, frame, limit)


@njit(cache=True)
def _height(q, lengths, up, position, frame, limit):
    """int <r, up> ds over the ribbon (units l^2)."""
    f = np.empty((3, 3))
    p = np.empty(3)
    j = np.empty(3)
    g = np.empty(3)
    new = np.empty(3)
    total = 0.0
    behind = 0.0
    for i in range(lengths.size):
        behind += lengths[i]
    for k in range(3):
        g[k] = frame[0, k] * up[0] + frame[1, k] * up[1] + frame[2, k] * up[2]
        total += position[k] * up[k] * behind
    for i in range(lengths.size):
        behind -= lengths[i]
        segment_values(q[i, 0], q[i, 1], q[i, 2], q[i, 3], lengths[i], limit, f, p, j)
        for k in range(3):
            total += g[k] * (j[k] + behind * p[k])
            new[k] = f[0, k] * g[0] + f[1, k] * g[1] + f[2, k] * g[2]
        g[:] = new
    return total


@njit(cache=True)
def local_derivatives(q, lengths, code, section, natural, curvature, poisson, local):
    """Fills `local` (p, 15) with the jets of the elastic energy of every segment by its own parameters."""
    part = np.empty(15)
    s = 0.0
    slope = curvature[1] - curvature[0]
    for i in range(lengths.size):
        a, b, n, m = q[i, 0], q[i, 1], q[i, 2], q[i, 3]
        bending_jet(code, a, b, n, m, lengths[i], section, part)
        local[i] = part
        if natural:
            natural_jet(a, b, n, m, lengths[i], curvature[0] + slope * s, slope, poisson, part)
            local[i] += part
        s += lengths[i]


@njit(cache=True)
def gravity_derivatives(q, lengths, gamma, up, frame, limit, local, u, v):
    """Adds the jets of gravity to `local` (p, 15) (value left alone) and fills the factors u, v (p, 4, 3).

    Symbols as in the module; u and v carry the factor gamma together (it sits in v).
    """
    p = lengths.size
    jets = np.empty((p, 15, 15))
    frames = np.empty((p + 1, 3, 3))
    frames[0] = frame
    segment_jets_many(q, lengths, limit, jets)
    for i in range(p):
        for r in range(3):
            for c in range(3):
                frames[i + 1, r, c] = (
                    frames[i, r, 0] * jets[i, c, 0]
                    + frames[i, r, 1] * jets[i, 3 + c, 0]
                    + frames[i, r, 2] * jets[i, 6 + c, 0]
                )
    back = np.zeros(3)
    g = np.empty(3)
    d = np.empty((3, 15))
    behind = 0.0
    for i in range(p - 1, -1, -1):
        jet = jets[i]
        for k in range(3):
            g[k] = frames[i, 0, k] * up[0] + frames[i, 1, k] * up[1] + frames[i, 2, k] * up[2]
        # jets of c_i + Q_i C_(i+1) with C_(i+1) held
        for r in range(3):
            for c in range(15):
                d[r, c] = (
                    jet[12 + r, c]
                    + behind * jet[9 + r, c]
                    + jet[3 * r, c] * back[0]
                    + jet[3 * r + 1, c] * back[1]
                    + jet[3 * r + 2, c] * back[2]
                )
        for c in range(1, 15):
            local[i, c] += gamma * (g[0] * d[0, c] + g[1] * d[1, c] + g[2] * d[2, c])
        for c in range(4):
            for r in range(3):
                v[i, c, r] = gamma * (
                    frames[i, r, 0] * d[0, 1 + c] + frames[i, r, 1] * d[1, 1 + c] + frames[i, r, 2] * d[2, 1 + c]
                )
                t0 = jet[0, 1 + c] * g[0] + jet[3, 1 + c] * g[1] + jet[6, 1 + c] * g[2]
                t1 = jet[1, 1 + c] * g[0] + jet[4, 1 + c] * g[1] + jet[7, 1 + c] * g[2]
                t2 = jet[2, 1 + c] * g[0] + jet[5, 1 + c] * g[1] + jet[8, 1 + c] * g[2]
                u[i, c, r] = frames[i + 1, r, 0] * t0 + frames[i + 1, r, 1] * t1 + frames[i + 1, r, 2] * t2
        for r in range(3):
            back[r] = d[r, 0]
        behind += lengths[i]


@njit(cache=True)
def assemble_gradient(lengths, local, gradient):
    """Gradient (2 p + 2,) by the unknowns from the local jets (p, 15)."""
    tail_b = 0.0
    tail_m = 0.0
    for i in range(lengths.size - 1, -1, -1):
        gradient[2 * i + 2] = local[i, 1] + lengths[i] * tail_b
        gradient[2 * i + 3] = local[i, 3] + lengths[i] * tail_m
        tail_b += local[i, 2]
        tail_m += local[i, 4]
    gradient[0] = tail_b
    gradient[1] = tail_m


@njit(cache=True)
def _dot(x, y):
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]


@njit(cache=True)
def assemble_hessian(lengths, local, coupled, u, v, hessian):
    """Symmetric Hessian (2 p + 2, 2 p + 2) by the unknowns; `coupled` is False when there is no gravity (u = v = 0)."""
    p = lengths.size
    # suffix sums over i > k, at index k + 1 (k = -1 .. p - 1); axes: tails of the two types
    sd = np.zeros((p + 1, 2, 2))
    sv = np.zeros((p + 1, 2, 3))
    suv = np.zeros((p + 1, 2, 2))
    spv = np.zeros((p + 1, 2, 2))
    prefix = np.zeros((p + 1, 2, 3))
    if coupled:
        for i in range(p):
            for s in range(2):
                for r in range(3):
                    prefix[i + 1, s, r] = prefix[i, s, r] + u[i, _TAIL[s], r]
    for i in range(p - 1, -1, -1):
        for s in range(2):
            for t in range(2):
                sd[i, s, t] = sd[i + 1, s, t] + local[i, PAIR_INDEX[_TAIL[s], _TAIL[t]]]
                if coupled:
                    suv[i, s, t] = suv[i + 1, s, t] + _dot(u[i, _TAIL[s]], sv[i + 1, t])
                    spv[i, s, t] = spv[i + 1, s, t] + _dot(prefix[i, s], v[i, _TAIL[t]])
        if coupled:
            for s in range(2):
                for r in range(3):
                    sv[i, s, r] = sv[i + 1, s, r] + v[i, _TAIL[s], r]
    # blocks of an unknown with those of its own segment (k = -1: b_1, m_1)
    for k in range(-1, p):
        length = 1.0 if k < 0 else lengths[k]
        for s in range(2):
            for t in range(2):
                h = length * length * sd[k + 1, s, t]
                if coupled:
                    h += length * length * (suv[k + 1, s, t] + suv[k + 1, t, s])
                if k >= 0:
                    h += local[k, PAIR_INDEX[_OWN[s], _OWN[t]]]
                    if coupled:
                        h += length * (_dot(u[k, _OWN[s]], sv[k + 1, t]) + _dot(u[k, _OWN[t]], sv[k + 1, s]))
                hessian[2 * k + 2 + s, 2 * k + 2 + t] = h
    # blocks with earlier segments, j < k
    first = np.zeros((p + 1, 2, 3))
    if coupled:
        for j in range(p):
            for s in range(2):
                for r in range(3):
                    first[j + 1, s, r] = u[j, _OWN[s], r] - lengths[j] * prefix[j + 1, s, r]
    whole = np.zeros(3)
    for k in range(p):
        for t in range(2):
            column = 2 * k + 2 + t
            if coupled:
                for r in range(3):
                    whole[r] = v[k, _OWN[t], r] + lengths[k] * sv[k + 1, t, r]
            for s in range(2):
                g = local[k, PAIR_INDEX[_TAIL[s], _OWN[t]]] + lengths[k] * sd[k + 1, s, t]
                if coupled:
                    g += _dot(prefix[k, s], v[k, _OWN[t]]) + lengths[k] * spv[k + 1, s, t]
                    g += _dot(u[k, _OWN[t]], sv[k + 1, s]) + lengths[k] * suv[k + 1, t, s]
                for j in range(-1, k):
                    h = g if j < 0 else lengths[j] * g
                    if coupled:
                        h += _dot(first[j + 1, s], whole)
                    hessian[2 * j + 2 + s, column] = h
                    hessian[column, 2 * j + 2 + s] = h


@njit(cache=True)
def walk(q, lengths, position, frame, limit, points, frames):
    """Positions (p + 1, 3) and frames (p + 1, 3, 3) of the joints, from the clamp."""
    f = np.empty((3, 3))
    p = np.empty(3)
    j = np.empty(3)
    points[0] = position
    frames[0] = frame
    for i in range(lengths.size):
        segment_values(q[i, 0], q[i, 1], q[i, 2], q[i, 3], lengths[i], limit, f, p, j)
        for r in range(3):
            points[i + 1, r] = points[i, r] + frames[i, r, 0] * p[0] + frames[i, r, 1] * p[1] + frames[i, r, 2] * p[2]
            for c in range(3):
                frames[i + 1, r, c] = frames[i, r, 0] * f[0, c] + frames[i, r, 1] * f[1, c] + frames[i, r, 2] * f[2, c]


@njit(cache=True)
def mass_matrix(lengths, mass):
    """Gram matrix (2 p + 2, 2 p + 2) of ``int (domega^2 + deta^2) ds`` in the unknowns.

    Eigenvalues of the Hessian against it do not depend on the number of segments.
    """
    p = lengths.size
    local = np.zeros((p, 15))
    for i in range(p):
        h = lengths[i]
        for pair in ((0, 1), (2, 3)):
            local[i, PAIR_INDEX[pair[0], pair[0]]] = h * h * h / 3.0
            local[i, PAIR_INDEX[pair[0], pair[1]]] = h * h / 2.0
            local[i, PAIR_INDEX[pair[1], pair[1]]] = h
    none = np.zeros((1, 4, 3))
    assemble_hessian(lengths, local, False, none, none, mass)
