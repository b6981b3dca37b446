"""Shells on bodies: derivatives of the gaps, the elastica in a tube, balance, a large radius beside a plane, faces."""

from __future__ import annotations

import dataclasses
from functools import cache

import numpy as np
import pytest

from shellref import ShellOptions, ShellProblem
from shellref.contact.obstacles import Obstacle
from shellref.contact.walls import Wall
from shellref.inputs import ShellInputError
from shellref.path.newton import Equilibrium
from shellref.path.solve import solve
from shellref.shell.naghdi import NaghdiModel
from shellref.shell.problem import Waypoint
from shellref.shell.result import ShellStatus
from shellref.shell.strip import build_strip

AXIS, NORMAL = (0.6, 0.0, 0.8), (0.0, 1.0, 0.0)
BODIES = [
    Obstacle("sphere", (0.1, -0.2, 0.3), 0.4),
    Obstacle("sphere", (0.1, -0.2, 0.3), 1.4, inside=True),
    Obstacle("cylinder", (0.1, -0.2, 0.3), 0.4, AXIS),
    Obstacle("cylinder", (0.1, -0.2, 0.3), 1.4, AXIS, inside=True),
    Obstacle("box", (0.1, -0.2, 0.3), 0.1, AXIS, NORMAL, (0.5, 0.4, 0.6)),
    Obstacle("box", (0.1, -0.2, 0.3), 0.1, AXIS, NORMAL, (2.5, 2.4, 2.6), inside=True),
    Obstacle("edge", (0.1, -0.2, 0.3), 0.1, AXIS, NORMAL, angle=60.0),
    Obstacle("edge", (0.1, -0.2, 0.3), 0.1, AXIS, NORMAL, angle=130.0),
]
UP = (0.0, 1.0, 0.0)
BAR = Obstacle("cylinder", (0.0, -0.25, 0.6), 0.1, (1.0, 0.0, 0.0))


def heavy(body, elements=(30, 2), **keys):
    """A heavy cantilever that something stops."""
    return ShellProblem(
        **{"width": 0.1, "thickness": 2e-3, "poisson": 0.0, "gamma": 20.0, "up": UP, "elements": elements,
           "grading": (1.0, 1.0), "obstacles": (body,), **keys}
    )  # fmt: skip


@cache
def laid(body, contact="midsurface", elements=(30, 2)):
    return solve(heavy(body, elements, contact=contact))


@pytest.mark.parametrize("body", BODIES, ids=lambda b: f"{b.kind} {b.inside} {b.angle:g}")
def test_gradients_and_second_derivatives_are_those_of_the_gap(body):
    """Central differences; unit normals; a place behind the surface has a negative gap."""
    points = np.random.default_rng(3).uniform(-0.9, 0.9, (60, 3))
    for part in body.parts():
        at, step = part(points), 1e-5
        for k, e in enumerate(np.eye(3) * step):
            ahead, back = part(points + e), part(points - e)
            smooth = np.abs(ahead.bend - back.bend).max(axis=(1, 2)) < 1e-2  # not where a face turns into its edge
            smooth &= np.abs(ahead.normal - back.normal).max(axis=1) < 1e-2
            assert smooth.sum() > 40
            slope, bend = (ahead.value - back.value) / (2 * step), (ahead.normal - back.normal) / (2 * step)
            np.testing.assert_allclose(at.normal[smooth, k], slope[smooth], atol=1e-8)
            np.testing.assert_allclose(at.bend[smooth, :, k], bend[smooth], atol=1e-6)
        np.testing.assert_allclose(np.linalg.norm(at.normal, axis=1), 1.0, rtol=1e-12)


@pytest.mark.parametrize("body", BODIES, ids=lambda b: f"{b.kind} {b.inside} {b.angle:g}")
def test_the_gap_is_the_distance_from_the_surface(body):
    """A place moved by its gap against the normal is on the surface; a box and an edge beside their faces' planes."""
    points = np.random.default_rng(4).uniform(-0.9, 0.9, (60, 3))
    if not body.inside:
        (part,) = body.parts()
        before = part(points)
        outside = before.value > 0.0
        feet = points[outside] - before.value[outside, None] * before.normal[outside]
        np.testing.assert_allclose(part(feet).value, 0.0, atol=1e-12)
    if body.kind in ("box", "edge"):
        far = 0.5 * np.tile(body.size, 2) if body.kind == "box" else np.zeros(2)
        planes = points @ body.faces.T - far
        gaps = body.gaps(points + np.array(body.point), np.array(body.point))
        if body.inside:
            np.testing.assert_allclose(gaps, -planes.max(axis=1), atol=1e-12)
        else:
            assert np.all(gaps >= planes.max(axis=1) - 1e-12)


