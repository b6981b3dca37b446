"""Kirchhoff's rod of rectangular section: bending and torsion apart, whatever the width.

Per length in D w / l^2, without the constant K^2 / 2; in-plane bending (`free.in_plane_stiffness`) is a term apart
(docs/theory.md, eq. (10.18))::

    e(k, t) = 1/2 b (k - K)^2 + 1/2 c t^2 - 1/2 K^2 ,   c = G J / (D w) = 2 (1 - nu) J / (w h^3 / 3)
    J = w h^3 / 3 [1 - 192 h / (pi^5 w) sum_(n odd) tanh(n pi w / (2 h)) / n^5]

stiffness = "matched" (section[3] = 0): b = 1, the rod's Y I raised by 1 / (1 - nu^2) to the ribbon's D w, so that both
bend alike (thesis, 4.4); "plate" (section[3] = 1): b = 1 - nu^2, Y I, as a narrow plate whose section may curve across.
"""

from __future__ import annotations

import math

from numba import njit

from ribbon.energies.energy import FreeTwist
from ribbon.energies.section.profile import ROD

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


@njit(cache=True)
def density(k, t, dk, dt, natural, slope, section, out):
    """Fills `out` (15,) (layout: `ribbon.energies.free`)."""
    bending, torsion = stiffnesses(section)
    kb = k - natural
    out[:] = 0.0
    out[0] = 0.5 * bending * kb * kb - 0.5 * natural * natural + 0.5 * torsion * t * t
    out[1] = bending * kb
    out[2] = torsion * t
    out[5] = bending
    out[9] = torsion


ENERGY = FreeTwist(
    density,
    needs=("thickness",),
    in_plane=True,
    section=ROD,
    words="Kirchhoff's rod of rectangular section",
)
