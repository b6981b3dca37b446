"""What the ribbon refuses as another model's: the remedy names a model that takes the scene as it is."""

from __future__ import annotations

import re

import pytest

from compare import registry
from compare.models.base import check_keys
from compare.models.effects.elsewhere import takers
from compare.pages.ribbon import advice
from compare.scene.scene import load, loads
from ribbonbench.errors import BadInput

HELD = """
[strip]
length = 0.3
width = 0.02
thickness = 2e-4
poisson = 0.35
young = 3.0e9
density = 1300.0
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
"""
END = """
[clamp.end]
position = [0.28, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
slide = [1.0, 0.0, 0.0]
"""
FLOOR = "[[wall]]\npoint = [0.0, 0.0, -0.05]\nnormal = [0.0, 0.0, 1.0]\n"
CURVED = HELD.replace("poisson", "transverse_curvature = 10.0\npoisson")
PULLED = HELD + "[tip]\nmoment = [0.0, 1e-3, 0.0]\n"
SCENES = {
    "slide": HELD + END, "slide on a wall": HELD + END + FLOOR, "tape with weight": CURVED, "moment": PULLED,
    "moment on a wall": PULLED + FLOOR,
    "tape": "tape_4_1", "rod": "rod_wrung", "twisted ring": "ring_twisted", "stem": "daisy_5g",
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_the_remedy_is_one(name):
    """Every model.energy that is named solves it; the shell does where it is named."""
    text = SCENES[name]
    scene = loads(text, name) if "[" in text else load(text)
    with pytest.raises(BadInput) as refused:
        check_keys(registry.model("ribbon"), scene)
    remedy = refused.value.remedy
    named = re.findall(r'"([a-z_]+)"', remedy)
    assert named or "ribbonbench shell" in remedy
    for energy in named:
        check_keys(registry.model(registry.name_for(energy)), scene.replace({"model.energy": energy}))
    assert ("ribbonbench shell" in remedy) == ("shell" in takers(scene))


def test_where_no_model_is_left_the_key_is_named():
    scene = loads(HELD + "[rod]\ntorsion = 1.0\n" + FLOOR, "rod on a wall")
    assert takers(scene) == ()
    with pytest.raises(BadInput, match=r"leave rod\S* out"):
        check_keys(registry.model("ribbon"), scene)


def test_where_walls_touch_segments_at_the_clamp_are_no_remedy():
    """Graded to the clamp such a state is no nearer (roof over a fold, 24 segments: 0.0215 l, graded 0.0234 l)."""
    free = load("cantilever").replace({"model.elements": 10, "model.grading": "uniform"})
    floor = {"point": [0.0, 0.0, -5.0], "normal": [0.0, 0.0, 1.0]}
    alone, beside = advice(free, 0.01), advice(free.replace({"wall": [floor]}), 0.01)
    assert alone is not None
    assert beside is not None
    assert ("model.grading" in alone, "model.grading" in beside) == (True, False)
    assert "model.tolerance" in beside
    assert advice(free, 1e-5) is None
