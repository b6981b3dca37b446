"""The unit profile of a relaxed section, in numpy: Psi(xi; y) = (Phi_0 - Phi) / y and its derivatives.

Phi_0 = xi^2 / 2 - 1/24 is the profile of a rod, Phi that of a strip (docs/theory.md, eq. (10.10)): Phi'''' = -4 y Phi,
Phi'' = 1 and Phi''' = 0 at xi = +-1/2, y = z^4. Below z = 2 a power series in y, whose terms are Legendre polynomials
in 2 xi; above, hyperbolic functions times exp(-z / 2), so that z may be of any size.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from ribbon.energies.section.relaxed import integrals, operators

FloatArray = NDArray[np.float64]

_SWITCH = 2.0  # in z
_TERMS = 20


@cache
def _terms() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Legendre coefficients in 2 xi of the terms of Psi's series, of their slopes and curvatures (each (count, terms)).

    Psi = sum (-y)^j psi_j, with psi_j'' of the coefficients (4 M)^(j + 1) e (`relaxed.operators`).
    """
    a, _ = operators()
    deflection, slope, curvature = integrals()
    powers = np.empty((a.shape[0], _TERMS))
    powers[:, 0] = a[:, 0]
    for j in range(1, _TERMS):
        powers[:, j] = a @ powers[:, j - 1]
    return deflection @ powers, slope @ powers, curvature @ powers


@dataclass(frozen=True)
class Unit:
    """Psi (m, n) at m values of y and n places xi, with its derivatives: by xi, twice by xi, by y."""

    value: FloatArray
    slope: FloatArray
    curvature: FloatArray
    by_y: FloatArray


def unit(y: FloatArray, xi: FloatArray) -> Unit:
    """Psi and its derivatives at y (m,), xi (n,)."""
    y, xi = np.asarray(y, dtype=float)[:, None], np.asarray(xi, dtype=float)
    near = y[:, 0] < _SWITCH**4
    if near.all() or not near.any():
        return Unit(*(_series if near.any() else _closed)(y, xi))
    found = np.empty((4, y.size, xi.size))
    for rows, form in ((np.flatnonzero(near), _series), (np.flatnonzero(~near), _closed)):
        for values, part in zip(found, form(y[rows], xi), strict=True):
            values[rows] = part
    return Unit(*found)


def _series(y: FloatArray, xi: FloatArray) -> tuple[FloatArray, ...]:
    powers = np.vander(-y[:, 0], _TERMS, increasing=True)  # (m, terms)
    slopes = -np.arange(1, _TERMS) * powers[:, :-1]
    degree = max(c.shape[0] for c in _terms()) - 1
    places = legendre.legvander(2.0 * xi, degree)  # (n, degree + 1)
    value, slope, curvature = ((places[:, : c.shape[0]] @ c).T for c in _terms())  # (terms, n)
    return powers @ value, powers @ slope, powers @ curvature, slopes @ value[1:]


def _closed(y: FloatArray, xi: FloatArray) -> tuple[FloatArray, ...]:
    """From Phi = a C + b S, C = cosh(z xi) cos(z xi), S = sinh(z xi) sin(z xi), all over exp(z / 2)."""
    z = y**0.25
    ch, sh, c, s = _parts(z, np.array(0.5))
    e = np.exp(-z)
    total = 0.25 * (2.0 * e * np.sin(z) + 1.0 - e * e)  # (sinh z + sin z) / 2, over exp(z)
    rate = 0.25 * (2.0 * e * np.cos(z) + 1.0 + e * e) / total  # its derivative by z, over it
    scale = 0.5 / (z * z * total)
    a, b = scale * (sh * c - ch * s), scale * (ch * s + sh * c)
    a_z, b_z = -a * (2.0 / z + rate) - scale * sh * s, -b * (2.0 / z + rate) + scale * ch * c
    ch, sh, c, s = _parts(z, xi)
    even, odd = ch * c, sh * s  # C, S
    even_1, odd_1 = sh * c - ch * s, ch * s + sh * c  # their derivatives, over z
    phi = a * even + b * odd
    slope = z * (a * even_1 + b * odd_1)
    curvature = 2.0 * z * z * (b * even - a * odd)
    by_z = a_z * even + b_z * odd + xi / z * slope
    chain = 0.25 * z / y  # dz / dy
    value = (0.5 * xi * xi - 1.0 / 24.0 - phi) / y
    return value, (xi - slope) / y, (1.0 - curvature) / y, -(value + chain * by_z) / y


def _parts(z: FloatArray, xi: FloatArray) -> tuple[FloatArray, ...]:
    """cosh, sinh (over exp(z / 2)), cos and sin of z xi."""
    plus, minus = np.exp(z * (xi - 0.5)), np.exp(-z * (xi + 0.5))
    half = np.tan(0.5 * z * xi)  # one function in the place of two, and of numpy's vectorised ones
    square = half * half
    below = 1.0 / (1.0 + square)
    return 0.5 * (plus + minus), 0.5 * (plus - minus), (1.0 - square) * below, 2.0 * half * below
