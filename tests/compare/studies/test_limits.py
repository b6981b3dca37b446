"""`ribbonbench limits`: levels, zones, verdicts, results, the grid, bad input."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

from compare.cli import BAD_INPUT, DONE, main
from compare.measure.grades import resolved
from compare.models.holds.words import briefly
from compare.page.page import read_page
from compare.pages.pictures.limits import varied
from compare.scene.scene import load
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.limits import (
    Finding,
    Maps,
    Thresholds,
    hits,
    quick,
    require_limits,
    stretching_zones,
    study,
    with_clamp,
)


def test_levels():
    one = Thresholds()
    assert one.level(0.01, 0.01) == "good"
    assert one.level(0.011, 0.001) == "fair"
    assert one.level(0.001, 0.051) == "poor"
    assert one.level(None, None) is None
    assert one.level(None, 0.001) is None  # what is not known may be worse
    assert one.level(None, 0.2) == "poor"
    assert Thresholds(0.05, 0.001).level(0.04, 0.0011) == "fair"


def test_clamps_change_ribbon_and_shell():
    edge = with_clamp(load("limits_7_3"), "edge")
    assert (edge.shell.clamp, edge.clamp_start.ruling, edge.model.grading) == ("edge", "straight", "clamp")
    corners = with_clamp(load("curl_4_3"), "corners")
    assert (corners.shell.clamp, corners.clamp_start.ruling) == ("corners", "free")
    assert corners.shell.corner == pytest.approx(0.0075)  # a quarter of the width, less than 0.01
    assert with_clamp(load("limits_7_3"), "corners").shell.corner == 0.01


def test_zones_of_a_made_up_map():
    scene = with_clamp(load("limits_7_3"), "edge")  # w = 0.1
    s, v = np.linspace(0, 1, 101), np.linspace(-0.05, 0.05, 41)
    density = np.zeros((100, 40, 3))
    density[..., 0] = 4.5  # kappa = 3
    density[:5, :, 1] = 1.0  # within w/2 of the clamp: 5 rows of 40
    density[5:, 0, 1] = 1.0  # one long edge: 95
    density[5:, 20, 2] = 2.0  # in the middle: 190
    zones, shear_away = stretching_zones(scene, Maps(s, v, density, np.zeros((2, 2, 3))), 100.0)
    total = 5 * 40 + 95 + 190
    assert zones["clamps"] == pytest.approx(200 / total)
    assert zones["edges"] == pytest.approx(95 / total)
    assert zones["rest"] == pytest.approx(190 / total)
    assert shear_away == pytest.approx(1.0, abs=1e-12)


def finding(level, estimated):
    found = object.__new__(Finding)
    object.__setattr__(found, "level", level)
    object.__setattr__(found, "estimated_level", estimated)
    object.__setattr__(found, "row", object())
    return found


def test_hits():
    pairs = [("good", "good"), ("fair", "good"), ("poor", "good"), ("fair", "poor"), ("poor", "fair"), (None, "good")]
    assert hits([finding(*pair) for pair in pairs]) == {
        "known": 5, "same": 1, "cautious": 1, "bold": 3, "false_safe": 2, "good": 1,
    }  # fmt: skip


def test_a_number_with_its_error_has_a_grade_where_it_is_resolved():
    """Above its error the number's own; below it "good" where both together are good; not known else."""
    above, below = [(0.004, 0.001), (0.02, 0.001), (0.2, 0.1)], [(0.001, 0.004), (0.001, 0.02), (0.02, 0.03)]
    assert [resolved(*pair, 0.01) for pair in above] == ["good", "fair", "poor"]
    assert [resolved(*pair, 0.01) for pair in below] == ["good", "unknown", "unknown"]
    assert resolved(None, 0.1, 0.01) == resolved(0.1, None, 0.01) == "unknown"
    one = Thresholds()
    assert one.level(0.001, 0.001, (0.0005, 0.002)) == "good"
    assert one.level(0.001, 0.001, (0.0005, 0.02)) is None
    assert one.level(0.2, 0.001, (0.0005, 0.02)) == "poor"


@pytest.mark.shell
def test_a_coil_that_its_weight_hardly_moves_does_not_stretch(tmp_path):
    """Two turns, wider than they are across: the share is that of the strip (0.7 %, on 400 elements too), not of what
    holds the elements' own modes, which carries a fifth of this energy."""
    pytest.importorskip("dolfinx")
    coil = {
        "strip.width": 0.275, "strip.thickness": 0.00622, "strip.poisson": 0.32, "strip.natural_curvature": -13.5,
        "strip.gamma": 1.29, "shell.elements": [100, 4], "shell.corner": None,
        "clamp.start.tangent": [0.6613118653236518, 0.0, -0.7501110696304596],
        "clamp.start.normal": [0.39638744449231866, -0.8489716876291415, 0.34946254084375966],
    }  # fmt: skip
    scene = with_clamp(load("limits_7_3").replace(coil), "edge")
    with Reporter() as reporter:
        (found,), _ = study(scene, CaseStore(tmp_path), reporter, Thresholds())
    assert found.estimated_level == found.level == "good"
    assert found.share == pytest.approx(found.estimate.share, abs=0.004)
    assert found.row.energy.parts["stabilisation"] > 0.2 * found.row.energy.parts["bending"]


