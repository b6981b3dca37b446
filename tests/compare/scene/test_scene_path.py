"""The path that leads to a scene: stages in order, what each of them changes, and what it must not."""

from __future__ import annotations

import pytest

from compare.scene.scene import loads
from compare.scene.spec import StageSpec
from ribbonbench.errors import BadInput
from tests.compare.scene.scene_texts import fault, text

END = {
    "clamp.end.position": "[0.0, 0.0, 0.5]",
    "clamp.end.tangent": "[0.0, 0.0, 1.0]",
    "clamp.end.normal": "[0.0, 1.0, 0.0]",
}
WALLS = (
    '[[wall]]\npoint = [-0.5, 0.0, 0.0]\nnormal = [1.0, 0.0, 0.0]\nname = "floor"\n'
    "[[wall]]\npoint = [0.5, 0.0, 0.0]\nnormal = [-1.0, 0.0, 0.0]\n"
)


def path(*stages: str) -> str:
    return "".join(f"[[path]]\n{stage}\n" for stage in stages)


def test_a_key_keeps_the_value_of_the_last_stage_that_names_it():
    scene = loads(
        text(
            END,
            extra=path(
                '"clamp.end.position" = [0.0, 0.0, 0.9]\n"strip.gamma" = 0.0',
                '"strip.gamma" = 50.0',
                '"clamp.end.position" = [0.0, 0.0, 0.7]\nsteps = 4',
            ),
        )
    )
    stages = scene.stages()
    assert [stage.end_position[2] for stage in stages] == [0.9, 0.9, 0.7, 0.5]
    assert [stage.gamma for stage in stages] == [0.0, 50.0, 50.0, 100.0]
    assert [stage.steps for stage in scene.path] == [None, None, 4]
    assert all(stage.path == () for stage in stages)
    assert stages[-1] == scene.replace({"path": None})
    assert all(stage.name == scene.name and stage.title == scene.title for stage in stages)
    assert loads(scene.to_toml(), scene.source) == scene
    assert hash(scene) == hash(loads(scene.to_toml(), scene.source))


def test_a_scene_without_a_path_is_its_only_stage():
    scene = loads(text())
    assert scene.path == ()
    assert scene.stages() == (scene,)


def test_a_stage_is_a_mapping_in_the_order_of_the_file():
    (stage,) = loads(text(extra=path('"strip.gamma" = 3\n"gravity.up" = [0.0, 1.0, 0.0]'))).path
    assert dict(stage) == {"strip.gamma": 3, "gravity.up": (0.0, 1.0, 0.0)}
    assert list(stage) == ["strip.gamma", "gravity.up"]
    assert len(stage) == 2
    assert stage["strip.gamma"] == 3
    with pytest.raises(KeyError):
        stage["strip.width"]
    assert stage == StageSpec((("strip.gamma", 3), ("gravity.up", (0.0, 1.0, 0.0))))


@pytest.mark.parametrize(
    "stage",
    [
        '"clamp.end.position" = [0.0, 0.0, 0.9]\n"clamp.end.ruling" = "straight"',
        'clamp.end.position = [0.0, 0.0, 0.9]\nclamp.end.ruling = "straight"',
        'clamp = {end = {position = [0.0, 0.0, 0.9], ruling = "straight"}}',
        '"clamp.end" = {position = [0.0, 0.0, 0.9], ruling = "straight"}',
        'clamp."end.position" = [0.0, 0.0, 0.9]\n"clamp.end".ruling = "straight"',
        '[path.clamp.end]\nposition = [0.0, 0.0, 0.9]\nruling = "straight"',
    ],
)
def test_quoted_and_unquoted_keys_and_inline_tables_are_the_same(stage):
    """A table sets its keys and leaves the others of the section, however it is written."""
    scene = loads(text(END, extra=path(stage)))
    assert dict(scene.path[0]) == {"clamp.end.position": (0.0, 0.0, 0.9), "clamp.end.ruling": "straight"}
    first = scene.stages()[0]
    assert first.clamp_end is not None
    assert first.clamp_end.tangent == (0.0, 0.0, 1.0)
    assert first.clamp_end.ruling == "straight"


