"""What holds a strip: clamps whose parts can be free, closures, walls; and the newer keys of model and seed."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from compare.models.scope import has_shell, require_shell
from compare.scene.scene import load, loads
from compare.scene.spec import ClampSpec, ClosureSpec, WallSpec
from ribbonbench.errors import BadInput
from tests.compare.scene.scene_texts import PLANAR, fault, text

NO_START = {f"clamp.start.{key}": None for key in ("position", "tangent", "normal")}
WEIGHTLESS = {"gravity.up": None}
END = {
    "clamp.end.position": "[0.0, 0.0, 0.5]",
    "clamp.end.tangent": "[0.0, 0.0, 1.0]",
    "clamp.end.normal": "[0.0, 1.0, 0.0]",
}
FLOOR = '[[wall]]\npoint = [-0.5, 0.0, 0.0]\nnormal = [1.0, 0.0, 0.0]\nname = "floor"\n'
PLATE = "[[wall]]\npoint = [0.5, 0.0, 0.0]\nnormal = [-1.0, 0.0, 0.0]\nstiffness = 30\n"


def again(scene):
    """The scene after a round trip through TOML; its canonical form survives JSON."""
    assert json.loads(json.dumps(scene.canonical(), allow_nan=False)) == scene.canonical()
    for line in scene.to_toml().splitlines():
        assert not line or line.startswith("[") or "  # " in line, line
    return loads(scene.to_toml(), scene.source)


# -- clamps -----------------------------------------------------------------------------------------


def test_both_ends_clamped():
    scene = loads(text({"strip.length": "2.0", "clamp.start.position": "[1.0, 0.0, 0.0]"}, END))
    np.testing.assert_allclose(scene.end_position, [0.0, 0.0, 0.25])
    np.testing.assert_allclose(scene.end_frame, np.column_stack([[1, 0, 0], [0, 1, 0], [0, 0, 1]]))
    np.testing.assert_allclose(scene.start_position, [0.5, 0.0, 0.0])
    assert scene.position.tolist() == scene.start_position.tolist()
    assert scene.frame.tolist() == scene.start_frame.tolist()
    assert scene.start_clamped
    assert again(scene) == scene


# fmt: off
PARTS = [
    # [clamp.end] as written, then the position, the tangent and the ruling it holds
    ({"position": "[0.0, 0.0, 0.5]"}, (0.0, 0.0, 0.5), None, "free"),
    ({"position": "[0.0, 0.0, 0.5]", "frame": '"free"'}, (0.0, 0.0, 0.5), None, "free"),
    ({"position": '"free"', "ruling": '"straight"'}, None, None, "straight"),
    ({"ruling": '"straight"'}, None, None, "straight"),
    ({"tangent": "[1.0, 0.0, 0.0]", "normal": "[0.0, 1.0, 0.0]"}, None, (1.0, 0.0, 0.0), "straight"),
    (
        {"tangent": "[1.0, 0.0, 0.0]", "normal": "[0.0, 1.0, 0.0]", "position": '"free"', "ruling": '"free"'},
        None, (1.0, 0.0, 0.0), "free",
    ),
]
# fmt: on


@pytest.mark.parametrize(("keys", "position", "tangent", "ruling"), PARTS)
def test_parts_of_the_end_clamp_can_be_free(keys, position, tangent, ruling):
    scene = loads(text({f"clamp.end.{key}": value for key, value in keys.items()}))
    normal = None if tangent is None else (0.0, 1.0, 0.0)
    assert scene.clamp_end == ClampSpec(position, tangent, normal, ruling)
    assert (scene.end_position is None) == (position is None)
    assert (scene.end_frame is None) == (tangent is None)
    assert again(scene) == scene


@pytest.mark.parametrize(
    ("keys", "position", "frame_held"),
    [
        ({"tangent": None, "normal": None}, (0.0, 0.0, 0.0), False),
        ({"tangent": None, "normal": None, "frame": '"free"'}, (0.0, 0.0, 0.0), False),
        ({"tangent": None, "normal": None, "position": None, "ruling": '"free"'}, (0.0, 0.0, 0.0), False),
        ({"position": '"free"'}, None, True),
    ],
)
def test_parts_of_the_start_clamp_can_be_free(keys, position, frame_held):
    """An absent position is the origin at the start; only "free" leaves it free."""
    change = {f"clamp.start.{key}": value for key, value in keys.items()}
    scene = loads(text(change, {} if position else WEIGHTLESS))
    assert scene.clamp_start is not None
    assert scene.clamp_start.position == position
    assert (scene.start_frame is not None) == frame_held
    assert not scene.start_clamped
    assert again(scene) == scene
    for name in ("position", "frame"):
        with pytest.raises(BadInput, match=r"clamp\.start: does not hold position and frame") as caught:
            getattr(scene, name)
        assert "tangent and normal" in caught.value.remedy


def test_a_strip_held_by_nothing_without_weight():
    scene = loads(text(NO_START, WEIGHTLESS))
    assert scene.clamp_start is None
    assert scene.clamp_end is None
    assert scene.start_position is None
    assert scene.start_frame is None
    assert again(scene) == scene
    with pytest.raises(BadInput, match=r"clamp\.start"):
        _ = scene.frame


def test_only_the_end_clamped():
    scene = loads(text(NO_START, END))
    assert scene.clamp_start is None
    assert scene.end_frame is not None
    assert again(scene) == scene


@pytest.mark.parametrize(
    ("keys", "key", "offered"),
    [
        ({"clamp.start.position": '"origin"'}, "clamp.start.position", 'or "free"'),
        ({"clamp.end.position": '"fre"'}, "clamp.end.position", 'or "free"'),
        ({"clamp.end.tangent": "[1.0, 0.0, 0.0]"}, "clamp.end.normal", "remove tangent too"),
        ({"clamp.end.normal": "[1.0, 0.0, 0.0]"}, "clamp.end.tangent", "remove normal too"),
        ({"clamp.end.across": "[1.0, 0.0, 0.0]"}, "clamp.end.across", "add tangent and normal"),
        ({"clamp.end.position": '"free"', "clamp.end.frame": '"free"'}, "clamp.end", "remove [clamp.end]"),
        ({"clamp.end.ruling": '"free"'}, "clamp.end", "position, tangent and normal"),
        ({"clamp.start.frame": '"free"'}, "clamp.start.tangent", "remove tangent or frame"),
        ({"clamp.start.frame": '"held"'}, "clamp.start.frame", 'frame = "free"'),
        ({"clamp.start.frame": "false"}, "clamp.start.frame", "free"),
        ({"clamp.end.frame": '"free"', "clamp.end.across": "[1.0, 0.0, 0.0]"}, "clamp.end.across", "remove across"),
        ({"clamp.end.potision": "[1.0, 0.0, 0.0]"}, "clamp.end.potision", "did you mean clamp.end.position?"),
    ],
)
def test_bad_clamp(keys, key, offered):
    error = fault(text(keys))
    assert error.key == key
    assert offered in error.remedy


def test_a_clamp_section_without_an_end():
    error = fault(text(NO_START, WEIGHTLESS, extra="[clamp]\n"))
    assert error.key == "clamp"
    assert "[clamp.end]" in error.remedy


# -- closures ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"kind": '"circle"'}, ClosureSpec("circle", "free", 1)),
        ({"kind": '"circle"', "turns": "3"}, ClosureSpec("circle", "free", 3)),
        ({"kind": '"moebius"'}, ClosureSpec("moebius", "free", 1)),
        ({"kind": '"moebius"', "ruling": '"straight"'}, ClosureSpec("moebius", "straight", 1)),
    ],
)
@pytest.mark.parametrize("held", [True, False])
def test_closures(keys, expected, held):
    change = {f"closure.{key}": value for key, value in keys.items()}
    scene = loads(text(change, {} if held else NO_START | WEIGHTLESS))
    assert scene.closure == expected
    assert (scene.clamp_start is not None) == held
    assert again(scene) == scene


def test_a_scene_that_just_says_moebius():
    scene = loads('[strip]\nlength = 1.0\nwidth = 0.3\npoisson = 0.3\n[closure]\nkind = "moebius"\n')
    assert scene.closure == ClosureSpec("moebius")
    assert again(scene) == scene


@pytest.mark.parametrize(
    ("keys", "key", "shown", "offered"),
    [
        ({"kind": '"mobius"'}, "closure.kind", "mobius", "did you mean 'moebius'"),
        ({"ruling": '"straight"'}, "closure.kind", "", "kind = "),
        ({"kind": '"circle"', "turns": "0"}, "closure.turns", "0", "whole number >= 1"),
        ({"kind": '"circle"', "turns": "1.5"}, "closure.turns", "1.5", "whole number >= 1"),
        ({"kind": '"moebius"', "turns": "1"}, "closure.turns", "1", "only a circle has turns"),
        ({"kind": '"circle"', "ruling": '"loose"'}, "closure.ruling", "loose", "'straight'"),
        (
            {"kind": '"circle"', "knot": "1"},
            "closure.knot",
            "1",
            "known keys here: half_turns, kind, ruling, turns, twist",
        ),
    ],
)
def test_bad_closure(keys, key, shown, offered):
    error = fault(text({f"closure.{name}": value for name, value in keys.items()}))
    assert error.key == key
    assert shown in str(error).partition(": ")[0]
    assert offered in error.remedy


# -- walls ------------------------------------------------------------------------------------------


def test_walls():
    scene = loads(text({"strip.length": "2.0", "strip.width": "0.1"}, extra=FLOOR + PLATE))
    assert scene.walls == (
        WallSpec((-0.5, 0.0, 0.0), (1.0, 0.0, 0.0), None, "floor"),
        WallSpec((0.5, 0.0, 0.0), (-1.0, 0.0, 0.0), 30.0, None),
    )
    np.testing.assert_allclose(scene.wall_points, [[-0.25, 0, 0], [0.25, 0, 0]])
    np.testing.assert_allclose(scene.wall_normals, [[1, 0, 0], [-1, 0, 0]])
    assert again(scene) == scene
    without = loads(text())
    assert without.walls == ()
    assert without.wall_points.shape == without.wall_normals.shape == (0, 3)


@pytest.mark.parametrize(
    ("wall", "key", "shown", "offered"),
    [
        ("normal = [1.0, 0.0, 0.0]", "wall.0.point", "", "add e.g. point = "),
        ("point = [0.0, 0.0, 0.0]", "wall.0.normal", "", "add e.g. normal = "),
        ("point = [0.0, 0.0]", "wall.0.point", "[0.0, 0.0]", "three numbers"),
        ("point = [0, 0, 0]\nnormal = [0, 3, 4]", "wall.0.normal", "[0, 3, 4]", "normalised it is [0.0, 0.6"),
        ("point = [-1, 0, 0]\nnormal = [1, 0, 0]\nstiffness = 0", "wall.0.stiffness", "0", "D w / l^3"),
        ("point = [-1, 0, 0]\nnormal = [1, 0, 0]\nstiffness = -1", "wall.0.stiffness", "-1", "D w / l^3"),
        ("point = [-1, 0, 0]\nnormal = [1, 0, 0]\nname = '0'", "wall.0.name", "0", 'name = "roof"'),
        ("point = [-1, 0, 0]\nnormal = [1, 0, 0]\nname = 'a.b'", "wall.0.name", "a.b", 'name = "roof"'),
        ("point = [-1, 0, 0]\nnormal = [1, 0, 0]\nname = 3", "wall.0.name", "3", "roof"),
        ("pont = [0.0, 0.0, 0.0]", "wall.0.pont", "", "did you mean wall.0.point?"),
    ],
)
def test_bad_wall(wall, key, shown, offered):
    error = fault(text(extra=f"[[wall]]\n{wall}\n"))
    assert error.key == key
    assert shown in str(error).partition(": ")[0]
    assert offered in error.remedy


def test_two_walls_of_one_name():
    error = fault(text(extra=FLOOR + FLOOR))
    assert error.key == "wall.1.name"
    assert "own name" in error.remedy


@pytest.mark.parametrize("extra", ["[wall]\npoint = [0.0, 0.0, 0.0]\n", "wall = 3\n", "wall = [1, 2]\n"])
def test_walls_that_are_no_array_of_tables(extra):
    error = fault(text(extra=extra) if extra.startswith("[") else extra + text())
    assert error.key == "wall"
    assert "[[wall]]" in error.remedy


# -- model, seed, gravity ---------------------------------------------------------------------------


def test_tolerance_starts_from_twenty_equal_elements():
    scene = loads(text({"model.tolerance": "1e-3"}))
    assert scene.model.tolerance == 1e-3
    assert scene.model.lengths == (0.05,) * 20
    assert "elements" not in scene.canonical()["model"]
    assert again(scene) == scene
    assert scene.replace({"model.elements": 7}).model.tolerance is None
    assert loads(text({"model.element_lengths": "[0.5, 0.5]"})).replace({"model.tolerance": 1e-4}).model.elements == 20


@pytest.mark.parametrize("formulation", ["auto", "chained", "mixed", "matrix"])
def test_formulations(formulation):
    scene = loads(text({"model.formulation": f'"{formulation}"'}, END))
    assert scene.model.formulation == formulation
    assert (scene.model.tolerance is None) == (formulation == "matrix")  # which cannot place elements
    assert again(scene) == scene


def test_held_by():
    scene = loads(text({"model.held_by": '"constraints"'}))
    assert scene.model.held_by == "constraints"
    assert scene.notes() == ()
    assert again(scene) == scene
    assert loads(text()).model.held_by == "elimination"
    free = loads(text({"model.held_by": '"constraints"', "strip.gamma": None}, NO_START, WEIGHTLESS))
    assert any("model.held_by" in note and "no effect" in note for note in free.notes())


def test_exact_gravity():
    scene = loads(text({"gravity.exact": "true"}))
    assert scene.gravity is not None
    assert scene.gravity.exact
    assert again(scene) == scene
    assert scene.canonical() != loads(text()).canonical()


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ("3.0", (6.0, 6.0)),
        ("[3.0]", (6.0, 6.0)),
        ("[3.0, 4.0]", (6.0, 8.0)),
        ("[1, 2, 3, -4]", (2.0, 4.0, 6.0, -8.0)),
        ('"natural"', (20.0, 20.0)),
    ],
)
def test_seed_curvature_is_piecewise_linear(given, expected):
    scene = loads(text({"seed.curvature": given, "strip.length": "2.0"}))
    assert scene.seed_curvature == expected
    assert again(scene) == scene


def test_seed_ruling_may_be_as_steep_as_the_width_allows():
    """|eta'| < 2/w on every piece: with w/l = 0.03 and two pieces of l/2 the difference stays below 33.33."""
    assert loads(text({"seed.ruling": "[0.0, 33.3, 0.0]"})).seed.ruling == (0.0, 33.3, 0.0)
    assert loads(text({"seed.ruling": "[0.5]"})).seed.ruling == (0.5, 0.5)


