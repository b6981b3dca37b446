"""Coils that turn far in one segment: of the states that such segments have, the lower one that finer ones lead to."""

from itertools import pairwise

import numpy as np
import pytest

from ribbon import Clamp, Gravity, Strip, refine, solve, solve_many
from ribbon.find import minima
from ribbon.find.solving import coarse
from ribbon.find.solving.request import How

CLAMP = Clamp((0, 0, 0), (0, 0, 1), (-np.sqrt(0.5), np.sqrt(0.5), 0), ruling="free")
UP = Gravity((1, 0, 0))
HEAVY = Strip(1.0, 0.03, 0.4, 100.0, 7500.0)
#: Energy (D w / l) of the coil in the limit, by collocation of the equations (results/strong_form.md).
LIMIT = -5807.73327


def coil(segments=20, **keywords):
    return solve(HEAVY, CLAMP, UP, energy="sadowsky", segments=segments, **keywords)


@pytest.fixture(scope="module")
def high():
    """What a given seed leads to, on 20 segments: a minimum of theirs."""
    return coil(seed_curvature=100.0)


@pytest.fixture(scope="module")
def low():
    return coil()


def test_the_higher_state_is_one_of_its_segments_only(high):
    assert high.ok
    assert high.lowest_eigenvalue > 0.1
    assert high.minima is None  # a seed that is given decides
    assert high.energy.total > LIMIT + 150.0
    finer = refine(high)
    assert finer.energy.total < high.energy.total - 100.0
    assert np.linalg.norm(finer.end.position - high.end.position) > 0.05
    assert refine(refine(finer)).energy.total == pytest.approx(LIMIT, abs=0.05)


def test_from_the_natural_shape_the_lower_state_is_found_and_refines_to_the_limit(high, low):
    assert low.ok
    assert LIMIT < low.energy.total < LIMIT + 20.0
    assert low.minima.lowest
    assert low.minima.energies == pytest.approx([low.energy.total, high.energy.total], rel=1e-9)
    chain = [low]
    for _ in range(3):
        chain.append(refine(chain[-1]))
    steps = [float(np.linalg.norm(b.end.position - a.end.position)) for a, b in pairwise(chain)]
    assert steps[0] < 0.02
    assert steps[0] > steps[1] > steps[2]
    assert chain[-1].energy.total == pytest.approx(LIMIT, abs=0.05)


@pytest.mark.validate
def test_counted_from_the_other_end_it_is_the_same_state(low):
    turned = Clamp((0, 0, 0), (0, 0, -1), CLAMP.normal, ruling="free")
    loose = Clamp(None, None, None, ruling="free")
    back = solve(HEAVY, loose, UP, end=turned, energy="sadowsky", segments=20)
    assert back.ok
    assert back.energy.total == pytest.approx(low.energy.total, rel=1e-9)
    s = np.linspace(0.0, 1.0, 11)
    assert np.abs(back.position(1.0 - s) - low.position(s)).max() < 1e-7


def test_a_batch_finds_it_too(low):
    many = solve_many([HEAVY, HEAVY], CLAMP, UP, energy="sadowsky", seeds=[("natural", 0.0), (100.0, 0.0)])
    assert np.array_equal(many.x[0], low.x)
    assert many.equilibrium(0).message == low.message
    assert many.energies()[1].sum() > low.energy.total + 100.0


def test_short_segments_are_not_looked_at_twice():
    found = solve(Strip(1.0, 0.03, 0.4, 10.0, 100.0), CLAMP, UP, energy="sadowsky", segments=10)
    assert coarse.turn(found.problem, found.x) < coarse.TURNED
    assert found.minima is None
    assert coarse.lowest(found, How()) is found


def test_the_lower_of_random_coils():
    """Never higher than what one search from the natural shape ends at, and in some lower."""
    rng, better = np.random.default_rng(7), 0
    for _ in range(40):
        size = np.exp(rng.uniform(np.log(40.0), np.log(150.0)))
        strip = Strip(1.0, 0.03, 0.4, size * rng.choice([-1.0, 1.0]), size * size * np.exp(rng.uniform(-3.0, 1.0)))
        up = rng.normal(size=3)
        up = Gravity(tuple(up / np.linalg.norm(up)))
        found = solve(strip, CLAMP, up, energy="sadowsky", segments=10)
        first = solve(strip, CLAMP, up, energy="sadowsky", segments=10, seed_curvature=strip.natural_curvature)
        if found.ok and first.ok:
            assert not minima.lower(first.energy.total, found.energy.total)
            better += minima.lower(found.energy.total, first.energy.total)
    assert better >= 4
