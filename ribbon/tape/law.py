"""Uniform bending of a tape: its moment M(k), the greatest one, the plateau where two curvatures stand side by side.

With kappa independent of s and no axial force, e^r = 0, and the energy per length over D w is

    u(k) = min over kappa of  1/2 [ (A/D) k^2 <z^2> + k^2 + <(kappa - kappa0)^2> - 2 nu k <kappa - kappa0> ],
    M = du/dk = (A/D) k <z^2> + k - nu <kappa - kappa0>.

Legendre terms: a linear system. Exact section: z'''' + 4 m^4 z = 0 with 4 m^4 = (A/D) k^2, and at the free edges
z'' = kappa0 + nu k, z''' = 0; so z = b cosh(m v) cos(m v) + c sinh(m v) sin(m v), and <z> = 0 by itself.
k > 0 stretches the edges where kappa0 > 0 (opposite sense).

Maxwell: u(k2) - u(k1) = M (k2 - k1), M = M(k1) = M(k2).
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.optimize import brentq, minimize_scalar

from ribbon.tape.section import FloatArray, Section

Law = Callable[[float], tuple[float, float]]
"""k -> (u, M)."""

HALF_SECTION = 80
"""Gauss points on half of an exact section, whose z has layers at the edges."""


def uniform_section(section: Section, k: float) -> FloatArray:
    """kappa^i (terms,) of the section under the curvature k, without axial force."""
    mass, square = section.matrices
    right = mass @ section.rest
    right[0] += section.poisson * k
    return np.linalg.solve(mass + section.stretching * k * k * square, right)


def uniform(section: Section, k: float) -> tuple[float, float]:
    """u (D w / l^2) and M (D w / l) under the curvature k (1/l) of the section with its Legendre terms."""
    mass, square = section.matrices
    kappa = uniform_section(section, k)
    d = kappa - section.rest
    zz = section.stretching * float(kappa @ square @ kappa)
    nu = section.poisson
    energy = 0.5 * (k * k * zz + k * k + float(d @ mass @ d)) - nu * k * d[0]
    return energy, k * zz + k - nu * float(d[0])


def exact_profile(section: Section, k: float) -> Callable[[FloatArray], tuple[FloatArray, FloatArray]]:
    """z and z'' of the section that is free to take any shape, as a function of v, under the curvature k."""
    nu, a = section.poisson, section.half
    edge = section.curvature + nu * k
    if k == 0.0:
        return lambda v: (0.5 * edge * (v * v - a * a / 3.0), np.full_like(v, edge))
    m = (0.25 * section.stretching * k * k) ** 0.25
    ch, sh, co, si = np.cosh(m * a), np.sinh(m * a), np.cos(m * a), np.sin(m * a)
    # z'' = 2 m^2 (c cosh cos - b sinh sin), z''' = 2 m^3 (c (sinh cos - cosh sin) - b (cosh sin + sinh cos))
    rows = np.array([[-sh * si, ch * co], [-(ch * si + sh * co), sh * co - ch * si]])
    b, c = np.linalg.solve(rows, np.array([edge / (2.0 * m * m), 0.0]))

    def profile(v: FloatArray) -> tuple[FloatArray, FloatArray]:
        even, odd = np.cosh(m * v) * np.cos(m * v), np.sinh(m * v) * np.sin(m * v)
        return b * even + c * odd, 2.0 * m * m * (c * even - b * odd)

    return profile


def exact(section: Section, k: float) -> tuple[float, float]:
    """u and M under the curvature k of the section that is free to take any shape; its `terms` are not used."""
    profile, a, nu = exact_profile(section, k), section.half, section.poisson

    t, weight = _points()
    z, bend = profile(0.5 * a * (t + 1.0))
    weight = 0.5 * weight
    zz = section.stretching * float(weight @ z**2)
    d = float(weight @ bend) - section.curvature
    dd = float(weight @ (bend - section.curvature) ** 2)
    return 0.5 * (k * k * zz + k * k + dd) - nu * k * d, k * zz + k - nu * d


@functools.cache
def _points() -> tuple[FloatArray, FloatArray]:
    return leggauss(HALF_SECTION)


@dataclass(frozen=True)
class Plateau:
    """moment: of both curvatures, D w / l; low, high: the curvatures of the unfolded part and of the fold, 1/l."""

    moment: float
    low: float
    high: float

    @property
    def radius(self) -> float:
        """Radius of the fold, l."""
        return 1.0 / abs(self.high)


def greatest(law: Law, high: float) -> tuple[float, float]:
    """Moment at the first limit point of uniform bending and the curvature there; high: a curvature well into the fold,
    with its sign. Raises ValueError where the moment only grows."""
    # a coarse look for the first fall, then the maximum between its neighbours
    grid = np.geomspace(1e-4, 1.0, 150) * high
    moments = np.abs([law(float(k))[1] for k in grid])
    falls = np.flatnonzero(np.diff(moments) < 0.0)
    if not falls.size or falls[0] == 0:
        raise ValueError("the moment has no maximum: the section is too flat for a fold")
    low, top = sorted((float(grid[falls[0] - 1]), float(grid[falls[0] + 1])))
    k = float(minimize_scalar(lambda k: -abs(law(k)[1]), bounds=(low, top), options={"xatol": 1e-13}).x)
    return law(k)[1], k


def plateau(law: Law, high: float) -> Plateau:
    """Where the unfolded tape and a fold stand side by side (Maxwell); high: about the fold's curvature, signed."""
    sign = float(np.sign(high))

    def turned(k: float) -> tuple[float, float]:
        energy, moment = law(sign * k)
        return energy, sign * moment

    top, peak = greatest(turned, 2.0 * abs(high))
    valley = float(minimize_scalar(lambda k: turned(k)[1], bounds=(peak, 2.0 * abs(high)), options={"xatol": 1e-9}).x)
    bottom = max(turned(valley)[1], 0.0)

    def curvatures(moment: float) -> tuple[float, float]:
        low = brentq(lambda k: turned(k)[1] - moment, 0.0, peak, xtol=1e-15, rtol=1e-14)
        return float(low), float(brentq(lambda k: turned(k)[1] - moment, valley, 1e3 * valley, xtol=1e-13, rtol=1e-14))

    def gap(moment: float) -> float:
        low, far = curvatures(moment)
        return turned(far)[0] - turned(low)[0] - moment * (far - low)

    inside = 1e-9 * (top - bottom)
    moment = float(brentq(gap, bottom + inside, top - inside, xtol=1e-14, rtol=1e-14))
    low, far = curvatures(moment)
    return Plateau(sign * moment, sign * low, sign * far)