def test_quick_says_why():
    (found,) = quick(with_clamp(load("limits_7_3"), "edge"), Thresholds())
    assert found.ok
    assert found.row is None
    assert found.level == "fair"
    text = f"By estimate from the ribbon alone: inextensible model off by {100 * found.distance:.2g} % of l"
    assert found.sentence.startswith(text)
    assert found.distance == pytest.approx(0.0208, rel=0.1)  # the shell's
    assert "layers along the free edges" in found.sentence
    assert found.false_safe is None


def test_quick_grid_from_the_command_line(tmp_path, capsys):
    code = main(
        ["limits", "limits_7_3", "--quick", "--clamp", "both", "--widths", "0.05,0.2", "--gammas", "10,100",
         "--out", str(tmp_path)]
    )  # fmt: skip
    assert code == DONE
    said = capsys.readouterr().out
    assert "8 cases" in said
    result = json.loads((tmp_path / "result.json").read_text())
    assert len(result["rows"]) == 8
    assert {row["clamp"] for row in result["rows"]} == {"edge", "corners"}
    for row in result["rows"]:
        assert row["estimate"]["share"] > 0.0
        assert row["verdict"].startswith("By estimate")
        assert row["hausdorff"] is None
        assert {"strip.width", "strip.gamma"} <= set(row)
    with (tmp_path / "limits.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 8
    assert float(rows[0]["estimate.share"]) == result["rows"][0]["estimate"]["share"]
    page = read_page(tmp_path)
    assert page.command == "limits"
    assert len(page.tables[0].rows) == 8
    assert not page.pictures


@pytest.mark.shell
def test_one_scene_with_its_shell(tmp_path, capsys):
    pytest.importorskip("dolfinx")
    arguments = ["limits", "limits_7_3", "--clamp", "edge", "--set", "shell.elements=[24,4]", "--out", str(tmp_path)]
    assert main(arguments) == DONE
    said = " ".join(capsys.readouterr().out.split())
    assert "Inextensible model off by 1.9 % of l and 1.8 % of energy" in said
    assert "the reason is" in said
    result = json.loads((tmp_path / "result.json").read_text())
    (row,) = result["rows"]
    assert result["status"] == "converged"
    assert row["claimed"]
    assert row["hausdorff"] == pytest.approx(0.0208, rel=0.12)
    assert row["stretching"] == pytest.approx(0.0166, rel=0.15)
    assert row["estimate"]["distance"] == pytest.approx(row["hausdorff"], rel=0.2)
    assert sum(row["zones"].values()) == pytest.approx(1.0, abs=1e-12)
    assert sum(row["share_of_total"].values()) == pytest.approx(1.0, abs=1e-9)
    assert row["verdict"] in result["verdict"]
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {
        "cases",
        "result.json",
        "page.json",
        "limits.csv",
        "shares.png",
        "maps.png",
        "shapes.png",
        "ribbon.vtu",
        "shell_w100.vtu",
    }
    assert {picture.file for picture in read_page(tmp_path).pictures} == {"shares.png", "maps.png", "shapes.png"}
    assert all(picture.alt for picture in read_page(tmp_path).pictures)


def test_no_thickness_is_said_before_anything_is_computed(tmp_path, capsys):
    assert main(["limits", "hanging_5_3_1", "--quick", "--out", str(tmp_path)]) == BAD_INPUT
    said = capsys.readouterr().err
    assert "strip.thickness" in said
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["--widths", "0.1,abc"], "--widths"),
        (["--widths", "0.1,-0.2"], "--widths"),
        (["--thickness-to-width", "0"], "--thickness-to-width"),
        (["--vary", "strip.wdth=1,2"], "strip.wdth"),
        (["--vary", "strip.gamma"], "--vary"),
        (["--distance", "0"], "--distance"),
        (["--share", "200"], "--share"),
        (["--gammas", "10,10"], "--gammas"),
        (["--set", "model.energy=elastica"], "model.energy"),
        (["--widths", "0.015"], "shell.corner"),
    ],
)
def test_bad_input(tmp_path, capsys, arguments, named):
    assert main(["limits", "limits_7_3", "--quick", "--out", str(tmp_path / "out"), *arguments]) == BAD_INPUT
    said = capsys.readouterr().err
    assert named in said
    assert said.count("\n") == 1


def test_bands_are_asked_free_and_on_a_table():
    table = load("moebius_table_edge").replace({"shell.width_to_thickness": 100})
    require_limits(table)
    assert briefly(table) == "nothing"
    band = load("moebius_6_1").replace({"shell.width_to_thickness": 100})
    require_limits(band)
    assert briefly(band) == "nothing"
    assert briefly(load("curl_4_3")) == "whole edge"


def test_what_is_varied():
    found = [
        item
        for width in (0.05, 0.2)
        for item in quick(
            with_clamp(load("limits_7_3"), "edge").replace({"strip.width": width}), Thresholds(), {"strip.width": width}
        )
    ]
    assert varied(found) == ["strip.width", "w/h"]


def test_many_cases_are_summed_up(tmp_path, capsys):
    arguments = ["limits", "limits_7_3", "--quick", "--gammas", "1,10,30,100,300,1000,3000", "--out", str(tmp_path)]
    assert main(arguments) == DONE
    result = json.loads((tmp_path / "result.json").read_text())
    assert len(result["verdict"]) < 7
    assert sum(text.startswith("Most stretching.") for text in result["verdict"]) == 1
    shares = [row["estimate"]["share"] for row in result["rows"]]
    most = result["rows"][shares.index(max(shares))]
    assert most["verdict"] in next(text for text in result["verdict"] if text.startswith("Most stretching."))
