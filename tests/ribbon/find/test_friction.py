"""Paths with friction: ends that slide and stick beside shooting, walls that carry, slopes, what is refused."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from ribbon import Clamp, Equilibrium, Gravity, RibbonInputError, Strip, Wall, refine, solve
from ribbon.find import continuation
from ribbon.find.friction import increment, path, pushes
from ribbon.find.solve import Problem, build, solve_from
from ribbon.obstacle import Obstacle
from ribbon.problems.friction import term
from ribbon.problems.friction.particles import Rub
from ribbon.problems.mixed import MixedProblem
from ribbon.solvers.problem import Minimum
from tests.validation.ribbon import friction as measured


def test_an_end_slides_as_shooting_has_it() -> None:
    """N, T and the end's place, and Coulomb's law in every state by code of its own."""
    slope, mu = measured.SLIDES
    push, z = measured.slid(slope, mu, measured.FALL)
    states = measured.pressed(slope, mu, (measured.FALL,), 10, 2)
    wall = states[-1].walls[0]
    assert wall.force[1] == pytest.approx(push, rel=1e-6)
    assert wall.friction is not None
    assert wall.friction[2] == pytest.approx(-mu * push, rel=1e-6)
    assert states[-1].end.position[2] == pytest.approx(z, abs=1e-7)
    assert measured.law(states[1:], mu) < 1e-7


def test_an_end_sticks_when_it_is_lifted() -> None:
    """Lifted, the end stays where it is, and T is within the cone: that of shooting with a held end."""
    push, friction, off = measured.lifted(10, 1)
    assert abs(friction) < measured.SLIDES[1] * push
    assert off < 1e-4


def test_what_is_said_to_slip_is_how_far_the_particle_went() -> None:
    """The slip of every place is that of its particle on the surface of the two states, and nothing else; what the
    friction took is the sum of its work."""
    slope, mu = measured.SLIDES
    states = measured.pressed(slope, mu, (measured.FALL,), 10, 2)
    lost = 0.0
    for before, after in pairwise(states[1:]):
        rubs = after.walls[0].rubs
        assert rubs
        material = np.array([[rub.s + rub.v * float(after.eta([min(rub.s, 1.0)])[0]), rub.v] for rub in rubs])
        went = after.rulings(material)[1] - before.rulings(material)[1]
        slips = np.array([rub.slip for rub in rubs])
        np.testing.assert_allclose(slips[:, [0, 2]], went[:, [0, 2]], atol=1e-9)
        lost -= sum(float(rub.friction @ rub.slip) for rub in rubs)
    first = states[1]
    assert states[-1].rubbed == pytest.approx((first.rubbed or 0.0) + lost, rel=1e-9)
    assert states[-1].rubbed is not None
    assert states[-1].rubbed > 0.0


def _carried(t: float, friction: float, shift: float = 1e-4) -> Problem:
    """An inclined strip pressed on a floor that moves along itself by `shift`."""
    return build(
        Strip(1.0, 0.02), measured._clamp(30.0, 0.3), energy="sadowsky", formulation="mixed", segments=8,
        walls=[Wall((0.0, 0.0, shift * t), (0.0, 1.0, 0.0), friction=friction)],
    )  # fmt: skip


def _put() -> Equilibrium:
    first = _carried(0.0, 0.0)
    return solve_from(first, first.state(np.full(9, -0.5), np.zeros(9)))


def test_a_wall_carries_what_sticks() -> None:
    """The floor moves along itself: with friction enough the end goes with it, with none it stays."""
    start = _put()
    rough = path.follow(lambda t: _carried(t, 0.9), start, steps=2)
    smooth = path.follow(lambda t: _carried(t, 0.0), start, steps=2)
    assert rough.ok
    assert rough.before is not None
    assert rough.end.position[2] - start.end.position[2] == pytest.approx(1e-4, abs=1e-8)
    assert not any(rub.slips for rub in rough.walls[0].rubs)
    assert smooth.end.position[2] == pytest.approx(start.end.position[2], abs=1e-7)
    back = path.follow(lambda t: _carried(1.0 - t, 0.9), replace(rough, log=()), steps=2)
    assert back.walls[0].friction is not None
    assert np.abs(back.walls[0].friction).max() < 1e-4  # as it was: sticking forgets nothing and takes nothing
    assert abs(back.rubbed or 0.0) < 1e-9


def test_places_that_cannot_all_stick_slip_where_the_first_is_at_its_bound() -> None:
    """Springs between particles and their places, one 1e-9 off: guesses that creep by r u a round (a million rounds to
    the bound) are taken there at once; the sum is what holds the strip, nothing is beyond its bound."""
    bounds, stiffness, off = np.array([0.4, 0.9, 0.9]), 1e4, np.array([1e-9, 0.0, 0.0])
    force = np.array([0.1, 0.05, -0.15])

    def minimum(guess: np.ndarray) -> np.ndarray:  # a stiff strip, free along the wall: the sum of T is zero
        low, high = -1.0, 1.0
        for _ in range(100):
            x = 0.5 * (low + high)
            total = np.clip(guess + stiffness * (x + off), -bounds, bounds).sum()
            low, high = (x, high) if total < 0.0 else (low, x)
        return np.asarray(np.clip(guess + stiffness * (x + off), -bounds, bounds))

    last: np.ndarray | None = None
    for _ in range(12):
        found = minimum(force)
        now = np.where(np.abs(found) < bounds * (1.0 - 1e-9), found - force, 0.0)[:, None] * np.eye(3)[0]
        rubs = tuple(Rub(0, s, 0.0, s, (0.0, 0.0, 1.0), (0.0,) * 3, bound, (t, 0.0, 0.0))
                     for s, bound, t in zip((0.1, 0.2, 0.3), bounds, found, strict=True))  # fmt: skip
        if np.abs(now).max() < 1e-9:
            break
        if increment.steady(last, now, 1e-7):
            rubs = increment.further(rubs, now)
        last, force = now, np.array([rub.force[0] for rub in rubs])
    assert found[0] == pytest.approx(0.4, rel=1e-9)
    assert found.sum() == pytest.approx(0.0, abs=1e-9)
    assert found[1] - found[2] == pytest.approx(0.2, abs=1e-6)
    assert not increment.steady(np.array([[1e-3, 0.0, 0.0]]), np.array([[-1e-3, 0.0, 0.0]]), 1e-7)


def test_rows_at_one_place_rub_as_one() -> None:
    """How two segments share the push at their joint is rounding: their sum bounds one particle's friction."""
    points = [(0.5, 1.0, 0.3), (0.5 - 1e-10, 1.0, 0.9), (0.5, -1.0, 1.2), (0.6, 1.0, 0.1)]
    found = increment.together(points, [1.0, 1.0, -1.0, 1.0])
    assert [(one[0], one[1], one[3]) for one in found] == [(0.5 - 1e-10, 1.0, 1.0), (0.5, -1.0, -1.0), (0.6, 1.0, 1.0)]
    assert [one[2] for one in found] == pytest.approx([1.2, 1.2, 0.1])


