"""A session in the hand: its sliders, where they take it, and the widget that has them."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from ribbon import Clamp, Gravity, RibbonInputError, Session, Strip, solve
from ribbon.shown import FILM_CELLS, hand, upright

STRIP = Strip(0.5, 0.02, 0.3, gamma=4.0, natural_curvature=2.0)
UP = Gravity((0.0, 1.0, 0.0))


def arch() -> Session:
    return Session(STRIP, Clamp(), UP, end=Clamp((0.0, 0.0, 0.42)), segments=12, seed_curvature=(-8.0, 8.0, 8.0, -8.0))


def test_there_is_a_slider_for_what_can_be_moved():
    found = {one.name: one for one in hand.sliders(arch())}
    assert list(found) == ["gamma", "natural curvature", "end x", "end y", "end z"]
    assert [found[name].value for name in found] == [4.0, 2.0, 0.0, 0.0, 0.42]
    assert (found["end z"].low, found["end z"].high) == pytest.approx((0.27, 0.57))  # lengths in the strip's unit
    assert all(one.low <= one.value <= one.high for one in found.values())
    pulled = Session(STRIP, Clamp(), UP, tip=(0.0, -2.0, 0.0), segments=12)
    assert [one.name for one in hand.sliders(pulled)][2:] == ["force x", "force y", "force z"]
    weightless = Session(Strip(1.0, 0.02, 0.3, natural_curvature=(0.0, 2.0)), Clamp(), segments=12)
    assert hand.sliders(weightless) == []


def test_a_move_ends_where_a_solve_does():
    session = arch()
    assert hand.move(session, {"gamma": 6.0, "end y": 0.05, "end z": 0.4, "unknown": 1.0}) == ""
    direct = solve(
        Strip(0.5, 0.02, 0.3, gamma=6.0, natural_curvature=2.0), Clamp(), UP, end=Clamp((0.0, 0.05, 0.4)), segments=12,
        seed_curvature=(-8.0, 8.0, 8.0, -8.0), formulation="mixed",
    )  # fmt: skip
    assert session.state.energy.total == pytest.approx(direct.energy.total, rel=1e-9)
    before = len(session.history)
    assert hand.move(session, {one.name: one.value for one in hand.sliders(session)}) == ""
    assert len(session.history) == before  # nothing is asked, nothing is solved
    with pytest.raises(RibbonInputError, match="at most 1 can be reached"):
        hand.move(session, {"end z": 0.9})
    assert session.state.ok
    with pytest.raises(RibbonInputError, match="no numbers"):
        hand.move(session, {"gamma": float("nan")})


def test_what_is_drawn_is_its_surface_upright_about_its_middle():
    session = arch()
    grid, drawn = hand.places(session)
    assert grid == [FILM_CELLS[0] + 1, FILM_CELLS[1] + 1]
    points = np.frombuffer(drawn, "<f4").reshape(-1, 3)
    surface = session.state.surface(*FILM_CELLS).points
    assert np.ptp(points[:, 2]) == pytest.approx(np.ptp(surface[:, 1]), abs=1e-6)  # e_y is up
    assert points.min(axis=0) + points.max(axis=0) == pytest.approx(np.zeros(3), abs=1e-6)
    turn = upright(session.state)
    assert turn.T @ turn == pytest.approx(np.eye(3), abs=1e-15)


def test_without_the_library_it_is_said_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "anywidget", None)
    with pytest.raises(ImportError, match=r"ribbonbench\[notebook\]"):
        arch().show(live=True)


def test_the_widget_goes_with_its_sliders():
    pytest.importorskip("anywidget")
    session = arch()
    widget = session.show(live=True)
    first = widget.places
    widget.values = {**widget.values, "gamma": 7.0}
    assert session.state.problem.strip.gamma == 7.0
    assert widget.reached["gamma"] == 7.0
    assert widget.places != first
    widget.values = {**widget.values, "end z": 0.9}
    assert "at most 1 can be reached" in widget.text
    assert widget.reached["end z"] < 0.57
    widget.values = {**widget.values, "gamma": float("inf")}
    assert "are no numbers" in widget.text
