"""The straight strip on edge to second order, without curvature elements: a Rayleigh quotient, least over the rulings.

A strip of length 1 held at s = 0, its width upright, bends sideways by kappa and twists by tau; theta(s) is the angle
by which its section has turned, theta' = tau, theta(0) = 0. To second order its energy (D w / l) is

    int e(kappa, tau) - Gamma m kappa theta ds ,   m = (1 - s)^2 / 2

(Michell 1899; m: the weight's moment over Gamma), so that 1 / Gamma_c is the largest value of ``int m kappa theta``
over ``int e``. Nothing is shared with `ribbon`: no elements, no derivatives of theirs, other quadrature.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.optimize
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Largest |w eta' / 2|: rulings do not cross inside the strip.
STEEPEST = 1.0 - 1e-9


@dataclass(frozen=True)
class Frontier:
    """Gamma_c, and for a developable strip the ruling eta (n + 1,) at the joints s (n + 1,) that makes it least."""

    gamma: float
    s: FloatArray
    ruling: FloatArray


def torsion(ratio: float) -> float:
    """Torsion constant of a rectangle of w/h = `ratio` over w h^3 / 3 (Saint-Venant's series)."""
    k = np.arange(1, 200, 2)
    return float(1 - 192 / (np.pi**5 * ratio) * np.sum(np.tanh(k * np.pi * ratio / 2) / k**5))


def michell(bending: float, twist: float, count: int = 400) -> float:
    """Gamma_c of a rod with e = bending kappa^2 / 2 + twist tau^2 / 2."""
    return smooth(bending, twist, count=count)


@functools.cache
def smooth(bending: float, twist: float, warping: float = 0.0, held: bool = False, first: float = 0.02,
           count: int = 400) -> float:  # fmt: skip
    """Gamma_c of e = bending kappa^2 / 2 + twist tau^2 / 2 + warping tau'^2 / 2.

    kappa and tau are linear between joints (cells at the clamp are `first` times the mean); held: tau(0) = 0.
    """
    s = _joints(count, first)
    length = np.diff(s)
    n = length.size
    mass = _tridiagonal(length / 3, length / 6)
    slope = _tridiagonal(1 / length, -1 / length)
    elastic = np.zeros((2 * n + 2, 2 * n + 2))
    elastic[: n + 1, : n + 1] = bending * mass
    elastic[n + 1 :, n + 1 :] = twist * mass + warping * slope
    # theta at the Gauss points of a cell: all cells before, and tau = t0 (1 - x) + t1 x up to x within it
    points, weights = np.polynomial.legendre.leggauss(3)
    before = np.zeros((n, n + 1))  # int of the hat functions up to the start of each cell
    for i in range(1, n):
        before[i] = before[i - 1]
        before[i, i - 1] += 0.5 * length[i - 1]
        before[i, i] += 0.5 * length[i - 1]
    coupling = np.zeros((n + 1, n + 1))
    cells = np.arange(n)
    for x, weight in zip(0.5 * (1 + points), 0.5 * weights, strict=True):
        theta = before.copy()
        theta[cells, cells] += length * (x - 0.5 * x * x)
        theta[cells, cells + 1] += length * 0.5 * x * x
        load = weight * length * 0.5 * (1 - s[:-1] - x * length) ** 2
        coupling[:-1] += (load * (1 - x))[:, None] * theta
        coupling[1:] += (load * x)[:, None] * theta
    work = np.zeros_like(elastic)
    work[: n + 1, n + 1 :] = coupling
    work = work + work.T
    keep = np.ones(2 * n + 2, dtype=bool)
    keep[n + 1] = not held
    last = [keep.sum() - 1] * 2
    (largest,) = scipy.linalg.eigh(
        work[np.ix_(keep, keep)], elastic[np.ix_(keep, keep)], eigvals_only=True, subset_by_index=last
    )
    return float(1 / largest)


def developable(width: float, finite_width: bool, straight: bool, count: int = 240) -> Frontier:
    """Gamma_c of an inextensible strip, e = kappa^2 (1 + eta^2)^2 g(w eta' / 2) / 2, tau = eta kappa.

    g = 1 (Sadowsky) or artanh(x) / x (Wunderlich); least over every ruling eta(s) with |w eta' / 2| < 1; straight:
    eta(0) = 0. kappa is constant on cells.
    """
    s = _joints(count, min(1.0, 0.1 * width * count))
    length = np.diff(s)
    rise = 2 / width * length

    def ruling(z: FloatArray) -> FloatArray:
        start = 0.0 if straight else z[0]
        return np.concatenate([[start], start + np.cumsum(rise * z[1:])])

    def negative(z: FloatArray) -> tuple[float, FloatArray]:
        value, slope = _quotient(ruling(z), length, width, finite_width)
        after = np.cumsum(slope[::-1])[::-1]
        return -value, -np.concatenate([[0.0 if straight else after[0]], after[1:] * rise])

    start = 0.7 * (1 - np.exp(-s / width)) if straight else np.full(s.size, 0.7)
    z = np.concatenate([[start[0]], np.clip(np.diff(start) / rise, -0.9, 0.9)])
    value = np.inf
    for _ in range(8):  # from where the search got to: its memory of curvature starts anew
        found = scipy.optimize.minimize(
            negative, z, jac=True, method="L-BFGS-B", bounds=[(None, None)] + [(-STEEPEST, STEEPEST)] * length.size,
            options={"maxiter": 2000, "maxfun": 4000, "ftol": 1e-15, "gtol": 1e-11},
        )  # fmt: skip
        z, before, value = found.x, value, found.fun
        if abs(value - before) < 1e-9 * abs(value):
            break
    return Frontier(-1 / value, s, ruling(z))


def _quotient(eta: FloatArray, length: FloatArray, width: float, finite_width: bool) -> tuple[float, FloatArray]:
    """1 / Gamma_c for the ruling eta (n + 1,) and its gradient by eta."""
    middle = 0.5 * (eta[1:] + eta[:-1])
    x = 0.5 * width * np.diff(eta) / length
    g, dg = _spread(x) if finite_width else (np.ones_like(x), np.zeros_like(x))

    def f(e: FloatArray) -> FloatArray:
        return (1 + e * e) ** 2

    def df(e: FloatArray) -> FloatArray:
        return 4 * e * (1 + e * e)

    mean = (f(eta[:-1]) + 4 * f(middle) + f(eta[1:])) / 6
    stiffness = mean * g * length
    s = np.concatenate([[0.0], np.cumsum(length)])
    load = 0.5 * (1 - 0.5 * (s[1:] + s[:-1])) ** 2 * length
    turn = np.tril(np.outer(np.ones(length.size), middle * length), -1) + np.diag(0.5 * middle * length)
    work = load[:, None] * turn
    scale = 1 / np.sqrt(stiffness)
    values, vectors = scipy.linalg.eigh(
        scale[:, None] * (work + work.T) * scale, subset_by_index=[length.size - 1, length.size - 1]
    )
    value, kappa = float(values[0]), scale * vectors[:, 0]
    loaded = load * kappa
    beyond = np.concatenate([np.cumsum(loaded[::-1])[::-1][1:], [0.0]])
    by_middle = (
        (beyond + 0.5 * loaded) * length * kappa
    )  # d work / d middle; half of it to each joint, twice for symmetry
    slope = np.zeros(eta.size)
    slope[:-1] += by_middle
    slope[1:] += by_middle
    energy = value * kappa**2 * length
    by_x = mean * dg * 0.5 * width / length
    slope[:-1] -= energy * ((df(eta[:-1]) + 2 * df(middle)) / 6 * g - by_x)
    slope[1:] -= energy * ((df(eta[1:]) + 2 * df(middle)) / 6 * g + by_x)
    return value, slope


def _spread(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """artanh(x) / x and its derivative."""
    small = np.abs(x) < 1e-4
    safe = np.where(small, 0.5, np.clip(x, -STEEPEST, STEEPEST))
    g = np.where(small, 1 + x * x / 3, np.arctanh(safe) / safe)
    return g, np.where(small, 2 * x / 3, (1 / (1 - safe * safe) - g) / safe)


def _joints(count: int, first: float) -> FloatArray:
    """`count` cells on [0, 1], growing smoothly from `first` times the mean at s = 0."""
    t = np.linspace(0.0, 1.0, count + 1)
    return first * t + (1 - first) * t * t * (2 - t)


def _tridiagonal(diagonal: FloatArray, off: FloatArray) -> FloatArray:
    matrix = np.diag(off, 1) + np.diag(off, -1)
    matrix[:-1, :-1] += np.diag(diagonal)
    matrix[1:, 1:] += np.diag(diagonal)
    return matrix
