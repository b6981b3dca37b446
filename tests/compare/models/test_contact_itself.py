"""[contact] of a scene: a strip folded between clamps until its sides meet, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from compare import registry
from compare.measure.grades import GOOD
from compare.models import model, solve
from compare.models.base import Options, check_keys
from compare.models.choice import no_third_opinion, shell_in_words, third_opinion
from compare.pages.result import state_result
from compare.pages.solve import rows
from compare.scene.scene import loads
from compare.studies.checks import of_state
from ribbonbench.errors import BadInput
from tests.reference.touching_fold import folds

FOLD = """
[strip]
length = 0.5
width = 0.025
poisson = 0.3
thickness = 0.01
[contact]
itself = true
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[clamp.end]
position = [0.0, 0.0, 0.08]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[seed]
curvature = [6.0, -6.0, 6.0]
[model]
energy = "sadowsky"
elements = 30
[[path]]
"clamp.end.position" = [0.0, 0.0, 0.3]
"""


def test_a_fold_whose_sides_meet():
    """0.16 of the length apart, 0.02 of it thick, by the scene's own path; thicker it stores more."""
    scene = loads(FOLD, "fold")
    state = solve(scene)
    (known,) = folds(np.array([0.16]), 0.02)
    assert state.ok
    data = state_result(scene, state)
    push = sum(float(np.linalg.norm(pair["force"])) for pair in data["contacts"])
    assert push == pytest.approx(known.push, rel=5e-3)
    assert data["energy"]["elastic"] == pytest.approx(known.energy, rel=1e-4)
    assert data["crossings"] == []
    assert {check.name: check.grade for check in of_state(scene, state)}["crossing"] == GOOD
    assert "2 pairs of places" in dict(rows(scene, state))["touches itself"]
    thicker = solve(scene.replace({"contact.distance": 0.011}))
    assert thicker.ok
    assert thicker.energy.total > state.energy.total + 1e-3


def test_what_is_refused():
    scene = loads(FOLD, "fold")
    assert scene.apart == pytest.approx(0.02)
    for changes, key in (
        ({"contact.distance": 0.3}, "contact.distance"),
        ({"contact.distance": 1e-6}, "contact.distance"),
        ({"strip.thickness": 1e-6}, "contact.distance"),
        ({"strip.thickness": None}, "contact.distance"),
    ):
        with pytest.raises(BadInput) as caught:
            scene.replace(changes)
        assert caught.value.key == key
    assert scene.nonplanar_reason() is None
    assert no_third_opinion(scene) == ""
    assert shell_in_words(scene).on
    rod = scene.replace({"contact.section": "round", "model.energy": "kirchhoff"})
    assert not shell_in_words(rod).on
    assert registry.model("shell").refusal(rod).key == "contact.section"
    check_keys(registry.model("shell"), scene)
    with pytest.raises(BadInput) as caught:
        registry.model("elastica").branch_start(lambda _: scene)
    assert caught.value.key == "contact.itself"


def test_the_elastica_as_a_second_opinion():
    """Alone and beside the ribbon: the same push as shooting, ribbon and elastica at one place."""
    scene = loads(FOLD, "fold")
    (known,) = folds(np.array([0.16]), 0.02)
    ribbon = solve(scene)
    alone = solve(scene.replace({"model.energy": "elastica", "model.elements": None}))
    beside = third_opinion(scene, registry.model("ribbon")).solve(scene, near=ribbon.shape)
    assert ribbon.shape is not None
    for state in (alone, beside):
        assert state.ok
        data = state_result(scene, state)
        (pair,) = data["contacts"]
        assert float(np.linalg.norm(pair["force"])) == pytest.approx(known.push, rel=1e-4)
        assert pair["s"] == pytest.approx(known.s, abs=1e-6)
        assert pair["gap"] == pytest.approx(0.02, abs=1e-9)
        assert data["penetration"] < 1e-6
        assert {check.name: check.grade for check in of_state(scene, state)}["balance"] == GOOD
    places = [[pair["s"], pair["s_other"]] for pair in state_result(scene, ribbon)["contacts"]]
    assert places == [pytest.approx([known.s, 1.0 - known.s], abs=2e-4)] * len(places)
    assert places
    s = np.linspace(0.0, 1.0, 51)
    assert np.abs(beside.shape.centreline(s) - ribbon.shape.centreline(s)).max() < 1e-4


