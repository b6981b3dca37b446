"""Coils of many layers by their joints' curvatures alone: derivatives, the quadratic step, 5.5 turns, weight."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from ribbon import Clamp, Gravity, Strip
from ribbon.find.layers import plane, quadratic
from ribbon.find.layers.bent import Bent, Gaps
from ribbon.find.layers.facing import Faced, crossed, faced
from ribbon.find.solve import build, solve_shape
from ribbon.judge import nearness
from ribbon.result import Status

#: Energy (D w / l) and sum of the pushes (D w / l^2) of 5.5 turns, K = 42, 0.003 l thick, by the planar elastica on 110
#: elements of degree 3 (`tests.validation.elastica.layers.coil`, five seconds): results/layers.md.
ELASTICA = (-845.26921, 18905.79)


def wound(turns: float, thick: float, segments: int, loosely: float = 1.5) -> np.ndarray:
    """Curvatures (1/l) at the joints of a strip wound loosely, by half more than it is thick."""
    rise, angle = loosely * thick / (2.0 * math.pi), 2.0 * math.pi * turns
    first = (1.0 - 0.5 * rise * angle**2) / angle
    return 1.0 / np.sqrt(first**2 + 2.0 * rise * np.linspace(0.0, 1.0, segments + 1))


def problem_of(curved: float, thick: float, segments: int, gamma: float = 0.0):
    strip = Strip(1.0, 0.05, 0.3, natural_curvature=curved, gamma=gamma)
    up = Gravity((0.0, -1.0, 0.0)) if gamma else None
    return build(strip, Clamp((0, 0, 0), (1, 0, 0), (0, 1, 0)), gravity=up, segments=segments, apart=thick)


@cache
def coil():
    """5.5 turns, wound loosely and let go."""
    return solve_shape(problem_of(42.0, 0.003, 110), wound(5.5, 0.003, 110), np.zeros(111))


def test_derivatives_by_curvatures_are_those_by_differences() -> None:
    problem = problem_of(20.0, 0.01, 24, gamma=100.0)
    omega, none = wound(2.5, 0.01, 24), np.zeros(25)
    places = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    places[-1] = 1.0

    def at(curvatures):
        x = problem.state(curvatures, none)
        there = faced(problem, x, places, 0.02)
        gaps = Gaps(problem.with_changes(pairs=there.pairs).pair_rows(), x)
        return Bent(problem, x), gaps

    bent, gaps = at(omega)
    assert gaps.gap.size > 10
    draw = np.random.default_rng(4)
    pushes, way, step = draw.uniform(1.0, 50.0, gaps.gap.size), draw.normal(size=25), 1e-5
    (ahead, gaps_ahead), (back, gaps_back) = at(omega + step * way), at(omega - step * way)
    slope = (problem.value(ahead.x) - problem.value(back.x)) / (2.0 * step)
    assert bent.gradient @ way == pytest.approx(slope, rel=1e-7)
    np.testing.assert_allclose(gaps.slopes(bent) @ way, (gaps_ahead.gap - gaps_back.gap) / (2.0 * step), atol=1e-8)
    turned = (ahead.gradient - back.gradient - pushes @ (gaps_ahead.slopes(ahead) - gaps_back.slopes(back))) / (
        2.0 * step
    )
    np.testing.assert_allclose(bent.hessian(gaps, pushes) @ way, turned, atol=1e-6 * np.abs(turned).max())


def test_a_coil_that_is_wound_far_more_loosely_is_the_same() -> None:
    """From layers seven thicknesses apart, which would rest on nothing, to those that lie on each other."""
    states = [
        solve_shape(problem_of(22.0, 0.002, 60), wound(2.5, 0.002, 60, loosely), np.zeros(61)) for loosely in (1.5, 7.0)
    ]
    assert [state.status for state in states] == [Status.CONVERGED, Status.CONVERGED]
    assert states[1].energy.total == pytest.approx(states[0].energy.total, rel=1e-9)
    assert min(len(state.pairs) for state in states) > 20


def test_a_quadratic_step_is_its_least() -> None:
    """Stationary, feasible, complementary; with more rows than unknowns, and rows that repeat each other."""
    draw = np.random.default_rng(5)
    for _ in range(10):
        half, rows = draw.normal(size=(12, 12)), draw.normal(size=(20, 12))
        rows[10:15] = rows[:5]
        hessian, slope = half @ half.T + np.eye(12), draw.normal(size=12)
        gap = rows @ draw.normal(size=12) + 0.5
        gap[10:15] = gap[:5]
        factor = np.linalg.cholesky(hessian), True
        step, push = quadratic.least(factor, slope, rows, gap, np.zeros(20, dtype=bool))
        left = rows @ step + gap
        assert push.min() >= 0.0
        assert left.min() > -1e-6
        assert abs(push @ left) < 1e-5
        np.testing.assert_allclose(hessian @ step + slope, rows.T @ push, atol=1e-8)


def test_many_layers_are_the_planar_elasticas_and_stable() -> None:
    """Energy, the whole push, and the verdict in space."""
    found = coil()
    assert found.status.code == "converged"
    assert found.residual <= 1e-8
    assert found.energy.total == pytest.approx(ELASTICA[0], rel=1e-5)
    push = sum(np.linalg.norm(pair.force) for pair in found.pairs)
    assert push == pytest.approx(ELASTICA[1], rel=1e-3)
    assert not nearness.minima(found.problem, found.x, -nearness.TOLERANCE)
    act = -found.rows[found.problem.block_slices()["pairs"]]
    assert act.min() >= 0.0
    assert np.abs(act * found.problem.pair_rows().gaps(found.x)).max() < 1e-8


def test_layers_that_slide_aside_neither_open_nor_close() -> None:
    """As faces: an outer turn drawn out along the axis by a tenth of the width is as near as before."""
    found = coil()
    problem, x = found.problem, found.x.copy()
    rows = problem.pair_rows()
    before = rows.gaps(x)
    axis = problem.joints(x)[1][0][:, 0]
    along = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    problem.layout.positions(x)[:] += (0.1 * problem.strip.relative_width * along)[:, None] * axis
    assert np.abs(problem.pair_rows().ends(x)[0] - rows.ends(found.x)[0]).max() > 1e-3
    np.testing.assert_allclose(problem.pair_rows().gaps(x), before, atol=1e-9)


def test_weight_is_balanced_by_the_clamp() -> None:
    """In the plane, with layers: the clamp's force is the weight, its moment the weight's about it."""
    problem = problem_of(20.0, 0.01, 60, gamma=100.0)
    found = plane.lain(problem, problem.state(wound(2.5, 0.01, 60), np.zeros(61)))
    assert found is not None
    held, minimum = found
    force = held.start_force(minimum.x, minimum.rows)
    np.testing.assert_allclose(force.force, (0.0, -100.0, 0.0), atol=1e-8)
    middle = nearness.shape(held, minimum.x, (np.arange(4000) + 0.5) / 4000).r.mean(axis=0)
    np.testing.assert_allclose(force.moment, -np.cross(middle, (0.0, 100.0, 0.0)), atol=1e-4)
    assert len(held.pairs) > 40


def test_a_layer_that_went_to_the_other_side_is_seen() -> None:
    before = Faced((), np.array([3, 4]), np.array([1, 1]), np.array([0.5, 0.6]))
    slid = before._replace(foot=np.array([0.51, 0.61]))
    assert not crossed(before, slid, 0.03)
    assert crossed(before, slid._replace(side=np.array([1, -1])), 0.03)
    assert not crossed(before, slid._replace(side=np.array([1, -1]), foot=np.array([0.51, 0.9])), 0.03)
