"""Good scenes: derived numbers, questions, replacement of keys, round trip through TOML."""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from compare.models.scope import require_shell
from compare.scene.scene import Scene, load, loads, parse_assignment, shipped
from ribbonbench.errors import BadInput
from tests.compare.scene.scene_texts import PLANAR, SI, text


def test_a_path_and_a_byte_order_mark(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_bytes(b"\xef\xbb\xbf" + text().replace("\n", "\r\n").encode())
    scene = load(path)
    assert scene.name == "mine"
    assert scene.title == "mine"
    assert scene.source == str(path)


# -- what a good scene means ------------------------------------------------------------------------


def test_dimensionless_numbers_of_an_si_scene():
    """Figure 4.1 of the thesis: D = 1.8e9 (1e-4)^3 / 9 = 2e-4 N m, Gamma = 1000 * 1e-4 * 9.81 * 0.5^3 / D."""
    scene = loads(text(SI, {"clamp.start.position": "[1.0, 0.0, -0.5]", "seed.curvature": "[2.0, 4.0]"}))
    assert scene.gamma == pytest.approx(613.125, rel=1e-13)
    assert scene.width == pytest.approx(0.03, rel=1e-15)
    assert scene.curvature == (15.0, 15.0)
    assert scene.seed_curvature == (1.0, 2.0)
    assert scene.thickness == pytest.approx(2e-4, rel=1e-15)
    assert scene.position.tolist() == [2.0, 0.0, -1.0]
    assert require_shell(scene) == (pytest.approx(150.0),)
    heavier = loads(text(SI, {"gravity.acceleration": "19.62"}))
    assert heavier.gamma == pytest.approx(2 * 613.125, rel=1e-13)


def test_the_same_strip_in_other_units_is_the_same_problem():
    """Metres or millimetres: with gamma given, every dimensionless number agrees."""
    one = loads(text({"strip.natural_curvature": "[10.0, 5.0]"}))
    other = loads(text({"strip.length": "1000", "strip.width": "30", "strip.natural_curvature": "[0.01, 0.005]"}))
    assert other.width == pytest.approx(one.width, rel=1e-15)
    assert other.curvature == pytest.approx(one.curvature, rel=1e-15)
    assert other.gamma == one.gamma


def test_frame_is_orthonormal_right_handed_and_in_order():
    nearly = {"clamp.start.normal": "[-0.7071067813, 0.7071067811, 0.0]", "clamp.start.tangent": "[0.0, 5e-10, 1.0]"}
    for scene in (loads(text()), loads(text(nearly))):
        frame = scene.frame
        np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-15)
        assert np.linalg.det(frame) == pytest.approx(1.0, abs=1e-15)
        half = math.sqrt(0.5)
        expected = np.column_stack([[half, half, 0.0], [-half, half, 0.0], [0.0, 0.0, 1.0]])
        np.testing.assert_allclose(frame, expected, atol=2e-9)


def test_defaults():
    scene = loads(text())
    assert scene.model.energy == "auto"
    assert scene.model.elements == 20
    assert scene.model.lengths == (0.05,) * 20
    assert scene.model.tolerance == 1e-3  # the elements are placed, beginning with these
    assert scene.model.formulation == "auto"
    assert scene.clamp_start.ruling == "straight"
    assert scene.clamp_end is None
    assert scene.seed_curvature == scene.curvature == (10.0, 10.0)
    assert scene.seed.ruling == (0.0, 0.0)
    assert scene.shell.clamp == "edge"
    assert not scene.gravity.exact
    assert scene.gravity.acceleration == 9.81


def test_element_lengths_are_fractions_of_the_length():
    scene = loads(text(SI, {"model.element_lengths": "[0.1, 0.15, 0.25]"}))
    assert scene.model.elements == 3
    assert scene.model.lengths == pytest.approx((0.2, 0.3, 0.5), rel=1e-15)
    assert math.fsum(scene.model.lengths) == pytest.approx(1.0, rel=1e-15)


