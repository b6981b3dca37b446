"""What a strip cannot cross, in the 3-D view of a report: planes and round obstacles around it, translucent."""

from __future__ import annotations

import json

import numpy as np
import pytest

from compare.cli import main
from compare.models import solve
from compare.models.holds.bodies import patch
from compare.models.holds.ribbon import body_of, nets
from compare.page.page import PUSH, SHELL, STRIP, WALL, Surface
from compare.pages.export.formats import contacts_csv
from compare.pages.export.vtu import grid_sheet, read_vtu
from compare.pages.report import still
from compare.pages.report.surfaces import as_data, view
from compare.scene.scene import load
from ribbon.obstacle import Obstacle


@pytest.fixture(scope="module")
def pressed(tmp_path_factory):
    """Roman's strip under a plate on a spring: its state, and a folder of results."""
    out = tmp_path_factory.mktemp("pressed")
    assert main(["solve", "roman_plate", "--quiet", "--out", str(out)]) == 0
    return solve(load("roman_plate")), out


def test_planes_are_where_they_stand_and_reach_past_the_strip(pressed):
    state, _ = pressed
    points = state.native.surface(40, 4).points
    floor, roof = nets(state.native, points)
    scene = load("roman_plate")
    assert floor[..., 1] == pytest.approx(scene.walls[0].point[1])
    moved = state.native.walls[1].height  # the plate gives way
    assert abs(moved) > 1e-3
    normal = np.array(scene.wall_normals[1])
    apart = (roof.reshape(-1, 3) - np.array(scene.walls[1].point)) @ normal
    assert apart == pytest.approx(moved, abs=1e-9)
    for net in (floor, roof):
        flat = net.reshape(-1, 3)
        for axis in (0, 2):
            assert flat[:, axis].min() < points[:, axis].min()
            assert flat[:, axis].max() > points[:, axis].max()
    assert ((points - np.array(scene.walls[1].point)) @ normal - moved).min() > -1e-5


def test_a_page_has_them_and_the_camera_looks_at_the_strip_alone(pressed):
    _, out = pressed
    page = json.loads((out / "page.json").read_text())
    walls = [one for one in page["surfaces"] if one["kind"] == WALL]
    assert [one["label"] for one in walls] == ["wall floor", "wall roof"]
    assert {"wall_floor.vtu", "wall_roof.vtu"} <= set(page["files"])
    pairs = [(Surface(**one), read_vtu(out / one["file"])) for one in page["surfaces"]]
    both, alone = view(pairs, (0.0, 1.0, 0.0), 500), view(pairs[:1], (0.0, 1.0, 0.0), 500)
    assert both.distance == alone.distance
    assert [one.surface.kind for one in both.surfaces] == [STRIP, WALL, WALL, PUSH]
    assert all(one.first for one in both.surfaces)
    data = as_data(both, "")
    low, span = np.array(data["low"]), np.array(data["span"])
    cloud = np.concatenate([sheet.points for _, sheet in pairs])
    assert (low, low + span) == (pytest.approx(cloud.min(axis=0)), pytest.approx(cloud.max(axis=0)))


def test_what_touches_is_exported_with_its_pushes(pressed, tmp_path):
    """The pushes along the planes' normals are the forces of the walls; of itself both places and the distance."""
    state, out = pressed
    assert main(["export", str(out), "--format", "csv", "--quiet", "--out", str(tmp_path)]) == 0
    rows = [line.split(",") for line in (tmp_path / "contacts.csv").read_text().splitlines()]
    assert rows[0] == ["touched", "x", "y", "z", "s", "v", "s_other", "v_other", "push", "gap"]
    for wall in state.supports.walls:
        own = [float(row[8]) for row in rows[1:] if row[0] == wall["name"]]
        assert len(own) == len(wall["points"])
        assert sum(own) == pytest.approx(np.linalg.norm(wall["force"]), rel=1e-4, abs=1e-4)
    assert "roof" in {row[0] for row in rows[1:]}
    pair = {"s": 0.1, "v": 0.02, "s_other": 0.9, "v_other": 0.0, "force": [0.0, 3.0, 4.0], "gap": 0.01}
    told = contacts_csv({"contacts": [pair]}, 2.0, 3.0)
    assert told is not None
    assert told.decode().splitlines()[1] == "itself,,,,0.2,0.04,1.8,0,15,0.02"
    rub = {"point": [0.5, 0.0, 0.25], "push": 2.0, "friction": [0.0, 0.5, -0.25], "state": "sticks"}
    floor = {"name": "floor", "points": [[0.5, 0.0, 0.25]], "pushes": [2.0], "rubs": [rub]}
    names, push, friction = (
        line.split(",") for line in contacts_csv({"walls": [floor]}, 2.0, 3.0).decode().splitlines()
    )
    assert len(names) == len(push) == len(friction) == 14
    assert (push[0], push[8], push[10:]) == ("floor", "6", [""] * 4)
    assert (friction[0], friction[1:4], friction[8]) == ("friction of floor", ["1", "0", "0.5"], "6")
    assert friction[10:] == ["0", "1.5", "-0.75", "sticks"]
    assert contacts_csv({"walls": [{"name": "floor", "points": [], "pushes": []}]}, 1.0, 1.0) is None


def test_a_wall_lets_the_strip_through_in_the_still_picture():
    s, v = np.meshgrid(np.linspace(0.0, 1.0, 5), np.linspace(0.0, 1.0, 3), indexing="ij")
    sheet = grid_sheet(np.stack([s, v, 0.1 * s], axis=-1), {"S": s, "v": v})
    pairs = [(Surface("", kind, kind), sheet) for kind in (STRIP, SHELL, WALL)]
    found = view(pairs, None, 500)
    alphas = [set(still._triangles(found, one, None)[2][:, 3]) for one in found.surfaces]
    assert alphas == [{1.0}, {1.0}, {still.WALL_OPACITY}]
    assert len({one.colour for one in found.surfaces}) == 3


@pytest.mark.parametrize(
    "obstacle",
    [
        Obstacle("sphere", (0.0, -50.0, 0.0), 49.5),
        Obstacle("cylinder", (0.0, -1e5, 0.0), 1e5 - 0.2, (0.0, 0.0, 1.0)),
        Obstacle("cylinder", (0.0, 3.0, 0.0), 4.0, (1.0, 0.0, 0.0), inside=True),
    ],
)
def test_of_a_large_obstacle_what_is_beside_the_strip_is_drawn(obstacle):
    points = np.random.default_rng(1).uniform(-0.3, 0.3, (50, 3))
    net = patch(body_of(obstacle), points)
    assert np.abs(obstacle.gaps(net.reshape(-1, 3))).max() < 1e-9 * max(obstacle.radius, 1.0)
    assert np.linalg.norm(net - points.mean(axis=0), axis=-1).max() < 8.0
    gaps, normals, _ = obstacle.derivatives(points)
    feet = points - gaps[:, None] * normals
    nearest = np.linalg.norm(feet[:, None] - net.reshape(1, -1, 3), axis=-1).min(axis=1)
    assert nearest.max() < 0.05  # every place that the strip could touch is on it
