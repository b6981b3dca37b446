"""From a scene to the shell's problem: units, the mesh's keys, two clamps and the way there, stages of a path."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from compare.models.shell_build import (
    DEFAULT_ELEMENTS,
    FIRST_ELEMENTS,
    GRADING,
    MOST_TURN,
    arc_turn,
    shell_elements,
    shell_options,
    shell_problem,
    shell_words,
)
from compare.scene.scene import load, loads
from compare.store.store import case_key
from ribbonbench.errors import BadInput
from shellref.shell.clamps import rotation_vector
from shellref.shell.options import ShellOptions
from shellref.shell.strip import build_strip
from tests.compare.scene.scene_texts import SI, text

CORNERS = {"shell.clamp": '"corners"', "shell.corner": "0.003"}
ALL = CORNERS | {
    "shell.tolerance": "2e-3",
    "shell.elements": "[30, 4]",
    "shell.grading": "[0.3, 0.2]",
    "shell.start_curvature": "4.0",
}


def test_keys_become_fields_in_units_of_the_length():
    """length = 0.5: lengths are doubled, curvatures halved."""
    scene = loads(text(SI, ALL))
    problem = shell_problem(scene, 50.0)
    assert (problem.clamp, problem.corner) == ("corners", pytest.approx(0.006))
    assert problem.elements == (30, 4)
    assert problem.grading == (0.3, 0.2)
    assert problem.edge_layer is None
    assert problem.start_curvature == pytest.approx(2.0)
    assert problem.thickness == pytest.approx(0.03 / 50)
    assert shell_options(scene) == ShellOptions(accuracy=2e-3, coarse=True)
    layered = loads(text(SI, {"shell.edge_layer": "0.001"}))
    assert shell_problem(layered, 50.0).edge_layer == pytest.approx(0.002)
    assert shell_problem(loads(text(SI, {"shell.edge_layer": '"auto"'})), 50.0).edge_layer == "auto"


def test_defaults():
    scene = loads(text())
    problem = shell_problem(scene, 50.0)
    assert (problem.clamp, problem.corner, problem.end, problem.path) == ("edge", None, None, ())
    assert problem.elements == shell_elements(scene) == DEFAULT_ELEMENTS
    assert problem.grading == GRADING
    assert problem.start_curvature is None
    assert shell_options(scene) == ShellOptions(coarse=True)
    assert shell_elements(loads(text({"shell.tolerance": "1e-3"}))) == FIRST_ELEMENTS


def test_the_scene_says_its_keys_again_and_older_scenes_keep_their_hash():
    scene = loads(text(ALL))
    assert loads(scene.to_toml()).canonical() == scene.canonical()
    plain = loads(text()).canonical()
    assert set(plain["shell"]) == {"width_to_thickness", "clamp", "elements"}
    assert case_key(scene.canonical()) != case_key(plain)
    other = scene.replace({"shell.edge_layer": "auto"})
    assert (other.shell.grading, other.shell.edge_layer) == (None, "auto")


def test_corners_without_a_size_are_noted():
    assert any("depend on the mesh" in note for note in loads(text({"shell.clamp": '"corners"'})).notes())
    assert loads(text(CORNERS)).notes() == ()


def test_what_the_shell_itself_refuses_names_the_key():
    with pytest.raises(BadInput, match=r"shell\.poisson|shell\.thickness") as caught:
        shell_problem(loads(text()), -1.0)
    assert caught.value.key.startswith("shell.")


# -- two clamps -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("distance", [0.0, 0.1, 0.5, 0.9, 0.999999, 1.0])
def test_the_arc_has_the_chord(distance):
    turn = arc_turn(distance)
    assert 0.0 <= turn <= 2.0 * math.pi
    chord = 1.0 if turn == 0.0 else 2.0 * math.sin(0.5 * turn) / turn
    assert chord == pytest.approx(distance, abs=1e-12)


def path_of(name, keys=None):
    problem = shell_problem(load(name).replace({"shell.width_to_thickness": 50, **(keys or {})}), 50.0)
    return problem, build_strip(problem, ShellOptions())


TWO = ["shift_7_2", "two_clamps_5_3_2", "two_clamps_5_3_2_level", "two_clamps_5_3_2_twist", "arc_5_1", "start_5_3_3_1"]


@pytest.mark.parametrize("name", TWO)
def test_the_way_begins_on_an_arc_between_the_clamps_and_ends_in_them(name):
    scene = load(name)
    problem, strip = path_of(name)
    first = scene.stages()[0]
    distance = np.linalg.norm(first.end_position - first.start_position)
    assert strip.end.poses[0].position == pytest.approx(first.end_position, abs=1e-9)
    assert 2.0 * math.sin(0.5 * problem.start_curvature) / problem.start_curvature == pytest.approx(distance, abs=1e-9)
    for path, position, frame in (
        (strip.start, scene.start_position, scene.start_frame),
        (strip.end, scene.end_position, scene.end_frame),
    ):
        assert path.poses[-1].position == pytest.approx(position)
        assert np.shape(path.poses[-1].frame) == frame.shape == (3, 3)
        np.testing.assert_allclose(path.poses[-1].frame, frame, atol=1e-12)
        frames = [np.array(pose.frame) for pose in path.poses]
        turns = [np.linalg.norm(rotation_vector(b @ a.T)) for a, b in pairwise(frames)]
        assert max(turns) <= MOST_TURN + 1e-9
    names = [stage.name for stage in strip.stages]
    assert names[0] == "natural"
    assert strip.stages[-1].end.natural == 1.0
    assert strip.stages[-1].end.weight == (1.0 if problem.loaded else 0.0)


def test_an_arc_of_more_than_half_a_turn_is_not_wound_up():
    """7.2: the arc turns by 3.79; each clamp turns back by half of that, not by the shorter way round."""
    problem, strip = path_of("shift_7_2")
    turn = problem.start_curvature
    assert turn == pytest.approx(3.79, abs=0.01)
    for path, sign in ((strip.start, 1.0), (strip.end, -1.0)):
        frames = [np.array(pose.frame) for pose in path.poses]
        turns = [rotation_vector(b @ a.T) for a, b in pairwise(frames)]
        across = frames[0][:, 0]
        assert sum(float(t @ across) for t in turns) == pytest.approx(
            sign * 0.5 * turn, abs=1e-3
        )  # the chord is askew by 0.02


def test_the_seed_says_to_which_side_the_arc_bends():
    up, _ = path_of("shift_7_2")
    down, _ = path_of("shift_7_2", {"seed.curvature": [8.0, -8.0, 8.0]})
    assert up.start_curvature > 0
    assert down.start_curvature == pytest.approx(-up.start_curvature)


def test_the_clamps_say_to_which_side_where_they_can():
    """Tangents up and to the right: the strip turns to the right, away from t_y = -e_x at the start, for every seed."""
    for seed in (1.0, -1.0):
        problem, _ = path_of("two_clamps_5_3_2", {"seed.curvature": seed})
        tangent = np.array(build_strip(problem, ShellOptions()).end.poses[0].frame)[:, 2]
        assert tangent[0] > 0.8


def test_a_straight_strip_between_clamps_begins_flat_and_a_curvature_can_be_said():
    straight = {"path": None, "clamp.end.position": [1.0, 0.0, 0.0]}
    assert path_of("shift_7_2", straight)[0].start_curvature == 0.0
    said, strip = path_of("shift_7_2", {"shell.start_curvature": 1.0})
    assert said.start_curvature == 1.0
    assert strip.end.poses[-1].position == pytest.approx((0.5, 0.1, 0.0))


def test_without_the_way_the_problem_is_the_state_alone():
    problem = shell_problem(load("shift_7_2"), 50.0, way=False)
    assert problem.path == ()
    assert problem.end.position == (0.5, 0.1, 0.0)


# -- stages -----------------------------------------------------------------------------------------------------------

PATH = """
[[path]]
"strip.gamma" = 25.0
"strip.natural_curvature" = 4.0
[[path]]
"clamp.start.position" = [0.1, 0.0, 0.0]
"strip.natural_curvature" = 8.0
"""


def test_stages_become_waypoints():
    """A stage changes the stage before it: the second keeps the weight of the first."""
    problem = shell_problem(loads(text(extra=PATH)), 50.0)
    assert problem.start_curvature == 4.0
    first, second = problem.path
    assert (first.natural, first.gravity, first.name) == (pytest.approx(0.0), pytest.approx(0.25), "path 1")
    assert (second.natural, second.gravity) == (pytest.approx(4.0 / 6.0), pytest.approx(0.25))
    assert second.start.position == (0.1, 0.0, 0.0)
    assert second.end is None


@pytest.mark.parametrize(
    ("stage", "key"),
    [
        ('"strip.width" = 0.02', "path[0].strip.width"),
        ('"strip.poisson" = 0.1', "path[0].strip.poisson"),
        ('"gravity.up" = [0.0, 0.0, 1.0]', "path[0].gravity.up"),
        ('"clamp.start.position" = "free"', "path[0].clamp.start"),
        ('"strip.natural_curvature" = [1.0, 2.0]', "path[0].strip.natural_curvature"),
    ],
)
def test_stages_that_the_shell_cannot_follow(stage, key):
    free = {"gravity.up": None, "strip.gamma": None} if "free" in stage else {}
    scene = loads(text(free, {"strip.thickness": "3e-4"}, extra=f"[[path]]\n{stage}\n"))
    with pytest.raises(BadInput) as caught:
        shell_problem(scene, 50.0)
    assert caught.value.key == key
    assert shell_problem(scene, 50.0, way=False).path == ()


def test_stages_about_the_ribbon_are_passed_over():
    problem = shell_problem(loads(text(extra='[[path]]\n"model.elements" = 5\n')), 50.0)
    assert {(w.natural, w.gravity) for w in problem.path} == {(1.0, 1.0)}


def test_words():
    assert "the whole edge at both ends" in shell_words(load("shift_7_2"))
    assert "planar arc" in shell_words(load("shift_7_2"))
    assert "a cell of 0.01 l at both corners at s = 0" in shell_words(load("limits_7_3"))
    assert "its natural shape" in shell_words(load("curl_4_3"))
    assert "on a coarse mesh first" in shell_words(load("curl_4_3"))
    assert "on a coarse mesh first" not in shell_words(load("shift_7_2"))
    for start, beside in (("auto", True), ("ribbon", True), ("coarse", False), ("path", False)):
        words = shell_words(load("curl_4_3").replace({"shell.start": start}))
        assert ("begins at the ribbon's surface" in words) is beside


@pytest.mark.parametrize(
    ("name", "start", "several", "coarse"),
    [
        ("curl_4_3", "auto", False, True),
        ("curl_4_3", "ribbon", False, True),
        ("curl_4_3", "path", False, False),
        ("shift_7_2", "auto", True, False),
        ("shift_7_2", "coarse", True, True),
        ("lateral_7_1", "auto", True, False),
        ("tape_4_1", "auto", True, False),
    ],
)
def test_a_shell_alone_begins_on_a_coarse_mesh_where_there_is_one_equilibrium(name, start, several, coarse):
    scene = load(name).replace({"shell.start": start})
    assert scene.several_equilibria is several
    assert shell_options(scene).coarse is coarse
