"""Strips joined at their ends: the uncut strip, closed forms, invariances, stability."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from ribbon import Clamp, Gravity, Strip, solve
from ribbon.energies import names
from ribbon.find.strips import finer
from ribbon.find.strips import solve as strips
from ribbon.find.strips.assemble import Member
from ribbon.problems.strips.joint import End, Joint
from ribbon.result import Status
from tests.reference.joined_rods import bigon_of_rods, stiffnesses
from tests.ribbon.strips.strips_scenes import OBLIQUE, SECTION, UP, bigon, chain, cut, ring

S = np.linspace(0.0, 1.0, 41)


def whole_shape(state, parts):
    """Places (k, 3) of a strip cut into equal parts, in the length of the whole."""
    return np.vstack([state.positions(k, S) / parts for k in range(parts)])


@pytest.mark.parametrize("parts", [2, 3])
@pytest.mark.parametrize("energy", ["wunderlich", "sadowsky", *names.FREE])
def test_a_strip_cut_and_joined_is_the_uncut_one(energy, parts):
    gamma, curvature = 30.0, 2.0
    strip = Strip(length=1.0, natural_curvature=curvature, gamma=gamma, **SECTION)
    one = solve(strip, OBLIQUE, UP, energy=energy, segments=12, formulation="mixed")
    found = strips.solve(cut(parts, 12, gamma, curvature), chain(parts), UP, energy)
    assert one.ok
    assert found.ok
    assert found.energy.total * parts == pytest.approx(one.energy.total, rel=1e-8)
    there = np.vstack([one.position((k + S) / parts) for k in range(parts)])
    assert np.abs(whole_shape(found, parts) - there).max() < 1e-8
    held = found.strips[0].start
    assert held.force * parts**2 == pytest.approx(one.start.force, abs=1e-6)
    assert held.moment * parts == pytest.approx(one.start.moment, abs=1e-6)
    assert found.unstable_modes == 0


def test_a_strip_cut_under_the_weight_of_its_surface_is_the_uncut_one():
    up = Gravity((1.0, 0.0, 0.0), exact=True)
    strip = Strip(length=1.0, natural_curvature=2.0, gamma=20.0, **{**SECTION, "width": 0.1})
    one = solve(strip, OBLIQUE, up, segments=12, formulation="mixed")
    members = [replace(member, strip=replace(member.strip, width=0.1)) for member in cut(2, 12, 20.0, 2.0)]
    found = strips.solve(members, chain(2), up)
    assert found.ok
    assert found.energy.total * 2 == pytest.approx(one.energy.total, rel=1e-8)
    assert np.abs(whole_shape(found, 2) - np.vstack([one.position(S / 2), one.position(0.5 + S / 2)])).max() < 1e-8


def test_parts_of_different_lengths_and_either_unit_are_the_uncut_strip():
    """Cut at 0.3, numbered from either side: the unit of energy is that of the first strip."""
    strip = Strip(length=1.0, natural_curvature=1.0, gamma=10.0, **SECTION)
    lengths = (0.1,) * 10
    one = solve(strip, OBLIQUE, UP, energy="kirchhoff", segments=lengths, formulation="mixed")
    pieces = [
        Member(Strip(length=size, natural_curvature=1.0, gamma=10.0 * size**3, **SECTION), clamp, segments=n)
        for size, n, clamp in ((0.3, 3, OBLIQUE), (0.7, 7, None))
    ]
    found = strips.solve(pieces, chain(2), UP, "kirchhoff")
    turned = strips.solve(pieces[::-1], [Joint(End(1, -1), End(0, 0), "seamless")], UP, "kirchhoff")
    for state, size, at in ((found, 0.3, 0), (turned, 0.7, 1)):
        assert state.ok
        assert state.energy.total / size == pytest.approx(one.energy.total, rel=1e-9)
        assert state.strips[at].start.force / 0.3**2 == pytest.approx(one.start.force, abs=1e-8)
        assert state.joints[0].force / size**2 == pytest.approx([7.0, 0.0, 0.0], abs=1e-8)  # the weight behind it


def test_a_joint_holds_the_weight_behind_it_and_its_moment():
    """Cut at the middle: the joint's moment on the second half is that of its own weight about the joint."""
    found = strips.solve(cut(2, 12, 30.0, 2.0), chain(2), UP)
    joint, half = found.joints[0], found.strips[1]
    assert joint.force == pytest.approx([30.0 / 8, 0.0, 0.0], abs=1e-8)
    s, weights = np.polynomial.legendre.leggauss(60)
    places = half.position(0.5 * (s + 1.0))
    arm = 0.5 * weights @ places - half.position([0.0])[0]
    assert joint.moment == pytest.approx(np.cross(arm, [30.0 / 8, 0.0, 0.0]), abs=1e-7)
    assert joint.opened < 1e-9
    assert joint.turned < 1e-9


