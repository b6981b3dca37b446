r"""Closed forms of the planar elastica by elliptic integrals, and its initial value problem in many digits.

Classical (A. E. H. Love, A Treatise on the Mathematical Theory of Elasticity, 4th ed., 1927, sections 262-263). With
phi the angle from the line of thrust, phi'' = -P sin phi; on the arc from an inflexion (phi' = 0, phi = alpha) to the
section where phi = 0, k = sin(alpha / 2)::

    arc sqrt(P) = K(k) ,   distance along the thrust = (2 E(k) - K(k)) / sqrt(P) ,   across = 2 k / sqrt(P)
"""

from __future__ import annotations

import math

import mpmath
from scipy.special import ellipe, ellipk


def quarter(alpha: float) -> tuple[float, float, float]:
    """sqrt(P) of a quarter wave of length 1 that ends at the angle alpha, its reach along and across the thrust."""
    m = math.sin(0.5 * alpha) ** 2
    root = float(ellipk(m))
    return root, 2.0 * float(ellipe(m)) / root - 1.0, 2.0 * math.sqrt(m) / root


def buckled_cantilever(alpha: float) -> tuple[float, float, float]:
    """Load P and end (x, y) of an upright-along-x clamped-free strut pushed along -x, from its tip angle alpha."""
    root, along, across = quarter(alpha)
    return root**2, along, across


def buckled_pinned(alpha: float) -> tuple[float, float]:
    """Load P and end distance of a pinned-pinned strut in its first mode, from its end angle alpha: two quarters."""
    root, along, _ = quarter(alpha)
    return 4.0 * root**2, along


def buckled_clamped(alpha: float) -> tuple[float, float]:
    """Load P and end distance of a clamped-clamped strut in its first mode, from its largest angle: four quarters."""
    root, along, _ = quarter(alpha)
    return 16.0 * root**2, along


def transverse_cantilever(tip: float) -> tuple[float, float, float]:
    """Load P across a horizontal cantilever with tip angle 0 < tip < pi/2 (downwards), and its end (x, drop).

    (theta'^2) / 2 = P (sin tip - sin theta); incomplete integrals in place of elliptic ones, by mpmath to 25 digits.
    """
    with mpmath.workdps(25):
        upper = mpmath.sqrt(mpmath.mpf(tip))

        def integral(f):
            """int f dtheta / sqrt(2 (sin tip - sin theta)), with theta = tip - u^2 against the root at the tip."""

            def rate(u):
                # sin tip - sin theta = 2 cos(tip - u^2 / 2) sin(u^2 / 2)
                fall = 2 * mpmath.cos(tip - u**2 / 2) * mpmath.sin(u**2 / 2)
                return f(tip - u**2) * (2 * u / mpmath.sqrt(2 * fall) if u else mpmath.sqrt(2 / mpmath.cos(tip)))

            return mpmath.quad(rate, [0, upper / 2, upper])

        root = integral(lambda _: mpmath.mpf(1))
        return float(root**2), float(integral(mpmath.cos) / root), float(integral(mpmath.sin) / root)


def heavy_cantilever(gamma: float, digits: int | None = None) -> tuple[float, float]:
    """End (x, drop) of a horizontal cantilever under its weight; digits None: doubles, else mpmath with so many.

    Shooting from the free end by Taylor series of the equation, psi'' = Gamma sigma sin psi in sigma = 1 - s, with
    psi the angle from the vertical, psi'(0) = 0. The unknown is log psi(0): under a large Gamma the end hangs down to
    within exp(-2/3 sqrt(Gamma)), and everything stays relative to that.
    """
    lib = math if digits is None else mpmath
    with mpmath.workdps(digits or 15):
        number = float if digits is None else mpmath.mpf
        g, right = number(gamma), number(lib.pi) / 2
        tolerance = 2e-14 if digits is None else mpmath.mpf(10) ** (-digits + 3)

        def miss(q):
            return _fall(g, lib.exp(q), lib)[0] - right

        low = -2 * lib.sqrt(g) / 3 - 3
        below = miss(low)
        assert below < 0
        high, above = low, below
        while above <= 0:  # up to where the clamp's angle is passed
            low, below, high = high, above, min(high + number(1) / 2, lib.log(right))
            above = miss(high)
            if high == lib.log(right):
                break
        for _ in range(200):  # regula falsi, Illinois
            middle = (low * above - high * below) / (above - below)
            value = miss(middle)
            if abs(value) <= tolerance or abs(high - low) <= tolerance:
                break
            if value * above < 0:
                low, below = high, above
            else:
                below /= 2
            high, above = middle, value
        _, x, y = _fall(g, lib.exp(middle), lib)
        return float(x), float(y)


def _fall(g, gap, lib, terms: int = 26):
    """psi, int sin psi and int cos psi at sigma = 1, from psi = gap and psi' = 0 at sigma = 0."""
    psi, slope, sigma = gap, 0 * gap, 0 * gap
    x, y = 0 * gap, 0 * gap
    while sigma < 1:
        # a fifth of the distance to the nearest pole of the pendulum in the clamp's layer, of width Gamma^-1/2
        step = min(1 - sigma, 1 / (3 * lib.sqrt(1 + g * (sigma + 0.05))))
        a, s, c = [psi, slope], [lib.sin(psi)], [lib.cos(psi)]  # psi = sum a_k h^k
        for k in range(terms):
            load = sigma * s[k] + (s[k - 1] if k > 0 else 0)
            a.append(g * load / ((k + 1) * (k + 2)))
            s.append(sum((j + 1) * a[j + 1] * c[k - j] for j in range(k + 1)) / (k + 1))
            c.append(-sum((j + 1) * a[j + 1] * s[k - j] for j in range(k + 1)) / (k + 1))
        powers = [step**k for k in range(terms + 2)]
        x += sum(s[k] * powers[k + 1] / (k + 1) for k in range(terms + 1))
        y += sum(c[k] * powers[k + 1] / (k + 1) for k in range(terms + 1))
        psi = sum(a[k] * powers[k] for k in range(terms + 2))
        slope = sum(k * a[k] * powers[k - 1] for k in range(1, terms + 2))
        sigma += step
    return psi, x, y
