"""Several minima: flips of the ruling that segments place, and starts that end in different states."""

import numpy as np
import pytest

from ribbon import Clamp, Gravity, Strip, solve
from ribbon.find import minima, relax
from ribbon.find.solve import build, solve_from, solve_shape

UP = Gravity((0.0, 0.0, 1.0))
#: A quarter of a turn between clamps 0.95 l apart, the strip on edge at the start (thesis, 5.3.2).
TWISTED = {
    "strip": Strip(1.0, 0.01, gamma=1.0),
    "clamp": Clamp((0, 0, 0), tangent=(1, 0, 0), normal=(0, -1, 0), ruling="free"),
    "gravity": UP,
    "end": Clamp((0.95, 0, 0), tangent=(1, 0, 0), normal=(0, 0, 1), ruling="free"),
}


def from_near(problem, x):
    near = relax.from_near(problem, x)
    return solve_from(problem, near.x, warm=(near.rows, near.multipliers))


@pytest.fixture(scope="module")
def twisted():
    return solve(**TWISTED, seed_curvature=(1e-3, 1.1e-3), seed_ruling=(1e-3, 1.1e-3))


def test_a_flip_is_where_curvature_and_ruling_change_sign_together(twisted):
    placed = minima.flips(twisted.problem, twisted.x)
    assert len(placed) == 3
    omega, eta = twisted.problem.joint_values(twisted.x)
    for i in placed:
        assert omega[i] * omega[i + 1] < 0.0
        assert eta[i] * omega[i] * eta[i + 1] * omega[i + 1] > 0.0  # the twist keeps its sign
    gaps = np.diff(eta)[placed] / np.diff(np.linspace(0.0, 1.0, omega.size))[placed]
    assert np.abs(gaps).max() < 2.0 / 0.01  # placed by the segment, not by the bound of the rulings


def neighbours(found):
    """The stable states beside `found` with one flip a segment further."""
    problem = found.problem
    for i in minima.flips(problem, found.x):
        for joint in (i, i + 1):
            omega, eta = problem.joint_values(found.x)
            omega[joint], eta[joint] = -omega[joint], -eta[joint]
            other = from_near(problem, problem.state(omega, eta))
            if other.ok and other.energy.total > found.energy.total + 1e-3:
                yield other


def test_moved_flips_are_minima_of_the_segments_and_are_moved_back(twisted):
    others = list(neighbours(twisted))
    assert len(others) >= 3
    for other in others[:2]:
        assert other.lowest_eigenvalue > 0.1
        back = minima.lowest(other, (), from_near)
        assert back.energy.total == pytest.approx(twisted.energy.total, abs=1e-9)
        assert np.abs(back.position(0.5) - twisted.position(0.5)).max() < 1e-8


@pytest.mark.parametrize("seed", [1, 2])
def test_rounding_of_the_seed_chooses_nothing(twisted, seed):
    shaken = 1e-3 * np.array([1.0, 1.1]) + 1e-9 * np.random.default_rng(seed).normal(size=2)
    found = solve(**TWISTED, seed_curvature=tuple(shaken), seed_ruling=(1e-3, 1.1e-3))
    assert found.energy.total == pytest.approx(twisted.energy.total, rel=1e-11)
    assert np.abs(found.position([0.3, 0.6]) - twisted.position([0.3, 0.6])).max() < 1e-9
    assert found.minima.lowest
    assert found.minima.flipped
    assert len(found.minima.energies) > 3
    assert found.minima.energies[0] == pytest.approx(found.energy.total, rel=1e-11)


@pytest.mark.validate
def test_copies_merge_on_segments_shorter_than_the_layer(twisted):
    """On 20 segments 2.7 % apart, on 320 of a third of the width the same to 1e-9."""
    from ribbon import refine

    pair = [twisted, next(neighbours(twisted))]
    apart = []
    for _ in range(5):
        apart.append(abs(pair[1].energy.total - pair[0].energy.total))
        pair = [refine(one) for one in pair]
        assert pair[0].ok
        assert pair[1].ok
    assert apart[0] > 1e-2
    assert apart[-1] < 1e-9 or abs(pair[1].energy.total - pair[0].energy.total) < 1e-9


def test_of_the_built_in_starts_the_lowest_state_is_kept():
    """Pushed together under its weight the strip hangs; the arch above is a state, too."""
    scene = {
        "strip": Strip(1.0, 0.05, gamma=20.0),
        "clamp": Clamp((0, 0, 0), tangent=(1, 0, 0), normal=(0, 0, 1)),
        "gravity": UP,
        "end": Clamp((0.9, 0, 0), tangent=(1, 0, 0), normal=(0, 0, 1)),
    }
    found = solve(**scene)
    arch = solve(**scene, seed_curvature=(4.0, -4.0, 4.0))
    hangs = solve(**scene, seed_curvature=(-4.0, 4.0, -4.0))
    high, low = sorted((arch, hangs), key=lambda e: -e.energy.total)
    assert high.ok
    assert low.middle.position[2] < -0.1 < 0.1 < high.middle.position[2]
    assert found.energy.total == pytest.approx(low.energy.total, rel=1e-9)
    assert found.minima.lowest
    assert np.allclose(found.minima.energies[:2], [low.energy.total, high.energy.total], rtol=1e-9, atol=0.0)
    assert high.minima is None  # a seed that is given decides
    assert f"lowest of {len(found.minima.energies)} minima" in found.message


def test_a_curled_strip_is_not_left_in_its_coil():
    """The natural shape was its only start, whatever that ended in."""
    from ribbon.find.solve import starting_shapes

    end = Clamp((0.3, 0, 0), tangent=(1, 0, 0), normal=(0, -np.sin(2.6), np.cos(2.6)))
    scene = {
        "strip": Strip(1.0, 0.04, 0.4, 4.0, gamma=1.0),
        "clamp": Clamp((0, 0, 0), tangent=(1, 0, 0), normal=(0, 0, 1)),
        "gravity": UP,
        "end": end,
    }
    found = solve(**scene)
    problem = build(**scene)
    each = [solve_shape(problem, *shape) for shape in starting_shapes(problem, "natural", 0.0)]
    assert len(each) > 3
    assert found.ok
    assert found.minima.lowest
    assert len(found.minima.energies) > 1
    assert found.energy.total <= min(one.energy.total for one in each if one.ok) + 1e-9


def test_equal_energies_are_the_first_start():
    scene = {"strip": Strip(1.0, 0.05), "clamp": Clamp(), "end": Clamp((0, 0, 0.9))}
    found = solve(**scene)
    problem = build(**scene)
    from ribbon.find.solve import starting_shapes

    first = solve_shape(problem, *next(iter(starting_shapes(problem, "natural", 0.0))))
    assert np.abs(found.position(0.5) - first.position(0.5)).max() < 1e-9
    assert found.minima.lowest


def test_a_strip_held_at_one_end_is_asked_nothing():
    assert solve(Strip(1.0, 0.05, gamma=20.0), Clamp(), Gravity((1, 0, 0))).minima is None
