"""Hausdorff distances with known values, to the triangles and not only to the points."""

from __future__ import annotations

import subprocess
import sys

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


def vtk_hausdorff(points_a, triangles_a, points_b, triangles_b):
    """The judge: VTK's point-to-cell filter."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkFiltersModeling import vtkHausdorffDistancePointSetFilter

    def surface(points, triangles):
        nodes, cells, data = vtkPoints(), vtkCellArray(), vtkPolyData()
        nodes.SetDataTypeToDouble()
        nodes.SetData(numpy_to_vtk(np.ascontiguousarray(points, dtype=float), deep=True))
        offsets = np.arange(0, 3 * len(triangles) + 1, 3, dtype=np.int64)
        connected = np.ascontiguousarray(triangles, dtype=np.int64).ravel()
        cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(connected, deep=True))
        data.SetPoints(nodes)
        data.SetPolys(cells)
        return data

    measure = vtkHausdorffDistancePointSetFilter()
    measure.SetInputData(0, surface(points_a, triangles_a))
    measure.SetInputData(1, surface(points_b, triangles_b))
    measure.SetTargetDistanceMethodToPointToCell()
    measure.Update()
    return float(measure.GetHausdorffDistance())


def coil(along, across, turns=3.0, width=0.05, pitch=0.02, slide=0.0, lift=0.0, wave=0.0):
    """A strip wound up: neighbouring turns are nearer than its own length."""
    s, v = np.meshgrid(np.linspace(0, 1, along), np.linspace(-width / 2, width / 2, across), indexing="ij")
    angle = 2 * np.pi * turns * (s + slide)
    radius = 1 / (2 * np.pi * turns) + lift + wave * np.sin(40 * s + 90 * v)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), v + pitch * turns * s], axis=2)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (coil(301, 9), coil(301, 9, lift=1e-6)),  # an error
        (coil(301, 9), coil(301, 9, slide=0.013)),  # points wander along the surface, the surface hardly moves
        (coil(301, 9), coil(201, 5, slide=0.2, lift=3e-4)),  # what is nearest stands elsewhere on the strip
        (coil(301, 9), coil(301, 9, wave=2e-3)),
        (coil(301, 9, pitch=0.004), coil(301, 9, pitch=0.004, lift=0.02)),  # the next turn is nearer than the own one
        (coil(301, 9), plane(51, 5, height=0.3)),  # farther than a cell by far
        (coil(61, 3), coil(601, 13, turns=2.0)),
        (np.repeat(coil(60, 5), 2, axis=0), coil(90, 4)),  # triangles without an area
    ],
)
def test_against_vtk(one, other):
    """VTK measures the same, whatever makes the nearest triangle hard to find."""
    arguments = (
        one.reshape(-1, 3), grid_triangles(*one.shape[:2]), other.reshape(-1, 3), grid_triangles(*other.shape[:2])
    )  # fmt: skip
    assert grid_hausdorff(one, other) == pytest.approx(vtk_hausdorff(*arguments), rel=1e-12, abs=1e-15)


def test_against_vtk_on_loose_triangles():
    """Large and small triangles that are no grid, and points that are corners of none."""
    rng = np.random.default_rng(7)
    for _ in range(5):
        points = [rng.normal(size=(n, 3)) * [1.0, 0.3, 0.1] for n in (60, 90)]
        corners = [np.array([rng.choice(len(p), 3, replace=False) for _ in range(40)]) for p in points]
        arguments = points[0], corners[0], points[1], corners[1]
        assert hausdorff(*arguments) == pytest.approx(vtk_hausdorff(*arguments), rel=1e-12)


def test_no_vtk_is_loaded_for_a_distance():
    code = (
        "import sys, numpy as np\n"
        "from compare.measure.distance import grid_hausdorff\n"
        "x = np.zeros((3, 2, 3)); x[:, :, 0] = [[0], [1], [2]]; x[:, 1, 1] = 1\n"
        "assert grid_hausdorff(x, x + [0, 0, 1]) == 1.0\n"
        "assert not [m for m in sys.modules if m.split('.')[0] in ('vtkmodules', 'pyvista', 'vtk')]\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


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
