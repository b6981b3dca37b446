"""Lateral-torsional buckling of a cantilever on edge with a dead force at its end, warping held at the clamp.

Of a rectangle b x h (h along the force), with I_y = h b^3 / 12, I_z = b h^3 / 12, J of St Venant's torsion and
C_w = b^3 h^3 / 144 (S. P. Timoshenko and J. M. Gere, Theory of Elastic Stability, 1961, chapters 5 and 6; V. Z. Vlasov,
Thin-walled elastic beams, 1961)::

    E C_w phi'''' - G J phi'' - P^2 (l - s)^2 / (E I_y) phi = 0 ,
    phi = phi' = 0 at the clamp,  phi'' = 0 and E C_w phi''' = G J phi' at the free end,

by Ritz's method on polynomials. Bending in its plane before it buckles shortens the lever: 1 / (E I_y) becomes
1 / (E I_y) - 1 / (E I_z), and the force is over sqrt(1 - G J / (E I_z)) (N. S. Trahair, Flexural-torsional buckling of
structures, 1993, section 2.8: pure bending, taken over).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.polynomial import Legendre, Polynomial
from scipy.linalg import eigh

DEGREE, POINTS = 14, 60


def torsion(b: float, h: float) -> float:
    """J of a rectangle b x h (St Venant's series)."""
    series = sum(math.tanh(k * math.pi * h / (2.0 * b)) / k**5 for k in range(1, 60, 2))
    return h * b**3 / 3.0 * (1.0 - 192.0 / math.pi**5 * b / h * series)


def critical(
    length: float, b: float, h: float, young: float, poisson: float, warping: bool = True, bends: bool = True
) -> np.ndarray:
    """The two lowest critical forces (2,). warping: held at the clamp, else free (C_w = 0); bends: what it bends in its
    plane before counts."""
    shear = young / (2.0 * (1.0 + poisson))
    bending, tall = young * h * b**3 / 12.0, young * b * h**3 / 12.0
    twisting, warped = shear * torsion(b, h), young * (b * h) ** 3 / 144.0 if warping else 0.0
    x, weight = np.polynomial.legendre.leggauss(POINTS)
    x, weight = 0.5 * (x + 1.0), 0.5 * weight
    held = Polynomial([0.0, 0.0, 1.0] if warping else [0.0, 1.0])
    modes = [Legendre.basis(k, domain=[0, 1]).convert(kind=Polynomial) * held for k in range(DEGREE)]
    phi, slope, curved = (np.array([mode.deriv(n)(x) if n else mode(x) for mode in modes]) for n in range(3))
    stiff = warped / length**3 * (curved * weight) @ curved.T + twisting / length * (slope * weight) @ slope.T
    lever = length**3 * (phi * weight * (1.0 - x) ** 2) @ phi.T * (1.0 / bending - (1.0 / tall if bends else 0.0))
    forces = 1.0 / np.sqrt(eigh(lever, stiff, eigvals_only=True)[::-1][:2])
    return np.asarray(forces / math.sqrt(1.0 - twisting / tall) if bends else forces)
