"""Strips that rub on each other along a path: Coulomb's law, statics, work, turned and mirrored scenes, refusals."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ribbon import Gravity, RibbonInputError, Wall
from ribbon.find.strips import path, sliding
from ribbon.find.strips import solve as strips
from ribbon.find.strips.assemble import assembled
from ribbon.find.strips.finer import with_error
from ribbon.judge import nearness
from ribbon.problems.strips.place import placed
from ribbon.problems.strips.slide import Slide
from tests.reference.joined_rods import facing, facing_rubbed
from tests.ribbon.strips.test_strips_touch import APART, cantilevers

LEVEL = np.eye(3)
#: How far a clamp is drawn away (l), and the coefficient.
WAY, MU = 0.03, 0.2


def turned(rotation, members):
    """The members in a turned scene."""
    return [
        replace(one, start=replace(one.start, position=rotation @ np.asarray(one.start.position),
                                   tangent=rotation @ np.asarray(one.start.tangent),
                                   normal=rotation @ np.asarray(one.start.normal)))
        for one in members
    ]  # fmt: skip


def problem(t, mu=MU, rotation=LEVEL, segments=8):
    """The upper one of two cantilevers that face each other, its tip on the lower, drawn away by t `WAY`."""
    members = cantilevers(0.85, 0.005, 3.0, segments, opposite=True)
    clamp = members[1].start
    members[1] = replace(members[1], start=replace(clamp, position=np.add(clamp.position, (WAY * t, 0.0, 0.0))))
    up = Gravity(tuple(rotation @ [0.0, 0.0, 1.0]))
    return turned(rotation, members), (), up, "kirchhoff", APART


def started(rotation=LEVEL):
    return strips.solve(*problem(0.0, rotation=rotation))


@cache
def drawn(steps, mu=MU, turn=0.0):
    """States of increments."""
    rotation = about(turn)
    found = [started(rotation)]
    for k in range(steps):
        found.append(path.stepped(assembled(*problem((k + 1) / steps, mu, rotation), friction=mu), found[-1]))
    return found


def about(angle):
    """A rotation about (1, 2, 3)."""
    axis = np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)
    cross = np.cross(np.eye(3), axis)
    return np.eye(3) + np.sin(angle) * cross.T + (1.0 - np.cos(angle)) * cross @ cross


def on_the_first(state):
    push = sum(one.force for one in state.touching)
    return push, sum(one.friction for one in state.slides)


def test_what_slides_is_pushed_at_the_angle_of_friction_and_everything_balances():
    """The law from forces alone: tan of the angle to the normal is mu. The lower strip, which is weightless, is held by
    its clamp against one force through the point halfway between both strips: no moment is left of friction's arm."""
    state = drawn(2)[-1]
    push, friction = on_the_first(state)
    assert np.linalg.norm(friction) == pytest.approx(MU * np.linalg.norm(push), rel=1e-6)
    assert friction @ push == pytest.approx(0.0, abs=1e-9)
    assert friction[0] > 0.0  # the tip is drawn along +x and takes the lower strip with it
    assert all(one.slips for one in state.slides)
    clamp, at = state.strips[0].start, state.positions(0, np.zeros(1))[0]
    assert clamp.force + push + friction == pytest.approx(np.zeros(3), abs=1e-6)
    moments = sum(np.cross(one.at, one.force) for one in state.touching)
    moments = moments + sum(np.cross(one.point, one.friction) for one in state.slides)
    assert clamp.moment + np.cross(at, clamp.force) + moments == pytest.approx(np.zeros(3), abs=1e-6)
    over = state.strips[1].start
    assert over.force - push - friction == pytest.approx([0.0, 0.0, 3.0], abs=1e-6)


