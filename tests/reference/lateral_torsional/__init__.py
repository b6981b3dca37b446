"""A strip on edge under its own weight beyond its lateral-torsional buckling: published numbers and laws.

B. Audoly, S. Neukirch, "A one-dimensional model for elastic ribbons: a little stretching makes a big difference",
J. Mech. Phys. Solids 153 (2021) 104457, doi:10.1016/j.jmps.2021.104457, section 4. The CSV files beside this one are
read from the vector figures that its authors publish with its source (markers to 1e-4 of an axis unit, curves to
0.005): points.csv and curves.csv (l / Leg, d / Leg), bifurcation.csv (d / l over gamma / gamma_c).

l: length, d: deflection of the free end to the side. gamma = rho w h g l^3 / (Y w h^3 / 12) = (l / Leg)^3, so that
Gamma = rho h g l^3 / D = (1 - nu^2) gamma. Leg is the authors' only fit. Their ribbons: cellulose acetate.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Leg, width, thickness (mm), Poisson's ratio of the experiments; a narrower one of the paper's.
LEG, WIDTH, THICKNESS, POISSON = 62.3, 5.10, 0.0925, 0.4
NARROW = 1.88
#: d / Leg of the paper's shell of the narrow width at l / Leg = 3.5.
NARROW_SHELL = (3.5, 1.6095)
#: The extensible curve of bifurcation.csv is for this l kappa_star, in its digits.
BIFURCATION_LK = 0.0157


def _read(name: str) -> list[list[str]]:
    with (Path(__file__).parent / name).open(newline="") as file:
        return list(csv.reader(file))[1:]


def points(kind: str) -> FloatArray:
    """(n, 2): l / Leg, d / Leg; kind "experiment" (9, mean of both mirror images) or "fem_shell" (51)."""
    return np.array([[float(row[2]), float(row[3])] for row in _read("points.csv") if row[0] == kind])


def curve(name: str) -> FloatArray:
    """(n, 2): l / Leg, d / Leg; name "extensible_1d_a5.10", "sadowsky_1d" or "linear_rod_1d"."""
    return _rising(np.array([[float(x) for x in row[1:]] for row in _read("curves.csv") if row[0] == name]))


def bifurcation(name: str) -> FloatArray:
    """(n, 2): gamma / gamma_c, d / l; name "sadowsky", "linear_rod" or "extensible_A_lk0.0157"."""
    return np.array([[float(x) for x in row[1:]] for row in _read("bifurcation.csv") if row[0] == name])


def _rising(table: FloatArray) -> FloatArray:
    return table[np.argsort(table[:, 0], kind="stable")]


def gamma_rod(poisson: float) -> float:
    """Critical gamma of the linear rod, and of the extensible ribbon."""
    return 18.178 / np.sqrt(1 + poisson)


def gamma_sadowsky(poisson: float) -> float:
    """Critical gamma of Sadowsky's ribbon."""
    return 21.491 / (1 - poisson**2)


def l_kappa_star(length: float, width: float, thickness: float, poisson: float) -> float:
    """l kappa_star = l h / (w^2 sqrt(12 (1 - nu^2))): large for a rod, small for an inextensible ribbon."""
    return float(length * thickness / (width**2 * np.sqrt(12 * (1 - poisson**2))))


def koiter(lk: float, poisson: float) -> float:
    """k of d / l = sqrt(2 / k) sqrt(gamma / gamma_c - 1) just above the critical weight, lk = l kappa_star."""
    nu = poisson
    alpha = (0.009906 + 0.03302 * nu + 0.04315 * nu**2) / (1 - nu**2)
    beta = (0.9658 + 0.2680 * nu - 0.9658 * nu**2 - 0.2680 * nu**3) / (1 - nu**2)
    return alpha / lk**2 + beta
