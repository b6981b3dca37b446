"""Impossible and contradictory geometry is refused before anything is computed; what is just possible is not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from compare.scene.scene import loads
from tests.compare.scene.scene_texts import BASE, fault, text

NO_START = {f"clamp.start.{key}": None for key in ("position", "tangent", "normal")}
WEIGHTLESS = {"gravity.up": None}
PINNED = {"clamp.start.tangent": None, "clamp.start.normal": None}


def end(position: str, tangent: str | None = None, normal: str | None = None) -> dict[str, str | None]:
    return {"clamp.end.position": position, "clamp.end.tangent": tangent, "clamp.end.normal": normal}


def walls(*entries: tuple[str, str, str]) -> str:
    """Each wall as point, normal and further lines."""
    return "".join(f"[[wall]]\npoint = {point}\nnormal = {normal}\n{more}\n" for point, normal, more in entries)


# -- distance of the clamps -------------------------------------------------------------------------


@pytest.mark.parametrize("position", ["[0.0, 0.0, 1.5]", "[0.0, 0.0, 1.00000001]", "[1e300, 0.0, 1e300]"])
@pytest.mark.parametrize("start", [{}, PINNED])
def test_clamps_further_apart_than_the_length(position, start):
    error = fault(text(start, end(position)))
    assert error.key == "clamp.end.position"
    assert "further than strip.length = 1.0" in error.problem
    assert "within 1.0" in error.remedy


def test_the_furthest_point_is_offered_and_works():
    error = fault(text(PINNED, end("[3.0, 0.0, 4.0]")))
    assert "the furthest is [0.6000000000000001, 0.0, 0.8]" in error.remedy
    assert loads(text(PINNED, end("[0.6000000000000001, 0.0, 0.8]"))).end_frame is None


@pytest.mark.parametrize("position", ["[0.0, 0.0, 1.0]", "[0.0, 0.0, 0.9999999999]", "[0.0, 0.0, 1.0000000000001]"])
def test_stretched_straight(position):
    """At the full length only the straight strip is left: frames along the chord and equal to each other."""
    along = "[0.0, 0.0, 1.0]"
    same = "[-0.70710678118654757, 0.70710678118654757, 0.0]"
    assert loads(text(end(position, along, same))).end_position is not None
    assert loads(text(end(position))).end_frame is None
    assert loads(text(PINNED, end(position, along, "[1.0, 0.0, 0.0]"))).start_frame is None

    error = fault(text(end(position, "[1.0, 0.0, 0.0]", "[0.0, 1.0, 0.0]")))
    assert error.key == "clamp.end.tangent"
    assert error.value == [1.0, 0.0, 0.0]
    assert "give [0.0, 0.0, 1.0]" in error.remedy
    error = fault(text({"clamp.start.tangent": "[0.0, 0.0, -1.0]"}, end(position)))
    assert error.key == "clamp.start.tangent"
    error = fault(text(end(position, along, "[1.0, 0.0, 0.0]")))
    assert error.key == "clamp.end.normal"
    assert "-0.7071067811865" in error.remedy


def test_just_short_of_stretched_any_frame_is_possible():
    scene = loads(text(end("[0.0, 0.0, 0.999999]", "[1.0, 0.0, 0.0]", "[0.0, 1.0, 0.0]")))
    assert scene.end_position is not None
    assert scene.end_position[2] == 0.999999


@pytest.mark.parametrize("unit", [1e-300, 1e-3, 1e300])
def test_any_unit_of_length(unit):
    keys = {"strip.length": repr(unit), "strip.width": repr(0.03 * unit), "strip.natural_curvature": "0.0"}
    scene = loads(text(keys, end(f"[0.0, 0.0, {unit!r}]", "[0.0, 0.0, 1.0]", BASE["clamp.start.normal"])))
    assert scene.end_position is not None
    assert scene.end_position.tolist() == [0.0, 0.0, 1.0]
    assert fault(text(keys, end(f"[0.0, 0.0, {1.1 * unit!r}]"))).key == "clamp.end.position"


def test_the_ends_may_meet():
    assert loads(text(end("[0.0, 0.0, 0.0]"))).end_position is not None


# -- closures ---------------------------------------------------------------------------------------


def test_a_closed_band_has_no_end_to_clamp():
    error = fault(text({"closure.kind": '"moebius"'}, end("[0.0, 0.0, 0.5]")))
    assert error.key == "clamp.end"
    assert "contradicts closure.kind" in error.problem
    assert "[closure]" in error.remedy


@pytest.mark.parametrize("length", [1.0, 2.5])
def test_a_moebius_band_is_longer_than_root_three_widths(length):
    keys = {"closure.kind": '"moebius"', "strip.length": repr(length)}
    wide = length / math.sqrt(3.0)
    for width in (wide * (1.0 + 1e-9), 0.9 * length):
        error = fault(text(keys, {"strip.width": repr(width)}))
        assert error.key == "strip.width"
        assert error.value == width
        assert "10.48550/arXiv.2308.12641" in error.problem
        assert f"below {wide:.6g}" in error.remedy
        assert loads(text(keys, {"strip.width": repr(width), "closure.kind": '"circle"'})).closure is not None
    assert loads(text(keys, {"strip.width": repr(wide * (1.0 - 1e-9))})).closure is not None


@pytest.mark.parametrize("kind", ["circle", "moebius"])
def test_a_closed_band_needs_three_elements(kind):
    closed = {"closure.kind": f'"{kind}"'}
    error = fault(text(closed, {"model.elements": "2"}))
    assert (error.key, error.value) == ("model.elements", 2)
    assert "at least 3" in error.remedy
    error = fault(text(closed, {"model.element_lengths": "[0.5, 0.5]"}))
    assert error.key == "model.element_lengths"
    assert loads(text(closed, {"model.elements": "3"})).model.elements == 3


# -- walls ------------------------------------------------------------------------------------------

UP, DOWN = "[0.0, 0.0, 1.0]", "[0.0, 0.0, -1.0]"
LOW, HIGH = "[0.0, 3.0, -0.5]", "[7.0, 0.0, 0.5]"


def test_walls_without_room():
    assert loads(text(NO_START, WEIGHTLESS, extra=walls((LOW, UP, ""), (HIGH, DOWN, "")))).walls
    error = fault(text(NO_START, WEIGHTLESS, extra=walls((HIGH, UP, 'name = "floor"'), (LOW, DOWN, 'name = "roof"'))))
    assert error.key == "wall.roof.point"
    assert error.value == [0.0, 3.0, -0.5]
    assert "contradicts wall.floor" in error.problem
    assert "the gap is -1" in error.problem
    assert "turn both normals" in error.remedy


def test_a_gap_of_nothing_and_a_plate_are_possible():
    assert loads(text(NO_START, WEIGHTLESS, extra=walls((LOW, UP, ""), (LOW, DOWN, "")))).walls
    assert loads(text(NO_START, WEIGHTLESS, extra=walls((HIGH, UP, ""), (LOW, DOWN, "stiffness = 3.0")))).walls
    # the same two planes, but not facing away from each other
    assert loads(text(NO_START, WEIGHTLESS, extra=walls((HIGH, UP, ""), (LOW, UP, "")))).walls


@pytest.mark.parametrize("where", ["start", "end"])
def test_a_wall_through_a_clamp(where):
    """The clamped points stand at z = 0 (start) and z = 0.2 (end); the start's edge lies in z = 0."""
    keys = end("[0.0, 0.0, 0.2]", "[0.0, 0.0, 1.0]", "[0.0, 1.0, 0.0]")
    wall = ("[0.0, 0.0, 0.1]", UP if where == "start" else DOWN, "")
    error = fault(text(keys, extra=walls(wall)))
    assert error.key == f"clamp.{where}.position"
    assert "the held point stands 0.1 behind the wall" in error.problem
    assert "wall.0" in error.problem
    assert "move it by 0.1 along wall.0.normal" in error.remedy
    assert loads(text(keys, extra=walls((*wall[:2], "stiffness = 1.0")))).walls


