"""The way from one scene to another: what moves, what switches, and that every scene on it is a good one."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from compare.scene.homotopy import between
from compare.scene.scene import loads
from ribbonbench.errors import BadInput
from tests.compare.scene.scene_texts import SI, text

END = {
    "clamp.end.position": "[0.0, 0.0, 0.5]",
    "clamp.end.tangent": "[0.0, 0.0, 1.0]",
    "clamp.end.normal": "[0.0, 1.0, 0.0]",
}
WALLS = (
    '[[wall]]\npoint = [-0.5, 0.0, 0.0]\nnormal = [1.0, 0.0, 0.0]\nname = "floor"\n'
    "[[wall]]\npoint = [0.5, 0.0, 0.0]\nnormal = [-1.0, 0.0, 0.0]\nstiffness = 2.0\n"
)
BASE = loads(text(END, {"model.elements": "20"}, extra=WALLS))


def turned(frame: np.ndarray, end: str = "end") -> dict[str, object]:
    """The keys of a clamp with this frame, 3x3 with columns t_x, t_y, t_z."""
    return {f"clamp.{end}.tangent": frame[:, 2], f"clamp.{end}.normal": frame[:, 1]}


# -- what moves -------------------------------------------------------------------------------------

LINEAR = [
    ("strip.length", 1.4, lambda s: s.strip.length, 1.0, 1.4),
    ("strip.width", 0.05, lambda s: s.strip.width, 0.03, 0.05),
    ("strip.poisson", 0.2, lambda s: s.strip.poisson, 0.4, 0.2),
    ("strip.natural_curvature", [20, 0], lambda s: s.strip.natural_curvature, (10.0, 10.0), (20.0, 0.0)),
    ("strip.gamma", 0.0, lambda s: s.gamma, 100.0, 0.0),
    ("gravity.acceleration", 1.81, lambda s: s.gravity.acceleration, 9.81, 1.81),
    ("clamp.start.position", [0.1, 0.0, 0.2], lambda s: s.start_position, (0.0, 0.0, 0.0), (0.1, 0.0, 0.2)),
    ("clamp.end.position", [0.2, 0.4, 0.7], lambda s: s.end_position, (0.0, 0.0, 0.5), (0.2, 0.4, 0.7)),
    ("wall.floor.point", [-0.1, 0.0, 3.0], lambda s: s.walls[0].point, (-0.5, 0.0, 0.0), (-0.1, 0.0, 3.0)),
    ("wall.1.stiffness", 6.0, lambda s: s.walls[1].stiffness, 2.0, 6.0),
]


@pytest.mark.parametrize(("key", "value", "of", "start", "end"), LINEAR, ids=[case[0] for case in LINEAR])
def test_numbers_and_points_move_linearly(key, value, of, start, end):
    path = between(BASE, BASE.replace({key: value}))
    assert path.continuous
    assert path.switched == ()
    for t in (0.0, 0.25, 0.9, 1.0):
        expected = (1.0 - t) * np.array(start) + t * np.array(end)
        np.testing.assert_allclose(of(path(t)), expected, rtol=1e-14, atol=1e-15)


def test_the_ends_are_exact():
    """t = 0 and t = 1 give the scenes themselves, with what only they carry (here a path, a seed, a title)."""
    first = BASE.replace({"path": [{"strip.gamma": 3.0}], "title": "first"})
    last = BASE.replace({"strip.gamma": 1.0 / 3.0, "seed.curvature": [1.0, 2.0, 3.0], "title": "last"})
    path = between(first, last)
    assert path(0.0) is first
    assert path(1.0) is last
    assert (path.first, path.last) == (first, last)
    middle = path(0.5)
    assert middle.path == ()
    assert middle.title == "last"
    assert middle.seed == last.seed
    assert between(last, first)(0.5).path == ()


def test_si_scenes_move_in_young_and_density():
    one = loads(text(SI))
    path = between(one, one.replace({"strip.young": 3.6e9, "strip.density": 2000.0, "strip.thickness": 2e-4}))
    assert path.switched == ()
    middle = path(0.5)
    assert (middle.strip.young, middle.strip.density, middle.strip.thickness) == pytest.approx((2.7e9, 1500.0, 1.5e-4))


def test_several_keys_move_together():
    last = BASE.replace({"strip.gamma": 50.0, "strip.width": 0.04, "clamp.end.position": [0.0, 0.0, 0.8]})
    middle = between(BASE, last)(0.5)
    assert middle.gamma == 75.0
    assert middle.width == pytest.approx(0.035)
    assert middle.end_position[2] == pytest.approx(0.65)


# -- frames and directions --------------------------------------------------------------------------


@pytest.mark.parametrize("end", ["start", "end"])
@pytest.mark.parametrize("angle", [1e-6, 0.3, math.pi / 2, 3.1])
def test_frames_turn_at_a_constant_rate_about_a_fixed_axis(end, angle):
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    before = BASE.start_frame if end == "start" else BASE.end_frame
    scene = BASE.replace({"wall": None})
    path = between(scene, scene.replace(turned(Rotation.from_rotvec(angle * axis).as_matrix() @ before, end)))
    assert path.continuous
    for t in (0.0, 0.2, 0.5, 0.9, 1.0):
        frame = getattr(path(t), f"{end}_frame")
        np.testing.assert_allclose(frame, Rotation.from_rotvec(t * angle * axis).as_matrix() @ before, atol=4e-15)
        np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-15)


@settings(max_examples=60)
@given(st.integers(0, 10**6), st.floats(0.0, 1.0))
def test_the_shortest_rotation_between_any_two_frames(seed, t):
    """Orthonormal and right-handed everywhere; the two parts of the way add up to the whole, at most half a turn."""
    one, other = Rotation.random(2, random_state=seed)
    first = loads(text()).replace(turned(one.as_matrix(), "start"))
    last = first.replace(turned(other.as_matrix(), "start"))
    scene = between(first, last)(t)
    np.testing.assert_allclose(scene.frame.T @ scene.frame, np.eye(3), atol=1e-15)
    assert np.linalg.det(scene.frame) == pytest.approx(1.0, abs=1e-14)
    whole = (one.inv() * other).magnitude()
    assert (one.inv() * Rotation.from_matrix(scene.frame)).magnitude() == pytest.approx(t * whole, abs=1e-7)
    assert (Rotation.from_matrix(scene.frame).inv() * other).magnitude() == pytest.approx((1 - t) * whole, abs=1e-7)


def test_positions_stay_linear_while_the_frame_turns():
    frame = Rotation.from_rotvec([0.0, 1.0, 0.0]).as_matrix() @ BASE.end_frame
    path = between(BASE, BASE.replace(turned(frame) | {"clamp.end.position": [0.3, 0.0, 0.1]}))
    np.testing.assert_allclose(path(0.5).end_position, [0.15, 0.0, 0.3], atol=1e-15)
    np.testing.assert_allclose(path(0.5).end_frame[:, 2], [math.sin(0.5), 0.0, math.cos(0.5)], atol=1e-15)


@pytest.mark.parametrize("key", ["gravity.up", "wall.floor.normal"])
@pytest.mark.parametrize("angle", [1e-9, 1.0, 3.1])
def test_directions_turn_along_their_great_circle(key, angle):
    scene = BASE.replace({"wall.1": None, "wall.floor.stiffness": 1.0})  # a rigid one would sweep over the clamps
    path = between(scene, scene.replace({key: [math.cos(angle), math.sin(angle), 0.0]}))
    assert path.continuous
    for t in (0.0, 0.3, 0.7, 1.0):
        now = path(t)
        direction = now.up if key == "gravity.up" else now.wall_normals[0]
        np.testing.assert_allclose(direction, [math.cos(t * angle), math.sin(t * angle), 0.0], atol=1e-15)


@pytest.mark.parametrize(
    ("keys", "key", "offered"),
    [
        ({"clamp.end.normal": [0.0, -1.0, 0.0]}, "clamp.end.tangent", '"clamp.end.tangent"'),
        (
            {"clamp.end.tangent": [0.0, 0.0, -1.0], "clamp.end.normal": [0.0, -1.0, 0.0]},
            "clamp.end.tangent",
            "a quarter turn",
        ),
        ({"clamp.start.tangent": [0.0, 0.0, -1.0]}, "clamp.start.tangent", '"clamp.start.tangent"'),
        ({"gravity.up": [-1.0, 0.0, 0.0]}, "gravity.up", "right angle"),
        ({"wall.floor.point": [9, 0, 0], "wall.floor.normal": [-1, 0, 0]}, "wall.floor.normal", "right angle"),
    ],
)
def test_half_a_turn_asks_for_a_stage_in_between(keys, key, offered):
    with pytest.raises(BadInput, match="no shortest way round") as caught:
        between(BASE, BASE.replace(keys))
    assert caught.value.key == key
    assert caught.value.value is not None
    assert "[[path]] stage in between" in caught.value.remedy
    assert offered in caught.value.remedy


def test_just_less_than_half_a_turn_has_a_shortest_way():
    angle = math.pi - 1e-6
    path = between(BASE, BASE.replace({"clamp.end.normal": [math.sin(angle), math.cos(angle), 0.0]}))
    np.testing.assert_allclose(path(0.5).end_frame[:, 1], [1.0, 0.0, 0.0], atol=1e-6)


# -- what switches ----------------------------------------------------------------------------------

SWITCHES = [
    ({"gravity": None}, ("gravity",)),
    ({"gravity.exact": True}, ("gravity.exact",)),
    ({"clamp.end": None}, ("clamp.end",)),
    ({"clamp.start": None}, ("clamp.start",)),
    ({"clamp.end.ruling": "free"}, ("clamp.end.ruling",)),
    ({"clamp.end.frame": "free"}, ("clamp.end.frame", "clamp.end.ruling")),
    ({"clamp.end.frame": "free", "clamp.end.ruling": "straight"}, ("clamp.end.frame",)),
    ({"clamp.end.position": "free"}, ("clamp.end.position",)),
    ({"clamp.end": None, "closure.kind": "moebius"}, ("clamp.end", "closure")),
    ({"wall": None}, ("wall",)),
    ({"wall.1.stiffness": None}, ("wall.1.stiffness",)),
    ({"model.energy": "sadowsky"}, ("model.energy",)),
    ({"model.elements": 40}, ("model.elements",)),
    ({"model.formulation": "mixed"}, ("model.formulation",)),
    ({"model.held_by": "constraints"}, ("model.held_by",)),
    ({"model.tolerance": 1e-3}, ("model.elements", "model.grading", "model.tolerance")),
    ({"strip.thickness": 1e-3}, ("model.accuracy", "strip.thickness")),
    ({"strip.thickness": 1e-3, "model.energy": "finite"}, ("model.energy", "strip.thickness")),
]


@pytest.mark.parametrize(("keys", "switched"), SWITCHES, ids=[str(case[1]) for case in SWITCHES])
@pytest.mark.parametrize("there", [True, False])
def test_what_cannot_be_interpolated_switches_at_once(keys, switched, there):
    pair = (BASE, BASE.replace(keys))
    path = between(*(pair if there else pair[::-1]))
    assert not path.continuous
    assert sorted(path.switched) == sorted(switched)
    assert path(0.0) is path.first
    for t in (1e-9, 0.5, 1.0):
        assert path(t) is path.last


def test_closures_switch_key_by_key():
    one = BASE.replace({"clamp.end": None, "closure.kind": "circle", "closure.turns": 2})
    assert between(one, one.replace({"closure.turns": 3})).switched == ("closure.turns",)
    assert between(one, one.replace({"closure.ruling": "straight"})).switched == ("closure.ruling",)


def test_a_switch_beside_a_move_takes_the_last_value_from_the_start():
    path = between(BASE, BASE.replace({"strip.gamma": 50.0, "model.elements": 40, "clamp.end.ruling": "free"}))
    assert path.continuous
    assert set(path.switched) == {"model.elements", "clamp.end.ruling"}
    early = path(1e-6)
    assert early.model.elements == 40
    assert early.clamp_end.ruling == "free"
    assert early.gamma == pytest.approx(100.0, abs=1e-4)


def test_nothing_to_do():
    for last in (BASE, BASE.replace({"title": "another", "seed.ruling": 0.1, "shell.elements": [9, 2]})):
        path = between(BASE, last)
        assert not path.continuous
        assert path.switched == ()


# -- every scene on the way is a good one -----------------------------------------------------------


def test_element_lengths_grow_with_the_strip():
    first = loads(text({"model.element_lengths": "[0.25, 0.75]"}))
    last = first.replace({"strip.length": 3.0, "model.element_lengths": [0.75, 2.25]})
    path = between(first, last)
    assert path.switched == ()
    assert path(0.5).model.element_lengths == pytest.approx((0.5, 1.5))
    other = between(first, last.replace({"model.element_lengths": [1.5, 1.5]}))
    assert other.switched == ("model.element_lengths",)
    assert other(0.5).model.lengths == pytest.approx((0.5, 0.5))


def test_a_seed_too_steep_for_the_width_on_the_way_is_left_out():
    first = loads(text({"strip.width": "0.3"}))
    last = first.replace({"strip.width": 0.03, "seed.ruling": [0.0, 50.0]})
    path = between(first, last)
    assert path(0.5).seed.ruling == (0.0, 0.0)
    assert path(0.99).seed.ruling == (0.0, 50.0)


@pytest.mark.parametrize("t", [1e-12, 1e-6, 0.5, 1.0 - 1e-12])
def test_from_stretched_straight_to_bent_and_turned(t):
    first = BASE.replace({"wall": None, "clamp.start.normal": [0, 1, 0], "clamp.end.position": [0, 0, 1]})
    keys = turned(Rotation.from_rotvec([3.0, 0.0, 0.0]).as_matrix() @ first.end_frame)
    path = between(first, first.replace(keys | {"clamp.end.position": [0.0, 0.3, 0.4]}))
    assert path(t).end_position[2] == pytest.approx(1.0 - 0.6 * t)


def test_a_way_through_a_wall_is_refused_where_it_happens():
    """The wall swings round the clamped point: both ends are good, the middle is not."""
    first = loads(text(extra='[[wall]]\npoint = [-0.5, 0.0, 0.0]\nnormal = [1.0, 0.0, 0.0]\nname = "door"\n'))
    last = first.replace({"wall.door.normal": [0.0, 0.0, 1.0], "wall.door.point": [0.5, 0.0, 0.0]})
    path = between(first, last)
    assert path(0.1).walls
    with pytest.raises(BadInput, match=r"wrong side of wall\.door") as caught:
        path(0.6)
    assert caught.value.key == "clamp.start.position"
    assert "0.6 of it behind" in caught.value.problem
    assert "[[path]] stage in between" in caught.value.remedy


@pytest.mark.parametrize("t", [-0.1, 1.1, math.nan])
def test_t_outside_the_way(t):
    with pytest.raises(ValueError, match="0 <= t <= 1"):
        between(BASE, BASE.replace({"strip.gamma": 1.0}))(t)


def test_the_stages_of_a_path_chain_up():
    scene = BASE.replace({"path": [{"strip.gamma": 0.0}, {"clamp.end.position": [0.0, 0.0, 0.9], "gravity": False}]})
    stages = scene.stages()
    ways = [between(*pair) for pair in pairwise(stages)]
    assert [path.continuous for path in ways] == [True, True]
    assert [path.switched for path in ways] == [("gravity",), ("gravity",)]
    assert ways[1](0.5).gamma == 50.0
    assert ways[1](0.5).end_position[2] == pytest.approx(0.7)


PULLED = loads(text({"tip.force": "[0.0, 4.0, 0.0]", "tip.tension": "2.0", "strip.gamma": None, "gravity.up": None}))


def test_loads_at_the_end_grow_from_nothing_and_turn_linearly():
    bare = PULLED.replace({"tip": False})
    for path, at in ((between(bare, PULLED), 0.25), (between(PULLED, bare), 0.75)):
        assert path.continuous
        assert path.switched == ()
        np.testing.assert_allclose(path(at).tip_force, 0.25 * PULLED.tip_force, rtol=1e-14)
    path = between(PULLED, PULLED.replace({"tip.force": [2.0, 0.0, 0.0]}))
    np.testing.assert_allclose(path(0.5).tip_force, [1.0, 2.0, 2.0], rtol=1e-14)


def test_a_load_at_an_end_that_is_held_later_switches():
    held = PULLED.replace({"tip": False, "clamp.end.position": [0.0, 0.0, 0.5]})
    assert "tip" in between(PULLED, held).switched