def test_canonical_changes_with_every_newer_key():
    base = loads(text(END, extra=FLOOR)).canonical()
    scene = loads(text(END, extra=FLOOR))
    changes = {
        "clamp.start.frame": "free",
        "clamp.start.position": [0.0, 0.0, 0.1],
        "clamp.end": None,
        "clamp.end.position": "free",
        "clamp.end.frame": "free",
        "clamp.end.ruling": "free",
        "wall": None,
        "wall.0.point": [-0.6, 0.0, 0.0],
        "wall.floor.normal": [math.cos(0.1), math.sin(0.1), 0.0],
        "wall.0.stiffness": 10.0,
        "gravity.exact": True,
        "model.elements": 20,
        "model.tolerance": 1e-4,
        "model.held_by": "constraints",
        "model.formulation": "matrix",
        "seed.ruling": [0.0, 1.0, 0.0],
        "path": [{"strip.gamma": 1.0}],
    }
    seen = [base]
    for key, value in changes.items():
        changed = scene.replace({key: value})
        assert changed.canonical() not in seen, key
        assert again(changed) == changed
        seen.append(changed.canonical())


def test_older_scenes_keep_their_canonical_form():
    """Stored cases are found by its hash: no key was added to a scene that does not use what is new."""
    canonical = load("curl_4_3").canonical()
    assert list(canonical) == ["strip", "gravity", "clamp", "model", "seed", "shell"]
    assert list(canonical["clamp"]) == ["start"]
    assert list(canonical["clamp"]["start"]) == ["position", "tangent", "normal", "ruling"]
    assert list(canonical["model"]) == ["energy", "elements", "grading", "formulation"]


