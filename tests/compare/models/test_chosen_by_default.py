"""A scene that names no energy gets the cheapest that is near enough; without a thickness it hears which would do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compare.measure.grades import UNKNOWN
from compare.models import solve
from compare.models.base import Status as StateStatus
from compare.models.ribbon import auto
from compare.pages.solve import answer
from compare.scene.scene import Scene, loads
from compare.scene.spec import USUAL_ACCURACY
from compare.studies.checks import model
from compare.studies.thickness import THICKEST, enough_from, leaves_open, with_thickness
from ribbon import Status
from ribbonbench.errors import BadInput

#: A curled strip whose curl lies across the weight, so that it twists.
TEXT = """
[strip]
length = 1.0
width = {width}
poisson = 0.4
gamma = 20.0
natural_curvature = 5.0
{more}
[gravity]
up = [0.0, 1.0, 0.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [0.6, 0.8, 0.0]
[model]
elements = 24
"""

#: A strip whose further end was drawn over a blade, ever harder; no energy is named.
CURLED = """
[strip]
length = 0.30
width = 0.009
thickness = 9e-5
poisson = 0.35
young = 4.0e9
density = 1400.0
natural_curvature = [[0.0, 0.0], [0.15, 0.0], [0.18, 40.0], [0.30, 80.0]]
[gravity]
up = [0.0, 1.0, 0.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
"""


def strip(thickness: float | None = None, width: float = 0.05) -> Scene:
    return loads(TEXT.format(width=width, more="" if thickness is None else f"thickness = {thickness}"))


@pytest.mark.parametrize(("thickness", "energy"), [(5e-5, "sadowsky"), (2e-3, "finite")])
def test_it_is_the_choice_for_the_usual_accuracy(thickness, energy):
    scene = strip(thickness)
    state = solve(scene)
    assert (scene.model.accuracy, "model.accuracy" in scene.own_keys) == (USUAL_ACCURACY, False)
    assert state.native.problem.energy == energy
    said = solve(scene.replace({"model.energy": "auto", "model.accuracy": USUAL_ACCURACY}))
    assert said.energy == state.energy
    named = solve(scene.replace({"model.energy": energy}))
    assert named.energy.total == pytest.approx(state.energy.total, rel=1e-9)
    assert "auto" not in named.numbers


def test_the_first_line_names_what_ran_and_how_near_it_is():
    scene = strip(5e-5)
    state = solve(scene)
    choice = state.numbers["auto"]
    line = answer(scene, state).line
    (estimate,) = (step["estimate"] for step in choice["steps"] if step["model"] == choice["chosen"])
    assert f"Sadowsky's strip is enough, {100 * estimate:.2g} % of the length from the shell" in line
    assert f"finite thickness would move it by {100 * choice['skipped']['thickness']:.2g} %" in line


@pytest.mark.parametrize(
    "keys",
    [
        {"model.energy": "wunderlich"},
        {"model.formulation": "matrix"},
        {"model.energy": "kirchhoff", "strip.natural_twist": 1.0},
        {"strip.natural_curvature": 150.0},
        {"model.energy": "finite", "model.in_plane": False},
    ],
)
def test_what_names_its_energy_or_leaves_no_choice_keeps_it(keys):
    scene = strip(2e-3).replace(keys)
    assert scene.model.accuracy is None


def test_where_nothing_tells_of_the_others_the_exact_width_answers(monkeypatch):
    found = auto.reference

    def lost(*told):
        return replace(found(*told), status=Status.NOT_CONVERGED, stable=None)

    monkeypatch.setattr(auto, "reference", lost)
    scene = strip(2e-3)
    state = solve(scene)
    assert state.ok
    assert state.native.problem.energy == "wunderlich"
    assert not state.numbers["auto"]["enough"]
    assert model(state).grade == UNKNOWN
    asked = scene.replace({"model.accuracy": USUAL_ACCURACY})
    assert auto.choose(asked).energy == "finite"  # who asks for an accuracy is not answered by less


def test_what_the_richest_energy_cannot_have_is_answered_all_the_same(monkeypatch):
    from ribbon import RibbonInputError

    thin = strip(1e-9, width=0.3).replace({"strip.natural_curvature": 150.0})  # v of the section's law is out of reach
    assert auto.refusal(auto.with_energy(thin, "finite")) is not None
    assert solve(thin).native.problem.energy == "wunderlich"

    def refused(*told):
        raise RibbonInputError("closure", None, "no")

    monkeypatch.setattr(auto, "reference", refused)
    assert solve(strip(2e-3)).native.problem.energy == "wunderlich"
    with pytest.raises(BadInput):
        solve(strip(2e-3).replace({"model.energy": "auto", "model.accuracy": USUAL_ACCURACY / 2}))


def test_without_a_thickness_the_answer_says_which_would_do():
    scene = strip()
    state = with_thickness(scene, solve(scene))
    ratio = state.numbers["thickness"]["enough_from"]
    assert state.native.problem.energy == "wunderlich"
    assert THICKEST < ratio < 1e4
    for factor, enough in ((1.3, True), (0.7, False)):  # the choice's own estimates agree
        steps = auto.choose(strip(scene.width / (factor * ratio))).steps
        (estimate,) = [step.estimate for step in steps if step.model == "wunderlich"] or [0.0]
        assert (estimate <= USUAL_ACCURACY) is enough
    assert leaves_open(scene)
    assert not leaves_open(strip(1e-3))
    assert not leaves_open(scene.replace({"model.energy": "wunderlich"}))


def test_nothing_is_said_of_what_is_no_stable_state():
    scene = strip()
    state = replace(solve(scene), status=StateStatus.NOT_CONVERGED)
    assert enough_from(scene, state) == (None, "it is no stable state")
    assert "thickness" not in with_thickness(scene, state).numbers


def test_an_energy_that_is_named_leaves_nothing_to_choose():
    """`--set model.energy=...` on a scene that says an accuracy, as `ribbonbench new` writes it."""
    chosen = strip(2e-3).replace({"model.accuracy": 1e-3})
    assert "model.accuracy" in chosen.own_keys
    named = chosen.replace({"model.energy": "wunderlich"})
    assert named.model.accuracy is None
    assert named.model.energy == "wunderlich"
    assert chosen.replace({"model.energy": "auto"}).model.accuracy == 1e-3
    both = chosen.replace({"model.energy": "wunderlich", "model.accuracy": 1e-3})
    with pytest.raises(BadInput):
        solve(both)


def test_an_energy_that_is_a_saddle_on_finer_segments_is_passed_over():
    """A curl that grows towards the free end, hung from its clamp: Sadowsky's strip is a saddle on many segments
    (lowest eigenvalue -0.34), Wunderlich's, as near to a shell, is stable in the limit (0.012)."""
    scene = loads(CURLED)
    state = solve(scene)
    tried = {step["model"]: step for step in state.numbers["auto"]["steps"]}
    assert tried["elastica"]["passed_over"]
    assert tried["elastica"]["estimate"] < scene.model.accuracy
    assert state.native.problem.energy == "wunderlich"
    assert state.stable is True
    assert state.lowest_eigenvalue > 0.0
    planar = solve(scene.replace({"model.energy": "elastica"}))
    assert np.abs(planar.shape.centreline([0.5, 1.0]) - state.shape.centreline([0.5, 1.0])).max() < 1e-4