@pytest.mark.parametrize("energy", ["wunderlich", "kirchhoff"])
@pytest.mark.parametrize("degrees", [30.0, 90.0])
def test_a_fold_of_two_strips_is_two_arcs(energy, degrees):
    """Joined at an angle about t_x at both ends: arcs that turn by the angle, E = angle^2, moment = angle, no force."""
    members, joints = bigon(degrees, 0)
    found = strips.solve(members, joints, energy=energy)
    angle = np.radians(degrees)
    assert found.ok
    assert found.energy.total == pytest.approx(angle**2, rel=1e-9)
    assert [float(np.abs(strip.omega(S)).max()) for strip in found.strips] == pytest.approx([angle] * 2, rel=1e-7)
    assert found.joints[0].moment == pytest.approx([angle, 0.0, 0.0], abs=1e-7)
    assert np.abs(found.joints[0].force).max() < 1e-7


def planar(stiffness, weight):
    """Tip (2,) of a level cantilever of two halves of length 1/2 and these bending stiffnesses under a weight per
    length, by SciPy's collocation: B theta'' = -q (1 - s) cos(theta)."""
    sol = solve_bvp(
        lambda t, y: np.array([
            0.5 * y[1] / stiffness[0], 0.5 * weight * (1.0 - 0.5 * t) * np.cos(y[0]),
            0.5 * y[3] / stiffness[1], 0.5 * weight * (0.5 - 0.5 * t) * np.cos(y[2]),
            0.5 * np.cos(y[0]), 0.5 * np.sin(y[0]), 0.5 * np.cos(y[2]), 0.5 * np.sin(y[2]),
        ]),
        lambda a, b: np.array(
            [a[0], b[0] - a[2], b[1] - a[3], b[3], a[4], a[5], b[4] - a[6], b[5] - a[7]]
        ),
        np.linspace(0.0, 1.0, 41), np.zeros((8, 41)), tol=1e-10,
    )  # fmt: skip
    assert sol.success
    return sol.y[6:, -1]


@pytest.mark.parametrize("stiffness", [(1.0, 4.0), (5.0, 1.0)])
def test_a_cantilever_of_two_stiffnesses_hangs_as_collocation_says(stiffness):
    level = Clamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
    weight = 6.0
    pieces = [
        Member(Strip(length=0.5, gamma=weight * 0.5**3 / b, **SECTION), clamp, stiffness=b, segments=20)
        for b, clamp in zip(stiffness, (level, None), strict=True)
    ]
    found = strips.solve(pieces, chain(2, "rigid"), UP, "kirchhoff")
    assert found.ok
    along, down = planar(stiffness, weight)
    tip = 0.5 * found.positions(1, np.array([1.0]))[0]
    assert tip == pytest.approx([down, 0.0, along], abs=1e-7)


@pytest.mark.parametrize("energy", ["wunderlich", "kirchhoff"])
def test_a_bigon_rises_out_of_the_plane_to_either_side(energy):
    """Joined at an angle in the plane of the strips: mirror images above and below, strips alike, forces none."""
    up, down = (strips.solve(*bigon(25.0, 1, (bend, bend)), energy=energy) for bend in (1.0, -1.0))
    for state in (up, down):
        assert state.ok
        assert state.strips[0].energy.total == pytest.approx(state.strips[1].energy.total, rel=1e-8)
        assert np.abs(state.joints[0].force).max() < 1e-6
        assert state.joints[0].moment == pytest.approx(-state.joints[1].moment, abs=1e-6)
    assert up.energy.total == pytest.approx(down.energy.total, rel=1e-8)
    heights = [float(state.strips[0].end.position[1]) for state in (up, down)]
    assert heights[0] == pytest.approx(-heights[1], rel=1e-7)
    assert abs(heights[0]) > 0.1


