"""`shell.goal`: what is refused by name, what the command writes of a graded mesh, what it says of its error."""

import json

import numpy as np
import pytest

from compare.cli import BAD_INPUT, DONE
from compare.models.shell_build import shell_options, shell_problem, shell_words
from compare.page.page import read_page
from compare.scene.scene import load
from ribbonbench.errors import BadInput
from tests.compare.models.test_shell_command import alone, needs_dolfinx

GOAL = {"shell.tolerance": 1e-3, "shell.goal": "end"}


def test_the_goal_is_asked_of_the_worker():
    scene = load("curl_4_3").replace(GOAL)
    options = shell_options(scene)
    assert (options.goal, options.accuracy) == ("end", 1e-3)
    assert "refined to 0.001 l at the end" in shell_words(scene)
    assert shell_options(load("curl_4_3")).goal == "surface"


@pytest.mark.parametrize(
    ("name", "keys", "why"),
    [
        ("curl_4_3", {"shell.goal": "end"}, "needs a tolerance"),
        ("shift_7_2", GOAL, "held by a clamp"),
        ("tape_4_1", {**GOAL, "shell.goal": "middle"}, "slide, turn or deform|curved section"),
    ],
)
def test_what_cannot_be_asked_names_the_key(name, keys, why):
    scene = load(name).replace({**keys, "shell.width_to_thickness": [50.0]})
    with pytest.raises(BadInput, match=why) as caught:
        shell_problem(scene, 50.0)
    assert caught.value.key == "shell.goal"


@needs_dolfinx
def test_the_command_writes_the_graded_mesh(tmp_path):
    keys = ["shell.goal=end", "shell.elements=[20, 2]", "shell.tolerance=2e-3", "shell.width_to_thickness=20"]
    sets = [part for key in keys for part in ("--set", key)]
    done = alone("curl_4_3", *sets, "--out", tmp_path)
    assert done.returncode == DONE, done.stderr
    found = json.loads((tmp_path / "result.json").read_text())["discretisation"]
    assert found["goal"] == "end"
    assert found["reached"] is True
    assert found["estimate"] <= 2e-3
    assert len(found["meshes"]) > 1
    assert np.diff(found["s_knots"]).min() > 0
    assert (tmp_path / "mesh.png").stat().st_size > 1000
    assert "mesh.png" in {picture.file for picture in read_page(tmp_path).pictures}
    assert "how accurately is not known" in done.stdout  # the end's error is no error of the surface


@needs_dolfinx
def test_a_goal_that_is_held_is_refused_by_the_command(tmp_path):
    done = alone("shift_7_2", "--set", "shell.goal=end", "--set", "shell.tolerance=1e-3", "--out", tmp_path)
    assert done.returncode == BAD_INPUT
    assert "shell.goal" in done.stderr
