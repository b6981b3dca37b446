"""Friction in scenes: what is read and refused, what result.json holds, the judge, a run that goes on from its file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compare.measure.friction import missed
from compare.models import model
from compare.models.base import Options, Status, check_keys
from compare.models.quantities import walls_of
from compare.models.ribbon import stages
from compare.scene.scene import Scene, loads
from compare.studies import checks
from ribbonbench.errors import BadInput

SCENE = """
[strip]
length = 2.0
width = 0.05
poisson = 0.3
[clamp.start]
position = [0.0, 0.7, 0.0]
tangent = [0.0, -0.5, 0.8660254037844386]
normal = [0.0, 0.8660254037844386, 0.5]
[[wall]]
name = "floor"
point = [0.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
friction = 0.3
[model]
energy = "sadowsky"
elements = 8
[seed]
curvature = -0.3
[[path]]
"clamp.start.position" = [0.0, 0.9, 0.0]
[[path]]
"clamp.start.position" = [0.0, 0.7, 0.0]
steps = 2
"""


def _scene(text: str = SCENE) -> Scene:
    return loads(text, "friction")


def test_a_path_with_friction_is_solved_and_judged() -> None:
    """The end slides: friction is mu N against the slip; supports with it are in balance by code of its own, and a
    friction that is not so is told."""
    scene = _scene()
    state = model("ribbon").solve(scene, options=Options(error=True))
    assert state.ok
    (wall,) = walls_of(state)
    assert state.errors["lines"]
    assert walls_of(replace(state, status=Status.NOT_CONVERGED)) == []  # errors of finer elements, and no forces
    assert np.linalg.norm(wall["friction"]) == pytest.approx(0.3 * np.linalg.norm(wall["force"]), rel=1e-6)
    assert wall["friction"][2] < 0.0
    assert {rub["state"] for rub in wall["rubs"]} == {"slips"}
    assert 0.0 < wall["friction_error"] < 1e-2
    normals = np.tile([0.0, 1.0, 0.0], (len(wall["rubs"]), 1))
    assert missed(wall["rubs"], 0.3, normals).most < 1e-6
    assert checks.balance(scene, state).value == pytest.approx(0.0, abs=1e-6)
    assert checks.walls(scene, state).grade == "good"
    rougher = scene.replace({"wall.floor.friction": 0.2})  # the same friction beside another coefficient is beyond it
    assert checks.walls(rougher, state).grade == "poor"
    log = [entry for entry in state.log if entry["accepted"]]
    lost = [entry["friction"]["lost"] for entry in log if "friction" in entry]
    assert lost == sorted(lost)
    assert state.native.rubbed == lost[-1] > 0.0


def test_an_interrupted_path_goes_on_with_its_history(tmp_path: Path) -> None:
    """What is kept holds what rubbed and what was lost: the end is the same."""
    scene = _scene()
    whole = stages.run_way(scene).equilibrium

    class Stop(Exception):
        pass

    def stop(entry: dict[str, object]) -> None:
        if entry["stage"] == 2:
            raise Stop

    with pytest.raises(Stop):
        stages.run_way(scene, tmp_path, on_step=stop)
    again = stages.run_way(scene, tmp_path)
    assert again.resumed
    assert again.equilibrium.rubbed == pytest.approx(whole.rubbed, rel=1e-6)
    np.testing.assert_allclose(again.equilibrium.x, whole.x, atol=1e-8)


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ('[[path]]\n"clamp.start.position" = [0.0, 0.9, 0.0]\n[[path]]\n"clamp.start.position" = [0.0, 0.7, 0.0]\n'
         "steps = 2\n", "", "wall.floor.friction"),
        ("elements = 8", "tolerance = 1e-3", "model.tolerance"),
        ("friction = 0.3", "friction = -0.3", "friction"),
        ("[seed]", "[contact]\nitself = true\ndistance = 0.01\n[seed]", "wall.floor.friction"),
    ],
)  # fmt: skip
def test_what_is_refused_with_the_reason(old: str, new: str, key: str) -> None:
    assert old in SCENE
    with pytest.raises(BadInput) as refusal:
        check_keys(model("ribbon"), _scene(SCENE.replace(old, new)))
    assert key in refusal.value.key


def test_models_that_do_not_read_it_refuse_it_by_name() -> None:
    """The shell, the rods and the elastica."""
    thick = SCENE.replace("width = 0.05", "width = 0.05\nthickness = 1e-3")
    with pytest.raises(BadInput) as refusal:
        check_keys(model("shell"), _scene(thick))
    assert refusal.value.key == "wall.friction"
    for name in ("antman", "curve_angle", "elastica"):
        assert not {"wall.friction", "obstacle.friction"} & model(name).reads


def test_a_coefficient_of_zero_is_the_scene_without() -> None:
    """The canonical form, and with it every key of a kept result, is the same."""
    assert (
        _scene(SCENE.replace("friction = 0.3", "friction = 0.0")).canonical()
        == _scene(SCENE.replace("friction = 0.3\n", "")).canonical()
    )
