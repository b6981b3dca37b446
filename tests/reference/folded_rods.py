"""A planar rod whose parts press and rub on each other, by shooting with SciPy: nothing of the ribbon's is used."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve


class Fold(NamedTuple):
    """Moment and force (2,) in it at the start, push N, places s < s_other, angle of the normal n, elastic energy;
    `force` (2,) on the part at s from the other one, `end`: the force (2,) in it at the end."""

    moment: float
    start: np.ndarray
    push: float
    s: float
    s_other: float
    angle: float
    energy: float
    force: np.ndarray
    end: np.ndarray


def folded(end, apart, mu, guess, arm=0.5):
    """An elastica of length 1 from the origin to `end`, both tangents along the first axis, of which X at s and X' at
    s' are `apart` along the unit normal n = (cos a, sin a) = (X - X') / apart of both tangents. theta' = m and
    ``m' = f_1 sin theta - f_2 cos theta`` with the force f in it; at the point halfway X is pushed with
    ``F = N (n - mu e)``, e across n, X' with -F: f falls by F at s and rises at s', m by the moment of F there. mu
    has the sign that e gives it, n turned by +90 degrees. guess: m, f_1, f_2 at the start, N, s, s', a; arm: how far
    from X, over `apart`, its force is (the one on X' as far from that)."""
    end = np.asarray(end, dtype=float)

    def along_it(y, length):
        def slope(s, y):
            turn = y[4] * np.sin(y[2]) - y[5] * np.cos(y[2])
            return [np.cos(y[2]), np.sin(y[2]), y[3], turn, 0.0, 0.0, 0.5 * y[3] ** 2]

        return solve_ivp(slope, (0.0, length), y, rtol=1e-11, atol=1e-12).y[:, -1]

    def all_of(u):
        n = np.array([np.cos(u[6]), np.sin(u[6])])
        force = u[3] * (n - mu * np.array([-n[1], n[0]]))
        couple = arm * apart * (n[0] * force[1] - n[1] * force[0])  # of F at X - n apart / 2 about X', minus about X
        jump = np.concatenate([force, [couple]])
        first = along_it([0.0, 0.0, 0.0, *u[:3], 0.0], u[4])
        y = first.copy()
        y[4:6] -= jump[:2]
        y[3] += jump[2]
        second = along_it(y, u[5] - u[4])
        y = second.copy()
        y[4:6] += jump[:2]
        y[3] += jump[2]
        return n, force, first, second, along_it(y, 1.0 - u[5])

    def misses(u):
        n, _, first, second, last = all_of(u)
        tangents = [n @ [np.cos(y[2]), np.sin(y[2])] for y in (first, second)]
        return [*(last[:2] - end), last[2], *(first[:2] - second[:2] - apart * n), *tangents]

    found = fsolve(misses, guess, xtol=1e-12)
    assert np.abs(misses(found)).max() < 1e-8
    _, force, _, _, last = all_of(found)
    return Fold(found[0], found[1:3], *found[3:7], last[6], force, last[4:6])
