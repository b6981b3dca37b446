"""The strip of finite width and thickness: Audoly and Neukirch's energy, and Wunderlich's finite width.

Per length in D w / l^2 (docs/theory.md, eq. (10.12) to (10.14))::

    e = e_extensible(k, t) + (1 - psi) w^2 / 24 t'^2 + 1/2 (k^2 + 1 / zeta^2) (1 + eta^2)^2 (H(x) - 1)
    psi = k^2 / (k^2 + 1 / zeta^2) ,  eta = k t / (k^2 + 1 / zeta^2) ,  x = w eta' / 2

How the curvature along the strip varies across it: as k - y t' in a section that is soft (restrained warping), as along
the rulings of a developable surface, k / (1 + y eta'), in one that is stiff; zeta^2 = (1 - nu^2) w^4 / (60 h^2) is the
stiffness of the section against stretching at k = 0 (`ribbon.energies.sano`), so that psi tells which it is. h -> 0 is
Wunderlich's energy, k -> 0 the rod with restrained warping. Nothing is fitted.

Where rulings would meet inside the strip (|x| -> 1) Wunderlich's H is infinite; a strip that can stretch rounds that
point: from x^2 = `ROUNDED` on H goes on as its quadratic in x^2, and no bound is needed. Where k passes zero the energy
is a wall, 1 / (zeta k') long, which the rule of an element follows (`ribbon.element.free_energy`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import njit

from ribbon.energies import extensible
from ribbon.energies.energy import FreeTwist
from ribbon.energies.section.jets import COMPONENTS, product, through
from ribbon.energies.section.profile import EXTENSIBLE, FloatArray, Local, Profile, Shares
from ribbon.energies.wunderlich import SERIES_BELOW, width_factor

#: x^2 from which H is continued.
ROUNDED = 0.97
_TERMS = 18


@njit(cache=True)
def rounded_factor(y):
    """H - 1 and its two derivatives by y = x^2 >= 0, continued beyond `ROUNDED` with continuous second derivative."""
    if y < SERIES_BELOW * SERIES_BELOW:
        f = 0.0
        d = 0.0
        e = 0.0
        for k in range(_TERMS - 1, -1, -1):  # (H - 1) / y: sum of y^k / (2 k + 3)
            e = e * y + 2.0 * d
            d = d * y + f
            f = f * y + 1.0 / (2 * k + 3)
        return y * f, f + y * d, 2.0 * d + y * e
    z = math.sqrt(min(y, ROUNDED))
    h, d, e = width_factor(z)
    f0, f1, f2 = h - 1.0, 0.5 * d / z, 0.25 * (e - d / z) / (z * z)
    beyond = max(y - ROUNDED, 0.0)
    return f0 + beyond * (f1 + 0.5 * f2 * beyond), f1 + f2 * beyond, f2


@njit(cache=True)
def density(k, t, dk, dt, natural, slope, section, out):
    """Fills `out` (15,) (layout: `ribbon.energies.free`)."""
    extensible.density(k, t, dk, dt, natural, slope, section, out)
    _add(k, t, dk, dt, section, out)


@njit(cache=True)
def value(k, t, dk, dt, natural, slope, section, out):
    """Fills the first of `out` (15,) alone with what `density` gives it, to the bit."""
    extensible.density(k, t, dk, dt, natural, slope, section, out)
    out[0] += _more(k, t, dk, dt, section)


@njit(cache=True)
def _soft(section):
    """Width squared, and 1 / zeta^2."""
    half_width, thickness, nu, _ = section
    square = 4.0 * half_width * half_width
    return square, 60.0 * thickness * thickness / ((1.0 - nu * nu) * square * square)


@njit(cache=True)
def _more(k, t, dk, dt, section):
    """What this energy has beyond `extensible`: the values of `_add`, in its order."""
    square, soft = _soft(section)
    softened = k * k + soft
    inverse = 1.0 / softened
    eta = k * t * inverse
    x = dt * k + t * dk
    x -= 2.0 * (eta * k * dk)
    x = x * inverse * section[0]
    stretched, _, _ = rounded_factor(x * x)
    wound = (1.0 + eta * eta) ** 2 * stretched * softened
    return 0.5 * wound + square * soft / 24.0 * (dt * dt * inverse)


@njit(cache=True)
def _add(k, t, dk, dt, section, out):
    """Adds to `out` (15,) what this energy has beyond `extensible`."""
    square, soft = _soft(section)
    jets = np.zeros((11, COMPONENTS))
    jk, jt, jdk, jdt = jets[0], jets[1], jets[2], jets[3]
    for place, local in enumerate((k, t, dk, dt)):
        jets[place, 0], jets[place, 1 + place] = local, 1.0
    a, b, c = jets[4], jets[5], jets[6]
    softened, inverse, eta, x = jets[7], jets[8], jets[9], jets[10]
    product(jk, jk, softened)
    softened[0] += soft
    r = softened[0]
    through(softened, 1.0 / r, -1.0 / (r * r), 2.0 / (r * r * r), inverse)
    product(jk, jt, a)
    product(a, inverse, eta)
    # eta' = (k t' + t k' - 2 eta k k') / (k^2 + 1 / zeta^2)
    product(jdt, jk, a)
    product(jt, jdk, b)
    a += b
    product(eta, jk, b)
    product(b, jdk, c)
    for i in range(15):
        a[i] -= 2.0 * c[i]
    product(a, inverse, x)
    x *= section[0]
    product(x, x, a)
    f0, f1, f2 = rounded_factor(a[0])
    through(a, f0, f1, f2, b)
    product(eta, eta, a)
    through(a, (1.0 + a[0]) ** 2, 2.0 * (1.0 + a[0]), 2.0, c)
    product(b, c, a)
    product(a, softened, c)
    product(jdt, jdt, a)
    product(a, inverse, b)  # (1 - psi) t'^2 = t'^2 / (zeta^2 k^2 + 1)
    for i in range(15):
        out[i] += 0.5 * c[i] + square * soft / 24.0 * b[i]


@njit(cache=True)
def _added(k, t, dk, dt, section, out):
    """Fills `out` (m,) with what this energy has beyond `extensible` in m states."""
    for i in range(out.size):
        out[i] = _more(k[i], t[i], dk[i], dt[i], section)


def added(k: FloatArray, t: FloatArray, dk: FloatArray, dt: FloatArray, section: Sequence[float]) -> FloatArray:
    """What this energy has beyond `extensible` (m,), D w / l^2, in m states k, t, k', t', each (m,)."""
    half_width, thickness, nu, stiffness = (float(v) for v in section)
    out = np.empty(k.size)
    _added(k, t, dk, dt, (half_width, thickness, nu, stiffness), out)
    return out


def _shares(local: Local, y: FloatArray, section: Sequence[float]) -> Shares:
    """Of `extensible`, and what this energy adds, which is bending and spread with y^2 (eq. (10.16))."""
    found = EXTENSIBLE.shares(local, y, section)
    more = added(local.k, local.t, local.dk, local.dt, section)
    spread = 3.0 * (np.asarray(y, dtype=float) / section[0]) ** 2
    return Shares(found.bending + more[:, None] * spread, found.membrane, found.shear)


ENERGY = FreeTwist(
    density,
    value=value,
    needs=("thickness",),
    points=8,
    reach=0.83,
    tested=True,
    holds_twist=True,
    section=Profile(EXTENSIBLE.shape, _shares),
    words="strip of finite width and thickness: extensible, with Wunderlich's finite width where its section is stiff",
)