def test_three_strips_closed_into_a_ring_are_a_circle():
    strip = Strip(length=1.0, **SECTION)
    members = [Member(strip, segments=8, curvature=(-2 * np.pi / 3,)) for _ in range(3)]
    joints = [*chain(3), Joint(End(2, -1), End(0, 0), "seamless")]
    found = strips.solve(members, joints, energy="kirchhoff")
    assert found.ok
    assert found.energy.total == pytest.approx(3 * 0.5 * (2 * np.pi / 3) ** 2, rel=1e-9)
    assert all(np.abs(joint.force).max() < 1e-7 for joint in found.joints)


def test_a_ring_of_bigons_has_two_stable_states():
    """Six of 60 degrees. Open: alike, with joints at the corners of a hexagon. Folded threefold (T. Yu et al.,
    arXiv:2011.06905): every strip is half a great circle of one sphere, E = pi^2 / 2 of each, and all
    joints stand at its two poles."""
    opened, folded = (strips.solve(*ring(6, 60.0, turns), energy="kirchhoff") for turns in (1, 3))
    for state in (opened, folded):
        assert state.ok
        assert state.unstable_modes == 0
        energies = [strip.energy.total for strip in state.strips]
        assert energies == pytest.approx([energies[0]] * 12, rel=1e-7)
    assert folded.energy.total == pytest.approx(6 * np.pi**2, rel=1e-9)
    assert opened.energy.total < folded.energy.total
    places = np.array([joint.at for joint in folded.joints])
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)
    assert np.minimum(apart, np.abs(apart - 2.0 / np.pi)).max() < 1e-7
    corners = np.array([joint.at for joint in opened.joints[::3]])
    side = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)
    assert side == pytest.approx([side[0]] * 6, rel=1e-7)
    assert np.linalg.norm(corners[0] - corners[3]) == pytest.approx(2.0 * side[0], rel=1e-7)


def test_a_hinged_strip_hangs_straight_down_from_a_cantilever():
    """The hinge about t_x carries the weight of what hangs at it and no moment about its axis."""
    level = Clamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
    pieces = [
        Member(Strip(length=size, gamma=gamma, **SECTION), clamp, segments=8)
        for size, gamma, clamp in ((1.0, 0.5, level), (0.6, 1.0, None))
    ]
    weight = 1.0 / 0.6**2  # D w / l_0^2 of the second strip: gamma D w / l^2
    found = strips.solve(pieces, [Joint(End(0, -1), End(1, 0), "hinge")], UP, "kirchhoff")
    assert found.ok
    assert found.joints[0].force == pytest.approx([weight, 0.0, 0.0], abs=1e-8)
    assert np.abs(found.joints[0].moment).max() < 1e-7
    assert found.strips[1].energy.elastic < 1e-12
    tip = found.positions(1, np.array([0.0, 1.0]))
    assert tip[1] - tip[0] == pytest.approx([-0.6, 0.0, 0.0], abs=1e-8)
    alone = solve(
        Strip(length=1.0, gamma=0.5, **SECTION), level, UP, energy="kirchhoff", segments=8, formulation="mixed",
        tip=[-weight, 0.0, 0.0],
    )  # fmt: skip
    assert found.strips[0].energy.elastic == pytest.approx(alone.energy.elastic, rel=1e-8)


def test_a_pin_holds_a_place_and_no_moment():
    level = Clamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
    pieces = [Member(Strip(length=1.0, gamma=0.5, **SECTION), clamp, segments=6) for clamp in (level, None)]
    found = strips.solve(pieces, [Joint(End(0, -1), End(1, 0), "pin")], UP, "kirchhoff")
    assert found.joints[0].force == pytest.approx([0.5, 0.0, 0.0], abs=1e-7)
    assert not found.joints[0].moment.any()
    assert found.residual < 1e-7


