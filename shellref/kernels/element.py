"""One Naghdi element in numba: strains, forces and the tangent of its nodes (docs/theory.md, eq. (7.1) to (7.3)).

The forms of `shellref.shell.forms` are the definition; here the same sums over the same Gauss points are written out.
At a point the state is its gradient g = (a_1, a_2, d_1, d_2, d), 15 numbers; strains are quadratic in g, so the
energy's second derivative by g is

    W = B^T C B + sigma . B' ,   B = dE/dg (8, 15) ,   K = sum_q w_q G_q^T W_q G_q ,   G_q = dg/du

with G one number per node and gradient. Columns are brought to the five increments of a node (three translations, two
in the director's tangent plane, P of director.py) at the points, rows at the end, where both are cheapest; the sum over
the points is a product of two matrices.

Arrays: cells (c, n) numbers of nodes; shapes (q, 3, n): values, slopes along S and v on the unit square; slopes
(c, q, 2): factors on them, 1 over element size and Lame factor; weights (c, q): areas over the normaliser; stress
(c, q, 8), or (c, q, 5) without bending where first = 3.
"""

from __future__ import annotations

import numpy as np

from shellref.kernels.kept import kernel, part


@part
def gradient(u, cell, shapes, along, across, g):
    """g (15,) of nodal values u (n, 6) at a point: shapes (3, n), factors of its slopes."""
    g[:] = 0.0
    for m in range(len(cell)):
        at = cell[m]
        one, two, value = along * shapes[1, m], across * shapes[2, m], shapes[0, m]
        for c in range(3):
            x, d = u[at, c], u[at, 3 + c]
            g[c] += one * x
            g[3 + c] += two * x
            g[6 + c] += one * d
            g[9 + c] += two * d
            g[12 + c] += value * d


@kernel("void(f8[:, ::1], f8[:, ::1], f8, i8[:, ::1], f8[:, :, ::1], f8[:, :, ::1], i8, f8[:, :, ::1])")
def strains(u, step, own, cells, shapes, slopes, first, out):
    """own T(u, u) + T(u, step) at the Gauss points: out (c, q, 8 - first); u, step (nodes, 6)."""
    g, h = np.empty(15), np.empty(15)
    for c in range(len(cells)):
        for q in range(len(shapes)):
            gradient(u, cells[c], shapes[q], slopes[c, q, 0], slopes[c, q, 1], g)
            gradient(step, cells[c], shapes[q], slopes[c, q, 0], slopes[c, q, 1], h)
            h += own * g
            e = np.zeros(8)
            for i in range(3):
                a1, a2, p1, p2, p = g[i], g[3 + i], g[6 + i], g[9 + i], g[12 + i]
                b1, b2, r1, r2, r = h[i], h[3 + i], h[6 + i], h[9 + i], h[12 + i]
                e[0] += a1 * r1 + b1 * p1
                e[1] += a2 * r2 + b2 * p2
                e[2] += a1 * r2 + b1 * p2 + a2 * r1 + b2 * p1
                e[3] += a1 * b1
                e[4] += a2 * b2
                e[5] += a1 * b2 + a2 * b1
                e[6] += a1 * r + b1 * p
                e[7] += a2 * r + b2 * p
            for k in range(first, 8):
                out[c, q, k - first] = e[k]


@kernel("void(f8[:, ::1], f8[:, :, ::1], i8[:, ::1], f8[:, :, ::1], f8[:, :, ::1], f8[:, ::1], i8, f8[:, ::1])")
def forces(u, stress, cells, shapes, slopes, weights, first, out):
    """int sigma . T(u, .) added to out (nodes, 6)."""
    g, f, s = np.empty(15), np.empty(15), np.zeros(8)
    for c in range(len(cells)):
        for q in range(len(shapes)):
            one, two = slopes[c, q, 0], slopes[c, q, 1]
            gradient(u, cells[c], shapes[q], one, two, g)
            for k in range(first, 8):
                s[k] = weights[c, q] * stress[c, q, k - first]
            for i in range(3):
                a1, a2, d1, d2, d = g[i], g[3 + i], g[6 + i], g[9 + i], g[12 + i]
                f[i] = s[0] * d1 + s[2] * d2 + s[3] * a1 + s[5] * a2 + s[6] * d
                f[3 + i] = s[1] * d2 + s[2] * d1 + s[4] * a2 + s[5] * a1 + s[7] * d
                f[6 + i] = s[0] * a1 + s[2] * a2
                f[9 + i] = s[1] * a2 + s[2] * a1
                f[12 + i] = s[6] * a1 + s[7] * a2
            for m in range(cells.shape[1]):
                at, x, y, z = cells[c, m], one * shapes[q, 1, m], two * shapes[q, 2, m], shapes[q, 0, m]
                for i in range(3):
                    out[at, i] += x * f[i] + y * f[3 + i]
                    out[at, 3 + i] += x * f[6 + i] + y * f[9 + i] + z * f[12 + i]


