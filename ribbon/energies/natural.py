"""Work of the natural curvature K(s) along t_z (unidirectional), as a term of the energy density.

From the plate energy ``D/2 [(1 - nu) b:b + nu (tr b)^2]`` of the strain ``b = curvature - K e_z (x) e_z`` of a
developable surface with ``b_zz = omega``, ``tr b = omega (1 + eta^2)``, the cross term is (thesis, eq. 2.11; w << l;
docs/theory.md, eq. (2.7))::

    e(omega, eta) = -K omega (1 + nu eta^2)

The constant ``K^2 / 2`` is left out, as in the thesis.
"""

from __future__ import annotations

from numba import njit


@njit(cache=True)
def density(omega, eta, curvature, poisson, out):
    """Fills `out` (10,) with value, gradient and Hessian (layout: `ribbon.energies`); `curvature` is K at this s."""
    g = 1.0 + poisson * eta * eta
    out[0] = -curvature * omega * g
    out[1] = -curvature * g
    out[2] = -2.0 * curvature * poisson * omega * eta
    out[3] = 0.0
    out[4] = 0.0
    out[5] = -2.0 * curvature * poisson * eta
    out[6] = 0.0
    out[7] = -2.0 * curvature * poisson * omega
    out[8] = 0.0
    out[9] = 0.0
