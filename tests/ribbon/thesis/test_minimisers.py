"""The minimisers of 3.5.2: known minima, their invariants, and what they do on the thesis's first scene."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from ribbon import Clamp, Gravity, Strip
from ribbon.problems.chained import ChainedProblem, segment_lengths
from ribbon.thesis import descent
from ribbon.thesis.descent import METHODS, Limits, Unbounded

HALF = 2**-0.5
CENTRE = np.array([1.0, -2.0, 0.5])
NEAR, FAR = np.array([0.5, -0.6, 0.4]), np.array([2.0, -1.0, 1.0])
MATRIX = np.array([[1.0, 0.2, 0.1], [0.2, 0.7, -0.1], [0.1, -0.1, 0.5]])


@dataclass
class Bowl:
    """``d^T A d / 2 + sum d^4 / 4`` with d = x - CENTRE: convex, minimum 0 at CENTRE; records where it was asked."""

    upper: float = np.inf
    gradients_at: list[np.ndarray] = field(default_factory=list)
    size: int = 3

    def bounds(self):
        return np.full(3, -np.inf), np.full(3, self.upper)

    def value(self, x):
        d = x - CENTRE
        return float(d @ MATRIX @ d / 2 + np.sum(d**4) / 4)

    def gradient(self, x):
        self.gradients_at.append(np.array(x))
        d = x - CENTRE
        return MATRIX @ d + d**3

    def hessian(self, x):
        return MATRIX + np.diag(3 * (x - CENTRE) ** 2)


class Valley:
    """``x^4 / 4 - x^2 / 2 + y^2 / 2``: minima -1/4 at (+-1, 0), a saddle at the origin."""

    size = 2

    def bounds(self):
        return np.full(2, -np.inf), np.full(2, np.inf)

    def value(self, z):
        return float(z[0] ** 4 / 4 - z[0] ** 2 / 2 + z[1] ** 2 / 2)

    def gradient(self, z):
        return np.array([z[0] ** 3 - z[0], z[1]])

    def hessian(self, z):
        return np.diag([3 * z[0] ** 2 - 1, 1.0])


def coil(curvature=10.0, gamma=100.0, segments=10):
    """The scene of table 3.2 (Sadowsky) without bounds; a point coiled over 10 000 rad/l counts as unreachable."""
    clamp = Clamp((0, 0, 0), (0, 0, 1), (-HALF, HALF, 0), ruling="free")
    strip = Strip(1.0, 0.03, 0.4, curvature, gamma)
    problem = ChainedProblem(strip, clamp, Gravity((1, 0, 0)), "sadowsky", segment_lengths(segments))

    def admissible(x):
        q = problem.parameters(x)
        return np.abs(q[:, 1]).max() * (1 + np.abs(q[:, 3]).max()) < 1e4 and np.abs(q[:, [0, 2]]).max() < 1e5

    return problem, Unbounded(problem, admissible)


@pytest.fixture(scope="module")
def scene():
    problem, free = coil()
    found = descent.newton_shifted(free, problem.natural_state(), Limits(1e-11))
    assert found.finished
    return problem, free, found


@pytest.mark.parametrize("name", METHODS)
def test_every_method_finds_a_known_minimum(name):
    bowl = Bowl()
    found = METHODS[name](bowl, CENTRE + NEAR, Limits(1e-9, 2000))
    assert found.finished
    assert found.message == "converged"
    assert found.gradient_norm <= 1e-9
    assert np.abs(found.x - CENTRE).max() < 1e-8
    assert found.value < 1e-16
    assert 0 < found.iterations <= 500
    assert found.evaluations["gradient"] >= found.iterations
    second_order = name in ("NEWTON", "NEWTONC", "NEWTONR", "IPOPT-HESS", "trust-exact")
    assert (found.evaluations["hessian"] > 0) == second_order


@pytest.mark.parametrize("name", METHODS)
def test_out_of_steps_is_said(name):
    found = METHODS[name](Bowl(), CENTRE + FAR, Limits(1e-12, 1))
    assert not found.finished
    assert "not converged" in found.message
    assert found.iterations <= 1
    assert found.gradient_norm > 1e-12


@pytest.mark.parametrize("name", METHODS)
def test_out_of_time_is_said(name):
    start = CENTRE + FAR
    found = METHODS[name](Bowl(), start, Limits(1e-12, 1000, 1e-9))
    assert not found.finished
    assert "time" in found.message or "stopped after" in found.message
    assert found.iterations <= 1


def test_newton_goes_to_a_saddle_and_the_regularised_ones_to_a_minimum():
    """Thesis, 3.5.2: Newton reaches an extremum, not necessarily a minimum."""
    start = np.array([0.2, 1.0])
    saddle = descent.newton(Valley(), start)
    assert saddle.finished
    assert np.abs(saddle.x).max() < 1e-8
    for method in (descent.newton_or_gradient, descent.newton_shifted, descent.trust_region):
        found = method(Valley(), start)
        assert found.finished
        assert np.abs(found.x) == pytest.approx([1.0, 0.0], abs=1e-7)
        assert found.value == pytest.approx(-0.25, abs=1e-14)


def test_the_line_search_keeps_to_the_bounds():
    bowl = Bowl(upper=0.8)  # the minimum's first component is 1
    found = descent.newton_shifted(bowl, np.array([0.0, -1.0, 0.0]), Limits(1e-9, 200))
    assert all(x.max() <= 0.8 for x in bowl.gradients_at)
    assert found.x[0] > 0.79
    assert not found.finished
    free = Bowl(upper=0.8)
    assert descent.newton_shifted(Unbounded(free), np.array([0.0, -1.0, 0.0])).x == pytest.approx(CENTRE, abs=1e-7)


def test_a_forbidden_point_is_a_message_or_a_shorter_step():
    start = CENTRE + FAR
    wall = Unbounded(Bowl(), lambda x: bool(np.abs(x - start).max() < 0.2))
    away = descent.gradient_descent_unit(wall, start)
    assert away.message.startswith("diverged")
    assert np.isnan(away.gradient_norm)
    inside = descent.gradient_descent(wall, start, Limits(steps=50))
    assert np.isfinite(inside.gradient_norm)
    assert inside.value < Bowl().value(start)


class Watched(Unbounded):
    """Records the points whose gradient is asked for: those that a method of ours accepts."""

    def gradient(self, x):
        self.path.append(np.array(x))  # type: ignore[attr-defined]
        return super().gradient(x)


def watched(problem):
    seen = Watched(problem)
    object.__setattr__(seen, "path", [])
    return seen


@pytest.mark.parametrize("method", [descent.newton_shifted, descent.newton_or_gradient, descent.gradient_descent])
@pytest.mark.parametrize("curvature", [10.0, -10.0])
def test_a_method_with_a_line_search_never_accepts_an_ascent(method, curvature):
    problem, _ = coil(curvature)
    seen = watched(problem)
    found = method(seen, problem.natural_state(), Limits(1e-8, 60))
    values = np.array([problem.value(x) for x in seen.path])
    assert len(values) > 10
    assert np.all(np.diff(values) <= descent.ROUNDING * np.abs(values[1:]).max())
    assert values[-1] < values[0] - 1.0
    assert found.value <= values.min() + 1e-12


def test_newtonr_shifts_only_where_the_hessian_is_not_positive(scene):
    """Near the minimum it is Newton's method; at the natural shape of this scene it is not."""
    problem, free, found = scene
    start = problem.natural_state()
    assert np.linalg.eigvalsh(problem.hessian(start))[0] < 0
    near = found.x + 1e-4 * np.sin(np.arange(found.x.size))
    one = Limits(1e-30, 1)
    assert np.array_equal(descent.newton_shifted(free, near, one).x, descent.newton(free, near, one).x)
    assert not np.allclose(descent.newton_shifted(free, start, one).x, descent.newton(free, start, one).x)


