"""The answer before all else: grades from one table, the first line of terminal, page and report."""

from __future__ import annotations

import io
import json
import re
from dataclasses import replace

import pytest
from rich.console import Console

from compare.cli import DONE, NOT_CONVERGED, main
from compare.measure.grades import GOOD_UP_TO, grade, worst
from compare.models import solve
from compare.models.base import Options, Status
from compare.page.page import read_page
from compare.page.terminal import print_verdict
from compare.page.verdict import Check, Verdict
from compare.pages.solve import answer, rows
from compare.scene.scene import load, loads
from compare.scene.units import Units
from compare.studies.inputs import input_uncertainty
from compare.studies.limits import Thresholds
from tests.compare.scene import held_scenes

SI = """
title = "Tape"
[strip]
length = 0.3
width = 0.02
thickness = 2e-4
poisson = 0.3
young = 2.0e11
density = 7800.0
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
position = [0.0, 0.0, 0.5]
tangent = [0.0, 1.0, 0.0]
normal = [0.0, 0.0, 1.0]
[model]
energy = "wunderlich"
elements = 10
"""


@pytest.mark.parametrize(
    ("kind", "value", "expected"),
    [
        ("error", 1e-3, "good"), ("error", 1.01e-3, "fair"), ("error", 5e-3, "fair"), ("error", 5.1e-3, "poor"),
        ("distance", 0.0032, "good"), ("distance", 0.057, "poor"), ("share", 0.02, "fair"), ("error", 0.0, "good"),
        ("error", None, "unknown"), ("distance", float("nan"), "unknown"),
    ],
)  # fmt: skip
def test_one_table_of_grades(kind, value, expected):
    assert grade(kind, value) == expected


def test_what_is_not_known_is_worse_than_fair_and_better_than_poor():
    assert worst("good", "fair") == "fair"
    assert worst("fair", "unknown") == "unknown"
    assert worst("unknown", "poor", "good") == "poor"
    assert worst() == "unknown"


def test_limits_use_the_same_table():
    usual = Thresholds()
    assert (usual.distance, usual.share) == (GOOD_UP_TO["distance"], GOOD_UP_TO["share"])
    for value in (0.005, 0.02, 0.2):
        assert usual.level(value, 0.0) == grade("distance", value)
    assert usual.level(0.02, None) is None
    assert usual.level(0.2, None) == "poor"


@pytest.mark.parametrize("wrong", [("x", "superb"), ("", "good")])
def test_a_verdict_has_a_text_and_a_grade(wrong):
    with pytest.raises(ValueError, match="verdict"):
        Verdict(*wrong)


def test_colours_on_a_terminal_and_none_in_a_pipe():
    def drawn(name, **options):
        out = io.StringIO()
        print_verdict(Console(file=out, width=80, **options), Verdict("It is so", name, (Check("seen", name, "seen"),)))
        return out.getvalue()

    codes = [
        re.findall(r"\x1b\[([0-9;]*)m", drawn(name, force_terminal=True, color_system="standard"))[0]
        for name in ("good", "fair", "poor")
    ]
    assert [code.split(";")[-1] for code in codes] == ["32", "33", "31"]
    assert drawn("good") == Verdict("It is so", "good", (Check("seen", "good", "seen"),)).line + "\n"


def numbers(text, unit):
    return [float(found) for found in re.findall(rf"([0-9.e+-]+) {unit}", text)]


@pytest.fixture(scope="module")
def tape():
    scene = loads(SI, "tape")
    return scene, solve(scene, options=Options(error=True))


def test_a_point_that_is_held_is_not_called_a_clamp(tape):
    scene, state = tape
    hinged = scene.replace({"clamp.start.tangent": None, "clamp.start.normal": None})
    assert "the clamp" in answer(scene, state).text
    assert "the clamp" not in answer(hinged, state).text


def test_solve_answers_where_the_free_end_hangs(tape):
    scene, state = tape
    state = replace(state, error=1e-4)
    drop = 0.5 / 0.3 - state.end.position[2]
    assert drop > 0.1
    said = answer(scene, state)
    assert said.grade == "good"
    assert numbers(said.text, "mm") == [pytest.approx(300 * drop, rel=5e-3), pytest.approx(0.03)]
    assert numbers(said.text, "%") == [pytest.approx(100 * drop, rel=0.05), pytest.approx(0.01)]
    assert numbers(answer(scene, state, Units()).text, "mm") == []
    assert answer(scene, replace(state, error=3e-3)).grade == "fair"
    assert answer(scene, replace(state, error=None)).grade == "unknown"