def test_the_tip_that_slides_is_where_shooting_has_it():
    """Push, place, both moments at the clamps and energy beside two elasticas that push each other at atan(mu) from the
    normal, at the point halfway: the moment of friction's arm moves the push by 0.5 %."""
    state = drawn(2)[-1]
    guess = facing(1.7, 0.005, APART, 3.0, [0.8, 0.71, -0.6, -0.7, -0.2])
    for part in (0.5, 1.0):
        guess, energy = facing_rubbed(1.7 + WAY * part, 0.005, APART, 3.0, MU * part, guess)
    normal, place, low, high, angle = guess
    push, friction = on_the_first(state)
    assert np.linalg.norm(push) == pytest.approx(normal, rel=1e-4)
    assert np.arctan2(push[0], -push[2]) == pytest.approx(angle, abs=1e-3)
    assert [one.s for one in state.slides] == pytest.approx([place] * 2, abs=1e-4)
    moments = state.strips[0].start.moment[1], -state.strips[1].start.moment[1]
    assert moments == pytest.approx((low, high), rel=1e-4)
    assert state.energy.elastic == pytest.approx(energy, rel=1e-4)
    assert (push + friction)[0] == pytest.approx(normal * (MU * np.cos(angle) + np.sin(angle)), abs=2e-4)


def test_the_clamps_work_is_energy_and_what_friction_took_away():
    """W - (E - E_0) - D of the second half of the way, all of which slides, falls with the increment."""
    left = []
    for steps in (2, 4):
        states = drawn(steps)[steps // 2 :]
        pull = np.array([state.strips[1].start.force[0] for state in states])
        work = 0.5 * float(np.sum(pull[1:] + pull[:-1])) * WAY / steps
        lost = states[-1].rubbed - states[0].rubbed
        left.append(work - (states[-1].energy.total - states[0].energy.total) - lost)
    assert left[0] / left[1] == pytest.approx(2.0, abs=0.1)
    assert lost > 100.0 * abs(left[1])


def test_a_scene_turned_is_the_scene():
    """Sizes to 1e-6. Places are sought to 1e-6 l on either strip, which turns a push by twice that over the 0.05 l
    between them, and friction by it over the slip."""
    one, other = drawn(2)[-1], drawn(2, turn=0.7)[-1]
    assert other.energy.elastic == pytest.approx(one.energy.elastic, rel=1e-7)
    assert other.rubbed == pytest.approx(one.rubbed, rel=1e-6)
    slip = min(np.linalg.norm(each.slip) for each in one.slides)
    assert slip > 0.01
    for here, there, far in zip(on_the_first(one), on_the_first(other), (one.problem.apart, slip), strict=True):
        size = np.linalg.norm(here)
        assert np.linalg.norm(there) == pytest.approx(size, rel=1e-6)
        assert about(0.7) @ here == pytest.approx(there, abs=2e-6 / far * size)


@pytest.mark.parametrize(("angle", "near"), [(0.002, 1e-5), (0.02, 3e-4)])
def test_what_turns_all_together_does_not_slide(angle, near):
    """An increment in which clamps and weight turn as one body: friction goes with it, and takes nothing away. What
    slips is at its bound still; why it turns a little more by larger turns is not shown."""
    state = drawn(2)[-1]
    rotation = about(angle)
    new = path.stepped(assembled(*problem(1.0, rotation=rotation), friction=MU), state)
    assert new.ok
    assert new.rubbed == pytest.approx(state.rubbed, abs=1e-8)
    assert new.energy.elastic == pytest.approx(state.energy.elastic, rel=1e-5)
    assert rotation @ on_the_first(state)[1] == pytest.approx(on_the_first(new)[1], abs=near)


FLOOR = Wall((0.0, 0.0, -0.05), (0.0, 0.0, 1.0))


def test_what_rubs_on_another_strip_and_on_a_floor_balances_with_both():
    """The lower strip on a floor, both clamps drawn apart: Coulomb's law at either with its own coefficient, forces and
    moments on the lower one, which is weightless, and on the upper; what is taken away by both."""
    rough = 0.3

    def members(t):
        low, high = problem(t)[0]
        at = np.add(low.start.position, (-0.02 * t, 0.0, 0.0))
        return [replace(low, start=replace(low.start, position=at)), high]

    rest = problem(0.0)[1:]
    state = strips.solve(members(0.0), *rest, walls=[FLOOR])
    for t in (0.25, 0.5):
        walls = [replace(FLOOR, friction=rough)]
        state = path.stepped(assembled(members(t), *rest, walls=walls, friction=MU), state)
    assert state.ok
    push, friction = on_the_first(state)
    assert np.linalg.norm(friction) == pytest.approx(MU * np.linalg.norm(push), rel=1e-6)
    floor, clamp = state.strips[0].walls[0], state.strips[0].start
    assert floor.force[2] > 0.3
    assert floor.friction[0] == pytest.approx(rough * floor.force[2], rel=1e-6)  # drawn along -x
    assert clamp.force + push + friction + floor.force + floor.friction == pytest.approx(np.zeros(3), abs=1e-6)
    moments = sum(np.cross(one.at, one.force) for one in state.touching)
    moments = moments + sum(np.cross(one.point, one.friction) for one in state.slides)
    moments = moments + sum(
        np.cross(one.point, one.push * np.array([0.0, 0.0, 1.0]) + one.friction) for one in floor.rubs
    )
    at = state.positions(0, np.zeros(1))[0]
    assert clamp.moment + np.cross(at, clamp.force) + moments == pytest.approx(np.zeros(3), abs=1e-6)
    assert state.strips[1].start.force - push - friction == pytest.approx([0.0, 0.0, 3.0], abs=1e-6)
    taken = -sum(one.friction @ one.slip for one in (*state.slides, *floor.rubs))
    assert state.rubbed - state.before.rubbed == pytest.approx(taken, rel=1e-8)
    assert with_error(state).error < 1e-4


@pytest.mark.parametrize("energy", ["kirchhoff", "wunderlich"])
def test_spots_of_both_strips_are_the_point_halfway_between(energy):
    """Of strips of other lengths, curved and with oblique rulings: the point of each by its shape, without slip; and a
    turn of all leaves them together."""
    members = cantilevers(0.6, 0.03, 1.0, 5, width=0.1)
    members[1] = replace(members[1], strip=replace(members[1].strip, length=1.7), segments=4)
    whole = assembled(members, (), Gravity((0.0, 0.0, 1.0)), energy, APART, friction=MU)
    shape = [(np.linspace(0.4, 1.2, n), np.linspace(-0.3, 0.5, n)) for n in (6, 5)]
    x = placed(whole, shape)
    places = [np.array([0.37, 0.02]), np.array([0.52, -0.011])]
    at = []
    for k, (s, u) in enumerate(places):
        part, own = whole.parts[k], whole.own(x, k)
        r, ruling, _, _ = nearness.shape(part, own, np.array([s]))
        at.append(whole.lengths_over[k] * (r + u * ruling)[0])
    spots = tuple(sliding._spot(whole, x, k, places[k], 0.5 * (at[1 - k] - at[k])) for k in range(2))
    slide = Slide(0, 1, spots, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), 1.0, (0.0, 0.0, 0.0))
    term = whole.with_changes(slides=(slide,)).friction
    assert term.points(x)[0] == pytest.approx(0.5 * (at[0] + at[1]), abs=1e-12)
    assert term.slips(x)[0] == pytest.approx(np.zeros(3), abs=1e-12)


