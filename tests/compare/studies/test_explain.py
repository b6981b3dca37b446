"""`ribbonbench explain`: what a scene switches on, what that adds, and that what is off is not there."""

from __future__ import annotations

import pytest

from compare.cli import BAD_INPUT, DONE, main
from compare.errors import BadInput
from compare.models.ribbon_build import ribbon_arguments, ribbon_problem
from compare.scene.scene import load, loads
from compare.studies import effects
from compare.studies.effects import explain, explained_problem
from ribbon import solve
from tests.compare.scene import held_scenes

NAMES = {
    "gravity", "gravity over the surface", "natural curvature", "finite width (Wunderlich)", "rulings do not cross",
    "clamp at the start", "clamp at the end", "straight rulings", "closure", "rigid motions removed", "contact",
    "pressure plates", "adaptive segments", "continuation path", "stretching and shear",
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
    assert {effect.name for effect in found.effects} == NAMES
    assert {effect.name for effect in found.effects if effect.on} == on | ALWAYS
    assert all(effect.why and effect.adds for effect in found.effects)
    assert all(effect.seconds is None for effect in found.effects if not effect.on)


@pytest.mark.parametrize("case", CASES)
def test_what_is_off_adds_no_row_and_no_unknown(case):
    """The counts of the problem are those of what is on, one by one."""
    text, on = CASES[case]
    scene = loads(text)
    problem = explained_problem(scene)
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
        rows += 2 * (p + 1)
    assert found.constraints == 8 * p + rows
    held = 7 if "clamp at the start" in on or "rigid motions removed" in on else 0
    held += 2 if "straight rulings" in on else 0
    assert found.unknowns == problem.size - held
    assert found.bounds == p


def test_off_is_not_computed():
    """Weightless and chained: no series in a whole solve; weightless and glued: no energy of weight, no plate."""
    weightless = load("curl_4_3").replace({"strip.gamma": 0.0})
    e = solve(**ribbon_arguments(weightless))
    assert e.ok
    assert e.problem.formulation == "chained"
    assert e.evaluations["series"] == 0
    assert solve(**ribbon_arguments(load("curl_4_3"))).evaluations["series"] > 0
    glued = ribbon_problem(loads(held_scenes.CIRCLE))
    assert not glued.has_gravity
    assert not glued.has_natural_curvature
    assert glued.plates == ()


def test_costs_are_measured_where_an_effect_can_be_off_alone(monkeypatch):
    """By a clock that stands still but for an evaluation: 1 s, 4 s with gravity, 7 s with that of the surface."""
    now = [0.0]

    def evaluate(problem, x, rows):
        now[0] += 1.0 + 3.0 * problem.has_gravity + 3.0 * (problem.has_gravity and problem.gravity.exact)

    monkeypatch.setattr(effects, "_evaluate", evaluate)
    monkeypatch.setattr(effects.time, "perf_counter", lambda: now[0])

    def costs(text):
        found = explain(loads(text))
        return {effect.name: effect.seconds for effect in found.effects}, found.evaluation

    spared, whole = costs(CASES["exact weight"][0])
    assert whole == 7.0
    assert {name: spared[name] for name in ("gravity", "gravity over the surface")} == {
        "gravity": 6.0, "gravity over the surface": 3.0,
    }  # fmt: skip
    assert spared["clamp at the end"] == spared["finite width (Wunderlich)"] == 0.0
    assert costs(held_scenes.CIRCLE)[0]["closure"] is None
    assert costs(CASES["plate"][0])[0]["pressure plates"] is not None


def test_an_evaluation_takes_time():
    assert explain(load("curl_4_3")).evaluation > 0.0


def test_the_formulation_and_why():
    assert explain(load("curl_4_3")).formulation == "chained"
    two = explain(loads(held_scenes.TWO_CLAMPS))
    assert two.formulation == "mixed"
    assert "a clamp at the end" in two.formulation_why
    assert "[[path]]" in explain(loads(held_scenes.PATH)).formulation_why
    assert "error estimate" in explain(loads(CASES["tolerance"][0])).formulation_why
    asked = load("curl_4_3").replace({"model.formulation": "mixed"})
    assert explain(asked).formulation == "mixed"
    assert explain(asked).formulation_why == "asked for"


def test_held_by_constraints_is_counted():
    scene = loads(held_scenes.TWO_CLAMPS)
    rows = scene.replace({"model.held_by": "constraints"})
    assert explain(rows).constraints == explain(scene).constraints + 7
    assert explain(rows).unknowns == explain(scene).unknowns + 7
    effect = next(e for e in explain(rows).effects if e.name == "clamp at the start")
    assert effect.adds == "7 constraints"


def test_a_tolerance_with_the_chained_model_is_refused(capsys, tmp_path):
    scene = load("curl_4_3").replace({"model.tolerance": 1e-3, "model.elements": None, "model.grading": None})
    with pytest.raises(BadInput, match="tolerance"):
        explain(scene.replace({"model.formulation": "chained"}))
    path = tmp_path / "scene.toml"
    path.write_text(scene.replace({"model.formulation": "chained"}).to_toml())
    assert main(["solve", str(path), "--out", str(tmp_path / "o"), "--quiet"]) == BAD_INPUT
    assert "model.formulation" in capsys.readouterr().err


@pytest.mark.parametrize("case", CASES)
def test_the_command_prints_all_of_it(capsys, tmp_path, case):
    path = tmp_path / "scene.toml"
    path.write_text(CASES[case][0])
    assert main(["explain", str(path), *([] if case == "two clamps" else ["--no-run"])]) == DONE
    out = capsys.readouterr().out
    assert "constraints and their Jacobian" in out
    for name in NAMES:
        assert name in out