def test_the_shell_as_a_second_opinion():
    """Begun at the ribbon's surface: the push of shooting within what a coarse mesh leaves open."""
    scene = loads(FOLD, "fold").replace(
        {"shell.width_to_thickness": [100], "shell.elements": [40, 1], "strip.poisson": 0.0}
    )
    (known,) = folds(np.array([0.16]), 0.02)
    ribbon = solve(scene)
    shell = registry.model("shell").solve(scene, near=ribbon.shape, options=Options(error=False))
    assert shell.ok
    push = np.linalg.norm(shell.supports.itself)
    assert push == pytest.approx(known.push, rel=0.1)
    np.testing.assert_allclose(ribbon.supports.itself, [0.0, 0.0, -known.push], atol=5e-3 * known.push)
    assert shell.energy.elastic == pytest.approx(known.energy, rel=2e-3)
    (pair, *_) = state_result(scene, shell)["contacts"]
    assert pair["gap"] == pytest.approx(0.02, abs=1e-9)
    s = np.linspace(0.0, 1.0, 51)
    assert np.abs(shell.shape.centreline(s) - ribbon.shape.centreline(s)).max() < 3e-3


TUBE = """
[strip]
length = 1.0
width = 0.05
poisson = 0.3
[clamp.start]
position = [0.0, -0.24456512383255039, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[[obstacle]]
kind = "cylinder"
point = [0.0, 0.0, 0.0]
radius = 0.24456512383255039
axis = [1.0, 0.0, 0.0]
inside = true
[seed]
curvature = -4.1
[model]
energy = "elastica"
"""


def test_a_coil_in_a_tube_by_the_elastica():
    """Its end as shooting has it (results/obstacles.md); the tube's push and moment balance the clamp."""
    scene = loads(TUBE, "tube")
    state = solve(scene)
    assert state.ok
    assert state.end.position[1:] == pytest.approx([0.12307397, -0.21134071], abs=3e-4)
    assert {check.name: check.grade for check in of_state(scene, state)}["balance"] == GOOD
    assert len(dict(rows(scene, state))["force of obstacle obstacle_0"]) > 0
    (wall,) = state_result(scene, state)["walls"]
    assert wall["contacts"][-1] == 1.0
    for away in ({"obstacle.0.axis": [0.6, 0.0, 0.8], "obstacle.0.radius": 0.3},
                 {"obstacle.0.kind": "sphere", "obstacle.0.axis": None, "obstacle.0.radius": 0.3}):  # fmt: skip
        with pytest.raises(BadInput) as caught:
            scene.replace(away)
        assert caught.value.key == "model.energy"
        assert "obstacle_0" in caught.value.problem


def test_a_round_rod_touches_itself_at_its_centreline():
    """In a plane a round rod and a strip of the same thickness lie on themselves alike, with one pair and not two."""
    changes = {"model.energy": "kirchhoff", "model.in_plane": False, "strip.poisson": 0.3, "strip.thickness": 0.01}
    strip = loads(FOLD, "fold").replace(changes)
    rod = strip.replace({"contact.section": "round"})
    assert rod.round_rod
    assert not strip.round_rod
    found = [solve(scene) for scene in (strip, rod)]
    assert all(state.ok for state in found)
    pushes = [
        [float(np.linalg.norm(pair["force"])) for pair in state_result(scene, state)["contacts"]]
        for scene, state in zip((strip, rod), found, strict=True)
    ]
    assert len(pushes[0]) == 2
    assert sum(pushes[1]) == pytest.approx(sum(pushes[0]), rel=2e-3)


def test_a_seed_through_itself_is_refused_as_a_seed():
    scene = loads(FOLD.partition("[clamp.end]")[0] + '[seed]\ncurvature = 14.0\n[model]\nenergy = "sadowsky"\n', "loop")
    with pytest.raises(BadInput, match="through itself") as caught:
        solve(scene)
    assert caught.value.key == "seed.curvature"
    with pytest.raises(BadInput, match="at rest") as caught:
        solve(scene.replace({"seed": None, "strip.natural_curvature": 14.0}))
    assert (caught.value.key, caught.value.value) == ("strip.natural_curvature", 14.0)
    assert solve(scene.replace({"seed.curvature": [4.0, 8.0]})).ok


def test_contact_with_itself_counts_among_the_effects():
    scene = loads(FOLD, "fold")
    on, off = ({e.key: e for e in model("ribbon").effects(one)} for one in (scene, scene.replace({"contact": None})))
    assert on["contact with itself"].on
    assert not off["contact with itself"].on
    assert scene.replace(on["contact with itself"].changes).apart is None
