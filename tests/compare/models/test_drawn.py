"""A way downhill of a drawn curve: kept, told, to a tolerance; what it is wound by; what a round rod touches."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from compare.measure.error import error_of_first
from compare.models.base import Seconds
from compare.models.drawn import touches
from compare.models.drawn.begun import LANDING_FILE, Landing
from compare.models.ribbon.solving import solver
from compare.models.ribbon.stages import run_key, run_way
from compare.models.ribbon.state import own_size, state_of
from compare.scene.scene import loads
from ribbon.find.jointed import drawn
from ribbon.find.jointed.wound import link, writhe
from tests.validation.ribbon import knots

LONG, END = 1.0, 0.65


def bow(turn=0.0, contact=True, **keys):
    """A round rod bowed in a plane, its far clamp turned (rad) about its tangent."""
    z = np.linspace(0.0, 1.0, 25)
    points = np.stack([0.0 * z, -0.331 * np.sin(np.pi * z) ** 2, END * z], axis=1)
    text = f"""
[strip]
length = {LONG}
width = 0.01
thickness = 0.0095
poisson = 0.3
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[clamp.end]
position = [0.0, 0.0, {END}]
tangent = [0.0, 0.0, 1.0]
normal = [{-math.sin(turn)}, {math.cos(turn)}, 0.0]
[model]
energy = "kirchhoff"
elements = 16
{"[contact]" if contact else ""}
{"itself = true" if contact else ""}
{"distance = 0.02" if contact else ""}
{'section = "round"' if contact else ""}
[seed]
curve = {points.tolist()}
"""
    return loads(text, "bow").replace(keys)


def test_an_interrupted_way_downhill_goes_on(tmp_path):
    """Interrupted as soon as a look is kept; the next run begins there, and ends where an uninterrupted one does."""
    scene, said = bow(0.4), []

    def stop(text):
        said.append(text)
        if ": look 1, energy" in text:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_way(scene, tmp_path, progress=stop)
    key = run_key(scene, False)
    kept = Landing(tmp_path, key, None).begin()
    assert kept is not None
    assert Landing(tmp_path, "of another scene", None).begin() is None
    again: list[str] = []
    found = run_way(scene, tmp_path, progress=again.append).equilibrium
    assert any("goes on from look 1" in text for text in again)
    assert not (tmp_path / LANDING_FILE).exists()
    whole = solver(bow(0.4, contact=False))()  # it touches nowhere
    assert found.ok
    assert whole.ok
    assert found.energy.total == pytest.approx(whole.energy.total, rel=1e-9)
    (tmp_path / LANDING_FILE).write_bytes(b"no archive")
    assert Landing(tmp_path, key, None).begin() is None


def test_segments_by_a_tolerance_are_placed_there():
    scene = bow(contact=False, **{"model.elements": None, "model.tolerance": 1e-3})
    found = solver(scene)()
    assert found.ok
    assert found.tolerance_error is not None
    assert found.tolerance_error < 1e-3
    equal = solver(bow(contact=False, **{"model.elements": 80}))()
    assert found.energy.total == pytest.approx(equal.energy.total, rel=1e-4)


def test_twist_and_writhe_closed_far_away_are_the_clamps_turn():
    """Of an arch in a plane, its far clamp turned to either side by as much."""
    told = []
    for turn in (0.5, -0.5):
        turned = bow(turn, contact=False, **{"model.elements": 48})
        found = solver(turned)()
        assert link(found.problem, found.x) == pytest.approx(turn / (2.0 * np.pi), abs=1e-3)
        told.append(touches.wound(turned, state_of(turned, found, own_size(found), Seconds(0.0))))
    assert told[0]["twist"] > 0.01
    assert told[0]["writhe"] > 0.01
    assert told[1]["twist"] == pytest.approx(-told[0]["twist"], rel=1e-6)
    assert told[1]["writhe"] == pytest.approx(-told[0]["writhe"], rel=1e-6)
    assert told[0]["link"] == pytest.approx(0.5 / (2.0 * np.pi), abs=1e-3)
    assert told[1]["link"] == pytest.approx(-told[0]["link"], rel=1e-6)
    assert told[0]["twist_error"] is None
    assert told[0]["twist_error_why"]


def test_writhe_is_that_of_gauss():
    """His double integral over a closed curve on a torus, by the trapezium rule; none of a plane curve."""
    t = np.linspace(0.0, 2.0 * np.pi, 801)
    bulge = 2.0 + np.cos(3.0 * t)
    r = np.stack([bulge * np.cos(2.0 * t), bulge * np.sin(2.0 * t), np.sin(3.0 * t)], axis=1)
    out = -3.0 * np.sin(3.0 * t)
    across = np.stack([-np.sin(2.0 * t), np.cos(2.0 * t), 0.0 * t], axis=1)
    along = np.stack([np.cos(2.0 * t), np.sin(2.0 * t), 0.0 * t], axis=1)
    slope = out[:, None] * along + 2.0 * bulge[:, None] * across
    slope[:, 2] = 3.0 * np.cos(3.0 * t)
    apart = r[:-1, None] - r[None, :-1]
    cube = np.linalg.norm(apart, axis=2) ** 3
    np.fill_diagonal(cube, np.inf)
    crossed = np.cross(slope[:-1, None], slope[None, :-1])
    gauss = float(((crossed * apart).sum(axis=2) / cube).sum() * t[1] ** 2 / (4.0 * np.pi))
    assert writhe(r) == pytest.approx(gauss, rel=5e-3)
    assert writhe(r * [1.0, 1.0, -1.0]) == pytest.approx(-writhe(r), rel=1e-12)
    assert abs(writhe(r * [1.0, 1.0, 0.0])) < 1e-9


def test_places_and_lines_have_errors():
    """Of the kept knot on its segments and on halved ones: within them is the page's finest (results/knots.md)."""
    here = knots.kept()
    coarse = drawn._joined(here.jointed.state, here.jointed)
    fine = drawn.halved(coarse)
    found = touches.errors([coarse, fine], error_of_first)
    rows = touches.numbers(coarse)
    assert len(rows["places"]) == 2
    assert len(rows["lines"]) == 1
    for (_, _, force), (where, error) in zip(rows["places"], found["places"], strict=True):
        assert abs(force - 178.7207813) < error < 1.0
        assert where < 1e-3
    (line,), ((ends, error),) = rows["lines"], found["lines"]
    assert abs(line[4] - 223.1222704) < error < 1.0
    assert 0.5 * (line[1] - line[0]) - 0.0168480 < ends < 5e-3
    assert touches.errors([coarse], error_of_first)["lines"] == [(None, None)]
    bare = touches.errors([coarse, replace(fine, jointed=None)], error_of_first)
    assert bare["places"] == [(None, None), (None, None)]


def test_a_rod_that_touches_nowhere_has_nothing_to_follow():
    found = solver(bow(**{"contact.joints": "follow"}))()
    assert found.ok
    assert found.jointed.touching.pairs() == ()


def test_a_state_that_is_wound_otherwise_is_not_the_drawn_one():
    """The arch, and the same with a whole turn of twist, which its clamps see as none."""
    scene = bow()
    found = solver(scene)()
    first = found.problem.state(*_wound_once(found))
    assert drawn._as_drawn(found.problem, found.x, found) is found
    assert drawn._as_drawn(found.problem, first, found).status.code == "not_converged"


def _wound_once(found):
    """The arch's own curvatures and a whole turn of twist."""
    tau = np.full(found.problem.lengths.size + 1, 2.0 * np.pi)
    return found.problem.joint_values(found.x)[0], tau, found.problem.in_plane_values(found.x)
