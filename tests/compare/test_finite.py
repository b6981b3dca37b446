"""No number that is not finite leaves a command without a name: result.json, CSV, page.json, the terminal."""

from __future__ import annotations

import csv
import json
import math
import re

import numpy as np
import pytest

from compare.cli import DONE, NOT_CONVERGED, main
from compare.page.table import Column, Table
from compare.page.wording import energies, force, length, moment, place
from compare.scene.scene import loads
from compare.scene.units import Units, quantity, reading
from compare.store.finite import explained
from tests.compare.scene.held_scenes import STEEL

HELD = "tangent = [0.0, 0.0, 1.0]\nnormal = [0.0, 1.0, 0.0]\n"
START = f"[clamp.start]\n{HELD}"
WEIGHT = "[gravity]\nup = [0.0, 1.0, 0.0]\n"
ELEMENTS = "[model]\nelements = 8\n"
STRIP = "[strip]\nlength = 1.0\nwidth = 0.05\npoisson = 0.3\n"
TAPE = "[strip]\nlength = 0.5\nwidth = 0.02\nthickness = 1e-4\nyoung = 2e11\ndensity = 7850.0\npoisson = 0.3\n"


def end(z: float, held: str = HELD) -> str:
    return f"[clamp.end]\nposition = [0.0, 0.0, {z!r}]\n{held}"


def wall(z: float) -> str:
    return f"[[wall]]\npoint = [0.0, 0.0, {z}]\nnormal = [0.0, 0.0, -1.0]\n"


HEAVY = f"{STRIP}gamma = 1000.0\n{WEIGHT}"
#: Name -> scene and status.
SCENES = {
    "taut": (f"{HEAVY}{START}{end(1.0)}{ELEMENTS}", "converged"),
    "taut without weight": (f"{STRIP}{START}{end(1.0)}{ELEMENTS}", "converged"),
    "tape between two holders": (f"{TAPE}{WEIGHT}{START}{end(0.5)}{ELEMENTS}", "converged"),
    "taut between pins": (f"{HEAVY}[clamp.start]\n{end(1.0, '')}{ELEMENTS}", "converged"),
    "taut on a floor": (
        f"{HEAVY}{START}{end(1.0)}[[wall]]\npoint = [0.0, 0.0, 0.0]\nnormal = [0.0, 1.0, 0.0]\n{ELEMENTS}", "converged",
    ),
    "taut, finite": (
        f'{STRIP}thickness = 1e-3\ngamma = 10.0\n{WEIGHT}{START}{end(1.0)}{ELEMENTS}energy = "finite"\n', "converged",
    ),
    "taut, a tolerance": (f"{HEAVY}{START}{end(1.0)}[model]\ntolerance = 1e-3\n", "converged"),
    "a path to the full length": (
        f'{HEAVY}{START}{end(1.0)}{ELEMENTS}[[path]]\n"clamp.end.position" = [0.0, 0.0, 0.9]\n', "converged",
    ),
    "slack of 1e-9": (f"{HEAVY}{START}{end(1.0 - 1e-9)}{ELEMENTS}", "converged"),
    "slack of 1e-14": (f"{HEAVY}{START}{end(1.0 - 1e-14)}{ELEMENTS}", "not_converged"),
    "one element": (f"{HEAVY}{START}{end(0.8)}[model]\nelements = 1\n", "infeasible"),
    "straight": (f"{STRIP}{START}{ELEMENTS}", "converged"),
    "unheld": (f"{STRIP}{ELEMENTS}", "converged"),
    "head on": (f"{STRIP}{START}{wall(0.99)}{ELEMENTS}", "converged"),
}  # fmt: skip

#: Keys of result.json that a scene need not have: null is then no number that is missing.
ABSENT = {
    "D", "width_to_thickness", "si", "minima", "tolerance_error", "max_abs_eta", "max_abs_eta_prime_w_half", "up",
    "height", "order", "taut_tension", "taut_sag", "lowest_eigenvalue_limit", "branch", "left_saddle", "rival",
}  # fmt: skip
#: Of lists of states along a way and on other elements: nothing before the first one, nothing judged.
OF_STEPS = {"distance", "lowest_eigenvalue"}
WORD = re.compile(r"\b(?:nan|inf|infinity)\b", re.IGNORECASE)


