r"""A ribbon twisted under tension: when it leaves the helicoid (Audoly & Neukirch 2021, section 5).

Scaled as there: tau = twist / kappa*, T = tension / (D w kappa*^2), with kappa* = h / (w^2 sqrt(12 (1 - nu^2))). Of the
extensible ribbon's energy, bending stiffness and torque over twist at the helicoid (no curvature) are::

    B = 1 - nu^2 + nu tau^2 / 360 - tau^4 / 362880 ,    M / tau = 2 (1 - nu) + tau^2 / 360

Small rotations theta_1, theta_2 of the helicoid's own frame, no in-plane bending (theta_2' = -tau theta_1), have the
curvature k = theta_1' - tau theta_2 and to second order the energy (ours, from R exp([theta]))::

    E = 1/2 int [ B k^2 + M theta_2 k + T (theta_1^2 + theta_2^2) ] ds

A wave of wavenumber sqrt(x) tau gives T/2 [q (x - 1)^2 + m (x - 1) + 1 + x], q = B tau^2 / T, m = M tau / T: its
minimum over x >= 0 is the paper's f. Between clamped ends that guide (theta_1 = theta_2 = 0 there) the same E is
minimised over trigonometric polynomials.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import brentq

#: Twist (scaled) up to which critical ones are looked for: the energy is convex there.
LARGEST = 28.0
#: Functions between the clamps, and intervals of the trapezoidal rule, which is exact for them.
TERMS, POINTS = 60, 256


def scale(width: float, thickness: float, poisson: float) -> float:
    """kappa*, in one over the unit of the lengths."""
    return thickness / (width**2 * math.sqrt(12.0 * (1.0 - poisson**2)))


def stiffnesses(tau: float, poisson: float, loss: float = 0.0) -> tuple[float, float]:
    """B and M / tau at the scaled twist; loss: part of the torsion lost by transverse shear at the free edges."""
    square = tau * tau
    bending = 1.0 - poisson**2 + poisson * square / 360.0 - square**2 / 362880.0
    return bending, 2.0 * (1.0 - poisson) * (1.0 - loss) + square / 360.0


def margin(tension: float, tau: float, poisson: float) -> float:
    """f of the infinitely long ribbon: negative where the helicoid is unstable (scaled tension and twist)."""
    bending, torsion = stiffnesses(tau, poisson)
    q, m = bending * tau**2 / tension, torsion * tau**2 / tension
    return 2.0 - (0.5 * (1.0 + m)) ** 2 / q if 2.0 * q - m >= 1.0 else 1.0 - (m - q)


def critical(tension: float, poisson: float) -> float:
    """Scaled twist at which an infinitely long ribbon leaves the helicoid."""
    return float(brentq(lambda tau: margin(tension, tau, poisson), 1e-3, LARGEST, xtol=1e-12))


def between_clamps(tension: float, poisson: float, length: float, loss: float = 0.0) -> float:
    """The same between clamps that guide; length: kappa* l; loss: as in `stiffnesses`."""
    return float(brentq(lambda tau: _lowest(tension, tau, poisson, length, loss), 1e-3, LARGEST, xtol=1e-10))


def _lowest(tension: float, tau: float, poisson: float, length: float, loss: float) -> float:
    """Lowest eigenvalue of E over int theta_2^2 between clamps: theta_2 in cos((n - 1) pi s) - cos((n + 1) pi s)."""
    s = np.linspace(0.0, 1.0, POINTS + 1)
    weights = np.full(s.size, 1.0 / POINTS)
    weights[[0, -1]] *= 0.5
    n = np.arange(1, TERMS + 1)[:, None]
    low, high = (n - 1) * np.pi, (n + 1) * np.pi
    second = np.cos(low * s) - np.cos(high * s)
    slope = high * np.sin(high * s) - low * np.sin(low * s)
    bend = high**2 * np.cos(high * s) - low**2 * np.cos(low * s)
    first, curvature = -slope / (tau * length), -bend / (tau * length**2) - tau * second
    bending, torsion = stiffnesses(tau, poisson, loss)

    def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return (a * weights) @ b.T

    cross = product(second, curvature)
    energy = bending * product(curvature, curvature) + 0.5 * torsion * tau * (cross + cross.T)
    energy += tension * (product(first, first) + product(second, second))
    return float(eigh(energy, product(second, second), eigvals_only=True, subset_by_index=(0, 0))[0])
