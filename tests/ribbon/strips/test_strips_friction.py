"""Strips that rub on each other along a path: Coulomb's law, statics, work, turned and mirrored scenes, refusals."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ribbon import Gravity, RibbonInputError
from ribbon.find.strips import path
from ribbon.find.strips import solve as strips
from ribbon.find.strips.assemble import assembled
from ribbon.find.strips.finer import with_error
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
    one, other = drawn(2)[-1], drawn(2, turn=0.7)[-1]
    assert other.energy.elastic == pytest.approx(one.energy.elastic, rel=1e-7)
    assert other.rubbed == pytest.approx(one.rubbed, rel=1e-6)
    for here, there in zip(on_the_first(one), on_the_first(other), strict=True):
        assert about(0.7) @ here == pytest.approx(there, abs=1e-6)


def test_what_turns_all_together_does_not_slide():
    """An increment in which clamps and weight turn as one body: friction goes with it, and takes nothing away."""
    state = drawn(2)[-1]
    rotation = about(0.002)
    new = path.stepped(assembled(*problem(1.0, rotation=rotation), friction=MU), state)
    assert new.ok
    assert new.rubbed == pytest.approx(state.rubbed, abs=1e-8)
    assert new.energy.elastic == pytest.approx(state.energy.elastic, rel=1e-5)
    assert rotation @ on_the_first(state)[1] == pytest.approx(on_the_first(new)[1], abs=1e-5)


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
