"""Sliders of scenes: what they are made from, what they change, what goes back to where it was."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from compare.models.choice import chosen
from compare.pages.live.sliders import Slider, changed, keys_of, sliders, value_of
from compare.scene.scene import load, loads, shipped
from ribbonbench.errors import BadInput
from tests.compare.scene.test_obstacles import TEXT


def of(scene) -> dict[str, Slider]:
    return {one.name: one for one in sliders(scene, chosen(scene))}


@pytest.mark.parametrize("name", shipped())
def test_every_slider_of_a_shipped_scene_stands_in_its_stretch_and_changes_its_key_alone(name):
    scene = load(name).replace({"path": None})
    model = chosen(scene)
    found = of(scene)
    assert {"strip.poisson", "strip.width"} & set(found) or scene.strip.second_moment
    assert changed(scene, model, {one: slider.value for one, slider in found.items()}) == scene
    for one, slider in found.items():
        assert slider.low <= slider.value <= slider.high, one
        assert slider.low < slider.high, one
        assert not slider.log or slider.low > 0.0, one
        value = 0.99 * slider.value + 0.01 * slider.high
        moved = keys_of(scene, {one: value})
        try:
            there = changed(scene, model, {one: value})
        except BadInput:
            continue  # what this scene cannot be: a turn out of the plane, a clamp behind a wall
        assert there != scene or value == slider.value, one
        assert there.replace({key: value_of(scene, key) for key in moved}).canonical() == scene.canonical(), one


def test_a_turn_is_one_rotation_about_fixed_axes():
    scene = load("two_clamps_5_3_2")
    turns = (20.0, -35.0, 50.0)
    there = changed(scene, chosen(scene), {f"clamp.end.turn.{k}": turn for k, turn in enumerate(turns)})
    expected = Rotation.from_rotvec(np.radians(turns)).as_matrix() @ scene.end_frame
    assert there.end_frame == pytest.approx(expected, abs=1e-14)
    assert there.end_position == pytest.approx(scene.end_position)


def test_walls_move_along_their_normals_and_obstacles_anywhere():
    scene = loads(TEXT, "bars")
    values = {"wall.0.offset": -0.05, "obstacle.0.point.2": 0.25, "obstacle.0.radius": 0.06}
    there = changed(scene, chosen(scene), values)
    assert there.walls[0].point == pytest.approx((0.0, -0.45, 0.0))
    assert there.obstacles[0].point == pytest.approx((0.0, -0.1, 0.25))
    assert there.obstacles[0].radius == 0.06
    assert there.obstacles[1] == scene.obstacles[1]


def test_a_linear_curvature_has_two_sliders_and_a_table_none():
    linear = load("curl_4_3").replace({"strip.natural_curvature": [4.0, 8.0]})
    found = of(linear)
    assert (found["strip.natural_curvature.0"].value, found["strip.natural_curvature.1"].value) == (4.0, 8.0)
    there = changed(linear, chosen(linear), {"strip.natural_curvature.1": 9.0})
    assert there.strip.natural_curvature == (4.0, 9.0)
    table = linear.replace({"strip.natural_curvature": [[0.0, 4.0], [0.5, 6.0], [1.0, 9.0]]})
    assert not [name for name in of(table) if "curvature" in name]


@pytest.mark.parametrize("value", [float("nan"), float("inf"), "3", None, True])
def test_what_is_no_number_is_refused_by_name(value):
    scene = load("curl_4_3")
    with pytest.raises(BadInput, match=r"strip\.gamma"):
        changed(scene, chosen(scene), {"strip.gamma": value})
