"""Contacts in pictures: dots and arrows are the places and forces of the result, and nothing ends beyond the edge."""

from __future__ import annotations

import io
import json
import re

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PathCollection
from matplotlib.quiver import Quiver
from rich.console import Console

from compare.cli import DONE, main
from compare.models import solve
from compare.models.strips.solve import solved
from compare.page.drawing import screen_axes
from compare.page.page import PUSH, STRIP
from compare.page.terminal import print_pairs
from compare.pages.pictures import ribbon as picture
from compare.pages.pictures.touches import LONGEST
from compare.pages.report.folders import read_part
from compare.pages.report.surfaces import view
from compare.pages.result import state_result
from compare.pages.strips import picture as strips_picture
from compare.pages.strips.page import result, rows, write
from compare.scene.inputs.source import shipped_strips
from compare.scene.scene import loads
from compare.scene.strips.read import loads as loads_strips
from compare.store.store import jsonable

CURLED = """
[strip]
length = 0.24
width = 0.012
thickness = 1e-4
poisson = 0.38
young = 3.2e9
density = 1380.0
natural_curvature = 12.0
[gravity]
up = [0.0, 0.0, 1.0]
[model]
elements = 20
energy = "wunderlich"
[clamp.start]
position = [0.0, 0.0, -0.0499]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
"""
TUBE = f"""{CURLED}
[[obstacle]]
name = "tube"
kind = "cylinder"
point = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
radius = 0.05
inside = true
[seed]
curvature = -20.5
"""
TABLE = f"""{CURLED}
[[wall]]
name = "table"
point = [0.0, 0.0, -0.06]
normal = [0.0, 0.0, 1.0]
[seed]
curvature = 4.0
"""
FOLD = """
[strip]
length = 0.3
width = 0.015
poisson = 0.3
thickness = 4e-4

[contact]
itself = true
distance = 0.004
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[clamp.end]
position = [0.0, 0.0, 0.048]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[seed]
curvature = [10.0, -10.0, 10.0]
[model]
energy = "sadowsky"
elements = 30
"""


def drawn(monkeypatch, tmp_path, module, draw):
    """The figure that `draw` would save."""
    kept = []
    monkeypatch.setattr(module, "save", lambda figure, *_, **__: kept.append(figure))
    draw(tmp_path / "x.png")
    FigureCanvasAgg(kept[0]).draw()
    return kept[0]


def marks(axes):
    """Dots (n, 2), and the arrows as feet and ways (n, 2)."""
    dots = [np.asarray(one.get_offsets()) for one in axes.collections if isinstance(one, PathCollection)]
    ways = [one for one in axes.collections if isinstance(one, Quiver)]
    return np.concatenate(dots), [(np.column_stack([w.X, w.Y]), np.column_stack([w.U, w.V])) for w in ways]


def test_dots_and_arrows_of_a_tube_are_its_places_and_pushes(monkeypatch, tmp_path):
    scene = loads(TUBE)
    state = solve(scene)
    assert state.ok
    (tube,) = jsonable(state_result(scene, state))["walls"]
    figure = drawn(
        monkeypatch, tmp_path, picture, lambda at: picture.ribbon_profile(at, state.native, "x", scene.units)
    )
    side = figure.axes[2]
    cloud = state.native.surface(400, 6).grid
    screen = screen_axes([cloud], np.array([0.0, 0.0, 1.0]))[0]
    dots, arrows = marks(side)
    points, pushes = np.array(tube["points"]), np.array(tube["pushes"])
    assert len(points) > 4
    assert dots == pytest.approx(points @ screen.T, abs=1e-9)
    ((feet, ways),) = arrows  # no friction
    inwards = -(points - np.array([0.0, points[0, 1], 0.0])) * [1.0, 0.0, 1.0]
    inwards /= np.linalg.norm(inwards, axis=1)[:, None]
    seen = pushes > 0.02 * pushes.max()
    extent = float(np.ptp(cloud.reshape(-1, 3), axis=0).max())
    scale = LONGEST * extent / pushes.max()
    assert feet == pytest.approx(points[seen] @ screen.T, abs=1e-9)
    assert ways == pytest.approx(scale * (pushes[:, None] * inwards)[seen] @ screen.T, rel=1e-6, abs=1e-9)
    assert (pushes[:, None] * inwards).sum(axis=0) == pytest.approx(np.array(tube["force"]), rel=1e-4, abs=1e-3)
    texts = [text.get_text() for text in side.get_legend().get_texts()]
    assert texts[0] == f"contact: {len(points)} places"
    told = float(re.search(r"at most ([\d.]+) mN", texts[1])[1])
    assert told == pytest.approx(1e3 * pushes.max() * scene.units.force, rel=5e-3)


def test_a_strip_on_itself_is_pushed_apart(monkeypatch, tmp_path):
    scene = loads(FOLD)
    state = solve(scene)
    pairs = jsonable(state_result(scene, state))["contacts"]
    assert pairs
    figure = drawn(monkeypatch, tmp_path, picture, lambda at: picture.ribbon_profile(at, state.native, "x"))
    dots, arrows = marks(figure.axes[2])
    assert len(dots) == 2 * len(pairs)
    feet, ways = arrows[0]
    assert np.linalg.norm(dots[0::2] - dots[1::2], axis=1).max() <= max(pair["gap"] for pair in pairs) + 1e-9
    assert ways[0::2] == pytest.approx(-ways[1::2])
    apart = feet[0::2] - feet[1::2]
    assert (np.sum(apart * ways[0::2], axis=1) > 0.9 * np.linalg.norm(apart, axis=1) * _norm(ways[0::2])).all()


