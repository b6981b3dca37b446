"""Energy of a tape and its derivatives, element by element, into a symmetric band.

Strains at a point of the section, with Z = a^2 r_i, S = a q_i, P = P_2i (`ribbon.tape.section`), primes by s:

    e   = (|r'|^2 - 1) / 2,     k = (x' y'' - y' x'') / |r'|^2,
    e11 = e + z k + z'^2 / 2,   z = Z kappa,  z' = Z kappa',
    b11 = -k + Z kappa'',       b22 = P (kappa - kappa0),      b12 = S kappa',
    u   = 1/2 < (A/D) e11^2 + b11^2 + b22^2 + 2 nu b11 b22 + 2 (1 - nu) b12^2 >.

Martin et al. 2017, eq. 4 and 5, with 2 nu k11 k22 for the printed "2 nu k11 + k22". Every field (x, y, kappa^i) is a
cubic Hermite; a node has its values and slopes (x, x', y, y', kappa^0, kappa^0', ...).
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def _warped(stiff, e11, at, along, z, warping, q, gradient, hessian):
    """Energy of e11 + (warping_ij kappa^i kappa^j')' at a point; adds its derivatives (`density`), the lower half."""
    terms = z.size
    size, n0, n1, n2 = 2 + 3 * terms, 2, 2 + terms, 2 + 2 * terms
    d = np.zeros(size)
    d[0], d[1] = 1.0, at
    for i in range(terms):
        d[n0 + i], d[n1 + i] = q[1] * z[i], along * z[i]
    for i in range(terms):
        for j in range(terms):
            e11 += warping[i, j] * (q[n1 + i] * q[n1 + j] + q[n0 + i] * q[n2 + j])
            d[n0 + i] += warping[i, j] * q[n2 + j]
            d[n1 + i] += (warping[i, j] + warping[j, i]) * q[n1 + j]
            d[n2 + j] += warping[i, j] * q[n0 + i]
    stress = stiff * e11
    for i in range(size):
        gradient[i] += stress * d[i]
        for j in range(i + 1):
            hessian[i, j] += stiff * d[i] * d[j]
    for i in range(terms):
        hessian[n0 + i, 1] += stress * z[i]
        for j in range(terms):
            hessian[n2 + j, n0 + i] += stress * warping[i, j]
            if j <= i:
                hessian[n1 + i, n1 + j] += stress * (z[i] * z[j] + warping[i, j] + warping[j, i])
    return 0.5 * stress * e11


@njit(cache=True)
def density(stretching, bending, rest, z, warping, weight, q, gradient, hessian):
    """u of one section; fills gradient (m,) and hessian (m, m), m = 2 + 3 terms, by q = (e, k, kappa, kappa', kappa'').

    bending: (m, m), the quadratic form of the part without e11 in q less its rest (`Section.bending`); z: (points,
    terms); warping: of `Section.warping`; weight: (points,), of the mean.
    """
    terms = rest.size
    size = 2 + 3 * terms
    n0, n1 = 2, 2 + terms
    k = q[1]
    energy = 0.0
    for i in range(size):
        value = 0.0
        for j in range(size):
            off = q[j] - rest[j - n0] if n0 <= j < n1 else q[j]
            value += bending[i, j] * off
            hessian[i, j] = bending[i, j]
        gradient[i] = value
        energy += 0.5 * value * (q[i] - rest[i - n0] if n0 <= i < n1 else q[i])
    for m in range(weight.size):
        at, along = 0.0, 0.0
        for i in range(terms):
            at += z[m, i] * q[n0 + i]
            along += z[m, i] * q[n1 + i]
        e11 = q[0] + at * k + 0.5 * along * along
        if warping.shape[0] > 0:
            energy += _warped(stretching * weight[m], e11, at, along, z[m], warping[m], q, gradient, hessian)
            continue
        stiff = weight[m] * stretching
        stress = stiff * e11
        energy += 0.5 * stress * e11
        gradient[0] += stress
        gradient[1] += stress * at
        hessian[0, 0] += stiff
        hessian[1, 0] += stiff * at
        hessian[1, 1] += stiff * at * at
        for i in range(terms):
            gradient[n0 + i] += stress * k * z[m, i]
            gradient[n1 + i] += stress * along * z[m, i]
            hessian[n0 + i, 0] += stiff * k * z[m, i]
            hessian[n0 + i, 1] += (stiff * k * at + stress) * z[m, i]
            hessian[n1 + i, 0] += stiff * along * z[m, i]
            hessian[n1 + i, 1] += stiff * along * at * z[m, i]
            for j in range(terms):
                zz = z[m, i] * z[m, j]
                hessian[n1 + i, n0 + j] += stiff * k * along * zz
                if j <= i:
                    hessian[n0 + i, n0 + j] += stiff * k * k * zz
                    hessian[n1 + i, n1 + j] += (stiff * along * along + stress) * zz
    for i in range(size):
        for j in range(i):
            hessian[j, i] = hessian[i, j]
    return energy


@njit(cache=True)
def line(x1, y1, x2, y2, gradient, hessian):
    """e and k of the line; gradient (2, 4) and hessian (2, 4, 4) by (x', y', x'', y'')."""
    gradient[:] = 0.0
    hessian[:] = 0.0
    g = x1 * x1 + y1 * y1
    j = x1 * y2 - y1 * x2
    gradient[0, 0], gradient[0, 1] = x1, y1
    hessian[0, 0, 0] = hessian[0, 1, 1] = 1.0
    dj = np.array([y2, -x2, -y1, x1])
    dg = np.array([2.0 * x1, 2.0 * y1, 0.0, 0.0])
    for a in range(4):
        gradient[1, a] = dj[a] / g - j * dg[a] / (g * g)
        for b in range(4):
            hessian[1, a, b] = -(dj[a] * dg[b] + dg[a] * dj[b]) / (g * g) + 2.0 * j * dg[a] * dg[b] / (g * g * g)
    for a in range(2):
        hessian[1, a, a] -= 2.0 * j / (g * g)
    hessian[1, 0, 3] += 1.0 / g
    hessian[1, 3, 0] += 1.0 / g
    hessian[1, 1, 2] -= 1.0 / g
    hessian[1, 2, 1] -= 1.0 / g
    return 0.5 * (g - 1.0), j / g


@njit(cache=True)
def hermite(t, h, out):
    """Values, first and second derivatives by s (3, 4) of the Hermite functions (value, slope, value, slope)."""
    out[0, 0], out[0, 1] = 1.0 - 3.0 * t * t + 2.0 * t**3, h * (t - 2.0 * t * t + t**3)
    out[0, 2], out[0, 3] = 3.0 * t * t - 2.0 * t**3, h * (t**3 - t * t)
    out[1, 0], out[1, 1] = (6.0 * t * t - 6.0 * t) / h, 1.0 - 4.0 * t + 3.0 * t * t
    out[1, 2], out[1, 3] = (6.0 * t - 6.0 * t * t) / h, 3.0 * t * t - 2.0 * t
    out[2, 0], out[2, 1] = (12.0 * t - 6.0) / (h * h), (6.0 * t - 4.0) / h
    out[2, 2], out[2, 3] = (6.0 - 12.0 * t) / (h * h), (6.0 * t - 2.0) / h


@njit(cache=True)
def assemble(
    nodes, lengths, stretching, bending, rest, z, warping, weight, gauss, gauss_weight, column, band, gradient
):
    """Energy of all elements; adds to gradient (n,) and to band (n, rows), band[j, i - j] for i >= j.

    nodes: (nodes, fields) values and slopes; column: (nodes,) of each node's first unknown; rest: (elements, points,
    terms), kappa^i at rest at the Gauss points (k,), t in [0, 1], with weights (k,); the others as in `density`.
    """
    terms = rest.shape[2]
    fields = 2 + terms
    size = 2 + 3 * terms
    shape = np.empty((3, 4))
    q, g, h = np.empty(size), np.empty(size), np.empty((size, size))
    gl, hl = np.empty((2, 4)), np.empty((2, 4, 4))
    # by field and order of its derivative: the line has no order 0
    first, second = np.zeros((fields, 3)), np.zeros((fields, 3, fields, 3))
    values, at, half = np.empty((fields, 4)), np.empty((fields, 3)), np.empty((3, 4))
    energy = 0.0
    for element in range(lengths.size):
        for f in range(fields):
            values[f, 0], values[f, 1] = nodes[element, 2 * f], nodes[element, 2 * f + 1]
            values[f, 2], values[f, 3] = nodes[element + 1, 2 * f], nodes[element + 1, 2 * f + 1]
        for point in range(gauss.size):
            hermite(gauss[point], lengths[element], shape)
            factor = gauss_weight[point] * lengths[element]
            for f in range(fields):
                for d in range(3):
                    at[f, d] = 0.0
                    for c in range(4):
                        at[f, d] += shape[d, c] * values[f, c]
            q[0], q[1] = line(at[0, 1], at[1, 1], at[0, 2], at[1, 2], gl, hl)
            for d in range(3):
                for i in range(terms):
                    q[2 + d * terms + i] = at[2 + i, d]
            energy += factor * density(stretching, bending, rest[element, point], z, warping, weight, q, g, h)
            for a in range(4):
                fa, da = a % 2, 1 + a // 2
                first[fa, da] = g[0] * gl[0, a] + g[1] * gl[1, a]
                for b in range(4):
                    value = g[0] * hl[0, a, b] + g[1] * hl[1, a, b]
                    for c in range(2):
                        value += gl[c, a] * (h[c, 0] * gl[0, b] + h[c, 1] * gl[1, b])
                    second[fa, da, b % 2, 1 + b // 2] = value
                for d in range(3):
                    for i in range(terms):
                        b = 2 + d * terms + i
                        second[2 + i, d, fa, da] = h[0, b] * gl[0, a] + h[1, b] * gl[1, a]
            for d in range(3):
                for i in range(terms):
                    first[2 + i, d] = g[2 + d * terms + i]
                    for c in range(3):
                        for j in range(terms):
                            second[2 + i, d, 2 + j, c] = h[2 + d * terms + i, 2 + c * terms + j]
            for f in range(fields):
                for c in range(4):
                    row = column[element + c // 2] + 2 * f + c % 2
                    for d in range(3):
                        gradient[row] += factor * first[f, d] * shape[d, c]
                for e in range(f + 1):
                    for d in range(3):
                        for c in range(4):
                            half[d, c] = factor * (
                                second[f, d, e, 0] * shape[0, c]
                                + second[f, d, e, 1] * shape[1, c]
                                + second[f, d, e, 2] * shape[2, c]
                            )
                    for a in range(4):
                        row = column[element + a // 2] + 2 * f + a % 2
                        for b in range(4):
                            if f == e and b > a:
                                continue
                            col = column[element + b // 2] + 2 * e + b % 2
                            value = shape[0, a] * half[0, b] + shape[1, a] * half[1, b] + shape[2, a] * half[2, b]
                            if row >= col:
                                band[col, row - col] += value
                            else:
                                band[row, col - row] += value
    return energy
