"""Predictors of the shell's path: exact for polynomials, rates against differences, the same states in fewer steps."""

import numpy as np
import pytest

from shellref import ShellOptions
from shellref.path.point import Point, Walk
from shellref.path.predictor import AIM, hasty, jumped, next_step, predicted
from shellref.path.solve import Solver, solve
from shellref.shell.naghdi import Stress
from shellref.shell.strip import build_strip
from tests.shellref.path.test_shell_begin import CURL


def polynomial(degree):
    """Random positions (5, 3) of this degree in the load beside fixed unit directors; value and rate."""
    c = np.random.default_rng(degree).standard_normal((degree + 1, 5, 3))
    directors = np.broadcast_to([0.6, 0.0, 0.8], (5, 3))

    def value(t):
        return np.hstack([sum(c[k] * t**k for k in range(degree + 1)), directors])

    def rate(t):
        return np.hstack([sum(k * c[k] * t ** (k - 1) for k in range(1, degree + 1)), 0.0 * directors])

    return value, rate


@pytest.mark.parametrize(
    ("order", "points", "early", "late"),
    [(1, 1, False, False), (2, 1, False, True), (2, 2, False, False), (3, 2, False, True), (4, 2, True, True)],
)
def test_a_predictor_of_order_p_is_exact_for_polynomials_below_it(order, points, early, late):
    for degree, exact in ((order - 1, True), (order, False)):
        value, rate = polynomial(degree)
        none = Stress(np.zeros(1), np.zeros(1))

        def point(t, known, value=value, rate=rate, none=none):
            return Point(t, value(t), none, 0, (rate(t), none) if known else None)

        walk = Walk(point(0.4, late), point(0.1, early) if points == 2 else None)
        found = predicted(walk, 0.9)
        assert found.order == order
        assert bool(np.abs(found.state - value(0.9)).max() < 1e-12) is exact


def test_steps_follow_the_error_of_the_predictor():
    assert next_step(0.1, AIM / 16.0, 4, 3.0, 0.4) == pytest.approx(0.2)
    assert next_step(0.1, AIM * 16.0, 4, 3.0, 0.4) == pytest.approx(0.05)
    assert next_step(0.1, 0.0, 4, 1.5, 0.4) == pytest.approx(0.15)
    assert next_step(0.1, 1e3, 2, 1.5, 0.4) == pytest.approx(0.04)


def test_a_state_that_was_not_foreseen_is_on_another_branch():
    assert jumped(0.05, 0.02, 4)
    assert not jumped(0.05, 0.2, 2)  # a tangent foresees too much where the strip stiffens
    assert not jumped(5e-4, 0.0, 4)
    assert not jumped(0.5, 0.0, 1)  # nothing was foreseen
    assert hasty(0.18, 0.023, 4)  # a roof at its limit load
    assert not hasty(0.05, 0.023, 4)
    assert not hasty(0.18, 0.023, 2)


@pytest.mark.shell
def test_rates_are_those_of_the_path():
    """Of nodal values and stress at 0.3 of the weight, against central differences of equilibria beside it."""
    pytest.importorskip("dolfinx")
    options = ShellOptions(tolerance=1e-10, max_newton=30)
    from shellref.fenics import dolfinx_api as api

    solver = Solver(build_strip(CURL, options), options, api.communicator("self"), lambda event: None)
    stage, e = solver.strip.stages[0], solver.equilibrium
    state, stress = solver.strip.initial_state(solver.model.nodes), None
    found = {}
    for load in (0.0, 0.15, 0.29, 0.31, 0.3):
        attempt = e.solve(state, stress, stage, load)
        assert attempt.converged
        found[load] = (attempt.state, solver.model.stress(attempt.state))
        state, stress = attempt.state, attempt.stress
    assert e.rate(found[0.15][0], stage, 0.15) is None  # not the state of the factors
    sway, change = e.rate(attempt.state, stage, 0.3)
    slope = (found[0.31][0] - found[0.29][0]) / 0.02
    assert np.abs(sway - slope).max() < 2e-3 * np.abs(slope).max()
    bending = (found[0.31][1].full - found[0.29][1].full)[..., :3] / 0.02
    assert np.abs(change.full[..., :3] - bending).max() < 1e-2 * np.abs(bending).max()


@pytest.mark.shell
def test_the_path_with_predictors_ends_in_the_same_state():
    """Every point of the way is one of the plain way too; the end is found in fewer iterations."""
    pytest.importorskip("dolfinx")
    plain, found = (solve(CURL, ShellOptions(predict=predict)) for predict in (False, True))
    assert np.abs(plain.surface.points - found.surface.points).max() < 1e-10
    assert found.energy["total"] == pytest.approx(plain.energy["total"], abs=1e-10)
    assert found.newton_iterations < 0.8 * plain.newton_iterations
    ends = {step.load: np.array(step.values["end"]) for step in plain.steps if step.accepted}
    shared = [step for step in found.steps if step.accepted and step.load in ends]
    assert len(shared) > 2
    for step in shared:
        assert np.abs(np.array(step.values["end"]) - ends[step.load]).max() < 1e-7
