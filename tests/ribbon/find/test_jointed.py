"""A round rod on segments that follow its places of contact: joints stand where a force acts."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ribbon.errors import RibbonInputError
from ribbon.find.jointed import rounds
from ribbon.find.jointed.path import followed
from ribbon.find.jointed.rounds import Jointed, begun, settled
from ribbon.find.jointed.touching import Line, Touching, joints
from ribbon.judge import nearness
from ribbon.problems.itself.pairs import Pair
from tests.ribbon.find.test_ply import folded, wound

SEGMENTS, TURNS = 40, 2.45


@pytest.fixture(scope="module")
def two():
    """A folded rod with two places of contact, on equal segments and on those that follow them."""
    state = wound(SEGMENTS, (TURNS,))[TURNS]
    return state, settled(folded(TURNS, SEGMENTS), Jointed(state, begun(state), 1.0 / SEGMENTS))


@pytest.mark.validate
def test_followed_to_and_fro_is_the_same_state(two):
    _, first = two
    there, away = followed(lambda t: folded(t, SEGMENTS), first, TURNS, TURNS + 0.1, 0.05)
    assert there == TURNS + 0.1
    assert away.state.energy.total > first.state.energy.total + 1.0
    _, back = followed(lambda t: folded(t, SEGMENTS), away, TURNS + 0.1, TURNS, 0.05)
    assert back.state.energy.total == pytest.approx(first.state.energy.total, rel=1e-6)
    assert np.sort(back.pushes) == pytest.approx(np.sort(first.pushes), rel=1e-3)


@pytest.mark.validate
def test_what_pulls_is_let_go(two):
    """A place that is held where nothing touches pulls, and is left out."""
    _, first = two
    (s, other), (t, _) = first.touching.places
    wrong = Touching((*first.touching.places, (s - 2.0 * (t - s), other + 2.0 * (t - s))))
    found = settled(folded(TURNS, SEGMENTS), replace(first, touching=wrong, counts=()))
    assert found is not None
    assert len(found.touching.places) == 2
    assert found.state.energy.total == pytest.approx(first.state.energy.total, rel=1e-8)


def test_joints_of_a_line_face_each_other():
    line = Line(0.2, 0.26, (0.81, 0.785, 0.77, 0.74))
    s, counts = joints(Touching(((0.1, 0.9),), (line,)), 0.02, False)
    assert np.abs(s[:, None] - [0.1, 0.9, 0.2, 0.22, 0.24, 0.26, 0.81, 0.785, 0.77, 0.74]).min(axis=0).max() < 1e-14
    assert s[0] == 0.0
    assert s[-1] == pytest.approx(1.0, abs=1e-14)
    assert (np.diff(s) > 0.0).all()
    assert sum(counts) + 2 * line.segments == s.size - 1
    longer = line.to(0.18, 0.28)
    assert longer.facing[0] == pytest.approx(0.81 + 0.02 * 1.25)
    assert longer.segments == line.segments


def pressed(touching, pushes):
    """What touches, with these pushes, in a state that is nothing else."""
    problem = folded(TURNS, SEGMENTS).with_changes(pairs=touching.pairs())
    rows = np.zeros(problem.row_count)
    rows[problem.block_slices()["pairs"]] = -np.array(pushes)
    return Jointed(SimpleNamespace(problem=problem, x=None, rows=rows), touching, 1.0 / SEGMENTS)


def test_a_place_for_another_is_a_change(monkeypatch):
    """One that pulls is let go and one that is too near is new, in one round; the same place a little on is none."""
    here = pressed(Touching(((0.4, 0.6), (0.2, 0.8))), (-1.0, 2.0))
    for new, expected in ((0.3, ((0.2, 0.8), (0.3, 0.7))), (0.4 + 2e-4 / SEGMENTS, None)):
        near = Pair(new, 0.0, 1.0 - new, 0.0, True)
        monkeypatch.setattr(nearness, "minima", lambda *_, near=near: [(-1e-3, near)])
        changed = rounds._changed(here)
        assert (changed and changed.places) == expected
    monkeypatch.setattr(nearness, "minima", lambda *_: [])
    assert rounds._changed(pressed(here.touching, (1.0, 2.0))) is None  # in whatever order


def test_an_end_beside_which_no_gap_is_found_stays(monkeypatch):
    """The other goes on, and no secant passes through the one."""
    line = Line(0.3, 0.36, (0.7, 0.68, 0.66, 0.64))
    here = pressed(Touching((), (line,)), np.ones(4))

    def narrowed(problem, x, pairs):
        return (np.array([p.s - line.end for p in pairs]) ** 3, pairs) if pairs[0].s > line.end else (np.empty(0), [])

    monkeypatch.setattr(nearness, "narrowed", narrowed)
    before = {(0, 1): (0.35, -1.0, np.nan)}
    moved = rounds._moved(here, before)
    assert moved.lines[0].begin == line.begin
    assert list(before) == [(0, 1)]
    assert before[(0, 1)] == pytest.approx((0.36, 0.0, 100.0), abs=1e-6)


def test_a_path_needs_steps_forward():
    for sizes in ((0.0, 1e-3), (-0.1, 1e-3), (0.1, 0.0)):
        with pytest.raises(RibbonInputError):
            followed(lambda t: folded(t, SEGMENTS), pressed(Touching(((0.4, 0.6),)), (1.0,)), 0.0, 1.0, *sizes)
