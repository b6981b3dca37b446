"""`[[obstacle]]` in a scene: read, refused before anything is computed, changed by keys, moved along a path."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from compare import registry
from compare.models.base import check_keys
from compare.models.ribbon.build import ribbon_walls
from compare.scene.homotopy import between as way_between
from compare.scene.inputs.through import check_wound
from compare.scene.scene import Scene, loads
from ribbon import Wall
from ribbon.obstacle import Obstacle
from ribbonbench.accepted import accepting
from ribbonbench.errors import BadInput

TEXT = """
[strip]
length = 0.5
width = 0.02
thickness = 5e-4
poisson = 0.3
gamma = 20.0
[gravity]
up = [0.0, 1.0, 0.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[[wall]]
name = "floor"
point = [0.0, -0.4, 0.0]
normal = [0.0, 1.0, 0.0]
[[obstacle]]
name = "bar"
kind = "cylinder"
point = [0.0, -0.1, 0.3]
axis = [1.0, 0.0, 0.0]
radius = 0.05
[[obstacle]]
kind = "sphere"
point = [0.0, -0.1, 0.0]
radius = 1.0
inside = true
[model]
elements = 12
"""


def scene() -> Scene:
    return loads(TEXT, "bars")


def test_it_is_read_and_handed_to_the_ribbon_in_units_of_the_length():
    walls = ribbon_walls(scene())
    assert walls[0] == Wall((0.0, -0.8, 0.0), (0.0, 1.0, 0.0))
    assert walls[1] == Obstacle("cylinder", (0.0, -0.2, 0.6), 0.1, (1.0, 0.0, 0.0))
    assert walls[2] == Obstacle("sphere", (0.0, -0.2, 0.0), 2.0, inside=True)
    assert scene().barrier_names == ("floor", "bar", "obstacle_1")


def test_what_is_written_is_read_again():
    again = loads(scene().to_toml(), "bars")
    assert again.obstacles == scene().obstacles
    assert again.canonical() == scene().canonical()
    moved = scene().replace({"obstacle.bar.radius": 0.06, "obstacle.1.point": [0.0, 0.0, 0.1]})
    assert moved.obstacles[0].radius == 0.06
    assert moved.obstacles[1].point == (0.0, 0.0, 0.1)
    assert {"obstacle.kind", "obstacle.inside"} <= scene().given()


def test_a_scene_without_is_the_one_it_was():
    assert "obstacle" not in scene().replace({"obstacle": None}).canonical()


@pytest.mark.parametrize(
    ("key", "changes"),
    [
        ("obstacle.0.kind", {"obstacle.0.kind": "cone"}),
        ("obstacle.0.radius", {"obstacle.0.radius": 0.0}),
        ("obstacle.bar.radius", {"obstacle.0.radius": 1e-6}),
        ("obstacle.0.axis", {"obstacle.0.axis": [1.0, 1.0, 0.0]}),
        ("obstacle.0.axis", {"obstacle.0.axis": None}),
        ("obstacle.0.axis", {"obstacle.0.kind": "sphere"}),
        ("obstacle.0.inside", {"obstacle.0.inside": "yes"}),
        ("obstacle.0.name", {"obstacle.0.name": "floor"}),
        ("obstacle.0.name", {"obstacle.0.name": "2"}),
        ("obstacle.0.stiffness", {"obstacle.0.stiffness": 1.0}),
        ("obstacle.rod.radius", {"obstacle.rod.radius": 1.0}),
        ("clamp.start.position", {"obstacle.0.point": [0.0, -0.02, 0.0]}),
        ("clamp.start.position", {"obstacle.0.point": [0.012, 0.0, 0.0], "obstacle.0.axis": [0.0, 0.0, 1.0],
                                  "obstacle.0.radius": 0.005}),
        ("clamp.start.position", {"obstacle.1.radius": 0.05}),
        ("clamp.start.tangent", {"obstacle.0.point": [0.0, 0.0, 0.05]}),
        ("clamp.start.tangent", {"obstacle.0.point": [0.0, 0.099679484355, 0.0], "obstacle.0.radius": 0.1,
                                 "obstacle.0.axis": [0.6, 0.0, 0.8], "obstacle.0.inside": True}),
        ("model.formulation", {"wall": None, "model.formulation": "chained"}),
        ("gravity.up", {"clamp": None, "wall": None, "obstacle.0.axis": [0.0, 1.0, 0.0], "obstacle.1": None}),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_by_its_key(key: str, changes: dict[str, Any]):
    with pytest.raises(BadInput) as caught:
        scene().replace(changes)
    assert caught.value.key == key
    assert caught.value.remedy


@pytest.mark.parametrize("model", ["antman", "curve_angle"])
def test_models_without_it_refuse_it_by_name(model):
    changed = scene().replace({"wall": None, "model.energy": model})
    with pytest.raises(BadInput) as caught:
        check_keys(registry.model(model), changed)
    assert caught.value.key.startswith("obstacle.")


def test_it_moves_along_a_path():
    """Point and radius linearly, the axis along its great circle; what it is switches."""
    turned = {"obstacle.0.point": [0.0, -0.2, 0.3], "obstacle.0.radius": 0.07, "obstacle.0.axis": [0.8, 0.0, 0.6]}
    between = way_between(scene(), scene().replace(turned))(0.5)
    assert between.obstacles[0].point == pytest.approx((0.0, -0.15, 0.3))
    assert between.obstacles[0].radius == pytest.approx(0.06)
    half = 0.5 * np.arccos(0.8)
    assert between.obstacles[0].axis == pytest.approx((np.cos(half), 0.0, np.sin(half)))
    one = scene().replace({"obstacle.1": None})
    assert "obstacle" in way_between(scene(), one).switched
    stages = scene().replace({"path": [{"obstacle.bar.point": [0.0, -0.3, 0.3]}]})
    assert stages.path[0].changes == (("obstacle.bar.point", (0.0, -0.3, 0.3)),)
    with pytest.raises(BadInput, match="keeps its name"):
        scene().replace({"path": [{"obstacle.bar.name": "rod"}]})
    with pytest.raises(BadInput, match="obstacles here"):
        scene().replace({"path": [{"obstacle.rod.radius": 1.0}]})


def test_a_bar_that_is_lifted_bears_more_of_the_weight():
    """Along a path, and as from the start: the same state; forces by name, penetration and balance judged."""
    low = scene().replace({"wall": None, "obstacle.1": None, "model.energy": "sadowsky"})
    ways = low.replace({"path": [{"obstacle.bar.point": [0.0, -0.12, 0.3]}]})
    states = [registry.model("ribbon").solve(one) for one in (low, ways)]
    assert all(state.ok for state in states)
    assert states[1].energy.total == pytest.approx(states[0].energy.total, abs=1e-6)
    (bar,) = states[0].supports.walls
    assert bar["name"] == "bar"
    below = registry.model("ribbon").solve(low.replace({"obstacle.bar.point": [0.0, -0.12, 0.3]}))
    assert below.supports.walls[0]["force"][1] < bar["force"][1]
    assert states[0].numbers["penetration"] < 1e-6


def test_a_straight_strip_that_begins_through_a_body_is_told_so():
    """A box that stands higher than it was meant to, its size along the wrong axes; turned round there is no note."""
    text = """
[strip]
length = 0.3
width = 0.012
poisson = 0.3
gamma = 5.0
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[[obstacle]]
name = "crate"
kind = "box"
point = [0.09, 0.0, -0.06]
axis = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
size = [0.10, 0.3, 0.10]
"""
    (note,) = [note for note in loads(text, "crate").notes() if "begins through" in note]
    assert "obstacle crate, from s = 0.04" in note
    assert "0.05 deep" in note
    upright = loads(text.replace("0.3, 0.10]", "0.1, 0.3]"), "crate")
    seeded = loads(text + "[seed]\ncurvature = 2.0\n", "crate")
    led = loads(text + '[[path]]\n"obstacle.crate.point" = [0.09, 0.0, -0.3]\n', "crate")
    for scene in (upright, seeded, led):
        assert not [note for note in scene.notes() if "begins through" in note]


@pytest.mark.parametrize(("normal", "curvature"), [("1.0", "-500"), ("-1.0", "500")])
def test_a_straight_strip_that_begins_outside_of_its_tube_is_told_the_seed_that_lies_in_it(normal, curvature):
    """It reaches out by nearly its length; with the seed it lies along the wall, and there is no note."""
    text = f"""
[strip]
length = 0.3
width = 0.002
poisson = 0.3
[clamp.start]
position = [0.0, -0.002, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, {normal}, 0.0]
[[obstacle]]
name = "tube"
kind = "cylinder"
point = [0.0, 0.0, 0.0]
axis = [1.0, 0.0, 0.0]
radius = 0.002
inside = true
"""
    (note,) = [note for note in loads(text, "tube").notes() if "begins outside" in note]
    assert "obstacle tube" in note
    assert "up to 0.298 away" in note
    assert f"curvature = {curvature} and model.elements = 150 " in note
    assert not [n for n in loads(text + f"[seed]\ncurvature = {curvature}.0\n", "tube").notes() if "begins" in n]


def _in_a_tube(radius: float) -> Scene:
    text = """
[strip]
length = 0.3
width = 0.01
thickness = 1e-4
poisson = 0.3
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[model]
energy = "sadowsky"
elements = 20
[[obstacle]]
name = "tube"
kind = "cylinder"
point = [0.0, 0.0, RADIUS]
axis = [0.0, 1.0, 0.0]
radius = RADIUS
inside = true
"""
    return loads(text.replace("RADIUS", str(radius)), "tube")


def test_the_seed_and_the_segments_that_a_narrow_tube_is_told_to_need_give_an_answer():
    """30 rad along the wall on 20 segments: what the note says is taken at its word."""
    scene = _in_a_tube(0.01)
    (note,) = [note for note in scene.notes() if "outside of obstacle tube" in note]
    (curvature,) = re.findall(r"\[seed\] curvature = (-?[0-9.]+)", note)
    (elements,) = re.findall(r"model.elements = ([0-9]+)", note)
    assert (float(curvature), int(elements)) == (-100.0, 30)
    told = scene.replace({"seed.curvature": float(curvature), "model.elements": int(elements)})
    state = registry.model("ribbon").solve(told)
    assert state.status.code == "converged"
    assert state.numbers["penetration"] < 1e-6
    assert "model.elements" not in "".join(_in_a_tube(0.02).notes())


def test_a_tube_too_narrow_for_its_strip_is_refused_before_anything_is_computed():
    """600 rad along the wall; along the axis, on demand, or wide enough it is not."""
    narrow = _in_a_tube(0.0005)
    with pytest.raises(BadInput, match="600 rad"):
        check_wound(narrow)
    with accepting(True):
        check_wound(narrow)
    check_wound(_in_a_tube(0.00101))
    along = {"strip.width": 5e-4, "obstacle.tube.axis": [1.0, 0.0, 0.0], "obstacle.tube.point": [0.0, 0.0, 2.5e-4]}
    check_wound(narrow.replace(along))
