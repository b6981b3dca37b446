"""Shells that touch themselves: derivatives of the gaps, balance, the fold by shooting, nothing through itself."""

from __future__ import annotations

import dataclasses
from functools import cache

import numpy as np
import pytest

from shellref import ShellOptions, ShellProblem
from shellref.contact.pairs import PairRows
from shellref.contact.sheet import Feet, Sheet
from shellref.inputs import ShellInputError
from shellref.path.solve import solve
from shellref.shell.grid import Grid, knots_across, knots_along
from shellref.shell.problem import IDENTITY, Pose, Waypoint
from shellref.shell.surface import ShellSurface
from tests.reference.touching_fold import folds

#: Lengths that the fold's clamps are apart, and its sides.
DISTANCE, APART = 0.15, 0.02
OPTIONS = ShellOptions(stabilisation=0.03)  # one element across


def at(distance):
    return Pose((0.0, 0.0, distance), IDENTITY)


def fold(elements, distance=DISTANCE, apart=APART, **keys):
    """A strip between two parallel clamps on one line that are brought together; nu = 0: it stays a cylinder."""
    way = (Waypoint(natural=1.0, name="natural"), Waypoint(end=at(0.5)), Waypoint(end=at(0.25)))
    return ShellProblem(
        **{"width": 0.02, "thickness": 2e-4, "poisson": 0.0, "elements": (elements, 1), "grading": (1.0, 1.0),
           "end": at(distance), "start_curvature": 2.0, "path": way, "apart": apart, **keys}
    )  # fmt: skip


@cache
def folded(elements=40):
    return solve(fold(elements), OPTIONS)


@cache
def known():
    (found,) = folds(np.array([DISTANCE]), APART)
    return found


@cache
def coil():
    """Rows and a state (n, 6) of a strip that is wound up askew, off any equilibrium."""
    grid = Grid(knots_along(24, 0.5, True), knots_across(2, 0.5, 0.1), 2)
    s, v = (x.ravel() for x in np.meshgrid(grid.s_nodes, grid.v_nodes, indexing="ij"))
    nodes, radius = np.column_stack([s, v]), 0.16 * (1.0 - 0.3 * s)
    points = np.column_stack([v + 0.06 * s, radius * np.sin(9.0 * s), radius * np.cos(9.0 * s)])
    directors = np.column_stack([0.1 * np.sin(s), np.sin(9.0 * s), np.cos(9.0 * s)])
    directors /= np.linalg.norm(directors, axis=1)[:, None]
    rows = PairRows.of(Sheet(grid, grid.order(nodes)), np.arange(len(nodes)), nodes, 0.03, False, 0)
    state = np.hstack([points, directors])
    return rows.at(state, None)[0], state


def test_gradients_are_those_of_the_gap():
    """Central differences along a field; feet move."""
    rows, state = coil()
    assert len(rows.nodes) > 40
    field, step = np.random.default_rng(1).normal(size=state.shape), 1e-6
    ahead, back = (rows.gaps(state + sign * step * field, None, None) for sign in (1.0, -1.0))
    np.testing.assert_allclose(rows.applied(field), (ahead - back) / (2.0 * step), atol=1e-6)
    matrix = rows.matrix(np.arange(len(rows.nodes)), len(state))
    np.testing.assert_allclose(matrix @ field.ravel(), rows.applied(field), atol=1e-12)


def test_second_derivatives_are_those_of_the_gradients():
    """Of the forces of fixed pushes, by central differences; symmetric."""
    rows, state = coil()
    generator, step, n = np.random.default_rng(2), 1e-6, len(state)
    field, other = generator.normal(size=state.shape), generator.normal(size=state.shape)
    push = generator.uniform(1.0, 2.0, len(rows.nodes))
    row, column, value = rows.curvature(push, n)

    def times(x):
        return np.bincount(row, value * x.ravel()[column], 6 * n).reshape(n, 6)

    forces = []
    for sign in (1.0, -1.0):
        moved, before = rows.at(state + sign * step * field, None)
        assert np.array_equal(before, np.arange(len(push)))
        forces.append(moved.forces(push, n))
    expected = (forces[0] - forces[1]) / (2.0 * step)
    np.testing.assert_allclose(times(field), expected, atol=1e-6 * np.abs(expected).max())
    assert np.sum(other * times(field)) == pytest.approx(np.sum(field * times(other)), rel=1e-10)


def test_pushes_balance_themselves():
    """Forces and moments, those on directors too, to rounding."""
    rows, state = coil()
    force = rows.forces(np.random.default_rng(3).uniform(1.0, 2.0, len(rows.nodes)), len(state))
    assert np.abs(force[:, :3].sum(axis=0)).max() < 1e-11
    moment = np.cross(state[:, :3], force[:, :3]) + np.cross(state[:, 3:], force[:, 3:])
    assert np.abs(moment.sum(axis=0)).max() < 1e-12
    assert np.abs(force).max() > 1.0


