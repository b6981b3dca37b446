"""Curvature element: elastic energy of one segment from (a, b, n, m), with gradient and Hessian (numba).

With omega = a s + b and eta = n s + m on [0, L] (thesis, 3.1), x = w n / 2 is constant on the segment and the densities
of Sadowsky and Wunderlich are polynomials in s of degree 6, the natural-curvature term with K linear in s one of degree
4: Gauss-Legendre with four points (exact to degree 7) integrates both exactly (thesis, 3.4.1: P and Q in closed form;
docs/theory.md, eq. (3.8)).

Energies of a free twist (`ribbon.energies.codes`) are no polynomials: `ribbon.element.free_energy` integrates them.

The kinematics of the element are in `ribbon.element.series`; energies and kinematics know nothing of each other.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ribbon.element.free_energy import free_jet
from ribbon.energies import density, factor, natural
from ribbon.energies.codes import has_free_twist

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)
#: Gauss points and weights on [0, 1].
GAUSS_POINTS = 0.5 * (_NODES + 1.0)
GAUSS_WEIGHTS = 0.5 * _WEIGHTS


@njit(cache=True)
def _gather(d, weight, s, dx, jet):
    """Adds weight * density to the jet (15,) of the segment energy by (a, b, n, m) (chain rule).

    domega = s da + db, deta = s dn + dm, dx = (w/2) dn; `dx` is w/2.
    """
    e_o = weight * d[1]
    e_e = weight * d[2]
    e_x = weight * d[3]
    oo = weight * d[4]
    oe = weight * d[5]
    ox = weight * d[6]
    ee = weight * d[7]
    ex = weight * d[8]
    xx = weight * d[9]
    jet[0] += weight * d[0]
    jet[1] += s * e_o
    jet[2] += e_o
    jet[3] += s * e_e + dx * e_x
    jet[4] += e_e
    jet[5] += s * s * oo
    jet[6] += s * oo
    jet[7] += s * (s * oe + dx * ox)
    jet[8] += s * oe
    jet[9] += oo
    jet[10] += s * oe + dx * ox
    jet[11] += oe
    jet[12] += s * s * ee + 2.0 * s * dx * ex + dx * dx * xx
    jet[13] += s * ee + dx * ex
    jet[14] += ee


@njit(cache=True)
def bending_jet(code, a, b, n, m, length, section, jet):
    """Fills `jet` (15,) with the bending energy of a segment (units D w / l) and its derivatives.

    `code` is the energy's (`ribbon.energies.CODES`), `section` its cross-section's numbers
    (`ribbon.energies.SectionNumbers`), w / (2 l) the first. Layout of the jet: `ribbon.element.series`.
    """
    d = np.empty(10)
    jet[:] = 0.0
    half_width = section[0]
    for g in range(GAUSS_POINTS.size):
        s = GAUSS_POINTS[g] * length
        density(code, a * s + b, n * s + m, half_width * n, section, d)
        _gather(d, GAUSS_WEIGHTS[g] * length, s, half_width, jet)


@njit(cache=True)
def natural_jet(a, b, n, m, length, k_start, k_slope, poisson, jet):
    """Fills `jet` (15,) with the natural-curvature term of a segment (units D w / l) and its derivatives.

    K(s) = k_start + k_slope s on the segment, in units of 1 / l.
    """
    d = np.empty(10)
    jet[:] = 0.0
    for g in range(GAUSS_POINTS.size):
        s = GAUSS_POINTS[g] * length
        natural.density(a * s + b, n * s + m, k_start + k_slope * s, poisson, d)
        _gather(d, GAUSS_WEIGHTS[g] * length, s, 0.0, jet)


@njit(cache=True)
def _density_value(code, a, b, n, m, length, section):
    """Bending energy of a segment by the density alone, for energies without a shortcut in `bending_value`."""
    d = np.empty(10)
    total = 0.0
    for g in range(GAUSS_POINTS.size):
        s = GAUSS_POINTS[g] * length
        density(code, a * s + b, n * s + m, section[0] * n, section, d)
        total += GAUSS_WEIGHTS[g] * d[0]
    return total * length


@njit(cache=True)
def bending_value(code, a, b, n, m, length, section):
    """Bending energy of a segment alone (units D w / l); arguments as in `bending_jet`.

    An energy that is a multiple of Sadowsky's by x alone has its factor evaluated once.
    """
    multiple = factor(code, section[0] * n)
    if np.isnan(multiple):
        return _density_value(code, a, b, n, m, length, section)
    total = 0.0
    for g in range(GAUSS_POINTS.size):
        s = GAUSS_POINTS[g] * length
        omega = a * s + b
        u = 1.0 + (n * s + m) ** 2
        total += GAUSS_WEIGHTS[g] * 0.5 * omega * omega * u * u
    return multiple * total * length


@njit(cache=True)
def natural_value(a, b, n, m, length, k_start, k_slope, poisson):
    """Natural-curvature term of a segment alone (units D w / l); arguments as in `natural_jet`."""
    total = 0.0
    for g in range(GAUSS_POINTS.size):
        s = GAUSS_POINTS[g] * length
        eta = n * s + m
        total -= GAUSS_WEIGHTS[g] * (k_start + k_slope * s) * (a * s + b) * (1.0 + poisson * eta * eta)
    return total * length


@njit(cache=True)
def elastic_jet(code, q, length, section, natural, k_start, k_slope, poisson, rest, jet, part):
    """Fills `jet` (15 or 28,) with the elastic energy of a segment, whatever its energy; rest (4,): `free_jet`; `part`
    (15,) is scratch."""
    if has_free_twist(code):
        free_jet(code, q, length, k_start, k_slope, section, jet, rest)
        return
    bending_jet(code, q[0], q[1], q[2], q[3], length, section, jet)
    if natural:
        natural_jet(q[0], q[1], q[2], q[3], length, k_start, k_slope, poisson, part)
        jet += part


@njit(cache=True)
def elastic_value(code, q, length, section, natural, k_start, k_slope, poisson, rest, jet):
    """Elastic energy of a segment and the part of it that is a term of its own by the natural curvature (none with a
    free twist); `jet` (15 or 28,) is scratch."""
    if has_free_twist(code):
        free_jet(code, q, length, k_start, k_slope, section, jet, rest, True)
        return jet[0], 0.0
    bending = bending_value(code, q[0], q[1], q[2], q[3], length, section)
    if natural:
        return bending, natural_value(q[0], q[1], q[2], q[3], length, k_start, k_slope, poisson)
    return bending, 0.0
