"""Heavy strips: residuals over the size of forces, coils that begin pulled out, and the sign of a wide spectrum."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ribbon import Clamp, Gravity, Status, Strip, solve
from ribbon.find import doubling, seeds
from ribbon.find.adaptive import solve_to_tolerance
from ribbon.find.solve import build
from ribbon.judge.stability import negative
from ribbon.problems import transfer
from ribbon.solvers.problem import force_scale, kkt_residual

UP = Gravity(up=(0.0, 1.0, 0.0))


def problem(gamma, curl=0.0, segments=40):
    return build(Strip(1.0, 0.05, 0.4, curl, gamma), Clamp(), UP, segments=segments)


@pytest.mark.parametrize(("gamma", "curl", "scale"), [(1e5, 0.0, 1.0), (1e9, 0.0, 1e3), (0.0, 1e4, 100.0)])
def test_residuals_are_over_a_millionth_of_weight_and_curl(gamma, curl, scale):
    assert force_scale(problem(gamma, curl)) == pytest.approx(scale)


def test_the_residual_is_the_gradient_over_its_scale():
    heavy = problem(1e8)
    x = heavy.state(np.zeros(41), np.zeros(41))
    free = heavy.bounds()[0] < heavy.bounds()[1]
    largest = np.abs(heavy.gradient(x)[free]).max()
    assert kkt_residual(heavy, x, np.zeros_like(x)) == pytest.approx(largest / 100.0, rel=1e-12)


def test_a_coil_begins_pulled_out_where_the_weight_can_pull_it_out():
    assert seeds.hanging(problem(1e3, curl=100.0)) is None
    omega = seeds.hanging(problem(1e6, curl=100.0))
    s = seeds.joints(problem(1e6, curl=100.0).lengths)
    assert omega[-1] == pytest.approx(100.0, rel=1e-3)
    assert np.abs(omega[(s > 0.2) & (s < 0.9)]).max() < 1.0
    turned = np.sum((0.5 * (omega[1:] + omega[:-1]) * np.diff(s))[s[1:] < 0.5])
    assert turned == pytest.approx(math.pi / 2, rel=0.05)  # down


def test_graded_segments_end_short_at_a_curled_end():
    flat, curled = (seeds.graded(problem(1e6, curl=curl)) for curl in (0.0, 100.0))
    assert flat.sum() == pytest.approx(1.0)
    assert curled.sum() == pytest.approx(1.0)
    assert curled[-1] < 0.3 * flat[-1]
    assert flat[0] == pytest.approx(curled[0], rel=0.2)


@pytest.mark.parametrize("size", [1.0, 1e6, 1e13])
@pytest.mark.parametrize(("soft", "below"), [(1e-3, False), (-0.1, True)])
def test_the_sign_of_a_wide_spectrum_is_told(size, soft, below):
    rng = np.random.default_rng(3)
    spread = np.diag(np.concatenate([np.full(5, math.sqrt(size)), np.ones(5)]))
    turn = np.linalg.qr(rng.normal(size=(10, 10)))[0]
    core = turn @ np.diag([soft, *np.ones(9)]) @ turn.T
    assert negative(spread @ core @ spread, np.ones(10)) is below


def test_rounding_is_not_a_negative_direction():
    rng = np.random.default_rng(4)
    factor = rng.normal(size=(30, 10))
    assert not negative(factor @ factor.T, np.ones(30))  # twenty eigenvalues are zero
    assert not negative(1e-17 * rng.normal(size=(30, 30)), np.full(30, 1e-3))  # nothing but rounding


def test_a_heavy_strip_that_hangs_out_of_its_clamps_plane_is_no_saddle():
    up = Gravity(up=tuple(np.array([0.17, 0.825, 0.565]) / np.linalg.norm([0.17, 0.825, 0.565])))
    equilibrium = solve_to_tolerance(Strip(1.0, 0.05, 0.4, 0.0, 1e4), Clamp(), up, tolerance=1e-3)
    assert equilibrium.ok, equilibrium.message


def test_a_heavy_coil_leaves_its_plane():
    lengths = seeds.graded(problem(1e5, 30.0, 20))
    strip = Strip(1.0, 0.05, 0.4, 30.0, 1e5)
    plane = solve(strip, Clamp(), UP, segments=lengths)
    assert plane.status is Status.SADDLE
    assert plane.residual < 1e-8
    found = solve(strip, Clamp(), UP, segments=lengths, leave_saddle=True)
    assert found.ok
    assert found.energy.total < plane.energy.total
    assert found.end.position[1] < -0.9  # it hangs


@pytest.mark.parametrize(("gamma", "segments"), [(3e5, 240), (1e6, 160), (1e6, 320), (1e7, 160), (1e9, 160)])
def test_a_heavy_flat_strip_has_no_loop_at_its_clamp_on_equal_segments(gamma, segments):
    """It turns by a quarter, into the weight; on b061e3f once or twice more, stable and 0.2 to 3 % higher."""
    found = solve(Strip(1.0, 0.05, 0.4, 0.0, gamma), Clamp(), UP, segments=segments)
    few = solve(Strip(1.0, 0.05, 0.4, 0.0, gamma), Clamp(), UP, segments=segments // 2 if segments < 320 else 80)
    assert found.ok
    assert turned(found) == pytest.approx(0.5 * math.pi, abs=0.05)
    assert found.energy.total < few.energy.total  # the shapes nest


def turned(found):
    """The angle by which the tangent turns from clamp to end (rad)."""
    omega = found.problem.joint_values(found.x)[0]
    return float(np.sum(0.5 * (omega[1:] + omega[:-1]) * found.problem.lengths))


def test_a_peak_turns_a_strip_by_as_much_on_fewer_segments():
    heavy = problem(1e6, segments=320)
    omega, none = seeds.hanging(heavy), np.zeros(321)
    for count in (160, 80, 40):
        lengths = np.full(count, 1.0 / count)
        fewer, _ = transfer.resampled(omega, none, heavy.lengths, lengths)
        turn = float(np.sum(0.5 * (fewer[1:] + fewer[:-1]) * lengths))
        assert turn == pytest.approx(0.5 * math.pi, abs=0.3)
    smooth = 3.0 + 2.0 * np.cos(3.0 * seeds.joints(heavy.lengths))
    fewer, _ = transfer.resampled(smooth, none, heavy.lengths, np.full(80, 1.0 / 80))
    np.testing.assert_allclose(fewer, smooth[::4], rtol=1e-12)


def test_what_doublings_lead_up_to_is_not_taken(monkeypatch):
    """The loops of fewer segments, planted: the strip is then solved from its own start, which lies lower."""
    monkeypatch.setattr(transfer, "_TURNS", math.inf)
    strip = Strip(1.0, 0.05, 0.4, 0.0, 1e6)
    for segments in (160, 320):
        found = solve(strip, Clamp(), UP, segments=segments)
        assert turned(found) == pytest.approx(0.5 * math.pi, abs=0.05)


def test_more_energy_than_at_the_start_is_told():
    heavy = problem(1e6, segments=40)
    hangs = solve(Strip(1.0, 0.05, 0.4, 0.0, 1e6), Clamp(), UP, segments=40)
    straight = heavy.state(np.zeros(41), np.zeros(41))
    assert doubling.above(heavy, straight, hangs.x)
    assert not doubling.above(heavy, hangs.x, straight)
    assert not doubling.above(heavy, hangs.x, hangs.x)


@pytest.mark.parametrize("ratio", [1e4, 1e6, 1e8, 1e10, 1e12])
def test_the_eigenvalue_of_strongly_graded_segments_is_that_of_even_ones(ratio):
    """A dense eigenvalue is lost in the rounding of the largest: it was -9 at 1e8, and -4e8 at 1e12, "stable"."""
    lengths = np.geomspace(1.0, ratio, 40)
    clamp = Clamp(normal=(-math.sqrt(0.5), math.sqrt(0.5), 0.0))
    strip = Strip(1.0, 0.05, gamma=100.0, natural_curvature=10.0)
    found = solve(strip, clamp, Gravity((1.0, 0.0, 0.0)), segments=lengths / lengths.sum(), leave_saddle=True)
    assert found.stable is True
    assert found.lowest_eigenvalue == pytest.approx(0.516, rel=0.05)  # of 80 even ones
    assert "indifferent" not in found.message


def test_the_eigenvalue_of_a_saddle_on_graded_segments():
    """A strip standing on its clamp, twice as heavy as it can stand: eigenvalue and verdict are of one source."""
    lengths = np.geomspace(1.0, 1e10, 40)
    upright = Clamp(tangent=(0.0, 0.0, 1.0), normal=(1.0, 0.0, 0.0))
    found = [
        solve(Strip(1.0, 0.05, gamma=15.6, natural_curvature=1e-12), upright, Gravity((0.0, 0.0, 1.0)),
              segments=segments, seed_curvature=0.0)
        for segments in (lengths / lengths.sum(), 40)
    ]  # fmt: skip
    assert [state.stable for state in found] == [False, False]
    assert found[0].lowest_eigenvalue == pytest.approx(found[1].lowest_eigenvalue, rel=0.05)