def test_without_friction_nothing_of_it_is_called(monkeypatch: pytest.MonkeyPatch) -> None:
    """A coefficient of 0 is a wall without: the same states to the last bit, and no kernel of friction."""

    def forbidden(*_: object) -> None:
        raise AssertionError("friction was asked for")

    monkeypatch.setattr(term.Friction, "__init__", forbidden)
    start = _put()
    plain = continuation.follow(lambda t: _carried(t, 0.0), start, steps=2)
    bare = continuation.follow(lambda t: _without(t), start, steps=2)
    np.testing.assert_array_equal(plain.x, bare.x)


def _without(t: float) -> Problem:
    problem = _carried(t, 0.0)
    return problem.with_changes(walls=tuple(Wall(wall.point, wall.normal) for wall in problem.walls))


def test_a_strip_on_a_slope_slips_at_the_angle_of_friction() -> None:
    """At rest at 0.98 of arctan mu, its friction the weight's part along the table; not at 1.02 of it."""
    mu, gamma = 0.4, 1.0

    def at(t: float, friction: float = mu) -> Problem:
        a = t * math.atan(mu)
        return build(
            Strip(1.0, 0.02, gamma=gamma), Clamp(None, None, None), Gravity((0.0, math.cos(a), math.sin(a))),
            walls=[Wall((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), friction=friction)], energy="sadowsky",
            formulation="mixed", segments=4,
        )  # fmt: skip

    first = at(0.0, 0.0)
    start = solve_from(first, first.state(np.zeros(5), np.zeros(5)))
    below = path.follow(lambda t: at(0.98 * t), start, steps=2)
    assert below.ok
    assert below.walls[0].friction is not None
    assert below.walls[0].friction[2] == pytest.approx(gamma * math.sin(0.98 * math.atan(mu)), rel=1e-6)
    beyond = path.follow(lambda t: at(0.98 + 0.04 * t), replace(below, log=()), steps=1, smallest=0.5)
    assert not beyond.ok
    np.testing.assert_array_equal(beyond.x, below.x)  # what was found is kept


