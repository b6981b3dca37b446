"""A session: states after moves are those of a fresh solve, its stiffness is that of moved clamps, ends are said."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ribbon import Clamp, Gravity, RibbonInputError, Session, Status, Strip, solve
from ribbon.find.solving import search
from ribbon.find.solving.assemble import assembled
from ribbon.find.solving.request import Request

ARCH = (-3, 3, 3, -3)


def arch(**keywords):
    strip = Strip(0.5, 0.03, 0.4, gamma=3.0)
    return Session(
        strip, Clamp(ruling="straight"), Gravity((0, 1, 0)), end=Clamp((0.02, 0.05, 0.4), ruling="straight"),
        segments=8, seed_curvature=tuple(2 * k for k in ARCH), **keywords,
    )  # fmt: skip


@pytest.fixture(scope="module")
def session():
    return arch()


def turned(clamp, spin, shift):
    frame = Rotation.from_rotvec(spin).as_matrix() @ clamp.frame
    position = np.asarray(clamp.position) + shift
    return Clamp(position, tangent=frame[:, 2], normal=frame[:, 1], ruling=clamp.ruling)


def test_stiffness_is_that_of_moved_clamps(session):
    """Six central differences of sessions that moved, in the strip's unit; its skew part is half the moment."""
    stiffness = session.stiffness
    end = session.state.problem.end
    h = 1e-4

    def wrench(component, step):
        unit = np.zeros(6)
        unit[component] = step
        moved = session.move(end=turned(end, unit[3:], unit[:3]), steps=1)
        assert moved.ok
        found = np.concatenate([session.forces["end"].force, session.forces["end"].moment])
        session.back(len(moved.states))
        return found

    for c in range(6):
        fourth = (8 * (wrench(c, h) - wrench(c, -h)) - wrench(c, 2 * h) + wrench(c, -2 * h)) / (12 * h)
        np.testing.assert_allclose(stiffness[:, c], fourth, rtol=1e-5, atol=1e-6 * np.abs(stiffness).max())
    stiffness = stiffness * np.repeat([session.state.problem.strip.length, 1.0], 3)  # by displacements in l
    scale = np.abs(stiffness).max()
    skew = 0.5 * (stiffness - stiffness.T)
    m = -0.5 * session.forces["end"].moment
    cross = np.array([[0, -m[2], m[1]], [m[2], 0, -m[0]], [-m[1], m[0], 0]])
    np.testing.assert_allclose(skew[:3], 0.0, atol=1e-10 * scale)
    np.testing.assert_allclose(skew[3:, 3:], cross, atol=1e-10 * scale)


def test_a_move_ends_where_a_fresh_solve_does_and_keeps_its_states():
    session = arch()
    seen = []
    goal = Clamp((0.0, 0.05, 0.35), tangent=(0, 0.6, 0.8), normal=(0, 0.8, -0.6), ruling="straight")
    moved = session.move(
        end=goal, gamma=6.0, natural_curvature=1.0, on_step=lambda record, state: seen.append(record.t)
    )
    assert moved.ok
    assert moved.reached == 1.0
    assert seen[-1] == 1.0
    assert len(seen) == len(moved.states) == len(session.history) - 1
    strip = Strip(0.5, 0.03, 0.4, 1.0, gamma=6.0)
    omega = session.state.omega(np.linspace(0, 1, 9)) / 0.5
    fresh = solve(
        strip, Clamp(ruling="straight"), Gravity((0, 1, 0)), end=goal, segments=8, seed_curvature=tuple(omega),
        formulation="mixed",
    )  # fmt: skip
    np.testing.assert_allclose(session.state.position([0.3, 0.7]), fresh.position([0.3, 0.7]), atol=1e-8)
    np.testing.assert_allclose(session.state.end.position, np.asarray(goal.position) / 0.5, atol=1e-9)
    # the supports carry the weight
    total = session.forces["start"].force + session.forces["end"].force
    np.testing.assert_allclose(total, [0, 6.0, 0], atol=1e-7)
    before = session.history[0]
    assert session.back(len(moved.states)) is before