@part
def curvature_of_energy(g, s, weight, nu, bend, stretch, shear, w):
    """W (15, 15) at a point times its weight; s (8,) stress; bend, stretch, shear: stiffness factors there."""
    r = 0.5 * (1.0 - nu)
    cb, cm, cs = weight * bend, weight * stretch, weight * (1.0 - nu) * shear
    for i in range(3):
        a1, a2, d1, d2, d = g[i], g[3 + i], g[6 + i], g[9 + i], g[12 + i]
        for j in range(3):
            b1, b2, e1, e2, e = g[j], g[3 + j], g[6 + j], g[9 + j], g[12 + j]
            w[i, j] = cb * (d1 * e1 + r * d2 * e2) + cm * (a1 * b1 + r * a2 * b2) + cs * d * e
            w[i, 3 + j] = cb * (nu * d1 * e2 + r * d2 * e1) + cm * (nu * a1 * b2 + r * a2 * b1)
            w[3 + i, 3 + j] = cb * (d2 * e2 + r * d1 * e1) + cm * (a2 * b2 + r * a1 * b1) + cs * d * e
            w[i, 6 + j] = cb * (d1 * b1 + r * d2 * b2)
            w[i, 9 + j] = cb * (nu * d1 * b2 + r * d2 * b1)
            w[3 + i, 6 + j] = cb * (nu * d2 * b1 + r * d1 * b2)
            w[3 + i, 9 + j] = cb * (d2 * b2 + r * d1 * b1)
            w[i, 12 + j] = cs * d * b1
            w[3 + i, 12 + j] = cs * d * b2
            w[6 + i, 6 + j] = cb * (a1 * b1 + r * a2 * b2)
            w[6 + i, 9 + j] = cb * (nu * a1 * b2 + r * a2 * b1)
            w[9 + i, 9 + j] = cb * (a2 * b2 + r * a1 * b1)
            w[12 + i, 12 + j] = cs * (a1 * b1 + a2 * b2)
        w[i, i] += weight * s[3]
        w[i, 3 + i] += weight * s[5]
        w[3 + i, 3 + i] += weight * s[4]
        w[i, 6 + i] += weight * s[0]
        w[i, 9 + i] += weight * s[2]
        w[3 + i, 6 + i] += weight * s[2]
        w[3 + i, 9 + i] += weight * s[1]
        w[i, 12 + i] += weight * s[6]
        w[3 + i, 12 + i] += weight * s[7]
    for x in range(15):
        for y in range(x - x % 3):
            w[x, y] = w[y, x]


@part
def pulled(w, x, y, z, basis, positions, directors, bends):
    """W G P at a point: forces of the gradients a (2, 3, 5 n) and d (3 or 1, 3, 5 n) for unit increments of the nodes.

    w (15, 15); x, y, z (n,): slopes and values; basis (6, n): director's tangents, component by component; bends: with
    d_1 and d_2, which have no stiffness elsewhere.
    """
    n = len(x)
    for k in range(15):
        block, c = k // 3, k % 3
        if block > 1 and block < 4 and not bends:
            continue
        v = positions[block, c] if block < 2 else directors[block - 2 if bends else 0, c]
        f = w[k]
        f0, f1, f2, f3, f4, f5, f6, f7 = f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7]
        f8, f9, f10, f11, f12, f13, f14 = f[8], f[9], f[10], f[11], f[12], f[13], f[14]
        for m in range(n):
            p = x[m] * f6 + y[m] * f9 + z[m] * f12
            q = x[m] * f7 + y[m] * f10 + z[m] * f13
            r = x[m] * f8 + y[m] * f11 + z[m] * f14
            v[m] = x[m] * f0 + y[m] * f3
            v[n + m] = x[m] * f1 + y[m] * f4
            v[2 * n + m] = x[m] * f2 + y[m] * f5
            v[3 * n + m] = p * basis[0, m] + q * basis[2, m] + r * basis[4, m]
            v[4 * n + m] = p * basis[1, m] + q * basis[3, m] + r * basis[5, m]


