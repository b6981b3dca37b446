"""Energy, gradient and exact Hessian of the chained ribbon in O(p) plus the filling of the dense matrix (numba).

Unknowns (thesis, 3.1), 2 p + 2 of them, in the order ``b_1, m_1, a_1, n_1, a_2, n_2, ... a_p, n_p``. Segment i has the
parameters ``q_i = (a_i, b_i, n_i, m_i)``; b and m are continuous: ``b_(i+1) = b_i + L_i a_i``,
``m_(i+1) = m_i + L_i n_i`` (docs/theory.md, eq. (4.1)).

Gravity. Let ``R_i`` be the frame at the start of segment i, ``Q_i, p_i, J_i`` its end frame, chord and chord integral
(`ribbon.element.series`), e the unit vector up, ``M_i`` the length of ribbon behind segment i. Then (thesis, eq. 2.10;
docs/theory.md, eq. (4.2))::

    int <r, e> ds = <r_1, e> + sum_i <g_i, c_i> ,   g_i = R_i^T e ,   c_i = J_i + M_i p_i ,   g_(i+1) = Q_i^T g_i .

With the backward recursion ``C_i = c_i + Q_i C_(i+1)``, ``C_(p+1) = 0``, the sum is ``<g_1, C_1>``, its derivative by a
parameter of segment j is ``<g_j, d c_j + d Q_j C_(j+1)>``. A dead force F at s = l adds ``-<F, r_1 + R_1 P_1>`` with
``P_i = p_i + Q_i P_(i+1)``, ``P_(p+1) = 0``, and the same in its derivatives.

Second derivatives are the same with second derivatives on the diagonal. For j < k a change of q_j turns all that is
behind it about the axis ``u_j``, the axial vector of ``R_j dQ_j Q_j^T R_j^T``, so that they are the product of two
vectors of the fixed frame, whatever the directions of the loads (docs/theory.md, eq. (4.3))::

    d2 / dq_j dq_k = <u_j, v_k> ,
    v_k = Gamma R_k (d c_k + dQ_k C_(k+1)) x e - R_k (d p_k + dQ_k P_(k+1)) x F .

The Hessian is thus semi-separable of rank 3. An unknown X = a_j (or n_j; b_1 and m_1 count as j = 0 with L = 1 and no
part of its own) moves ``a_j`` itself and every later b by ``L_j``; with suffix sums of u, v and of the diagonal blocks
each entry of the Hessian by the unknowns costs O(1), where the thesis reports cubic cost (3.5.1).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ribbon.element import weight
from ribbon.element.element import elastic_jet, elastic_value
from ribbon.element.free_series import parameter_count
from ribbon.element.kinematics import segment_values
from ribbon.element.kinematics import walk as segment_walk
from ribbon.energies.codes import has_free_twist


@njit(cache=True)
def pairs(count):
    """Places (count, count) in a jet of the second derivatives by `count` parameters."""
    found = np.empty((count, count), dtype=np.int64)
    at = 1 + count
    for i in range(count):
        for j in range(i, count):
            found[i, j] = found[j, i] = at
            at += 1
    return found


@njit(cache=True)
def unpack(x, lengths, q):
    """Parameters q (p, 2 f) of every segment from the unknowns x (f p + f,) of f fields (thesis, eq. 3.1, 3.2): pairs
    (slope, value at its start), field by field."""
    fields = q.shape[1] // 2
    for f in range(fields):
        value = x[f]
        for i in range(lengths.size):
            q[i, 2 * f] = x[fields * (i + 1) + f]
            q[i, 2 * f + 1] = value
            value += lengths[i] * q[i, 2 * f]


@njit(cache=True)
def energy_parts(q, lengths, material, loads, position, parts):
    """Fills `parts` (3,) with bending, natural-curvature and gravity energy (units D w / l).

    q (p, 4) from `unpack`; lengths (p,) in units of l; material, loads: `ribbon.problems.arguments`; position (3,) of
    the clamp. A term that is off is not computed.
    """
    parts[:] = 0.0
    jet = np.empty(15 if q.shape[1] == 4 else 28)
    for i in range(lengths.size):
        bending, own = elastic_value(
            material.code, q[i], lengths[i], material.section, material.natural, material.curvature[i, 0],
            material.curvature[i, 1], material.poisson, material.rest[i], jet,
        )  # fmt: skip
        parts[0] += bending
        parts[1] += own
    if loads.gamma != 0.0:
        if has_free_twist(material.code):
            parts[2] = loads.gamma * _height(q, lengths, loads.up, position, loads.frame, loads.limit)
        else:
            parts[2] = loads.gamma * weight.height(q, lengths, loads, position)


@njit(cache=True)
def _height(q, lengths, up, position, frame, limit):
    """int <r, up> ds over the ribbon (units l^2) of a free twist."""
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
        segment_values(True, q[i], lengths[i], limit, f, p, j)
        for k in range(3):
            total += g[k] * (j[k] + behind * p[k])
            new[k] = f[0, k] * g[0] + f[1, k] * g[1] + f[2, k] * g[2]
        g[:] = new
    return total


@njit(cache=True)
def local_derivatives(q, lengths, material, local):
    """Fills `local` (p, 15 or 28) with the jets of the elastic energy of every segment by its own parameters."""
    part = np.empty(15)
    for i in range(lengths.size):
        elastic_jet(
            material.code, q[i], lengths[i], material.section, material.natural, material.curvature[i, 0],
            material.curvature[i, 1], material.poisson, material.rest[i], local[i], part,
        )  # fmt: skip


@njit(cache=True)
def load_derivatives(free, q, lengths, loads, local, u, v):
    """Adds the jets of weight and end force to `local` (p, components) (value left alone) and fills the factors u, v
    (p, 4 or 6, 3).

    Symbols as in the module; loads: `ribbon.problems.arguments.Loads`. Weight alone on a strip with rulings is derived
    by the balance of moments (`ribbon.element.weight`), which gives the same for half of the work.
    """
    if not free and not loads.pulled:
        weight.derivatives(q, lengths, loads, local, u, v)
    else:
        framed_derivatives(free, q, lengths, loads, local, u, v)


@njit(cache=True)
def framed_derivatives(free, q, lengths, loads, local, u, v):
    """As `load_derivatives`, by the jets of frame, chord and chord integral, whatever the loads and the fields."""
    gamma, up, force = loads.gamma, loads.up, loads.force
    p = lengths.size
    components = local.shape[1]
    count = parameter_count(components)
    jets = np.empty((p, 15, components))
    frames = np.empty((p + 1, 3, 3))
    frames[0] = loads.frame
    segment_walk(free, q, lengths, loads.limit, jets)
    for i in range(p):
        for r in range(3):
            for c in range(3):
                frames[i + 1, r, c] = (
                    frames[i, r, 0] * jets[i, c, 0]
                    + frames[i, r, 1] * jets[i, 3 + c, 0]
                    + frames[i, r, 2] * jets[i, 6 + c, 0]
                )
    back = np.zeros(3)
    chord = np.zeros(3)
    g = np.empty(3)
    f = np.empty(3)
    d = np.empty((3, components))
    e = np.empty((3, components))
    spin = np.empty(3)
    moved = np.empty(3)
    drawn = np.empty(3)
    behind = 0.0
    for i in range(p - 1, -1, -1):
        jet = jets[i]
        for k in range(3):
            g[k] = gamma * (frames[i, 0, k] * up[0] + frames[i, 1, k] * up[1] + frames[i, 2, k] * up[2])
            f[k] = frames[i, 0, k] * force[0] + frames[i, 1, k] * force[1] + frames[i, 2, k] * force[2]
        # jets of c_i + Q_i C_(i+1) and of p_i + Q_i P_(i+1), with C_(i+1) and P_(i+1) held
        for r in range(3):
            for c in range(components):
                d[r, c] = (
                    jet[12 + r, c]
                    + behind * jet[9 + r, c]
                    + jet[3 * r, c] * back[0]
                    + jet[3 * r + 1, c] * back[1]
                    + jet[3 * r + 2, c] * back[2]
                )
                e[r, c] = (
                    jet[9 + r, c]
                    + jet[3 * r, c] * chord[0]
                    + jet[3 * r + 1, c] * chord[1]
                    + jet[3 * r + 2, c] * chord[2]
                )
        for c in range(1, components):
            local[i, c] += g[0] * d[0, c] + g[1] * d[1, c] + g[2] * d[2, c]
            local[i, c] -= f[0] * e[0, c] + f[1] * e[1, c] + f[2] * e[2, c]
        for c in range(count):
            # dQ Q^T is skew
            for r in range(3):
                a, b = (r + 2) % 3, (r + 1) % 3
                spin[r] = (
                    jet[3 * a, 1 + c] * jet[3 * b, 0]
                    + jet[3 * a + 1, 1 + c] * jet[3 * b + 1, 0]
                    + jet[3 * a + 2, 1 + c] * jet[3 * b + 2, 0]
                )
            for r in range(3):
                u[i, c, r] = frames[i, r, 0] * spin[0] + frames[i, r, 1] * spin[1] + frames[i, r, 2] * spin[2]
                moved[r] = gamma * (
                    frames[i, r, 0] * d[0, 1 + c] + frames[i, r, 1] * d[1, 1 + c] + frames[i, r, 2] * d[2, 1 + c]
                )
                drawn[r] = frames[i, r, 0] * e[0, 1 + c] + frames[i, r, 1] * e[1, 1 + c] + frames[i, r, 2] * e[2, 1 + c]
            for r in range(3):
                a, b = (r + 1) % 3, (r + 2) % 3
                v[i, c, r] = moved[a] * up[b] - moved[b] * up[a] - drawn[a] * force[b] + drawn[b] * force[a]
        for r in range(3):
            back[r] = d[r, 0]
            chord[r] = e[r, 0]
        behind += lengths[i]


@njit(cache=True)
def assemble_gradient(lengths, local, gradient):
    """Gradient (f p + f,) by the unknowns of f fields from the local jets (p, 15 or 28)."""
    fields = parameter_count(local.shape[1]) // 2
    for f in range(fields):
        tail = 0.0
        for i in range(lengths.size - 1, -1, -1):
            gradient[fields * (i + 1) + f] = local[i, 1 + 2 * f] + lengths[i] * tail
            tail += local[i, 2 + 2 * f]
        gradient[f] = tail


@njit(cache=True)
def _dot(x, y):
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]


@njit(cache=True)
def assemble_hessian(lengths, local, coupled, u, v, hessian):
    """Symmetric Hessian (f p + f, f p + f) by the unknowns of f fields; `coupled` is False without loads (u = v = 0).

    The parameter 2 s of a segment is the slope of field s, its own, and 2 s + 1 what it hands on, its tail."""
    p = lengths.size
    count = parameter_count(local.shape[1])
    place = pairs(count)
    fields = count // 2
    # suffix sums over i > k, at index k + 1 (k = -1 .. p - 1); axes: tails of the fields
    sd = np.zeros((p + 1, fields, fields))
    sv = np.zeros((p + 1, fields, 3))
    suv = np.zeros((p + 1, fields, fields))
    spv = np.zeros((p + 1, fields, fields))
    prefix = np.zeros((p + 1, fields, 3))
    if coupled:
        for i in range(p):
            for s in range(fields):
                for r in range(3):
                    prefix[i + 1, s, r] = prefix[i, s, r] + u[i, 2 * s + 1, r]
    for i in range(p - 1, -1, -1):
        for s in range(fields):
            for t in range(fields):
                sd[i, s, t] = sd[i + 1, s, t] + local[i, place[2 * s + 1, 2 * t + 1]]
                if coupled:
                    suv[i, s, t] = suv[i + 1, s, t] + _dot(u[i, 2 * s + 1], sv[i + 1, t])
                    spv[i, s, t] = spv[i + 1, s, t] + _dot(prefix[i, s], v[i, 2 * t + 1])
        if coupled:
            for s in range(fields):
                for r in range(3):
                    sv[i, s, r] = sv[i + 1, s, r] + v[i, 2 * s + 1, r]
    # blocks of an unknown with those of its own segment (k = -1: values at s = 0)
    for k in range(-1, p):
        length = 1.0 if k < 0 else lengths[k]
        for s in range(fields):
            for t in range(fields):
                h = length * length * sd[k + 1, s, t]
                if coupled:
                    h += length * length * (suv[k + 1, s, t] + suv[k + 1, t, s])
                if k >= 0:
                    h += local[k, place[2 * s, 2 * t]]
                    if coupled:
                        h += length * (_dot(u[k, 2 * s], sv[k + 1, t]) + _dot(u[k, 2 * t], sv[k + 1, s]))
                hessian[fields * (k + 1) + s, fields * (k + 1) + t] = h
    # blocks with earlier segments, j < k
    first = np.zeros((p + 1, fields, 3))
    if coupled:
        for j in range(p):
            for s in range(fields):
                for r in range(3):
                    first[j + 1, s, r] = u[j, 2 * s, r] - lengths[j] * prefix[j + 1, s, r]
    whole = np.zeros(3)
    for k in range(p):
        for t in range(fields):
            column = fields * (k + 1) + t
            if coupled:
                for r in range(3):
                    whole[r] = v[k, 2 * t, r] + lengths[k] * sv[k + 1, t, r]
            for s in range(fields):
                g = local[k, place[2 * s + 1, 2 * t]] + lengths[k] * sd[k + 1, s, t]
                if coupled:
                    g += _dot(prefix[k, s], v[k, 2 * t]) + lengths[k] * spv[k + 1, s, t]
                    g += _dot(u[k, 2 * t], sv[k + 1, s]) + lengths[k] * suv[k + 1, t, s]
                for j in range(-1, k):
                    h = g if j < 0 else lengths[j] * g
                    if coupled:
                        h += _dot(first[j + 1, s], whole)
                    hessian[fields * (j + 1) + s, column] = h
                    hessian[column, fields * (j + 1) + s] = h


@njit(cache=True)
def walk(free, q, lengths, position, frame, limit, points, frames, moment):
    """Positions (p + 1, 3) and frames (p + 1, 3, 3) of the joints, from the clamp, and int r ds (3,)."""
    f = np.empty((3, 3))
    p = np.empty(3)
    j = np.empty(3)
    points[0] = position
    frames[0] = frame
    moment[:] = 0.0
    for i in range(lengths.size):
        segment_values(free, q[i], lengths[i], limit, f, p, j)
        for r in range(3):
            moment[r] += lengths[i] * points[i, r]
            moment[r] += frames[i, r, 0] * j[0] + frames[i, r, 1] * j[1] + frames[i, r, 2] * j[2]
            points[i + 1, r] = points[i, r] + frames[i, r, 0] * p[0] + frames[i, r, 1] * p[1] + frames[i, r, 2] * p[2]
            for c in range(3):
                frames[i + 1, r, c] = frames[i, r, 0] * f[0, c] + frames[i, r, 1] * f[1, c] + frames[i, r, 2] * f[2, c]


@njit(cache=True)
def mass_matrix(lengths, fields, mass):
    """Gram matrix (f p + f, f p + f) of the integral of the squares of the changes of the `fields` in the unknowns.

    Eigenvalues of the Hessian against it do not depend on the number of segments.
    """
    p = lengths.size
    place = pairs(2 * fields)
    local = np.zeros((p, 15 if fields == 2 else 28))
    for i in range(p):
        h = lengths[i]
        for f in range(fields):
            local[i, place[2 * f, 2 * f]] = h * h * h / 3.0
            local[i, place[2 * f, 2 * f + 1]] = h * h / 2.0
            local[i, place[2 * f + 1, 2 * f + 1]] = h
    none = np.zeros((1, 2 * fields, 3))
    assemble_hessian(lengths, local, False, none, none, mass)