def test_a_wall_through_the_clamped_edge():
    """t_x = (e_x + e_y)/sqrt 2 and w = 0.03: the corners stand 0.015/sqrt 2 in front of and behind x = 0."""
    corner = 0.015 * math.sqrt(0.5)
    normal = "[1.0, 0.0, 0.0]"
    error = fault(text(extra=walls((f"[{-corner + 2e-6!r}, 0.0, 0.0]", normal, ""))))
    assert error.key == "clamp.start.position"
    assert "a corner of the held edge stands 2e-06 behind the wall" in error.problem
    assert loads(text(extra=walls((f"[{-corner!r}, 0.0, 0.0]", normal, "")))).walls
    # a pin holds no edge
    assert loads(text(PINNED, extra=walls(("[0.0, 0.0, 0.0]", normal, "")))).walls


# -- weight -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "change",
    [
        {},
        {"closure.kind": '"circle"'},
        {"clamp.end.ruling": '"straight"'},
        {"clamp.end.tangent": "[1.0, 0.0, 0.0]", "clamp.end.normal": "[0.0, 1.0, 0.0]"},
    ],
)
def test_a_strip_held_at_no_point_falls(change):
    """up = e_x; a held frame or ruling holds no point."""
    error = fault(text(NO_START, change))
    assert error.key == "gravity.up"
    assert error.value == [1.0, 0.0, 0.0]
    assert "fall for ever" in error.problem
    assert "[clamp.start]" in error.remedy
    assert "[[wall]]" in error.remedy
    assert loads(text(NO_START, change, WEIGHTLESS)).gamma == 0.0
    assert loads(text(NO_START, change, {"strip.gamma": "0.0"})).gamma == 0.0
    assert loads(text(NO_START, change, extra=walls(("[0.0, 0.0, 0.0]", "[1.0, 0.0, 0.0]", "")))).walls
    beside = walls(("[0.0, 0.0, 0.0]", "[0.0, 1.0, 0.0]", ""), ("[1.0, 0.0, 0.0]", "[-1.0, 0.0, 0.0]", ""))
    assert "fall for ever" in fault(text(NO_START, change, extra=beside)).problem


