"""The planar elastica in contact: derivatives of its gaps, folds and coils against shooting, what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from shellref.elastica.contact.barrier import Barrier
from shellref.elastica.contact.near import sides
from shellref.elastica.contact.places import Moving
from shellref.elastica.contact.rows import Beside, Pair, evaluated, slid
from shellref.elastica.fem import Discretisation
from shellref.elastica.problem import ElasticaProblem
from shellref.elastica.solve import solve
from shellref.elastica.start import natural_start, solve_along, solve_near
from tests.reference.touching_fold import folds

ROWS = {
    "slides": Pair(0.505, 0.745, 1.0, 0.0),
    "held": Pair(0.13, 0.7, 1.0, 0.02, True),
    "outside": Beside(0.05, Barrier((0.13, -0.3), 0.1), 0),
    "inside": Beside(0.46, Barrier((0.1, 0.1), 0.4, -1.0), 0),
    "joint": Beside(0.33, Barrier((0.1, 0.1), 0.4, -1.0), 0, True),
    "line": Beside(0.53, Barrier((0.0, 0.6), normal=(0.6, -0.8)), 0),
}


@pytest.mark.parametrize("name", ROWS)
def test_derivatives_of_a_gap(name):
    """Slope and bend along a direction against central differences of twice two steps (Richardson)."""
    discrete = Discretisation(np.linspace(0.0, 1.0, 11), 3)
    c = discrete.projected(7.5 * discrete.s - 1.2 * np.sin(5.0 * discrete.s) + 0.3)
    row = slid(Moving(discrete, 3, c), ROWS[name])
    assert row is not None
    own = evaluated(Moving(discrete, 3, c), row)
    v = np.random.default_rng(1).normal(size=len(c))

    def rates(h):
        ends = []
        for sign in (1.0, -1.0):
            moving = Moving(discrete, 3, c + sign * h * v)
            gone = slid(moving, row)
            assert gone is not None
            ends.append(evaluated(moving, gone, second=False))
        return (ends[0].gap - ends[1].gap) / (2.0 * h), (ends[0].slope - ends[1].slope) / (2.0 * h)

    (slope, bend), (fine_slope, fine_bend) = rates(2e-5), rates(1e-5)
    assert (4.0 * fine_slope - slope) / 3.0 == pytest.approx(own.slope @ v, abs=1e-8)
    assert np.abs((4.0 * fine_bend - bend) / 3.0 - own.bend @ v).max() < 1e-6 * max(1.0, np.abs(own.bend).max())
    assert np.abs(own.bend - own.bend.T).max() < 1e-12


def test_sides_by_the_turn():
    """A turn of half a circle to the left is faced from the left; one and a half from the right; a coil from both."""
    assert sides(math.pi) == (1.0,)
    assert sides(-math.pi) == (-1.0,)
    assert sides(3.0 * math.pi) == (-1.0,)
    assert sides(0.3) == ()
    assert sides(2.0 * math.pi) == (1.0, -1.0)


def _fold(distance, apart, elements):
    def between(z):
        return ElasticaProblem(end=(z, 0.0), end_angle=0.0, apart=apart)

    way = [natural_start(between(0.5), (2.0, 2.0)), between(0.5), between(distance)]
    return solve_along(way, elements, 3, estimate_error=False)


@pytest.mark.parametrize("apart", [0.0, 0.02])
def test_a_fold_whose_sides_meet(apart):
    """Place, push and energy against shooting; elements end where it touches, so the order is not lost there."""
    (known,) = folds(np.array([0.12]), apart)
    errors = []
    for elements in (20, 40):
        found = _fold(0.12, apart, elements)
        assert found.stable
        assert found.through < 1e-6
        (touch,) = found.touches
        assert touch.s == pytest.approx(known.s, abs=1e-6)
        assert touch.other == pytest.approx(1.0 - known.s, abs=1e-6)
        errors.append(abs(touch.push - known.push) / known.push)
        assert found.energy.total == pytest.approx(known.energy, rel=1e-5)
    assert errors[1] < 1e-6
    assert math.log2(errors[0] / errors[1]) > 4.0


def test_without_contact_it_is_stiffer_with_it():
    """The fold that may pass through itself does, and stores less."""
    way = [natural_start(ElasticaProblem(end=(0.5, 0.0), end_angle=0.0), (2.0, 2.0))]
    way += [ElasticaProblem(end=(z, 0.0), end_angle=0.0) for z in (0.5, 0.12)]
    free = solve_along(way, 20, 3, estimate_error=False)
    assert free.touches == ()
    assert free.through is None
    assert free.energy.total < _fold(0.12, 0.0, 20).energy.total - 1e-2


def test_from_a_shape_that_touches():
    """Begun at the angles of a state in contact, the same state; what touches is seen in the shape."""
    known = _fold(0.12, 0.02, 40)
    s = np.linspace(0.0, 1.0, 201)
    again = solve_near(known.problem, s, known.angle(s), 40, 3, estimate_error=False)
    assert again is not None
    assert again.touches[0].push == pytest.approx(known.touches[0].push, rel=1e-6)


@pytest.mark.parametrize("lift", [0.0, 1e-4, 3e-4])
def test_beside_a_shape_that_is_not_quite_exact(lift):
    """A strip that lies over a bar: begun a little above it, it does not fall through to where it touches nothing."""
    weight = {"gamma": 10.0, "up": (0.0, 1.0)}
    light, heavy = (
        ElasticaProblem(barriers=(Barrier((0.5, -0.1), 0.06),), **{**weight, "gamma": gamma}) for gamma in (1e-3, 10.0)
    )
    known = solve_along([light, heavy], 20, 3, estimate_error=False)
    assert len(known.touches) == 1
    s = np.linspace(0.0, 1.0, 201)
    again = solve_near(heavy, s, known.angle(s) + 4.0 * lift * s * (1.0 - s), 20, 3, estimate_error=False)
    assert again is not None
    assert again.touches[0].push == pytest.approx(known.touches[0].push, rel=1e-6)


def test_what_is_refused():
    with pytest.raises(ValueError, match="apart"):
        ElasticaProblem(apart=-0.1)
    with pytest.raises(ValueError, match="solve_along"):
        solve(ElasticaProblem(apart=0.01))


def test_no_bar_goes_over_the_strip_on_its_way() -> None:
    """Bars come from both sides onto a loop between parallel clamps and end as mirror images: so does the loop, each
    side of it pressed by its own bar. In one stride one of them would come out inside of the loop."""
    gap, radius = 1.0 / 6.0, 1.0 / 24.0

    def loop(left: float, right: float) -> ElasticaProblem:
        bars = tuple(Barrier((gap, -place), radius) for place in (left, right))
        return ElasticaProblem(end=(0.0, -gap), end_angle=-math.pi, apart=1.0 / 300.0, barriers=bars)

    away, here = loop(-0.25, 1.0), loop(0.0046 / 0.12, 0.0154 / 0.12)
    found = solve_along([natural_start(away, (-math.pi, -math.pi)), away, here], 16, 3, estimate_error=False)
    assert found.stable is True
    one, other = found.touches
    assert (one.barrier, other.barrier) == (0, 1)
    assert one.s + other.s == pytest.approx(1.0, abs=1e-8)
    np.testing.assert_allclose(np.add(one.force, (0.0, 0.0)), np.multiply(other.force, (1.0, -1.0)), rtol=1e-8)