def crossing(t, side=1.0):
    """A heavy ruled strip across another one that is weightless, its clamp drawn along that and a little aside."""
    members = cantilevers(0.8, 0.005, 3.0, 4)
    over = members[1].start
    at = np.add(over.position, (WAY * t, -0.02 * t, 0.0)) * (1.0, side, 1.0)
    members[1] = replace(members[1], start=replace(over, position=at, tangent=(0.0, side, 0.0)))
    return members, (), Gravity((0.0, 0.0, 1.0)), "wunderlich", APART


@cache
def crossed(side):
    begun = strips.solve(*crossing(0.0, side))
    return path.stepped(assembled(*crossing(0.5, side), friction=MU), begun)


@pytest.mark.validate  # 15 s
def test_ruled_strips_that_cross_rub_and_the_mirrored_ones_alike():
    """Coulomb's law and moments about the clamp of the lower one; mirrored at y = 0 the forces are so too."""
    one, other = crossed(1.0), crossed(-1.0)
    assert one.ok
    push, friction = on_the_first(one)
    assert np.linalg.norm(friction) == pytest.approx(MU * np.linalg.norm(push), rel=1e-5)
    clamp, at = one.strips[0].start, one.positions(0, np.zeros(1))[0]
    moments = sum(np.cross(each.at, each.force) for each in one.touching)
    moments = moments + sum(np.cross(each.point, each.friction) for each in one.slides)
    assert clamp.force + push + friction == pytest.approx(np.zeros(3), abs=1e-6)
    assert clamp.moment + np.cross(at, clamp.force) + moments == pytest.approx(np.zeros(3), abs=1e-6)
    assert abs(friction[1]) > 1e-2
    for here, there in zip((push, friction), on_the_first(other), strict=True):
        assert here * (1.0, -1.0, 1.0) == pytest.approx(there, abs=1e-5)
    assert other.rubbed == pytest.approx(one.rubbed, rel=1e-5)


