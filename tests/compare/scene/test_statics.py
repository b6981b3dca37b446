"""What holds a strip can hold it: a scene and the ribbon's own interface refuse the same, to the same tolerances."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from compare.scene.scene import loads
from ribbon import Clamp, Gravity, RibbonInputError, Strip
from ribbon.contact import Wall
from ribbon.find.solving import check
from ribbonbench import statics
from ribbonbench.errors import BadInput
from tests.compare.scene import held_scenes

LENGTH, WIDTH, UP = 2.0, 0.1, (0.0, 0.0, 1.0)


def refused(function) -> bool:
    try:
        function()
    except (BadInput, RibbonInputError):
        return True
    return False


@pytest.mark.parametrize("part", [0.5, 0.99, 1.01, 2.0])
def test_behind_a_wall(part):
    """A held point, and the corners of a held edge: the edge across is level here, so that all stand as deep."""
    height = -part * statics.BEHIND_WALL * LENGTH
    text = held_scenes.FLOOR.replace("position = [0.0, 0.0, 0.4]", f"position = [0.0, 0.0, {height!r}]")
    strip = Strip(LENGTH, WIDTH, gamma=40.0)
    clamp = Clamp(position=(0.0, 0.0, height), tangent=(1.0, 0.0, 0.0), normal=UP)
    walls = (Wall(point=(0.0, 0.0, 0.0), normal=UP),)
    by_scene = refused(lambda: loads(text))
    problem = SimpleNamespace(strip=strip, start=clamp, end=None, walls=walls)
    assert by_scene == refused(lambda: check.walls(problem)) == (part > 1.0)


@pytest.mark.parametrize("part", [0.5, 0.9, 1.1, 2.0])
def test_carried_by_a_wall(part):
    """A strip that nothing holds lies on a wall that is tilted by a small angle: it leaves that part of the weight."""
    angle = part * statics.UNSUPPORTED
    normal = (math.sin(angle), 0.0, math.cos(angle))
    text = held_scenes.FLOOR.replace("normal = [0.0, 0.0, 1.0]\n[model]", f"normal = {list(normal)}\n[model]")
    start = text.index("[clamp.start]")
    text = text[:start] + text[text.index("[[wall]]") :]
    walls = (Wall(point=(0.0, 0.0, 0.0), normal=normal),)
    problem = SimpleNamespace(start=None, end=None, gravity=Gravity(up=UP), has_gravity=True, walls=walls)
    by_scene = refused(lambda: loads(text))
    assert by_scene == refused(lambda: check.carried(problem)) == (part > 1.0)


def test_a_corner_carries_what_no_wall_of_it_does():
    roof = np.array([[math.sqrt(0.5), 0.0, math.sqrt(0.5)], [-math.sqrt(0.5), 0.0, math.sqrt(0.5)]])
    assert statics.is_carried(roof, UP)
    assert not statics.is_carried(roof[:1], UP)
    assert not statics.is_carried(-roof, UP)
    assert not statics.is_carried([], UP)
    assert statics.depth([[0.0, 0.0, -0.25], [3.0, 1.0, 0.5]], (5.0, 5.0, 0.0), UP) == pytest.approx([0.25, -0.5])
