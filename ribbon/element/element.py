"""Curvature element: elastic energy of one segment from (a, b, n, m), with gradient and Hessian (numba).

With omega = a s + b and eta = n s + m on [0, L] (thesis, 3.1), x = w n / 2 is constant on the segment and the densities
of Sadowsky and Wunderlich are polynomials in s of degree 6, the natural-curvature term with K linear in s one of degree
4: Gauss-Legendre with four points (exact to degree 7) integrates both exactly (thesis, 3.4.1: P and Q in closed form;
docs/theory.md, eq. (3.8)).

Energies of a free twist (codes from FREE_CODE on; `ribbon.energies.free`) are no polynomials: as many points as they
ask for, at least these, integrate them to an order beyond that of the element.

The kinematics of the element are in `ribbon.element.series`; energies and kinematics know nothing of each other.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ribbon.energies import FREE_POINTS, density, factor, free_density, natural
from ribbon.energies.names import FREE_CODE

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)
#: Gauss points and weights on [0, 1].
GAUSS_POINTS = 0.5 * (_NODES + 1.0)
GAUSS_WEIGHTS = 0.5 * _WEIGHTS

#: Of the energies of a free twist, by code: how many points, and the points and weights on [0, 1] (energies, most).
_FREE_COUNT = np.array(FREE_POINTS)
_FREE_POINTS = np.zeros((_FREE_COUNT.size, _FREE_COUNT.max()))
_FREE_WEIGHTS = np.zeros_like(_FREE_POINTS)
for _code, _count in enumerate(FREE_POINTS):
    _NODES, _WEIGHTS = np.polynomial.legendre.leggauss(_count)
    _FREE_POINTS[_code, :_count], _FREE_WEIGHTS[_code, :_count] = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS


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
def free_jet(code, q, length, k_start, k_slope, section, jet):
    """Fills `jet` (15 or 28,) with the elastic energy (D w / l) of a segment with free twist, parameters q (4 or 6,).

    kappa_1 = q_0 s + q_1, kappa_3 = q_2 s + q_3, kappa_2 = q_4 s + q_5; K(s) = k_start + k_slope s; section: w / (2 l),
    h / l, nu, plate (`ribbon.energies.free`). Layout of the jet: `ribbon.element.free_series`.
    """
    d = np.empty(15)
    jet[:] = 0.0
    six = q.size == 6
    o = 7 if six else 5  # places of second derivatives: rows a, b, n, m
    ob = o + q.size
    on = ob + q.size - 1
    om = on + q.size - 2
    code -= FREE_CODE
    for g in range(_FREE_COUNT[code]):
        s = _FREE_POINTS[code, g] * length
        w = _FREE_WEIGHTS[code, g] * length
        free_density(code, q[0] * s + q[1], q[2] * s + q[3], q[0], q[2], k_start + k_slope * s, k_slope, section, d)
        jet[0] += w * d[0]
        jet[1] += w * (s * d[1] + d[3])
        jet[2] += w * d[1]
        jet[3] += w * (s * d[2] + d[4])
        jet[4] += w * d[2]
        jet[o] += w * (s * (s * d[5] + 2.0 * d[7]) + d[12])
        jet[o + 1] += w * (s * d[5] + d[7])
        jet[o + 2] += w * (s * (s * d[6] + d[8] + d[10]) + d[13])
        jet[o + 3] += w * (s * d[6] + d[10])
        jet[ob] += w * d[5]
        jet[ob + 1] += w * (s * d[6] + d[8])
        jet[ob + 2] += w * d[6]
        jet[on] += w * (s * (s * d[9] + 2.0 * d[11]) + d[14])
        jet[on + 1] += w * (s * d[9] + d[11])
        jet[om] += w * d[9]
    if six:
        stiffness = 4.0 * (1.0 - section[2] * section[2]) * (section[0] / section[1]) ** 2
        c, e = q[4], q[5]
        first, second, third = stiffness * length, 0.5 * stiffness * length**2, stiffness * length**3 / 3.0
        jet[0] += 0.5 * (third * c * c + first * e * e) + second * c * e
        jet[5] += third * c + second * e
        jet[6] += second * c + first * e
        jet[25] += third
        jet[26] += second
        jet[27] += first


@njit(cache=True)
def elastic_jet(code, q, length, section, natural, k_start, k_slope, poisson, jet, part):
    """Fills `jet` (15 or 28,) with the elastic energy of a segment, whatever its energy; `part` (15,) is scratch."""
    if code >= FREE_CODE:
        free_jet(code, q, length, k_start, k_slope, section, jet)
        return
    bending_jet(code, q[0], q[1], q[2], q[3], length, section, jet)
    if natural:
        natural_jet(q[0], q[1], q[2], q[3], length, k_start, k_slope, poisson, part)
        jet += part


@njit(cache=True)
def elastic_value(code, q, length, section, natural, k_start, k_slope, poisson, jet):
    """Elastic energy of a segment and the part of it that is a term of its own by the natural curvature (none with a
    free twist); `jet` (15 or 28,) is scratch."""
    if code >= FREE_CODE:
        free_jet(code, q, length, k_start, k_slope, section, jet)
        return jet[0], 0.0
    bending = bending_value(code, q[0], q[1], q[2], q[3], length, section)
    if natural:
        return bending, natural_value(q[0], q[1], q[2], q[3], length, k_start, k_slope, poisson)
    return bending, 0.0
