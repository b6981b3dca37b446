"""Force against displacement: the work of a moved support is the change of energy; columns, curve and picture."""

import csv
import json

import numpy as np
import pytest

from compare.cli import main
from compare.measure.load_curve import LoadPoint, load_curve_of
from compare.models.ribbon.stages import run_way
from compare.page.csv import as_csv
from compare.pages.ribbon import path_stands, path_table
from compare.scene.scene import loads
from tests.compare.scene import held_scenes

NONE = {"start": None, "end": None, "walls": []}


def load_path_of(*changes):
    text = held_scenes.PATH
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    scene = loads(text)
    found = run_way(scene).equilibrium
    assert found.ok
    return scene, found.log


@pytest.fixture(scope="module")
def path():
    return load_path_of(("steps = 3", "steps = 12"))


def trapezoid(values, places):
    return float(np.sum(0.5 * (values[1:] + values[:-1]) * np.diff(places)))


def of_stage(log, stands, stage):
    """Steps of a stage and the last of the one before: numbers in `stands`, energies."""
    numbers = [k for k, (entry, _) in enumerate(stands) if log[entry]["stage"] == stage]
    numbers = [numbers[0] - 1, *numbers] if log[stands[numbers[0]][0]]["t"] > 0.0 else numbers
    return numbers, [log[stands[k][0]]["energy"] for k in numbers]


def test_the_work_along_the_path_is_the_change_of_energy(path):
    """Stage 2: pushed together by 0.2 l in steps of 1/60 l; the trapezoid's error is of the second order."""
    scene, log = path
    stands = path_stands(log, scene)
    curve = load_curve_of([stand for _, stand in stands], scene.strip.length)
    assert (curve.key, curve.kind, curve.support) == ("clamp.end.position", "position", "end")
    numbers, energy = of_stage(log, stands, 2)
    way, force = curve.way[numbers], curve.force[numbers]
    assert way[-1] - way[0] == pytest.approx(0.2)
    work = trapezoid(force, way)
    assert work == pytest.approx(energy[-1] - energy[0], rel=1e-4)
    coarse = trapezoid(force[::2], way[::2])
    assert abs(coarse - (energy[-1] - energy[0])) > 3.0 * abs(work - (energy[-1] - energy[0]))
    slope = (energy[2] - energy[0]) / (way[2] - way[0])
    assert slope == pytest.approx(force[1], rel=1e-3)


def test_the_work_of_a_turned_clamp_is_that_of_its_moment():
    c, s = np.cos(np.pi / 8.0), np.sin(np.pi / 8.0)
    turned = f"tangent = [{c}, 0.0, {s}]\nnormal = [{-s}, 0.0, {c}]"
    stages = held_scenes.PATH.split("[[path]]\n", 1)[1]
    scene, log = load_path_of(
        ("position = [0.6, 0.0, 0.1]\n", "position = [0.7, 0.0, 0.0]\n"),
        (held_scenes.FLAT, f'{turned}\nruling = "straight"\n'),
        (stages, '"clamp.end.tangent" = [1.0, 0.0, 0.0]\n"clamp.end.normal" = [0.0, 0.0, 1.0]\n'),
    )  # fmt: skip
    stands = path_stands(log, scene)
    curve = load_curve_of([stand for _, stand in stands], 1.0)
    assert curve.kind == "turn"
    assert curve.way[-1] == pytest.approx(np.pi / 8.0, rel=1e-9)
    energy = [log[entry]["energy"] for entry, _ in stands]
    assert trapezoid(curve.force, curve.way) == pytest.approx(energy[-1] - energy[0], rel=3e-2)


def test_columns_of_every_accepted_step(path):
    scene, log = path
    rows = list(csv.DictReader(as_csv(path_table(log, scene)).splitlines()))
    for row, entry in zip(rows, log, strict=True):
        if not entry["accepted"]:
            assert row["force.end.x"] == ""
            continue
        assert [float(row[f"force.end.{c}"]) for c in "xyz"] == entry["forces"]["end"]
        assert [float(row[f"moment.start.{c}"]) for c in "xyz"] == entry["moments"]["start"]
        assert [float(row[f"clamp.end.position.{c}"]) for c in "xyz"] == entry["moved"]["clamp.end.position"]
    weightless = [entry for entry in log if entry["stage"] == 2]
    for entry in weightless:
        np.testing.assert_allclose(np.add(entry["forces"]["start"], entry["forces"]["end"]), 0.0, atol=1e-9)


