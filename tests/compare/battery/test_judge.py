"""The battery's judge of ribbons: its derivatives against differences, and that it turns red for what is wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compare.battery.judge.curve import integrated, segments
from compare.battery.judge.discrete import Discrete
from compare.battery.judge.elastic import elastic, width_factor
from compare.battery.judge.ribbon import judged, lowest, multipliers
from compare.models import solve
from compare.scene.scene import load
from ribbon import Status
from ribbonbench.linking import linking

SCENES = ("figure_4_1", "two_clamps_5_3_2", "moebius_table_fallen")


@pytest.fixture(scope="module")
def states():
    return {name: solve(load(name)).native for name in SCENES}


@pytest.fixture
def parameters():
    rng = np.random.default_rng(1)
    lengths = np.array([0.2, 0.5, 0.3])
    return rng.normal(size=(3, 4)) * np.array([8.0, 5.0, 1.0, 0.5]), lengths


def test_matrices_are_the_integrated_curve(parameters):
    q, lengths = parameters
    joints = np.concatenate([[0.0], np.cumsum(lengths)])

    def kappa(s):
        i = min(int(np.searchsorted(joints, s, side="right")) - 1, 2)
        u = s - joints[i]
        omega = q[i, 0] * u + q[i, 1]
        return np.array([omega, 0.0, omega * (q[i, 2] * u + q[i, 3])])

    r, frames = integrated(kappa, joints, np.eye(3), np.zeros(3), joints)
    y = np.column_stack([np.eye(3), np.zeros((3, 2))])
    for k, matrix in enumerate(segments(q, lengths).matrix):
        y = y @ matrix
        assert np.abs(y[:, :3] - frames[k + 1]).max() < 1e-10
        assert np.abs(y[:, 3] - r[k + 1]).max() < 1e-10


def test_derivatives_of_matrices_are_differences(parameters):
    q, lengths = parameters
    found = segments(q, lengths)
    step = 1e-4
    for k in range(4):
        high, low = (segments(q + sign * step * np.eye(4)[k], lengths) for sign in (1.0, -1.0))
        assert np.abs((high.matrix - low.matrix) / (2 * step) - found.first[:, k]).max() < 1e-7
        assert np.abs((high.first - low.first) / (2 * step) - found.second[:, k]).max() < 1e-6


def test_width_factor_is_continuous_where_its_series_ends():
    below, above = width_factor(np.array([0.25 - 1e-12])), width_factor(np.array([0.25 + 1e-12]))
    for first, second in zip(below, above, strict=True):
        assert abs(first[0] - second[0]) < 1e-11


@pytest.mark.parametrize("energy", ["sadowsky", "wunderlich"])
def test_derivatives_of_the_elastic_energy_are_differences(parameters, energy):
    q, lengths = parameters
    arguments = energy, 0.2, 0.3, (2.0, 3.0)
    found, step = elastic(q, lengths, *arguments), 1e-5
    for i in range(3):
        for k in range(4):
            move = np.zeros_like(q)
            move[i, k] = step
            high, low = elastic(q + move, lengths, *arguments), elastic(q - move, lengths, *arguments)
            assert (high.value - low.value) / (2 * step) == pytest.approx(found.gradient[i, k], abs=1e-7, rel=1e-7)
            slope = (high.gradient[i] - low.gradient[i]) / (2 * step)
            assert slope == pytest.approx(found.hessian[i, k], abs=1e-5, rel=1e-6)


@pytest.mark.parametrize("name", SCENES)
def test_hessian_is_the_gradients_difference(states, name):
    own = Discrete(states[name])
    force = multipliers(own)[0]
    move = np.random.default_rng(0).normal(size=own.size) * 1e-6
    move[own.size - own.places :] = 0.0  # the place is no part of q
    q = np.einsum("pkn,n->pk", own.by_joints, move)
    high, low = (Discrete(states[name], own.q + sign * q) for sign in (1.0, -1.0))
    slope = [side.gradient + side.jacobian.T @ force for side in (high, low)]
    expected = own.hessian(force) @ move
    assert np.abs(0.5 * (slope[0] - slope[1]) - expected).max() < 1e-7 * np.abs(expected).max()


@pytest.mark.parametrize("name", SCENES)
def test_what_the_solver_found_is_right(states, name):
    checks = [check for check in judged(states[name]) if not check.what.startswith("penetration")]
    assert [f"{c.what}: {c.value} ({c.said})" for c in checks if not c.ok] == []
    assert len(checks) >= 6


def _red(found, what):
    return [check.what for check in judged(found) if not check.ok and check.what.startswith(what)]


def test_a_point_beside_the_equilibrium_is_not_in_balance(states):
    found = states["figure_4_1"]
    x = found.x.copy()
    x[0] *= 1.0 + 1e-5
    assert _red(replace(found, x=x), "not in balance")


def test_a_wrong_energy_is_seen(states):
    found = states["two_clamps_5_3_2"]
    assert _red(replace(found, energy=replace(found.energy, bending=found.energy.bending * (1.0 + 1e-7))), "energy")


@pytest.mark.parametrize("name", SCENES[:2])
def test_a_wrong_status_is_seen(states, name):
    assert _red(replace(states[name], status=Status.SADDLE), "status")


def test_a_saddle_is_known_as_one():
    from ribbon import Clamp, Gravity, Strip
    from ribbon import solve as ribbon_solve

    up = Gravity(up=(0.0, 0.0, 1.0))  # a column beyond Greenhill's load stands straight on a saddle
    found = ribbon_solve(Strip(1.0, 0.05, gamma=10.0), Clamp(), up, segments=12, seed_curvature=0.0)
    assert found.status is Status.SADDLE
    own = Discrete(found)
    assert lowest(own, np.empty(0))[0] < -0.1
    assert _red(found, "status") == []
    assert _red(replace(found, status=Status.CONVERGED), "status")


def test_what_goes_through_a_wall_is_seen(states):
    found = states["moebius_table_fallen"]
    wall = found.problem.walls[0]
    higher = replace(wall, point=tuple(np.asarray(wall.point) + 1e-3 * np.asarray(wall.normal)))
    assert _red(replace(found, problem=found.problem.with_changes(walls=(higher,))), "penetration")


@pytest.mark.parametrize("turns", [-3, 0, 1, 2])
def test_linking_of_a_circle_and_a_line_that_winds_around_it(turns):
    s = np.linspace(0.0, 2.0 * np.pi, 80, endpoint=False)
    axis = np.stack([np.cos(s), np.sin(s), 0.0 * s], axis=1)
    out, up = axis, np.array([0.0, 0.0, 1.0])
    beside = axis + 0.1 * (np.cos(turns * s)[:, None] * out + np.sin(turns * s)[:, None] * up)
    assert linking(axis, beside) == pytest.approx(turns, abs=1e-7)
    assert linking(axis, beside[::-1]) == pytest.approx(-turns, abs=1e-7)
    assert linking(axis, beside + 5.0) == pytest.approx(0.0, abs=1e-7)
