"""The planar elastica between two clamps brought together until its sides meet: by shooting, contact and all.

A strip of length 1 and bending stiffness 1, its ends clamped along z at z = 0 and Z, folds up into a loop whose neck
closes as Z falls. Its half up to the middle, with the angle a of the tangent against z::

    z' = cos a ,   y' = sin a ,   a' = k ,   k' = F sin a ,

F constant but for a jump by the force N with which the sides of the neck push each other, straight across, where a =
pi/2. By symmetry no force acts across the plane of the middle. Unknown k(0), F, the place of contact and N; conditions
a = pi/2 and z = (Z - h) / 2 there, a = 0 and z = Z/2 in the middle. No code is shared with any solver of the package.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Fold:
    """A fold at rest: contact at s and 1 - s with `push` (0: none, s where the neck is narrowest), `energy` 1/2 int k^2
    ds, gap between the sides over h, height of the middle; unknowns: those of the shooting."""

    s: float
    push: float
    energy: float
    height: float
    unknowns: FloatArray


def _walked(begin: FloatArray, force: float, low: float, high: float) -> FloatArray:
    """State (y, z, a, k, energy) at `high`."""

    def rate(_: float, state: FloatArray) -> list[float]:
        _, _, a, k, _ = state
        return [np.sin(a), np.cos(a), k, force * np.sin(a), 0.5 * k * k]

    found = solve_ivp(rate, (low, high), begin, method="DOP853", rtol=1e-10, atol=1e-11)
    return np.asarray(found.y[:, -1])


def free(distance: float, guess: FloatArray) -> FloatArray:
    """k(0) and F of the fold without contact, Z = distance."""

    def missed(v: FloatArray) -> list[float]:
        end = _walked(np.array([0.0, 0.0, 0.0, v[0], 0.0]), v[1], 0.0, 0.5)
        return [end[2], end[1] - 0.5 * distance]

    found = root(missed, guess, tol=1e-11)
    if not np.abs(missed(found.x)).max() < 1e-9:
        raise ValueError(f"no fold at Z = {distance:g}: {found.message}")
    return np.asarray(found.x)


def touching(distance: float, thickness: float, guess: FloatArray) -> Fold:
    """The fold with contact; guess: k(0), F, s, N."""

    def both(v: FloatArray) -> tuple[FloatArray, FloatArray]:
        at = _walked(np.array([0.0, 0.0, 0.0, v[0], 0.0]), v[1], 0.0, float(v[2]))
        return at, _walked(at, v[1] + v[3], float(v[2]), 0.5)

    def missed(v: FloatArray) -> list[float]:
        at, end = both(v)
        return [at[2] - 0.5 * np.pi, at[1] - 0.5 * (distance - thickness), end[2], end[1] - 0.5 * distance]

    found = root(missed, guess, tol=1e-11)
    if not np.abs(missed(found.x)).max() < 1e-9:
        raise ValueError(f"no touching fold at Z = {distance:g}: {found.message}")
    end = both(found.x)[1]
    return Fold(float(found.x[2]), abs(float(found.x[3])), 2.0 * float(end[4]), float(end[0]), np.asarray(found.x))


def _neck(v: FloatArray) -> tuple[float, float]:
    """Where the first half of a free fold comes farthest, before it turns back, and how far: s and z."""

    def rate(_: float, y: FloatArray) -> list[float]:
        return [np.sin(y[2]), np.cos(y[2]), y[3], v[1] * np.sin(y[2])]

    found = solve_ivp(rate, (0.0, 0.24), [0.0, 0.0, 0.0, v[0]], "DOP853", rtol=1e-10, atol=1e-11, dense_output=True)
    s = np.linspace(0.0, 0.24, 2401)
    z = found.sol(s)[1]
    return float(s[np.argmax(z)]), float(z.max())


def folds(distances: FloatArray, thickness: float) -> list[Fold]:
    """Folds at rest at falling `distances`, all of them touching: the free fold first, from half its length on."""
    v = free(0.5, np.array([9.0, -60.0]))
    for distance in np.linspace(0.5, 0.2, 13)[1:]:
        v = free(float(distance), v)
    distance = 0.2
    place, narrow = _neck(v)
    while narrow < 0.5 * (distance - thickness):  # to where the sides meet
        distance -= 0.005
        v = free(distance, v)
        place, narrow = _neck(v)
    w = np.array([v[0], v[1], place, 0.0])
    found = []
    for target in distances:
        while distance > target + 1e-12:
            distance = max(float(target), distance - 0.01)
            w = touching(distance, thickness, w).unknowns
        found.append(touching(float(target), thickness, w))
    return found


def touchdown(thickness: float) -> float:
    """The distance of the clamps at which the sides of the neck meet."""
    known = free(0.5, np.array([9.0, -60.0]))
    for distance in np.linspace(0.5, 0.2, 13)[1:]:
        known = free(float(distance), known)

    def open_by(distance: float) -> float:
        return 0.5 * (distance - thickness) - _neck(free(distance, known))[1]

    return float(brentq(open_by, 0.15, 0.2, xtol=1e-9))
