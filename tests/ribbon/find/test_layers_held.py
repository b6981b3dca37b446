"""Coils clamped at both ends, and coils on few segments: derivatives, the elastica's energy, what a page or a user
needs not know of segments."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ribbon import Clamp, Strip
from ribbon.find import adaptive
from ribbon.find.adaptive import refine_to_tolerance
from ribbon.find.layers import ends, facing, plane
from ribbon.find.layers.bent import Bent, Gaps
from ribbon.find.solve import build, solve_shape
from ribbon.judge import nearness

#: 4 turns, K = 42, 0.003 l thick, wound by twice as much as they are thick and clamped there at both ends: energy (D w
#: / l) by the planar elastica, 60 elements of degree 3 begun at the wound strip at rest, 230 places, a minute.
ELASTICA = -736.01209
TURNS, THICK, CURVED = 4.0, 0.003, 42.0
START = Clamp((0, 0, 0), (1, 0, 0), (0, 1, 0))


def wound(turns: float, thick: float, segments: int, loosely: float) -> np.ndarray:
    """Curvatures (1/l) at the joints of a spiral whose turns are `loosely` thicknesses apart."""
    rise, angle = loosely * thick / (2.0 * math.pi), 2.0 * math.pi * turns
    first = (1.0 - 0.5 * rise * angle**2) / angle
    return 1.0 / np.sqrt(first**2 + 2.0 * rise * np.linspace(0.0, 1.0, segments + 1))


def wound_end() -> Clamp:
    """Where the spiral ends."""
    fine = build(Strip(1.0, 0.03, 0.3), START, segments=400, apart=THICK)
    r, frame = fine.joints(fine.state(wound(TURNS, THICK, 400, 2.0), np.zeros(401)))
    return Clamp(tuple(r[-1]), tuple(frame[-1][:, 2]), tuple(frame[-1][:, 1]))


def spring(segments: int, **changes):
    """Clamped at both ends."""
    strip = Strip(1.0, 0.03, 0.3, natural_curvature=CURVED)
    end = changes.get("end", wound_end())
    return build(strip, START, end=end, segments=segments, apart=THICK)


@pytest.fixture(scope="module")
def held():
    return solve_shape(spring(60), wound(TURNS, THICK, 60, 2.0), np.zeros(61))


def test_what_an_end_asks_is_differentiated() -> None:
    problem = spring(30)
    rows, omega, none = ends.Ends(problem), wound(TURNS, THICK, 30, 2.0), np.zeros(31)
    way, step = np.random.default_rng(3).normal(size=31), 1e-6
    slopes = rows.slopes(Bent(problem, problem.state(omega, none)).moves)
    ahead, back = (rows.off(problem.state(omega + sign * step * way, none)) for sign in (1.0, -1.0))
    assert slopes.shape == (3, 31)
    np.testing.assert_allclose(slopes @ way, (ahead - back) / (2.0 * step), atol=1e-7)


def test_the_hessian_has_what_an_end_pulls_with() -> None:
    """Of E - nu e, by differences of its slope."""
    problem = spring(30)
    rows, omega, none = ends.Ends(problem), wound(TURNS, THICK, 30, 2.0), np.zeros(31)
    way, nu, step = np.random.default_rng(3).normal(size=31), np.array([150.0, -80.0, 20.0]), 1e-5

    def slope(curvatures: np.ndarray) -> np.ndarray:
        bent = Bent(problem, problem.state(curvatures, none))
        return bent.gradient - nu @ rows.slopes(bent.moves)

    by_differences = (slope(omega + step * way) - slope(omega - step * way)) / (2.0 * step)
    x = problem.state(omega, none)
    hessian = Bent(problem, x).hessian(Gaps(None, x), np.zeros(0), rows.pull(nu))
    np.testing.assert_allclose(hessian @ way, by_differences, atol=1e-6 * np.abs(by_differences).max())


def test_a_spring_clamped_at_both_ends_is_the_planar_elasticas(held) -> None:
    assert held.status.code == "converged"
    assert held.stable
    assert held.residual <= 1e-8
    assert held.energy.total == pytest.approx(ELASTICA, rel=1e-5)
    assert not nearness.minima(held.problem, held.x, -nearness.TOLERANCE)
    push = -held.rows[held.problem.block_slices()["pairs"]]
    assert push.min() >= 0.0
    assert push.size > 50
    assert np.abs(push * held.problem.pair_rows().gaps(held.x)).max() < 1e-8


def test_its_clamps_are_where_they_are_and_balance_each_other(held) -> None:
    """Without weight what one end exerts the other takes, force and moment about one point."""
    problem, end = held.problem, wound_end()
    r, frame = problem.joints(held.x)
    np.testing.assert_allclose(r[-1], end.position, atol=1e-11)
    np.testing.assert_allclose(frame[-1], end.frame, atol=1e-11)
    first, last = problem.start_force(held.x, held.rows), problem.end_force(held.x, held.rows)
    assert last is not None
    assert np.linalg.norm(first.force) > 10.0
    np.testing.assert_allclose(first.force + last.force, 0.0, atol=1e-7)
    np.testing.assert_allclose(first.moment + last.moment + np.cross(r[-1] - r[0], last.force), 0.0, atol=1e-7)


def test_a_spring_clamped_at_both_ends_is_found_on_finer_segments(held, monkeypatch) -> None:
    """From its curvatures, and not by a search in space, which takes minutes."""
    monkeypatch.setattr(adaptive, "switch", None)
    finer = refine_to_tolerance(held, 1e-3, strict=False)
    assert finer.ok
    assert finer.problem.lengths.size >= 120
    assert finer.energy.total == pytest.approx(ELASTICA, rel=1e-6)


def test_an_end_out_of_the_plane_is_none_of_a_plane_coil() -> None:
    end = wound_end()
    assert ends.in_plane(spring(20))
    aside = np.add(end.position, (0.0, 0.0, 1e-3))
    assert not ends.in_plane(spring(20, end=Clamp(tuple(aside), end.tangent, end.normal)))
    lean = np.add(end.normal, (0.0, 0.0, 1e-3))
    lean /= np.linalg.norm(lean)
    assert not ends.in_plane(spring(20, end=Clamp(end.position, end.tangent, tuple(lean))))


@pytest.mark.parametrize(("curved", "thick", "segments"), [(30.0, 1e-3, 24), (30.0, 3e-4, 24)])
def test_a_thin_coil_settles_on_few_segments(curved: float, thick: float, segments: int) -> None:
    """3.8 turns: a segment bulged by more than layers are apart between the samples at which sides are read.
    Energies on 80 segments: -449.2940 and -449.9377."""
    strip = Strip(1.0, 0.03, 0.3, natural_curvature=curved)
    problem = build(strip, START, segments=segments, apart=thick)
    found = plane.lain(problem, problem.state(wound(3.8, thick, segments, 1.5), np.zeros(segments + 1)))
    assert found is not None
    settled, minimum = found
    assert minimum.residual <= 1e-8
    assert settled.value(minimum.x) == pytest.approx(-449.2940 if thick > 5e-4 else -449.9377, abs=6e-3)
    assert not nearness.minima(settled, minimum.x, -nearness.TOLERANCE)


def test_the_nearest_layer_is_seen_whatever_the_samples_are() -> None:
    """Of two layers 0.3 and 0.6 thousandths off a place the nearer one, on segments whose samples are a hundredth long:
    a sample of the farther one may be nearer."""
    problem = build(Strip(1.0, 0.03, 0.3), START, segments=20, apart=3e-4)
    x = problem.state(wound(4.0, 3e-4, 20, 1.0), np.zeros(21))
    places = np.linspace(0.0, 0.4, 81)[1:]
    there = facing.faced(problem, x, places, 0.02)
    rows = problem.with_changes(pairs=there.pairs).pair_rows()
    outward = there.side == there.side[0]
    turned = np.array([pair.s_other - pair.s for pair in there.pairs])[outward]
    assert outward.sum() == 80
    assert turned.max() < 0.3
    assert rows.gaps(x)[outward].max() < 2e-4
