"""Several strips on walls and along paths: the uncut strip, statics, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from ribbon import Clamp, Gravity, RibbonInputError, Strip, Wall, solve
from ribbon.find.continuation import switch
from ribbon.find.friction import path as rubbing_alone
from ribbon.find.solve import build, solve_from
from ribbon.find.strips import finer, path
from ribbon.find.strips import solve as strips
from ribbon.find.strips.assemble import Member, assembled
from ribbon.obstacle import Obstacle
from ribbon.problems.strips.joint import End, Joint
from ribbon.solid import Solid
from tests.ribbon.strips.strips_scenes import OBLIQUE, SECTION, UP, chain, cut

S = np.linspace(0.0, 1.0, 41)
GAMMA, CURVATURE = 30.0, 0.5
WALLS = {
    "plane": Wall((-0.25, 0.0, 0.0), (1.0, 0.0, 0.0)),
    "oblique plane": Wall((-0.25, 0.0, 0.0), (np.cos(0.2), np.sin(0.2), 0.0)),
    "cylinder": Obstacle("cylinder", (-0.35, -0.2, 0.9), 0.1, (0.0, 1.0, 0.0)),
    "edge": Solid("edge", (-0.25, -0.2, 0.9), 1e-2, (0.0, 1.0, 0.0), normal=(1.0, 0.0, 0.0)),
}


def whole(walls, energy, clamp=OBLIQUE):
    strip = Strip(length=1.0, natural_curvature=CURVATURE, gamma=GAMMA, **SECTION)
    return solve(strip, clamp, UP, energy=energy, segments=12, formulation="mixed", walls=walls)


def places(state, parts):
    return np.vstack([state.positions(k, S) / parts for k in range(parts)])


@pytest.mark.parametrize(
    ("name", "energy"),
    [*((name, "kirchhoff") for name in WALLS), *((name, "wunderlich") for name in WALLS if name != "cylinder"),
     pytest.param("cylinder", "wunderlich", marks=pytest.mark.validate)],
)  # fmt: skip
def test_a_strip_cut_and_joined_on_a_wall_is_the_uncut_one(name, energy):
    """Shape and energy to 1e-8, the wall's force to 1e-6, on joints and at places between them."""
    one = whole([WALLS[name]], energy)
    assert one.ok
    for parts in (2, 3):
        found = strips.solve(cut(parts, 12, GAMMA, CURVATURE), chain(parts), UP, energy, walls=[WALLS[name]])
        assert found.ok
        assert found.energy.total * parts == pytest.approx(one.energy.total, rel=1e-8)
        there = np.vstack([one.position((k + S) / parts) for k in range(parts)])
        assert np.abs(places(found, parts) - there).max() < 1e-8
        force = parts**2 * np.sum([strip.walls[0].force for strip in found.strips], axis=0)
        assert force == pytest.approx(one.walls[0].force, abs=1e-6)
        assert np.linalg.norm(force) > 0.1
        assert found.penetration <= 1e-6


