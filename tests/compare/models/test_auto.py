"""The choice of an energy by `model.accuracy`: scenes that end on each rung of the ladder, and what the steps say."""

from __future__ import annotations

import pytest

from compare.measure.distance import grid_hausdorff
from compare.measure.grid import Grid
from compare.models import solve
from compare.models.base import Status
from compare.models.ribbon.auto import choose, chosen
from compare.models.ribbon.model import RibbonModel
from compare.models.ribbon.neglected import beyond
from compare.scene.scene import Scene, load
from compare.studies.limits import with_clamp
from ribbonbench.errors import BadInput

ACCURACY = 1e-2


def planar() -> Scene:
    return load("cantilever").replace({"strip.poisson": 0.0, "shell.width_to_thickness": [20.0]})


def held(width: float, gamma: float) -> Scene:
    keys = {"strip.poisson": 0.0, "strip.width": width, "strip.gamma": gamma}
    return with_clamp(load("limits_7_3"), "edge").replace(keys)


def narrow() -> Scene:
    return with_clamp(load("limits_7_3"), "edge").replace(
        {"strip.poisson": 0.0, "strip.width": 0.05, "strip.gamma": 10.0}
    )


def wide() -> Scene:
    return with_clamp(load("limits_7_3"), "edge").replace(
        {"strip.poisson": 0.0, "strip.width": 0.2, "strip.gamma": 10.0}
    )


def curl() -> Scene:
    return load("curl_4_3").replace({"shell.width_to_thickness": [20.0]})


def corners() -> Scene:
    return with_clamp(load("limits_7_3"), "corners").replace({"strip.width": 0.3, "strip.gamma": 100.0})


def asked(scene: Scene, accuracy: float = ACCURACY) -> Scene:
    return scene.replace({"model.energy": "auto", "model.accuracy": accuracy})


@pytest.mark.parametrize(
    ("scene", "ends", "tried"),
    [
        (planar, "elastica", ["elastica"]),
        (narrow, "sadowsky", ["sadowsky"]),
        (wide, "wunderlich", ["sadowsky", "wunderlich"]),
        (curl, "finite", ["sadowsky", "wunderlich", "finite"]),
        (corners, "shell", ["sadowsky", "finite"]),
    ],
)
def test_the_ladder_ends_at_the_first_rung_that_is_near_enough(scene, ends, tried):
    name, steps = chosen(scene(), ACCURACY)
    assert name == ends
    assert [step["model"] for step in steps] == tried
    estimates = [step["estimate"] for step in steps]
    assert all(estimate > ACCURACY for estimate in estimates[:-1])
    assert (estimates[-1] <= ACCURACY) == (ends != "shell")


def test_the_answer_is_that_of_the_chosen_energy():
    for scene, energy in ((wide(), "wunderlich"), (curl(), "finite")):
        state = solve(asked(scene))
        alone = solve(scene.replace({"model.energy": energy}))
        assert state.status is Status.CONVERGED
        assert state.native.problem.energy == energy
        assert state.numbers["auto"]["chosen"] == energy
        assert state.numbers["auto"]["enough"] is True
        grid = Grid.for_shape(scene, state.shape.bend)
        assert grid_hausdorff(grid.of(state.shape), grid.of(alone.shape)) < 1e-9


def test_estimates_are_the_distance_to_finite_and_what_that_leaves_out():
    choice = choose(asked(wide()))
    moved = choice.skipped["thickness"]
    rest = sum(value for name, value in choice.skipped.items() if name != "thickness")
    assert choice.steps[-1].estimate == pytest.approx(moved + rest, rel=1e-12)
    assert choice.solved["wunderlich"][1].ok
    assert "finite" not in choice.solved


def test_what_is_left_out_vanishes_where_nothing_is():
    """Without Poisson's effect a strip that only bends is exact: its section stays straight, and nothing twists it."""
    scene = planar().replace({"model.energy": "finite"})
    state = solve(scene)
    parts = beyond(scene, state.native).parts
    assert set(parts) == {"along", "odd", "between", "clamp", "in_plane", "fold", "section"}
    assert max(parts.values()) < 1e-6


def test_a_tighter_accuracy_never_takes_a_cheaper_model():
    order = ["elastica", "sadowsky", "wunderlich", "finite", "shell"]
    places = [order.index(chosen(wide(), accuracy)[0]) for accuracy in (5e-2, 1e-2, 1e-5)]
    assert places == sorted(places)
    assert places[0] < places[-1] == len(order) - 1


def test_explain_names_what_was_left_out():
    effects = {effect.key: effect for effect in RibbonModel().effects(asked(narrow()))}
    left_out = [name for name, effect in effects.items() if "estimated" in effect.why]
    assert len(left_out) == 8
    assert not any(effects[name].on for name in left_out)


@pytest.mark.parametrize(
    ("keys", "key"),
    [
        ({"model.energy": "auto", "strip.thickness": None, "shell.width_to_thickness": None}, "strip.thickness"),
        ({"model.energy": "wunderlich"}, "model.accuracy"),
        ({"model.energy": "finite"}, "model.accuracy"),
        ({"model.energy": "auto", "shell.width_to_thickness": [20.0, 50.0]}, "shell.width_to_thickness"),
        ({"model.energy": "auto", "model.formulation": "matrix"}, "model.formulation"),
    ],
)
def test_an_accuracy_that_cannot_choose_is_refused(keys, key):
    scene = curl().replace({"model.accuracy": ACCURACY, **keys})
    refused = RibbonModel().refusal(scene)
    assert refused is not None
    assert refused.key == key


@pytest.mark.parametrize("accuracy", [0.0, -1e-3, 0.1, 1.0])
def test_an_accuracy_out_of_range_is_refused(accuracy):
    with pytest.raises(BadInput) as refused:
        asked(curl(), accuracy)
    assert refused.value.key == "model.accuracy"


def test_without_an_accuracy_auto_is_wunderlich():
    state = solve(curl().replace({"model.energy": "auto"}))
    assert state.native.problem.energy == "wunderlich"
    assert "auto" not in state.numbers