def test_a_move_out_of_reach_is_refused_and_a_failed_step_keeps_the_last_state(monkeypatch):
    session = arch()
    before = session.state
    with pytest.raises(RibbonInputError):
        session.move(end=Clamp((0.0, 0.0, 0.6), ruling="straight"))
    assert session.state is before
    goal = Clamp((0.02, 0.05, 0.38), ruling="straight")
    real = search.from_state

    def failing(problem, x, *how):
        found = real(problem, x, *how)
        gone = problem.end.position[2] < 0.39 - 1e-9
        return replace(found, status=Status.NOT_CONVERGED, message="no more") if gone else found

    monkeypatch.setattr(search, "from_state", failing)
    moved = session.move(end=goal, steps=4)
    assert moved.status == "stopped"
    assert not moved.ok
    assert moved.reached == 0.5
    assert session.state.ok
    assert session.state.problem.end.position[2] == pytest.approx(0.39)
    assert not all(entry["accepted"] for entry in moved.log)


def test_a_move_keeps_all_that_the_ribbon_was_asked_for():
    """The stiffness of a narrow plate and no bending in its own plane, of which a moved problem said nothing once."""
    session = Session(
        Strip(1.0, 0.05, 0.3, gamma=2.0, thickness=1e-3), Clamp(ruling=None), Gravity((1, 0, 0)), energy="kirchhoff",
        stiffness="plate", in_plane=False, held_by="constraints", segments=8,
    )  # fmt: skip
    assert session.move(gamma=4.0, steps=1).ok
    fresh = solve(
        replace(session.state.problem.strip, gamma=4.0), Clamp(ruling=None), Gravity((1, 0, 0)), energy="kirchhoff",
        stiffness="plate", in_plane=False, segments=8, formulation="mixed",
    )  # fmt: skip
    assert session.state.energy.total == pytest.approx(fresh.energy.total, rel=1e-9)
    problem = session.state.problem
    assert (problem.stiffness, problem.in_plane, problem.held_by) == ("plate", False, "constraints")


def test_an_arch_snaps_through():
    """The ends of a buckled strip turn up until it flips: said, with the state after the snap kept."""
    strip = Strip(1.0, 0.05, 0.3)

    def ends(angle):
        c, s = np.cos(angle), np.sin(angle)
        start = Clamp((0, 0, 0), tangent=(0, s, c), normal=(0, c, -s), ruling="straight")
        end = Clamp((0, 0, 0.92), tangent=(0, -s, c), normal=(0, c, s), ruling="straight")
        return start, end

    start, end = ends(0.3)
    session = Session(strip, start, end=end, segments=10, seed_curvature=(3, -3, -3, 3), seed_ruling=0.0)
    side = np.sign(session.state.position(0.5)[0][1])
    start, end = ends(-side * 1.0)
    moved = session.move(clamp=start, end=end)
    assert np.sign(session.state.position(0.5)[0][1]) == -side
    assert moved.status == "snapped"
    assert not moved.ok
    assert 0.0 < moved.jumps[0] <= 1.0
    assert moved.reached == 1.0
    assert session.state.ok


def test_a_leap_is_one_step_to_what_a_fresh_solve_finds():
    """Also of what `move` does not name (the width), by a way of problems."""
    session = arch()
    request = Request.again(session.state.problem)

    def wider(t):
        return assembled(replace(request, strip=replace(request.strip, width=0.03 + 0.01 * t)))

    seen = []
    moved = session.along(wider, leap=True, on_step=lambda record, state: seen.append((record.t, state)))
    fresh = solve(
        replace(request.strip, width=0.04), request.start, request.gravity, end=request.end, segments=8,
        formulation="mixed", seed_curvature=tuple(2 * k for k in ARCH),
    )  # fmt: skip
    assert moved.ok
    assert (len(moved.log), len(moved.states)) == (1, 1)
    assert session.state.energy.total == pytest.approx(fresh.energy.total, rel=1e-9)
    assert [t for t, _ in seen] == [1.0]
    session.back()
    assert session.state.problem.strip.width == 0.03