def test_finer_segments_go_the_last_increment_again() -> None:
    """N on segments cut in two is nearer to shooting, with friction as much as it is."""
    slope, mu = measured.SLIDES
    push, _ = measured.slid(slope, mu, measured.FALL)
    state = measured.pressed(slope, mu, (measured.FALL,), 10, 2)[-1]
    finer = refine(state)
    assert finer.ok
    assert finer.problem.lengths.size == 20
    assert abs(finer.walls[0].force[1] - push) < abs(state.walls[0].force[1] - push)
    assert finer.walls[0].friction is not None


def test_friction_is_refused_where_nothing_reads_it() -> None:
    with pytest.raises(RibbonInputError, match="path"):
        solve(Strip(1.0, 0.02), walls=[Wall((0.0, -1.0, 0.0), (0.0, 1.0, 0.0), friction=0.3)])
    with pytest.raises(RibbonInputError, match="friction"):
        continuation.follow(lambda t: _carried(t, 0.3), _put(), steps=1)
    with pytest.raises(RibbonInputError, match="negative"):
        Wall((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), friction=-0.1)
    assert isinstance(_carried(0.0, 0.3), MixedProblem)


def test_a_cylinder_of_large_radius_rubs_as_a_plane() -> None:
    """The push tends to the plane's, friction is along the surface, and supports balance with it."""
    radius, (slope, mu) = 1e3, measured.SLIDES

    def at(t: float, friction: float = mu) -> Problem:
        drum = Obstacle("cylinder", (0.0, 1e-9 - radius, 0.93), radius, (1.0, 0.0, 0.0), friction=friction)
        return build(
            Strip(1.0, 0.02), measured._clamp(slope, 0.5 - measured.FALL * t), energy="sadowsky", formulation="mixed",
            segments=10, walls=[drum],
        )  # fmt: skip

    first = at(0.0, 0.0)
    end = path.follow(at, solve_from(first, first.state(np.zeros(11), np.zeros(11))), steps=2)
    assert end.ok
    (wall,) = end.walls
    assert wall.friction is not None
    assert wall.moment is not None
    assert end.start is not None
    assert np.linalg.norm(wall.force) == pytest.approx(measured.slid(slope, mu, measured.FALL)[0], rel=1e-4)
    assert abs(wall.force @ wall.friction) < 1e-9
    assert np.linalg.norm(wall.friction) == pytest.approx(mu * np.linalg.norm(wall.force), rel=1e-6)
    np.testing.assert_allclose(end.start.force + wall.force + wall.friction, 0.0, atol=1e-8)
    turning = end.start.moment + np.cross(end.joints[0][0], end.start.force) + wall.moment
    turning = turning + sum(np.cross(rub.point, rub.friction) for rub in wall.rubs)
    np.testing.assert_allclose(turning, 0.0, atol=1e-8)


def test_friction_on_a_ball_acts_where_the_ball_pushes() -> None:
    """A broad strip of free twist that a ball touches beside its centreline: friction at that place of the ball, along
    its surface, of the size that its push there allows."""
    centre, radius = np.array([0.0, 0.02, 0.0]), 0.15

    def at(t: float, friction: float = 0.5) -> Problem:
        start = Clamp((-0.4 - 0.01 * t, 0.0, 0.15 - 0.01 * t), tangent=(1.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0))
        return build(
            Strip(1.0, 0.15, thickness=1e-3, gamma=2.0), start, Gravity((0.0, 0.0, 1.0)), energy="sano", segments=6,
            walls=[Obstacle("sphere", tuple(centre), radius, friction=friction)], formulation="mixed",
        )  # fmt: skip

    first = at(0.0, 0.0)
    state = solve_from(first, first.state(np.zeros(7), np.zeros(7)))
    for t in (0.5, 1.0):
        state = path.stepped(at(t), state)
    assert state.ok
    (ball,) = state.walls
    (rub,) = ball.rubs
    ((_, v),) = ball.ends
    assert v > 0.005
    assert rub.v == pytest.approx(v, abs=1e-7)
    assert np.linalg.norm(rub.point - centre) == pytest.approx(radius, abs=1e-6)
    normal = (rub.point - centre) / radius
    assert ball.force / rub.push == pytest.approx(normal, abs=1e-6)
    assert rub.friction @ normal == pytest.approx(0.0, abs=1e-6 * rub.push)
    assert np.linalg.norm(rub.friction) == pytest.approx(0.5 * rub.push, rel=1e-6)


