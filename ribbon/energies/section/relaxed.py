"""The relaxed cross-section: functions of y = z^4 = c4 k^2 with their derivatives by y, for compiled kernels.

A bent and twisted section minimises its energy over its shape; what the energies need of the shape are four functions,
means over the width of the unit profile Phi (docs/theory.md, eq. (10.2), (10.10), (10.14)), xi across over w, with
Phi'''' = -4 z^4 Phi, Phi'' = 1 and Phi''' = 0 at the edges and Theta = (xi - Phi_xi) / y::

    gain   = (1/2 - g(z)) / y        twist  = <xi Theta>       square = <Theta^2>       change = <(dTheta/dy)^2>

All four are smooth in y >= 0 (their only poles are y_n = -(mu_n / 2)^4 * 4, the first at -125), so smooth and even in
k: nothing divides by k. Three ways to them, one after the other in y:

- y below `_END` (z < 34): Taylor series about centres, of `_TERMS` terms, on pieces that grow with the distance to the
  first pole. Their coefficients come from the section's own equation in Legendre polynomials, below, once at import:
  sums of terms of one sign, so that derivatives lose nothing.
- above: closed forms in 1/z, exact but for exp(-z). g has one that is exact, which serves from `_FAR` (z = 4) on.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_POLE = 125.14  # nearest pole of the four functions in y: at -_POLE
_WIDTH = 0.25  # of a piece, in log(y + _POLE)
_TERMS = 19
_ORDER = 32  # even Legendre polynomials across the section
_END = 34.0**4
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
    """Centres (p,), half widths (p,) and Taylor coefficients (p, terms, 4) by (y - centre) / half width.

    With a = 4 M, the curvature is c = (1 + y a)^-1 e and Theta has the coefficients a c = v_0, its Taylor coefficients
    (-1)^j v_j, v_j = (a (1 + y a)^-1)^(j + 1) e.
    """
    a, slopes = operators()
    ends = _POLE * (np.exp(_WIDTH * np.arange(math.ceil(math.log1p(_END / _POLE) / _WIDTH) + 1)) - 1.0)
    centre, half = 0.5 * (ends[1:] + ends[:-1]), 0.5 * (ends[1:] - ends[:-1])
    step = np.linalg.inv(np.eye(_ORDER) + centre[:, None, None] * a) @ a
    v = np.empty((centre.size, _TERMS + 1, _ORDER))
    v[:, 0] = step[:, :, 0]
    step *= -half[:, None, None]
    for j in range(_TERMS):
        v[:, j + 1] = (step @ v[:, j, :, None])[:, :, 0]
    gram = (v @ slopes) @ v.transpose(0, 2, 1)
    rank = np.arange(1.0, _TERMS + 1)
    changes = gram[:, 1:, 1:] * np.outer(rank, rank) / half[:, None, None] ** 2
    found = np.empty((centre.size, _TERMS, 4))
    found[:, :, 0] = 0.5 * v[:, :-1, 0]
    found[:, :, 1] = v[:, :-1] @ slopes[:, 0]
    turned = gram[:, :, ::-1], changes[:, :, ::-1]  # sums along the other diagonals
    for m in range(_TERMS):
        found[:, m, 2] = np.trace(turned[0], _TERMS - m, 1, 2)
        found[:, m, 3] = np.trace(turned[1], _TERMS - 1 - m, 1, 2)
    return centre, half, found


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
            a = a * d + _TAYLOR[piece, j, 0]
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
def slopes(y):
    """Of twist and square the value and three derivatives by y, of change the value and two: eleven numbers."""
    if y < _END:
        piece = int(math.log1p(y / _POLE) / _WIDTH)
        d = (y - _CENTRE[piece]) / _HALF[piece]
        a0 = a1 = a2 = a3 = b0 = b1 = b2 = b3 = c0 = c1 = c2 = 0.0
        for j in range(_TERMS - 1, -1, -1):
            a3 = a3 * d + a2
            a2 = a2 * d + a1
            a1 = a1 * d + a0
            a0 = a0 * d + _TAYLOR[piece, j, 1]
            b3 = b3 * d + b2
            b2 = b2 * d + b1
            b1 = b1 * d + b0
            b0 = b0 * d + _TAYLOR[piece, j, 2]
            c2 = c2 * d + c1
            c1 = c1 * d + c0
            c0 = c0 * d + _TAYLOR[piece, j, 3]
        u = 1.0 / _HALF[piece]
        uu, uuu = 2.0 * u * u, 6.0 * u * u * u
        return a0, a1 * u, a2 * uu, a3 * uuu, b0, b1 * u, b2 * uu, b3 * uuu, c0, c1 * u, c2 * uu
    u = 1.0 / y
    e = math.sqrt(u)  # z^-2
    f = e * math.sqrt(e)  # z^-3
    uu = u * u
    third = 1.0 / 12.0
    return (
        (third - 0.5 * e) * u,
        -(third - 0.75 * e) * uu,
        (2.0 * third - 1.875 * e) * uu * u,
        -(6.0 * third - 6.5625 * e) * uu * uu,
        (third - e + 0.75 * f) * uu,
        -(2.0 * third - 2.5 * e + 2.0625 * f) * uu * u,
        (6.0 * third - 8.75 * e + 7.734375 * f) * uu * uu,
        -(24.0 * third - 39.375 * e + 36.73828125 * f) * uu * uu * u,
        (third - 1.5 * e + 185.0 / 128.0 * f) * uu * uu,
        -(4.0 * third - 6.75 * e + 4.75 * 185.0 / 128.0 * f) * uu * uu * u,
        (20.0 * third - 37.125 * e + 4.75 * 5.75 * 185.0 / 128.0 * f) * uu * uu * uu,
    )


@njit(cache=True)
def torsion_loss(width, thickness):
    """q = tanh(a) / a, a = sqrt(10) w / (2 h): share of the twist's energy that shear at the free edges saves."""
    a = math.sqrt(10.0) * width / (2.0 * thickness)
    return (math.tanh(a) if a < 20.0 else 1.0) / a