def _norm(rows_):
    return np.linalg.norm(rows_, axis=1)


def test_nothing_is_marked_where_nothing_touches(monkeypatch, tmp_path):
    scene = loads(TABLE.replace("-0.06]", "-0.9]"))
    state = solve(scene)
    figure = drawn(monkeypatch, tmp_path, picture, lambda at: picture.ribbon_profile(at, state.native, "x"))
    side = figure.axes[2]
    assert not [one for one in side.collections if isinstance(one, PathCollection | Quiver)]
    assert side.get_legend() is None


def test_all_of_the_view_in_space_is_within_the_picture(monkeypatch, tmp_path):
    """Corners of table and strip where they come to lie in the picture, even drawn half as large again."""
    scene = loads(TABLE)
    state = solve(scene)
    monkeypatch.setattr(picture, "_ZOOM", 1.5)
    figure = drawn(monkeypatch, tmp_path, picture, lambda at: picture.ribbon_profile(at, state.native, "x"))
    axes = figure.axes[3]
    place = axes.get_subplotspec().get_position(figure).transformed(figure.transFigure)
    for one in axes.collections:
        if not one.get_paths() or one.get_visible() is False:
            continue
        corners = axes.transData.transform(np.concatenate([path.vertices for path in one.get_paths()]))
        inside = place if not one.get_clip_on() else axes.bbox
        assert (corners >= inside.p0 - 1.0).all()
        assert (corners <= inside.p1 + 1.0).all()


_SI = {"m": 1e-3, "µ": 1e-6, "n": 1e-9, "": 1.0}


def _vector(text):
    """The first three numbers of a row in SI, newtons or metres."""
    found = re.match(r"(\S+) (\S+) (\S+) ([mµn]?)(?:N|m)\b", text)
    return _SI[found[4]] * np.array([float(found[k]) for k in (1, 2, 3)])


def test_several_strips_are_told_and_drawn_as_in_their_result(monkeypatch, tmp_path):
    """Ends, forces of clamps and of contact in SI as in result.json, in 80 columns; dots at the places of contact."""
    text = shipped_strips()["crossing"].read_text(encoding="utf-8")
    scene = loads_strips(text, "crossing.toml", {"model.elements": 5})
    state = solved(scene, error=False)
    found, units = jsonable(result(state)), scene.first.units
    told = dict(rows(state))
    for name, strip in found["strips"].items():
        assert _vector(told[f"force at {name}.start"]) == pytest.approx(
            units.force * np.array(strip["forces"]["start"]), rel=1e-3, abs=1e-3 * units.force
        )
        assert _vector(told[f"{name}.end"]) == pytest.approx(
            units.length * np.array(strip["end"]["position"]), rel=1e-3, abs=1e-6
        )
    places = found["contact"]["places"]
    (pair,) = [key for key in told if key.startswith("contact ")]
    total = units.force * np.sum([place["force"] for place in places], axis=0)
    assert _vector(told[pair]) == pytest.approx(total, rel=1e-3, abs=1e-3 * np.abs(total).max())
    page = io.StringIO()
    print_pairs(Console(file=page, width=80), "x", rows(state))
    assert max(map(len, page.getvalue().splitlines())) <= 80

    figure = drawn(monkeypatch, tmp_path, strips_picture, lambda at: write(at.parent, state, ""))
    for axes in figure.axes[:2]:
        dots, arrows = marks(axes)
        assert len(dots) == 2 * len(places)
        assert axes.get_xlabel()
        assert axes.get_ylabel()
        assert arrows[0][1].sum(axis=0) == pytest.approx([0.0, 0.0], abs=1e-9)
    sides = screen_axes(list(_grids(tmp_path)), scene.up)
    at = np.array([point for place in places for point in (place["position"], place["position_b"])])
    assert marks(figure.axes[1])[0] == pytest.approx(at @ sides[1].T, abs=1e-9)


def test_places_of_several_strips_are_exported(tmp_path):
    text = shipped_strips()["crossing"].read_text(encoding="utf-8")
    scene = loads_strips(text, "crossing.toml", {"model.elements": 5})
    write(tmp_path, solved(scene, error=False), "")
    assert main(["export", str(tmp_path), "--format", "csv", "--quiet", "--out", str(tmp_path / "files")]) == DONE
    found = json.loads((tmp_path / "result.json").read_text())
    places, units = found["contact"]["places"], scene.first.units
    own = [line.split(",") for line in (tmp_path / "files" / "contacts.csv").read_text().splitlines()[1:]]
    assert len(own) == len(places) > 0
    for row, place in zip(own, places, strict=True):
        assert row[0] == f"{place['b']} on {place['a']}"
        assert [float(x) for x in row[1:4]] == pytest.approx(units.length * np.array(place["position"]), rel=1e-9)
        assert float(row[4]) == pytest.approx(place["s"] * scene.strips[0].strip.length, rel=1e-9)
        assert float(row[6]) == pytest.approx(place["s_b"] * scene.strips[1].strip.length, rel=1e-9)
        assert float(row[8]) == pytest.approx(units.force * np.linalg.norm(place["force"]), rel=1e-9)
    drawn_ = view(read_part(tmp_path).surfaces, None, 500).surfaces
    assert [one.surface.kind for one in drawn_] == [STRIP, STRIP, PUSH]
    assert all(one.first for one in drawn_)  # both strips are seen


def _grids(folder):
    from compare.pages.export.vtu import read_vtu

    for name in ("lower", "upper"):
        sheet = read_vtu(folder / f"{name}.vtu")
        yield sheet.points.reshape(*sheet.shape, 3)
