"""What is left out and moves the strip nobody knows how far is said before what would move it most."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest

from compare.cli import main
from compare.measure.grades import FAIR, GOOD, UNKNOWN
from compare.models.base import Options
from compare.models.capabilities import Priced
from compare.models.choice import chosen
from compare.models.ribbon.neglected import beside
from compare.scene.scene import loads
from compare.store.progress import Reporter
from compare.studies import effects_measured
from compare.studies.checks import effects
from compare.studies.effects import explain
from compare.studies.priced.effects import PricedEffect, PricedEffects

#: A steel strip between two clamps, whose rulings are at their bound: first order of a stiffer section says nothing.
#: The energy is said: which one is chosen is another's affair (test_auto), and takes ten times as long here.
OWN = """
title = "Own"
[strip]
length = 0.5
width = 0.02
thickness = 1e-4
young = 2.1e11
poisson = 0.3
density = 7850.0
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[clamp.end]
position = [0.3, 0.05, 0.02]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, -1.0, 0.0]
[model]
energy = "wunderlich"
"""


def test_what_is_not_known_is_said_first(tmp_path, capsys, monkeypatch):
    # its own solve takes about half a second: whether others are made unasked is the machine's affair
    monkeypatch.setattr(effects_measured, "CHEAP", 0.0)
    (tmp_path / "own.toml").write_text(OWN)
    assert main(["explain", str(tmp_path / "own.toml"), "--out", str(tmp_path / "o")]) == 0
    first = " ".join(capsys.readouterr().out.partition("what each effect is worth")[0].split())
    result = json.loads((tmp_path / "o" / "result.json").read_text())
    rows, checks = result["prices"], {check["name"]: check["grade"] for check in result["answer"]["checks"]}
    assert checks.pop("effects") == UNKNOWN
    assert set(checks.values()) == {GOOD}
    assert result["answer"]["grade"] == UNKNOWN
    unknown = {
        row["effect"] for row in rows if not row["on"] and row["moves"] is None and row["energy_share"] is not None
    }
    assert "section between soft and stiff" in unknown
    known, _, most = first.partition("is not known")
    assert all(name in known for name in unknown)
    assert not any(name in most.partition("would move it most")[0] for name in unknown)


def test_a_solve_that_nobody_asked_for_has_an_end(monkeypatch):
    """The scene's own solve takes what it takes; that without an effect, which has no time, tells nothing."""
    scene = loads(OWN)
    found = explain(scene)
    found = replace(found, effects=tuple(effect for effect in found.effects if effect.key == "gravity"))
    monkeypatch.setattr(effects_measured, "CHEAP", math.inf)
    monkeypatch.setattr(effects_measured, "TIMES", 0.0)
    moved = []
    for least in (1e-6, 1e3):
        monkeypatch.setattr(effects_measured, "LEAST", least)
        made = effects_measured.solves(scene, found, Reporter(quiet=True))
        assert made.state.ok
        moved.append(made.without["gravity"].moved)
    assert moved[0] is None
    assert moved[1] > 0.1


@pytest.mark.parametrize(
    ("row", "grade"),
    [
        (PricedEffect(Priced("shear", False, 1e-4, 1e-6), 1.1e-4), GOOD),  # first order and whole solves agree
        (PricedEffect(Priced("shear", False, 1e-4, 1e-6), 0.3), FAIR),  # solved anew it ends elsewhere
        (PricedEffect(Priced("shear", False, 1e-4, doubtful=True), 0.03), GOOD),
        (
            PricedEffect(Priced("shear", False, 1e-4, doubtful=True), 0.3),
            FAIR,
        ),  # far, and nothing says how it got there
        (
            PricedEffect(Priced("weight", True, 1e-4, doubtful=True), 0.3),
            GOOD,
        ),  # what is on is in the state that is shown
        (PricedEffect(Priced("shear", False, 1e-4, doubtful=True)), UNKNOWN),
    ],
)
def test_a_move_is_known_or_it_is_not(row, grade):
    known = PricedEffect(Priced("width", True, 1e-3, 1e-6))
    assert effects(PricedEffects((known, row)), 1e-5).grade == grade
    assert effects(PricedEffects((known, row), "no tangent"), 1e-5).grade == UNKNOWN


CURL = """
title = "A heavy curl on a table that lies on itself"
[strip]
length = 0.40
width = 0.02
thickness = 1e-4
poisson = 0.38
young = 3.2e9
density = 1380.0
natural_curvature = 25.0
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, -1.0]
[[wall]]
name = "table"
point = [0.0, 0.0, -0.0001]
normal = [0.0, 0.0, 1.0]
[contact]
itself = true
distance = 0.002
[model]
energy = "wunderlich"
elements = 20
[[path]]
"strip.natural_curvature" = 5.0
"""


def test_a_curl_that_goes_through_itself_at_rest_has_its_strip_of_finite_thickness() -> None:
    """At rest it is a coil whose turns lie in one another: only the state's own shape can begin the other strip."""
    scene = loads(CURL)
    state = chosen(scene).solve(scene, options=Options(error=False))
    found = beside(scene, state.native)
    assert found is not None
    assert found.problem.energy == "finite"
