r"""When a thin plate twisted under tension wrinkles: Green's limit (A. E. Green 1937, Proc. R. Soc. Lond. A 161, 197)
and how it is approached.

Lengths in w, eta = twist w, T = tension / (E h w), eps^2 = (h/w)^2 / (12 (1 - nu^2)). The helicoid's membrane strain is
``T + eta^2 / 2 (y^2 - 1/12)``, compressive in the middle from ``eta^2 = 24 T`` on. Waves W(y) exp(i k x) with the
stress function i f(y) exp(i k x), on a surface whose only curvature is the twist (Donnell's shallow shell; survey:
J. Chopin, V. Demery and B. Davidovitch 2014, arXiv:1403.0267)::

    eps^2 (d^2 - k^2)^2 W + k^2 (T + eta^2 / 2 (y^2 - 1/12)) W - 2 eta k f' = 0 ,    (d^2 - k^2)^2 f = 2 eta k W'
    y = +-1/2:  f = f' = 0, no moment, no shear

Divided by eta^2 only d = eps / eta is left, and T / eta^2 is an eigenvalue; the helicoid wrinkles where the largest
over k is. As d -> 0 the wave is local, of the width 1/k with k^2 = q / d: with y = z sqrt(d), f = d^(3/2) g

    1/24 - T / eta^2 = c d ,    q c = min < (D^2 - q)^2 + q z^2 / 2 - 4 q D (D^2 - q)^-2 D > ,   D = d/dz

on the whole line, so that ``24 T / eta^2 = 1 - 24 c eps / eta`` and ``eta = sqrt(24 T) + 12 c eps``.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial import hermite, legendre
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.optimize import minimize_scalar

FloatArray = NDArray[np.float64]


def _jets(functions: FloatArray, at: FloatArray, order: int) -> list[FloatArray]:
    """Values and derivatives by y = x / 2 (k, points) of Legendre series (k, degree) in x."""
    return [2.0**n * legendre.legval(at, legendre.legder(functions.T, n) if n else functions.T) for n in range(order)]


def tension(d: float, k: float, poisson: float, terms: int, odd: bool = False) -> float:
    """The largest T / eta^2 at which a wave of wavenumber k is neutral, with `terms` functions of one parity across."""
    x, weight = legendre.leggauss(2 * terms + 12)
    weight = 0.5 * weight
    one = np.eye(2 * terms + 2)[int(odd) : 2 * terms : 2]
    w, w1, w2 = _jets(one, x, 3)
    bubble = legendre.poly2leg([1.0, 0.0, -2.0, 0.0, 1.0])
    other = [legendre.legmul(bubble, row) for row in np.eye(2 * terms + 2)[int(not odd) : 2 * terms : 2]]
    wide = np.zeros((len(other), 2 * terms + 6))
    for row, series in zip(wide, other, strict=True):
        row[: series.size] = series
    f, _, f2 = _jets(wide, x, 3)

    def product(a: FloatArray, b: FloatArray) -> FloatArray:
        return np.asarray((a * weight) @ b.T)

    def sides(a: FloatArray, b: FloatArray) -> FloatArray:
        both = product(a, b)
        return both + both.T

    y = 0.5 * x
    bent = product(w2, w2) - k * k * sides(w, w2) + k**4 * product(w, w)
    bent += (1.0 - poisson) * k * k * (sides(w, w2) + 2.0 * product(w1, w1))
    energy = d * d * bent + 0.5 * k * k * product(w * y * y, w)  # positive: T / eta^2 = 1 / 24 is in it
    membrane = product(f2, f2) - k * k * sides(f, f2) + k**4 * product(f, f)
    coupled = 2.0 * k * product(w1, f)
    energy += coupled @ np.linalg.solve(membrane, coupled.T)
    last = one.shape[0] - 1
    return 1.0 / 24.0 - 1.0 / float(
        eigh(k * k * product(w, w), energy, eigvals_only=True, subset_by_index=[last, last])[0]
    )  # fmt: skip


def critical(d: float, poisson: float, terms: int) -> tuple[float, float, bool]:
    """T / eta^2 below which the helicoid wrinkles, its wavenumber, and whether the wave is odd across."""
    best = (-np.inf, 0.0, False)
    for odd in (False, True):
        near = [(tension(d, float(k), poisson, terms, odd), float(k)) for k in np.geomspace(0.5, 4.0 / np.sqrt(d), 40)]
        k = max(near)[1]
        found = minimize_scalar(lambda v, odd=odd: -tension(d, v, poisson, terms, odd), bounds=(0.85 * k, 1.18 * k),
                                method="bounded", options={"xatol": 1e-9})  # fmt: skip
        best = max(best, (-float(found.fun), float(found.x), odd))
    return best


def local(d: float, poisson: float, terms: int) -> tuple[float, float]:
    """T / eta^2 and wavenumber of the even wave near the limit's own: `critical` where d is small."""
    near = np.sqrt(slope()[1] / d)
    found = minimize_scalar(lambda k: -tension(d, k, poisson, terms), bounds=(0.8 * near, 1.2 * near), method="bounded",
                            options={"xatol": 1e-6 * near})  # fmt: skip
    return -float(found.fun), float(found.x)


@cache
def slope(terms: int = 60) -> tuple[float, float]:
    """c and q of the limit, by Hermite functions and their Fourier images, in which D is i p."""

    def least(q: float) -> float:
        # in Fourier space: (p^2 + q)^2 + 4 q p^2 / (p^2 + q)^2 - q / 2 d^2/dp^2, exact on Hermite functions of p / b
        b = (0.5 * q) ** 0.25 * 1.2
        at, weight = hermite.hermgauss(2 * terms + 40)
        values = np.zeros((terms, at.size))
        values[0] = np.pi**-0.25
        if terms > 1:
            values[1] = np.sqrt(2.0) * at * values[0]
        for n in range(2, terms):
            values[n] = np.sqrt(2.0 / n) * at * values[n - 1] - np.sqrt((n - 1.0) / n) * values[n - 2]
        p2 = (b * at) ** 2
        potential = (values * weight * ((p2 + q) ** 2 + 4.0 * q * p2 / (p2 + q) ** 2)) @ values.T
        n = np.arange(terms)
        square = np.diag(n + 0.5)
        square -= 0.5 * (np.diag(np.sqrt(n[2:] * (n[2:] - 1.0)), 2) + np.diag(np.sqrt(n[2:] * (n[2:] - 1.0)), -2))
        kinetic = 0.5 * q / b**2 * square
        return float(eigh(potential + kinetic, eigvals_only=True, subset_by_index=[0, 0])[0]) / q

    found = minimize_scalar(least, bounds=(0.05, 20.0), method="bounded", options={"xatol": 1e-10})
    return float(found.fun), float(found.x)