def test_a_section_can_be_absent_in_a_stage_and_come_back():
    scene = loads(
        text(
            END,
            {"gravity.exact": "true"},
            extra=path('gravity = false\n"clamp.end" = false', "gravity.up = [0.0, 1.0, 0.0]"),
        )
    )
    first, second, last = scene.stages()
    assert first.gravity is first.clamp_end is None
    assert second.gravity is not None
    assert not second.gravity.exact, "what was left out as a whole comes back key by key"
    assert second.clamp_end is None
    assert last.gravity is not None
    assert last.gravity.exact
    assert loads(scene.to_toml(), scene.source) == scene


def test_a_band_closed_at_the_end_of_the_path():
    held = "position = [0.0, 0.0, 0.5], tangent = [0.0, 0.0, 1.0], normal = [0.0, 1.0, 0.0]"
    bent = f'"closure" = false\nclamp.end = {{{held}}}'
    scene = loads(text({"closure.kind": '"moebius"'}, extra=path(bent, '"clamp.end.position" = [0.0, 0.0, 0.1]')))
    first, second, last = scene.stages()
    assert first.closure is second.closure is None
    assert second.end_position is not None
    assert last.closure is not None
    assert last.clamp_end is None
    assert loads(scene.to_toml(), scene.source) == scene


def test_stages_move_walls_by_name_or_number():
    scene = loads(text(extra=WALLS + path('"wall.floor.point" = [-0.9, 0.0, 0.0]\n"wall.1.stiffness" = 7.0')))
    first, last = scene.stages()
    assert [wall.point[0] for wall in first.walls] == [-0.9, 0.5]
    assert [wall.stiffness for wall in first.walls] == [None, 7.0]
    assert last.walls[1].stiffness is None
    assert loads(scene.to_toml(), scene.source) == scene


def test_stages_replace_the_other_way_to_say_it():
    stage = '"model.elements" = 10\n"clamp.end.frame" = "free"'
    first, last = loads(text(END, {"model.tolerance": "1e-3"}, extra=path(stage))).stages()
    assert (first.model.elements, first.model.tolerance, first.end_frame) == (10, None, None)
    assert last.model.tolerance == 1e-3


def test_replace_keeps_the_path_and_checks_it_again():
    scene = loads(text(END, extra=path('"clamp.end.position" = [0.0, 0.0, 0.9]')))
    assert scene.replace({"strip.gamma": 1.0}).stages()[0].gamma == 1.0
    with pytest.raises(BadInput, match=r"path\[0\]\.clamp\.end\.position"):
        scene.replace({"strip.length": 0.8})
    assert scene.replace({"path": [{"strip.gamma": 2.0}]}).stages()[0].gamma == 2.0


