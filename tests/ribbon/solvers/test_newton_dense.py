"""Newton's iteration between bounds, dense: against Ipopt and against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from compare.models import solve as solve_scene
from compare.scene.scene import load
from ribbon.find.softened import softened
from ribbon.solvers import ipopt, newton_dense


class Bowl:
    """f = sum (x - a)^4 / 4 + c (x - a)^2 / 2 between bounds: its minimum is a, or the bound nearest to it."""

    rows = None
    strip = None
    slack = None

    def __init__(self, a, lower, upper, c=1.0):
        self.a, self.lower, self.upper, self.c = (np.asarray(v, dtype=float) for v in (a, lower, upper, c))
        self.size = self.a.size

    def bounds(self):
        return self.lower, self.upper

    def value(self, x):
        return float((0.25 * (x - self.a) ** 4 + 0.5 * self.c * (x - self.a) ** 2).sum())

    def gradient(self, x):
        return (x - self.a) ** 3 + self.c * (x - self.a)

    def hessian(self, x):
        return np.diag(3.0 * (x - self.a) ** 2 + self.c)


def test_minima_on_bounds_and_their_multipliers():
    inf = np.inf
    bowl = Bowl([2.0, -3.0, 0.5, 1.0, 7.0], [-1.0, -1.0, -1.0, -inf, 0.3], [1.0, inf, inf, inf, 0.3])
    minimum = newton_dense.minimise(bowl, np.zeros(5))
    assert minimum.finished
    np.testing.assert_allclose(minimum.x, [1.0, -1.0, 0.5, 1.0, 0.3], atol=1e-9)
    at = bowl.gradient(minimum.x)
    np.testing.assert_allclose(minimum.multipliers[:4], [at[0], at[1], 0.0, 0.0], atol=1e-8)
    assert at[0] < 0 < at[1]  # pressed against the upper, against the lower bound


def test_it_leaves_a_place_where_the_hessian_is_not_positive():
    bowl = Bowl([0.0, 0.0], [-5.0, -5.0], [5.0, 5.0], c=-1.0)
    minimum = newton_dense.minimise(bowl, np.array([0.1, -0.1]))
    np.testing.assert_allclose(np.abs(minimum.x), [1.0, 1.0], atol=1e-8)
    assert minimum.multipliers == pytest.approx(0.0, abs=1e-8)


def test_it_says_how_it_ended():
    bowl = Bowl([2.0, -3.0], [-1.0, -1.0], [1.0, 1.0])
    short = newton_dense.minimise(bowl, np.zeros(2), {"max_iter": 1})
    assert (short.code, short.finished, short.iterations) == (newton_dense.MOST, False, 1)
    assert newton_dense.minimise(bowl, np.full(2, np.nan)).code == newton_dense.NO_STEP


@pytest.mark.parametrize("name", ["curl_4_3", "limits_7_3", "coil_10_100"])
def test_softened_ribbons_are_ipopt_s(name):
    e = solve_scene(load(name), "ribbon").native
    problem = softened(e.problem, e.problem.strip.relative_width / 50.0)
    options = {"tol": 1e-9, "max_iter": 60}
    own = newton_dense.minimise(problem, e.x, options, warm=e.multipliers)
    judge = ipopt.minimise(problem, e.x, options, warm=(e.rows, e.multipliers))
    assert own.finished
    assert own.residual <= 1e-8
    assert problem.value(own.x) == pytest.approx(problem.value(judge.x), rel=1e-10)
    np.testing.assert_allclose(e.problem.joints(own.x)[0], e.problem.joints(judge.x)[0], atol=1e-7)
    assert problem.value(own.x) < problem.value(e.x) - 1e-6  # it has moved