@pytest.mark.parametrize("contact", ["midsurface", "faces"])
def test_forces_and_moments_balance_and_nothing_goes_through(contact):
    """The bar's push, the clamp's and the weight; complementarity from the shape alone."""
    found = laid(BAR, contact)
    assert found.stable is True
    force = found.clamps["start"]["force"] + found.walls[0]["force"] - 20.0 * np.array(UP)
    assert np.abs(force).max() < 1e-7
    surface, lever = found.surface, 1e-3 if contact == "faces" else 0.0
    gaps = [
        BAR.gaps((surface.points + side * lever * surface.directors).reshape(-1, 3), np.array(BAR.point))
        for side in (1.0, -1.0)
    ]
    assert -1e-10 < np.min(gaps) < 1e-10
    assert found.walls[0]["force"][1] > 5.0
    assert found.contact["product"] < 1e-10
    assert 0.0 <= found.contact["penetration"] < 2e-4


def test_moments_balance():
    """About the origin, where the clamp is: its moment, the bar's and that of the weight."""
    found = laid(BAR)
    grid = build_strip(found.problem, ShellOptions()).body.grid
    areas = np.outer(grid.nodal_shares(0), grid.nodal_shares(1)) / 0.1
    weight = np.cross((areas[:, :, None] * found.surface.points).sum(axis=(0, 1)), -20.0 * np.array(UP))
    left = found.clamps["start"]["moment"] + found.walls[0]["moment"] + weight
    assert np.abs(left).max() < 1e-3 * np.abs(found.walls[0]["moment"]).max()


def test_faces_are_half_a_thickness_before_the_midsurface():
    """With its faces a strip meets a bar as one that is thicker by half a thickness."""
    thicker = dataclasses.replace(BAR, radius=BAR.radius + 1e-3)
    faces, middle = laid(BAR, "faces"), laid(thicker)
    np.testing.assert_allclose(faces.walls[0]["force"], middle.walls[0]["force"], rtol=2e-3)
    assert abs(laid(BAR).energy["total"] - middle.energy["total"]) > 5 * abs(
        faces.energy["total"] - middle.energy["total"]
    )


def test_a_large_radius_is_a_plane():
    """Energies tend to that on a wall, from both sides, as 1 / R."""

    def bar(radius, inside):
        centre = (0.0, -0.1 + (radius if inside else -radius), 0.0)
        return Obstacle("cylinder", centre, radius, (1.0, 0.0, 0.0), inside=inside)

    flat = solve(heavy(BAR, (20, 1), obstacles=(), walls=(Wall((0.0, -0.1, 0.0), UP),))).energy["total"]
    slopes = []
    for radius, inside in ((1e2, False), (1e4, False), (1e4, True)):
        slopes.append(radius * (solve(heavy(bar(radius, inside), (20, 1))).energy["total"] - flat))
    np.testing.assert_allclose(slopes[0], slopes[1], rtol=0.02)
    np.testing.assert_allclose(slopes[1], -slopes[2], rtol=1e-2)


@pytest.mark.parametrize(
    "body",
    [
        Obstacle("sphere", (0.0, -0.25, 0.6), 0.1),
        Obstacle("box", (0.0, -0.25, 0.6), 0.02, (1.0, 0.0, 0.0), UP, (0.3, 0.2, 0.2)),
        Obstacle("edge", (0.0, -0.15, 0.6), 0.02, (1.0, 0.0, 0.0), UP, angle=90.0),
        Obstacle("box", (0.0, 0.0, 0.5), 1.0, (1.0, 0.0, 0.0), UP, (1.0, 0.3, 1.2), inside=True),
    ],
    ids=lambda b: f"{b.kind} {b.inside}",
)
def test_all_kinds_stop_a_strip(body):
    """It touches, is stable, and forces balance."""
    found = laid(body)
    assert found.stable is True
    assert found.walls[0]["force"][1] > 1.0
    assert np.abs(found.clamps["start"]["force"] + found.walls[0]["force"] - 20.0 * np.array(UP)).max() < 1e-7
    assert found.contact["through"] < 1e-10


