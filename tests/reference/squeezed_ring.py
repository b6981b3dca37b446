r"""A ring between two frictionless plates, an elastica, by shooting: force, energy, where it touches. NumPy and SciPy.

A closed strip of length 1 without thickness, naturally flat or a circle (the closure makes both the same), symmetric up
and down and to both sides. From the lower plate, s = 0 the first place that is off it, theta the tangent's angle,

    theta' = kappa ,  kappa' = (P/2) cos theta ,  x' = cos theta ,  y' = sin theta

in units of l and D w: at the sides, theta = pi/2, the section carries P/2 and no horizontal force. A quarter is l/4
long and H/2 high. Where the ring touches at one place kappa(0) > 0 is free; from kappa(0) = 0 on it is flat on both
plates along 2 a, where no force acts (the plates push at the ends of what is flat alone), and a is free.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

_EXACT = {"rtol": 1e-11, "atol": 1e-12, "method": "DOP853"}


class Squeezed(NamedTuple):
    """force: of a plate, D w / l^2; energy: int kappa^2 / 2 ds, D w / l; flat: half length on a plate, l."""

    force: float
    energy: float
    flat: float


def quarter(force: float, first: float) -> tuple[float, float, float]:
    """(length, height, energy) of the arc from theta = 0 with curvature `first` to the first theta = pi/2."""

    def rates(_: float, u: np.ndarray) -> list[float]:
        theta, kappa = u[0], u[1]
        return [kappa, 0.5 * force * np.cos(theta), np.sin(theta), 0.5 * kappa**2]

    def upright(_: float, u: np.ndarray) -> float:
        return float(u[0] - 0.5 * np.pi)

    upright.terminal = True  # type: ignore[attr-defined]
    found = solve_ivp(rates, (0.0, 10.0), [0.0, first, 0.0, 0.0], events=upright, **_EXACT)
    length = float(found.t[-1])
    return length, float(found.y[2, -1]), float(found.y[3, -1])


def spreads() -> tuple[float, float]:
    """(force, gap) from which on the ring is flat on the plates: kappa(0) = 0 and a quarter is free."""
    force = brentq(lambda p: quarter(p, 0.0)[0] - 0.25, 50.0, 200.0, xtol=1e-12)
    return float(force), 2.0 * quarter(force, 0.0)[1]


def squeezed(gap: float) -> Squeezed:
    """The ring between plates `gap` apart, 0 < gap < 1 / pi."""
    most, last = spreads()
    if gap < last:
        force = brentq(lambda p: 2.0 * quarter(p, 0.0)[1] - gap, most, 1e6, xtol=1e-9)
        length, _, energy = quarter(force, 0.0)
        return Squeezed(float(force), 4.0 * energy, 0.25 - length)

    def first(force: float) -> float:
        return float(brentq(lambda k: quarter(force, k)[0] - 0.25, 1e-9, 2.0 * np.pi + 1e-6, xtol=1e-13))

    force = brentq(lambda p: 2.0 * quarter(p, first(p))[1] - gap, 1e-6, most * (1.0 - 1e-9), xtol=1e-10)
    return Squeezed(float(force), 4.0 * quarter(force, first(force))[2], 0.0)
