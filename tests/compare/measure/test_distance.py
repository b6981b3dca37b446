"""Hausdorff distances with known values, to the triangles and not only to the points."""

from __future__ import annotations

import numpy as np
import pytest

from compare.measure.distance import centreline_distance, grid_hausdorff, hausdorff
from compare.measure.grid import SAGITTA, cells_across, cells_along
from ribbon.surface import grid_triangles


def plane(along, across, height=0.0, shift=0.0):
    x, y = np.meshgrid(np.linspace(0, 1, along) + shift, np.linspace(0, 0.1, across), indexing="ij")
    return np.stack([x, y, np.full_like(x, height)], axis=2)


def test_parallel_planes_of_different_grids():
    """Point to point the coarse grid would be far; point to triangle the distance is the gap."""
    assert grid_hausdorff(plane(4, 2), plane(101, 7, height=0.03)) == pytest.approx(0.03, abs=1e-15)
    assert grid_hausdorff(plane(4, 2), plane(101, 7)) == pytest.approx(0.0, abs=1e-15)


def test_distance_is_symmetric_and_sees_what_one_side_lacks():
    short, long = plane(11, 3), plane(11, 3)
    long[:, :, 0] *= 1.2
    assert grid_hausdorff(short, long) == pytest.approx(0.2, abs=1e-14)
    assert grid_hausdorff(long, short) == pytest.approx(0.2, abs=1e-14)


def test_against_brute_force_on_random_triangles():
    rng = np.random.default_rng(0)
    points = [rng.normal(size=(12, 3)), rng.normal(size=(15, 3)) + 0.3]
    triangles = [np.array([rng.choice(n, 3, replace=False) for _ in range(9)]) for n in (12, 15)]
    # only points that belong to triangles count on either side
    used = [np.unique(t) for t in triangles]
    points = [p[u] for p, u in zip(points, used, strict=True)]
    triangles = [np.searchsorted(u, t) for u, t in zip(used, triangles, strict=True)]

    def to_triangle(p, a, b, c):
        """Distance of p to a triangle by minimising over a fine barycentric grid, then over its edges exactly."""
        edges = min(np.linalg.norm(p - (u + np.clip((p - u) @ (v - u) / ((v - u) @ (v - u)), 0, 1) * (v - u)))
                    for u, v in ((a, b), (b, c), (c, a)))  # fmt: skip
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal)
        foot = p - ((p - a) @ normal) * normal
        weights = np.linalg.lstsq(np.column_stack([b - a, c - a]), foot - a, rcond=None)[0]
        inside = weights.min() >= 0 and weights.sum() <= 1
        return min(edges, abs((p - a) @ normal)) if inside else edges

    def one_sided(i, j):
        return max(min(to_triangle(p, *points[j][t]) for t in triangles[j]) for p in points[i])

    expected = max(one_sided(0, 1), one_sided(1, 0))
    assert hausdorff(points[0], triangles[0], points[1], triangles[1]) == pytest.approx(expected, rel=1e-12)


def test_grid_is_fine_enough_for_the_curvature():
    for curvature in (15.0, 40.0, 200.0):
        cells = cells_along(curvature)
        assert curvature / cells**2 / 8 <= SAGITTA
    assert cells_along(0.0) == 400
    assert cells_along(1e9) == 4000
    assert 4 <= cells_across(0.03, 400) <= 12
    assert cells_across(0.03, 400) % 2 == 0


def test_centreline_distance_is_at_equal_abscissa():
    line = np.column_stack([np.linspace(0, 1, 5), np.zeros(5), np.zeros(5)])
    assert centreline_distance(line, line + np.array([0, 0.3, 0.4])) == pytest.approx(0.5)
    assert centreline_distance(line, line[::-1]) == pytest.approx(1.0)


def test_triangles_cover_the_grid_once():
    triangles = grid_triangles(5, 3)
    assert len(triangles) == 2 * 4 * 2
    grid = plane(5, 3).reshape(-1, 3)
    a, b, c = (grid[triangles[:, k]] for k in range(3))
    assert 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() == pytest.approx(0.1)
