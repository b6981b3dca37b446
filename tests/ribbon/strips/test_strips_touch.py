"""Strips that touch each other: beams, a shooting of two elasticas, what is kept and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from ribbon import Clamp, Gravity, RibbonInputError, Strip
from ribbon.find.strips import path, touch
from ribbon.find.strips import solve as strips
from ribbon.find.strips.assemble import Member, assembled, shapes
from ribbon.problems.strips.joint import End, Joint
from ribbon.problems.strips.place import placed
from ribbon.solvers.budget import within
from tests.reference.joined_rods import facing
from tests.ribbon.strips.strips_scenes import bigon

UP = Gravity((0.0, 0.0, 1.0))
APART = 0.05


def cantilevers(over, gap, weight, segments, width=0.05, opposite=False):
    """Two cantilevers of length 1 with their faces up: the first one along x, weightless, clamped at (-over, 0, 0);
    the second one a `gap` beyond the distance to keep above it, along y or (opposite) along -x, heavy."""
    section = {"width": width, "poisson": 0.3, "thickness": 0.2 * width}
    low = Clamp((-over, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    way = (-1.0, 0.0, 0.0) if opposite else (0.0, 1.0, 0.0)
    high = Clamp(-over * np.array(way) + [0.0, 0.0, APART + gap], way, (0.0, 0.0, 1.0))
    return [
        Member(Strip(length=1.0, gamma=0.0, **section), low, segments=segments, name="low"),
        Member(Strip(length=1.0, gamma=weight, **section), high, segments=segments, name="high"),
    ]


def on_high(state, high=-1):
    """The force (3,) of all contacts on one strip, in D_0 w_0 / l_0^2; -1: the last one."""
    high %= len(state.strips)
    return np.sum([one.force * (1.0 if one.one == high else -1.0) for one in state.touching], axis=0)


@pytest.mark.parametrize("cut", [False, True])
def test_cantilevers_that_cross_share_the_force_as_beams_do(cut):
    """Small deflections, crossing at x = a: q a^2 (6 - 4 a + a^2) / 24 - F a^3 / 3 - gap = F a^3 / 3; cut: the lower
    one is two strips of half the length, and the unit of all forces four times as large."""
    over, gap, weight = 0.9, 1e-4, 0.02
    low, high = cantilevers(over, gap, weight, 10, 0.002)
    members, joints, unit = [low, high], [], 1.0
    if cut:
        half = replace(low.strip, length=0.5)
        members = [replace(low, strip=half, segments=5), high, Member(half, segments=5)]
        joints, unit = [Joint(End(0, -1), End(2, 0), "seamless")], 4.0
    found = strips.solve(members, joints, UP, "kirchhoff", APART)
    sinks = weight * over**2 * (6.0 - 4.0 * over + over**2) / 24.0
    assert found.ok
    force = unit * on_high(found, 1)
    assert force[2] == pytest.approx((sinks - gap) / (2.0 * over**3 / 3.0), rel=2e-3)
    assert unit * found.strips[0].start.force[2] == pytest.approx(force[2], abs=1e-6)
    assert found.strips[1].start.force[2] + force[2] == pytest.approx(weight, abs=1e-6)
    assert found.depth <= touch.TOLERANCE


@pytest.mark.parametrize("crossing", [0.327, 0.3274])
def test_a_place_beside_a_joint_has_one_row_on_its_segment(crossing):
    """Rows on both sides of it hold the same place, one of them on the element continued."""
    members = cantilevers(0.8, 0.01, 3.0, 10)
    members[0] = replace(members[0], start=replace(members[0].start, position=(-crossing, 0.0, 0.0)))
    found = strips.solve(members, (), UP, "kirchhoff", APART)
    assert found.ok
    rows = found.problem.between(0, 1)
    assert rows.places(found.x)[0, 0] == pytest.approx(0.3, abs=1e-3)
    assert rows.count == 1
    assert np.abs(rows.past(found.x)).max() < 1e-7
    (one,) = found.touching
    told = [
        strip.position([s])[0] + v * strip.frame([s])[0, :, 0]
        for strip, s, v in zip(found.strips, (one.s, one.s_other), (one.v, one.v_other), strict=True)
    ]
    apart = told[0] - told[1]
    assert np.cross(one.force, apart) == pytest.approx(np.zeros(3), abs=1e-7 * np.linalg.norm(one.force))
    assert np.linalg.norm(apart) == pytest.approx(APART, abs=1e-8)


def test_places_are_told_on_strips_of_other_segments():
    """Each place by the segments of its own strip: ten of one and three of the other."""
    members = cantilevers(0.8, 0.01, 3.0, 10)
    few = [members[0], replace(members[1], segments=3)]
    found = strips.solve(few[::-1], (), UP, "kirchhoff", APART)
    assert found.ok
    (one,) = found.touching
    feet = (one.at, one.s, one.v), (one.at_other, one.s_other, one.v_other)
    for strip, (at, s, v) in zip(found.strips, feet, strict=True):
        assert strip.position([s])[0] + v * strip.frame([s])[0, :, 0] == pytest.approx(at, abs=1e-8)


def test_cantilevers_that_face_each_other_press_as_two_elasticas():
    over, gap, weight = 0.85, 0.005, 3.0
    found = strips.solve(cantilevers(over, gap, weight, 8, opposite=True), (), UP, "kirchhoff", APART)
    assert found.ok
    force, place, low, _, angle = facing(2 * over, gap, APART, weight, [0.8, 0.71, -0.6, -0.7, -0.2])
    pushed = on_high(found)
    assert np.linalg.norm(pushed) == pytest.approx(force, rel=1e-3)
    assert np.arctan2(-pushed[0], pushed[2]) == pytest.approx(angle, abs=2e-3)
    assert found.strips[0].start.moment[1] == pytest.approx(low, rel=2e-3)
    assert [one.s for one in found.touching] == pytest.approx([place] * 2, abs=2e-3)
    # its corners, but for rounding: whatever is pushed alike on both sides of the middle has the same sum
    assert [abs(one.v) for one in found.touching] == pytest.approx([0.025] * 2, abs=1e-3)
    assert [one.gap for one in found.touching] == pytest.approx([APART] * 2, abs=1e-6)
    assert found.strips[0].start.force == pytest.approx(pushed, abs=1e-6)
    assert found.strips[1].start.force + pushed == pytest.approx([0.0, 0.0, weight], abs=1e-6)


def test_strips_that_are_clear_of_each_other_are_as_they_are_alone():
    members = cantilevers(0.9, 0.4, 1.0, 6)
    here, alone = (strips.solve(members, (), UP, "kirchhoff", apart) for apart in (APART, 0.0))
    assert here.ok
    assert not here.touching
    assert here.depth == 0.0
    assert alone.depth is None
    assert here.energy.total == pytest.approx(alone.energy.total, rel=1e-9)


def test_the_nearest_places_of_two_strips_are_found_and_slide_onto_them():
    """Straight strips that cross: the gap is what is between their planes, at the crossing."""
    members = cantilevers(0.61, 0.02, 0.0, 5)
    problem = assembled(members, (), None, "kirchhoff", APART)
    x = placed(problem, shapes(problem, members, None))
    near = touch.minima(problem, x, 0.1)
    assert near
    assert near[0][0] == pytest.approx(0.02, abs=1e-9)
    assert not touch.minima(problem, x, 0.01)


def test_strips_kept_a_hair_apart_meet_from_far_above():
    """They fall fifty times the distance that they keep: their push tends to that of strips kept farther apart, from
    as high above what they keep, linearly in the distance."""
    pushes = {}
    for kept in (1e-3, 4e-3, 1e-2):
        found = strips.solve(cantilevers(0.8, 0.1 + kept - APART, 3.0, 8, 0.03), (), UP, "kirchhoff", kept)
        assert found.ok
        assert found.depth <= touch.TOLERANCE
        assert len(found.touching) == 1
        assert found.iterations < 200  # once by an eighth of the distance a step, also where they lay on each other
        pushes[kept] = on_high(found)
    between = pushes[1e-3] + (pushes[1e-2] - pushes[1e-3]) * 3.0 / 9.0
    assert pushes[4e-3] == pytest.approx(between, abs=1e-5)
    assert pushes[1e-3][2] > 0.4


def test_a_way_on_which_strips_pass_through_each_other_is_seen():
    """High goes from above to below the other by three distances, nowhere near it at both ends, or up and away."""
    low, high = cantilevers(0.6, 0.05, 0.0, 6)
    shapes_at = {}
    for z in (0.1, -0.1, 0.25):
        members = [low, replace(high, start=replace(high.start, position=(0.0, -0.6, z)))]
        problem = assembled(members, (), None, "kirchhoff", APART)
        shapes_at[z] = placed(problem, shapes(problem, members, None))
    near = touch.minima(problem, shapes_at[0.1], 1.0)
    held = problem.with_changes(touching=touch.around(problem, [each for _, each in near]))
    assert touch._astray(held, shapes_at[0.1], shapes_at[-0.1], 1.0)
    assert not touch._astray(held, shapes_at[0.1], shapes_at[0.25], 1.0)
    assert touch._astray(held, shapes_at[0.1], shapes_at[0.25], 0.1)  # farther than what is held could be from it


def test_a_strip_that_is_let_down_on_another_meets_it():
    """A stage of a path at which few steps from the barrier lead off the other strip, and the next ones back: the two
    went on for good. Each clamp carries the weight of its strip but for the push."""
    section = {"length": 1.0, "width": 0.05, "poisson": 0.4}
    way = (np.cos(np.radians(80.0)), np.sin(np.radians(80.0)), 0.0)

    def members(z):
        low = Clamp((-0.75, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
        high = Clamp((-0.8 * way[0], -0.8 * way[1], z), way, (0.0, 0.0, 1.0))
        return [
            Member(Strip(gamma=1.7303, thickness=2e-3, **section), low, segments=10),
            Member(Strip(gamma=3.0761, thickness=1.5e-3, **section), high, stiffness=0.421875, segments=10),
        ]

    before = strips.solve(members(0.1636), (), UP, "kirchhoff", 2e-3)
    assert before.ok
    assert not before.touching
    with within(10.0):
        found = path.stepped(assembled(members(0.154), (), UP, "kirchhoff", 2e-3), before)
    assert found.ok
    assert found.depth <= touch.TOLERANCE
    push = on_high(found)
    assert found.touching
    assert push[2] > 1e-3
    assert 0.421875 * found.strips[1].start.force + push == pytest.approx([0.0, 0.0, 0.421875 * 3.0761], abs=1e-6)
    assert found.strips[0].start.force - push == pytest.approx([0.0, 0.0, 1.7303], abs=1e-6)


def test_strips_that_begin_through_each_other_are_refused_with_the_place():
    with pytest.raises(RibbonInputError, match=r"low at s = .* high at s = .*nearer than they are kept"):
        strips.solve(cantilevers(0.9, -0.01, 1.0, 5), (), UP, "kirchhoff", APART)


def test_strips_are_not_looked_at_beside_a_joint_that_joins_them():
    members, joints = bigon(60.0, 1, (1.0, 1.0))
    members[0] = Member(members[0].strip, Clamp(), segments=12, curvature=(1.0,))
    problem = assembled(members, joints[1:], apart=0.03)
    x = placed(problem, shapes(problem, members, None))
    beside = touch.BESIDE * 0.05
    for _, near in touch.minima(problem, x, 0.05):
        assert max(1.0 - near.pair.s, 1.0 - near.pair.s_other) > beside - 1e-9
    apart = assembled(members, joints[1:], apart=0.03).with_changes(joints=())
    assert touch.minima(apart, x, -0.02)[0][0] < -0.029


@pytest.mark.validate  # 10 s
def test_a_strip_that_is_cut_carries_the_same():
    """The lower cantilever as two strips of half the length, the first of which is the unit: forces at the clamps."""
    over, gap, weight = 0.85, 0.005, 3.0
    low, high = cantilevers(over, gap, weight, 6, opposite=True)
    half = Strip(length=0.5, width=0.05, poisson=0.3, thickness=0.01)
    cut = [Member(half, low.start, segments=3, name="first"), Member(half, segments=3, name="second"), high]
    whole = strips.solve([low, high], (), UP, "kirchhoff", APART)
    found = strips.solve(cut, [Joint(End(0, -1), End(1, 0), "seamless")], UP, "kirchhoff", APART)
    assert whole.ok
    assert found.ok
    assert {(one.one, one.other) for one in found.touching} == {(1, 2)}
    assert found.energy.total * 2 == pytest.approx(whole.energy.total, rel=1e-7)
    assert found.strips[0].start.force * 4 == pytest.approx(whole.strips[0].start.force, abs=1e-5)
    assert found.strips[2].start.moment == pytest.approx(whole.strips[1].start.moment, abs=1e-5)
    assert on_high(found) * 4 == pytest.approx(on_high(whole), abs=1e-5)
