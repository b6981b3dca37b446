"""Audoly and Neukirch's energy: a strip of finite thickness, whose section curves and stretches across.

Per length in D w / l^2, curvature k and twist t times l free of each other, kb = k - K, B = nu k kb + t^2, without the
constant K^2 / 2 (docs/theory.md, eq. (10.11))::

    e(k, t) = 1/2 (1 - nu^2) kb^2 + (1 - nu) (1 - q) t^2 + c4 B^2 phi(c4 k^2) - K^2 / 2 ,   c4 = 3 (1 - nu^2) w^4 / h^2

phi is `relaxed.gain`, smooth and even in k; q the loss of torsion by transverse shear at the free edges.

Source: B. Audoly, S. Neukirch 2021, "A one-dimensional model for elastic ribbons: a little stretching makes a big
difference"; the natural curvature and q are ours (docs/theory.md, chapter 10).
"""

from __future__ import annotations

from numba import njit

from ribbon.energies.energy import FreeTwist
from ribbon.energies.section.profile import EXTENSIBLE
from ribbon.energies.section.relaxed import gain, torsion_loss


@njit(cache=True)
def density(k, t, dk, dt, natural, slope, section, out):
    """Fills `out` (15,) (layout: `ribbon.energies.free`)."""
    half_width, thickness, poisson, _ = section
    width = 2.0 * half_width
    plate = 1.0 - poisson * poisson
    c4 = 3.0 * plate * width**4 / (thickness * thickness)
    kb = k - natural
    phi, first, second = gain(c4 * k * k)
    by_k = 2.0 * c4 * k * first  # phi's derivatives by k
    by_kk = 2.0 * c4 * (first + 2.0 * c4 * k * k * second)
    b = poisson * k * kb + t * t
    b_k = poisson * (k + kb)
    twist = (1.0 - poisson) * (1.0 - torsion_loss(width, thickness))
    out[:] = 0.0
    out[0] = 0.5 * plate * kb * kb - 0.5 * natural * natural + twist * t * t + c4 * b * b * phi
    out[1] = plate * kb + c4 * b * (2.0 * b_k * phi + b * by_k)
    out[2] = 2.0 * twist * t + 4.0 * c4 * b * t * phi
    out[5] = plate + c4 * (2.0 * (b_k * b_k + 2.0 * poisson * b) * phi + 4.0 * b * b_k * by_k + b * b * by_kk)
    out[6] = 4.0 * c4 * t * (b_k * phi + b * by_k)
    out[9] = 2.0 * twist + 4.0 * c4 * phi * (b + 2.0 * t * t)


@njit(cache=True)
def value(k, t, dk, dt, natural, slope, section):
    """The density alone."""
    half_width, thickness, poisson, _ = section
    width = 2.0 * half_width
    plate = 1.0 - poisson * poisson
    c4 = 3.0 * plate * width**4 / (thickness * thickness)
    kb = k - natural
    b = poisson * k * kb + t * t
    twist = (1.0 - poisson) * (1.0 - torsion_loss(width, thickness))
    return 0.5 * plate * kb * kb - 0.5 * natural * natural + twist * t * t + c4 * b * b * gain(c4 * k * k)[0]


@njit(cache=True)
def pretwist(k, t, natural, rest, section, out):
    """Adds to `out` (15,) what a natural twist changes: (t - rest)^2 for t^2, and B = nu k kb + t^2 - rest^2."""
    half_width, thickness, poisson, _ = section
    width = 2.0 * half_width
    c4 = 3.0 * (1.0 - poisson * poisson) * width**4 / (thickness * thickness)
    kb = k - natural
    phi, first, second = gain(c4 * k * k)
    by_k = 2.0 * c4 * k * first
    by_kk = 2.0 * c4 * (first + 2.0 * c4 * k * k * second)
    b = poisson * k * kb + t * t
    b_k = poisson * (k + kb)
    twist = (1.0 - poisson) * (1.0 - torsion_loss(width, thickness))
    less = rest * rest
    change = less * (less - 2.0 * b)  # of B^2
    out[0] += twist * rest * (rest - 2.0 * t) + c4 * phi * change
    out[1] += c4 * (by_k * change - 2.0 * less * phi * b_k)
    out[2] -= 2.0 * twist * rest + 4.0 * c4 * phi * less * t
    out[5] += c4 * (by_kk * change - 4.0 * less * (by_k * b_k + poisson * phi))
    out[6] -= 4.0 * c4 * less * t * by_k
    out[9] -= 4.0 * c4 * less * phi


ENERGY = FreeTwist(
    density,
    value=value,
    pretwist=pretwist,
    needs=("thickness",),
    reach=0.83,
    section=EXTENSIBLE,
    words="extensible strip (Audoly-Neukirch): the section curves and stretches across",
)