def test_absent_gravity_is_weightless_and_says_what_has_no_effect():
    scene = loads(text({"gravity.up": None}))
    assert scene.gamma == 0.0
    assert scene.up is None
    assert scene.is_planar()
    assert any("strip.gamma = 100.0 has no effect" in note for note in scene.notes())
    assert loads(text()).notes() == ()
    si = loads(text(SI, {"gravity.up": None}))
    assert si.gamma == 0.0
    assert any("strip.density" in note for note in si.notes())
    assert any("acceleration" in note for note in loads(text({"gravity.acceleration": "1.62"})).notes())
    both = loads(text({"strip.thickness": "1e-3", "shell.width_to_thickness": "20"}))
    assert any("strip.thickness is replaced" in note for note in both.notes())


def test_shell_needs_a_thickness():
    with pytest.raises(BadInput) as caught:
        require_shell(loads(text()))
    assert caught.value.key == "shell.width_to_thickness"
    assert "strip.thickness" in caught.value.remedy
    assert require_shell(loads(text({"strip.thickness": "3e-4"}))) == (pytest.approx(100.0),)
    assert require_shell(loads(text({"shell.width_to_thickness": "[20, 50]"}))) == (20.0, 50.0)
    assert require_shell(loads(text({"shell.width_to_thickness": "30"}))) == (30.0,)


def test_planarity():
    assert not loads(text()).is_planar()
    assert "t_x" in str(loads(text()).nonplanar_reason())
    assert loads(text(PLANAR)).is_planar()
    assert loads(text(PLANAR)).nonplanar_reason() is None
    assert loads(text({"strip.gamma": "0.0"})).is_planar()
    # a tenth of a milliradian of tilt about the tangent is not planar
    tilt = f"[{math.cos(1e-4)!r}, {math.sin(1e-4)!r}, 0.0]"
    assert not loads(text({"clamp.start.normal": tilt})).is_planar()


def test_a_scene_is_frozen():
    scene = loads(text())
    with pytest.raises(dataclasses.FrozenInstanceError):
        scene.title = "other"
    with pytest.raises(ValueError, match="read-only"):
        scene.frame[0, 0] = 5.0
    assert scene.frame[0, 0] != 5.0


def test_canonical_changes_with_everything_but_the_title():
    scene = loads(text())
    base = scene.canonical()
    json.dumps(base, allow_nan=False)
    assert loads(text({"title": '"another"'}), "elsewhere.toml").canonical() == base
    assert loads(text({"model.tolerance": "1e-3", "gravity.exact": "false"})).canonical() == base
    assert loads(text({"strip.length": "1", "strip.gamma": "1e2"})).canonical() == base
    changes = {
        "strip.length": 1.5,
        "strip.width": 0.04,
        "strip.thickness": 1e-3,
        "strip.poisson": 0.3,
        "strip.natural_curvature": [10.0, 9.0],
        "strip.gamma": 101.0,
        "gravity": None,
        "gravity.up": [0.0, 1.0, 0.0],
        "gravity.acceleration": 1.62,
        "clamp.start.position": [0.0, 0.0, 1.0],
        "clamp.start.tangent": [0.0, 0.0, -1.0],
        "clamp.start.normal": [1.0, 0.0, 0.0],
        "clamp.start.ruling": "free",
        "model.energy": "sadowsky",
        "model.elements": 21,
        "model.formulation": "chained",
        "seed.curvature": 1.0,
        "seed.ruling": 0.1,
        "shell.width_to_thickness": [20],
        "shell.elements": [50, 2],
    }
    for key, value in changes.items():
        assert scene.replace({key: value}).canonical() != base, key


# -- replacing keys ---------------------------------------------------------------------------------


