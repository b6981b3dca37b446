"""Scenes with walls: what the shell is asked, that it rests with the ribbon, and what the walls of both exert."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

from compare.cli import DONE, NOT_CONVERGED, main
from compare.measure.balance import Push, Wrench, unbalanced
from compare.models.scope import has_shell
from compare.models.shell import motions_of
from compare.models.shell_build import shell_problem
from compare.scene.scene import load, loads
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.compare import compare
from ribbonbench.errors import BadInput
from tests.test_setup import ROOT

SCENES = ROOT / "compare" / "scenes"
WITH_WALLS = sorted(path for path in SCENES.glob("*.toml") if "[[wall]]" in path.read_text())
TABLE = """
[strip]
length = 2.0
width = 0.1
thickness = 2e-3
poisson = 0.3
gamma = 40.0
[gravity]
up = [0.0, 0.0, 1.0]
exact = true
[clamp.start]
position = [0.0, 0.0, 0.2]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[[wall]]
name = "table"
point = [0.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[model]
elements = 24
[shell]
elements = [24, 2]
grading = [1.0, 1.0]
"""


def table(**change):
    return loads(TABLE, "table").replace(change)


@pytest.mark.parametrize("path", WITH_WALLS, ids=lambda path: path.stem)
def test_every_shipped_scene_with_walls_has_a_shell(path):
    """Walls where the scene has them, over the length; a stage that moves one is a waypoint."""
    scene = load(path).replace({"shell.width_to_thickness": [100.0]})
    assert len(WITH_WALLS) >= 5
    assert has_shell(scene)
    problem = shell_problem(scene, 100.0)
    assert [wall.stiffness for wall in problem.walls] == [wall.stiffness for wall in scene.walls]
    np.testing.assert_allclose([wall.point for wall in problem.walls], scene.wall_points)
    assert problem.contact == "midsurface"
    if scene.path:
        moved = {waypoint.walls for waypoint in problem.path if waypoint.walls is not None}
        assert len(moved) >= len({tuple(map(tuple, stage.wall_points)) for stage in scene.stages()[:-1]})


@pytest.fixture(scope="module")
def beside(tmp_path_factory):
    store = CaseStore(tmp_path_factory.mktemp("cases"))
    return compare(table(), store, Reporter(quiet=True), bare=True)


def test_the_shell_lies_where_the_ribbon_does(beside):
    """A strip held above a table: one state, near; both tables carry the same, each row says so with errors."""
    (row,) = beside.rows
    assert row.same_state is True
    assert row.hausdorff < 3e-3
    (own,) = row.shell_walls
    ribbon = beside.fast.supports.walls[0]["force"]
    told = ("force", "moment", "gap", "mean_pressure", "greatest_pressure")
    assert set(own) == {
        *("name", "contacts", "height"),
        *(f"{name}{end}" for name in told for end in ("", "_error")),
    }
    assert own["name"] == "table"
    assert all(own[f"{name}_error"] is not None for name in told)
    assert 5.0 < ribbon[2] < 40.0
    np.testing.assert_allclose(own["force"], ribbon, atol=0.3)
    total = np.add(own["force"], row.shell_forces["start"])
    np.testing.assert_allclose(total, [0.0, 0.0, 40.0], atol=1e-5)


def test_resultants_balance_by_shape_and_loads_alone(beside):
    """Clamp, wall and weight of the shell, by the judge that knows no solver; one newton more of the wall does not."""
    (shell,) = beside.shells
    scene, held = table(), shell.supports
    s, across = np.polynomial.legendre.leggauss(200)
    v, shares = np.polynomial.legendre.leggauss(4)
    s, weight = 0.5 * (s + 1.0), 0.5 * across
    points = shell.shape.points(s, 0.5 * scene.width * v)
    centre = np.einsum("k,m,kmi->i", weight, 0.5 * shares, points)
    (wall,) = held.walls
    wrench = Wrench(shell.shape.pose(0.0).position, held.start.force, held.start.moment)
    for more, bound in ((0.0, 2e-4), (1.0, np.inf)):
        force = wall["force"] * (1.0 + more / wall["force"][2])
        push = Push(np.array([0.0, 0.0, 1.0]), force, wall["points"])
        left = unbalanced([wrench], np.array([0.0, 0.0, -40.0]), centre, [push])
        assert left < bound
        assert more == 0.0 or left > 1e-2


def test_pressures_of_both_are_of_one_size_within_what_their_lines_leave_open(beside):
    """Where the strip comes down on its table the ribbon's segments and the shell's elements leave open; what its table
    pushes over that length is one number, within both errors, and each model's pushes are its force."""
    (row,), (shell,) = beside.rows, beside.shells
    (own,), (wall,), ribbon = row.shell_walls, shell.supports.walls, beside.fast.supports.walls[0]
    known = beside.fast.errors["mean_pressures"]["walls"][0]
    assert abs(own["mean_pressure"] - ribbon["mean_pressure"]) < known + own["mean_pressure_error"]
    assert known > ribbon["mean_pressure"] / 24 / 0.4  # a segment of the line
    for one in (wall, ribbon):
        assert one["pushes"].sum() == pytest.approx(one["force"][2], rel=1e-7)
        assert len(one["pushes"]) == len(one["points"])
        length = np.diff(one["lines"], axis=1).sum()
        assert one["mean_pressure"] == pytest.approx(one["force"][2] / length, rel=1e-7)
    assert own["greatest_pressure"] == wall["pressure"].max() > own["mean_pressure"]


def test_pressure_of_a_strip_that_lies_flat_is_that_of_its_weight(tmp_path):
    """Of ribbon and shell: Gamma D / l^3 = 40 D / l^3, everywhere."""
    flat = table(**{"clamp.start.position": [0.0, 0.0, 0.0]})
    beside = compare(flat, CaseStore(tmp_path), Reporter(quiet=True), bare=True)
    (row,), (shell,) = beside.rows, beside.shells
    np.testing.assert_allclose(shell.supports.walls[0]["pressure"], 40.0, rtol=1e-7)
    assert row.shell_walls[0]["mean_pressure"] == pytest.approx(beside.fast.supports.walls[0]["mean_pressure"], rel=0.1)


def test_faces_are_read_from_the_scene():
    scene = table(**{"shell.contact": "faces"})
    assert shell_problem(scene, 50.0).contact == "faces"
    low = {"clamp.start.position": [0.0, 0.0, 1e-4], "shell.contact": "faces"}
    with pytest.raises(BadInput) as refused:
        shell_problem(table(**low), 50.0)
    assert refused.value.key == "shell.walls[0].point"
    assert "\n" not in str(refused.value)


def test_result_json_of_the_shell_says_what_touches(tmp_path):
    """`ribbonbench shell` alone: the walls with what touches, and how far it is behind them between its nodes."""
    from compare.commands.main import main

    scene = tmp_path / "table.toml"
    scene.write_text(TABLE)
    main(["shell", str(scene), "--out", str(tmp_path / "out"), "--elements", "12", "2"])
    found = json.loads((tmp_path / "out" / "result.json").read_text())
    (wall,) = found["walls"]
    assert wall["name"] == "table"
    assert max(wall["lines"])[1] == pytest.approx(1.0)
    assert found["contact"]["penetration"] < 1e-4
    assert found["contact"]["through"] < 1e-10
    assert found["forces"]["walls"][0] == wall["force"]
    assert sum(wall["pushes"]) == pytest.approx(wall["force"][2])
    for name in ("mean_pressure", "greatest_pressure"):
        assert wall[name] > 20.0
        assert wall[f"{name}_error"] > 0.0


def test_a_free_strip_on_a_table_is_told_without_its_motions():
    """Two translations and one turn; walls that leave no motion leave none."""
    free = TABLE.split("[clamp.start]")[0] + "[[wall]]" + TABLE.split("[[wall]]")[1]
    scene = loads(free, "free")
    found = motions_of(scene)
    assert (len(found.translations), len(found.axes)) == (2, 1)
    np.testing.assert_allclose(found.translations[:, 2], 0.0, atol=1e-12)
    assert has_shell(scene)


def test_limits_has_a_column_for_every_number_of_a_wall(tmp_path):
    """The row of limits.csv and the wall of result.json are the same numbers; nothing holds the strip's other end."""
    light = {"shell.elements": [12, 2], "model.elements": 12, "model.energy": "wunderlich"}
    scene = tmp_path / "table.toml"
    scene.write_text(TABLE)
    words = [word for key, value in light.items() for word in ("--set", f"{key}={json.dumps(value)}")]
    out = tmp_path / "out"
    assert main(["limits", str(scene), *words, "--quiet", "--out", str(out)]) in (DONE, NOT_CONVERGED)
    (row,) = csv.DictReader((out / "limits.csv").open())
    (found,) = json.loads((out / "result.json").read_text())["rows"]
    (wall,) = found["shell_walls"]
    assert float(row["shell_walls.table.contacts"]) == wall["contacts"] > 0
    assert json.loads(row["shell_walls.table.force"]) == pytest.approx(wall["force"])
    assert wall["force"][2] > 5.0
