"""Jets of an energy of free twist in its four local variables (k, t, dk, dt): value and derivatives (numba).

Layout of `ribbon.energies.free`: 0 value | 1..4 first | 5..14 second derivatives of the pairs in order.
"""

from __future__ import annotations

from numba import njit

#: Components of a jet.
COMPONENTS = 15


@njit(cache=True)
def product(x, y, out):
    """out (15,) = jet of x y; out is neither of them."""
    x0, y0 = x[0], y[0]
    out[0] = x0 * y0
    for c in range(1, COMPONENTS):
        out[c] = x0 * y[c] + y0 * x[c]
    at = 5
    for i in range(1, 5):
        for j in range(i, 5):
            out[at] += x[i] * y[j] + x[j] * y[i]
            at += 1


@njit(cache=True)
def through(x, f0, f1, f2, out):
    """out (15,) = jet of f(x), f0, f1, f2 being f and its derivatives at the value of x; out is not x."""
    out[0] = f0
    at = 5
    for i in range(1, 5):
        out[i] = f1 * x[i]
        for j in range(i, 5):
            out[at] = f1 * x[at] + f2 * x[i] * x[j]
            at += 1