def test_a_wall_out_of_reach_changes_nothing():
    far = Wall((-5.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    members = cut(2, 12, GAMMA, CURVATURE)
    here, alone = strips.solve(members, chain(2), UP, walls=[far]), strips.solve(members, chain(2), UP)
    assert here.energy.total == pytest.approx(alone.energy.total, rel=1e-10)
    assert here.penetration == 0.0
    assert alone.penetration is None
    assert max(float(np.abs(strip.walls[0].force).max()) for strip in here.strips) < 1e-8


def test_a_strip_comes_to_lie_along_a_bar_between_its_edges():
    """Up to its free end, where the ruling is nearest to the bar between its ends: alone, and cut and joined."""
    level, up = Clamp((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)), Gravity((0.0, 0.0, 1.0))
    bar = Obstacle("cylinder", (0.0, 0.0, -0.06), 0.04, (1.0, 0.0, 0.0))
    section = {"width": 0.06, "poisson": 0.4, "thickness": 1e-3}
    strip = Strip(1.0, gamma=18.0, **section)
    one = solve(strip, level, up, energy="kirchhoff", segments=10, formulation="mixed", walls=[bar])
    members = [Member(Strip(0.5, gamma=18.0 / 8.0, **section), clamp, segments=5) for clamp in (level, None)]
    cut_one = strips.solve(members, chain(2), up, "kirchhoff", walls=[bar])
    flat = Wall((0.0, 0.0, -0.02), (0.0, 0.0, 1.0))  # the bar's highest line, for a strip that stays level across
    plane = solve(strip, level, up, energy="kirchhoff", segments=10, formulation="mixed", walls=[flat])
    for found, force in ((one, one.walls[0].force), (cut_one, 4.0 * sum(s.walls[0].force for s in cut_one.strips))):
        assert found.ok
        assert found.penetration <= 1e-6
        assert force[2] == pytest.approx(plane.walls[0].force[2], rel=2e-4)
        assert force[:2] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert one.walls[0].contacts.max() == pytest.approx(1.0, abs=1e-6)
    assert one.end.position[2] == pytest.approx(-0.02, abs=1e-6)
    assert np.abs(places(cut_one, 2) - np.vstack([one.position((k + S) / 2) for k in range(2)])).max() < 1e-5


def test_a_strip_hung_on_another_lies_on_a_table():
    """The second one, joined by a hinge, comes to rest on the table along a line: joint and table carry its weight."""
    table = Wall((0.0, 0.0, -0.5), (0.0, 0.0, 1.0))
    level = Clamp((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    members = [Member(Strip(length=1.0, gamma=2.0, **SECTION), level, segments=10),
               Member(Strip(length=1.0, gamma=2.0, **SECTION), segments=10)]  # fmt: skip
    joints = [Joint(End(0, -1), End(1, 0), "hinge")]
    found = strips.solve(members, joints, Gravity((0.0, 0.0, 1.0)), "kirchhoff", walls=[table])
    assert found.ok
    assert found.penetration <= 1e-6
    carried = sum(strip.walls[0].force for strip in found.strips)
    assert found.strips[0].start.force + carried == pytest.approx([0.0, 0.0, 4.0], abs=1e-7)
    assert found.joints[0].force + found.strips[1].walls[0].force == pytest.approx([0.0, 0.0, 2.0], abs=1e-7)
    assert found.strips[1].walls[0].force[2] > 0.5


@pytest.mark.parametrize(
    ("wall", "said"),
    [(Wall((0, 0, -1.0), (0, 0, 1.0), stiffness=3.0), "rigid"),
     (Wall((0, 0, -1.0), (0, 0, 1.0), friction=0.3), "along a path only"),
     (replace(WALLS["edge"], friction=0.3), "no friction")],
)  # fmt: skip
def test_plates_on_springs_and_friction_without_a_way_are_refused(wall, said):
    members = cut(2, 12, GAMMA, CURVATURE)
    with pytest.raises(RibbonInputError, match=said):
        (assembled if said == "no friction" else strips.solve)(members, chain(2), UP, walls=[wall])


def _pressed(t, mu, shift=0.0):
    """A clamp that comes down by 0.05 on a floor, along which the end slides, or a floor that moves by `shift`."""
    slope = np.radians(30.0)
    tangent, normal = (0.0, -np.sin(slope), np.cos(slope)), (0.0, np.cos(slope), np.sin(slope))
    fall = 0.0 if shift else 0.05 * t
    return Clamp((0.0, 0.35 - fall, 0.0), tangent, normal), Wall((0.0, 0.0, shift * t), (0.0, 1.0, 0.0), friction=mu)


def _cut_and_pressed(t, mu, shift=0.0):
    clamp, floor = _pressed(t, mu, shift)
    strip = Strip(0.5, 0.02, gamma=3.0 / 8.0)
    members = [Member(strip, clamp if k == 0 else None, segments=4, curvature=(-0.5,)) for k in range(2)]
    return {"members": members, "joints": chain(2), "gravity": Gravity((0.0, 1.0, 0.0)), "energy": "sadowsky",
            "walls": [floor]}  # fmt: skip


@pytest.mark.parametrize(("mu", "shift"), [(0.3, 0.0), (0.9, 1e-4)])
def test_a_cut_strip_rubs_as_the_uncut_one(mu, shift):
    """An end that slides outwards takes all of mu N against it; one that a floor carries along sticks. The state before
    is kept: shape, pushes, friction and what it took away are those of the uncut strip by its own machinery."""

    def whole_one(t, mu):
        clamp, floor = _pressed(t, mu, shift)
        return build(Strip(1.0, 0.02, gamma=3.0), clamp, Gravity((0.0, 1.0, 0.0)), energy="sadowsky", segments=8,
                     formulation="mixed", walls=[floor])  # fmt: skip

    first = whole_one(0.0, 0.0)
    start = solve_from(first, first.state(np.full(9, -0.5), np.zeros(9)))
    one = rubbing_alone.follow(lambda t: whole_one(t, mu), start, steps=2)
    begun = strips.solve(**_cut_and_pressed(0.0, 0.0))
    found, t, log = path.follow(lambda t: assembled(**_cut_and_pressed(t, mu, shift)), begun, 2)
    assert t == 1.0
    assert len(log) == 2
    assert one.ok
    assert found.ok
    alone, own = one.walls[0], found.strips[1].walls[0]
    assert 4.0 * own.force == pytest.approx(alone.force, rel=1e-6)
    assert 4.0 * own.friction == pytest.approx(alone.friction, rel=1e-5, abs=1e-9)
    assert {rub.slips for rub in own.rubs} == {not shift}
    assert np.linalg.norm(own.friction) == pytest.approx(mu * own.force[1], rel=1e-6) or shift
    assert np.linalg.norm(own.friction) > 1e-3
    assert 2.0 * found.rubbed == pytest.approx(one.rubbed, rel=1e-6, abs=1e-12)
    there = np.vstack([one.position((k + S) / 2) for k in range(2)])
    assert np.abs(places(found, 2) - there).max() < 1e-8
    if not shift:
        assert 0.0 < finer.with_error(found).error < 1e-4


def test_what_friction_took_away_is_kept_where_it_ends():
    """Three increments, the last one without friction: what the two before it lost."""

    def at(t):
        return assembled(**_cut_and_pressed(t, 0.3 if t < 0.9 else 0.0))

    state = strips.solve(**_cut_and_pressed(0.0, 0.0))
    lost = []
    for t in (0.4, 0.8, 1.0):
        state = path.stepped(at(t), state)
        assert state.ok
        lost.append(state.rubbed)
    assert 0.0 < lost[0] < lost[1] == lost[2]
    assert state.before is None


@pytest.mark.parametrize(
    ("ends", "steps", "first"), [((0.3, 0.3), None, 0.05), ((0.3, 0.0), None, 0.05), ((0.0, 0.3), None, 0.05),
                                 ((0.0, 0.0), None, 0.1), ((0.3, 0.3), 2, 0.5)],
)  # fmt: skip
def test_increments_are_short_where_either_end_of_a_way_has_friction(monkeypatch, ends, steps, first):
    start = strips.solve(**_cut_and_pressed(0.0, 0.0))
    monkeypatch.setattr(path, "stepped", lambda problem, state: state)
    _, t, log = path.follow(lambda t: assembled(**_cut_and_pressed(t, np.interp(t, (0, 1), ends))), start, steps)
    assert t == 1.0
    assert log[0].t == pytest.approx(first)
    if any(ends):
        assert len(log) == round(1.0 / first)


def test_strips_that_no_clamp_holds_have_no_wall():
    with pytest.raises(RibbonInputError, match="clamp"):
        strips.solve(cut(2, 12, 0.0, CURVATURE, None), chain(2), walls=[WALLS["plane"]])


def _lowered(t):
    return Clamp((0.1 - 0.3 * t, -0.2, 0.3 + 0.05 * t), (0.0, 0.0, 1.0), (-np.sqrt(0.5), np.sqrt(0.5), 0.0))


def test_a_cut_strip_that_is_lowered_on_a_wall_is_the_uncut_one():
    """Its clamp moves down by 0.3 in increments, from clear of the wall to where it lies on it."""
    wall = Wall((-0.85, 0.0, 0.0), (1.0, 0.0, 0.0))
    strip = Strip(length=1.0, natural_curvature=CURVATURE, gamma=GAMMA, **SECTION)
    one = whole([wall], "kirchhoff")
    for t in (0.25, 0.5, 0.75, 1.0):
        near = build(strip, _lowered(t), UP, energy="kirchhoff", segments=12, formulation="mixed", walls=[wall])
        one = switch(near, one)
    assert one.ok

    def at(t):
        members = cut(2, 12, GAMMA, CURVATURE, _lowered(t))
        return assembled(members, chain(2), UP, "kirchhoff", walls=[wall])

    start = strips.solve(cut(2, 12, GAMMA, CURVATURE), chain(2), UP, "kirchhoff", walls=[wall])
    assert np.abs(start.strips[1].walls[0].force).max() < 1e-8
    found, t, log = path.follow(at, start, 4)
    assert t == 1.0
    assert found.ok
    assert all(one.kept for one in log)
    assert found.strips[1].walls[0].contacts.size
    there = np.vstack([one.position(0.5 * S), one.position(0.5 + 0.5 * S)])
    assert np.abs(places(found, 2) - there).max() < 1e-7
    assert 2.0 * found.energy.total == pytest.approx(one.energy.total, rel=1e-8)


def test_a_bar_that_is_lifted_takes_joined_strips_along():
    """In one increment it would have gone through them: it is cut, and the strips are borne."""
    members, joints = cut(2, 12, 6.0, 0.0, Clamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))), chain(2)

    def bar(t):
        return [Obstacle("cylinder", (0.2 * t - 0.1, 0.0, 0.5), 0.05, (0.0, 1.0, 0.0))]

    start = strips.solve(members, joints, UP, "kirchhoff", walls=bar(0.0))
    found, t, log = path.follow(lambda t: assembled(members, joints, UP, "kirchhoff", walls=bar(t)), start, 1)
    assert t == 1.0
    assert found.ok
    assert not log[0].kept
    assert found.energy.total > start.energy.total + 0.5
    assert sum(strip.walls[0].force[0] for strip in found.strips) > 0.5
    assert found.penetration < 1e-6


def test_a_path_that_leads_to_nothing_says_how_far_it_got():
    """Both ends clamped and drawn apart until the strips are too short."""
    straight = Clamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))

    def members(t):
        end = Clamp((0.0, 0.0, 1.6 + 0.6 * t), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
        return [Member(Strip(length=1.0, **SECTION), straight, segments=6, curvature=(2.0,)),
                Member(Strip(length=1.0, **SECTION), None, end, segments=6, curvature=(-2.0,))]  # fmt: skip

    start = strips.solve(members(0.0), chain(2), energy="kirchhoff")
    assert start.ok
    found, t, log = path.follow(lambda t: assembled(members(t), chain(2), energy="kirchhoff"), start)
    assert 0.5 < t < 0.67
    assert not log[-1].kept
    assert found.ok
