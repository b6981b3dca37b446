"""How a strip's frame turns along a curve that is given, held at both ends: to where bending and twist cost least.

Of the curvature vector's parts k_1, k_2 in a frame that is carried without twist, one turned on by phi about the
tangent has omega = -(k_1 cos phi - k_2 sin phi) and kappa_2 = k_2 cos phi + k_1 sin phi, and

    E[phi] = int (b omega^2 + a kappa_2^2 + c phi'^2) / 2 ds ,   dE/dphi = (b - a) omega kappa_2 - c phi''

with the stiffnesses of a rectangle's bending, of bending in its plane, and of torsion (docs/theory.md, eqs. (10.5)
and (10.18)); shapes at rest other than flat are left out. A strip much wider than thick hardly bends in its plane: a
constant twist costs (w / h)^2 times as much as it has to. What the ends are turned against each other stays, and with
it the link. A normal that is half a turn over costs no more, so that there are many minima, of which most have it turn
over where the curve is bent most: the least is looked for among angles of a grid, piece by piece (R. Bellman 1957,
Dynamic Programming), and made exact by L-BFGS.
"""

from __future__ import annotations

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon.energies.free import in_plane_stiffness
from ribbon.energies.section.rod import stiffnesses
from ribbon.problems.fields import Fields

FloatArray = NDArray[np.float64]
#: Pieces of the curve, iterations; every which abscissa the grid has, its angles in a turn, and turns to each side.
PIECES, _MOST = 400, 4000
_EVERY, _ANGLES, _TURNS = 4, 96, 1.5


def energy(phi: FloatArray, one: FloatArray, other: FloatArray, stiff: FloatArray) -> tuple[float, FloatArray]:
    """Of angles phi (n + 1,) in rad at even abscissae, with k_1 and k_2 (n + 1,), in 1 / l, there and (b, a, c) in D w:
    the energy, in D w / l, and its slope (n + 1,)."""
    h = 1.0 / (phi.size - 1)
    weight = np.full(phi.size, h)
    weight[[0, -1]] *= 0.5
    omega = -(one * np.cos(phi) - other * np.sin(phi))
    beside = other * np.cos(phi) + one * np.sin(phi)
    step = np.diff(phi)
    slope = weight * (stiff[0] - stiff[1]) * omega * beside
    slope[1:] += stiff[2] * step / h
    slope[:-1] -= stiff[2] * step / h
    bent = 0.5 * float(weight @ (stiff[0] * omega**2 + stiff[1] * beside**2))
    return bent + 0.5 * stiff[2] * float(step @ step) / h, slope


def turned(fields: Fields, one: FloatArray, other: FloatArray, angle: float) -> FloatArray:
    """The angles phi (n + 1,), in rad, from 0 to `angle`, of a strip with these fields on a curve with k_1 and k_2
    (n + 1,), in 1 / l, at even abscissae."""
    bending, torsion = stiffnesses(fields.section)
    stiff = np.array([bending, in_plane_stiffness(fields.section), torsion])
    phi = _least(one, other, angle, stiff)

    def of(inside: FloatArray) -> tuple[float, FloatArray]:
        phi[1:-1] = inside
        value, slope = energy(phi, one, other, stiff)
        return value, slope[1:-1]

    options = {"maxiter": _MOST, "maxfun": 2 * _MOST, "maxcor": 30, "ftol": 1e-13}
    phi[1:-1] = scipy.optimize.minimize(of, phi[1:-1].copy(), jac=True, method="L-BFGS-B", options=options).x
    return phi


def _least(one: FloatArray, other: FloatArray, angle: float, stiff: FloatArray) -> FloatArray:
    """Of angles on a grid beside a constant twist to `angle`, (n + 1,) in rad, those of the least energy."""
    even = np.linspace(0.0, 1.0, (one.size - 1) // _EVERY + 1)
    fine = np.linspace(0.0, 1.0, one.size)
    beside = np.arange(-round(_TURNS * _ANGLES), round(_TURNS * _ANGLES) + 1) * (2.0 * np.pi / _ANGLES)
    h, first = even[1], beside.size // 2
    step = beside[None, :] - beside[:, None] + angle * h
    twist = 0.5 * stiff[2] * step**2 / h
    k = np.stack([np.interp(even, fine, one), np.interp(even, fine, other)], axis=1)
    cost, came = np.where(np.arange(beside.size) == first, 0.0, np.inf), []
    for s, (a, b) in zip(even[1:], k[1:], strict=True):
        phi = angle * s + beside
        omega, aside = -(a * np.cos(phi) - b * np.sin(phi)), b * np.cos(phi) + a * np.sin(phi)
        every = cost[:, None] + twist
        came.append(np.argmin(every, axis=0))
        cost = every.min(axis=0) + 0.5 * h * (stiff[0] * omega**2 + stiff[1] * aside**2)
    way = [first]
    for before in reversed(came):
        way.append(int(before[way[-1]]))
    return np.asarray(angle * fine + np.interp(fine, even, beside[way[::-1]]))
