"""SI beside the dimensionless numbers: a steel cantilever against formulas by hand, tables, results, CSV."""

import csv
import json

import numpy as np
import pytest

from compare.cli import main
from compare.page.main_table import main_table
from compare.page.pair import Times
from compare.page.si import array_with_si, for_reader, with_si
from compare.page.state import STATE
from compare.page.table import Column, Table
from compare.pages.result import row_result
from compare.record.views import in_si
from compare.scene.scene import load, loads
from compare.scene.units import Units
from compare.studies.compare import Row
from tests.compare.scene.held_scenes import STEEL

WEIGHT = 7850.0 * 9.81 * 0.01 * 1e-4 * 0.3
BENDING = 2.1e11 * 1e-12 / (12.0 * (1.0 - 0.09))


@pytest.fixture(scope="module")
def steel(tmp_path_factory):
    """The folder of the solved cantilever."""
    folder = tmp_path_factory.mktemp("steel")
    (folder / "steel.toml").write_text(STEEL)
    energy = ["--set", 'model.energy="wunderlich"']
    assert main(["solve", str(folder / "steel.toml"), *energy, "--out", str(folder / "out"), "--quiet"]) == 0
    return folder / "out"


def line_of(folder):
    with (folder / "centreline.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def test_the_clamp_carries_the_weight_in_newtons(steel):
    si = json.loads((steel / "result.json").read_text())["si"]
    np.testing.assert_allclose(si["forces"]["start"], [0.0, 0.0, WEIGHT], rtol=1e-9, atol=1e-9 * WEIGHT)
    line = line_of(steel)
    lever = np.mean(0.5 * (line["x_m"][1:] + line["x_m"][:-1]))
    assert abs(si["moments"]["start"][1]) == pytest.approx(WEIGHT * lever, rel=1e-4)


def test_energies_are_the_integrals_in_joules(steel):
    result, line = json.loads((steel / "result.json").read_text()), line_of(steel)
    along = np.diff(line["s_m"])

    def integral(values):
        return float(np.sum(0.5 * (values[1:] + values[:-1]) * along))

    si = result["si"]["energy"]
    assert si["elastic"] == pytest.approx(0.5 * BENDING * 0.01 * integral(line["omega_per_m"] ** 2), rel=1e-4)
    assert si["gravity"] == pytest.approx(WEIGHT / 0.3 * integral(line["z_m"]), rel=1e-4)
    assert si["total"] == pytest.approx(si["elastic"] + si["gravity"], rel=1e-12)


def test_the_result_says_what_it_is_made_dimensionless_with(steel):
    result = json.loads((steel / "result.json").read_text())
    assert result["units"]["known"]
    assert result["units"]["length_m"] == 0.3
    assert result["D"] == pytest.approx(BENDING, rel=1e-12)
    assert result["gamma"] == pytest.approx(WEIGHT * 0.3**2 / (BENDING * 0.01), rel=1e-12)
    assert result["width_to_thickness"] == pytest.approx(100.0)
    assert result["width_to_length"] == pytest.approx(1.0 / 30.0)
    end = np.array(result["end"]["position"])
    np.testing.assert_allclose(result["si"]["end"]["position"], 0.3 * end, rtol=1e-14)
    assert result["si"]["discretisation_error"] == pytest.approx(0.3 * result["discretisation_error"])


def test_a_scene_with_gamma_has_no_numbers_in_si(tmp_path):
    assert main(["solve", "cantilever", "--set", "model.elements=6", "--out", str(tmp_path), "--quiet"]) == 0
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["si"] is None
    assert not result["units"]["known"]
    assert result["gamma"] == 10.0
    assert not [name for name in line_of(tmp_path) if name.endswith("_m")]


def test_rows_of_a_comparison_have_their_distance_in_metres():
    row = Row(100.0, "converged", True, "", 2e-3, None, 1e-5, 1e-4, True, None, None,
              {"position": [0.5, 0.0, -0.5], "frame": np.eye(3)}, None, Times(1.0, 2.0), (1, 1), 1,
              False, True, "", warm=True, searched=False)  # fmt: skip
    si = row_result(row, loads(STEEL))["si"]
    assert si["hausdorff"] == pytest.approx(6e-4)
    assert si["centreline"] is None
    np.testing.assert_allclose(si["shell_end"]["position"], [0.15, 0.0, -0.15])
    assert row_result(row, load("cantilever"))["si"] is None


def test_limits_and_sweeps_have_columns_in_si_each_row_in_its_own(tmp_path):
    """Another Young's modulus is another joule; the length stays."""
    (tmp_path / "steel.toml").write_text(STEEL)
    vary = ["--vary", "strip.young=1e11,2e11", "--quiet"]
    assert main(["sweep", str(tmp_path / "steel.toml"), *vary, "--workers", "1", "--out", str(tmp_path / "s")]) == 0
    with (tmp_path / "s" / "cases.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    joule = [float(row["energy.total_J"]) / float(row["energy.total"]) for row in rows]
    assert joule[1] == pytest.approx(2.0 * joule[0], rel=1e-12)
    assert [float(row["end.z_m"]) / float(row["end.z"]) for row in rows] == pytest.approx([0.3, 0.3])
    assert json.loads((tmp_path / "s" / "result.json").read_text())["units"] is None
    thick = ["--set", "shell.width_to_thickness=[100]", "--quick", "--out", str(tmp_path / "l")]
    assert main(["limits", str(tmp_path / "steel.toml"), *thick, *vary]) == 0
    with (tmp_path / "l" / "limits.csv").open() as stream:
        for row in csv.DictReader(stream):
            assert float(row["estimate.distance_m"]) == pytest.approx(0.3 * float(row["estimate.distance"]))


def test_columns_in_si_stand_behind_their_own():
    columns = Column("name", "name", kind="word"), Column("far", "far", "l", "digits"), Column("n", "n", kind="integer")
    table = Table("T", columns, (("a", 0.5, 1), ("b", None, 2)))
    known = Units(2.0, 0.1, 3.0)
    assert with_si(table, Units()) is table
    found = with_si(table, known)
    assert found.keys == ("name", "far", "far_m", "n")
    assert found.values("far_m") == (1.0, None)
    assert found.columns[2].unit == "m"
    assert with_si(table, [Units(), known]).values("far_m") == (None, None)


def test_arrays_of_points():
    names, array = array_with_si(["s", "eta"], np.ones((2, 2)), {"s": "l"}, Units(2.0, 0.1, 3.0))
    assert names == ["s", "eta", "s_m"]
    assert array.tolist() == [[1.0, 1.0, 2.0]] * 2


def test_every_part_of_an_energy_is_in_joules():
    found = {"energy": {"elastic": 1.0, "tip": None}, "moments": {"start": [1.0, 0.0, 2.0]}}
    si = in_si(STATE, found, Units(2.0, 0.1, 3.0))
    assert si == {"energy": {"elastic": 1.5, "tip": None}, "moments": {"start": [1.5, 0.0, 3.0]}}


def test_a_table_for_a_reader_has_one_prefix_a_column_and_the_stored_numbers_last():
    """In mm and mJ by hand; six columns show what is in SI; nothing changes where SI is not known."""
    units = Units(length=0.3, width=0.01, stiffness=1.9e-4)
    columns = (
        Column("ratio", "w/h", rank=0),
        Column("distance", "distance", "l", "exponent:2", rank=1),
        Column("end", "end / l", "l", "decimals:5", rank=2),
        Column("energy", "total", "D w / l", "digits:6", rank=3),
        Column("seconds", "s", "s", "seconds:3", rank=4),
    )
    table = Table("t", columns, ((10.0, 1e-3, (0.0, 0.5, 1.0), 4.0, 2.0),), below=(("ribbon", None, None, -2.0, 1.0),))
    told = for_reader(table, units)
    assert told.values("distance_si") == (pytest.approx(0.3),)
    assert told.values("end_si")[0] == pytest.approx((0.0, 150.0, 300.0))
    assert told.values("energy_si") == (pytest.approx(4.0 * 1.9e-4 / 0.3 * 1e3),)
    assert told.below[0][told.keys.index("energy_si")] == pytest.approx(-2.0 * 1.9e-4 / 0.3 * 1e3)
    assert told.select(table.keys).rows == table.rows
    shown, _ = main_table(told)
    assert shown.keys == ("ratio", "distance_si", "distance", "end_si", "energy_si", "seconds")
    assert for_reader(table, Units()) is table
