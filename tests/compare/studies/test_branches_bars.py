"""Errors of regular points of branches: against shooting and solves on finer elements; what does not settle."""

import csv
import json

import numpy as np
import pytest
from scipy.optimize import fsolve

from compare import registry
from compare.battery.cases.branches.scenes import SHIFT, clamps
from compare.commands.main import main
from compare.models.base import Options
from compare.pages.branches.page import answer, record
from compare.scene.scene import load
from compare.studies.branches.bars import Numbers, bars
from compare.studies.branches.run import Asked, diagram
from tests.compare.studies.test_branches import shot

SIDE = "clamp.end.position[1]"
#: The strip of 7.2 between its clamps, without the way there.
SHIFTED = load("shift_7_2").replace({"path": None, "model.elements": 20})


def test_force_and_energy_are_within_their_errors_of_shooting(tilted):
    """Energy: that of the first point and the work of the force on the way, both by shooting."""
    regular = [p for p in tilted.branches[0].points if p.kind == "regular"]
    angle = float(np.arctan2(0.28, 0.96))  # y of the plane points along -z
    for point in (regular[3], regular[12], regular[-2]):
        x, z = point.end[0], -point.end[2]
        guess = [float(np.diff(point.shape.result.angle(np.array([0.0, 1e-5])))[0] / 1e-5), point.force[0]]
        found, _, status, _ = fsolve(
            lambda u, x=x, z=z: shot(*u)[0] - np.array([x, z, angle]), [*guess, -point.force[2]], xtol=1e-12,
            full_output=True,
        )  # fmt: skip
        assert status == 1
        exact = np.array([found[1], 0.0, -found[2]])
        assert point.bars.settles
        assert np.linalg.norm(point.force - exact) <= point.bars.force < 1e-3 * np.linalg.norm(exact)
        # theta'^2 / 2 = M0^2 / 2 + fx (1 - cos theta) - fz sin theta along the strip, so that its integral is known
        fx, fz = found[1], found[2]
        energy = 0.5 * found[0] ** 2 + fx * (1.0 - x) - fz * z
        assert abs(point.energy - energy) <= point.bars.energy + 1e-9


def test_a_point_beside_a_fold_has_an_error_of_its_parameter_and_others_have_none(tilted):
    points = tilted.branches[0].points
    fold = next(k for k, p in enumerate(points) if p.kind == "fold")
    assert points[fold + 1].error > 0.0
    assert points[fold + 1].bars.settles
    assert points[3].error == 0.0
    assert points[fold].bars.energy > 0.0
    assert tilted.rough == 0


@pytest.mark.parametrize(("energy", "to"), [("wunderlich", 0.03), ("sadowsky", 0.1)])
def test_numbers_of_a_ribbon_are_within_their_errors_of_elements_eight_times_as_fine(energy, to):
    """Sadowsky's rulings come to their bounds on the way, on other elements elsewhere."""
    scene = SHIFTED.replace({"model.energy": energy})
    (own,) = diagram(scene, SIDE, 0.01, to, asked=Asked(branches=1)).branches
    last = own.points[-1]
    assert last.parameter == pytest.approx(to)
    placed = scene.replace({"model.elements": 160, "clamp.end.position": [*scene.clamp_end.position[:1], to, 0.0]})
    fine = registry.model("ribbon").solve(placed, options=Options(error=False))
    line = fine.shape.centreline(np.linspace(0.0, 1.0, 101))
    assert last.bars.settles
    assert abs(last.energy - fine.energy.total) <= last.bars.energy < 0.02 * last.energy
    assert np.linalg.norm(last.centreline - line, axis=1).max() <= last.bars.shape < 0.01
    assert np.linalg.norm(last.force - fine.supports.end.force) <= last.bars.force


def test_what_does_not_settle_is_told_first_and_has_no_error():
    scene = SHIFTED.replace({"model.energy": "wunderlich"})
    found = diagram(scene, SIDE, 0.03, 0.05, asked=Asked(branches=1))
    assert found.rough >= 1
    open_ones = [p for p in found.branches[0].points if p.bars is not None and not p.bars.settles]
    assert len(open_ones) == found.rough
    assert all(p.error is None for p in open_ones)
    line = answer(found).line
    assert line.startswith("Not settled") or line.index("Not settled") < line.index(SIDE)
    told = [p for p in record(found)["points"] if p["settles"] is False]
    assert len(told) == found.rough


def numbers(energy, parameter=0.0, off=0.0):
    return Numbers(parameter, energy, np.full((3, 3), off), np.array([energy, 0.0, 0.0]))


def test_errors_are_a_series_and_three_meshes_are_needed():
    own = bars([numbers(1.0), numbers(1.75, off=0.75), numbers(1.9375, off=0.9375)], level=True)
    assert own.settles
    assert own.energy >= 1.0  # the limit is 2
    assert own.energy < 1.3
    assert own.shape >= np.sqrt(3.0)
    assert own.parameter == 0.0
    for others in ([numbers(1.5), numbers(2.5)], [numbers(1.5), None], [None, None]):
        assert not bars([numbers(1.0), *others], level=True).settles
    across = bars([numbers(1.0, 0.0), numbers(1.0, 0.4), numbers(1.0, 0.8)], level=False)
    assert not across.settles
    assert across.parameter > 0.8


def test_the_command_writes_errors_of_every_point(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arch.toml").write_text(clamps())
    line = ["branches", "arch.toml", "--along", SHIFT, "--from", "0.05", "--to", "0.2", "--branches", "1", "--quiet"]
    assert main([*line, "--out", "all"]) == 0
    assert main([*line, "--errors", "special", "--out", "special"]) == 0
    assert main([*line, "--errors", "all", "--no-errors"]) == 2
    points = json.loads((tmp_path / "all" / "branches.json").read_text())["points"]
    assert all(p["energy_error"] > 0.0 and p["shape_error"] > 0.0 and p["end_force_error"] > 0.0 for p in points)
    assert all(p["settles"] and len(p["end_force"]) == 3 for p in points)
    with (tmp_path / "all" / "points.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    told = [name for name in rows[0] if name.startswith("energy_error")]
    assert len(told) == 1
    assert [float(row[told[0]]) for row in rows] == pytest.approx([p["energy_error"] for p in points], rel=0.05)
    bare = json.loads((tmp_path / "special" / "branches.json").read_text())["points"]
    assert {p["energy_error"] for p in bare if p["kind"] == "regular"} == {None}