@pytest.mark.parametrize(
    ("stage", "key", "shown", "offered"),
    [
        ('"strip.widht" = 0.03', "path[0].strip.widht", "0.03", "did you mean strip.width?"),
        ("strip.widht = 0.03", "path[0].strip.widht", "0.03", "did you mean strip.width?"),
        ("gamma = 3.0", "path[0].gamma", "3.0", "did you mean strip.gamma?"),
        ("xyzzy = 3.0", "path[0].xyzzy", "3.0", "clamp.end.position"),
        ('title = "a"', "path[0].title", "a", "title is fixed"),
        ('"shell.clamp" = "edge"', "path[0].shell.clamp", "edge", "shell is fixed"),
        ('"path.steps" = 3', "path[0].path.steps", "3", "path is fixed"),
        ("", "path[0]", "", "clamp.end.position"),
        ("gravity = {}", "path[0].gravity", "", "or false"),
        ("gravity = true", "path[0].gravity", "True", "give false"),
        ("gravity = 3", "path[0].gravity", "3", "give false"),
        ("clamp = false", "path[0].clamp", "False", "did you mean clamp."),
        ("strip = false", "path[0].strip", "False", "did you mean strip."),
        ('gravity = false\n"gravity.up" = [0.0, 1.0, 0.0]', "path[0].gravity.up", "1.0", "remove one of the two"),
        ('"strip.gamma" = 1.0\nstrip.gamma = 2.0', "path[0].strip.gamma", "2.0", "remove one of the two"),
        ('"wall.roof.point" = [0.0, 0.0, 0.0]', "path[0].wall.roof.point", "0.0", "walls here: wall.floor, wall.1"),
        ('"wall.2.point" = [0.0, 0.0, 0.0]', "path[0].wall.2.point", "0.0", "walls here: wall.floor, wall.1"),
        ('"wall.1.name" = "a"', "path[0].wall.1.name", "a", "keeps its name"),
        ('"wall.1.pont" = [0.0, 0.0, 0.0]', "path[0].wall.1.pont", "0.0", "did you mean wall.point?"),
        ("wall = false", "path[0].wall", "False", "walls here"),
        (
            '"wall.0.point" = [-1.0, 0.0, 0.0]\n"wall.floor.point" = [-2.0, 0.0, 0.0]',
            "path[0].wall.floor.point",
            "-2.0",
            "remove one of the two",
        ),
        ('steps = 3\n"strip.gamma" = 1.0', "path[0].steps", "3", "stage after"),
        ("a." * 30 + "a = 1", "path[0].a.a.a.a.a.a", "", "clamp.end.position"),
        # the scene of a stage is checked like any other
        ('"strip.width" = 2.0', "path[0].strip.width", "2.0", "below 1.0"),
        ('"strip.gamma" = "much"', "path[0].strip.gamma", "much", ">= 0"),
        ('"gravity.up" = [3.0, 0.0, 4.0]', "path[0].gravity.up", "3.0", "normalised it is"),
        ('"clamp.end.position" = [0.0, 0.0, 2.0]', "path[0].clamp.end.position", "2.0", "within 1.0"),
        ('"closure.kind" = "circle"', "path[0].clamp.end", "", "[closure]"),
        ('"wall.floor.point" = [0.1, 0.0, 0.0]', "path[0].clamp.start.position", "0.0", "move the wall back"),
        (
            '"clamp.start" = false\n"clamp.end" = false\n"gravity.up" = [0.0, 1.0, 0.0]',
            "path[0].gravity.up",
            "1.0",
            "[clamp.start]",
        ),
        ('"model.elements" = 0', "path[0].model.elements", "0", ">= 1"),
        ('"model.formulation" = "chained"', "path[0].model.formulation", "chained", '"mixed"'),
        ('"strip.gamma" = 2024-01-01', "path[0].strip.gamma", "2024", ">= 0"),
    ],
)
def test_bad_stage(stage, key, shown, offered):
    error = fault(text(END, extra=WALLS + path(stage)))
    assert error.key == key
    assert shown in str(error).partition(": ")[0]
    assert offered in error.remedy


@pytest.mark.parametrize("steps", ["0", "-1", "2.0", "true", '"four"'])
def test_bad_steps(steps):
    error = fault(text(extra=path('"strip.gamma" = 1.0', f'"strip.gamma" = 2.0\nsteps = {steps}')))
    assert error.key == "path[1].steps"
    assert "whole number >= 1" in error.remedy


def test_the_error_names_the_later_stage():
    error = fault(text(END, extra=path('"strip.gamma" = 1.0', '"strip.gamma" = -1.0')))
    assert error.key == "path[1].strip.gamma"
    assert error.value == -1.0


@pytest.mark.parametrize("line", ["path = 3\n", "path = [1]\n", "[path]\nsteps = 3\n"])
def test_a_path_that_is_no_array_of_tables(line):
    error = fault(text(extra=line) if line.startswith("[") else line + text())
    assert error.key == "path"
    assert "[[path]]" in error.remedy