def test_replace_is_checked_again_and_leaves_the_original():
    scene = loads(text())
    other = scene.replace({"strip.gamma": 50, "model.energy": "sadowsky", "clamp.start.position": (0.0, 0.0, 1.0)})
    assert (other.gamma, other.model.energy, other.position.tolist()) == (50.0, "sadowsky", [0.0, 0.0, 1.0])
    assert scene.gamma == 100.0
    assert other.title == scene.title
    assert scene.replace({"gravity.up": np.array([0.0, 1.0, 0.0])}).up.tolist() == [0.0, 1.0, 0.0]
    assert scene.replace({"gravity": None}).gamma == 0.0
    assert scene.replace({"seed.curvature": None}).canonical() == scene.canonical()
    for key, value in (
        ("strip.width", 2.0),
        ("strip.widht", 0.1),
        ("strip.width.x", 0.1),
        ("clamp.end.position", [0, 0, 1.5]),
    ):
        with pytest.raises(BadInput) as caught:
            scene.replace({key: value})
        assert caught.value.key.startswith(key.rpartition(".")[0])
        assert "\n" not in str(caught.value)
    with pytest.raises(BadInput, match=r"strip\.length: is missing"):
        scene.replace({"strip.length": None})


def test_replace_drops_the_other_way_to_say_it():
    si = loads(text(SI))
    assert si.replace({"strip.gamma": 7.0}).gamma == 7.0
    back = si.replace({"strip.gamma": 7.0}).replace({"strip.young": 1.8e9, "strip.density": 1000.0})
    assert back.canonical() == si.canonical()
    with pytest.raises(BadInput, match="conflicts"):
        si.replace({"strip.gamma": 7.0, "strip.young": 1e9})
    graded = loads(text({"model.element_lengths": "[0.25, 0.75]"}))
    assert graded.replace({"model.elements": 4}).model.lengths == (0.25,) * 4


@pytest.mark.parametrize(
    ("argument", "expected"),
    [
        ("strip.gamma=50", ("strip.gamma", 50)),
        (" strip.gamma = 5e1 ", ("strip.gamma", 50.0)),
        ("model.energy=sadowsky", ("model.energy", "sadowsky")),
        ('model.energy="sadowsky"', ("model.energy", "sadowsky")),
        ("gravity.up=[0.0, 1.0, 0.0]", ("gravity.up", [0.0, 1.0, 0.0])),
        ('title="a = b"', ("title", "a = b")),
        ("gravity.exact=true", ("gravity.exact", True)),
    ],
)
def test_parse_assignment(argument, expected):
    assert parse_assignment(argument) == expected


@pytest.mark.parametrize("argument", ["strip.gamma", "=5", "strip.gamma=", "a=[1", "a=1\nb=2", "a=3 cm"])
def test_parse_assignment_rejects(argument):
    with pytest.raises(BadInput) as caught:
        parse_assignment(argument)
    assert "\n" not in str(caught.value)
    assert "e.g." in caught.value.remedy


# -- round trip -------------------------------------------------------------------------------------

numbers = st.floats(-1e3, 1e3, allow_nan=False)


@st.composite
def rotations(draw) -> np.ndarray:
    quaternion = np.array([draw(st.floats(-1, 1)) for _ in range(4)]) + np.array([1e-3, 0, 0, 0])
    if np.linalg.norm(quaternion) < 1e-6:
        quaternion = np.array([1.0, 0, 0, 0])
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