# -- replacing keys ---------------------------------------------------------------------------------


def test_replace_walls_and_sections():
    scene = loads(text(END, extra=FLOOR + PLATE))
    moved = scene.replace({"wall.floor.point": [-0.7, 0.0, 0.0], "wall.1.stiffness": 5.0})
    assert moved.walls[0].point == (-0.7, 0.0, 0.0)
    assert moved.walls[1].stiffness == 5.0
    assert moved == scene.replace({"wall.0.point": [-0.7, 0.0, 0.0], "wall.1.stiffness": 5})
    assert scene.walls[0].point == (-0.5, 0.0, 0.0)
    assert scene.replace({"wall.1.stiffness": None}).walls[1].stiffness is None
    assert scene.replace({"wall.floor": None}).walls == scene.walls[1:]
    assert scene.replace({"wall.1": {"point": (0.9, 0, 0), "normal": (-1, 0, 0)}}).walls[1] == WallSpec(
        (0.9, 0.0, 0.0), (-1.0, 0.0, 0.0)
    )
    for gone in (None, False):
        assert scene.replace({"clamp.end": gone}).clamp_end is None
        assert scene.replace({"gravity": gone}).gravity is None
        assert scene.replace({"gravity": gone, "clamp.start": gone, "clamp.end": gone}).clamp_start is None
    ring = scene.replace({"clamp.end": False, "closure.kind": "circle"})
    assert ring.closure == ClosureSpec("circle")
    assert ring.replace({"closure": False, "clamp.end": {"ruling": "straight"}}).clamp_end == ClampSpec(
        None, None, None, "straight"
    )