@kernel(
    "void(f8[:, ::1], f8[:, :, ::1], i8[::1], i8[:, ::1], f8[:, :, ::1], f8[:, :, ::1], f8[:, ::1], f8[:, :, ::1], i8,"
    " f8[::1], f8[::1], f8[:, :, ::1])"
)
def tangents(u, bases, some, cells, shapes, slopes, weights, stress, full, alpha, law, out):
    """P^T K P of the elements `some` in out (m, 5 n, 5 n); its rows and columns: increment outside, node inside.

    The points of both rules, the `full` ones first; bases (nodes, 3, 2); stress (c, q, 8), without bending at the
    others; alpha (c,): share of membrane and shear on the full rule; law (3,): nu, stiffness of membrane and shear.
    """
    n, points = cells.shape[1], len(shapes)
    basis = np.empty((6, n))
    g, w = np.empty(15), np.zeros((15, 15))
    x, y = np.empty((points, n)), np.empty((points, n))
    # of the gradients a and d, at all points: what they are of the nodes, what forces they have, what the nodes have
    short = 2 * full + points  # d_1, d_2, d at full points, d at the others
    to_positions, to_directors = np.empty((n, 2 * points)), np.empty((n, short))
    positions, directors = np.empty((points, 2, 3, 5 * n)), np.empty((short, 3, 5 * n))
    on_positions, on_directors = np.empty((n, 15 * n)), np.empty((n, 15 * n))
    for i in range(len(some)):
        c = some[i]
        for m in range(n):
            for k in range(6):
                basis[k, m] = bases[cells[c, m], k // 2, k % 2]
        at = 0
        for q in range(points):
            bends = q < full
            one, two = slopes[c, q, 0], slopes[c, q, 1]
            gradient(u, cells[c], shapes[q], one, two, g)
            share = alpha[c] if bends else 1.0 - alpha[c]
            bend = 1.0 if bends else 0.0
            curvature_of_energy(g, stress[c, q], weights[c, q], law[0], bend, share * law[1], share * law[2], w)
            for m in range(n):
                x[q, m], y[q, m] = one * shapes[q, 1, m], two * shapes[q, 2, m]
                to_positions[m, 2 * q], to_positions[m, 2 * q + 1] = x[q, m], y[q, m]
                if bends:
                    to_directors[m, at], to_directors[m, at + 1] = x[q, m], y[q, m]
                to_directors[m, at + 2 if bends else at] = shapes[q, 0, m]
            pulled(w, x[q], y[q], shapes[q, 0], basis, positions[q], directors[at:], bends)
            at += 3 if bends else 1
        np.dot(to_positions, positions.reshape(2 * points, 15 * n), on_positions)
        np.dot(to_directors, directors.reshape(short, 15 * n), on_directors)
        for m in range(n):
            for k in range(3):
                out[i, k * n + m] = on_positions[m, k * 5 * n : (k + 1) * 5 * n]
            for k in range(2):
                p, q, r = basis[k, m], basis[2 + k, m], basis[4 + k, m]
                row, f = out[i, (3 + k) * n + m], on_directors[m]
                for j in range(5 * n):
                    row[j] = p * f[j] + q * f[5 * n + j] + r * f[10 * n + j]


@kernel("Tuple((i8[::1], i4[::1]))(i4[::1], i4[::1], i8[:, ::1])")
def rows(joined, neighbours, number):
    """(indptr, indices) over the unknowns: those of all neighbours (compressed rows of nodes), ascending.

    number (nodes, 5): of the unknowns, -1 for none.
    """
    width = np.zeros(len(number), np.int64)
    for i in range(len(number)):
        for j in neighbours[joined[i] : joined[i + 1]]:
            for b in range(5):
                width[i] += number[j, b] >= 0
    indptr = np.zeros(number.max() + 2, np.int64)
    for i in range(len(number)):
        for a in range(5):
            if number[i, a] >= 0:
                indptr[number[i, a] + 1] = width[i]
    indptr = np.cumsum(indptr)
    indices = np.empty(indptr[-1], np.int32)
    for i in range(len(number)):
        for a in range(5):
            if number[i, a] >= 0:
                k = indptr[number[i, a]]
                for j in neighbours[joined[i] : joined[i + 1]]:
                    for b in range(5):
                        if number[j, b] >= 0:
                            indices[k] = number[j, b]
                            k += 1
    return indptr, indices


@kernel("void(f8[:, :, ::1], i8[:, ::1], i8[::1], i4[::1], f8[::1])")
def scattered(tangents, number, indptr, indices, values):
    """values += tangents (c, 5 n, 5 n) of elements whose unknowns are `number` (c, 5 n)."""
    for c in range(len(tangents)):
        for i in range(number.shape[1]):
            row = number[c, i]
            if row < 0:
                continue
            low, high = indptr[row], indptr[row + 1]
            for j in range(number.shape[1]):
                if number[c, j] >= 0:
                    values[low + np.searchsorted(indices[low:high], number[c, j])] += tangents[c, i, j]


@kernel("void(f8[::1], i8[::1], i4[::1], f8[::1])")
def on_diagonal(diagonal, indptr, indices, values):
    """values += diag(diagonal)."""
    for i in range(len(diagonal)):
        values[indptr[i] + np.searchsorted(indices[indptr[i] : indptr[i + 1]], i)] += diagonal[i]
