"""What a scene whose ribbon has a free twist must have, and what it cannot: the key that the refusal names."""

from __future__ import annotations

import pytest

from compare.models import solve
from compare.models.ribbon.free import refusal
from compare.scene.scene import load
from ribbonbench.errors import BadInput

CASES = {
    "several w/h": ({"model.energy": "finite"}, "shell.width_to_thickness"),
    "no thickness": ({"model.energy": "finite", "shell": None}, "strip.thickness"),
    "a rod without thickness": (
        {"model.energy": "kirchhoff", "clamp.start.ruling": None, "shell": None}, "strip.thickness",
    ),
    "a straight ruling": (
        {"model.energy": "extensible", "shell.width_to_thickness": [50.0]}, "clamp.start.ruling",
    ),
    "a stiffness that is the rod's": (
        {"model.energy": "finite", "model.stiffness": "plate", "shell.width_to_thickness": [50.0]}, "model.stiffness",
    ),
    "a stiffness of a developable strip": ({"model.stiffness": "plate"}, "model.stiffness"),
    "a developable strip bent in its plane": ({"model.in_plane": True}, "model.in_plane"),
    "bent to a few thicknesses": (
        {"model.energy": "finite", "strip.thickness": 0.01, "strip.natural_curvature": 30.0,
         "shell.width_to_thickness": None}, "strip.natural_curvature",
    ),
    "so thin that no section relaxes": (
        {"model.energy": "finite", "strip.thickness": 2e-8, "shell.width_to_thickness": None}, "strip.thickness",
    ),
    "the thesis's unknowns": (
        {"model.energy": "finite", "model.formulation": "matrix", "shell.width_to_thickness": [50.0]},
        "model.formulation",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_what_cannot_be_is_refused_by_its_key(case):
    changes, key = CASES[case]
    scene = load("curl_4_3").replace(changes)
    found = refusal(scene)
    assert found is not None
    assert found.key == key
    assert "\n" not in str(found)
    with pytest.raises(BadInput) as refused:
        solve(scene, "ribbon")
    assert refused.value.key == key


@pytest.mark.parametrize(
    "changes",
    [
        {"model.energy": "finite", "shell.width_to_thickness": [50.0]},
        {"model.energy": "sadowsky_kt", "clamp.start.ruling": None},
        {"model.energy": "kirchhoff", "model.stiffness": "plate", "clamp.start.ruling": None,
         "shell.width_to_thickness": [50.0]},
        {"model.energy": "wunderlich"},
    ],
)  # fmt: skip
def test_what_can_be_is_not(changes):
    assert refusal(load("curl_4_3").replace(changes)) is None
