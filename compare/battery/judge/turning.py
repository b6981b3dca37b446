"""Where an elastica between two level clamps, one of them shifted aside, turns over into its mirror image: by shooting.

With theta'' = p_y cos theta - p_x sin theta, theta(0) = 0 and int (1 - cos theta) ds = 1 - d, d the distance along
the clamps, the wave between them has theta(s) = theta(1 - s). Another equilibrium begins where some v, not zero, with
v(s) = - v(1 - s), has

    v'' = -(p_y sin theta + p_x cos theta) v ,    v(0) = v(1/2) = 0

(what holds the end then takes no other force, and int sin theta v = int cos theta v = 0 by symmetry). Half the strip is
integrated (`solve_ivp`): theta'(1/2) = 0, half the slack, v(1/2) = 0 for theta'(0), p_x and p_y. Of small slopes:
shift^2 = 4 (1 - d) / 3, p_x = 4 pi^2. Lengths in l, forces in D w / l^2.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import root

Array = NDArray[np.float64]

#: Tolerance of the integration.
_EXACT = 1e-13


def _half(moment: float, px: float, py: float) -> Array:
    """theta, theta', int (1 - cos theta), int sin theta, v and v' at s = 1/2."""

    def rates(s: float, u: Array) -> list[float]:
        cos, sin = math.cos(u[0]), math.sin(u[0])
        return [
            u[1], py * cos - px * sin, 2.0 * math.sin(0.5 * u[0]) ** 2, sin, u[5], -(py * sin + px * cos) * u[4],
        ]  # fmt: skip

    first = [0.0, moment, 0.0, 0.0, 0.0, 1.0]
    found: Array = solve_ivp(rates, (0.0, 0.5), first, method="DOP853", rtol=_EXACT, atol=1e-20).y[:, -1]
    return found


def turning(short: float) -> float:
    """The shift (l) at which it does, clamps 1 - short (l) apart. Raises ArithmeticError where it is not found."""
    size = math.sqrt(short)

    def missed(x: Array) -> list[float]:
        end = _half(size * x[0], x[1], size * x[2])
        return [end[1] / size, 2.0 * end[2] / short - 1.0, end[4]]

    start = np.array([0.0, 4.0 * math.pi**2, 4.0 * math.pi**2 * math.sqrt(4.0 / 3.0)])
    found = root(missed, start, method="hybr", options={"xtol": 1e-14})
    if not np.abs(missed(found.x)).max() < 1e-11:
        raise ArithmeticError(f"turning({short}): {found.message}")
    return 2.0 * float(_half(size * found.x[0], found.x[1], size * found.x[2])[3])
