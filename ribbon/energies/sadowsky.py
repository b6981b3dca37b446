"""Sadowsky's energy density: bending of a developable strip whose rulings stay nearly parallel.

Dimensionless (D w / l^2; thesis, eq. 2.12 without its natural-curvature term, which is `ribbon.energies.natural`)::

    e(omega, eta) = 1/2 omega^2 (1 + eta^2)^2

Source: M. Sadowsky 1930; in this form thesis, eq. 2.12 and 4.2; docs/theory.md, eq. (2.4).
"""

from __future__ import annotations

from numba import njit

from ribbon.energies.energy import EnergyDensity


@njit(cache=True)
def density(omega, eta, x, section, out):
    """Fills `out` (10,) with value, gradient and Hessian (layout: `ribbon.energies`)."""
    u = 1.0 + eta * eta
    f = u * u
    f_1 = 4.0 * eta * u
    f_2 = 4.0 * u + 8.0 * eta * eta
    half = 0.5 * omega * omega
    out[0] = half * f
    out[1] = omega * f
    out[2] = half * f_1
    out[3] = 0.0
    out[4] = f
    out[5] = omega * f_1
    out[6] = 0.0
    out[7] = half * f_2
    out[8] = 0.0
    out[9] = 0.0


@njit(cache=True)
def factor(x):
    """One, whatever the width."""
    return 1.0


ENERGY = EnergyDensity(density, factor)
