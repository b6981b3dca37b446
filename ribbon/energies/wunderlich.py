"""Wunderlich's energy density: bending of a developable strip of finite width, exact in the width.

Dimensionless (D w / l^2; thesis, eq. 2.11 and 4.1, natural curvature apart), with ``x = w eta' / 2``, |x| < 1::

    e(omega, eta, x) = 1/2 omega^2 (1 + eta^2)^2 H(x) ,   H(x) = artanh(x) / x

H is the mean of ``1 / (1 + t x)`` over the width ``-1 <= t <= 1``: the curvature along a ruling falls with the distance
to the point where neighbouring rulings cross (docs/theory.md, eq. (2.2), (2.3)). Derivatives::

    H'  = (1 / (1 - x^2) - H) / x
    H'' = (2 x / (1 - x^2)^2 - 2 H') / x

lose all digits as x -> 0; below |x| = `SERIES_BELOW` the even series ``H = sum x^(2k) / (2k + 1)`` serves all three
(docs/theory.md, eq. (2.5), (2.6)).

Source: W. Wunderlich 1962; thesis, section 3.4.1, which switches to 1 + x^2/3 below 1e-5 (too late for H' and H'').
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ribbon.energies import sadowsky
from ribbon.energies.energy import EnergyDensity, FloatArray, SectionNumbers, Words

#: |x| below which H, H', H'' come from the series (0.3^36 = 1.5e-19: 18 terms reach rounding).
SERIES_BELOW = 0.3
_TERMS = 18
_COEFFICIENTS = np.array([1.0 / (2 * k + 1) for k in range(_TERMS)])


@njit(cache=True)
def width_factor(x):
    """(H, H', H'') at x = w eta' / 2; infinite from |x| = 1 on, where rulings meet."""
    if abs(x) < SERIES_BELOW:
        y = x * x
        h = 0.0
        d = 0.0
        c = 0.0
        for k in range(_TERMS - 1, -1, -1):
            h = h * y + _COEFFICIENTS[k]
        for k in range(_TERMS - 1, 0, -1):
            d = d * y + 2 * k * _COEFFICIENTS[k]
            c = c * y + 2 * k * (2 * k - 1) * _COEFFICIENTS[k]
        return h, d * x, c
    z = abs(x)
    if not z < 1.0:
        return math.inf, math.copysign(math.inf, x), math.inf
    u = (1.0 - x) * (1.0 + x)
    h = 0.5 * math.log1p(2.0 * z / (1.0 - z)) / z
    d = (1.0 / u - h) / x
    c = (2.0 * x / (u * u) - 2.0 * d) / x
    return h, d, c


@njit(cache=True)
def density(omega, eta, x, section, out):
    """Fills `out` (10,) with value, gradient and Hessian (layout: `ribbon.energies`)."""
    h, d, c = width_factor(x)
    sadowsky.density(omega, eta, x, section, out)
    out[3] = d * out[0]
    out[6] = d * out[1]
    out[8] = d * out[2]
    out[9] = c * out[0]
    out[0] *= h
    out[1] *= h
    out[2] *= h
    out[4] *= h
    out[5] *= h
    out[7] *= h


@njit(cache=True)
def factor(x):
    """H(x)."""
    return width_factor(x)[0]


def across(omega: FloatArray, eta: FloatArray, x: FloatArray, t: FloatArray, section: SectionNumbers) -> FloatArray:
    """``1/2 omega^2 (1 + eta^2)^2 / (1 + t x)``: the curvature along a ruling, where it is."""
    return np.asarray(0.5 * omega**2 * (1.0 + eta**2) ** 2 / (1.0 + t * x))


ENERGY = EnergyDensity(
    density,
    factor,
    across,
    knows_width=True,
    words=Words("finite width (Wunderlich)", "the factor H(w eta'/2)", "H = 1, not evaluated", "sadowsky"),
)
