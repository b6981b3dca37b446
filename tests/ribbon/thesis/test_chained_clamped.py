"""The chained ribbon with a clamped end: derivatives, and its solution against that of `ribbon.problems.mixed`."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon import Clamp, Gravity, RibbonInputError, Strip
from ribbon.element import kernel_cache
from ribbon.problems.chained import segment_lengths
from ribbon.solvers.ipopt import minimise

with kernel_cache.in_use():
    from ribbon.problems.mixed import MixedProblem
    from ribbon.thesis.chained_clamped import ChainedClampedProblem

LENGTHS = np.array([0.2, 0.35, 0.15, 0.3])
HALF = 2**-0.5
START = Clamp((0.1, -0.2, 0.3), (0, 0, 1), (-HALF, HALF, 0), ruling="free")
CURLY = Strip(1.0, 0.06, 0.4, (10.0, -6.0), 20.0)
PLAIN = Strip(1.0, 0.06, 0.4)
END = Clamp((0.5, 0.1, 0.9), (1, 0, 0), (0, 0.6, 0.8), "straight")
SCENES = {
    "weight": (CURLY, END, Gravity((0.6, 0.0, 0.8))),
    "weightless": (PLAIN, END, None),
    "a point": (PLAIN, Clamp((0.5, 0.1, 0.9), None, None, ruling="free"), None),
    "a frame": (PLAIN, Clamp(None, (1, 0, 0), (0, 0.6, 0.8), ruling="free"), None),
}


def differences(function, x, step=1e-5):
    """Central differences of the fourth order, (..., n)."""
    columns = []
    for d in step * np.eye(x.size):
        near, far = function(x + d) - function(x - d), function(x + 2 * d) - function(x - 2 * d)
        columns.append((8.0 * near - far) / (12.0 * step))
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("name", SCENES)
def test_derivatives_at_infeasible_points(name):
    strip, end, gravity = SCENES[name]
    problem = ChainedClampedProblem(strip, START, end, gravity, "wunderlich", LENGTHS)
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        x = rng.normal(size=problem.size) * np.tile([5.0, 1.0], 5)
        np.testing.assert_allclose(problem.gradient(x), differences(problem.value, x), rtol=1e-7, atol=1e-7)
        jacobian = problem.jacobian_matrix(x)
        np.testing.assert_allclose(jacobian, differences(problem.constraints, x), rtol=1e-8, atol=1e-9)
        assert np.array_equal(problem.jacobian(x), jacobian.ravel())
        multipliers = rng.normal(size=len(jacobian))

        def slope(y, multipliers=multipliers):
            return problem.gradient(y) + problem.jacobian_matrix(y).T @ multipliers

        hessian = problem.hessian_matrix(x, multipliers)
        expected = differences(slope, x)
        np.testing.assert_allclose(hessian, expected, rtol=1e-8, atol=1e-9 * np.abs(expected).max())
        # the rows alone, which the energy may hide
        rows = problem.hessian_matrix(x, multipliers, 0.0)
        bent = differences(lambda y, problem=problem, m=multipliers: problem.jacobian_matrix(y).T @ m, x)
        np.testing.assert_allclose(rows, bent, rtol=1e-8, atol=1e-9 * np.abs(bent).max())
        assert np.array_equal(problem.hessian(x, multipliers), hessian[problem.hessian_structure()])


@pytest.mark.parametrize("energy", ["sadowsky", "wunderlich"])
def test_an_arc_with_its_end_moved_is_that_of_the_mixed_model(energy):
    tangent, normal = np.array([0.0, -np.sin(1.0), np.cos(1.0)]), np.array([0.0, np.cos(1.0), np.sin(1.0)])
    turned = np.cos(0.1) * normal + np.sin(0.1) * np.cross(tangent, normal)
    end = Clamp((0.01, -(1 - np.cos(1.0)), 0.98 * np.sin(1.0)), tangent, turned, ruling="free")
    strip, lengths = Strip(1.0, 0.05, 0.5, gamma=1.0), segment_lengths(8)
    chained = ChainedClampedProblem(strip, Clamp(ruling="free"), end, Gravity(), energy, lengths)
    mixed = MixedProblem(strip, Clamp(ruling="free"), end, None, (), Gravity(), energy, lengths)
    one = minimise(chained, chained.linear((1.0, 1.0), (1e-3, 1e-3)), {"tol": 1e-12})
    two = minimise(mixed, mixed.state(np.ones(9), np.full(9, 1e-3)), {"tol": 1e-12})
    assert one.residual < 1e-8
    assert two.residual < 1e-8
    assert not chained.flipped(one.x)
    assert chained.value(one.x) == pytest.approx(mixed.value(two.x), rel=1e-10)
    assert chained.energy_parts(one.x).sum() == pytest.approx(chained.value(one.x), rel=1e-14)
    for mine, other in zip(chained.joints(one.x), mixed.joints(two.x), strict=True):
        assert np.abs(mine - other).max() < 1e-8
    np.testing.assert_allclose(chained.parameters(one.x), mixed.parameters(two.x), atol=1e-6)
    for name, where in chained.block_slices().items():
        other = two.rows[mixed.block_slices()[name]]
        np.testing.assert_allclose(one.rows[where], other, atol=1e-6 * np.abs(other).max())


def test_rows_that_hold_in_a_flipped_frame_are_found():
    """The seven wrong frames (thesis, 5.1): all rows hold, and `flipped` tells."""
    wrong = [np.diag(signs) for signs in ((-1, -1, 1), (-1, 1, -1), (1, -1, -1))]
    cycle = np.roll(np.eye(3), 1, axis=1)
    wrong += [cycle @ np.diag(signs) for signs in ((1, 1, 1), (-1, -1, 1), (-1, 1, -1), (1, -1, -1))]
    straight = np.zeros(10)
    for frame in wrong:
        # the straight ribbon has G = 1; it meets a clamp H at its end when H is one of these (or their transposes)
        for held in (frame, frame.T):
            end = Clamp((0.0, 0.0, 1.0), held[:, 2], held[:, 1], ruling="free")
            problem = ChainedClampedProblem(PLAIN, Clamp(ruling="free"), end, None, "sadowsky", LENGTHS)
            if np.abs(problem.constraints(straight)).max() < 1e-14:
                break
        else:
            pytest.fail("the rows exclude this frame")
        assert problem.flipped(straight)


def test_a_trial_point_that_winds_up_has_no_value():
    problem = ChainedClampedProblem(CURLY, START, END, Gravity(), "sadowsky", LENGTHS)
    x = problem.linear((1e7, 1e7), (1e7, 0.0))
    assert np.isnan(problem.value(x))
    assert np.all(np.isnan(problem.constraints(x)))
    assert np.isfinite(problem.value(problem.linear((1000.0, 1000.0), (0.1, 0.0))))


def test_what_the_model_cannot_hold_is_refused():
    with pytest.raises(RibbonInputError, match="start"):
        ChainedClampedProblem(PLAIN, Clamp(None, ruling="free"), END, None, "sadowsky", LENGTHS)
    with pytest.raises(RibbonInputError, match="exact"):
        ChainedClampedProblem(PLAIN, START, END, Gravity(exact=True), "sadowsky", LENGTHS)