def test_the_sheet_is_smooth_along_and_goes_through_the_nodes():
    """At the joints of unequal elements values and slopes are one; a rigid motion of the strip is one of the sheet."""
    rows, state = coil()
    sheet, ny = rows.sheet, 2
    joints = np.arange(23)
    half = np.full(23, 0.3)
    sizes = np.diff(sheet.grid.s_knots)
    before = sheet.local(state, Feet(joints * ny, np.ones(23), half, 0.0 * half))
    after = sheet.local(state, Feet((joints + 1) * ny, np.zeros(23), half, 0.0 * half))
    np.testing.assert_allclose(before.place[0], after.place[0], atol=1e-13)
    slopes = [one.place[1] / size[:, None] for one, size in ((before, sizes[:-1]), (after, sizes[1:]))]
    np.testing.assert_allclose(*slopes, atol=1e-12)
    corner = sheet.local(state, Feet(joints * ny, np.zeros(23), np.zeros(23), np.zeros(23)))
    np.testing.assert_allclose(corner.place[0], state[sheet._own[joints * ny, 0], :3], atol=1e-13)
    np.testing.assert_allclose(before.weights[0].sum(axis=1), 1.0, rtol=1e-12)


def test_a_fold_is_that_of_shooting():
    """Push and energy to the mesh's order: a place of contact is a node, half an element from the next."""
    found = folded()
    assert found.stable is True
    push = np.linalg.norm(sum(pair["force"] for pair in found.pairs))
    assert push == pytest.approx(known().push, rel=0.05)
    assert found.energy["total"] == pytest.approx(known().energy, rel=2e-4)
    for pair in found.pairs:
        assert pair["s"] == pytest.approx(known().s, abs=1.0 / 80.0)
        assert pair["s_other"] == pytest.approx(1.0 - known().s, abs=1.0 / 80.0)
        assert pair["gap"] == pytest.approx(APART, abs=1e-10)
    coarse = solve(fold(20), OPTIONS)
    assert abs(found.energy["total"] / known().energy - 1.0) < 0.2 * abs(coarse.energy["total"] / known().energy - 1.0)


def test_nothing_is_nearer_than_it_may_be():
    """From the shape alone, sides of the fold are at least the distance apart, to the mesh's order between nodes."""
    found = folded()
    s = np.linspace(0.0, 1.0, 801)
    line = found.surface.centreline(s)
    near = np.linalg.norm(line[:300, None] - line[None, 500:], axis=2)
    assert APART - 2e-4 < near.min() < APART + 2e-4
    assert 0.0 <= found.contact["penetration"] < 2e-4
    assert found.contact["product"] < 1e-10
    assert found.contact["through"] < 1e-10
    force = found.clamps["start"]["force"] + found.clamps["end"]["force"]
    assert np.abs(force).max() < 1e-6 * np.abs(found.clamps["end"]["force"]).max()


def test_without_contact_the_sides_go_through_each_other():
    """The same way ends with the sides past each other where nothing keeps them apart."""
    free = solve(fold(40, apart=None), OPTIONS)
    line = free.surface.centreline(np.linspace(0.0, 1.0, 401))
    assert free.pairs == ()
    near = np.linalg.norm(line[:150, None] - line[None, 250:], axis=2)
    assert near.min() < 0.5 * APART
    assert free.energy["total"] < folded().energy["total"] - 1e-3


def test_a_beginning_that_crosses_itself_is_refused():
    """A curve of one turn and a half, flat: it says where."""
    grid_s, grid_v = np.linspace(0.0, 1.0, 81), np.linspace(-0.01, 0.01, 3)
    angle = 3.0 * np.pi * grid_s
    place = np.column_stack([np.sin(angle) / 9.0, 0.1 * grid_s, (1.0 - np.cos(angle)) / 9.0])
    points = np.stack([np.stack([0.0 * angle + v, place[:, 2], place[:, 0] + place[:, 1]], axis=1) for v in grid_v], 1)
    normals = np.stack([0.0 * angle, np.cos(angle), -np.sin(angle)], axis=1)[:, None] * np.ones((1, 3, 1))
    start = ShellSurface(grid_s, grid_v, points, normals, 2)
    crossed = dataclasses.replace(fold(40), path=())
    found = solve(crossed, OPTIONS, start=start)
    assert found.status == "not_converged"
    assert "crosses itself" in found.message


@pytest.mark.parametrize(
    ("key", "change"),
    [("apart", {"apart": -0.1}), ("apart", {"apart": 0.3}), ("apart", {"apart": float("nan")}),
     ("apart", {"transverse_curvature": 5.0, "start_curvature": None})],
)  # fmt: skip
def test_what_is_refused(key, change):
    """Before anything is computed."""
    with pytest.raises(ShellInputError) as error:
        fold(20, **change)
    assert error.value.key == key