def test_a_bar_that_rubs_does_not_go_through_the_strip() -> None:
    """Lifted by more than it is thick in one increment: the increment is cut, and the strip borne."""

    def at(t: float, friction: float = 0.2) -> Problem:
        bar = Obstacle("cylinder", (0.0, 0.1 * t - 0.1, 0.5), 0.05, (1.0, 0.0, 0.0), friction=friction)
        return build(
            Strip(1.0, 0.05, gamma=6.0), Clamp(), Gravity((0.0, 1.0, 0.0)), walls=[bar], segments=6,
            energy="sadowsky", formulation="mixed",
        )  # fmt: skip

    first = at(0.0, 0.0)
    start = solve_from(first, first.state(np.zeros(7), np.zeros(7)))
    end = path.follow(at, start, steps=1)
    assert start.ok
    assert end.ok
    assert not end.log[0]["accepted"]
    assert end.energy.total > start.energy.total + 0.1
    assert end.walls[0].force[1] > 2.0


@pytest.mark.parametrize("energy", [pytest.param("kirchhoff", marks=pytest.mark.validate), "wunderlich"])
def test_a_heavy_strip_is_dragged_forth_and_back(energy: str) -> None:
    """What slides on as it is does so unchanged, with mu times its pushes against it, as much at either edge, and these
    as shooting has them; what is drawn back has the friction the other way. Flat segments have more rows than unknowns
    that these hold."""
    for states, way in zip(measured.dragged(energy, 10), (1.0, -1.0), strict=True):
        for state in states[-2:]:
            (wall,) = state.walls
            assert wall.friction is not None
            assert wall.friction[2] == pytest.approx(-way * measured.DRAG * wall.force[1], rel=1e-6)
            assert wall.force[1] + state.start.force[1] == pytest.approx(measured.HEAVY, rel=1e-6)
            assert wall.friction[2] + state.start.force[2] == pytest.approx(0.0, abs=1e-6 * measured.HEAVY)
            sides = [sum(rub.push for rub in wall.rubs if rub.v * v > 0.0) for v in (1.0, -1.0)]
            assert sides[0] == pytest.approx(sides[1], rel=1e-5)
        one, other = states[-2:]
        assert one.energy.total == pytest.approx(other.energy.total, rel=1e-7)
        assert one.walls[0].force[1] == pytest.approx(other.walls[0].force[1], rel=1e-6)
        if energy == "wunderlich":  # Kirchhoff's strip is softer by nu^2
            assert other.walls[0].force[1] == pytest.approx(measured.shot_drag(way)[0], rel=5e-3)


def test_pushes_are_the_least_that_hold_the_same() -> None:
    """Whatever a minimiser ends with: pushes differ by what the equations' rows take over, the residual stays, and the
    least ones are the same; no push that is determined is changed."""
    state = measured.dragged("wunderlich", 10)[0][0]
    problem = state.problem
    assert isinstance(problem, MixedProblem)
    minimum = Minimum(state.x, np.zeros(problem.size), state.rows, state.residual, 0, 0, "", True, 0.0, state.solver)
    least = pushes.least(problem, minimum)
    free = pushes.undetermined(problem, state.x, *pushes._rows(problem, minimum))
    assert free is not None
    jacobian = problem.jacobian_matrix(state.x)
    before = jacobian.T @ least.rows
    kept = free.null @ free.null.T
    for direction in free.null.T:
        up = direction > 1e-9
        most = 0.5 * np.min(-least.rows[free.walls][up] / direction[up], initial=1.0)  # rows stay below zero
        moved = free.along(least.rows, most * direction)
        assert np.abs(jacobian.T @ moved - before).max() < 1e-8 * np.abs(before).max()
        again = pushes.least(problem, replace(minimum, rows=moved))
        np.testing.assert_allclose(again.rows, least.rows, atol=1e-7)
        determined = moved[free.walls] - kept @ moved[free.walls]
        np.testing.assert_allclose(determined, least.rows[free.walls] - kept @ least.rows[free.walls], atol=1e-9)