def unexplained(value, free_end: bool, at: tuple[str, ...] = ()):
    """The dotted keys of nulls beside which no KEY_why stands."""
    if isinstance(value, list):
        for part in value:
            if part is None:
                yield ".".join(at)
            yield from unexplained(part, free_end, at)
    if not isinstance(value, dict):
        return
    for key, part in value.items():
        told = value.get(f"{key}_why") or (key in ("value", "bound") and value.get("said"))
        if told or (key.endswith("_error") and value.get("errors_why")):
            continue
        of_step = at[:1] in (("refinements",), ("path",)) and key in OF_STEPS
        of_no_end = free_end and key == "end" and at[-1:] in (("forces",), ("moments",))
        if part is None and key not in ABSENT and not of_step and not of_no_end:
            yield ".".join((*at, key))
        yield from unexplained(part, free_end, (*at, key))


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("command", ["solve", "limits"])
def test_everything_that_is_told_is_a_number_or_has_a_reason(name, command, tmp_path, capsys):
    scene, status = SCENES[name]
    if command == "limits" and ("clamp.start" not in scene or "wall" in scene or "[clamp.start]\n[" in scene):
        pytest.skip("no shell stands beside it")
    file = tmp_path / "scene.toml"
    file.write_text(scene)
    more = ["--quick", "--set", "shell.width_to_thickness=[100]"] if command == "limits" else []
    if "thickness" in scene:
        more = more[:1]
    code = main([command, str(file), *more, "--out", str(tmp_path / "o")])
    said = capsys.readouterr()
    assert code in (DONE, NOT_CONVERGED), said.err
    assert not WORD.findall(said.out + said.err)
    for written in sorted((tmp_path / "o").rglob("*")):
        if written.suffix in (".json", ".csv", ".md"):
            assert not WORD.findall(written.read_text()), written.name
    result = json.loads((tmp_path / "o" / "result.json").read_text())
    assert result["status"] == status
    if status != "converged":
        assert result["answer"]["grade"] == "poor" or command == "limits"
        return
    told = {key: value for key, value in result.items() if key not in ("provenance", "units", "si", "hits", "rows")}
    assert list(unexplained(told, "[clamp.end]" not in scene)) == []
    for row in csv.DictReader((tmp_path / "o" / "centreline.csv").open()) if command == "solve" else ():
        assert all(math.isfinite(float(cell)) for cell in row.values() if cell)
    undetermined = result.get("forces_why") is not None
    assert undetermined == ("taut" in name or "holders" in name or "full length" in name)
    if undetermined and command == "solve":
        assert result["forces"]["start"] is result["forces"]["end"] is None
        assert result["answer"]["grade"] != "good"


def test_json_of_a_tape_between_two_holders(tmp_path, capsys):
    """In SI, with the tension and the sag of the strip that stretches."""
    file = tmp_path / "tape.toml"
    file.write_text(SCENES["tape between two holders"][0])
    assert main(["solve", str(file), "--json", "--quiet", "--out", str(tmp_path / "o")]) == DONE
    told = json.loads(capsys.readouterr().out)
    assert told["forces"] == {"start": None, "end": None, "walls": []}
    stiffness = 2e11 * 1e-12 / (12.0 * 0.91) * 0.02
    assert told["si"]["taut_tension"] == pytest.approx(told["taut_tension"] * stiffness / 0.25, rel=1e-12)
    assert told["si"]["taut_sag"] == pytest.approx(0.5 * told["taut_sag"], rel=1e-12)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_words_of_a_number_that_is_none(value):
    units = loads(STEEL).units
    plain = Units()
    for each in (units, plain):
        told = [each.text(value, unit) for unit in ("l", "1/l", "D w / l^2", "D w / l", "moment", "s")]
        told += [length(each, value), energies({"elastic": value}, each)]
        told += [of(np.array([0.0, value, 1.0]), each) for of in (force, moment, place)]
        assert not WORD.findall(" ".join(told))
    assert reading(value, "N") == (1.0, "N")
    assert quantity(value, "J") == "not known"
    assert reading(-2e-3, "m") == (1e3, "mm")


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_table_and_a_result_without_it(value):
    table = Table("t", (Column("a", "a", kind="digits"), Column("b", "b")), ((value, (1.0, value)),))
    assert table.rows == ((None, (1.0, None)),)
    found = explained({"x": value, "y": [1.0, value], "z": {"w": value, "w_why": "of itself"}, "v": None, "u": 2.0})
    assert found == {
        "x": None, "x_why": "not a finite number", "y": [1.0, None], "y_why": "not a finite number",
        "z": {"w": None, "w_why": "of itself"}, "v": None, "u": 2.0,
    }  # fmt: skip
