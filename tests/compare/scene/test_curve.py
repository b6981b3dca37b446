"""A drawn curve to begin in: read from a file beside the scene's, and refused with the place where it cannot be one."""

from __future__ import annotations

import re

import numpy as np
import pytest

from compare.models.ribbon.free import of_a_curve
from compare.models.ribbon.model import RibbonModel
from compare.scene.scene import load, loads
from ribbon.find.jointed import polygon
from ribbonbench.errors import BadInput
from tests.docs_blocks import DOCS, blocks

ROD = """
[strip]
length = 2.0
width = 0.02
thickness = 0.019
poisson = 0.3
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[clamp.end]
position = [0.0, 0.0, 0.8134]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[model]
energy = "kirchhoff"
elements = 40
[contact]
itself = true
distance = 0.02
section = "round"
[seed]
curve = "knot.csv"
"""


def drawn():
    points = 2.0 * polygon.overhand(0.4067)
    return points - points[0]


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "rod.toml").write_text(ROD)
    np.savetxt(tmp_path / "knot.csv", drawn(), delimiter=",", header="x,y,z", comments="")
    return tmp_path


def test_the_file_beside_the_scene_is_read_and_the_scene_stands_without_it(folder):
    scene = load(folder / "rod.toml")
    assert np.allclose(scene.seed_points, drawn() / 2.0, atol=1e-15)
    assert RibbonModel().refusal(scene) is None
    (folder / "knot.csv").unlink()
    assert loads(scene.to_toml(), scene.source) == scene
    moved = scene.replace({"model.elements": 50})
    assert moved.seed == scene.seed
    nudged = [list(point) for point in scene.seed.curve]
    nudged[20][0] += 1e-6
    assert scene.replace({"seed.curve": nudged}).canonical() != scene.canonical()


@pytest.mark.parametrize("rows", ["", "0,0\n1,1\n", "x,y,z\n0,0,one\n", None])
def test_a_file_that_is_no_curve_is_refused(folder, rows):
    (folder / "knot.csv").unlink() if rows is None else (folder / "knot.csv").write_text(rows)
    with pytest.raises(BadInput) as caught:
        load(folder / "rod.toml")
    assert caught.value.key == "seed.curve"


def refused(folder, points, **keys):
    scene = load(folder / "rod.toml")
    return of_a_curve(scene.replace({"seed.curve": points.tolist(), **keys}))


def test_a_ring_is_near_itself_at_its_seam_and_nowhere_else(folder):
    """Both clamps at one place: its seam is no fault; a trefoil whose strands are nearer than they are kept is one."""
    ring = {"clamp.end.position": [0.0, 0.0, 0.0]}
    for radius, near in ((0.2, False), (0.05, True)):
        points = 2.0 * polygon.trefoil(radius)
        turn = polygon.onto((points[1] - points[0]) / np.linalg.norm(points[1] - points[0]), np.array([0.0, 0.0, 1.0]))
        fault = refused(folder, (points - points[0]) @ turn.T, **ring)
        assert (fault is not None) == near
        assert fault is None or "from itself at s" in fault.problem


@pytest.mark.parametrize("name", ["trefoil.toml", "plectoneme.toml"])
def test_the_documented_knots_are_not_refused(name):
    (block,) = [block for block in blocks((DOCS / "scenes.md").read_text()) if block.file == name]
    assert RibbonModel().refusal(loads(block.text, name)) is None


def test_a_curve_that_comes_near_itself_is_refused_with_the_place(folder):
    """The strands of the knot, where parts keep more than they are apart; it is right where they keep less."""
    found = refused(folder, drawn(), **{"contact.distance": 0.15})
    assert found is not None
    s, other = (float(number) for number in re.findall(r"s'? = ([0-9.]+)", found.problem))
    assert 0.0 < s < other - 4.0 * 0.15 < 2.0
    assert refused(folder, drawn()) is None


@pytest.mark.parametrize(
    ("change", "part"),
    [
        (lambda p: p[:, :] * 1.3 * [1.0, 1.0, 1.0 / 1.3], "long"),
        (lambda p: np.add(p, [0.0, 0.1, 0.0]), "start"),
        (lambda p: np.vstack([p[:-1], p[-1] + [0.03, 0.0, -0.005]]), "end"),
        (lambda p: p[:3], "points"),
        (lambda p: np.vstack([p[:5], p[4:]]), "where the one before"),
    ],
)
def test_a_curve_that_is_too_long_or_elsewhere_is_refused(folder, change, part):
    found = refused(folder, change(drawn()))
    assert found is not None
    assert part in found.problem


@pytest.mark.parametrize(
    ("key", "value", "named"),
    [
        ("model.energy", "finite", "model.in_plane"),
        ("model.energy", "wunderlich", "seed.curve"),
        ("model.in_plane", False, "seed.curve"),
        ("clamp.end.position", "free", "seed.curve"),
        ("contact.section", "strip", None),
    ],
)
def test_who_begins_in_it(folder, key, value, named):
    found = of_a_curve(load(folder / "rod.toml").replace({key: value}))
    assert (None if found is None else found.key) == named


def test_segments_that_follow_are_of_a_round_rod(folder):
    scene = load(folder / "rod.toml").replace({"contact.joints": "follow"})
    assert scene.follows
    assert of_a_curve(scene) is None
    assert of_a_curve(scene.replace({"model.energy": "finite"})).key == "contact.joints"
    assert of_a_curve(scene.replace({"model.elements": None, "model.tolerance": 1e-3})).key == "model.tolerance"
    for key, value in (("contact.section", "strip"), ("contact.itself", False)):
        with pytest.raises(BadInput) as caught:
            scene.replace({key: value})
        assert caught.value.key == "contact.joints"


def test_a_curve_and_a_curvature_say_the_same_thing_twice(folder):
    with pytest.raises(BadInput) as caught:
        load(folder / "rod.toml").replace({"seed.curvature": 1.0})
    assert caught.value.key == "seed.curvature"
