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
from ribbon.energies.section.profile import EXTENSIBLE, FloatArray, Local, Profile, Shares
from ribbon.energies.wunderlich import SERIES_BELOW, width_factor

#: x^2 from which H is continued.
ROUNDED = 0.97
_TERMS = 18
#: Below this x^2 a few terms of H's series are all: the next of its second derivative is 3e-18 of the first.
_SMALL, _FEW = 1e-3, 8
_COEFFICIENTS = 1.0 / (2.0 * np.arange(_TERMS) + 3.0)


@njit(cache=True)
def rounded_factor(y):
    """H - 1 and its two derivatives by y = x^2 >= 0, continued beyond `ROUNDED` with continuous second derivative."""
    if y < SERIES_BELOW * SERIES_BELOW:
        f = 0.0
        d = 0.0
        e = 0.0
        for k in range((_FEW if y < _SMALL else _TERMS) - 1, -1, -1):  # (H - 1) / y: sum of y^k / (2 k + 3)
            e = e * y + 2.0 * d
            d = d * y + f
            f = f * y + _COEFFICIENTS[k]
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
def value(k, t, dk, dt, natural, slope, section):
    """The density alone."""
    return extensible.value(k, t, dk, dt, natural, slope, section) + _more(k, t, dk, dt, section)


@njit(forceinline=True)
def _softened(k, section):
    """w / 2, w^2 / (24 zeta^2) and k^2 + 1 / zeta^2."""
    half_width, thickness, nu, _ = section
    square = 4.0 * half_width * half_width
    soft = 60.0 * thickness * thickness / ((1.0 - nu * nu) * square * square)  # 1 / zeta^2
    return half_width, soft, square * soft / 24.0, k * k + soft


@njit(cache=True)
def _more(k, t, dk, dt, section):
    """What this energy has beyond `extensible`."""
    half_width, soft, warp, s = _softened(k, section)
    p = k / s
    x = half_width * (dt * p + t * dk * (soft - k * k) / (s * s))
    u = 1.0 + (t * p) ** 2
    return 0.5 * s * u * u * rounded_factor(x * x)[0] + warp * dt * dt / s


@njit(cache=True)
def _add(k, t, dk, dt, section, out):
    """Adds to `out` (15,) what this energy has beyond `extensible`, with its derivatives.

    eta = t p and x = w / 2 (p t' + p' t k') with p(k) = k / (k^2 + 1 / zeta^2), so that what is Wunderlich's is
    W(k, t) G(x), W = 1/2 (k^2 + 1 / zeta^2) (1 + eta^2)^2, G = H - 1.
    """
    half_width, soft, warp, s = _softened(k, section)
    r = 1.0 / s
    square = k * k
    p, p1, p2 = k * r, (soft - square) * r * r, 2.0 * k * (square - 3.0 * soft) * r**3
    p3 = (36.0 * soft * square - 6.0 * (soft * soft + square * square)) * r**4
    # W, by k and t
    eta, eta_k = t * p, t * p1
    u = 1.0 + eta * eta
    f, f1, f2 = u * u, 4.0 * eta * u, 4.0 + 12.0 * eta * eta
    m = 0.5 * s
    w, w_k, w_t = m * f, k * f + m * f1 * eta_k, m * f1 * p
    w_kk = f + 2.0 * k * f1 * eta_k + m * (f2 * eta_k * eta_k + f1 * t * p2)
    w_kt = k * f1 * p + m * (f2 * eta_k * p + f1 * p1)
    w_tt = m * f2 * p * p
    # x, by k, t, t' and k'
    a, b, c, d = half_width * p, half_width * p1, half_width * p2, half_width * p3
    x = dt * a + t * dk * b
    x_k, x_t, x_dk = dt * b + t * dk * c, dk * b, t * b
    h, h1, h2 = rounded_factor(x * x)
    g, g1, g2 = h, 2.0 * x * h1, 2.0 * h1 + 4.0 * x * x * h2
    wg1, wg2 = w * g1, w * g2
    out[0] += w * g + warp * dt * dt * r
    out[1] += w_k * g + wg1 * x_k - 2.0 * warp * dt * dt * k * r * r
    out[2] += w_t * g + wg1 * x_t
    out[3] += wg1 * x_dk
    out[4] += wg1 * a + 2.0 * warp * dt * r
    out[5] += w_kk * g + 2.0 * w_k * g1 * x_k + wg2 * x_k * x_k + wg1 * (dt * c + t * dk * d)
    out[5] += warp * dt * dt * (8.0 * square * r - 2.0) * r * r
    out[6] += w_kt * g + (w_k * x_t + w_t * x_k) * g1 + wg2 * x_k * x_t + wg1 * dk * c
    out[7] += w_k * g1 * x_dk + wg2 * x_k * x_dk + wg1 * t * c
    out[8] += w_k * g1 * a + wg2 * x_k * a + wg1 * b - 4.0 * warp * dt * k * r * r
    out[9] += w_tt * g + 2.0 * w_t * g1 * x_t + wg2 * x_t * x_t
    out[10] += w_t * g1 * x_dk + wg2 * x_t * x_dk + wg1 * b
    out[11] += w_t * g1 * a + wg2 * x_t * a
    out[12] += wg2 * x_dk * x_dk
    out[13] += wg2 * x_dk * a
    out[14] += wg2 * a * a + 2.0 * warp * r


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