def test_replace_frees_and_holds_a_frame():
    scene = loads(text())
    pinned = scene.replace({"clamp.start.frame": "free"})
    assert pinned.start_frame is None
    held = pinned.replace({"clamp.start.tangent": [0, 0, 1], "clamp.start.normal": [0, 1, 0]})
    assert held.start_clamped


@pytest.mark.parametrize(
    ("keys", "key", "offered"),
    [
        ({"wall.2.point": [0, 0, 0]}, "wall.2.point", "walls here: wall.floor, wall.1"),
        ({"wall.roof.point": [0, 0, 0]}, "wall.roof.point", "walls here: wall.floor, wall.1"),
        ({"wall.-1.point": [0, 0, 0]}, "wall.-1.point", "walls here"),
        ({"wall.roof": None}, "wall.roof", "walls here"),
        ({"wall.0.pont": [0, 0, 0]}, "wall.0.pont", "did you mean wall.0.point?"),
        ({"path.0.strip": 3}, "path.0.strip", "replace path as a whole"),
        ({"wall": None, "wall.0.point": [0, 0, 0]}, "wall.0.point", "add a section [[wall]]"),
        ({"clamp.start": None, "clamp.end.position": "free", "gravity": True}, "gravity", "[gravity]"),
    ],
)
def test_bad_replace(keys, key, offered):
    with pytest.raises(BadInput) as caught:
        loads(text(extra=FLOOR + PLATE)).replace(keys)
    assert caught.value.key == key
    assert offered in caught.value.remedy
    assert "\n" not in str(caught.value)


