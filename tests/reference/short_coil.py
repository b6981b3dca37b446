"""A short strip between the walls of a tube, by closed forms and shooting on the planar elastica; shares nothing with
the elements.

The tube's radius and the bending stiffness are 1; of the strip, symmetric about its middle, one half is taken, of
length h = L / (2 R). Its middle is below the tube's axis or on the wall, its end is pushed along the wall's normal and
has no moment. As L / R grows (J. Y. Lee, H.-Y. Lu, R.-K. Lee, arXiv 2303.08304):

    two       both ends, at the ends of a diameter: a pinned elastica, whose middle is below its chord
              by closed forms
    three     its middle as well, at a point: its curvature there is more than the tube's
    line      a part about its middle lies along the wall, half of it over the angle alpha
    ends      its ends meet at the top, and push each other too
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve
from scipy.special import ellipe

from tests.reference.elastica_closed import quarter

KINDS = ("two", "three", "line", "ends")


@dataclass(frozen=True)
class Half:
    """One half. place: where its end is, rad round the tube from below; lowest: of its middle, below the axis; middle:
    force that the other half puts on its middle, along the tangent; energy: B / R."""

    kind: str
    place: float
    lowest: float
    middle: float
    energy: float


def _path(length: float, force: tuple[float, float], curvature: float, alpha: float) -> np.ndarray:
    """x, y, theta, curvature and energy at the end of what is free, from the wall at alpha: ``theta'' = F_x sin theta -
    F_y cos theta``."""

    def rate(_: float, y: np.ndarray) -> list[float]:
        bending = force[0] * np.sin(y[2]) - force[1] * np.cos(y[2])
        return [np.cos(y[2]), np.sin(y[2]), y[3], bending, 0.5 * y[3] ** 2]

    begin = [np.sin(alpha), -np.cos(alpha), alpha, curvature, 0.0]
    return np.asarray(solve_ivp(rate, (0.0, length), begin, rtol=1e-12, atol=1e-13).y[:, -1])


def _two(ratio: float) -> Half:
    """The chord of the half is the tube's radius."""
    alpha = float(brentq(lambda a: quarter(a)[1] - 2.0 / ratio, 1e-9, 2.4, xtol=1e-15))
    root, _, across = quarter(alpha)
    wave, m = 2.0 * root / ratio, np.sin(0.5 * alpha) ** 2
    # curvature 2 k wave cn(wave s) from the middle on; the integral of cn^2 over a quarter is (E - (1 - k^2) K) / k^2
    energy = 2.0 * wave * (ellipe(m) - (1.0 - m) * root)
    return Half("two", 0.5 * np.pi, 0.5 * ratio * across, -(wave**2), float(energy))


def _three(ratio: float) -> tuple[float, float, float]:
    """Curvature of the middle, push on the end, its place."""
    first = threes()
    push = -_two(first).middle  # which bends the middle, 1 below it, by its curvature
    found = np.array([push, push, 0.5 * np.pi])
    for step in np.linspace(first, ratio, max(2, int(abs(ratio - first) / 0.1) + 2)):

        def left(u: np.ndarray, half: float = 0.5 * step) -> list[float]:
            x, y, _, curvature, _ = _path(half, (-u[1] * np.sin(u[2]), u[1] * np.cos(u[2])), u[0], 0.0)
            return [x - np.sin(u[2]), y + np.cos(u[2]), curvature]

        found = fsolve(left, found, xtol=1e-12)
    return float(found[0]), float(found[1]), float(found[2])


@cache
def lines_begin() -> tuple[float, float, float]:
    """L / R from which on the middle lies along the wall; the push on the end and its place there."""
    ratio = float(brentq(lambda r: _three(r)[0] - 1.0, 4.0, 4.4, xtol=1e-13))
    _, push, place = _three(ratio)
    return ratio, push, place


@cache
def threes() -> float:
    """L / R from which on the middle touches: it is as far below the chord as its ends are from the axis."""
    alpha = float(brentq(lambda a: quarter(a)[1] - quarter(a)[2], 0.5, 2.0, xtol=1e-15))
    return 2.0 / quarter(alpha)[1]


def ends_meet() -> float:
    """L / R from which on its ends meet: what is free stays as it is, and what lies on the wall goes round."""
    ratio, _, place = lines_begin()
    return ratio + 2.0 * (np.pi - place)


@cache
def half(ratio: float) -> Half:
    """The half of a strip of L = `ratio` R."""
    if ratio <= threes():
        return _two(ratio)
    first, push, place = lines_begin()
    if ratio <= first:
        curvature, push, place = _three(ratio)
        force = (-push * np.sin(place), push * np.cos(place))
        return Half("three", place, 1.0, force[0], float(_path(0.5 * ratio, force, curvature, 0.0)[4]))
    if ratio <= ends_meet():
        alpha = 0.5 * (ratio - first)
        force = (-push * np.sin(place), push * np.cos(place))
        free = _path(0.5 * first, force, 1.0, 0.0)
        return Half("line", place + alpha, 1.0, force[0], float(free[4]) + 0.5 * alpha)
    return _met(ratio)


def _met(ratio: float) -> Half:
    """With the ends at the top: pushes on the end along both axes, and alpha, meet three conditions."""
    _, push, place = lines_begin()
    found = np.array([np.pi - place, 0.0, -push])
    for step in np.linspace(ends_meet(), ratio, max(2, int((ratio - ends_meet()) / 0.01) + 2)):

        def left(u: np.ndarray, half: float = 0.5 * step) -> list[float]:
            x, y, _, curvature, _ = _path(half - u[0], (u[1], u[2]), 1.0, u[0])
            return [x, y - 1.0, curvature]

        found = fsolve(left, found, xtol=1e-12)
    alpha, across, down = found
    along = across * np.cos(alpha) + down * np.sin(alpha)
    energy = 0.5 * alpha + _path(0.5 * ratio - alpha, (across, down), 1.0, alpha)[4]
    return Half("ends", np.pi, 1.0, float(along), float(energy))
