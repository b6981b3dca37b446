"""Modes aside of a planar strip's plane: closed forms of a circle, and forces and moments in space by shooting."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import scipy.integrate
import scipy.optimize

from compare.continuation.correct import first_point
from compare.continuation.follow import follow
from compare.continuation.point import Options
from compare.scene.scene import loads
from compare.studies.branches import aside as passages
from compare.studies.branches.run import Asked, diagram
from ribbon.find.branch.aside import Form, Piece, of_chain, second_variation
from ribbon.find.branch.chain import Setting
from ribbon.find.branch.confined import Confined
from ribbon.find.branch.folds import waves
from tests.reference.aside_shooting import determinant

DELTA, GAMMA = 0.1, 10.0


def circle(turn: float, width: float) -> np.ndarray:
    """Of a strip between clamps that is bent to a circle and exerts no force."""
    arc = Piece(1.0, lambda s: np.array([-turn * s, turn + 0.0 * s, 0.0 * s, 0.0 * s]))
    return second_variation([arc], 0.0, width, (False, False), 8).lowest(2)


def closed(turn: float, width: float, low: float) -> float:
    """Zero at an eigenvalue: yaw over the angle phi is cos, sin and exponentials i p with m (1 - p^2) (1 + k p^2)
    = 1/2, m = 1 - low, k = (w turn)^2 / 24, and a constant; clamps hold yaw and roll a', its mean, and free the ruling
    a + a''."""
    m, k = 1.0 - low, (width * turn) ** 2 / 24.0
    squares = np.roots([-k * m, m * (k - 1.0), m - 0.5]) if k else np.array([1.0 - 0.5 / m])
    rates = [1j, -1j] + [s * 1j * np.sqrt(q + 0j) for q in squares for s in (1.0, -1.0)]

    def row(at: float, order: int) -> list[complex]:
        return [r**order * np.exp(r * at) for r in rates] + [1.0 if order == 0 else 0.0]

    rows = [row(0.0, 0), row(0.0, 1), row(turn, 0), row(turn, 1),
            [(np.exp(r * turn) - 1.0) / r for r in rates] + [turn]]  # fmt: skip
    if k:
        rows += [[(r + r**3) * np.exp(r * at) for r in rates] + [0.0] for at in (0.0, turn)]
    matrix = np.array(rows)
    value = np.linalg.det(matrix / np.abs(matrix).max(axis=0))
    return float(abs(value.real) if abs(value.real) > abs(value.imag) else abs(value.imag))


@pytest.mark.parametrize(("turn", "width"), [(10.0, 0.0), (12.0, 0.0), (12.0, 0.1), (10.0, 0.2)])
def test_a_circle_has_the_eigenvalues_of_its_closed_form(turn, width):
    for low in circle(turn, width):
        found = scipy.optimize.minimize_scalar(
            lambda v: closed(turn, width, v),
            bounds=(low - 1e-3, low + 1e-3),
            method="bounded",
            options={"xatol": 1e-12},
        )
        assert found.x == pytest.approx(low, abs=2e-7)
        assert found.fun < 1e-3 * closed(turn, width, low + 5e-4)


@pytest.mark.parametrize("elements", [1, 5])
def test_an_odd_number_of_elements_is_refused(elements):
    arc = Piece(1.0, lambda s: np.array([-s, 1.0 + 0.0 * s, 0.0 * s, 0.0 * s]))
    with pytest.raises(ValueError, match="even"):
        second_variation([arc], 0.0, 0.0, (False, False), elements)


def test_all_eigenvalues_below_zero_are_told_however_few_are_asked_for():
    """Of 20 unknowns of which 13 are below zero: 12 of them were taken for all."""
    own = Form(np.eye(20), np.diag(np.where(np.arange(20) < 13, -2.0, 0.5)), np.eye(1, 20, 19))
    assert (own.through_zero(12) < 0.0).sum() == 13
    assert (own.lowest(12) < 0.0).all()
    assert own.through_zero(16).size == 16


def test_without_time_modes_aside_are_not_asked_for():
    def asks(point):
        raise AssertionError

    assert passages.counts([None, None], asks, lambda: True) == [None, None]
    assert passages.passed([None] * 3, [0, 1, None], asks, Options(), 2, lambda: True) == [None]


def test_folds_give_way_aside_where_forces_and_moments_in_space_say():
    def setting_at(t: float) -> Setting:
        return Setting(0.095 - 0.038 * t, DELTA, GAMMA)

    own, z = waves(setting_at(0.0), 2, 8)
    points = follow(first_point(Confined(setting_at, own), z, 0.0, 1e-10), (0.0, 1.0), Options()).points

    def asks(point):
        return of_chain(point.system.chain, point.z, setting_at(point.t), 0.0, elements=2).lowest(4)

    counts = passages.counts(points, asks, lambda: False)
    assert (counts[0], counts[-1]) == (0, 2)
    found = passages.passed(points, counts, asks, Options(), 0, lambda: False)
    assert [one.change for one in found] == [1, 1]
    for mode, one in enumerate(found):
        height = setting_at(one.point.t).height
        assert abs(asks(one.point)[mode]) < 1e-8
        above, below = (determinant(height + side, DELTA, GAMMA, 2) for side in (2e-7, -2e-7))
        assert math.copysign(1.0, above) != math.copysign(1.0, below)


SAGGING = """
[strip]
length = 1.0
width = 0.1
poisson = 0.3
gamma = 5.0
[gravity]
up = [0.0, 1.0, 0.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[clamp.end]
position = [0.0, 0.0, 0.5]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[model]
energy = "wunderlich"
elements = 40
"""


def sagging(shortened: float, gamma: float) -> float:
    """The lowest eigenvalue aside of a symmetric strip that sags between clamps, by shooting from one to its middle."""

    def along(u, end):
        def rates(s, y):
            c, n = math.cos(y[0]), math.sin(y[0])
            return [y[1], gamma * (0.5 - s) * c - u[1] * n, c, n]

        return scipy.integrate.solve_ivp(
            rates, (0.0, end), [0.0, u[0], 0.0, 0.0], "DOP853", rtol=1e-11, atol=1e-12, dense_output=True
        )

    def left(u, to):
        y = along(u, 0.5).y[:, -1]
        return [y[0], y[2] - 0.5 * (1.0 - to)]

    u = np.array([-8.4, 39.5])
    for to in np.linspace(0.5, shortened, 12):
        u = scipy.optimize.fsolve(left, u, args=(to,), xtol=1e-11)
    whole = along(u, 1.0).sol
    seen = np.linspace(1e-6, 1.0 - 1e-6, 401)
    bent = whole(seen)[1]
    where = np.flatnonzero(bent[1:] * bent[:-1] < 0.0)
    cuts = [0.0, *(scipy.optimize.brentq(lambda s: whole(s)[1], seen[k], seen[k + 1]) for k in where), 1.0]

    def piece(first):
        def at(s):
            theta, slope = whole(first + s)[:2]
            up, c, n = gamma * (0.5 - first - s), np.cos(theta), np.sin(theta)
            return np.array([theta, -slope, up * n + u[1] * c, up * c - u[1] * n])

        return at

    strip = [Piece(last - first, piece(first)) for first, last in itertools.pairwise(cuts)]
    assert len(strip) == 3
    return float(second_variation(strip, u[1], 0.1, (True, True), 4).lowest(1)[0])


def test_a_sagging_strip_of_some_width_gives_way_where_its_hessian_in_space_says():
    """With a weight, two passages and the term with w: -0.05831, without weight -0.05874, upside down -0.05918."""
    asked = Asked(branches=1, points=False, moving=True)
    (own,) = diagram(loads(SAGGING), "clamp.end.position[2]", 0.5, -0.1, asked=asked).branches
    in_plane, aside = own.special
    assert in_plane.kind == aside.kind == "branch_point"
    root = scipy.optimize.brentq(lambda to: sagging(to, 5.0), 1.04, 1.07, xtol=1e-6)
    assert aside.settled.value == pytest.approx(1.0 - root, abs=2e-4)