# -- what only some solvers can do ------------------------------------------------------------------

BEYOND = [
    ({"closure.kind": '"circle"'}, "", "[closure]"),
    ({}, FLOOR, "[[wall]]"),
    ({"clamp.start.tangent": None, "clamp.start.normal": None}, "", "at s = 0 is free"),
    (NO_START | WEIGHTLESS, "", "at s = 0 is free"),
]


CORNERS = '[shell]\nclamp = "corners"\n'
CURVED = {"strip.transverse_curvature": "20.0"}
NO_FRAME = {"clamp.start.tangent": None, "clamp.start.normal": None}
BEYOND_THE_SHELL = [
    (NO_FRAME, CORNERS, "shell.clamp", "a part of the edge"),
    (NO_FRAME | CURVED, "", "clamp.start", "leaves the frame of a curved section free"),
    (NO_START | END | CURVED, "", "clamp.start", "the start of a curved section is free"),
    (NO_FRAME | {"clamp.start.slide": "[1.0, 0.0, 0.0]"}, "", "clamp.start.slide", "a section that is free"),
]


@pytest.mark.parametrize(("change", "extra", "key", "words"), BEYOND_THE_SHELL)
def test_what_the_shell_cannot_hold_is_refused(change, extra, key, words):
    scene = loads(text(PLANAR, {"strip.thickness": "3e-4"}, change, extra=extra))
    assert not has_shell(scene)
    with pytest.raises(BadInput, match=words) as caught:
        require_shell(scene)
    assert caught.value.key == key
    assert "ribbonbench solve" in caught.value.remedy


