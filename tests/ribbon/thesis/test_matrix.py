"""The thesis's unknowns (full matrices) against finite differences and the quaternions of `ribbon.problems.mixed`."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon import Clamp, Gravity, RibbonInputError, Strip
from ribbon.element import kernel_cache
from ribbon.problems.chained import segment_lengths
from ribbon.solvers.ipopt import minimise

with kernel_cache.in_use():
    from ribbon.boundary import Closure
    from ribbon.contact import Wall
    from ribbon.problems.mixed import MixedProblem
    from ribbon.thesis.matrix import MatrixProblem

LENGTHS = np.array([0.2, 0.35, 0.15, 0.3])
HALF = 2**-0.5
START = Clamp((0.1, -0.2, 0.3), (0, 0, 1), (-HALF, HALF, 0), ruling="free")
END = Clamp((0.5, 0.1, 0.9), (1, 0, 0), (0, 0.6, 0.8), "straight")
WALLS = (Wall((0, 0, -0.4), (0.6, 0.0, 0.8)), Wall((0, 0.9, 0), (0, -1, 0), stiffness=30.0))
CURLY = Strip(1.0, 0.06, 0.4, (10.0, -6.0), 20.0)
PLAIN = Strip(1.0, 0.06, 0.4)
UP = Gravity((0.6, 0.0, 0.8))

SCENES = {
    "clamped": {"strip": CURLY, "start": START, "gravity": UP},
    "exact weight": {"strip": CURLY, "start": START, "gravity": Gravity((0.6, 0, 0.8), exact=True)},
    "clamped by rows": {"strip": CURLY, "start": START, "end": END, "gravity": UP, "held_by": "constraints"},
    "two clamps": {"strip": PLAIN, "start": START, "end": END},
    "pins": {
        "strip": PLAIN,
        "start": Clamp((0, 0, 0), None, None, ruling="free"),
        "end": Clamp((0.3, 0.4, 0.5), None, None, ruling="free"),
    },
    "circle": {"strip": PLAIN, "closure": Closure("circle", "straight")},
    "moebius": {"strip": PLAIN, "closure": Closure("moebius")},
    "moebius on a table": {"strip": CURLY, "closure": Closure("moebius"), "walls": WALLS, "gravity": UP},
    "walls": {"strip": CURLY, "start": Clamp((0, 0, 0), ruling="straight"), "walls": WALLS, "gravity": UP},
    "free between walls": {"strip": PLAIN, "walls": WALLS[:1]},
    "held at its end": {"strip": CURLY, "end": END, "gravity": UP},
}


def make(kind, strip, start=None, end=None, closure=None, walls=(), gravity=None, energy="wunderlich", **more):
    lengths = segment_lengths(more.pop("segments", LENGTHS))
    return kind(strip, start, end, closure, walls, gravity, energy, lengths, **more)


def anywhere(problem, seed):
    """Unknowns that meet no row at all, with |n| < 2 / w."""
    rng = np.random.default_rng(seed)
    x = rng.normal(size=problem.size)
    x[12 : 16 * problem.lengths.size : 16] *= 5.0
    x[13 : 16 * problem.lengths.size : 16] *= 3.0
    return x


def differences(function, x, step=1e-5):
    """Central differences of the fourth order, (..., n)."""
    columns = []
    for k in range(x.size):
        d = np.zeros(x.size)
        d[k] = step
        columns.append(
            (8.0 * (function(x + d) - function(x - d)) - (function(x + 2 * d) - function(x - 2 * d))) / (12.0 * step)
        )
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("energy", ["sadowsky", "wunderlich"])
@pytest.mark.parametrize("name", SCENES)
def test_derivatives_at_infeasible_points(name, energy):
    problem = make(MatrixProblem, **SCENES[name], energy=energy)
    for seed in (1, 2):
        x = anywhere(problem, seed)
        gradient = problem.gradient(x)
        scale = np.abs(gradient).max()
        np.testing.assert_allclose(gradient, differences(problem.value, x), rtol=1e-8, atol=1e-8 * scale)
        jacobian = problem.jacobian_matrix(x).toarray()
        np.testing.assert_allclose(jacobian, differences(problem.constraints, x), rtol=1e-8, atol=1e-8)
        multipliers = np.random.default_rng(seed + 10).normal(size=len(jacobian))

        def slope(y, multipliers=multipliers):
            return problem.gradient(y) + problem.jacobian_matrix(y).T @ multipliers

        hessian = problem.hessian_matrix(x, multipliers).toarray()
        expected = differences(slope, x)
        np.testing.assert_allclose(hessian, expected, rtol=1e-8, atol=1e-8 * np.abs(expected).max())
        rows, columns = problem.hessian_structure()
        assert np.all(rows >= columns)
        half = problem.hessian(x, multipliers, 0.5) - 0.5 * problem.hessian(x, 2.0 * multipliers, 1.0)
        assert np.abs(half).max() < 1e-12 * np.abs(expected).max()


def rank(problem, x):
    lower, upper = problem.bounds()
    return np.linalg.matrix_rank(problem.jacobian_matrix(x).toarray()[:, lower < upper]), lower


@pytest.mark.parametrize("name", ["clamped", "clamped by rows", "pins", "moebius", "held at its end"])
def test_a_glued_state_meets_the_rows_and_they_are_independent(name):
    problem = make(MatrixProblem, **SCENES[name])
    rng = np.random.default_rng(3)
    twin = make(MixedProblem, **SCENES[name])
    omega, eta = rng.normal(size=5), np.append(rng.normal(size=4) * 0.3, 0.0)
    x, y = problem.state(omega, eta), twin.state(omega, eta)
    ends = {k: v for k, v in problem.block_slices().items() if k.startswith(("end", "seam"))}
    rows = problem.constraints(x)
    for where in ends.values():
        rows[where] = 0.0
    ends = {k: v for k, v in ends.items() if k in twin.block_slices()}
    assert np.abs(rows).max() < 1e-13
    np.testing.assert_allclose(problem.energy_parts(x), twin.energy_parts(y)[:4], rtol=1e-12)  # no load at the tip
    for mine, other in zip(problem.joints(x), twin.joints(y), strict=True):
        np.testing.assert_allclose(mine, other, atol=1e-13)
    for block, where in ends.items():
        if block != "end_frame":  # of quaternions: sines of half the turn
            np.testing.assert_allclose(
                problem.constraints(x)[where], twin.constraints(y)[twin.block_slices()[block]], atol=1e-13
            )
    found, lower = rank(problem, x)
    assert found == len(rows)
    fixed = lower == problem.bounds()[1]
    left = twin.size - twin_fixed(twin) - len(twin.constraint_bounds()[0])
    assert problem.size - fixed.sum() - len(rows) == left + twin.slides  # the mixed model removes the sliding seam
    if not ends:
        assert not problem.flipped(x)


def twin_fixed(twin):
    lower, upper = twin.bounds()
    return int((lower == upper).sum())


def agree(scene, omega, eta, energy="wunderlich", segments=12, options=None):
    """Both formulations from the same shape; returns the solutions after comparing them."""
    options = {"tol": 1e-12, **(options or {})}
    mixed = make(MixedProblem, **scene, energy=energy, segments=segments)
    matrix = make(MatrixProblem, **scene, energy=energy, segments=segments)
    s = np.concatenate([[0.0], np.cumsum(mixed.lengths)])
    omega, eta = omega(s), eta(s)
    one = minimise(mixed, mixed.state(omega, eta), options)
    two = minimise(matrix, matrix.state(omega, eta), options)
    compare(mixed, matrix, one, two)
    return mixed, matrix, one, two


def compare(mixed, matrix, one, two):
    assert one.residual < 1e-8
    assert two.residual < 1e-8
    assert not matrix.flipped(two.x)
    energy = mixed.value(one.x)
    assert abs(matrix.value(two.x) - energy) < 1e-10 * max(1.0, abs(energy))
    for mine, other in zip(matrix.joints(two.x), mixed.joints(one.x), strict=True):
        assert np.abs(mine - other).max() < 1e-8


@pytest.mark.parametrize("held_by", ["elimination", "constraints"])
@pytest.mark.parametrize("energy", ["sadowsky", "wunderlich"])
def test_a_hanging_curl_is_the_same(energy, held_by):
    scene = {
        "strip": Strip(1.0, 0.05, 0.4, 6.0, 20.0),
        "start": Clamp(ruling="free"),
        "gravity": Gravity((0.6, 0.0, 0.8)),
        "held_by": held_by,
    }
    agree(scene, lambda s: 6.0 + 0.1 * s, lambda s: 0.02 - 0.1 * s, energy)


@pytest.mark.parametrize("energy", ["sadowsky", "wunderlich"])
def test_two_clamps_are_the_same_with_their_forces_and_moments(energy):
    # the end of the arc omega = 1, moved and turned about its tangent
    tangent, normal = np.array([0.0, -np.sin(1.0), np.cos(1.0)]), np.array([0.0, np.cos(1.0), np.sin(1.0)])
    turned = np.cos(0.3) * normal + np.sin(0.3) * np.cross(tangent, normal)
    end = Clamp((0.02, -(1 - np.cos(1.0)), 0.97 * np.sin(1.0)), tangent, turned, ruling="free")
    scene = {"strip": Strip(1.0, 0.05, 0.5, gamma=1.0), "start": Clamp(ruling="free"), "end": end, "gravity": Gravity()}
    mixed, matrix, one, two = agree(scene, lambda s: 1.0 + 0 * s, lambda s: 1e-3 + 0 * s, energy)
    for name in ("end_position", "end_frame"):
        mine, other = two.rows[matrix.block_slices()[name]], one.rows[mixed.block_slices()[name]]
        np.testing.assert_allclose(mine, other, atol=1e-6 * np.abs(other).max())


def test_a_wall_is_the_same_and_pushes_as_hard():
    scene = {
        "strip": Strip(1.0, 0.05, 0.4, gamma=40.0),
        "start": Clamp((0, 0, 0), (1, 0, 0), (0, 0, 1), ruling="free"),
        "gravity": Gravity(),
        "walls": (Wall((0, 0, -0.2), (0, 0, 1)),),
    }
    mixed, matrix, one, two = agree(scene, lambda s: 0.5 + 0 * s, lambda s: 1e-3 + 0 * s)
    mine, other = two.rows[matrix.block_slices()["wall_0"]], one.rows[mixed.block_slices()["wall_0"]]
    assert (mine.size, other.size) == (26, 24)  # what a level clamp gives at its own joint the mixed model leaves out
    assert other.sum() < -1.0
    assert mine.sum() == pytest.approx(other.sum(), rel=1e-6)


def test_a_moebius_band_is_the_same_from_the_state_of_the_other():
    lengths = segment_lengths(20)
    strip = Strip(1.0, 0.05)
    closure = Closure("moebius", "straight")  # a free seam slides in one model and is held by a gauge in the other
    mixed = MixedProblem(strip, None, None, closure, (), None, "wunderlich", lengths)
    matrix = MatrixProblem(strip, None, None, closure, (), None, "wunderlich", lengths)
    s = np.concatenate([[0.0], np.cumsum(lengths)])
    seed = mixed.state(2.0 * np.pi * np.cos(np.pi * s) * np.sqrt(2), np.sin(np.pi * s))
    one = minimise(mixed, seed, {"tol": 1e-12, "max_iter": 500})
    assert one.finished
    table = np.append(one.x, 0.0).reshape(-1, 10)
    start = matrix.state(table[:, 7], table[:, 8])
    assert not matrix.flipped(start)
    assert np.abs(matrix.constraints(start)).max() < 1e-9
    two = minimise(matrix, start, {"tol": 1e-12, "max_iter": 500})
    compare(mixed, matrix, one, two)


def test_flipped_frames_meet_all_rows_and_are_found():
    end = Clamp((0.0, 0.0, 1.0), (0, 0, 1), (0, 1, 0), ruling="free")
    problem = make(MatrixProblem, PLAIN, start=Clamp(ruling="free"), end=end)
    straight = problem.state(np.zeros(5), np.zeros(5))
    assert np.abs(problem.constraints(straight)).max() < 1e-14
    assert not problem.flipped(straight)
    # a left-handed frame and half a turn about the tangent: the straight segment does not leave its line
    for turn in (np.diag([1.0, -1.0, 1.0]), np.diag([-1.0, -1.0, 1.0])):
        x = straight.copy()
        x[35:44] = turn.ravel()
        assert np.abs(problem.constraints(x)).max() < 1e-14
        assert problem.flipped(x)
    # a third of a turn: no product is negative, all of them are zero
    loose = make(MatrixProblem, PLAIN, start=Clamp(ruling="free"))
    x = straight.copy()
    turn = np.roll(np.eye(3), 1, axis=1)
    x[35:44] = x[51:60] = turn.ravel()
    x[48:51] = x[32:35] + LENGTHS[2] * turn[:, 2]
    assert np.abs(loose.constraints(x)).max() < 1e-14
    assert loose.flipped(x)
    turned = Clamp((0.0, 0.0, 1.0), (0, 0, 1), (0, -1, 0), ruling="free")
    other = make(MatrixProblem, PLAIN, start=Clamp(ruling="free"), end=turned)
    assert np.abs(other.constraints(straight)).max() < 1e-14
    assert other.flipped(straight)


def test_the_seam_knows_its_half_turn():
    circle = make(MatrixProblem, PLAIN, closure=Closure("circle"))
    round_ = circle.state(np.full(5, 2 * np.pi), np.zeros(5))
    assert np.abs(circle.constraints(round_)).max() < 1e-13
    assert not circle.flipped(round_)
    moebius = make(MatrixProblem, PLAIN, closure=Closure("moebius"))
    rows = moebius.constraints(round_)
    assert np.abs(rows[moebius.block_slices()["end_frame"]]).max() < 1e-13
    assert moebius.flipped(round_)


def test_a_trial_point_that_winds_up_has_no_value():
    problem = make(MatrixProblem, **SCENES["clamped"])
    x = problem.state(np.zeros(5), np.zeros(5))
    x[16 + 12 : 16 + 16] = 1e7, 1.0, 1.0, 1e7
    assert np.isnan(problem.value(x))
    assert np.any(np.isnan(problem.constraints(x)))


def test_a_band_of_one_segment_is_refused():
    with pytest.raises(RibbonInputError, match="segments"):
        make(MatrixProblem, PLAIN, closure=Closure("circle"), segments=1)