def test_turned_strips_are_the_same_state_turned():
    """The clamp, its place and the weight turned by a rotation: energies, eigenvalue and shape with them."""
    rng = np.random.default_rng(2)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    frame = turn @ OBLIQUE.frame
    clamp = Clamp(turn @ np.asarray(OBLIQUE.position) + 2.0, frame[:, 2], frame[:, 1])
    joints = [Joint(End(0, -1), End(1, -1), "rigid")]
    here = strips.solve(cut(2, 12, 20.0, 2.0), joints, UP)
    there = strips.solve(cut(2, 12, 20.0, 2.0, clamp), joints, Gravity(turn @ [1.0, 0.0, 0.0]))
    assert here.ok
    assert there.ok
    assert there.energy.elastic == pytest.approx(here.energy.elastic, rel=1e-8)
    assert there.lowest_eigenvalue == pytest.approx(here.lowest_eigenvalue, rel=1e-5)
    assert there.positions(1, S) == pytest.approx(here.positions(1, S) @ turn.T + 2.0 * 2, abs=1e-7)
    assert there.joints[0].moment == pytest.approx(turn @ here.joints[0].moment, abs=1e-6)


def test_a_joint_read_from_the_other_side_is_the_same():
    members, joints = bigon(25.0, 1, (1.0, 1.0))
    swapped = [
        Joint(joint.other, joint.one, joint.kind, (joint.turn[0], *(-c for c in joint.turn[1:]))) for joint in joints
    ]
    one, other = strips.solve(members, joints, energy="kirchhoff"), strips.solve(members, swapped, energy="kirchhoff")
    assert one.energy.total == pytest.approx(other.energy.total, rel=1e-9)
    assert one.joints[0].moment == pytest.approx(-other.joints[0].moment, abs=1e-7)


def test_a_mast_of_two_parts_buckles_as_one_and_its_unstable_mode_is_counted():
    """Upright under its weight beyond 7.84 D w / l^2: straight it has one unstable mode, as the uncut one."""
    upright = Clamp((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    for gamma, modes in ((7.5, 0), (10.0, 1)):
        members = [replace(member, curvature=(0.0,)) for member in cut(2, 12, gamma, 0.0, upright)]
        found = strips.solve(members, chain(2), UP, "kirchhoff", leave_saddle=False)
        assert found.residual < 1e-8
        assert found.unstable_modes == modes
        assert found.status is (Status.SADDLE if modes else Status.CONVERGED)
    left = strips.solve(members, chain(2), UP, "kirchhoff")
    one = solve(
        Strip(length=1.0, gamma=10.0, **SECTION), upright, UP, energy="kirchhoff", segments=12, formulation="mixed",
        leave_saddle=True, seed_curvature=0.5,
    )  # fmt: skip
    assert left.ok
    assert left.left > 0.0
    assert left.energy.total * 2 == pytest.approx(one.energy.total, rel=1e-7)


def test_segments_half_as_long_tell_the_error():
    members, joints = bigon(25.0, 1, (1.0, 1.0))
    found = finer.with_error(strips.solve(members, joints, energy="kirchhoff"))
    finest = finer.refined(finer.refined(found))
    assert strips.distance(found, finest) == pytest.approx(found.error, rel=0.1)
    assert found.error < 1e-4


def test_a_bigon_of_rods_is_that_of_a_shooting_in_space():
    """Both strips from the joint at s = 0, under opposite forces and moments there: at s = l they meet at the angle."""
    degrees = 40.0
    members, joints = bigon(degrees, 1, (1.0, 1.0))
    members = [replace(member, segments=32) for member in members]
    found = strips.solve(members, joints, energy="kirchhoff")
    known = bigon_of_rods(degrees, *stiffnesses(0.05, 0.01, 0.4), found.joints[0].moment)
    assert found.ok
    assert np.abs(known.force).max() < 1e-7
    assert 0.5 * found.energy.total == pytest.approx(known.energy, rel=1e-6)
    assert found.positions(0, np.array([1.0]))[0] == pytest.approx(known.end, abs=1e-6)
    assert found.joints[0].moment == pytest.approx(known.moment, abs=1e-4)
