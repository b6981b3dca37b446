"""Stiffnesses of a rod of rectangular section (docs/theory.md, eq. (10.18)), for compiled kernels."""

from __future__ import annotations

import math

from numba import njit

_ALL = 31.0 / 32.0 * 1.0369277551433699263  # sum of 1 / n^5 over odd n: 31/32 zeta(5)


@njit(cache=True)
def torsion_constant(width, thickness):
    """J over w h^3 / 3 of a rectangle w x h, lengths alike."""
    ratio = width / thickness
    total = _ALL
    n = 1
    while n * ratio < 13.0:  # 1 - tanh(pi n w / (2 h)) < 2 exp(-pi 13)
        total -= (1.0 - math.tanh(0.5 * math.pi * n * ratio)) / n**5
        n += 2
    return 1.0 - 192.0 / math.pi**5 / ratio * total


@njit(cache=True)
def stiffnesses(section):
    """(b, c): stiffness of bending and of torsion in D w."""
    half_width, thickness, nu, plate = section
    bending = 1.0 - nu * nu if plate != 0.0 else 1.0
    return bending, 2.0 * (1.0 - nu) * torsion_constant(2.0 * half_width, thickness)
