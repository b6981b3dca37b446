"""Linear isotropic plane-stress law of the shell, dimensionless (l = 1, D = 1 per unit width).

    D = Y h^3 / (12 (1 - nu^2)) = 1 ,   so   Y = 12 (1 - nu^2) / h^3

Source: docs/theory.md, eq. (7.4) (Naghdi shell), shear factor 5/6 (Reissner).
"""

from __future__ import annotations

from typing import Any

import numpy as np

SHEAR_FACTOR = 5.0 / 6.0


def young(thickness: float, poisson: float) -> float:
    """Young's modulus Y = 12 (1 - nu^2) / h^3, units D / l^3 (per unit width D = 1)."""
    return 12.0 * (1.0 - poisson**2) / thickness**3


def stiffness_factors(thickness: float, shear_factor: float = SHEAR_FACTOR) -> tuple[float, float]:
    """(membrane, shear): membrane stiffness A = (12 / h^2) D and shear stiffness k G h without its (1 - nu).

    k = shear_factor. From G = Y / (2 (1 + nu)): k G h = k 12 (1 - nu^2) / (2 (1 + nu) h^2) = 6 k (1 - nu) / h^2. Units
    D / l^2.
    """
    membrane = 12.0 / thickness**2
    return membrane, shear_factor * membrane / 2.0


def plane_stress_rows(nu: Any) -> list[list[Any]]:
    """Plane-stress law on (11, 22, 2*12), as three rows, for D = 1; `nu` a number or a UFL constant."""
    return [[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, (1.0 - nu) / 2.0]]


def plane_stress(nu: float) -> np.ndarray:
    """The same law as an array (3, 3)."""
    return np.array(plane_stress_rows(float(nu)), dtype=float)
