"""A strip that begins in a drawn curve: its frame, and the state downhill of it on segments that follow."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon import Clamp, RibbonInputError, refine
from ribbon.find.jointed import drawn, polygon
from ribbon.find.jointed.wound import link
from ribbon.find.seeds import end_mismatch
from ribbon.find.solve import build
from ribbon.find.solving.request import Request
from ribbon.judge import nearness
from tests.ribbon.find.test_ply import STRIP
from tests.validation.ribbon import knots


def problem(turn, segments=160, **more):
    """A rod between clamps 0.4067 apart along an oblique axis, its end turned."""
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    normal = np.array([1.0, 2.0, 0.0]) / np.sqrt(5.0)
    across = np.cross(normal, axis)
    end = np.cos(turn) * normal - np.sin(turn) * across
    first = np.array([0.3, 0.1, -0.2])
    clamps = Clamp(first, axis, normal), Clamp(first + 0.4067 * axis, axis, end)
    found = build(STRIP, clamps[0], end=clamps[1], energy="kirchhoff", segments=segments, formulation="mixed", **more)
    return found, np.column_stack([across, normal, axis]), first


def test_the_frame_of_a_curve_meets_both_clamps():
    """Position and frame of the far end, as the rod's own elements carry them; and its twist is the same all along."""
    turn = -0.6
    rod, frame, first = problem(turn, apart=0.02, round_rod=True)
    curve = polygon.overhand(0.4067)
    x = drawn.unknowns(rod, first + (curve - curve[0]) @ frame.T)
    assert np.abs(end_mismatch(rod, x)).max() < 0.02
    twist = rod.joint_values(x)[1]
    assert np.ptp(twist) == 0.0
    assert abs(twist[0]) < np.pi
    assert min((gap for gap, _ in nearness.minima(rod, x, 0.0)), default=0.0) > -0.1 * rod.apart
    other = drawn.unknowns(problem(turn + 0.2, apart=0.02, round_rod=True)[0], first + (curve - curve[0]) @ frame.T)
    assert rod.joint_values(other)[1][0] - twist[0] == pytest.approx(0.2, abs=1e-6)


def test_a_knot_begins_where_its_turn_is_held():
    """The row that holds the turn about the clamps' axis is met, whichever way the knot was drawn; turned, it is linked
    as before, by a whole number as its clamps are alike."""
    axis = Clamp(position=(0.0, 0.0, 0.0)), Clamp(position=(0.0, 0.0, 0.4067))
    rod = build(
        STRIP, axis[0], end=axis[1], energy="kirchhoff", segments=100, formulation="mixed", apart=0.02, round_rod=True
    )
    assert rod.spins
    curve, links = polygon.overhand(0.4067), []
    for turn in (0.0, 2.0):
        about = np.array([[np.cos(turn), -np.sin(turn), 0.0], [np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]])
        x = drawn.unknowns(rod, curve @ about.T)
        assert abs(rod.constraints(x)[rod.block_slices()["gauge_ring"]][0]) < 5e-3
        links.append(link(rod, x))
    assert links == pytest.approx([-3.0, -3.0], abs=0.02)


def test_a_developable_strip_does_not_begin_in_space():
    rod, frame, first = problem(0.0)
    flat = build(STRIP, rod.start, end=rod.end, energy="wunderlich", segments=20, formulation="mixed")
    with pytest.raises(RibbonInputError):
        drawn.unknowns(flat, first + polygon.overhand(0.4067) @ frame.T)


def test_a_bowed_curve_without_contact_comes_to_rest_as_far_out_as_its_image():
    """Drawn as an arch to either side, in the plane of the clamps: mirror images, of one energy."""
    rod, frame, first = problem(0.0, 20)
    z = np.linspace(0.0, 1.0, 12)
    request, found = Request.again(rod), []
    for side in (1.0, -1.0):
        arch = np.stack([side * 0.37 * np.sin(np.pi * z) ** 2, 0.0 * z, 0.4067 * z], axis=1)
        found.append(drawn.solved(request, first + arch @ frame.T))
    tops = np.array([(state.position([0.5])[0] - first) @ frame[:, :2] for state in found])
    assert all(state.status.code in ("converged", "saddle") for state in found)
    out = np.linalg.norm(tops, axis=1)  # the plane of the arch may turn about the clamps' axis
    assert out[0] == pytest.approx(out[1], rel=1e-6)
    assert out[0] > 0.3
    assert found[0].energy.total == pytest.approx(found[1].energy.total, rel=1e-9)


def test_a_state_on_segments_that_follow_is_refined_on_such():
    """The knot that is kept: what its line says sums to what its stations push with, and refining halves segments and
    keeps places at joints."""
    here = knots.kept()
    state = drawn._joined(here.jointed.state, here.jointed)
    (line,) = state.jointed.lines()
    assert line["force"] == pytest.approx(sum(line["share"]), rel=1e-12)
    assert line["force"] == pytest.approx(knots.measured(here.jointed).line, rel=1e-12)
    assert line["s"][0] < line["s"][1] < line["s_other"][0] < line["s_other"][1]
    finer = refine(state)
    assert finer.ok
    assert finer.jointed is not None
    assert finer.problem.lengths.size == 2 * state.problem.lengths.size
    joints = np.cumsum(finer.problem.lengths)
    for s, other in finer.jointed.touching.places:
        assert max(np.abs(joints - s).min(), np.abs(joints - other).min()) < 1e-4
    assert finer.energy.total == pytest.approx(state.energy.total, rel=1e-6)
