"""Uniform bending of a tape spring: the section alone, exact in its rotations. Nothing of `shellref` or `ribbon`.

A section of half-width a, curvature kappa(v) with normal angle phi = int_0 kappa and height zeta(v) (mean 0, zeta' =
sin phi), bent as a whole to the curvature k along (a surface of revolution of small strain). Per length, D = 1 per
width, Y = E h = 12 (1 - nu^2) / h^2, the membrane working along only:

    u = 1/2 int_-a^a [ Y (k zeta)^2 + (k cos phi)^2 + (kappa - kappa0)^2 + 2 nu (k cos phi)(kappa - kappa0) ] dv ,
    M = du/dk   at the stationary kappa

k > 0 bends as kappa0 > 0 does across, the edges shortened ("equal sense"); k < 0 is "opposite sense". With sin phi =
phi and cos phi = 1 this is the uniform law of the enriched rod (seed: Martin et al. 2017, eq. 4-8).
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre
from scipy.optimize import minimize

POINTS, WEIGHTS = legendre.leggauss(40)
FINE = np.linspace(-1.0, 1.0, 4001)


class Section:
    """Section of half-width a, thickness h, curvature kappa0; `terms` even Legendre curvatures."""

    def __init__(self, a: float, h: float, kappa0: float, nu: float, terms: int = 4, exact: bool = True):
        self.a, self.nu, self.kappa0, self.terms, self.exact = a, nu, kappa0, terms, exact
        self.membrane = 12.0 * (1.0 - nu**2) / h**2

    def _shape(self, c: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Curvature, height and cos phi at the Gauss points."""
        full = np.zeros(2 * len(c) - 1)
        full[::2] = c
        once = legendre.legint(full)
        kappa = legendre.legval(POINTS, full)
        if self.exact:
            sine = np.sin(self.a * legendre.legval(FINE, once))
            height = np.concatenate([[0.0], np.cumsum(0.5 * (sine[1:] + sine[:-1]) * np.diff(FINE))]) * self.a
            zeta, cosine = np.interp(POINTS, FINE, height), np.cos(self.a * legendre.legval(POINTS, once))
        else:
            zeta, cosine = self.a**2 * legendre.legval(POINTS, legendre.legint(once)), np.ones(len(POINTS))
        return kappa, zeta - 0.5 * (WEIGHTS @ zeta), cosine

    def energy(self, c: np.ndarray, k: float) -> float:
        """u, per length."""
        kappa, zeta, cosine = self._shape(c)
        along, across = k * cosine, kappa - self.kappa0
        bending = along**2 + across**2 + 2.0 * self.nu * along * across
        return float(0.5 * self.a * (WEIGHTS @ (self.membrane * (k * zeta) ** 2 + bending)))

    def moment(self, k: float) -> float:
        """M at the section's minimum of energy."""
        c = np.zeros(self.terms)
        c[0] = self.kappa0
        scale = self.kappa0**2 * self.a  # the energy of flattening
        found = minimize(lambda x: self.energy(x * self.kappa0, k) / scale, c / self.kappa0, method="BFGS",
                         options={"gtol": 1e-9, "maxiter": 2000})  # fmt: skip
        kappa, zeta, cosine = self._shape(found.x * self.kappa0)
        along = self.membrane * k * zeta**2 + k * cosine**2 + self.nu * cosine * (kappa - self.kappa0)
        return float(self.a * (WEIGHTS @ along))

    def stiffness(self) -> float:
        """M / k at k = 0: Y I + D 2a (1 - nu^2), I of the arc or of its parabola (I2 = 2 a^5 kappa0^2 / 45); the
        anticlastic part for a shallow section."""
        beta = self.a * self.kappa0
        if not self.exact:
            inertia = 2.0 * self.a**5 * self.kappa0**2 / 45.0
        else:
            mean = np.sin(beta) / beta
            inertia = 2.0 * self.a / self.kappa0**2 * (0.5 + np.sin(2.0 * beta) / (4.0 * beta) - mean**2)
        return self.membrane * inertia + 2.0 * self.a * (1.0 - self.nu**2)
