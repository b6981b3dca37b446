"""Distances between two triangulated strips, in units of l.

Hausdorff distance (thesis, chapter 3, note 2): ``max(sup_P d(P, Z), sup_Q d(Q, S))``. The suprema are taken over the
vertices, the distances to the *triangles* of the other surface (VTK's point-to-cell filter), so that the result is
exact to the distance between a triangle and the curved surface it stands for: kappa ds^2 / 8, ds the grid's spacing.
`compare.measure.grid` chooses the grid so that this stays below a hundredth of the thesis's yardstick.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from compare.measure.grid import triangles

FloatArray = NDArray[np.float64]

#: The thesis calls two shapes the same to the eye when their Hausdorff distance is below 1 permille of the length.
YARDSTICK = 1e-3


def _poly_data(points: FloatArray, triangles: NDArray[np.int64]):  # type: ignore[no-untyped-def]
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

    nodes = vtkPoints()
    nodes.SetDataTypeToDouble()
    nodes.SetData(numpy_to_vtk(np.ascontiguousarray(points, dtype=np.float64), deep=True))
    cells = vtkCellArray()
    offsets = np.arange(0, 3 * len(triangles) + 1, 3, dtype=np.int64)
    cells.SetData(
        numpy_to_vtkIdTypeArray(offsets, deep=True),
        numpy_to_vtkIdTypeArray(np.ascontiguousarray(triangles, dtype=np.int64).ravel(), deep=True),
    )
    data = vtkPolyData()
    data.SetPoints(nodes)
    data.SetPolys(cells)
    return data


def hausdorff(
    points_a: FloatArray, triangles_a: NDArray[np.int64], points_b: FloatArray, triangles_b: NDArray[np.int64]
) -> float:
    """Symmetric Hausdorff distance of two triangulations, points (N, 3) and triangles (T, 3)."""
    from vtkmodules.vtkFiltersModeling import vtkHausdorffDistancePointSetFilter

    measure = vtkHausdorffDistancePointSetFilter()
    measure.SetInputData(0, _poly_data(points_a, triangles_a))
    measure.SetInputData(1, _poly_data(points_b, triangles_b))
    measure.SetTargetDistanceMethodToPointToCell()
    measure.Update()
    return float(measure.GetHausdorffDistance())


def grid_hausdorff(grid_a: FloatArray, grid_b: FloatArray) -> float:
    """Symmetric Hausdorff distance of two surfaces given on material grids (along, across, 3) of any sizes."""
    return hausdorff(
        grid_a.reshape(-1, 3),
        triangles(*grid_a.shape[:2]),
        grid_b.reshape(-1, 3),
        triangles(*grid_b.shape[:2]),
    )


def centreline_distance(line_a: FloatArray, line_b: FloatArray) -> float:
    """Largest distance between points of equal abscissa of two centrelines (k, 3)."""
    return float(np.linalg.norm(line_a - line_b, axis=1).max())
