"""Rods that are joined or press each other, by shooting with SciPy: nothing of the ribbon's is used."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve


def stiffnesses(width, thickness, poisson):
    """Of torsion and of bending in the strip's plane of a rectangular rod, over Y I raised by 1 / (1 - nu^2):
    2 (1 - nu) J / (w h^3 / 3) by Saint-Venant's series, and (1 - nu^2) w^2 / h^2."""
    ratio = thickness / width
    series = sum(np.tanh(n * np.pi / (2.0 * ratio)) / n**5 for n in range(1, 60, 2))
    torsion = 2.0 * (1.0 - poisson) * (1.0 - 192.0 * ratio / np.pi**5 * series)
    return torsion, (1.0 - poisson**2) / ratio**2


def rod(moment, force, torsion, sideways):
    """Place (3,), frame (3, 3) and energy at s = 1 of a rod of bending stiffness 1 and these other two, from s = 0 at
    the origin with the frame 1 under a moment and a force (3,) there: R' = R [kappa], r' = t_z,
    m' = force x t_z, kappa_i = (m . t_i) / B_i, by SciPy's Runge-Kutta of order 8."""

    def slope(s, y):
        frame = y[3:12].reshape(3, 3)
        one, two, three = frame.T @ y[12:15] / np.array([1.0, sideways, torsion])
        turning = np.array([[0.0, -three, two], [three, 0.0, -one], [-two, one, 0.0]])
        energy = 0.5 * (one**2 + sideways * two**2 + torsion * three**2)
        return np.concatenate([frame[:, 2], (frame @ turning).ravel(), np.cross(force, frame[:, 2]), [energy]])

    first = np.concatenate([np.zeros(3), np.eye(3).ravel(), moment, [0.0]])
    y = solve_ivp(slope, (0.0, 1.0), first, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    return y[:3], y[3:12].reshape(3, 3), y[15]


class Bigon(NamedTuple):
    """Force and moment (3,) inside the first rod at s = 0, its energy, and where both end (3,)."""

    force: np.ndarray
    moment: np.ndarray
    energy: float
    end: np.ndarray


def bigon_of_rods(degrees, torsion, sideways, moment):
    """Two rods of length 1 joined at both ends at an angle about t_y, from a moment near the one at the joint at
    s = 0: under opposite forces and moments there, at s = l they meet at the angle."""
    angle = np.radians(degrees)
    turn = np.array([[np.cos(angle), 0.0, np.sin(angle)], [0.0, 1.0, 0.0], [-np.sin(angle), 0.0, np.cos(angle)]])

    def misses(u):
        place, frame, _ = rod(u[:3], u[3:], torsion, sideways)
        other, last, _ = rod(-turn.T @ u[:3], -turn.T @ u[3:], torsion, sideways)
        apart = turn @ frame.T @ turn @ last
        return np.concatenate([place - turn @ other, [apart[2, 1], apart[0, 2], apart[1, 0]]])

    found = fsolve(misses, np.concatenate([moment, np.zeros(3)]), xtol=1e-12)
    assert np.abs(misses(found)).max() < 1e-9
    end, _, energy = rod(found[:3], found[3:], torsion, sideways)
    return Bigon(found[3:], found[:3], energy, end)


def facing(span, gap, apart, weight, guess):
    """Two elasticas of length 1 in a plane that face each other, the tip of the second, which is heavy, `apart` from
    the first: force, place s on the first, both moments at the clamps, angle at the place. span: between their clamps;
    the second one's is `apart` + gap higher. theta' = m, m' = n x t."""

    def along_it(moment, along, up, load, length):
        def slope(s, y):
            return [np.cos(y[2]), np.sin(y[2]), y[3], y[4] * np.sin(y[2]) - y[5] * np.cos(y[2]), 0.0, load]

        return solve_ivp(slope, (0.0, length), [0.0, 0.0, 0.0, moment, along, up], rtol=1e-11, atol=1e-12).y[:, -1]

    def misses(u):
        force, s, low, high, angle = u
        push = force * np.array([np.sin(angle), -np.cos(angle)])
        first = along_it(low, *push, 0.0, s)
        second = along_it(high, push[0], -push[1] - weight, weight, 1.0)
        tip = np.array([span - second[0], apart + gap + second[1]])
        normal = np.array([-np.sin(first[2]), np.cos(first[2])])
        return [first[3], second[3], *(tip - first[:2] - apart * normal), first[2] - angle]

    found = fsolve(misses, guess, xtol=1e-12)
    assert np.abs(misses(found)).max() < 1e-9
    return found


def facing_rubbed(span, gap, apart, weight, mu, guess):
    """The two of `facing`, the second one's tip drawn along the first away from its clamp: ``F = N (-n + mu t)`` on the
    first at the point halfway, its moment there ``m = (apart / 2) n x F``, and -F on the second.

    N, place s on the first, both moments at the clamps, angle at the place; and the bending energy of both."""

    def along_it(moment, along, up, load, length):
        def slope(s, y):
            turn = y[4] * np.sin(y[2]) - y[5] * np.cos(y[2])
            return [np.cos(y[2]), np.sin(y[2]), y[3], turn, 0.0, load, 0.5 * y[3] ** 2]

        return solve_ivp(slope, (0.0, length), [0.0, 0.0, 0.0, moment, along, up, 0.0], rtol=1e-11, atol=1e-12).y[:, -1]

    def both(u):
        push, s, low, high, angle = u
        normal, way = np.array([-np.sin(angle), np.cos(angle)]), np.array([np.cos(angle), np.sin(angle)])
        force = push * (mu * way - normal)
        couple = 0.5 * apart * (normal[0] * force[1] - normal[1] * force[0])
        ends = along_it(low, *force, 0.0, s), along_it(high, force[0], -force[1] - weight, weight, 1.0)
        return normal, couple, *ends

    def misses(u):
        normal, couple, first, second = both(u)
        tip = np.array([span - second[0], apart + gap + second[1]])
        return [first[3] - couple, second[3] + couple, *(tip - first[:2] - apart * normal), first[2] - u[4]]

    found = fsolve(misses, guess, xtol=1e-12)
    assert np.abs(misses(found)).max() < 1e-9
    _, _, first, second = both(found)
    return found, first[6] + second[6]
