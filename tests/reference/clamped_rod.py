"""A twisted round rod whose clamped ends come together, up to its first place of contact: by shooting.

Kirchhoff's equations as in `tests.reference.touching_ring`, from the middle s = 1/2, where the rod is alike about e_1
(r = (x, 0, 0), tangent (0, cos a, sin a), no part of moment or force along e_1), to a clamp on the axis e_3 at Z / 2
with the tangent e_3: r_1 = r_2 = u_1 = u_2 = 0, r_3 = Z / 2. Where strands touch at s and 1 - s, images about e_1, a
force F jumps straight across. The clamps are turned against each other by R = t + 2 b up to whole turns, b the angle
about e_3 at the clamp of the direction that is e_1 in the middle and carried along without twist (R. L. Bishop 1975,
doi:10.2307/2319846), w' = -(w . u') u.

No code is shared with any solver of the package.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar, root

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Clamped:
    """A rod at rest: distance Z of its ends, twist t and turn R (rad), energy, tension T and moment M along the axis,
    force F of the place of contact at distance `place` from the middle (nan: free), and the shooting's unknowns."""

    distance: float
    twist: float
    turn: float
    energy: float
    tension: float
    moment: float
    force: float
    place: float
    mismatch: float
    unknowns: FloatArray


def _rate(_: float, y: FloatArray) -> list[float]:
    """Of (r, u, m, n, energy of bending, w)."""
    a, b, c, m1, m2, m3, f, g, h = y[3:12].tolist()
    d1, d2, d3 = m2 * c - m3 * b, m3 * a - m1 * c, m1 * b - m2 * a
    w = y[13] * d1 + y[14] * d2 + y[15] * d3
    return [a, b, c, d1, d2, d3, g * c - h * b, h * a - f * c, f * b - g * a, 0.0, 0.0, 0.0,
            0.5 * (d1 * d1 + d2 * d2 + d3 * d3), -w * a, -w * b, -w * c]  # fmt: skip


def _walked(y: FloatArray, low: float, high: float) -> FloatArray:
    found = solve_ivp(_rate, (low, high), y, method="DOP853", rtol=1e-11, atol=1e-12)
    return np.asarray(found.y[:, -1])


def _end(v: FloatArray, bend: float, torsion: float, place: float | None = None, force: float = 0.0) -> FloatArray:
    """The state at the clamp by (x, a, t, n_2, n_3) and the curvature in the middle; with contact at `place` also the
    distance of the strand from e_1 there, and half the slope of its square."""
    x, a, twist, second, third = v
    u = np.array([0.0, np.cos(a), np.sin(a)])
    m = bend * np.cross(u, [-1.0, 0.0, 0.0]) + torsion * twist * u
    y = np.concatenate([[x, 0.0, 0.0], u, m, [0.0, second, third, 0.0, 1.0, 0.0, 0.0]])
    if place is None:
        return _walked(y, 0.0, 0.5)
    y = _walked(y, 0.0, place)
    near = np.hypot(y[1], y[2]), y[1] * y[4] + y[2] * y[5]
    y[10:12] -= force * y[1:3] / near[0]
    return np.concatenate([_walked(y, place, 0.5), near])


def _held(y: FloatArray, turn: float, twist: float) -> list[float]:
    """What a clamp on the axis misses, and the turn."""
    return [y[0], y[1], y[3], y[4], np.sin(0.5 * (turn - twist) - np.arctan2(y[14], y[13]))]


def _solved(missed: Callable[[FloatArray], FloatArray], guess: FloatArray) -> tuple[FloatArray, float]:
    found = root(missed, guess, method="hybr", tol=1e-12)
    mismatch = float(np.abs(missed(found.x)).max())
    if not mismatch < 1e-8:
        raise ValueError(f"no rod from there: {found.message}")
    return np.asarray(found.x), mismatch


def _rod(y: FloatArray, twist: float, turn: float, torsion: float, *rest: Any) -> Clamped:
    energy = 2.0 * float(y[12]) + 0.5 * torsion * twist**2
    return Clamped(2.0 * float(y[2]), twist, turn, energy, float(y[11]), float(y[8]), *rest)


def free(bend: float, turn: float, torsion: float, guess: FloatArray) -> Clamped:
    """The rod of the curvature `bend` in its middle, turned by R, that touches nothing, from a guess (5,) of (x, a, t,
    n_2, n_3). `ValueError` where the shooting does not end."""
    v, mismatch = _solved(lambda v: np.array(_held(_end(v, bend, torsion), turn, v[2])), guess)
    return _rod(_end(v, bend, torsion), float(v[2]), turn, torsion, 0.0, np.nan, mismatch, v)


def touching(twist: float, turn: float, torsion: float, diameter: float, guess: FloatArray) -> Clamped:
    """The rod of the twist t that touches itself at s to both sides of its middle, from a guess (7,) of (x, a, s, n_2,
    n_3), the curvature in the middle and F. `ValueError` where the shooting does not end."""

    def end(v: FloatArray) -> FloatArray:
        own = np.array([v[0], v[1], twist, v[3], v[4]])
        return _end(own, float(v[5]), torsion, float(v[2]), float(v[6]))

    def missed(v: FloatArray) -> FloatArray:
        y = end(v)
        return np.array([*_held(y, turn, twist), y[16] - 0.5 * diameter, y[17] / diameter])

    v, mismatch = _solved(missed, guess)
    return _rod(end(v), twist, turn, torsion, float(v[6]), float(v[2]), mismatch, v)


def without_end(turn: float, torsion: float) -> float:
    """The least distance Z at which a rod whose loop does not feel its clamps is in equilibrium before it touches
    itself: with m = M / sqrt(T), by its homoclinic shapes R = M / C + 4 arccos(m / 2) and
    1 - Z = 4 sqrt((1 - m^2 / 4) / T) (S. Neukirch, G. H. M. van der Heijden and J. M. T. Thompson 2002, J. Mech. Phys.
    Solids 50, 1175)."""

    def shortening(m: float) -> float:
        moment = torsion * (turn - 4.0 * np.arccos(0.5 * m))
        return float(4.0 * m / moment * np.sqrt(1.0 - 0.25 * m * m))

    found = minimize_scalar(lambda m: -shortening(m), bounds=(0.3, 1.99), method="bounded", options={"xatol": 1e-12})
    return 1.0 - shortening(float(found.x))
