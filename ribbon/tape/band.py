"""Symmetric band matrices that may be indefinite: L D L^T without exchanges, its inertia, solutions.

The constraints' rows stand behind the unknowns that they hold, so that no pivot is zero by structure; how well a
solution fits is measured where it is used.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def factor(band):
    """L D L^T in place: band (n, rows), band[j, i - j] for i >= j, becomes D in column 0 and L. Negative pivots."""
    n, rows = band.shape
    negative = 0
    scaled = np.empty(rows)
    for j in range(n):
        pivot = band[j, 0]
        if pivot < 0.0:
            negative += 1
        if pivot == 0.0:
            pivot = 1e-300
            band[j, 0] = pivot
        last = min(rows, n - j)
        for i in range(1, last):
            scaled[i] = band[j, i]
            band[j, i] /= pivot
        for k in range(1, last):
            if scaled[k] != 0.0:
                for i in range(k, last):
                    band[j + k, i - k] -= band[j, i] * scaled[k]
    return negative


@njit(cache=True)
def solve(band, right):
    """Solves in place for right (n, m), with the factors of `factor`."""
    n, rows = band.shape
    for m in range(right.shape[1]):
        for j in range(n):
            value = right[j, m]
            for i in range(1, min(rows, n - j)):
                right[j + i, m] -= band[j, i] * value
        for j in range(n - 1, -1, -1):
            value = right[j, m] / band[j, 0]
            for i in range(1, min(rows, n - j)):
                value -= band[j, i] * right[j + i, m]
            right[j, m] = value