def test_the_order_of_the_strips_says_nothing():
    """Upper strip first, each of its own length: forces on it are the opposite ones."""
    found = []
    for order in (1, -1):
        members, joints, up, energy, apart = problem(0.0)
        states = [strips.solve(members[::order], joints, up, energy, apart)]
        for t in (0.5, 1.0):
            members = problem(t)[0][::order]
            states.append(path.stepped(assembled(members, joints, up, energy, apart, friction=MU), states[-1]))
        found.append(on_the_first(states[-1]))
    for here, there in zip(*found, strict=True):
        assert here == pytest.approx(-there, abs=1e-6)


def test_a_tip_slides_over_a_joint_of_segments():
    """From s = 0.743 to 0.751, the joint at 0.75, in one increment: it settles, and the law holds."""
    begun = path.stepped(assembled(*problem(1.25), friction=MU), drawn(2)[-1])
    state = path.stepped(assembled(*problem(1.5), friction=MU), begun)
    assert state.ok
    assert max(one.s for one in begun.slides) < 0.75 < min(one.s for one in state.slides)
    push, friction = on_the_first(state)
    assert np.linalg.norm(friction) == pytest.approx(MU * np.linalg.norm(push), rel=1e-6)


def test_what_touches_anew_has_no_friction():
    state = drawn(2)[-1]
    clear = replace(state, rows=np.zeros_like(state.rows))
    assert sliding.slides(state.problem, state.x, state.rows, state)
    assert not sliding.slides(state.problem, state.x, state.rows, clear)


def test_drawn_back_a_little_it_sticks():
    """Friction turns round before anything slips: less than mu N, and nothing is lost."""
    state = drawn(2)[-1]
    back = path.stepped(assembled(*problem(0.995), friction=MU), state)
    assert back.ok
    assert not any(one.slips for one in back.slides)
    assert max(np.linalg.norm(one.slip) for one in back.slides) < 1e-8
    assert back.rubbed == pytest.approx(state.rubbed, abs=1e-9)


def test_derivatives_of_what_rubs():
    """Gradient and Hessian of the energy with friction by differences, off the equilibrium."""
    state = drawn(2)[-1]
    whole = state.problem
    rng = np.random.default_rng(5)
    x, d = state.x + 1e-4 * rng.normal(size=state.x.size), rng.normal(size=state.x.size)
    h = 1e-6
    term = whole.friction
    values = [term.value(x + sign * h * d) for sign in (1.0, -1.0)]
    gradients = [np.zeros(x.size) for _ in range(3)]
    for gradient, at in zip(gradients, (x + h * d, x - h * d, x), strict=True):
        term.add_gradient(at, gradient)
    assert (values[0] - values[1]) / (2.0 * h) == pytest.approx(gradients[2] @ d, rel=1e-6)
    both = whole.with_changes(slides=())
    rows = np.zeros(state.rows.size)
    second = (whole.hessian_matrix(x, rows) - both.hessian_matrix(x, rows)) @ d
    by_steps = (gradients[0] - gradients[1]) / (2.0 * h)
    assert np.abs(second - by_steps).max() < 1e-5 * np.abs(by_steps).max()


def test_the_error_is_that_of_the_increment_on_shorter_segments():
    found = with_error(drawn(2)[-1])
    assert 0.0 < found.error < 1e-3


def test_friction_without_a_way_or_without_contact_is_refused():
    with pytest.raises(RibbonInputError, match="along a path only"):
        strips.solve(*problem(0.0), friction=MU)
    with pytest.raises(RibbonInputError, match="kept apart"):
        assembled(*problem(0.0)[:4], friction=MU)
    with pytest.raises(RibbonInputError, match=">= 0"):
        assembled(*problem(0.0), friction=-MU)
