"""Contacts in the 3-D view, the film of a path and exports: arrows stand at the places and along the forces."""

from __future__ import annotations

import json
import struct

import numpy as np
import pytest

from compare.cli import DONE, main
from compare.page.page import PUSH, RUB, STRIP
from compare.pages.export.arrows import AROUND, LONGEST, MOST, ROWS, extent_of, grid, moving
from compare.pages.export.vtu import read_vtu
from compare.pages.report import still
from compare.pages.report.folders import read_part
from compare.pages.report.surfaces import as_data, view
from compare.store.states import Film, States, read_states, states_of
from compare.store.touches import Touches
from tests.compare.report.test_contacts_drawn import FOLD

PATH = """
[[path]]
"clamp.end.position" = [0.0, 0.0, 0.09]
"""


@pytest.fixture(scope="module")
def folded(tmp_path_factory):
    """A folder of the fold that is closed along a path."""
    out = tmp_path_factory.mktemp("folded")
    (out / "fold.toml").write_text(FOLD.replace("elements = 30", "elements = 20") + PATH)
    assert main(["solve", str(out / "fold.toml"), "--quiet", "--out", str(out / "solve")]) == DONE
    return out / "solve"


def feet(points):
    """Places (n, 3) of arrows: the middle of their widest ring at the knob."""
    rows = points.reshape(-1, ROWS, AROUND, 3)
    return rows[:, 1, :-1].mean(axis=1)


def tips(points):
    return points.reshape(-1, ROWS, AROUND, 3)[:, -1, 0]


def touching():
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 0.2, 0.0]])
    push = np.array([[0.0, 0.0, 4.0], [0.0, -2.0, 0.0], [0.0, 0.0, 0.0]])
    friction = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    return Touches(points, push, friction, ("a", "a", "b"))


def test_an_arrow_stands_at_its_place_along_its_force_to_one_scale():
    touches = touching()
    assert touches.largest == 4.0
    pushes = grid(touches, PUSH, 2.0, touches.largest)
    assert feet(pushes) == pytest.approx(touches.points)
    ways = tips(pushes) - feet(pushes)
    assert ways[:2] == pytest.approx(LONGEST * 2.0 / 4.0 * touches.push[:2])
    assert np.linalg.norm(ways[2]) < 0.02  # without a push a knob
    rubs = grid(touches, RUB, 2.0, touches.largest)
    assert tips(rubs) - feet(rubs) == pytest.approx(LONGEST * 2.0 / 4.0 * touches.friction[:1])
    many = Touches(
        *(np.tile(part, (400, 1)) for part in (touches.points, touches.push, touches.friction)), ("a",) * 1200
    )
    assert len(grid(many, PUSH, 1.0, 4.0)) == MOST * ROWS


def test_a_film_keeps_what_touches_in_each_state():
    film = Film(0.1)
    surface = np.zeros((film.s.size, film.v.size, 3))
    surface[..., 0] = film.s[:, None]
    film.add(1, 1.0, surface, {})
    film.add(2, 1.0, surface, {}, touching())
    known = states_of(film.states.arrays())
    assert known.touches is not None
    assert [len(one) for one in known.touches] == [0, 3]
    assert known.touches[1].push == pytest.approx(touching().push)
    shown = moving(known, PUSH)
    assert shown is not None
    assert np.ptp(shown.points[0].reshape(-1, 3), axis=0) == pytest.approx([0.0, 0.0, 0.0])  # nothing yet
    assert feet(shown.points[1]) == pytest.approx(touching().points, abs=1e-6)
    bare = Film(0.1)
    bare.add(1, 1.0, surface, {})
    assert bare.states.touches is None
    assert "touch_state" not in bare.states.arrays()


def test_a_report_shows_the_contacts_of_a_fold_and_of_its_path(folded):
    pairs = json.loads((folded / "result.json").read_text())["contacts"]
    assert pairs
    part = read_part(folded)
    kinds = [surface.kind for surface, _ in part.surfaces]
    assert kinds == [STRIP, PUSH]
    film = read_states(folded / "path.npz")
    assert isinstance(film, States)
    assert film.touches is not None
    own = film.touches[-1]
    assert len(own) == 2 * len(pairs)
    assert own.push[0::2] == pytest.approx(np.array([pair["force"] for pair in pairs]), rel=1e-6, abs=1e-9)
    sheet = part.surfaces[1][1]
    assert feet(sheet.points) == pytest.approx(own.points, abs=1e-9)
    found = view(part.surfaces, part.page.up, 500, part.states)
    assert len(found.surfaces[1].sheet.points) == len(sheet.points)  # no arrow is thinned out
    strip, marks = as_data(found, "")["surfaces"]
    assert marks["frames"]["labels"] == strip["frames"]["labels"]
    assert marks["frames"]["grid"][0] == ROWS * max(len(one) for one in film.touches)
    alone = view(part.surfaces[:1], part.page.up, 500, part.states)
    assert found.distance == alone.distance
    corners, _, _ = still._triangles(found, found.surfaces[1], None)
    assert len(corners) < len(sheet.triangles)  # none between two arrows
    ends = np.linalg.norm(corners[:, [0, 1, 2]] - corners[:, [1, 2, 0]], axis=2).max()
    assert ends < 2.0 * LONGEST


def test_an_export_has_places_arrows_and_a_film_with_both(folded, tmp_path):
    assert main(["export", str(folded), "--format", "vtu,csv,gltf", "--quiet", "--out", str(tmp_path)]) == DONE
    result = json.loads((folded / "result.json").read_text())
    rows = (tmp_path / "contacts.csv").read_text().splitlines()[1:]
    assert len(rows) == len(result["contacts"])
    length, force = result["units"]["length_m"] or result["length"], result["units"]["force_N"] or 1.0
    for row, pair in zip(rows, result["contacts"], strict=True):
        cells = row.split(",")
        assert float(cells[4]) == pytest.approx(length * pair["s"], rel=1e-9)
        assert float(cells[8]) == pytest.approx(force * np.linalg.norm(pair["force"]), rel=1e-9)
    arrows, ribbon = read_vtu(tmp_path / "contacts.vtu"), read_vtu(tmp_path / "ribbon.vtu")
    assert feet(arrows.points) == pytest.approx(length * feet(read_vtu(folded / "contacts.vtu").points), abs=1e-9)
    assert not (tmp_path / "contacts_points.csv").exists()
    content = (tmp_path / "path.glb").read_bytes()
    size = struct.unpack_from("<I", content, 12)[0]
    document = json.loads(content[20 : 20 + size])
    assert [mesh["name"] for mesh in document["meshes"]] == ["strip", PUSH]
    assert [channel["target"]["node"] for channel in document["animations"][0]["channels"]] == [1, 2]
    counts = {len(mesh["primitives"][0]["targets"]) for mesh in document["meshes"]}
    assert counts == {len(read_states(folded / "path.npz").t) - 1}
    accessor = document["accessors"][document["meshes"][1]["primitives"][0]["attributes"]["POSITION"]]
    assert max(accessor["max"]) < 2.0 * extent_of(ribbon.points)  # at the strip's own scale
