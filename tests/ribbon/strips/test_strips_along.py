"""Strips that lie along each other, held at stations: closed forms, surfaces measured again, and what is seen."""

import numpy as np
import pytest

from ribbon import Clamp, Gravity, Strip, Wall
from ribbon.find.layers import quadratic
from ribbon.find.strips import facing
from ribbon.find.strips import solve as strips
from ribbon.find.strips.assemble import Member, assembled, shapes
from ribbon.find.strips.finer import refined
from ribbon.problems.itself.pairs import Pair
from ribbon.problems.strips.between import PAST_EDGE, Touching
from ribbon.problems.strips.place import placed

UP = Gravity((0.0, 0.0, 1.0))
APART = 0.05


def cantilever(height, weight, degrees=0.0, at=(0.0, 0.0), segments=10, width=0.05):
    """A strip clamped level at a height, its face up, turned about the vertical."""
    turn = np.radians(degrees)
    clamp = Clamp((*at, height), (np.cos(turn), np.sin(turn), 0.0), (0.0, 0.0, 1.0))
    strip = Strip(length=1.0, width=width, poisson=0.3, thickness=0.01, gamma=weight)
    return Member(strip, clamp, segments=segments)


def pushes(state, one, other):
    """The force (3,) of strip `one` on strip `other`."""
    found = np.zeros(3)
    for touch in state.touching:
        if {touch.one, touch.other} == {one, other}:
            found += touch.force if touch.one == other else -touch.force
    return found


def nearest(state, one=0, other=1):
    """The least distance (l) of places of one surface, edges and between, from rulings of the other."""
    best = np.inf
    for a, b in ((one, other), (other, one)):
        first, second = state.strips[a], state.strips[b]
        wide = 0.5 * second.problem.strip.relative_width
        t = np.linspace(0.0, 1.0, 2001)
        middle, (ruling, _, tangent) = second.position(t), np.moveaxis(second.frame(t), 2, 0)
        s = np.linspace(0.0, 1.0, 401)
        for u in np.linspace(-1.0, 1.0, 5) * 0.5 * first.problem.strip.relative_width:
            away = (first.position(s) + u * first.frame(s)[:, :, 0])[:, None] - middle[None]
            v = np.clip(np.einsum("ijc,jc->ij", away, ruling), -wide, wide)
            away = away - v[..., None] * ruling
            between = np.clip(np.einsum("ijc,jc->ij", away, tangent), -2.5e-4, 2.5e-4)
            best = min(best, float(np.linalg.norm(away - between[..., None] * tangent, axis=2).min()))
    return best


def test_two_strips_along_each_other_share_a_small_weight_as_beams_do():
    """From a = (72 gap / q)^(1/4) on they lie on each other, with q / 2 a length and q a / 6 at a."""
    gap, q = 1e-4, 72.0 * 1e-4 / 0.55**4
    found = strips.solve([cantilever(0.0, 0.0), cantilever(APART + gap, q)], (), UP, "kirchhoff", APART)
    assert found.ok
    assert facing.is_held(found.problem)
    push = pushes(found, 0, 1)
    assert push[2] == pytest.approx(q * (0.5 - 0.55 / 3.0), rel=4e-3)
    assert found.strips[0].start.force == pytest.approx(push, abs=1e-7)
    assert found.strips[1].start.force + push == pytest.approx([0.0, 0.0, q], abs=1e-7)
    assert min(touch.s for touch in found.touching) == pytest.approx(0.55, abs=0.05)


@pytest.mark.parametrize(
    ("energy", "degrees", "segments"), [("kirchhoff", 1.0, 6), ("wunderlich", 0.5, 10), ("kirchhoff", 0.0, 10)]
)
def test_faces_that_lie_along_each_other_are_nowhere_too_near(energy, degrees, segments):
    members = [cantilever(0.0, 0.0, segments=segments), cantilever(APART + 0.005, 3.0, degrees, segments=segments)]
    found = strips.solve(members, (), UP, energy, APART)
    assert found.ok
    assert nearest(found) == pytest.approx(APART, abs=1e-6)
    assert [touch.gap for touch in found.touching] == pytest.approx([APART] * len(found.touching), abs=1e-10)
    assert len(found.touching) >= 6
    push = pushes(found, 0, 1)
    assert found.strips[0].start.force == pytest.approx(push, abs=1e-5)
    assert found.strips[1].start.force + push == pytest.approx([0.0, 0.0, 3.0], abs=1e-5)


