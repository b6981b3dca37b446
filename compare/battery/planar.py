r"""A judge of planar elasticas that shares no code with their solver: the boundary value problem by collocation.

The planar strip with natural curvature K(s), weight Gamma against the unit direction u and a force P at s = 1 (dead
loads, and what a support there exerts) carries p(s) = Gamma (1 - s) u - P, and in equilibrium, with its energies::

    theta' = m + K ,   m' = p_y cos theta - p_x sin theta ,   (x, y)' = (cos theta, sin theta) ,
    e' = 1/2 theta'^2 - K theta' ,   g' = Gamma <r, u>

with m = 0 at an end that is free to turn. scipy's `solve_bvp` (J. Kierzenka and L. F. Shampine, ACM Trans. Math.
Softw. 27 (2001), 299, doi 10.1145/502800.502801) solves it beside the state that is judged, its energies with it.
Stability: the second variation int v'^2 - <t, p> v^2 on piecewise linear v that keep what is held. All equilibria of a
clamped-free strip: those m(0) for which the integrated m(1) vanishes, by scanning.

Coordinates and units: `shellref.elastica.problem`, whose data a `Held` repeats.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.integrate import solve_bvp, solve_ivp
from scipy.optimize import brentq

from compare.battery.case import Check, near

Array = NDArray[np.float64]
Pair = tuple[float, float]

POINTS = 500
"""Points of the piecewise linear modes."""


class Held(Protocol):
    """Loads, natural curvature and ends (`shellref.elastica.problem.ElasticaProblem`): data, no code."""

    @property
    def gamma(self) -> float: ...
    @property
    def up(self) -> Pair: ...
    @property
    def curvature(self) -> Pair | tuple[Pair, ...]: ...
    @property
    def force(self) -> Pair: ...
    @property
    def start_angle(self) -> float | None: ...
    @property
    def end_angle(self) -> float | None: ...
    @property
    def end(self) -> Pair | None: ...


@dataclass(frozen=True)
class Equilibrium:
    """What the collocation found: theta (k,), m (k,) and points (k, 2) at s (k,), energies, the force (2,) at s = 1."""

    s: Array
    theta: Array
    moment: Array
    points: Array
    bending: float
    gravity: float
    force: Array


def at_rest(law: Pair | tuple[Pair, ...], s: Array | float) -> Array:
    """K at s (any shape) of a natural curvature: (at s = 0, at s = 1), linear, or points (s, K)."""
    points = np.asarray(law, dtype=float)
    s_points, k_points = points.T if points.ndim == 2 else (np.array([0.0, 1.0]), points)
    return np.asarray(np.interp(s, s_points, k_points))


def collocated(problem: Held, s: Array, theta: Array, points: Array, reaction: Array, tolerance: float) -> Equilibrium:
    """The equilibrium beside a shape, theta (k,) and points (k, 2) at s (k,), with the support's force (2,) about
    `reaction`. Raises ArithmeticError where the collocation does not converge."""
    fixed = problem.end is not None
    size = max(1.0, math.sqrt(problem.gamma), float(np.abs(np.asarray(problem.curvature, dtype=float)).max()))

    def rates(at: Array, y: Array, held: Array) -> Array:
        lever = problem.gamma * (1.0 - at)
        pull = np.asarray(problem.force) + (held * size**2 if fixed else 0.0)
        px, py = lever * problem.up[0] - pull[0], lever * problem.up[1] - pull[1]
        natural = at_rest(problem.curvature, at)
        rate = size * y[1] + natural
        height = y[2] * problem.up[0] + y[3] * problem.up[1]
        cos, sin = np.cos(y[0]), np.sin(y[0])
        return np.array([
            rate, (py * cos - px * sin) / size, cos, sin,
            (0.5 * rate - natural) * rate / size**2, problem.gamma * height / size**2,
        ])  # fmt: skip

    def conditions(a: Array, b: Array, held: Array) -> Array:
        rows = [a[2], a[3], a[4], a[5]]
        rows.append(a[1] if problem.start_angle is None else a[0] - problem.start_angle)
        rows.append(b[1] if problem.end_angle is None else b[0] - problem.end_angle)
        if problem.end is not None:
            rows += [b[2] - problem.end[0], b[3] - problem.end[1]]
        return np.array(rows)

    natural = at_rest(problem.curvature, s)
    guess = np.zeros((6, len(s)))
    guess[0], guess[1], guess[2:4] = theta, (np.gradient(theta, s) - natural) / size, points.T
    if fixed:
        found = solve_bvp(rates, conditions, s, guess, p=reaction / size**2, tol=tolerance, max_nodes=40_000)
    else:
        found = solve_bvp(
            lambda at, y: rates(at, y, np.zeros(2)), lambda a, b: conditions(a, b, np.zeros(2)), s, guess,
            tol=tolerance, max_nodes=40_000,
        )  # fmt: skip
    if found.status != 0:
        raise ArithmeticError(f"collocation: {found.message}")
    y = found.y
    force = np.asarray(problem.force) + (found.p * size**2 if fixed else 0.0)
    return Equilibrium(
        found.x, y[0], size * y[1], y[2:4].T, float(y[4, -1]) * size**2, float(y[5, -1]) * size**2, force
    )


def lowest_eigenvalue(problem: Held, at: Equilibrium) -> float:
    """Lowest eigenvalue (D w / l) of the second variation against int v^2, v kept where angles and the end are held."""
    spread = np.interp(np.linspace(0.0, 1.0, POINTS // 2), np.linspace(0.0, 1.0, len(at.s)), at.s)
    ends = np.geomspace(1e-5, 0.5, POINTS // 4)
    s = np.unique(np.concatenate([spread, ends, 1.0 - ends]))
    theta = np.interp(s, at.s, at.theta)
    lever = problem.gamma * (1.0 - s)
    pull = (lever * problem.up[0] - at.force[0]) * np.cos(theta) + (lever * problem.up[1] - at.force[1]) * np.sin(theta)
    h = np.diff(s)
    weight = 0.5 * (np.concatenate([h, [0.0]]) + np.concatenate([[0.0], h]))
    matrix = np.diag(np.concatenate([1.0 / h, [0.0]]) + np.concatenate([[0.0], 1.0 / h]) - pull * weight)
    matrix -= np.diag(1.0 / h, 1) + np.diag(1.0 / h, -1)
    rows = []
    unit = np.eye(len(s))
    if problem.start_angle is not None:
        rows.append(unit[0])
    if problem.end_angle is not None:
        rows.append(unit[-1])
    if problem.end is not None:
        rows += [-np.sin(theta) * weight, np.cos(theta) * weight]
    root = np.sqrt(weight)
    basis = scipy.linalg.null_space(np.array(rows) / root) if rows else unit
    scaled = matrix / root[:, None] / root
    return float(scipy.linalg.eigvalsh(basis.T @ scaled @ basis, subset_by_index=[0, 0])[0])


def shooting(problem: Held, start_moments: Array) -> Array:
    """(theta, m, x, y) (4, k) at s = 1 of clamped-free strips that leave their clamp with these moments (k,)."""
    count = len(start_moments)

    def rates(s: float, state: Array) -> Array:
        y = state.reshape(4, count)
        lever = problem.gamma * (1.0 - s)
        px, py = lever * problem.up[0] - problem.force[0], lever * problem.up[1] - problem.force[1]
        natural = at_rest(problem.curvature, s)
        cos, sin = np.cos(y[0]), np.sin(y[0])
        return np.stack([y[1] + natural, py * cos - px * sin, cos, sin]).ravel()

    assert problem.start_angle is not None
    begin = np.zeros((4, count))
    begin[0], begin[1] = problem.start_angle, start_moments
    found = solve_ivp(rates, (0.0, 1.0), begin.ravel(), method="DOP853", rtol=1e-10, atol=1e-12)
    return np.asarray(found.y[:, -1]).reshape(4, count)


def all_equilibria(problem: Held, most: float, tries: int) -> list[tuple[float, Array]]:
    """Every (m(0), end state (4,)) of a clamped-free strip with |m(0)| <= most: sign changes of m(1) on `tries` values.

    m(0) is at most sqrt(2 times the work that the loads can do) where K = 0: m^2 / 2 - <t, p> is constant under a dead
    force, so that 2 sqrt(|F|) bounds all of them.
    """
    values = np.linspace(-most, most, tries)
    ends = shooting(problem, values)[1]
    found = []
    for a, b, left, right in zip(values[:-1], values[1:], ends[:-1], ends[1:], strict=True):
        if left == 0.0 or left * right < 0.0:
            root = a if left == 0.0 else brentq(lambda m: shooting(problem, np.array([m]))[1, 0], a, b, xtol=1e-12)
            found.append((float(root), shooting(problem, np.array([float(root)]))[:, 0]))
    return found


class Solved(Protocol):
    """What is judged (`shellref.elastica.result.ElasticaResult`)."""

    angle: Callable[[Array], Array]
    position: Callable[[Array], Array]


def judged(
    problem: Held,
    solved: Solved,
    joints: Array,
    energy: tuple[float, float],
    eigenvalue: float,
    reaction: Pair = (0.0, 0.0),
    shape: float = 1e-5,
    tolerance: float = 1e-6,
) -> Iterator[Check]:
    """The checks of a solved strip: its shape, energy (bending, gravity), force at the end and stability, against the
    collocation's. joints (n,): where its elements meet; shape: bound of the distance (l); tolerance: the collocation's.
    """
    s = np.unique(np.concatenate([joints, 0.5 * (joints[1:] + joints[:-1])]))
    theta = solved.angle(s)
    apart = 0.01 * np.sin(3.0 * s) * s * (1.0 - s)  # so that nothing of the state survives unsolved
    try:
        at = collocated(problem, s, theta + apart, solved.position(s), np.asarray(reaction) * 1.001, tolerance)
    except ArithmeticError as error:
        yield Check("distance from the collocation (l)", math.nan, shape, said=str(error))
        return
    distance = np.linalg.norm(solved.position(at.s) - at.points, axis=1)
    yield Check("distance from the collocation (l)", float(distance.max()), shape)
    total = at.bending + at.gravity
    yield near("energy against the collocation's (relative)", sum(energy), total, 1e-5)
    if problem.end is not None:
        off = float(np.linalg.norm(np.asarray(reaction) + problem.force - at.force))
        yield Check("force at the end (relative)", off / max(1.0, float(np.linalg.norm(at.force))), 1e-3)
    own = lowest_eigenvalue(problem, at)
    text = f"{eigenvalue:.6g}, by piecewise linear modes {own:.6g}"
    yield Check("lowest eigenvalue (relative)", abs(eigenvalue - own) / max(1.0, abs(own)), 0.03, said=text)
