"""L D L^T of a mesh's matrix, front by front along a tree of rectangles, with the inertia (numba).

Multifrontal elimination (Duff & Reid 1983, ACM Trans. Math. Softw. 9, 302, doi:10.1145/356044.356047) with pivots of
one unknown in an order known beforehand. The front of a rectangle is the tangent of its element, or the sum of what its
two parts have left; its pivots are eliminated, and the Schur complement of its border is kept until it is joined.

Without a search for pivots the factors are those of A + E with |E_ij| <= c u sqrt(g_i g_j), g_i = sum_k l_ik^2 |d_k|
(Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., SIAM 2002, theorem 11.3). Where all pivots are
positive g is the diagonal of A; each negative one adds 2 l_ik^2 |d_k|, summed up here, so that whoever asks can
refuse factors whose g is far above the diagonal. Pivots below their own rounding are refused here.

Fronts are full matrices in rows, of which the upper triangle counts: row k of a factor is d_k L^T while it is worked
on, L^T in the end.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types

from shellref.kernels.kept import kernel, part

LEAST, MOST, MANY = 16, 32, 200  # pivots that are eliminated at once, and of how many they are the more
TILE = 128  # rows of a product
ROUNDING = 8.0 * np.finfo(float).eps

# C <- alpha A B + beta C with leading dimensions, by the function of which numba makes np.dot: in place, no copies
_POINTER: Any = types.CPointer(types.float64)
gemm: Any = types.ExternalFunction(
    "numba_xxgemm",
    types.intc(
        *[types.char] * 3, *[types.intp] * 3, _POINTER, _POINTER, types.intp, _POINTER, types.intp, _POINTER, _POINTER,
        types.intp,
    ),
)  # fmt: skip
DOUBLE, PLAIN, TURNED = (np.int8(ord(letter)) for letter in "dnt")


@kernel("Tuple((i8[::1], i8[::1], i8[::1], i8[::1], i8[::1]))(i8[:, ::1], i8[::1], i8[:, ::1], i8[::1])")
def structured(children, cells, number, shared):
    """(start, index, pivots, where, place) of the fronts, see tree.Structure; shared: elements of each unknown.

    place[where[t] : where[t + 1]]: of the element's unknowns in front t (-1: held), or of the borders of both parts.
    """
    count, width = len(children), number.shape[1]
    start, where = np.zeros(count + 1, np.int64), np.zeros(count + 1, np.int64)
    pivots = np.zeros(count, np.int64)
    index, known = np.empty(64 * count, np.int64), np.empty(64 * count, np.int64)  # known: elements seen so far
    place = np.empty(64 * count, np.int64)
    at = np.full(len(shared), -1)
    for t in range(count):
        # the unknowns of the front, in the order in which they come
        begin, size, requested = start[t], 0, where[t]
        need = 2 * width
        if children[t, 0] >= 0:
            need = 0
            for k in range(2):
                c = children[t, k]
                need += start[c + 1] - start[c]
        while begin + need > len(index):
            index, known = np.append(index, np.empty_like(index)), np.append(known, np.empty_like(known))
        while requested + need > len(place):
            place = np.append(place, np.empty_like(place))
        if children[t, 0] < 0:
            for i in range(width):
                u = number[cells[t], i]
                place[requested + i] = u
                if u >= 0:
                    index[begin + size], known[begin + size] = u, 1
                    size += 1
            requested += width
        else:
            for k in range(2):
                c = children[t, k]
                for i in range(start[c] + pivots[c], start[c + 1]):
                    u = index[i]
                    place[requested] = u
                    requested += 1
                    if at[u] < 0:
                        at[u] = size
                        index[begin + size], known[begin + size] = u, known[i]
                        size += 1
                    else:
                        known[begin + at[u]] += known[i]
        # those that no other element knows first
        own, seen = index[begin : begin + size].copy(), known[begin : begin + size].copy()
        k = begin
        for last in (True, False):
            for i in range(size):
                if (seen[i] == shared[own[i]]) == last:
                    index[k], known[k], at[own[i]] = own[i], seen[i], k - begin
                    k += 1
            if last:
                pivots[t] = k - begin
        for i in range(where[t], requested):
            place[i] = at[place[i]] if place[i] >= 0 else -1
        for i in range(size):
            at[own[i]] = -1
        start[t + 1], where[t + 1] = begin + size, requested
    return start, index[: start[count]].copy(), pivots, where, place[: where[count]].copy()


@part
def eliminated(f, pivots, left, minus, one):
    """The first `pivots` rows of the upper triangle of f (n, n) become d L^T, the rest its Schur complement.

    left (MOST * n,): work space; minus, one (1,): -1 and 1. False: a pivot is zero or not finite.
    """
    n = len(f)
    panel = LEAST if pivots < MANY else MOST
    for low in range(0, pivots, panel):
        high = min(low + panel, pivots)
        for i in range(low, high):
            row = f[i]
            k = low
            while k + 3 < i:
                a, b, c, d = f[k], f[k + 1], f[k + 2], f[k + 3]
                p, q, r, s = a[i] / a[k], b[i] / b[k + 1], c[i] / c[k + 2], d[i] / d[k + 3]
                for j in range(i, n):
                    row[j] -= p * a[j] + q * b[j] + r * c[j] + s * d[j]
                k += 4
            while k < i:
                a = f[k]
                p = a[i] / a[k]
                for j in range(i, n):
                    row[j] -= p * a[j]
                k += 1
            if not (np.abs(f[i, i]) > 0.0 and np.abs(f[i, i]) < np.inf):
                return False
        wide, rest = high - low, n - high
        l = left[: wide * rest].reshape(wide, rest)
        for k in range(wide):
            row, over = f[low + k], 1.0 / f[low + k, low + k]
            for i in range(rest):
                l[k, i] = over * row[high + i]
        # f[i, first:] -= l[:, i] . f[low:high, first:] in tiles of rows; columns in BLAS are rows here
        for first in range(high, n, TILE):
            rows = min(TILE, n - first)
            gemm(
                DOUBLE, PLAIN, TURNED, n - first, rows, wide, minus.ctypes, f[low, first:].ctypes, n,
                l[0, first - high :].ctypes, rest, one.ctypes, f[first, first:].ctypes, n,
            )  # fmt: skip
    return True


@kernel(
    "i8(i8, i8, i8[:, ::1], f8[:, :, ::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], f8[::1],"
    " f8[::1], f8[::1], i8, f8[::1], f8[::1], f8[::1], f8[::1])"
)
def factored(
    begin, end, children, tangents, start, index, pivots, where, place, rows, first, diagonal, size, growth, top, stack,
    work, factors, d,
):  # fmt: skip
    """Fronts begin to end - 1, whose elements' `tangents` (c, m, m) come in their order: factors and d are filled.

    diagonal (unknowns,) is added to the matrix; size: sum of the sizes of what comes to each diagonal entry; growth: to
    which is added what negative pivots add to it. top: of the stack of Schur complements; its new top is returned, -1
    where a pivot is not safe.
    """
    most = 0
    for t in range(begin, end):
        most = max(most, start[t + 1] - start[t])
    space, minus, one = np.empty(MOST * most), np.array([-1.0]), np.array([1.0])
    element = 0
    for t in range(begin, end):
        n, p = start[t + 1] - start[t], pivots[t]
        own = index[start[t] : start[t + 1]]
        f = work[: n * n].reshape(n, n)
        for i in range(n):
            f[i, i:] = 0.0
        if children[t, 0] < 0:
            at, k = place[where[t] : where[t + 1]], tangents[element]
            element += 1
            for i in range(len(at)):
                x = at[i]
                if x >= 0:
                    size[own[x]] += np.abs(k[i, i])
                    row = k[i]
                    for j in range(len(at)):
                        if at[j] >= x:
                            f[x, at[j]] = row[j]
        else:
            least = top
            for k in range(2):
                c = children[t, k]
                b = start[c + 1] - start[c] - pivots[c]
                least -= b * b
            old, requested = least, where[t]
            for k in range(2):
                c = children[t, k]
                b = start[c + 1] - start[c] - pivots[c]
                left, at = stack[old : old + b * b].reshape(b, b), place[requested : requested + b]
                for i in range(b):
                    x, row = at[i], left[i]
                    for j in range(i, b):
                        y = at[j]
                        if x <= y:
                            f[x, y] += row[j]
                        else:
                            f[y, x] += row[j]
                old, requested = old + b * b, requested + b
            top = least
        for i in range(p):
            f[i, i] += diagonal[own[i]]
            size[own[i]] += np.abs(diagonal[own[i]])
        if not eliminated(f, p, space, minus, one):
            return -1
        keep = factors[rows[t] : rows[t + 1]].reshape(p, n)
        for k in range(p):
            pivot = f[k, k]
            d[first[t] + k] = pivot
            if pivot < 0.0:
                growth[own[k]] -= 2.0 * pivot
                for j in range(k + 1, n):
                    growth[own[j]] -= 2.0 * f[k, j] * f[k, j] / pivot
            if np.abs(pivot) <= ROUNDING * (size[own[k]] + growth[own[k]]):
                return -1
            over = 1.0 / pivot
            for j in range(k + 1, n):
                keep[k, j] = over * f[k, j]
        b = n - p
        left = stack[top : top + b * b].reshape(b, b)
        for i in range(b):
            left[i, i:] = f[p + i, p + i :]
        top += b * b
    return top


@kernel("void(f8[::1], i8[::1], i8[::1], i8[::1], i8[::1], i8[::1], f8[::1], f8[::1])")
def solved(x, start, index, pivots, rows, first, factors, d):
    """x (unknowns,): the right side becomes the solution."""
    own = np.empty(len(x))
    for t in range(len(pivots)):
        n, p = start[t + 1] - start[t], pivots[t]
        at, l = index[start[t] : start[t + 1]], factors[rows[t] : rows[t + 1]].reshape(p, n)
        for i in range(n):
            own[i] = x[at[i]] if i < p else 0.0
        for k in range(p):
            value, row = own[k], l[k]
            for j in range(k + 1, n):
                own[j] -= value * row[j]
        for i in range(p):
            x[at[i]] = own[i]
        for i in range(p, n):
            x[at[i]] += own[i]
    for back in range(len(pivots)):
        t = len(pivots) - 1 - back
        n, p = start[t + 1] - start[t], pivots[t]
        at, l = index[start[t] : start[t + 1]], factors[rows[t] : rows[t + 1]].reshape(p, n)
        for i in range(n):
            own[i] = x[at[i]]
        for back_k in range(p):
            k = p - 1 - back_k
            own[k] = own[k] / d[first[t] + k] - np.dot(l[k, k + 1 :], own[k + 1 : n])
            x[at[k]] = own[k]
