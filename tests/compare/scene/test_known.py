"""Numbers beyond what the models are known to work for are refused by name, before anything is computed."""

from __future__ import annotations

import math

import pytest

from compare.scene.declare import Kind, Known
from compare.scene.keys import KEYS
from compare.scene.scene import load, loads
from ribbon.strip import KNOWN
from ribbonbench.errors import BadInput
from tests.compare.scene.scene_texts import SI, fault, text

#: Changes of a scene, and the key that is refused.
BEYOND = [
    ({"strip.natural_curvature": "1e200"}, "strip.natural_curvature"),
    ({"strip.natural_curvature": "[0.0, -1e10]"}, "strip.natural_curvature"),
    ({"strip.natural_curvature": "1e5"}, "strip.natural_curvature"),
    ({"strip.gamma": "1e13"}, "strip.gamma"),
    ({"strip.width": "1e-9"}, "strip.width"),
    ({"strip.thickness": "1e-12"}, "strip.thickness"),
    (SI | {"strip.young": "1e-9"}, "strip.young"),
    ({"clamp.start.position": "[0.0, 0.0, 1e308]"}, "clamp.start.position"),
    ({"seed.curvature": "99999"}, "seed.curvature"),
    ({"seed.ruling": "1e6"}, "seed.ruling"),
    ({"tip.force": "[0.0, 0.0, 1e13]"}, "tip.force"),
    ({"tip.load": "1e13"}, "tip.load"),
    ({"tip.moment": "[6.28, 0.0, 1e308]"}, "tip.moment"),
    ({"wall": '[{point = [0.0, 0.0, -1e9], normal = [0.0, 0.0, 1.0], name = "roof"}]'}, "wall.roof.point"),
    ({"wall": "[{point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0], stiffness = 1e30}]"}, "wall.0.stiffness"),
    ({"rod.torsion": "1e30"}, "rod.torsion"),
    ({"rod.natural_twist": "1e9"}, "rod.natural_twist"),
    ({"model.tolerance": "1e-300"}, "model.tolerance"),
    ({"shell.start_curvature": "1e6"}, "shell.start_curvature"),
    ({"shell.width_to_thickness": "[20, 1e9]"}, "shell.width_to_thickness"),
    ({"path": '[{"strip.natural_curvature" = 1e7}]'}, "path[0].strip.natural_curvature"),
]


@pytest.mark.parametrize(("changes", "key"), BEYOND)
def test_what_is_beyond_is_refused_by_name(changes, key):
    error = fault(text(changes))
    assert error.key == key
    assert "known to work for" in error.problem


@pytest.mark.parametrize(
    "changes",
    [
        {"strip.natural_curvature": "[-3000.0, 1e4]"},
        {"strip.gamma": "1e9"},
        {"strip.gamma": "1e12"},
        {"strip.width": "1e-6"},
        {"strip.thickness": "1e-6"},
        {"clamp.start.position": "[8e5, -3e5, 0.0]"},
        {"seed.curvature": "[-1e4, 1e4]"},
        {"strip.length": "1e200", "strip.width": "1e198", "strip.natural_curvature": "1e-197"},
    ],
)
def test_what_the_hard_cases_ask_for_is_taken(changes):
    """The ends of the battery's ladders: curl, weight, narrow and thin strips, places far away; any unit of length."""
    loads(text(changes))


def test_every_number_has_its_range():
    """A range with two ends, or numbers that are known to work: lengths alone have no size of their own."""
    open_ended = {"strip.length", "path.steps", "model.elements", "shell.elements"}  # counts: MAX_ELEMENTS
    for name, key in KEYS.items():
        if key.unit is None or key.kind is Kind.DIRECTION or name in open_ended:
            continue
        bounded = key.range is not None and key.range.high is not None
        assert bounded or key.known is not None, name


def test_scenes_and_strips_made_in_python_have_the_same_ranges():
    """Arguments of `ribbon` beside the keys they are in a scene."""
    pairs = {
        "width": "strip.width", "thickness": "strip.thickness", "natural_curvature": "strip.natural_curvature",
        "gamma": "strip.gamma", "position": "clamp.end.position", "point": "wall.point", "radius": "obstacle.radius",
            "rounding": "obstacle.rounding", "size": "obstacle.size",
        "stiffness": "wall.stiffness", "natural_twist": "strip.natural_twist",
        "natural_geodesic_curvature": "strip.natural_geodesic_curvature", "turns": "closure.turns", "tip": "tip.force",
        "seed_curvature": "seed.curvature", "seed_ruling": "seed.ruling", "segments": "model.element_lengths",
    }  # fmt: skip
    assert set(pairs) == set(KNOWN)
    for name, dotted in pairs.items():
        known, (_, least, most) = KEYS[dotted].known, KNOWN[name]
        assert known is not None
        low = known.low if known.low > -math.inf else KEYS[dotted].range.low
        high = known.high if known.high < math.inf or name != "segments" else 1.0
        assert (low, high) == (least, most), name


def test_a_shipped_scene_turned_up_is_refused():
    with pytest.raises(BadInput, match=r"K l = 1e\+07"):
        load("cantilever").replace({"strip.natural_curvature": 1e7})


@pytest.mark.parametrize("written", ["K l", "K l < 1", "1 <= K"])
def test_a_range_that_says_none_is_no_declaration(written):
    with pytest.raises(ValueError, match="no numbers"):
        Known.of(written)