def test_the_shell_takes_ends_of_which_a_part_is_held():
    free = {"clamp.end.tangent": None, "clamp.end.normal": None}
    for change in (NO_FRAME, NO_START | WEIGHTLESS, END | free, NO_START | END):
        assert has_shell(loads(text(PLANAR, {"strip.thickness": "3e-4"}, change)))


def test_the_shell_takes_walls():
    for change in ({"closure.kind": '"circle"'}, {}):
        assert has_shell(loads(text(PLANAR, {"strip.thickness": "3e-4"}, change, extra=FLOOR)))


def test_the_shell_takes_two_clamps_and_weighs_its_surface():
    scene = loads(text(PLANAR, {"strip.thickness": "3e-4", "gravity.exact": "true"}, END))
    assert has_shell(scene)
    assert require_shell(scene) == (pytest.approx(100.0),)


@pytest.mark.parametrize(("change", "extra", "words"), BEYOND)
def test_the_elastica_is_for_a_strip_clamped_at_its_start(change, extra, words):
    """Every one of these scenes is planar without the change."""
    assert loads(text(PLANAR)).is_planar()
    scene = loads(text(PLANAR, change, extra=extra))
    assert not scene.is_planar()
    assert words in str(scene.nonplanar_reason())
    error = fault(text(PLANAR, change, {"model.energy": '"elastica"'}, extra=extra))
    assert error.key == "model.energy"
    assert words in error.problem
    assert "wunderlich" in error.remedy


def test_the_elastica_has_no_exact_gravity():
    error = fault(text(PLANAR, {"gravity.exact": "true"}, {"model.energy": '"elastica"'}))
    assert error.key == "model.energy"
    assert "gravity.exact" in error.problem


@pytest.mark.parametrize(
    ("change", "extra", "cause"),
    [
        ({"closure.kind": '"circle"'}, "", "[closure]"),
        ({}, FLOOR, "[[wall]]"),
        ({"gravity.exact": "true"}, "", "gravity.exact"),
        ({"clamp.start.tangent": None, "clamp.start.normal": None}, "", "clamp.start"),
        (NO_START | END, "", "clamp.start"),
    ],
)
def test_the_chained_model_starts_at_a_clamp(change, extra, cause):
    error = fault(text(change, {"model.formulation": '"chained"'}, extra=extra))
    assert error.key == "model.formulation"
    assert error.value == "chained"
    assert cause in error.problem
    assert '"mixed"' in error.remedy
