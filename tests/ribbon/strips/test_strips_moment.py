"""Moments of fixed axis at ends of several strips: the rod in space, the circle, the uncut strip, a path, refusals."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ribbon import Clamp, RibbonInputError, Strip
from ribbon.find.strips import path
from ribbon.find.strips import solve as strips
from ribbon.find.strips.assemble import Member, assembled
from ribbon.problems.strips.part import turning
from ribbon.result import Status
from tests.ribbon.strips.strips_scenes import SECTION, UP, chain, cut

S = np.linspace(0.0, 1.0, 21)
LEVEL = Clamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
MOMENT = np.array([3.0, 1.0, 1.5])


def turned(parts, segments, moment, **strip):
    """A strip of length 1 cut into equal parts; moment: at its end, D w / l of the whole."""
    own = Strip(length=1.0 / parts, **{**SECTION, **strip})
    members = [Member(own, LEVEL if k == 0 else None, segments=segments // parts) for k in range(parts)]
    members[-1] = replace(members[-1], moment=tuple(np.asarray(moment) / parts))
    return members


def places(state, parts):
    return np.vstack([state.positions(k, S) / parts for k in range(parts)])


def rod_end(moment):
    """End of Kirchhoff's rod of this section: its moment is one vector all along, so that the frame obeys
    R' = R [k] with k = (M.t_x, M.t_y / B, M.t_z / C) from the clamp on (docs/theory.md, eq. (10.18))."""
    nu, ratio = SECTION["poisson"], SECTION["width"] / SECTION["thickness"]
    n = np.arange(1, 200, 2)
    torsion = 2.0 * (1.0 - nu) * (1.0 - 192.0 / np.pi**5 / ratio * np.sum(np.tanh(0.5 * n * np.pi * ratio) / n**5))
    plane = (1.0 - nu**2) * ratio**2

    def slopes(_, y):
        frame = y[3:].reshape(3, 3)
        one, two, three = (moment @ frame) / [1.0, plane, torsion]
        spin = np.array([[0.0, -three, two], [three, 0.0, -one], [-two, one, 0.0]])
        return np.concatenate([frame[:, 2], (frame @ spin).ravel()])

    begin = np.concatenate([np.zeros(3), np.eye(3).ravel()])
    return solve_ivp(slopes, (0.0, 1.0), begin, method="DOP853", rtol=1e-12, atol=1e-13).y[:3, -1]


def test_a_moment_in_space_is_that_of_a_rod_with_an_order():
    """Its axis stays where it is: the section's moment is the same vector everywhere, no potential is."""
    exact = rod_end(MOMENT)
    left = []
    for segments in (8, 16, 32):
        found = strips.solve(turned(1, segments, MOMENT), energy="kirchhoff")
        assert found.status is Status.CONVERGED
        assert found.stable is None
        assert found.strips[0].start.moment == pytest.approx(-MOMENT, abs=1e-8)
        left.append(np.linalg.norm(found.positions(0, S[-1:])[0] - exact))
    orders = np.log2(np.array(left[:-1]) / left[1:])
    assert left[-1] < 1e-6
    assert orders == pytest.approx([4.0, 4.0], abs=0.4)


@pytest.mark.parametrize("energy", ["kirchhoff", "wunderlich"])
@pytest.mark.parametrize("moment", [(2.0 * np.pi, 0.0, 0.0), (3.0, 1.0, 1.5)])
def test_a_strip_cut_and_joined_under_a_moment_is_the_uncut_one(energy, moment):
    """In the plane it closes to a circle, of curvature M everywhere."""
    one, cut_ = (strips.solve(turned(parts, 12, moment), chain(parts), energy=energy) for parts in (1, 3))
    assert one.status is cut_.status is Status.CONVERGED
    uncut = np.vstack([one.positions(0, (k + S) / 3) for k in range(3)])
    assert np.abs(places(cut_, 3) - uncut).max() < 1e-8
    if moment[1] == 0.0:
        assert np.abs(one.positions(0, S[-1:])).max() < 1e-9
        assert one.strips[0].omega(S) == pytest.approx(np.full(S.size, 2.0 * np.pi), abs=1e-8)


def test_a_moment_comes_up_along_a_path_beside_weight_and_a_force():
    """Grown from nothing at once, or along a path, with what else loads the strip there first."""

    def members(t):
        own = cut(2, 12, 20.0, 0.5)
        own[-1] = replace(own[-1], tip=(0.3, 0.2, -0.1), moment=tuple(t * np.array([1.0, -0.4, 0.3])) if t else None)
        return own

    at_once = strips.solve(members(1.0), chain(2), UP, "kirchhoff")
    start = strips.solve(members(0.0), chain(2), UP, "kirchhoff")
    found, t, _ = path.follow(lambda t: assembled(members(t), chain(2), UP, "kirchhoff"), start)
    assert t == 1.0
    assert strips.distance(start, at_once) > 0.05
    assert strips.distance(found, at_once) < 1e-8


def test_a_moment_in_the_middle_of_a_strip_acts_at_the_joint():
    """Behind the joint that it turns nothing bends: a circle's arc, and its tangent."""
    members = [Member(Strip(length=1.0, **SECTION), LEVEL, segments=8, moment=(1.2, 0.0, 0.0)),
               Member(Strip(length=1.0, **SECTION), segments=4)]  # fmt: skip
    found = strips.solve(members, chain(2, "rigid"), energy="kirchhoff")
    end = found.positions(1, S[-1:])[0]
    tangent = np.array([0.0, -np.sin(1.2), np.cos(1.2)])
    assert end == pytest.approx(np.array([0.0, np.cos(1.2) - 1.0, np.sin(1.2)]) / 1.2 + tangent, abs=1e-8)
    assert found.joints[0].moment == pytest.approx(np.zeros(3), abs=1e-9)


def test_the_force_on_the_quaternion_does_the_moments_work():
    """f . dq = M . phi for dq = phi o q / 2, and none by a change of its length."""
    rng = np.random.default_rng(3)
    q, phi = rng.normal(size=4), rng.normal(size=3)
    q /= np.linalg.norm(q)
    w, v = q[0], q[1:]
    turn = 0.5 * np.concatenate([[-phi @ v], w * phi + np.cross(phi, v)])
    force = turning(tuple(MOMENT)) @ q
    assert force @ turn == pytest.approx(MOMENT @ phi, abs=1e-13)
    assert force @ q == pytest.approx(0.0, abs=1e-14)


def test_what_cannot_turn_and_what_nothing_holds_gets_no_moment():
    strip = Strip(length=1.0, **SECTION)
    held = Member(strip, LEVEL, Clamp(None, (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)), moment=(1.0, 0.0, 0.0))
    with pytest.raises(RibbonInputError, match="frame that a clamp holds"):
        strips.solve([held])
    with pytest.raises(RibbonInputError, match="no clamp"):
        strips.solve([Member(strip, moment=(1.0, 0.0, 0.0))])
    with pytest.raises(RibbonInputError, match="three finite numbers"):
        strips.solve([Member(strip, LEVEL, moment=(1.0, np.inf, 0.0))])