def test_newton_converges_quadratically_near_the_equilibrium(scene):
    """Thesis, 3.5.2: the gradient near the solution falls quadratically."""
    problem, _, found = scene
    seen = watched(problem)
    descent.newton(seen, found.x + 0.05 * np.cos(np.arange(found.x.size)), Limits(1e-12, 12))
    errors = np.array([np.linalg.norm(x - found.x) for x in seen.path])
    errors = errors[: int(np.argmax(errors < 1e-8)) + 1]
    assert len(errors) >= 4
    orders = np.log(errors[2:] / errors[1:-1]) / np.log(errors[1:-1] / errors[:-2])
    assert orders[-1] > 1.7
    assert errors[-1] < 1e-8


@pytest.mark.parametrize("curvature", [10.0, -10.0])
def test_those_that_converge_agree_on_the_first_scene(curvature):
    problem, free = coil(curvature)
    start = problem.natural_state()
    energies, ends = [], []
    for name in ("BFGS", "NEWTONR", "IPOPT-HESS", "trust-exact"):
        found = METHODS[name](free, start, Limits(1e-7))
        assert found.finished, (name, found.message)
        assert np.linalg.eigvalsh(problem.hessian(found.x))[0] > 0
        energies.append(found.value)
        ends.append(problem.joints(found.x)[0][-1])
    assert np.ptp(energies) < 1e-9
    assert np.ptp(ends, axis=0).max() < 1e-6


@pytest.mark.parametrize(
    ("name", "word"),
    [("GRADDESC", "not converged after"), ("GRADDESC, unit step", "diverged"), ("NEWTON", "diverged"),
     ("NEWTONC", "not converged after")],
)  # fmt: skip
def test_those_that_fail_on_the_first_scene_say_so(name, word):
    """As in table 3.2, K = 10."""
    problem, free = coil()
    found = METHODS[name](free, problem.natural_state(), Limits(1e-6, 500))
    assert not found.finished
    assert word in found.message
    assert not found.gradient_norm <= 1e-3


def test_second_order_needs_far_fewer_steps_on_the_first_scene(scene):
    problem, free, found = scene
    assert found.iterations <= 20
    assert METHODS["BFGS"](free, problem.natural_state(), Limits(1e-6)).iterations > 5 * found.iterations
