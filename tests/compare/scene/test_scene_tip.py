"""Loads at the end of the strip, `[tip]`: what they add up to, and what is wrong about them in one line."""

from __future__ import annotations

import numpy as np
import pytest

from compare.scene.scene import loads
from tests.compare.scene.scene_texts import PLANAR, SI, fault, text

GUIDED = {
    "clamp.end.position": '"free"', "clamp.end.tangent": "[0.0, 0.6, 0.8]", "clamp.end.normal": "[1.0, 0.0, 0.0]",
}  # fmt: skip
HELD = GUIDED | {"clamp.end.position": "[0.0, 0.0, 0.5]"}
FREE = {"clamp.start.tangent": None, "clamp.start.normal": None}
WEIGHTLESS = {"strip.gamma": None, "gravity.up": None}


@pytest.mark.parametrize("units", [{}, SI], ids=["D w / l^2", "N"])
def test_all_loads_of_the_tip_add_up(units):
    """load is always in D w / l^2; force and tension are in N where Young's modulus is given."""
    keys = {"tip.load": "2.0", "tip.force": "[0.1, -0.2, 0.3]", "tip.tension": "-0.5"}
    scene = loads(text(units, PLANAR, keys))
    newton = 1.0 if not units else 1.0 / scene.units.force
    expected = -2.0 * scene.up + newton * (np.array([0.1, -0.2, 0.3]) - 0.5 * scene.frame[:, 2])
    np.testing.assert_allclose(scene.tip_force, expected, rtol=1e-12)
    assert loads(scene.to_toml()).canonical() == scene.canonical()


@pytest.mark.parametrize(
    ("end", "along"), [({}, [0.0, 0.0, 1.0]), (GUIDED, [0.0, 0.6, 0.8]), (FREE | GUIDED, [0.0, 0.6, 0.8])]
)
def test_a_tension_is_along_the_guided_end_or_the_start(end, along):
    scene = loads(text(WEIGHTLESS, end, {"tip.tension": "3.0"}))
    np.testing.assert_allclose(scene.tip_force, 3.0 * np.array(along), rtol=1e-15)
    assert scene.guided is bool(end)


def test_a_path_moves_the_force():
    scene = loads(text(WEIGHTLESS, {"tip.force": "[0.0, 2.0, 0.0]"}, extra='[[path]]\n"tip.force" = [0.0, 1.0, 0.0]\n'))
    assert [stage.tip_force[1] for stage in scene.stages()] == [1.0, 2.0]


@pytest.mark.parametrize(
    ("change", "key", "problem", "remedy"),
    [
        (HELD | {"tip.tension": "1.0"}, "tip.tension", "is the clamp's reaction", "clamp.end.position"),
        (HELD | {"tip.force": "[1.0, 0.0, 0.0]"}, "tip", "clamp.end holds", "remove [tip]"),
        ({"closure.kind": '"circle"', "tip.load": "1.0"}, "tip", "[closure] leaves none", "remove"),
        (FREE | {"tip.tension": "1.0"}, "tip.tension", "has no direction", "tip.force"),
        (
            {"clamp.start.position": '"free"', "tip.force": "[1.0, 0.0, 0.0]"} | WEIGHTLESS,
            "tip", "pulls the strip away", "[clamp.start]",
        ),
        ({"tip.force": "[1.0, nan, 0.0]"}, "tip.force", "finite", "force at s = length"),
        ({"tip.force": "[1.0, 0.0]"}, "tip.force", "three numbers", "force at s = length"),
        ({"tip.tension": "inf"}, "tip.tension", "not finite", "tangent of clamp.end"),
        (SI | {"tip.tension": "1e308"}, "tip.tension", "out of range", "N"),
        ({"tip.pull": "1.0"}, "tip.pull", "not a known key", "tension"),
    ],
)  # fmt: skip
def test_bad_loads(change, key, problem, remedy):
    error = fault(text(change))
    assert (error.key, problem in str(error), remedy in error.remedy) == (key, True, True), str(error)


def test_an_empty_section_says_what_can_stand_there():
    assert fault(text(extra="[tip]\n")).key == "tip.force"