def test_uncertain_inputs_are_told_beside_the_error(tape):
    scene, state = tape
    unsure = scene.replace({"uncertainty.young": 1e10})
    found = input_uncertainty(unsure, state)
    told = numbers(answer(unsure, replace(state, error=1e-6)).text, "mm")
    assert told[-1] == pytest.approx(300 * found.total, rel=0.01)
    assert len(told) == len(numbers(answer(scene, replace(state, error=1e-6)).text, "mm")) + 1


def test_forces_are_told_in_newtons_with_the_plain_ones_beside(tape):
    scene, state = tape
    told = dict(rows(scene, state))["force at s = 0"]
    weight = 7800 * 9.81 * 0.3 * 0.02 * 2e-4
    milli, plain = told.split(" mN ")
    assert float(milli.split()[2]) == pytest.approx(1e3 * weight, rel=1e-3)
    assert float(plain.strip("(").split()[2]) == pytest.approx(scene.gamma, rel=1e-5)
    assert "N" not in dict(rows(scene, state, Units()))["force at s = 0"]


def test_a_state_that_is_none_has_no_positions(tape):
    scene, state = tape
    none = replace(state, status=Status.NOT_CONVERGED, word="not_converged", stable=None)
    names = {name for name, _ in rows(scene, none)}
    assert answer(scene, none).grade == "poor"
    assert not any("end" in name or "middle" in name or "force" in name or "energy" in name for name in names)
    assert {"status", "residual"} <= names
    saddle = replace(state, status=Status.UNSTABLE, word="saddle", stable=False)
    assert answer(scene, saddle).grade == "poor"
    assert {name for name, _ in rows(scene, saddle)} == {name for name, _ in rows(scene, state)}


def test_first_line_of_terminal_page_and_reports(capsys, tmp_path):
    out = tmp_path / "o"
    assert main(["solve", "coil_10_100", "--out", str(out)]) == DONE
    first = capsys.readouterr().out.splitlines()[0]
    page = read_page(out)
    assert first == page.verdict.line
    told = json.loads((out / "result.json").read_text())["answer"]
    assert Verdict.from_data(told) == page.verdict
    assert page.verdict.checks
    assert main(["report", str(out), "--quiet"]) == DONE
    html = (out / "report.html").read_text()
    assert f'class="answer {page.verdict.grade}"' in html
    assert html.index(page.verdict.text) < html.index("<table") < html.index("How it was made")
    markdown = (out / "report.md").read_text()
    assert next(line for line in markdown.splitlines() if line and not line.startswith("#")) == f"**{first}**"


def test_a_saddle_is_said_first(capsys, tmp_path):
    path = tmp_path / "edge.toml"
    path.write_text(held_scenes.ON_EDGE)
    assert main(["solve", str(path), "--stay", "--out", str(tmp_path / "o")]) == NOT_CONVERGED
    assert read_page(tmp_path / "o").verdict.grade == "poor"
    assert capsys.readouterr().out.splitlines()[0] == read_page(tmp_path / "o").verdict.line


def test_quick_limits_say_by_how_much_they_are_off(capsys, tmp_path):
    arguments = ["limits", "limits_7_3", "--quick", "--clamp", "edge", "--out", str(tmp_path)]
    assert main(arguments) == DONE
    result = json.loads((tmp_path / "result.json").read_text())
    (row,) = result["rows"]
    first = capsys.readouterr().out.splitlines()[0]
    assert numbers(first, "%")[0] == pytest.approx(100 * row["estimate"]["distance"], rel=0.03)
    assert result["answer"]["grade"] == row["level"]
    assert main([*arguments, "--gammas", "10,100"]) == DONE
    several = json.loads((tmp_path / "result.json").read_text())
    assert several["answer"]["grade"] == worst(*(row["level"] for row in several["rows"]))


def test_a_scene_without_a_place_to_name_has_an_answer_too():
    scene = load("moebius_narrow")
    made = replace(solve(scene, options=Options(error=True)), error=1e-5)
    assert answer(scene, made).grade == "good"
