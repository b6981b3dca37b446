"""The energies of free twist written a second time, in plain NumPy, and their integral by QUADPACK: no kernel of ours.

Formulas: docs/theory.md, eq. (10.2), (10.11) to (10.13), (10.17), (10.18), (2.4) with (2.7). All in D w / l^2, without
the constant K^2 / 2; w, h: over l.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import IntegrationWarning, quad

_M = np.arange(40)
_FOUR_ONE = np.array([1.0 / math.factorial(4 * m + 1) for m in _M])
_REST = np.array([0.5 / math.factorial(4 * m + 1) - 1.0 / math.factorial(4 * m + 2) for m in _M])


def gain(y: float) -> float:
    """(1/2 - g) / y of (10.2), y = z^4: quotient of the power series of g, whose terms have one sign; closed beyond."""
    if y < 1e4:
        powers = y**_M
        return float(_REST[1:] @ powers[:-1] / (_FOUR_ONE @ powers))
    z = y**0.25
    return (0.5 - (math.cosh(z) - math.cos(z)) / (z * (math.sinh(z) + math.sin(z))) if z < 300 else 0.5 - 1.0 / z) / y


def ruling(x: float) -> float:
    """H(x) - 1, from x^2 = 0.97 on its quadratic in x^2 (eq. (10.13))."""
    y = x * x
    if y < 1e-3:
        return sum(y**m / (2 * m + 1) for m in range(1, 9))
    if y <= 0.97:
        return math.atanh(abs(x)) / abs(x) - 1.0
    z = math.sqrt(0.97)
    h = math.atanh(z) / z
    first = (1.0 / (1.0 - z * z) - h) / (2.0 * z * z)  # dH / dy
    second = (1.0 / (1.0 - z * z) ** 2 - 3.0 * first) / (2.0 * z * z)
    rest = y - 0.97
    return h - 1.0 + first * rest + 0.5 * second * rest * rest


def density(name: str, strip: tuple[float, float, float], k: float, t: float, dk: float, dt: float, natural: float):
    """Energy per length of the energy `name`; strip: w, h, nu."""
    w, h, nu = strip
    b = nu * k * (k - natural) + t * t
    zeta2 = (1.0 - nu * nu) * w**4 / (60.0 * h * h) if name != "sadowsky_kt" else math.inf
    plate = 0.5 * (1.0 - nu * nu) * (k - natural) ** 2 - 0.5 * natural**2
    if name == "kirchhoff":
        n = np.arange(1, 400, 2)
        constant = 1.0 - 192.0 * h / (math.pi**5 * w) * float(np.sum(np.tanh(n * math.pi * w / (2.0 * h)) / n**5))
        return 0.5 * (k - natural) ** 2 - 0.5 * natural**2 + (1.0 - nu) * constant * t * t
    if name == "sadowsky_kt":
        return 0.5 * (k * k + t * t) ** 2 / (k * k) - natural * (k + nu * t * t / k) if k or t else 0.0
    if name == "sano":
        return plate + (1.0 - nu) * t * t + 0.5 * b * b / (1.0 / zeta2 + k * k)
    a = math.sqrt(10.0) * w / (2.0 * h)
    c4 = 180.0 * zeta2
    found = plate + (1.0 - nu) * (1.0 - math.tanh(a) / a) * t * t + c4 * b * b * gain(c4 * k * k)
    if name == "extensible":
        return found
    r = k * k + 1.0 / zeta2
    eta = k * t / r
    x = 0.5 * w * (k * dt + t * dk - 2.0 * eta * k * dk) / r
    return found + w * w / (24.0 * zeta2 * r) * dt * dt + 0.5 * r * (1.0 + eta * eta) ** 2 * ruling(x)


def integral(found: Any) -> float:
    """Elastic energy of an `Equilibrium` of free twist, D w / l, by adaptive Gauss-Kronrod rules."""
    problem = found.problem
    first, last = problem.strip.curvature
    strip = (problem.strip.relative_width, problem.strip.section[1], problem.strip.poisson)
    total, start = 0.0, 0.0
    for q, length in zip(found.parameters, problem.lengths, strict=True):

        def along(s: float, q: Any = q, start: float = start) -> float:
            k, t = q[0] * s + q[1], q[2] * s + q[3]
            here = density(problem.energy, strip, k, t, q[0], q[2], first + (last - first) * (start + s))
            if q.size == 6:
                here += 0.5 * (1.0 - strip[2] ** 2) * (strip[0] / strip[1]) ** 2 * (q[4] * s + q[5]) ** 2
            return here

        total += adaptive(along, q, length)
        start += length
    return total


def adaptive(along: Callable[[float], float], q: Any, length: float) -> float:
    """Integral of ``along`` from 0 to `length`, in pieces on which the curvature q_0 s + q_1, which may pass zero or
    come near it, changes tenfold at most (QUADPACK's extrapolation is misled by poles beside an end)."""
    ends = [0.0, length]
    if q[0]:
        decades = np.concatenate([[0.0], 10.0 ** np.arange(-7.0, 4.0)])
        places = (np.concatenate([-decades, decades]) - q[1]) / q[0]
        ends = np.unique(np.concatenate([ends, places[(places > 0.0) & (places < length)]])).tolist()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IntegrationWarning)  # rounding below the tolerance
        return sum(quad(along, a, b, epsabs=0.0, epsrel=1e-11, limit=400)[0] for a, b in pairwise(ends))