def test_a_strip_on_a_slope_slides_away():
    slope = ("[0.0, 0.0, 0.0]", "[0.8, 0.6, 0.0]", "")
    error = fault(text(NO_START, extra=walls(slope)))
    assert error.key == "gravity.up"
    assert "slide away for ever" in error.problem
    assert "second wall" in error.remedy
    # a second wall makes a valley, or a plate stops it
    for normal, more in (("[0.8, -0.6, 0.0]", ""), ("[0.0, -1.0, 0.0]", "stiffness = 2.0")):
        assert loads(text(NO_START, extra=walls(slope, ("[0.0, 0.0, 0.0]", normal, more)))).walls
    along = walls(slope, ("[0.0, 0.0, 0.0]", "[0.0, 0.0, 1.0]", ""))
    assert "slide away" in fault(text(NO_START, extra=along)).problem


def test_a_table_level_to_rounding_carries():
    tilt = np.array([1.0, 1e-9, 0.0])
    assert loads(text(NO_START, extra=walls(("[0.0, 0.0, 0.0]", str(tilt.tolist()), "")))).walls


@pytest.mark.parametrize("position", ["clamp.start.position", "clamp.end.position"])
def test_one_held_point_is_enough(position):
    assert loads(text(NO_START, {position: "[0.0, 0.0, 0.0]"})).gamma == 100.0