@st.composite
def scenes(draw) -> Scene:
    """Any scene, made by replacing keys of a small one."""
    length = draw(st.floats(1e-3, 1e3))
    width = length * draw(st.floats(1e-4, 0.5))
    thickness = width * draw(st.floats(1e-3, 0.5))
    per_length = st.floats(-9e3, 9e3).map(lambda turn: turn / length)
    linear = st.one_of(per_length, st.tuples(per_length, per_length).map(list))
    piecewise = st.one_of(per_length, st.lists(per_length, min_size=1, max_size=5))
    frame = draw(rotations())
    keys: dict[str, object] = {
        "title": draw(st.text(st.characters(exclude_categories=("Cc", "Cs", "Zl", "Zp")), min_size=1)),
        "strip.length": length,
        "strip.width": width,
        "strip.poisson": draw(st.floats(-0.99, 0.5)),
        "strip.natural_curvature": draw(linear),
        "clamp.start.position": [draw(numbers) for _ in range(3)],
        "clamp.start.tangent": frame[:, 2],
        "clamp.start.normal": frame[:, 1],
        "clamp.start.ruling": draw(st.sampled_from(["free", "straight"])),
        "gravity.up": draw(rotations())[:, 0],
        "model.energy": draw(st.sampled_from(["auto", "sadowsky", "wunderlich"])),
        "model.formulation": draw(st.sampled_from(["auto", "mixed", "matrix"])),
        "model.held_by": draw(st.sampled_from(["elimination", "constraints"])),
        "seed.curvature": draw(st.one_of(st.just("natural"), piecewise)),
        "seed.ruling": draw(st.floats(-2, 2)),
        "shell.width_to_thickness": draw(st.one_of(st.none(), st.lists(st.floats(1.1, 1e4), min_size=1))),
        "shell.elements": draw(st.one_of(st.none(), st.tuples(st.integers(1, 500), st.integers(1, 9)))),
    }
    if draw(st.booleans()):
        density, acceleration = draw(st.floats(1, 1e5)), draw(st.floats(1e-3, 100))
        softest = 12.0 * density * acceleration * length**3 / thickness**2 / 1e11  # Gamma = 1e11
        young = softest * draw(st.floats(1.0, 1e12))
        keys |= {"strip.young": young, "strip.density": density}
        keys |= {"strip.thickness": thickness, "gravity.acceleration": acceleration}
    else:
        keys |= {"strip.gamma": draw(st.floats(0, 1e6)), "strip.thickness": draw(st.sampled_from([None, thickness]))}
    placing = draw(st.sampled_from(["element_lengths", "elements", "tolerance"]))
    if placing == "element_lengths":
        parts = np.array(draw(st.lists(st.floats(0.1, 1.0), min_size=3, max_size=6)))
        keys["model.element_lengths"] = length * parts / parts.sum()
    else:
        keys[f"model.{placing}"] = draw(st.integers(3, 300) if placing == "elements" else st.floats(1e-6, 0.09))
    start = np.array(keys["clamp.start.position"])
    if draw(st.booleans()):
        normal = draw(rotations())[:, 1]
        floor = {"point": start - (1e-3 * length + width) * normal, "normal": normal, "name": "floor"}
        keys["wall"] = [floor, {"point": start, "normal": normal, "stiffness": draw(st.floats(1e-3, 1e6))}]
    end = draw(st.sampled_from([None, "clamp", "circle", "moebius"]))
    if end == "clamp":
        frame = draw(rotations())
        keys["clamp.end.ruling"] = "straight"
        keys["clamp.end.tangent"], keys["clamp.end.normal"] = frame[:, 2], frame[:, 1]
    elif end is not None:
        keys["closure"] = {"kind": end, "ruling": draw(st.sampled_from(["free", "straight"]))}
        keys |= {"closure.turns": 2} if end == "circle" else {}
    if draw(st.booleans()):
        stage = {"gravity": False, "strip.width": 0.9 * width, "closure": False, "clamp.start.frame": "free"}
        keys["path"] = [stage, {"steps": 3, "seed": {"ruling": 0.5}, "clamp.start.tangent": [0.0, 0.6, 0.8]}]
        keys["path"][1]["clamp.start.normal"] = [1.0, 0.0, 0.0]
    return loads(text()).replace(keys)


@settings(max_examples=200)
@given(scenes())
def test_round_trip(scene):
    """TOML and back: the same scene to the last bit, and the same dimensionless numbers."""
    again = loads(scene.to_toml(), scene.source)
    assert again == scene
    assert again.canonical() == scene.canonical()
    assert again.given() == scene.given()
    assert again.gamma == scene.gamma
    assert json.loads(json.dumps(scene.canonical())) == scene.canonical()


def test_to_toml_comments_every_key():
    for name in shipped():
        for line in load(name).to_toml().splitlines():
            assert not line or line.startswith("[") or "  # " in line, line


def test_the_whole_edge_instead_of_corners_drops_their_size():
    scene = load("limits_7_3")
    assert scene.shell.corner == 0.01
    edge = scene.replace({"shell.clamp": "edge"})
    assert (edge.shell.clamp, edge.shell.corner) == ("edge", None)
    with pytest.raises(BadInput, match=r"shell\.corner"):
        scene.replace({"shell.clamp": "edge", "shell.corner": 0.02})
