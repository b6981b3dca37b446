"""Shells on walls: against the elastica, resultants, complementarity from the shape alone, inertia, bad input."""

from __future__ import annotations

import dataclasses
import math
from functools import cache

import numpy as np
import pytest
from scipy.special import gamma as Gamma

from shellref import ShellOptions, ShellProblem
from shellref.contact.active import Contact
from shellref.contact.walls import Wall
from shellref.inputs import ShellInputError
from shellref.path.newton import Equilibrium
from shellref.path.solve import solve
from shellref.shell.problem import Waypoint
from shellref.shell.strip import build_strip
from tests.reference import squeezed_ring

UPRIGHT = ((-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))  # t_x = -e_x, t_y = e_z, t_z = e_y
TABLE = Wall((0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
LYING = {"width": 0.1, "thickness": 2e-3, "poisson": 0.3, "gamma": 20.0, "up": (0.0, 1.0, 0.0), "clamp": "free"}


def plates(gap, stiffness=None):
    """The lower plate, rigid, and the upper one, `gap` apart at rest, the middle between them at y = 0."""
    lower, upper = (0.0, -0.5 * gap, 0.0), (0.0, 0.5 * gap, 0.0)
    return Wall(lower, (0.0, 1.0, 0.0)), Wall(upper, (0.0, -1.0, 0.0), stiffness)


def ring(gap, elements=(40, 2), stiffness=None, **keys):
    """A circle held at one side, where its tangent is upright, between plates; nu = 0: it stays a cylinder."""
    return ShellProblem(
        **{
            **{"width": 0.1, "thickness": 1e-3, "poisson": 0.0, "clamp_frame": UPRIGHT, "half_turns": 0},
            **{"start_curvature": -2.0 * math.pi, "elements": elements, "grading": (1.0, 1.0)},
            **{"walls": plates(gap, stiffness), **keys},
        }
    )


@cache
def squeezed(gap, elements=(40, 2), contact="midsurface", stiffness=None):
    return solve(ring(gap, elements, stiffness, contact=contact))


def test_the_shooting_is_the_closed_form():
    """Flat on the plates kappa^2 = P sin theta: lengths and heights are beta functions."""
    one, other = (
        0.5 * math.sqrt(math.pi) * Gamma(0.5 * (p + 1.0)) / Gamma(0.5 * p + 1.0)
        for p in (-0.5, 0.5)  # int sin^p
    )
    force, gap = squeezed_ring.spreads()
    np.testing.assert_allclose([force, gap], [16.0 * one**2, 0.5 * other / one], rtol=1e-9)
    found = squeezed_ring.squeezed(0.15)
    force = (2.0 * other / 0.15) ** 2
    expected = [force, 2.0 * math.sqrt(force) * other, 0.25 - one / math.sqrt(force)]
    np.testing.assert_allclose(found, expected, rtol=1e-8)
    np.testing.assert_allclose(squeezed_ring.squeezed(0.999 / math.pi).energy, 2.0 * math.pi**2, rtol=1e-4)


@pytest.mark.parametrize("gap", [0.28, 0.2])
def test_a_ring_between_plates_is_the_elastica(gap):
    """Before and after the contact spreads: force and energy; it touches where the elastica does, to an element."""
    exact, found = squeezed_ring.squeezed(gap), squeezed(gap)
    assert found.stable is True
    force = [wall["force"][1] for wall in found.walls]
    np.testing.assert_allclose(force, [exact.force, -exact.force], rtol=2e-3)
    np.testing.assert_allclose(found.energy["total"], exact.energy, rtol=1e-4)
    assert np.abs(found.clamps["start"]["force"]).max() < 1e-5 * exact.force
    for wall, middle in zip(found.walls, (0.75, 0.25), strict=True):
        ends = wall["lines"].min(), wall["lines"].max()
        np.testing.assert_allclose(ends, [middle - exact.flat, middle + exact.flat], atol=1.0 / 80.0)


def on_walls(result):
    """From the shape alone: least gap of the places, pulls, and products of gap and push, of every wall."""
    surface, problem = result.surface, result.problem
    sides = (0.5, -0.5) if problem.contact == "faces" else (0.0,)
    for wall, found in zip(problem.walls, result.walls, strict=True):
        height = found["height"] or 0.0
        for side in sides:
            points = surface.points + side * problem.thickness * surface.directors
            yield float(np.min(points @ np.array(wall.normal))) - wall.offset - height
        gaps = found["points"] @ np.array(wall.normal) - wall.offset - height
        yield -float(np.abs(gaps).max(initial=0.0))
        yield float(np.min(found["pressure"], initial=0.0))


@pytest.mark.parametrize("contact", ["midsurface", "faces"])
@pytest.mark.parametrize("gap", [0.28, 0.2])
def test_nothing_goes_through_and_nothing_pulls(gap, contact):
    """Gap >= 0, push >= 0, push only where the gap is zero: to rounding, no penalty."""
    found = squeezed(gap, contact=contact)
    assert min(on_walls(found)) > -1e-10
    assert found.contact["through"] < 1e-10
    assert found.contact["product"] < 1e-10
    assert 0.0 <= found.contact["penetration"] < 3e-5


@pytest.mark.parametrize("gap", [0.28, 0.2])
def test_faces_are_half_a_thickness_before_the_midsurface(gap):
    """Between plates with its faces the ring is that between plates one h nearer with its middle surface."""
    faces, middle = squeezed(gap, contact="faces"), squeezed(gap - 1e-3)
    np.testing.assert_allclose(faces.walls[1]["force"], middle.walls[1]["force"], rtol=1e-3)
    np.testing.assert_allclose(faces.energy["total"], middle.energy["total"], rtol=1e-5)
    assert abs(squeezed(gap).walls[1]["force"][1] / faces.walls[1]["force"][1] - 1.0) > 5e-3


def test_a_plate_on_a_spring_gives_way():
    """k q = F, and the force is that of a rigid plate at its place."""
    stiff = squeezed(0.26, stiffness=500.0)
    upper, path = -stiff.walls[1]["force"][1], stiff.walls[1]["height"]
    np.testing.assert_allclose(upper, -500.0 * path, rtol=1e-9)
    rigid = solve(
        ring(0.26, walls=(plates(0.26)[0], dataclasses.replace(plates(0.26)[1], point=(0.0, 0.13 - path, 0.0))))
    )
    np.testing.assert_allclose(rigid.walls[1]["force"][1], -upper, rtol=1e-7)
    np.testing.assert_allclose(stiff.energy["plates"], 0.5 * 500.0 * path**2, rtol=1e-12)


def test_a_wall_that_moves_away_lets_the_strip_go():
    """Squeezed flat on the way and let go: the circle, no force, energy 2 pi^2."""
    near = tuple(wall.point for wall in plates(0.2))
    found = solve(ring(0.4, path=(Waypoint(name="squeeze", walls=near),)))
    squeeze = [step for step in found.steps if step.accepted and step.stage == "walls"]
    assert squeeze[0].load == 0.0 or len(squeeze) > 1
    assert not any(len(wall["points"]) for wall in found.walls)
    np.testing.assert_allclose(found.energy["total"], 2.0 * math.pi**2, rtol=1e-4)


@pytest.mark.parametrize("contact", ["midsurface", "faces"])
def test_a_flat_strip_lies_under_its_own_weight(contact):
    """Everywhere the pressure is the weight; nothing but the table holds it: three motions are taken out."""
    found = solve(ShellProblem(**LYING, elements=(12, 2), walls=(TABLE,), contact=contact))
    (wall,) = found.walls
    assert found.stable is True
    np.testing.assert_allclose(wall["force"], [0.0, 20.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(wall["pressure"], 20.0, rtol=1e-7)
    assert len(wall["points"]) == 25 * 5
    height = 1e-3 if contact == "faces" else 0.0
    np.testing.assert_allclose(found.surface.points[..., 1], height, atol=1e-12)


@pytest.mark.parametrize("curvature", [1.0, -1.0])
def test_a_curled_strip_falls_onto_the_table(curvature):
    """On its two ends, or on its middle: stable, and resultants of table and weight are zero, moments too."""
    found = solve(
        ShellProblem(**{**LYING, "gamma": 5.0}, natural_curvature=(curvature,) * 2, elements=(12, 2), walls=(TABLE,))
    )
    (wall,) = found.walls
    assert found.stable is True
    np.testing.assert_allclose(wall["force"], [0.0, 5.0, 0.0], atol=1e-8)
    weights = _weights(found.surface)
    centre = np.einsum("sv,svk->k", weights, found.surface.points) / weights.sum()
    np.testing.assert_allclose(wall["moment"], np.cross(centre, wall["force"]), atol=1e-5)
    if curvature > 0.0:
        assert set(np.round(wall["contacts"][:, 0], 9)) & {0.0, 1.0} == {0.0, 1.0}


def _weights(surface):
    from shellref.shell.grid import Grid

    grid = Grid(surface.s_nodes[::2], surface.v_nodes[::2])
    return np.outer(grid.nodal_shares(0), grid.nodal_shares(1))


def test_a_slanted_table_is_a_table():
    """Turned with its wall and its weight the strip is the same; normals that are no axes."""
    found = []
    for angle in (0.0, 0.7):
        up = (0.0, math.cos(angle), math.sin(angle))
        frame = ((1.0, 0.0, 0.0), (0.0, up[1], -up[2]), (0.0, up[2], up[1]))
        problem = ShellProblem(
            0.1, 2e-3, 0.3, gamma=20.0, up=up, clamp_frame=frame, elements=(12, 2),
            walls=(Wall((0.0, -0.1 * up[1], -0.1 * up[2]), up),),
        )  # fmt: skip
        found.append(solve(problem))
    one, other = found
    assert one.stable is other.stable is True
    np.testing.assert_allclose(other.energy["total"], one.energy["total"], rtol=1e-7)
    force = [np.linalg.norm(result.walls[0]["force"]) for result in found]
    assert force[0] > 1.0
    np.testing.assert_allclose(force[1], force[0], rtol=1e-6)
    both = one.walls[0]["force"] + one.clamp_force
    np.testing.assert_allclose(both, [0.0, 20.0, 0.0], atol=1e-6)


def test_the_inertia_is_that_on_the_rows():
    """Dense: eigenvalues of Z^T K Z, Z a basis of the null space of the active rows, beside the saddle system's."""
    problem = ring(0.2, (16, 1))
    result = solve(problem)
    strip = build_strip(problem, ShellOptions())
    from shellref.fenics import dolfinx_api as api
    from shellref.path.solver import Solver

    solver = Solver(strip, ShellOptions(), api.communicator("self"), lambda event: None)
    equilibrium: Equilibrium = solver.equilibrium
    state, stage = solver.state_of(result.surface), strip.stages[-1]
    found = equilibrium.solve(state, None, stage, 1.0)
    assert found.converged
    negative = equilibrium.negative_eigenvalues(found.state, stage, 1.0)
    contact: Contact = equilibrium.contact
    from scipy.linalg import null_space

    from shellref.fenics import petsc_api as petsc

    tangent = petsc.to_scipy(equilibrium.matrix).toarray()
    projection = equilibrium._projection(equilibrium.last_bases)
    rows = (contact.rows.matrix(np.flatnonzero(contact.active), len(state)) @ projection).toarray()
    basis = null_space(rows)
    assert basis.shape[1] == len(tangent) - len(rows)
    values = np.linalg.eigvalsh(basis.T @ (0.5 * (tangent + tangent.T)) @ basis)
    assert negative == int(np.sum(values < 0.0))
    assert contact.saddle.inertia() == (negative, 0, len(values) - negative)


@pytest.mark.parametrize("engine", ["kernels", "forms"])
def test_a_guided_end_meets_a_wall(engine):
    """An edge with unknowns of its own (a guide), which the wall stops: force and clamp balance, the rows are sure."""
    from shellref.shell.problem import Pose

    level = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    found = solve(
        ShellProblem(
            0.1, 2e-3, 0.0, gamma=20.0, up=(0.0, 1.0, 0.0), end=Pose((0.0, 0.0, 0.0), level), guided=True,
            elements=(12, 2), walls=(Wall((0.0, -0.1, 0.0), (0.0, 1.0, 0.0)),),
        ),
        ShellOptions(engine=engine),
    )  # fmt: skip
    (wall,) = found.walls
    assert found.stable is True
    np.testing.assert_allclose(wall["force"] + found.clamp_force, [0.0, 20.0, 0.0], atol=1e-6)
    assert wall["force"][1] > 1.0
    np.testing.assert_allclose(found.surface.points[-1, :, 1], -0.1, atol=1e-6)  # pushed beside its end, too


HELD = {"width": 0.1, "thickness": 1e-3, "poisson": 0.3}


@pytest.mark.parametrize(
    ("keys", "key"),
    [
        ({"walls": (Wall((0.0, 0.01, 0.0), (0.0, 1.0, 0.0)),)}, "walls[0].point"),
        ({"walls": (Wall((0.0, -1e-4, 0.0), (0.0, 1.0, 0.0)),), "contact": "faces"}, "walls[0].point"),
        ({"walls": (TABLE,), "contact": "edges"}, "contact"),
        ({"walls": ({"point": (0, 0, 0)},)}, "walls"),
        ({"walls": ({"point": (0, 0, 0), "normal": (0, 2, 0)},)}, "walls.normal"),
        ({"walls": ({"point": (0, 0, 0), "normal": (0, 1, 0), "stiffness": 0.0},)}, "walls.stiffness"),
        ({"walls": (TABLE,), "path": (Waypoint(walls=()),)}, "path.walls"),
        ({"walls": (TABLE,), "clamp": "free", "gamma": 1.0, "up": (1.0, 0.0, 0.0)}, "up"),
        ({"walls": (TABLE,), "clamp": "free", "gamma": 1.0, "up": (0.0, -1.0, 0.0)}, "up"),
    ],
)
def test_bad_walls_are_refused_before_anything_is_solved(keys, key):
    with pytest.raises(ShellInputError) as refused:
        ShellProblem(**{**HELD, **keys})
    assert refused.value.key == key


def test_a_problem_with_walls_is_read_back():
    """From JSON's plain values, walls and their ways too."""
    near = tuple(wall.point for wall in plates(0.25))
    problem = ring(0.28, path=(Waypoint(walls=near),), stiffness=7.0, contact="faces")
    assert ShellProblem.from_dict(problem.to_dict()) == problem


@pytest.mark.parametrize("elements", [(60, 2), (72, 2)])
def test_a_fold_under_a_roof_is_not_left_on_one_row_of_nodes(elements):
    """Roman's one fold at H = 0.185, nu = 0, touches along a line: on one row of nodes it would turn about that row, a
    saddle of the mesh and not of the strip, which leans on the next one; roof and energy stay the elastica's."""
    from compare.models.ribbon.state import RibbonShape  # only a start
    from compare.models.shell import starting_surface
    from compare.models.shell_build import shell_options, shell_problem
    from shellref.path.begin import Beginning
    from tests.validation.ribbon import roman
    from tests.validation.shell.shell_roman import scene_of

    scene = scene_of(0.0, 0.185)
    problem = shell_problem(scene, 400.0, elements)
    near = starting_surface(RibbonShape(roman.Experiment().folded(1, 0.185, 60)), problem)
    options = dataclasses.replace(shell_options(scene), begin="given")
    found, _ = Beginning(problem, options, lambda event: None, None, "self").given(near)
    assert found is not None
    assert found.stable is True
    touched = np.unique(np.asarray(found.walls[1]["points"])[:, 2].round(9))
    assert len(touched) == 2
    exact = roman.line_contact(0.185, roman.DELTA, roman.GAMMA).force
    assert -float(found.walls[1]["force"][1]) == pytest.approx(exact, rel=5e-3)


@pytest.mark.shell
@pytest.mark.parametrize("curl", [2.0, 4.0, -5.0])
def test_a_curl_that_nothing_holds_comes_to_rest(curl):
    """It is laid down level, on both ends or on its middle; a step that would throw it through the table is made
    shorter, with what touched before it. The table carries the weight, where the pushes have no moment about the
    centre of mass."""
    from shellref.path.begin import begun

    up, gamma = (0.0, 0.0, 1.0), 23.4
    problem = ShellProblem(
        width=0.08, thickness=8e-4, poisson=0.3, natural_curvature=(curl, curl), gamma=gamma, up=up, clamp="free",
        elements=(30, 2), walls=(Wall((0.0, 0.0, 0.0), up),),
    )  # fmt: skip
    result = begun(problem, ShellOptions(), lambda event: None).result
    assert result.status.value == "converged", result.message
    assert result.stable
    (wall,) = result.walls
    np.testing.assert_allclose(wall["force"], gamma * np.array(up), atol=1e-6)
    s, weights = np.polynomial.legendre.leggauss(60)
    v, across = np.polynomial.legendre.leggauss(4)
    points = result.surface.grid(0.5 * (s + 1.0), 0.04 * v)
    centre = np.einsum("k,m,kmi->i", 0.5 * weights, 0.5 * across, points)
    moment = np.cross(wall["points"] - centre, np.outer(wall["pushes"], up)).sum(axis=0)
    np.testing.assert_allclose(moment, 0.0, atol=1e-3)