def test_a_leap_that_goes_too_far_is_gone_in_steps():
    """The snap of an arch is found, and found once, by small leaps as by a whole move."""
    strip = Strip(1.0, 0.05, 0.3)

    def ends(angle):
        c, s = np.cos(angle), np.sin(angle)
        start = Clamp((0, 0, 0), tangent=(0, s, c), normal=(0, c, -s), ruling="straight")
        return start, Clamp((0, 0, 0.92), tangent=(0, -s, c), normal=(0, c, s), ruling="straight")

    start, end = ends(0.3)
    session = Session(strip, start, end=end, segments=10, seed_curvature=(3, -3, -3, 3), seed_ruling=0.0)
    side = np.sign(session.state.position(0.5)[0][1])
    found = []
    for angle in np.linspace(0.3, -1.0, 14)[1:]:
        start, end = ends(side * angle)
        found.append(session.move(clamp=start, end=end, leap=True))
    assert [moved.status for moved in found].count("snapped") == 1
    assert all(moved.reached == 1.0 for moved in found)
    assert np.sign(session.state.position(0.5)[0][1]) == -side
    calm = [moved for moved in found if moved.status == "arrived"]
    assert min(len(moved.log) for moved in calm) == 1


def test_a_session_begins_at_a_state_that_is_known(session):
    again = Session.at(session.state)
    moved = again.move(gamma=3.1, leap=True)
    assert moved.ok
    assert len(again.history) == 2
    with pytest.raises(RibbonInputError, match="state"):
        Session.at(replace(session.state, status=Status.NOT_CONVERGED))


def test_what_a_session_shows_is_where_it_has_been(tmp_path):
    """The states of its history, upwards up, to the digits that a page keeps; one text with no address in it."""
    session = arch()
    session.move(gamma=4.0, steps=2)
    seen = session.show()
    assert len(seen.labels) == len(session.history) == seen.points.shape[0]
    grid = session.state.surface(*seen.points.shape[1:3] - np.array([1, 1])).grid
    assert seen.points[-1, ..., 2] == pytest.approx(grid[..., 1])  # up is (0, 1, 0)
    edges = [np.linalg.norm(np.diff(points, axis=0), axis=-1) for points in (seen.points[-1], grid)]
    assert edges[0] == pytest.approx(edges[1], abs=1e-12)
    text = seen.save(tmp_path / "seen.html").read_text()
    data = json.loads(re.search(r"const data = (.*?), \[count", text)[1])
    assert tuple(data["grid"]) == seen.points.shape[:3]
    places = np.frombuffer(base64.b64decode(data["places"]), "<u2").reshape(seen.points.shape)
    low, span = seen.points.min(axis=(0, 1, 2)), np.ptp(seen.points, axis=(0, 1, 2)).max()
    assert np.abs(low + span * places / 65535 - seen.points).max() <= span / 65535
    assert "http" not in text
    assert 'sandbox="allow-scripts"' in seen._repr_html_()
    assert seen._repr_html_().count("<") == 2  # the frame: what is in it is escaped


def test_misuse():
    free = Session(Strip(1.0, 0.05, gamma=1.0), Clamp(), Gravity((0, 1, 0)), segments=4)
    with pytest.raises(RibbonInputError):
        _ = free.stiffness
    with pytest.raises(RibbonInputError):
        free.move(gamma=2.0, steps=0)
    with pytest.raises(RibbonInputError):
        free.back()
    with pytest.raises(RibbonInputError, match="half"):
        free.move(clamp=Clamp(tangent=(0, 0, -1), normal=(0, 1, 0)))
    assert free.move(gamma=2.0).ok
    assert free.state.problem.strip.gamma == 2.0
