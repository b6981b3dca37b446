"""Newton's step of a chained problem by a Riccati recursion, in O(p), and the inertia of its Hessian (numba).

The Hessian by the parameters q_k of the segments is semi-separable (`ribbon.problems.chained_kernels`; docs/theory.md,
eq. (4.3)): its diagonal blocks are the local ones, and a change of q_j turns all that is behind it by u_j, which meets
v_k. With the rotation gathered so far as a state, psi_(k+1) = psi_k + sum_c u_kc dq_kc, and the fields' values t_k
(dq: slopes w_k, and t_k), the quadratic model of the energy is a linear-quadratic control problem of five or six
states and two or three controls (docs/theory.md, eq. (4.9))::

    sum_k g_k dq_k + 1/2 dq_k D_k dq_k + sum_c dq_kc <v_kc, psi_k> ,   t_(k+1) = t_k + L_k w_k ,   psi_0 = 0 .

Backwards, with the value 1/2 z P z + r z of what is behind, z = (t, psi): H_ww = D_ww + B^T P B and so on, the controls
are w = -H_ww^-1 (h_w + H_wz z), and P becomes the Schur complement. The blocks H_ww, and P_tt at s = 0, are the pivots
of a block LDL^T of the Hessian: their inertia is the Hessian's (Sylvester), and a Hessian shifted by the metric
``int (dfields)^2 ds``, whose matrix is local too, tells how many eigenvalues lie below the shift. Nothing dense is made
and no library of linear algebra is called.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ribbon.problems.chained_kernels import pairs


@njit(cache=True)
def _invert(block, count, inverse):
    """Inverse of the leading symmetric `count` x `count` block (count at most 3) into `inverse`, and how many of its
    eigenvalues are not positive (a singular block counts as such, and its inverse is not finite).

    Scaled to a diagonal of 1 first: curvature and ruling have different units.
    """
    s = np.ones(3)
    a = np.zeros((3, 3))
    for i in range(count):
        size = abs(block[i, i])
        for j in range(count):
            size = max(size, abs(block[i, j])) if size == 0.0 else size
        s[i] = 1.0 / np.sqrt(size) if size > 0.0 else 1.0
    for i in range(count):
        for j in range(count):
            a[i, j] = s[i] * block[i, j] * s[j]
    negative = 0
    if count == 1:
        negative = 0 if a[0, 0] > 0.0 else 1
        inverse[0, 0] = 1.0 / a[0, 0] if a[0, 0] != 0.0 else np.inf
    elif count == 2:
        d = a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]
        if d < 0.0:
            negative = 1
        elif d == 0.0 or a[0, 0] + a[1, 1] <= 0.0:
            negative = 2
        f = 1.0 / d if d != 0.0 else np.inf
        inverse[0, 0], inverse[1, 1] = a[1, 1] * f, a[0, 0] * f
        inverse[0, 1] = inverse[1, 0] = -a[0, 1] * f
    elif count == 3:
        c00 = a[1, 1] * a[2, 2] - a[1, 2] * a[2, 1]
        c01 = a[0, 2] * a[2, 1] - a[0, 1] * a[2, 2]
        c02 = a[0, 1] * a[1, 2] - a[0, 2] * a[1, 1]
        c11 = a[0, 0] * a[2, 2] - a[0, 2] * a[2, 0]
        c12 = a[0, 2] * a[1, 0] - a[0, 0] * a[1, 2]
        c22 = a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]
        d = a[0, 0] * c00 + a[0, 1] * c01 + a[0, 2] * c02
        # signs of the real roots of x^3 - t x^2 + m x - d (Descartes: exact where all roots are real)
        t, m = a[0, 0] + a[1, 1] + a[2, 2], c00 + c11 + c22
        last = 1.0
        positive = 0
        for coefficient in (-t, m, -d):
            if coefficient != 0.0:
                if coefficient * last < 0.0:
                    positive += 1
                last = coefficient
        negative = 3 - positive
        f = 1.0 / d if d != 0.0 else np.inf
        inverse[0, 0], inverse[1, 1], inverse[2, 2] = c00 * f, c11 * f, c22 * f
        inverse[0, 1] = inverse[1, 0] = c01 * f
        inverse[0, 2] = inverse[2, 0] = c02 * f
        inverse[1, 2] = inverse[2, 1] = c12 * f
    for i in range(count):
        for j in range(count):
            inverse[i, j] *= s[i] * s[j]
    return negative


@njit(forceinline=True)
def _local(length, jets, shift, fields, place, D):
    """The local Hessian of a segment, `jets` (15 or 28,), into D, with `shift` times the metric of its length."""
    for i in range(2 * fields):
        for j in range(i, 2 * fields):
            D[i, j] = D[j, i] = jets[place[i, j]]
    if shift != 0.0:
        for f in range(fields):
            D[2 * f, 2 * f] += shift * length * length * length / 3.0
            D[2 * f, 2 * f + 1] += shift * length * length * 0.5
            D[2 * f + 1, 2 * f] += shift * length * length * 0.5
            D[2 * f + 1, 2 * f + 1] += shift * length


@njit(forceinline=True)
def _controls(k, length, coupled, u, v, P, D, fields, PB, hww, hzw):
    """H_ww and H_zw of segment k, with P of what is behind it; PB is scratch."""
    # P B: B moves t_f by the length and psi by u
    for i in range(fields + 3 if coupled else fields):
        for f in range(fields):
            value = length * P[i, f]
            if coupled:
                for r in range(3):
                    value += P[i, fields + r] * u[k, 2 * f, r]
            PB[i, f] = value
    # H_ww = D_ww + B^T P B
    for e in range(fields):
        for f in range(fields):
            value = D[2 * e, 2 * f] + length * PB[e, f]
            if coupled:
                for r in range(3):
                    value += u[k, 2 * e, r] * PB[fields + r, f]
            hww[e, f] = value
    # H_zw = [D_tw; v_w] + A^T P B: A is the identity and moves psi by u t
    for e in range(fields):
        for f in range(fields):
            value = D[2 * e + 1, 2 * f] + PB[e, f]
            if coupled:
                for r in range(3):
                    value += u[k, 2 * e + 1, r] * PB[fields + r, f]
            hzw[e, f] = value
    if coupled:
        for r in range(3):
            for f in range(fields):
                hzw[fields + r, f] = v[k, 2 * f, r] + PB[fields + r, f]


@njit(forceinline=True)
def _states(k, coupled, u, v, P, D, fields, scratch, new):
    """H_zz = [[D_tt, v_t], [., 0]] + A^T P A of segment k into `new`, with P of what is behind it."""
    for i in range(fields + 3 if coupled else fields):
        for f in range(fields):
            value = P[i, f]
            if coupled:
                for r in range(3):
                    value += P[i, fields + r] * u[k, 2 * f + 1, r]
            new[i, f] = value
    for e in range(fields):
        for f in range(fields):
            value = D[2 * e + 1, 2 * f + 1]
            if coupled:
                for r in range(3):
                    value += u[k, 2 * e + 1, r] * new[fields + r, f]
            scratch[e, f] = new[e, f] + value
    for e in range(fields):
        for f in range(fields):
            new[e, f] = scratch[e, f]
    if coupled:
        for r in range(3):
            for f in range(fields):
                new[fields + r, f] += v[k, 2 * f + 1, r]
                new[f, fields + r] = new[fields + r, f]
            for c in range(3):
                new[fields + r, fields + c] = P[fields + r, fields + c]


@njit(forceinline=True)
def _free(held, at, fields, which):
    """How many of the `fields` unknowns from `at` on are not held; `which` of them, in front."""
    moving = 0
    for f in range(fields):
        if not held[at + f]:
            which[moving] = f
            moving += 1
    return moving


@njit(forceinline=True)
def _gains(k, states, fields, moving, which, inverse, hzw, gains, inverses):
    """-H_ww^-1 H_wz and H_ww^-1 of segment k, with zeros for what is held."""
    for e in range(fields):
        for f in range(fields):
            inverses[k, e, f] = 0.0
        for i in range(states):
            gains[k, e, i] = 0.0
    for e in range(moving):
        for f in range(moving):
            inverses[k, which[e], which[f]] = inverse[e, f]
            for i in range(states):
                gains[k, which[e], i] -= inverse[e, f] * hzw[i, which[f]]


@njit(cache=True)
def factor(lengths, local, coupled, u, v, shift, extra, held, gains, inverses, first):
    """Factors Hessian + shift * metric + diag(extra) on the unknowns that are not held; returns how many of its
    eigenvalues are not positive.

    lengths (p,); local (p, 15 or 28) jets of the segments; u, v (p, 2 f, 3) of the loads, read where `coupled`; shift:
    of the metric; held (f p + f,) bool: unknowns that do not move. Filled: gains (p, f, f + 3): -H_ww^-1 H_wz, inverses
    (p, f, f): H_ww^-1 with zeros for what is held, first (f, f): inverse of the pivot at s = 0.
    """
    count = 4 if local.shape[1] == 15 else 6
    fields = count // 2
    states = fields + 3 if coupled else fields
    place = pairs(count)
    P, new, D = np.zeros((6, 6)), np.zeros((6, 6)), np.empty((6, 6))
    PB, hzw = np.zeros((6, 3)), np.zeros((6, 3))
    hww, small, inverse = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    which = np.zeros(3, dtype=np.int64)
    negative = 0
    for k in range(lengths.size - 1, -1, -1):
        _local(lengths[k], local[k], shift, fields, place, D)
        _controls(k, lengths[k], coupled, u, v, P, D, fields, PB, hww, hzw)
        for e in range(fields):
            hww[e, e] += extra[fields * (k + 1) + e]
        _states(k, coupled, u, v, P, D, fields, PB, new)
        moving = _free(held, fields * (k + 1), fields, which)
        for e in range(moving):
            for f in range(moving):
                small[e, f] = hww[which[e], which[f]]
        negative += _invert(small, moving, inverse)
        _gains(k, states, fields, moving, which, inverse, hzw, gains, inverses)
        # P of this segment: the Schur complement
        for i in range(states):
            for j in range(i + 1):
                value = new[i, j] if i == j else 0.5 * (new[i, j] + new[j, i])
                for f in range(fields):
                    value += 0.5 * (hzw[i, f] * gains[k, f, j] + hzw[j, f] * gains[k, f, i])
                P[i, j] = P[j, i] = value
    moving = _free(held, 0, fields, which)
    for e in range(moving):
        for f in range(moving):
            small[e, f] = P[which[e], which[f]]
        small[e, e] += extra[which[e]]
    negative += _invert(small, moving, inverse)
    first[:] = 0.0
    for e in range(moving):
        for f in range(moving):
            first[which[e], which[f]] = inverse[e, f]
    return negative


@njit(cache=True)
def solve(lengths, coupled, u, gains, inverses, first, right, step, turned):
    """Solves the factored system for right (f p + f,) into `step` (f p + f,); held unknowns stay.

    turned (3,): filled with the largest components of psi along the strip, rotation vectors (rad) of the step.
    """
    p, fields = inverses.shape[0], inverses.shape[1]
    states = fields + 3 if coupled else fields
    r = np.zeros(6)
    z = np.zeros(6)
    h = np.zeros(3)
    turned[:] = 0.0
    # backwards: h_w = -right_w + B^T r (kept in step), r = A^T r + K^T h_w, K the gains
    for k in range(p - 1, -1, -1):
        for f in range(fields):
            h[f] = -right[fields * (k + 1) + f] + _row(r, lengths[k], coupled, u, k, 2 * f, f, fields)
        if coupled:
            for f in range(fields):
                for c in range(3):
                    z[f] += r[fields + c] * u[k, 2 * f + 1, c]
            for f in range(fields):
                r[f] += z[f]
                z[f] = 0.0
        for i in range(states):
            for f in range(fields):
                r[i] += gains[k, f, i] * h[f]
        for f in range(fields):
            step[fields * (k + 1) + f] = h[f]
    for e in range(fields):
        z[e] = 0.0
        for f in range(fields):
            z[e] += first[e, f] * (right[f] - r[f])
        step[e] = z[e]
    for k in range(p):
        for e in range(fields):
            value = 0.0
            for f in range(fields):
                value -= inverses[k, e, f] * step[fields * (k + 1) + f]
            for i in range(states):
                value += gains[k, e, i] * z[i]
            h[e] = value
        if coupled:
            for c in range(3):
                for f in range(fields):
                    z[fields + c] += u[k, 2 * f, c] * h[f] + u[k, 2 * f + 1, c] * z[f]
                turned[c] = max(turned[c], abs(z[fields + c]))
        for f in range(fields):
            step[fields * (k + 1) + f] = h[f]
            z[f] += lengths[k] * h[f]


@njit(cache=True)
def _row(r, length, coupled, u, k, c, f, fields):
    """(B^T r)_f of a segment."""
    value = length * r[f]
    if coupled:
        for i in range(3):
            value += u[k, c, i] * r[fields + i]
    return value


@njit(cache=True)
def mass_times(lengths, fields, x, out):
    """Fills `out` (f p + f,) with the metric ``int (dfields)^2 ds`` times x (f p + f,), in O(p)."""
    p = lengths.size
    values = np.zeros(3)
    for f in range(fields):
        values[f] = x[f]
    for k in range(p):  # forces on a segment's value in out, on its slope kept beside
        length = lengths[k]
        for f in range(fields):
            slope = x[fields * (k + 1) + f]
            out[fields * (k + 1) + f] = length * length * (values[f] * 0.5 + length * slope / 3.0)
            values[f] += length * slope
    tails = np.zeros(3)
    for k in range(p - 1, -1, -1):
        length = lengths[k]
        for f in range(fields):
            slope = x[fields * (k + 1) + f]
            values[f] -= length * slope
            out[fields * (k + 1) + f] += length * tails[f]
            tails[f] += length * (values[f] + 0.5 * length * slope)
    for f in range(fields):
        out[f] = tails[f]