def test_the_tangent_is_the_derivative_of_the_residual():
    """Of the Lagrange function at a state on the bar, pushes kept: a central difference along a field."""
    found = laid(BAR)
    model = NaghdiModel(build_strip(found.problem, ShellOptions()).body, 0.01, engine="kernels")
    equilibrium = Equilibrium(model, ShellOptions())
    contact = equilibrium.contact
    s, v = model.nodes.T
    state = np.hstack([found.surface.evaluate(s, v), found.surface.director(s, v)])
    contact.begin(state, equilibrium.standing())
    contact.pushes = np.where(contact.active, 3.0, 0.0)
    field = np.random.default_rng(5).normal(size=state.shape)
    step = 1e-6
    forces = []
    for sign in (1.0, -1.0):
        contact.see(state + sign * step * field, equilibrium.standing())
        forces.append(contact.forces())
    contact.see(state, equilibrium.standing())
    bend = (contact.curvature() @ field.ravel()).reshape(field.shape)
    np.testing.assert_allclose(bend, (forces[0] - forces[1]) / (2 * step), atol=1e-6)
    assert np.abs(bend).max() > 1.0


def test_an_obstacle_moves_along_the_path():
    """Under its weight first, the bar out of reach; lifted by it then: the state that the bar stops on its way down."""
    low = Waypoint(gravity=1.0, name="weight", obstacles=((0.0, -0.45, 0.6),))
    moved = solve(heavy(BAR, path=(low,)))
    assert [step.stage for step in moved.steps][-1] == "walls"
    np.testing.assert_allclose(moved.energy["total"], laid(BAR).energy["total"], rtol=1e-9)
    np.testing.assert_allclose(moved.walls[0]["force"], laid(BAR).walls[0]["force"], rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize(
    ("key", "change"),
    [
        ("obstacles.kind", {"kind": "cone"}),
        ("obstacles.axis", {"axis": None}),
        ("obstacles.axis", {"axis": (1.0, 1.0, 0.0)}),
        ("obstacles.radius", {"radius": 0.0}),
        ("obstacles.normal", {"normal": UP}),
        ("obstacles.size", {"kind": "box", "normal": UP}),
        ("obstacles.radius", {"kind": "box", "normal": UP, "size": (0.1, 0.1, 0.1)}),
        ("obstacles.normal", {"kind": "edge", "normal": (1.0, 0.0, 0.0)}),
        ("obstacles.angle", {"kind": "edge", "normal": UP, "angle": 5.0}),
    ],
)
def test_what_an_obstacle_is_not(key, change):
    """One line that names the key."""
    with pytest.raises(ShellInputError) as error:
        dataclasses.replace(BAR, **change)
    assert error.value.key == key


@pytest.mark.parametrize(
    ("key", "change"),
    [
        ("obstacles[0].point", {"obstacles": (dataclasses.replace(BAR, point=(0.0, 0.0, 0.05)),)}),
        ("obstacles", {"clamp": "free", "gamma": 0.0, "up": None}),
        ("path.obstacles", {"path": (Waypoint(obstacles=((0.0, 0.0, 0.0),) * 2),)}),
    ],
)
def test_what_a_strip_beside_obstacles_cannot(key, change):
    """Before anything is computed."""
    with pytest.raises(ShellInputError) as error:
        heavy(BAR, **change)
    assert error.value.key == key


def test_a_bar_that_moves_far_in_a_step_does_not_go_through():
    """Thinner than a step is wide: straight steps from one side of the strip to the other are refused."""
    thin = dataclasses.replace(BAR, radius=0.01)
    equilibrium = Equilibrium(NaghdiModel(build_strip(heavy(thin), ShellOptions()).body, 0.01), ShellOptions())
    rows, path = equilibrium.contact.rows, equilibrium.model.body.walls
    flat = equilibrium.model.reference
    here = path.at(0.0, 0)
    below, above = (here._replace(centres=np.array([[0.0, y, 0.6]])) for y in (-0.02, 0.02))
    assert rows.passed(flat, flat, (below, above))
    assert not rows.passed(flat, flat, (below, below))
    lifted = flat + np.array([0.0, 0.04, 0.0, 0.0, 0.0, 0.0])
    assert not rows.passed(flat, lifted, (below, above))
    assert rows.passed(flat, flat - np.array([0.0, 0.04, 0.0, 0.0, 0.0, 0.0]), (below, below))


def test_a_flat_start_outside_of_its_tube_is_told_so_and_not_to_be_finer():
    """A strip across a tube of a fifteenth of its length, nothing else: as far out as geometry says."""
    radius = 1.0 / 15.0
    tube = Obstacle("cylinder", (0.0, radius, 0.0), radius, (1.0, 0.0, 0.0), inside=True)
    found = solve(heavy(tube, (10, 1), gamma=0.0, up=None))
    assert found.status is ShellStatus.NOT_CONVERGED
    assert f"{np.hypot(1.0, radius) - radius:.3g} l behind" in found.message
    assert "elements" not in found.message
