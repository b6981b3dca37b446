"""Edges of a shell that meet edges: derivatives of the gaps, balance, two strands that cross edge on edge."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.optimize import minimize

from shellref.contact.edges import EdgeRows
from shellref.contact.sheet import Sheet
from shellref.shell.grid import Grid, knots_across, knots_along

#: Distance that edges keep, and half of the width.
APART, HALF = 0.02, 0.01


@cache
def looped(lift=0.032):
    """Rows and a state (n, 6) of a strip in a loop whose strands, upright, cross edge over edge; no equilibrium."""
    grid = Grid(knots_along(40, 0.5, True), knots_across(2, 0.5, 2.0 * HALF), 2)
    s, v = (x.ravel() for x in np.meshgrid(grid.s_nodes, grid.v_nodes, indexing="ij"))
    x = 2.0 * s - 1.0
    line = np.column_stack([0.7 * (x**3 - 0.5 * x), lift * x, 0.5 * x**2])
    across = np.column_stack([0.2 * np.sin(5.0 * s), 1.0 + 0.0 * s, 0.1 * np.cos(4.0 * s)])
    along = np.column_stack([0.7 * (3.0 * x**2 - 0.5), lift + 0.0 * x, x])
    across /= np.linalg.norm(across, axis=1)[:, None]
    directors = np.cross(along, across)
    directors /= np.linalg.norm(directors, axis=1)[:, None]
    state = np.hstack([line + v[:, None] * across, directors])
    nodes = np.column_stack([s, v])
    rows = EdgeRows.of(Sheet(grid, grid.order(nodes)), nodes, APART, False, 0)
    return rows.at(state, None)[0], state


def test_the_gap_is_the_least_distance_of_the_edges():
    """Beside a search over both lines that knows nothing of derivatives; one pair, the upper edge below the lower."""
    rows, state = looped()
    (place,) = rows.places
    sheet = rows.sheet

    def apart(p):
        ends = [sheet.border(np.array([edge]), np.array([s])) for edge, s in zip((1, 0), p, strict=True)]
        one, other = (np.einsum("mq,mqi->mi", weights[0], state[nodes, :3]) for weights, nodes in ends)
        return float(np.linalg.norm(one - other))

    s = np.linspace(0.02, 0.45, 44)
    begin = min(((a, 1.0 - b) for a in s for b in s), key=apart)
    found = minimize(apart, begin, method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-14})
    np.testing.assert_allclose(place, [found.x[0], HALF, found.x[1], -HALF], atol=1e-5)
    assert rows.distances[0] == pytest.approx(found.fun, abs=1e-12)
    assert rows.gaps(state, None, None)[0] == pytest.approx(found.fun - APART, abs=1e-12)


def test_gradients_are_those_of_the_gap():
    """Central differences along a field; the places slide."""
    rows, state = looped()
    field, step = np.random.default_rng(1).normal(size=state.shape), 1e-6
    ahead, back = (rows.gaps(state + sign * step * field, None, None) for sign in (1.0, -1.0))
    np.testing.assert_allclose(rows.applied(field), (ahead - back) / (2.0 * step), rtol=1e-6)
    matrix = rows.matrix(np.arange(len(rows)), len(state))
    np.testing.assert_allclose(matrix @ field.ravel(), rows.applied(field), atol=1e-12)


@pytest.mark.parametrize("lift", [0.032, 0.016])
def test_second_derivatives_are_those_of_the_gradients(lift):
    """Of the forces of fixed pushes, by central differences, near and far from each other; symmetric."""
    rows, state = looped(lift)
    generator, step, n = np.random.default_rng(2), 1e-7, len(state)
    field, other = generator.normal(size=state.shape), generator.normal(size=state.shape)
    push = np.full(len(rows), 1.5)
    row, column, value = rows.curvature(push, n)

    def times(x):
        return np.bincount(row, value * x.ravel()[column], 6 * n).reshape(n, 6)

    moved = [rows.at(state + sign * step * field, None)[0].forces(push, n) for sign in (1.0, -1.0)]
    expected = (moved[0] - moved[1]) / (2.0 * step)
    np.testing.assert_allclose(times(field), expected, atol=1e-5 * np.abs(expected).max())
    assert np.sum(other * times(field)) == pytest.approx(np.sum(field * times(other)), rel=1e-9)


def test_pushes_balance_themselves():
    """Forces and moments, to rounding."""
    rows, state = looped()
    force = rows.forces(np.array([2.0]), len(state))
    assert np.abs(force[:, :3].sum(axis=0)).max() < 1e-14
    assert np.abs(np.cross(state[:, :3], force[:, :3]).sum(axis=0)).max() < 1e-14
    np.testing.assert_allclose(np.abs(force).sum(), 4.0 * np.abs(rows.normals).sum(), rtol=0.5)


def test_edges_that_went_through_each_other_are_told_and_pushed_back():
    """Strands moved along the push until their edges have crossed: the gap is negative by as much as they moved, and
    the step is one that passed; a step half as long is none."""
    rows, state = looped()
    part = (rows.material[:, 0] < 0.5)[:, None] * np.hstack([rows.normals[0], np.zeros(3)])
    far = float(rows.distances[0])
    for way, through in ((0.5, False), (1.3, True)):
        moved = state - way * far * part
        after, before = rows.at(moved, None)
        assert before[0] == 0
        assert float(after.gaps(moved, None, None)[0]) == pytest.approx((1.0 - way) * far - APART, abs=1e-9)
        assert rows.passed(state, moved, None) is through
    assert not rows.passed(state, state, None)