def test_a_path_in_si_has_its_curve_in_newtons_and_a_picture(tmp_path):
    text = held_scenes.PATH.replace("gamma = 10.0\n", "thickness = 1e-4\nyoung = 2e9\ndensity = 1000.0\n")
    (tmp_path / "path.toml").write_text(text)
    assert main(["solve", str(tmp_path / "path.toml"), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    with (tmp_path / "out" / "path.csv").open() as stream:
        rows = [row for row in csv.DictReader(stream) if row["accepted"] == "true"]
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    newton = result["units"]["force_N"]
    for row in rows:
        assert float(row["force_along_N"]) == pytest.approx(newton * float(row["force_along"]), rel=1e-12)
        assert float(row["moment.end.y_Nm"]) == pytest.approx(
            result["units"]["moment_Nm"] * float(row["moment.end.y"]), rel=1e-12
        )
    assert [float(rows[-1][f"force.end.{c}_N"]) for c in "xyz"] == pytest.approx(
        result["si"]["forces"]["end"], rel=1e-6
    )
    page = json.loads((tmp_path / "out" / "page.json").read_text())
    assert "force_displacement.png" in [picture["file"] for picture in page["pictures"]]
    assert (tmp_path / "out" / "force_displacement.png").stat().st_size > 5000


def stand(**values):
    named = {name.replace("_", "."): value for name, value in values.items() if name not in ("end", "wall")}
    forces = {"end": np.array(values["end"])} if "end" in values else {}
    return LoadPoint(named, forces, {})


def test_a_way_round_a_corner_is_measured_along_itself():
    places = ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0])
    states = [stand(clamp_end_position=list(p), end=[3.0, 5.0, 0.0]) for p in places]
    curve = load_curve_of(states, 2.0)
    assert curve.way.tolist() == [0.0, 0.5, 0.5, 1.5]
    assert curve.force.tolist() == [3.0, 3.0, 3.0, 5.0]


def test_states_without_the_support_have_no_place_on_the_curve():
    states = [
        LoadPoint({"clamp.end.position": None}, {}, {}),
        *(stand(clamp_end_position=[x, 0.0, 0.0], end=[x, 0.0, 0.0]) for x in (1.0, 2.0, 4.0)),
    ]
    curve = load_curve_of(states, 1.0)
    assert curve.states.tolist() == [1, 2, 3]
    assert curve.way.tolist() == [0.0, 1.0, 3.0]


def test_a_number_is_told_against_the_size_of_the_force():
    states = [stand(strip_gamma=g, end=[0.0, 3.0 * g, 4.0 * g]) for g in (1.0, 2.0)]
    curve = load_curve_of(states, 1.0)
    assert (curve.kind, curve.way.tolist(), curve.force.tolist()) == ("number", [1.0, 2.0], [5.0, 10.0])
    assert load_curve_of(states[:1], 1.0) is None
    assert load_curve_of([LoadPoint({"strip.gamma": g}, {}, {}) for g in (1.0, 2.0)], 1.0) is None


def test_a_sweep_over_a_place_has_forces_and_their_curve(tmp_path):
    """Cases are solved one by one: the force is again the slope of their energies."""
    text = held_scenes.PATH.split("[[path]]")[0].replace("position = [0.6, 0.0, 0.1]", "position = [0.8, 0.0, 0.0]")
    (tmp_path / "arch.toml").write_text(text)
    vary = "clamp.end.position=[0.8,0,0]:[0.7,0,0]:5"
    out = tmp_path / "out"
    run = ["sweep", str(tmp_path / "arch.toml"), "--vary", vary, "--workers", "1", "--out", str(out), "--quiet"]
    assert main(run) == 0
    with (out / "cases.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [json.loads(row["clamp.end.position"])[0] for row in rows] == pytest.approx([0.8, 0.775, 0.75, 0.725, 0.7])
    way, force, energy = (np.array([float(row[key]) for row in rows])
                          for key in ("displacement", "force_along", "energy.total"))  # fmt: skip
    assert way == pytest.approx([0.0, 0.025, 0.05, 0.075, 0.1])
    np.testing.assert_allclose((energy[2:] - energy[:-2]) / (way[2:] - way[:-2]), force[1:-1], rtol=2e-3)
    assert [float(row["force.end.x"]) for row in rows] == pytest.approx((-force).tolist())
    assert "force.start.z" in rows[0]
    assert (out / "force_displacement.png").stat().st_size > 5000
