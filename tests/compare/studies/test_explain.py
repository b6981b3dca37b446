"""`ribbonbench explain`: what a scene switches on, what that adds, and that what is off is not there."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest

from compare.cli import BAD_INPUT, DONE, main
from compare.models.base import Options, Seconds
from compare.models.effects import ribbon_off
from compare.models.ribbon import auto
from compare.models.ribbon.build import formulation_why, ribbon_arguments, ribbon_problem
from compare.models.ribbon.solving import solver
from compare.models.timing import LONG
from compare.page.page import read_page
from compare.scene.scene import load, loads
from compare.studies.effects import explain
from ribbon import solve
from ribbonbench.clock import spent
from ribbonbench.errors import BadInput
from tests.compare.models import outside
from tests.compare.scene import held_scenes
from tests.compare.studies.outside import registered

NAMES = {
    "gravity", "gravity over the surface", "natural curvature", "finite width (Wunderlich)", "rulings do not cross",
    "clamp at the start", "clamp at the end", "straight rulings", "closure", "rigid motions removed", "contact",
    "contact with itself",
    "pressure plates", "adaptive segments", "continuation path", "stretching and shear", "load at the tip",
}  # fmt: skip
PLATE = "stiffness = 50.0\n"
ALWAYS = {"rulings do not cross", "finite width (Wunderlich)"}

CASES = {
    "two clamps": (held_scenes.TWO_CLAMPS, {"gravity", "clamp at the start", "clamp at the end"}),
    "circle": (held_scenes.CIRCLE, {"closure", "rigid motions removed"}),
    "straight seam": (
        held_scenes.CIRCLE.replace('"circle"', '"circle"\nruling = "straight"'),
        {"closure", "rigid motions removed", "straight rulings"},
    ),
    "floor": (held_scenes.FLOOR, {"gravity", "clamp at the start", "contact"}),
    "plate": (
        held_scenes.FLOOR.replace("[[wall]]\n", f"[[wall]]\n{PLATE}"),
        {"gravity", "clamp at the start", "contact", "pressure plates"},
    ),
    "exact weight": (
        held_scenes.TWO_CLAMPS.replace("[gravity]\n", "[gravity]\nexact = true\n"),
        {"gravity", "gravity over the surface", "clamp at the start", "clamp at the end"},
    ),
    "path": (held_scenes.PATH, {"gravity", "clamp at the start", "clamp at the end", "continuation path"}),
    "tolerance": (
        held_scenes.TWO_CLAMPS.replace("elements = 16", "tolerance = 1e-2"),
        {"gravity", "clamp at the start", "clamp at the end", "adaptive segments"},
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_effects_that_are_on(case):
    text, on = CASES[case]
    found = explain(loads(text))
    assert {effect.key for effect in found.effects} == NAMES
    assert {effect.key for effect in found.effects if effect.on} == on | ALWAYS
    assert all(effect.why and effect.words for effect in found.effects)
    assert all(effect.seconds is None for effect in found.effects if not effect.on)


@pytest.mark.parametrize("case", CASES)
def test_what_is_off_adds_no_row_and_no_unknown(case):
    """The counts of the problem are those of what is on, one by one."""
    text, on = CASES[case]
    scene = loads(text)
    problem = ribbon_off.explained_problem(scene)
    found = explain(scene)
    blocks = {name.split("_")[0] for name in problem.block_slices()}
    assert ("wall" in blocks) == ("contact" in on)
    assert ("seam" in blocks) == ("closure" in on)
    assert ("end" in blocks) == bool({"clamp at the end", "closure"} & on)
    assert "gauge" not in blocks
    p = problem.lengths.size
    assert problem.size == 10 * p + 9 + ("pressure plates" in on)
    rows = 6 * ("clamp at the end" in on)
    if "closure" in on:
        rows += 7 + ("straight rulings" not in on)  # a straight seam has no row for eta
    if "contact" in on:
        rows += 2 * (
            p + 1 - ("clamp at the start" in on)
        )  # a clamp level with the wall leaves its joint no motion to it
    assert found.evaluation.constraints == 8 * p + rows
    held = 7 if "clamp at the start" in on or "rigid motions removed" in on else 0
    held += 2 if "straight rulings" in on else 0
    assert found.evaluation.unknowns == problem.size - held
    assert found.evaluation.bounds == p


def test_off_is_not_computed():
    """Weightless and chained: no series in a whole solve; weightless and glued: no energy of weight, no plate."""
    weightless = load("curl_4_3").replace({"strip.gamma": 0.0})
    e = solve(**ribbon_arguments(weightless))
    assert e.ok
    assert e.problem.formulation == "chained"
    assert e.evaluations["series"] == 0
    assert solve(**ribbon_arguments(load("curl_4_3"))).evaluations["series"] > 0
    mixed = ribbon_problem(loads(held_scenes.CIRCLE))
    assert not mixed.has_gravity
    assert not mixed.has_natural_curvature
    assert mixed.plates == ()


def test_costs_are_measured_where_an_effect_can_be_off_alone(monkeypatch):
    """By a clock that stands still but for an evaluation: 1 s, 4 s with gravity, 7 s with that of the surface."""
    now = [0.0]

    def evaluate(problem, x, rows):
        now[0] += 1.0 + 3.0 * problem.has_gravity + 3.0 * (problem.has_gravity and problem.gravity.exact)

    monkeypatch.setattr(ribbon_off, "_evaluate", evaluate)
    monkeypatch.setattr(ribbon_off.time, "perf_counter", lambda: now[0])

    def costs(text):
        found = explain(loads(text))
        return {effect.key: effect.seconds for effect in found.effects}, found.evaluation.seconds

    spared, whole = costs(CASES["exact weight"][0])
    assert whole == 7.0
    assert {name: spared[name] for name in ("gravity", "gravity over the surface")} == {
        "gravity": 6.0, "gravity over the surface": 3.0,
    }  # fmt: skip
    assert spared["clamp at the end"] == spared["finite width (Wunderlich)"] == 0.0
    assert costs(held_scenes.CIRCLE)[0]["closure"] is None
    assert costs(CASES["plate"][0])[0]["pressure plates"] is not None


def test_an_evaluation_takes_time():
    assert explain(load("curl_4_3")).evaluation.seconds > 0.0


def test_the_formulation_and_why():
    assert explain(load("curl_4_3")).evaluation.formulation == "chained"
    two = explain(loads(held_scenes.TWO_CLAMPS))
    assert two.evaluation.formulation == "mixed"
    assert "a clamp at the end" in two.evaluation.why
    assert "[[path]]" in explain(loads(held_scenes.PATH)).evaluation.why
    placed = load("curl_4_3").replace({"model.tolerance": 1e-3, "model.elements": None, "model.grading": None})
    placed = explain(placed).evaluation
    assert (placed.formulation, "held at s = 0 only" in placed.why) == ("chained", True)
    requested = load("curl_4_3").replace({"model.formulation": "mixed"})
    assert explain(requested).evaluation.formulation == "mixed"
    assert explain(requested).evaluation.why == "asked for"


def test_the_heaviest_placed_strips_are_mixed_and_say_why():
    scene = load("cantilever").replace({"model.elements": None, "model.tolerance": 1e-2, "strip.gamma": 1e6})
    found = solver(scene)()
    assert (found.ok, found.problem.formulation) == (True, "mixed")
    assert "Gamma = 100000" in formulation_why(scene, found.problem.formulation)
    assert solver(scene.replace({"strip.gamma": 1e4}))().problem.formulation == "chained"


def test_held_by_constraints_is_counted():
    scene = loads(held_scenes.TWO_CLAMPS)
    rows = scene.replace({"model.held_by": "constraints"})
    assert explain(rows).evaluation.constraints == explain(scene).evaluation.constraints + 7
    assert explain(rows).evaluation.unknowns == explain(scene).evaluation.unknowns + 7
    effect = next(e for e in explain(rows).effects if e.key == "clamp at the start")
    assert effect.words == "7 constraints"


def test_a_tolerance_with_the_thesis_matrices_is_refused(capsys, tmp_path):
    scene = load("curl_4_3").replace({"model.tolerance": 1e-3, "model.elements": None, "model.grading": None})
    with pytest.raises(BadInput, match="tolerance"):
        explain(scene.replace({"model.formulation": "matrix"}))
    path = tmp_path / "scene.toml"
    path.write_text(scene.replace({"model.formulation": "matrix"}).to_toml())
    assert main(["solve", str(path), "--out", str(tmp_path / "o"), "--quiet"]) == BAD_INPUT
    assert "model.formulation" in capsys.readouterr().err


@pytest.mark.parametrize("case", CASES)
def test_the_command_prints_all_of_it(capsys, tmp_path, case):
    path = tmp_path / "scene.toml"
    path.write_text(CASES[case][0])
    assert main(["explain", str(path), "--wide", *([] if case == "two clamps" else ["--no-run"])]) == DONE
    out = capsys.readouterr().out
    assert "constraints and their Jacobian" in out
    for name in NAMES:
        assert name in out


# -- models from outside ----------------------------------------------------------------------------------------------


@pytest.fixture
def explained(tmp_path, capsys):
    """Explains the scene of an outside model: what the command says, and its result.json and page."""

    def run(energy, *arguments, code=DONE):
        with registered(tmp_path / "site", outside.Arc, outside.Thread):
            (tmp_path / "arc.toml").write_text(outside.SCENE.format(energy=energy))
            out = ["--out", str(tmp_path / "out")]
            assert main(["explain", str(tmp_path / "arc.toml"), *out, *arguments]) == code
        said = " ".join(capsys.readouterr().out.split())
        result = json.loads((tmp_path / "out" / "result.json").read_text())
        return said, result, read_page(tmp_path / "out")

    return run


def rows(table):
    return {record["effect"]: record for record in table.records()}


def test_a_model_from_outside_is_explained_with_its_effects_its_solve_and_its_moves(explained):
    said, result, page = explained("arc")
    effects, costs = page.tables
    assert [row[:2] for row in effects.rows] == [
        ("weight", True), ("natural curvature", True), ("being an arc", True), ("walls", False),
    ]  # fmt: skip
    found = rows(costs)
    assert set(found) == {"everything on", "weight", "natural curvature", "being an arc"}
    whole, bare = found["everything on"], found["natural curvature"]
    assert (whole["unknowns"], whole["constraints"], whole["evaluation"]) == (1, 2, pytest.approx(1e-5))
    assert (whole["status"], whole["iterations"], whole["seconds"]) == ("converged", 3, 0.125)
    assert (bare["unknowns"], bare["evaluation"], bare["evaluation_share"]) == (
        1,
        pytest.approx(2e-6),
        pytest.approx(0.2),
    )
    # surfaces: the arc's end stands 1 - cos 1 above the flat strip, and nothing is further away
    assert bare["moves"] == pytest.approx(1.0 - math.cos(1.0), abs=1e-6)
    assert found["being an arc"]["reason"].startswith("no switch")
    assert found["weight"]["status"] == "not solved"
    assert "strip.gamma is too light" in found["weight"]["reason"]
    assert result["explanation"]["model"] == "arc"
    assert result["explanation"]["formulation"] == "closed"
    assert result["without"]["natural curvature"]["moved"] == bare["moves"]
    assert (result["status"], result["discretisation_error"], result["energy"]["elastic"]) == ("converged", 1e-9, -0.5)
    assert "Arc: closed (nothing to solve); 1 unknowns, 0 with bounds, 2 constraints" in said
    assert (
        "begun at the natural shape" in said
    )  # the scene is planar: compare has a third opinion beside this model too
    assert "Shell: none" in said


def test_a_curve_from_outside_without_evaluations_moves_by_its_centreline(explained):
    said, result, page = explained("thread")
    found = rows(page.tables[1])
    assert set(found) == {"everything on", "weight", "natural curvature", "being an arc"}
    assert "unknowns" not in found["everything on"]
    end = math.hypot(1.0 - math.sin(1.0), 1.0 - math.cos(1.0))
    assert found["natural curvature"]["moves"] == pytest.approx(end, abs=1e-12)
    assert result["explanation"]["evaluation"] is None
    assert "Thread: 7 elements; it is an arc; discretisation error 1.0e-09 l, 125 ms warm." in said


def test_no_run_solves_nothing_and_a_refused_key_is_named(explained, tmp_path, capsys):
    _, result, page = explained("arc", "--no-run")
    assert result["status"] == "explained"
    assert result["without"] is None
    assert rows(page.tables[1])["natural curvature"]["moves"] is None
    with registered(tmp_path / "other", outside.Arc):
        path = tmp_path / "wall.toml"
        path.write_text(
            outside.SCENE.format(energy="arc") + "[[wall]]\npoint = [0.0, 0.0, -9.0]\nnormal = [0.0, 0.0, 1.0]\n"
        )
        assert main(["explain", str(path), "--quiet"]) == BAD_INPUT
    assert "wall" in capsys.readouterr().err


def test_the_scenes_own_model_is_explained():
    """The elastica where the scene chooses it, not the ribbon beside it; it is then its own third opinion."""
    found = explain(load("cantilever").replace({"model.energy": "elastica"}))
    assert found.model == "elastica"
    assert found.third_opinion == ""
    assert found.evaluation is None
    assert {e.key for e in found.effects if e.changes is not None} == {"weight"}
    assert explain(load("cantilever")).model == "ribbon"


def test_an_energy_is_chosen_once_and_within_the_budget(monkeypatch):
    made, seen = auto.choose, []

    def choose(*told):
        seen.append(spent())
        return made(*told)

    monkeypatch.setattr(auto, "choose", choose)
    open_energy = ["--set", "model.energy=auto", "--set", "model.accuracy=0.01", "--set", "shell.width_to_thickness=20"]
    assert main(["explain", "curl_4_3", *open_energy, "--set", "model.budget=60", "--no-run", "--quiet"]) == DONE
    assert main(["explain", "curl_4_3", *open_energy, "--set", "model.budget=60", "--run", "--quiet"]) == DONE
    keys = {"model.energy": "auto", "model.accuracy": 0.01, "shell.width_to_thickness": [20.0], "model.budget": 1e-9}
    explain(load("curl_4_3").replace(keys))
    assert seen == [False, False, True]


def test_what_a_choice_has_solved_is_not_solved_again():
    """Where it took long (`compare.models.timing.LONG`): told here by a first time that is made longer."""
    scene = load("cantilever").replace(
        {"strip.poisson": 0.0, "shell.width_to_thickness": [20.0], "model.energy": "auto", "model.accuracy": 0.01}
    )
    made = auto.choose

    def slow(*told):
        found = made(*told)
        solved = {name: (path, e, Seconds(LONG + 1.0)) for name, (path, e, _) in found.solved.items()}
        return replace(found, solved=solved)

    with pytest.MonkeyPatch.context() as patch:
        explain(scene)  # kernels are compiled
        patch.setattr(auto, "choose", slow)
        again = explain(scene).choice.solve(Options(error=True, repeats=None), None)
    fresh = explain(scene).choice.solve(Options(error=True, repeats=None), None)
    assert again.seconds.first == LONG + 1.0
    assert fresh.seconds.first < LONG
    assert again.energy.total == pytest.approx(fresh.energy.total, rel=1e-9)
    assert again.error == pytest.approx(fresh.error, rel=1e-3)