def test_the_order_of_strips_along_each_other_says_nothing_and_shorter_segments_little():
    members = [cantilever(0.0, 0.0, segments=4), cantilever(APART + 0.005, 3.0, 3.0, segments=4)]
    one, other = (strips.solve(some, (), UP, "kirchhoff", APART) for some in (members, members[::-1]))
    assert one.ok
    assert other.ok
    assert one.energy.total == pytest.approx(other.energy.total, rel=1e-6)  # stations are put to 3e-7 l
    finer = refined(one)
    assert finer.ok
    assert strips.distance(one, finer) < 1e-3
    assert nearest(finer) > APART - 1e-6


def test_a_stack_on_a_table_bears_what_is_above_it():
    """Each one let down by a thousandth of its length from its clamp: q (1 - 2 a / 3) is on what lies below, and the
    clamp bears the rest, a = (72 height / q)^(1/4)."""
    lift, q, count = 1e-3, 72.0 * 1e-3 / 0.5**4, 3
    members = [cantilever(k * (APART + lift), q) for k in range(count)]
    table = Wall((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    found = strips.solve(members, (), UP, "kirchhoff", APART, walls=[table])
    assert found.ok
    lies = q * (1.0 - 2.0 / 3.0 * 0.5 * np.arange(count) ** 0.25)
    on = [found.strips[0].walls[0].force, pushes(found, 0, 1), pushes(found, 1, 2), np.zeros(3)]
    for k in (1, 2):
        assert on[k][2] == pytest.approx(lies[k:].sum(), rel=2e-3)
        assert found.strips[k].start.force[2] == pytest.approx(q - lies[k], rel=5e-3)
    for k, strip in enumerate(found.strips):
        assert strip.start.force + on[k] - on[k + 1] == pytest.approx([0.0, 0.0, q], abs=1e-5)
    assert found.penetration < 1e-6
    assert min(nearest(found, 0, 1), nearest(found, 1, 2)) > APART - 1e-6


def test_a_clamp_bears_what_touches_its_first_segment():
    """Two cantilevers that cross at 0.05 of the lower one, on the segment that its clamp holds."""
    low, high = cantilever(0.0, 0.0), cantilever(APART + 0.01, 3.0, 90.0, (0.05, -0.8))
    found = strips.solve([low, high], (), UP, "kirchhoff", APART)
    assert found.ok
    assert {touch.one for touch in found.touching} == {0}
    assert max(touch.s for touch in found.touching) < 0.1
    push = pushes(found, 0, 1)
    assert push[2] > 1.0
    assert found.strips[0].start.force == pytest.approx(push, abs=1e-6)
    moment = np.sum([np.cross(touch.at, -touch.force) for touch in found.touching], axis=0)
    assert found.strips[0].start.moment == pytest.approx(moment, abs=1e-6)
    assert found.strips[1].start.force + push == pytest.approx([0.0, 0.0, 3.0], abs=1e-6)


def bent(members, omegas):
    """A problem of strips and their shape with these curvatures and a twist."""
    problem = assembled(members, (), UP, "kirchhoff", APART)
    each = shapes(problem, members, None)
    return problem, placed(problem, [(o + k, 0.2 * np.sin(3 * o)) for (o, _), k in zip(each, omegas, strict=True)])


def test_rows_of_stations_have_the_slopes_of_their_values_past_an_edge_too():
    """On either strip, inside and above an edge of the other: slopes and second derivatives by central differences."""
    grid = np.linspace(0.0, 1.0, 6)
    members = [cantilever(0.0, 0.0, segments=5), cantilever(APART + 0.01, 3.0, 1.0, segments=5)]
    problem, x = bent(members, (0.3 * np.cos(2.0 * grid), 0.35 * np.cos(2.0 * grid)))
    half = 0.025
    told = [
        Touching(0, 1, Pair(0.5, half, 0.5, 0.0, False, True)),
        Touching(1, 0, Pair(0.63, -half, 0.63, -0.02, False, True)),
        Touching(1, 0, Pair(0.63, half * (1.0 - 1e-9), 0.63, half, False, True)),
    ]
    held = problem.with_changes(touching=tuple(told))
    one, two = held.between(0, 1), held.between(1, 0)
    assert two.places(x)[:, :2] == pytest.approx(np.array([[0.63, -half], [0.63, half]]), abs=1e-8)
    assert np.abs(two.places(x)[:, 3]).max() <= half * (1.0 + PAST_EDGE) + 1e-12
    shift = np.random.default_rng(3).normal(size=x.size)
    for rows, weights in ((one, np.array([1.0])), (two, np.array([1.0, 0.0]))):
        of, columns = rows.jacobian_structure()

        def slope(x, rows=rows, weights=weights, of=of, columns=columns):
            out = np.zeros(x.size)
            np.add.at(out, columns, weights[of] * rows.jacobian(x))
            return out

        step = 1e-6
        by_values = (rows.values(x + step * shift) - rows.values(x - step * shift)) @ weights / (2.0 * step)
        assert slope(x) @ shift == pytest.approx(by_values, abs=1e-7 * max(1.0, abs(by_values)))
        lower = np.zeros((x.size, x.size))
        np.add.at(lower, rows.hessian_structure(), rows.hessian(x, weights))
        second = lower + np.tril(lower, -1).T
        by_slopes = (slope(x + step * shift) - slope(x - step * shift)) / (2.0 * step)
        assert second @ shift == pytest.approx(by_slopes, abs=1e-5 * np.abs(by_slopes).max())


@pytest.mark.parametrize(
    ("degrees", "at", "height", "lies"),
    [
        (0.0, (0.0, 0.0), APART + 0.005, True),
        (3.0, (0.0, 0.0), APART + 0.005, True),
        (10.0, (0.0, 0.0), APART + 0.005, False),
        (90.0, (0.5, -0.5), APART + 0.005, False),
        (0.0, (0.0, 0.11), 0.0, False),  # side by side
        (0.0, (0.7, 0.0), APART + 0.005, False),  # along less than half of each other
        (0.0, (0.0, 0.0), APART + 0.2, False),  # far above
        (180.0, (0.9, 0.0), APART + 0.005, True),
    ],
)
def test_which_strips_lie_along_each_other(degrees, at, height, lies):
    members = [cantilever(0.0, 0.0), cantilever(height, 1.0, degrees, at)]
    problem = assembled(members, (), UP, "kirchhoff", APART)
    x = placed(problem, shapes(problem, members, None))
    assert facing.along(problem, x) == ([(0, 1)] if lies else [])


def test_a_quadratic_problem_whose_rows_are_the_same_is_solved():
    """min d^2 / 2 + d under d >= 1, told many times."""
    rows = np.ones((40, 1))
    step, push = quadratic.least((np.eye(1), True), np.ones(1), rows, -np.ones(40), np.ones(40, dtype=bool))
    assert step == pytest.approx([1.0], abs=1e-9)
    assert push.sum() == pytest.approx(2.0, abs=1e-6)
    assert push.min() >= 0.0


def test_an_edge_right_above_an_edge_slides_aside_for_nothing():
    """As faces do: between their edges alone a place that moves aside by y would gain y^2 / 2 d."""
    members = [cantilever(0.0, 0.0, segments=4), cantilever(APART, 0.0, segments=4)]
    problem = assembled(members, (), None, "kirchhoff", APART)
    x = placed(problem, shapes(problem, members, None))
    edge = Pair(0.6, 0.025, 0.6, 0.025, False, True)
    rows = problem.with_changes(touching=(Touching(0, 1, edge),)).between(0, 1)
    aside = int(problem.offsets[1] + problem.parts[1].layout.joint(2).position[1])
    at = np.array(rows.hessian_structure())
    second = rows.hessian(x, np.ones(1))[(at == aside).all(axis=0)].sum()
    assert second == pytest.approx(0.0, abs=1e-9)
    assert rows.values(x) == pytest.approx([0.0], abs=1e-12)
