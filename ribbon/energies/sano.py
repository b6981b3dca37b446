"""Sano and Wada's ribbon: Sadowsky's coupling of bending and twist, regularised where the curvature vanishes.

Published (T. G. Sano, H. Wada, "Twist-induced snapping in a bent elastic rod and ribbon", Phys. Rev. Lett. 2019; the
paper itself was not at hand, the form is that of public codes that cite it) is the energy of a rod, with EI and GJ its
stiffnesses, and a term that keeps it from twisting where it does not bend::

    1/2 EI k^2 + 1/2 GJ t^2 + 1/2 EI t^4 / (1 / zeta^2 + k^2) ,   zeta^2 = (1 - nu^2) w^4 / (60 h^2)

for a naturally straight ribbon; with a rod's stiffnesses it is Sadowsky's energy for wide ribbons (zeta k large) only
where nu = 0. Taken here is what holds for any nu and natural curvature K, in D w / l^2: EI = (1 - nu^2) D w and
GJ = 2 (1 - nu) D w (J = w h^3 / 3) of the rod, and the whole coupling of Sadowsky's energy regularised
(docs/theory.md, eq. (10.17))::

    e(k, t) = 1/2 (1 - nu^2) kb^2 + (1 - nu) t^2 + 1/2 B^2 / (1 / zeta^2 + k^2) - K^2 / 2 ,   B = nu k kb + t^2

kb = k - K. For nu = K = 0 it is the published one; for zeta k -> infinity Sadowsky's with (2.7), for zeta k -> 0 the
plate's helicoid, to which zeta is matched (that code takes w^4 / (120 h^2)). Without the loss of
torsion by shear, as published.
"""

from __future__ import annotations

from numba import njit

from ribbon.energies.energy import FreeTwist
from ribbon.energies.section.profile import SANO


@njit(cache=True)
def density(k, t, dk, dt, natural, slope, section, out):
    """Fills `out` (15,) (layout: `ribbon.energies.free`)."""
    half_width, thickness, nu, _ = section
    plate = 1.0 - nu * nu
    inverse = 60.0 * thickness * thickness / (plate * (2.0 * half_width) ** 4)  # 1 / zeta^2
    kb = k - natural
    b, b_k = nu * k * kb + t * t, nu * (k + kb)
    r = 1.0 / (inverse + k * k)
    r_k = -2.0 * k * r * r
    r_kk = r * r * (8.0 * k * k * r - 2.0)
    out[:] = 0.0
    out[0] = 0.5 * plate * kb * kb - 0.5 * natural * natural + (1.0 - nu) * t * t + 0.5 * b * b * r
    out[1] = plate * kb + b * b_k * r + 0.5 * b * b * r_k
    out[2] = 2.0 * t * (1.0 - nu + b * r)
    out[5] = plate + (b_k * b_k + 2.0 * nu * b) * r + 2.0 * b * b_k * r_k + 0.5 * b * b * r_kk
    out[6] = 2.0 * t * (b_k * r + b * r_k)
    out[9] = 2.0 * (1.0 - nu) + 2.0 * r * (b + 2.0 * t * t)


@njit(cache=True)
def pretwist(k, t, natural, rest, section, out):
    """Adds to `out` (15,) what a natural twist changes: (t - rest)^2 for t^2, and B = nu k kb + t^2 - rest^2."""
    half_width, thickness, nu, _ = section
    inverse = 60.0 * thickness * thickness / ((1.0 - nu * nu) * (2.0 * half_width) ** 4)
    kb = k - natural
    b, b_k = nu * k * kb + t * t, nu * (k + kb)
    r = 1.0 / (inverse + k * k)
    r_k = -2.0 * k * r * r
    r_kk = r * r * (8.0 * k * k * r - 2.0)
    less = rest * rest
    change = less * (less - 2.0 * b)  # of B^2
    out[0] += (1.0 - nu) * rest * (rest - 2.0 * t) + 0.5 * r * change
    out[1] += 0.5 * r_k * change - less * r * b_k
    out[2] -= 2.0 * (1.0 - nu) * rest + 2.0 * r * less * t
    out[5] += 0.5 * r_kk * change - 2.0 * less * (r_k * b_k + nu * r)
    out[6] -= 2.0 * less * t * r_k
    out[9] -= 2.0 * less * r


ENERGY = FreeTwist(
    density,
    pretwist=pretwist,
    needs=("thickness",),
    reach=1.0,
    section=SANO,
    words="Sano-Wada: Sadowsky's coupling of bending and twist, regularised at inflections",
)
