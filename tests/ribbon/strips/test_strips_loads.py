"""Forces at ends of several strips: the uncut strip under the same one, the elastica, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipe, ellipk

from ribbon import Clamp, RibbonInputError, Strip, solve
from ribbon.find.strips import path
from ribbon.find.strips import solve as strips
from ribbon.find.strips.assemble import Member, assembled
from ribbon.problems.strips.joint import End, Joint
from tests.ribbon.strips.strips_scenes import OBLIQUE, SECTION, UP, chain, cut

S = np.linspace(0.0, 1.0, 41)
FORCE = np.array([3.0, -2.0, 1.5])
LEVEL = Clamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))


def loaded(parts, segments, force):
    """A heavy curved strip cut into equal parts; force: at its end, D w / l^2 of the whole."""
    members = cut(parts, segments, 30.0, 0.5)
    members[-1] = replace(members[-1], tip=tuple(force / parts**2))
    return members


@pytest.mark.parametrize("energy", ["kirchhoff", "wunderlich"])
def test_a_strip_cut_and_joined_under_a_force_is_the_uncut_one(energy):
    """Solved at once, and as the end of a path along which the force comes up from nothing."""
    strip = Strip(length=1.0, natural_curvature=0.5, gamma=30.0, **SECTION)
    one = solve(strip, OBLIQUE, UP, energy=energy, segments=12, formulation="mixed", tip=tuple(FORCE))
    at_once = strips.solve(loaded(3, 12, FORCE), chain(3), UP, energy)
    start = strips.solve(loaded(3, 12, 0.0 * FORCE), chain(3), UP, energy)
    followed, t, _ = path.follow(lambda t: assembled(loaded(3, 12, t * FORCE), chain(3), UP, energy), start)
    assert t == 1.0
    assert strips.distance(start, at_once) > 0.05
    there = np.vstack([one.position((k + S) / 3) for k in range(3)])
    for found in (at_once, followed):
        assert found.ok
        assert np.abs(np.vstack([found.positions(k, S) / 3 for k in range(3)]) - there).max() < 1e-8
        assert 3 * found.energy.total == pytest.approx(one.energy.total, rel=1e-8)
        assert 3 * found.energy.tip == pytest.approx(-FORCE @ one.end.position, rel=1e-8)
        assert 9 * found.strips[0].start.force == pytest.approx(one.start.force, abs=1e-7)


@pytest.mark.parametrize("energy", ["kirchhoff", "wunderlich"])
def test_a_force_at_a_joint_buckles_what_is_before_it(energy):
    """A column of two strips pressed along itself at its top, where a third one goes on, without load and straight:
    ``P l^2 / (D w) = K(k)^2``, its top at ``2 E / K - 1`` and ``2 k / K`` of l (Love, Elasticity, 263), k = sin 30."""
    k = 0.5
    whole, pressed = ellipk(k * k), ellipe(k * k)
    strip = Strip(length=0.5, width=0.02, poisson=0.0, thickness=1e-3)
    members = [Member(strip, LEVEL, segments=12, curvature=(0.5,)), Member(strip, segments=12, curvature=(0.5,)),
               Member(strip, segments=4)]  # fmt: skip
    members[1] = replace(members[1], tip=(0.0, 0.0, -float(whole**2) / 4.0))
    joints = [Joint(End(0, -1), End(1, 0), "seamless"), Joint(End(1, -1), End(2, 0), "rigid")]
    found = strips.solve(members, joints, energy=energy)
    assert found.ok
    top = found.positions(1, np.array([1.0]))[0] * 0.5
    assert top[2] == pytest.approx(2.0 * pressed / whole - 1.0, abs=1e-5)
    assert abs(top[1]) == pytest.approx(2.0 * k / whole, abs=1e-5)
    assert found.strips[2].energy.elastic == pytest.approx(0.0, abs=1e-9)
    frame = found.strips[2].pose(0.5).frame
    assert frame[2, 2] == pytest.approx(np.cos(np.pi / 3), abs=1e-4)  # the top has turned by 60 degrees
    assert np.linalg.norm(found.joints[1].force) < 1e-8
    assert 4.0 * found.strips[0].start.force == pytest.approx([0.0, 0.0, whole**2], abs=1e-7)


def test_what_cannot_move_and_what_nothing_holds_is_not_loaded():
    strip = Strip(length=1.0, **SECTION)
    held = Member(strip, LEVEL, replace(LEVEL, position=(0.0, 0.0, 0.9)), tip=(1.0, 0.0, 0.0))
    with pytest.raises(RibbonInputError, match="a clamp holds"):
        strips.solve([held])
    with pytest.raises(RibbonInputError, match="no clamp"):
        strips.solve([Member(strip, tip=(1.0, 0.0, 0.0))])
