"""The relaxed cross-section: what its energy gains, a function of y = z^4 = c4 k^2, for compiled kernels.

A bent and twisted section minimises its energy over its shape; what the energies need of the shape is one function,
(1/2 - g(z)) / y (docs/theory.md, eq. (10.2)), a mean over the width of the unit profile Phi (eq. (10.10)), xi across
over w, with Phi'''' = -4 z^4 Phi, Phi'' = 1 and Phi''' = 0 at the edges.

It is smooth in y >= 0 (its only poles are y_n = -(mu_n / 2)^4 * 4, the first at -125), so smooth and even in k: nothing
divides by k. Two ways to it, one after the other in y:

- below `_FAR` (z < 4): Taylor series about centres, of `_TERMS` terms, on pieces that grow with the distance to the
  first pole. Their coefficients come from the section's own equation in Legendre polynomials, below, once at import:
  sums of terms of one sign, so that derivatives lose nothing.
- above: its closed form.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_POLE = 125.14  # nearest pole in y: at -_POLE
_WIDTH = 0.25  # of a piece, in log(y + _POLE)
_TERMS = 19
_ORDER = 32  # even Legendre polynomials across the section
_FAR = 4.0**4  # from here on g in closed form


def integrals() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Legendre coefficients in 2 xi of deflection, slope and curvature, each (count, order), by those of the curvature.

    The curvature is expanded in even Legendre polynomials, orthonormal in the mean over the width; slope (odd) and
    deflection (of mean zero) are its integrals by xi, exactly.
    """
    count = 2 * _ORDER + 3
    up = np.zeros((count, count))  # integral of P_n: (P_(n+1) - P_(n-1)) / (2 n + 1), half of it in xi
    for n in range(count - 1):
        up[n + 1, n] = 0.5 / (2 * n + 1)
        if n:
            up[n - 1, n] = -0.5 / (2 * n + 1)
    even = np.arange(0, 2 * _ORDER, 2)
    curvature = np.zeros((count, _ORDER))
    curvature[even, np.arange(_ORDER)] = np.sqrt(2.0 * even + 1.0)
    slope = up @ curvature
    deflection = up @ slope
    deflection[0] = 0.0  # mean zero
    return deflection, slope, curvature


def operators() -> tuple[FloatArray, FloatArray]:
    """(4 M, N): Gram matrices of the section's deflection and slope, by the coefficients of its curvature across."""
    deflection, slope, _ = integrals()
    norm = 1.0 / (2.0 * np.arange(deflection.shape[0]) + 1.0)  # <P_n^2>
    return 4.0 * deflection.T @ (norm[:, None] * deflection), slope.T @ (norm[:, None] * slope)


def _pieces() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Centres (p,), half widths (p,) and Taylor coefficients (p, terms) by (y - centre) / half width.

    With a = 4 M, the curvature is c = (1 + y a)^-1 e, and half the first coefficient of a c is the gain; its Taylor
    coefficients are those of (-1)^j v_j, v_j = (a (1 + y a)^-1)^(j + 1) e.
    """
    a, _ = operators()
    ends = _POLE * (np.exp(_WIDTH * np.arange(math.ceil(math.log1p(_FAR / _POLE) / _WIDTH) + 1)) - 1.0)
    centre, half = 0.5 * (ends[1:] + ends[:-1]), 0.5 * (ends[1:] - ends[:-1])
    step = np.linalg.inv(np.eye(_ORDER) + centre[:, None, None] * a) @ a
    v = np.empty((centre.size, _TERMS, _ORDER))
    v[:, 0] = step[:, :, 0]
    step *= -half[:, None, None]
    for j in range(_TERMS - 1):
        v[:, j + 1] = (step @ v[:, j, :, None])[:, :, 0]
    return centre, half, 0.5 * v[:, :, 0]


_CENTRE, _HALF, _TAYLOR = _pieces()


@njit(cache=True)
def gain(y):
    """((1/2 - g)/y, first and second derivative by y) at y >= 0; phi(v) of Audoly & Neukirch with y = v^2 / 4."""
    if y < _FAR:
        piece = int(math.log1p(y / _POLE) / _WIDTH)
        d = (y - _CENTRE[piece]) / _HALF[piece]
        a = b = c = 0.0
        for j in range(_TERMS - 1, -1, -1):
            c = c * d + b
            b = b * d + a
            a = a * d + _TAYLOR[piece, j]
        scale = 1.0 / _HALF[piece]
        return a, b * scale, 2.0 * c * scale * scale
    g, zg, zzg = _edges(math.sqrt(math.sqrt(y)))
    u = 1.0 / y
    rest = 0.5 - g
    return rest * u, -(0.25 * zg + rest) * u * u, (2.0 * rest + 0.6875 * zg - 0.0625 * zzg) * u * u * u


@njit(cache=True)
def _edges(z):
    """g, z g' and z^2 g'' in closed form: g = (cosh z - cos z) / (z (sinh z + sin z)), hyperbolic functions scaled."""
    e = math.exp(-z)
    cosine, sine = 2.0 * e * math.cos(z), 2.0 * e * math.sin(z)
    n, s, c, d = 1.0 + e * e - cosine, 1.0 - e * e + sine, 1.0 + e * e + cosine, 1.0 - e * e - sine
    q = n / s  # g = q / z;  n' = s, s' = c, c' = d (all over 2 exp(-z))
    r = c / s
    first = 1.0 - q * r
    second = 2.0 * q * r * r - r - q * d / s
    g = q / z
    return g, first - g, z * second - 2.0 * first + 2.0 * g


@njit(cache=True)
def fill_layers(z, out):
    """Fills `out` (3, k) with g, z g' and z^2 g'' at z (k,) >= 0."""
    for i in range(z.size):
        y = z[i] ** 4
        if y < _FAR:
            p, q, r = gain(y)
            p, q, r = y * p, y * y * q, y * y * y * r
            out[0, i] = 0.5 - p
            out[1, i] = -4.0 * (p + q)
            out[2, i] = -4.0 * (3.0 * p + 11.0 * q + 4.0 * r)
        else:
            out[0, i], out[1, i], out[2, i] = _edges(z[i])


@njit(cache=True)
def torsion_loss(width, thickness):
    """q = tanh(a) / a, a = sqrt(10) w / (2 h): share of the twist's energy that shear at the free edges saves."""
    a = math.sqrt(10.0) * width / (2.0 * thickness)
    return (math.tanh(a) if a < 20.0 else 1.0) / a
