"""Boxes and edges: gaps and their derivatives, nearest points of rulings, rooms of planes, and strips over them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

from compare.scene.inputs.bodies import Body
from ribbon import Clamp, Gravity, Strip, solve
from ribbon.errors import RibbonInputError
from ribbon.solid import Solid
from tests.validation.ribbon import edges

TURN = Rotation.from_rotvec([0.4, -0.2, 0.9]).as_matrix()
AXES = {"axis": TURN[:, 0], "normal": TURN[:, 1]}
BOX = Solid("box", (0.1, -0.2, 0.3), 0.05, size=(0.6, 0.4, 0.3), **AXES)
EDGES = [Solid("edge", (0.1, -0.2, 0.3), 0.05, angle=angle, **AXES) for angle in (20.0, 90.0, 150.0)]
POINTS = np.random.default_rng(7).uniform(-1.0, 1.0, (400, 3))
UP = (0.0, 1.0, 0.0)


@pytest.mark.parametrize("body", [BOX, *EDGES])
def test_gap_normal_and_bend_are_derivatives_of_each_other(body):
    gaps, normals, bends = body.derivatives(POINTS)
    outside = gaps > -0.04  # in the core the nearest face jumps
    step = 1e-6
    for axis in np.eye(3):
        ahead, behind = (body.derivatives(POINTS + side * step * axis) for side in (1.0, -1.0))
        slope = (ahead[0] - behind[0]) / (2.0 * step)
        assert np.abs(slope - normals @ axis)[outside].max() < 1e-5
        alike = outside & (np.abs(ahead[2] - behind[2]).max(axis=(1, 2)) < 1e-3)  # B jumps where a face turns round
        turned = (ahead[1] - behind[1]) / (2.0 * step)
        assert np.abs(turned - bends @ axis)[alike].max() < 1e-5
        assert alike.sum() > 0.5 * outside.sum()
    assert np.abs(np.linalg.norm(normals, axis=1) - 1.0).max() < 1e-12


@pytest.mark.parametrize("body", [BOX, *EDGES])
def test_gaps_are_those_of_the_projection_on_the_core(body):
    """A second implementation, which projects."""
    size = None if body.size is None else np.asarray(body.size)
    own = Body(body.kind, np.asarray(body.point), body.radius, np.asarray(body.axis), np.asarray(body.normal), size,
               body.angle, False)  # fmt: skip
    gaps, normals = own.facing(POINTS)
    mine = body.derivatives(POINTS)
    assert np.abs(mine[0] - gaps).max() < 1e-12 or np.abs(mine[0] - gaps)[gaps > -body.radius].max() < 1e-12
    assert np.abs(mine[1] - normals)[gaps > -body.radius].max() < 1e-10


@pytest.mark.parametrize("body", [BOX, *EDGES])
def test_nearest_of_a_ruling_is_its_least_gap(body):
    ways = np.random.default_rng(8).normal(size=(60, 3))
    middle = POINTS[:60] * 2.0
    found = body.nearest(middle, ways)
    least = body.gaps(middle + found[:, None] * ways)
    for k in np.flatnonzero(least > 0.0):
        other = minimize_scalar(lambda v, k=k: float(body.gaps((middle[k] + v * ways[k])[None])[0]), bounds=(-1.0, 1.0),
                                method="bounded", options={"xatol": 1e-12}).fun  # fmt: skip
        assert least[k] <= other + 1e-12
    assert np.abs(found).max() <= 1.0


def test_the_rim_of_a_table_is_that_of_shooting():
    place, force = edges.off(1e-3, 40)
    assert place < 2e-6
    assert force < 0.1
    assert np.subtract(*(edges.shot(r)[0] for r in (0.0, 1e-3))) == pytest.approx(5.6e-4, rel=0.02)  # a rounding tells


def test_an_oblique_rim_turned_and_mirrored_holds_the_same_strip():
    assert abs(edges.moved(True)) < 1e-8
    found, wall = edges.over(1e-3, 40, 10.0), edges.over(1e-3, 40, 10.0).walls[0]
    assert found.ok
    assert found.penetration < 1e-6
    assert wall.contacts.size == 2
    assert abs(found.start.force + wall.force - [0.0, edges.GAMMA, 0.0]).max() < 1e-6
    assert np.cross([0.0, -edges.BELOW, edges.AWAY], [1.0, 0.0, 0.0]) @ wall.force != 0.0


def test_a_room_is_its_planes_and_one_force():
    room = Solid("box", (0.0, 0.0, 0.5), 0.0, (1.0, 0.0, 0.0), True, UP, (0.4, 0.3, 1.9))
    found = solve(Strip(1.0, 0.05, 0.3, gamma=60.0), Clamp(), Gravity(UP), walls=[room], segments=20)
    assert found.ok
    assert found.penetration < 1e-6
    assert len(found.problem.walls) == 6
    (wall,) = found.walls
    assert abs(found.start.force + wall.force - [0.0, 60.0, 0.0]).max() < 1e-6
    assert found.end.position[1] == pytest.approx(-0.15, abs=1e-6)


@pytest.mark.parametrize(
    ("key", "what"),
    [("kind", {"kind": "cone"}), ("normal", {"normal": None}), ("normal", {"normal": (1.0, 0.0, 0.0)}),
     ("radius", {"radius": 0.0}), ("radius", {"radius": 0.2}), ("size", {"size": (1.0, 0.0, 1.0)}),
     ("size", {"kind": "edge"}), ("angle", {"kind": "edge", "size": None, "angle": 5.0})],
)  # fmt: skip
def test_what_is_no_body_is_refused(key, what):
    whole = {"kind": "box", "point": (0.0, 0.0, 0.0), "radius": 0.01, "axis": (1.0, 0.0, 0.0), "normal": UP,
             "size": (0.4, 0.4, 0.4)}  # fmt: skip
    with pytest.raises(RibbonInputError) as caught:
        Solid(**{**whole, **what})
    assert caught.value.key == key
