"""When a planar strip between floor and roof gives way aside, by shooting on forces and moments in space.

Sadowsky's strip (no width), linear about Roman's elastica with flat parts. In the strip's own frame, bending omega
about t_x, twist tau about t_z, moments (omega, M_y, 2 tau), a yaw and b roll of the frame, X the way aside::

    a' = omega b ,  b' = tau - omega a ,  X' = a
    M_y' = omega tau - N_x ,  2 tau' = - omega M_y ,  N_x' = tau n_y + Gamma (b cos theta - a sin theta) ,  n_y = omega'

A place where a plane pushes holds b = 0 by a twisting moment, so that tau jumps; along a flat part a and N_x stay.
Nothing here is a variation, and nothing of `ribbon` is used.
"""

from __future__ import annotations

import math

import numpy as np
import scipy.integrate
import scipy.optimize


def half_wave(height: float, delta: float, gamma: float, folds: int) -> tuple[float, float, float, float]:
    """Length, thrust, lift at its start, and curvature at the roof of a half wave between a flat part and the roof."""

    def end(length: float, thrust: float, lift: float) -> np.ndarray:
        return scipy.integrate.solve_ivp(
            lambda s, u: [u[1], (lift - gamma * s) * math.cos(u[0]) - thrust * math.sin(u[0]), math.cos(u[0]),
                          math.sin(u[0])],
            (0.0, length), [0.0, 0.0, 0.0, 0.0], "DOP853", rtol=1e-12, atol=1e-13,
        ).y[:, -1]  # fmt: skip

    def left(v: np.ndarray) -> list[float]:
        u = end(*v)
        return [u[0], (v[0] - u[2]) / delta - 0.5 / folds, u[3] / height - 1.0]

    length = 1.5 * folds * height**2 / delta
    thrust = (2.0 * math.pi / length) ** 2
    scale = np.array([length, thrust, thrust * height / length])
    found = np.ones(3)
    for _ in range(4):  # again from where it ended, as it may end early
        found = scipy.optimize.root(lambda v: left(v * scale), found, tol=1e-13).x
        length, thrust, lift = (float(v) for v in found * scale)
        bent = float(end(length, thrust, lift)[1])
        if bent > 0.0:  # level for the second time, right behind the first
            found[0] -= 2.0 * bent / abs(lift - gamma * length) / scale[0]
    assert np.abs(left(found * scale)).max() < 1e-10
    assert bent < 0.0
    return length, thrust, lift, bent


def determinant(height: float, delta: float, gamma: float, folds: int) -> float:
    """Zero where a mode aside of so many folds alike, flat parts on the floor shared alike, costs nothing."""
    length, thrust, lift, bent = half_wave(height, delta, gamma, folds)
    push = 2.0 * (lift - gamma * length)
    flat = (1.0 - 2.0 * folds * length) / folds

    def slope(s: float, u: np.ndarray, up: float) -> np.ndarray:
        theta, omega = u[0], -u[1]
        turned = (up - gamma * s) * math.cos(theta) - thrust * math.sin(theta)
        a, b, _, twisting, tau, aside = u[2:].reshape(6, -1)
        return np.concatenate([
            [u[1], turned], omega * b, tau - omega * a, a, omega * tau - aside, -0.5 * omega * twisting,
            -turned * tau + gamma * (b * math.cos(theta) - a * math.sin(theta)),
        ])  # fmt: skip

    unknowns = 3 + 2 * folds - 1  # of the start M_y, tau, N_x, and tau anew at every place
    y, rows = np.zeros((6, unknowns)), []
    y[[3, 4, 5], [0, 1, 2]] = 1.0
    for k in range(2 * folds):
        rises = k % 2 == 0
        start, up = ([0.0, 0.0], lift) if rises else ([0.0, bent], lift - gamma * length - push)
        u = scipy.integrate.solve_ivp(
            slope, (0.0, length), np.concatenate([start, y.ravel()]), "DOP853", rtol=1e-11, atol=1e-12,
            args=(up,),
        ).y[2:, -1]  # fmt: skip
        y = u.reshape(6, -1)
        if k == 2 * folds - 1:
            break
        rows.append(y[1].copy())
        y[1], y[4] = 0.0, 0.0
        y[4, 3 + k] = 1.0
        if not rises:
            y[2] += flat * y[0]
            y[3] -= flat * y[5]
    matrix = np.array([*rows, y[0], y[1], y[2]])
    size = np.abs(matrix).max(axis=0)
    return float(np.linalg.det(matrix / size / np.abs(matrix / size).max(axis=1)[:, None]))


def critical(low: float, high: float, delta: float, gamma: float, folds: int) -> float:
    """The height (l) between these at which a mode aside costs nothing."""
    return float(scipy.optimize.brentq(determinant, low, high, args=(delta, gamma, folds), xtol=1e-11))
