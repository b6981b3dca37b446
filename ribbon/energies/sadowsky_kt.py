"""Sadowsky's energy in curvature k and twist t, free of each other: no ruling, so no bound on it either.

Dimensionless (D w / l^2), with natural curvature K (docs/theory.md, eq. (2.4) and (2.7) with eta = t / k)::

    e(k, t) = 1/2 (k^2 + t^2)^2 / k^2 - K (k + nu t^2 / k)

It has no value where k = 0 and t != 0 (infinite), so that a line search backs off; at k = t = 0 it is the limit t = 0.
"""

from __future__ import annotations

import math

from numba import njit

from ribbon.energies.energy import FreeTwist
from ribbon.energies.section.profile import SADOWSKY


@njit(cache=True)
def density(k, t, dk, dt, natural, slope, section, out):
    """Fills `out` (15,) (layout: `ribbon.energies.free`)."""
    nu = section[2]
    out[:] = 0.0
    if k == 0.0:
        if t != 0.0:
            out[:] = math.inf
            return
        eta = 0.0
        inverse = 0.0
    else:
        eta = t / k
        inverse = 1.0 / k
    square = eta * eta
    out[0] = 0.5 * k * k * (1.0 + square) ** 2 - natural * k * (1.0 + nu * square)
    out[1] = k * (1.0 - square * square) - natural * (1.0 - nu * square)
    out[2] = 2.0 * t * (1.0 + square) - 2.0 * natural * nu * eta
    out[5] = 1.0 + 3.0 * square * square - 2.0 * natural * nu * square * inverse
    out[6] = -4.0 * eta * square + 2.0 * natural * nu * eta * inverse
    out[9] = 2.0 + 6.0 * square - 2.0 * natural * nu * inverse


ENERGY = FreeTwist(
    density,
    reach=0.0,
    section=SADOWSKY,
    words="Sadowsky's energy in curvature and twist, without rulings",
)
