"""Planar elasticas whose ends come together, by shooting: the half figure of eight, the teardrop, the ring
pinched between two points. NumPy and SciPy; no code is shared with any solver of the package.

A strip of length 1 and bending stiffness 1 begins at the origin, its angle theta from x, under the force R at s = 1::

    x' = cos theta ,   y' = sin theta ,   theta' = k ,   k' = R_x sin theta - R_y cos theta ,
    area' = (x y' - y x') / 2 ,   energy' = k^2 / 2 .
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root
from scipy.special import ellipe, ellipk

FloatArray = NDArray[np.float64]


class Loop(NamedTuple):
    """force (2,) at s = 1; area between the strip and its chord; energy."""

    force: FloatArray
    area: float
    energy: float


def walked(begin: FloatArray, force: FloatArray, low: float, high: float) -> FloatArray:
    """State (x, y, theta, k, area, energy) at `high`."""

    def rate(_: float, u: FloatArray) -> list[float]:
        x, y, a, k, _, _ = u
        c, s = np.cos(a), np.sin(a)
        return [c, s, k, force[0] * s - force[1] * c, 0.5 * (x * s - y * c), 0.5 * k * k]

    return np.asarray(solve_ivp(rate, (low, high), begin, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1])


def _begun(theta: float, k: float) -> FloatArray:
    return np.array([0.0, 0.0, theta, k, 0.0, 0.0])


def _root(missed: object, guess: list[float]) -> FloatArray:
    found = root(missed, guess, tol=1e-12)
    if not np.abs(found.fun).max() < 1e-9:
        raise ValueError(found.message)
    return np.asarray(found.x)


def eight() -> tuple[float, float]:
    """Angle (rad) and force of a strut hinged at both ends when these meet: E(m) / K(m) = 1/2, P = 4 K(m)^2."""
    m = brentq(lambda m: 2.0 * ellipe(m) - ellipk(m), 0.5, 0.99, xtol=1e-15)
    return float(2.0 * np.arcsin(np.sqrt(m))), float(4.0 * ellipk(m) ** 2)


def half_eight() -> Loop:
    """The same by its shape: hinged at the origin at both ends, turning to the left."""
    angle, force = eight()
    end = walked(_begun(-angle, 0.0), np.array([-force, 0.0]), 0.0, 1.0)
    if np.abs(end[:2]).max() > 1e-8:
        raise ValueError(f"the ends stand {end[:2]} apart")
    return Loop(np.array([-force, 0.0]), float(end[4]), float(end[5]))


def pinched(height: float) -> Loop:
    """Half of a ring whose poles are pinched together to a distance, 0 (they meet: a teardrop) to 2 / pi (a circle):
    from one pole along x to the other, back along x; half of it up to theta = pi/2 at half the height."""

    def end(v: FloatArray) -> FloatArray:
        return walked(_begun(0.0, v[0]), np.array([0.0, v[1]]), 0.0, 0.5)

    guess, at = [np.pi, 0.0], 2.0 / np.pi
    for h in np.linspace(at, height, 13)[1:]:
        guess = list(_root(lambda v, h=h: [end(v)[2] - 0.5 * np.pi, end(v)[1] - 0.5 * h], guess))
    half = end(np.array(guess))
    # the other half mirrored; what is between both halves and the axis of the poles
    area = 2.0 * (half[4] + 0.5 * half[0] * (0.5 * height - half[1])) + 0.5 * height * half[0]
    return Loop(np.array([0.0, guess[1]]), float(area), float(2.0 * half[5]))
