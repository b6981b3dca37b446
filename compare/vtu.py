"""Surfaces on a grid as VTU files (ParaView); no solver is imported."""

from __future__ import annotations

import tempfile
from pathlib import Path

import meshio
import numpy as np
from numpy.typing import NDArray

from compare.store import atomic_write_bytes

FloatArray = NDArray[np.float64]


def triangles(along: int, across: int) -> NDArray[np.int64]:
    """Triangles (2 (along - 1) (across - 1), 3) of a grid of points, last index fastest: all lower, then all upper."""
    corner = (np.arange(along - 1)[:, None] * across + np.arange(across - 1)[None, :]).ravel()
    lower = np.column_stack([corner, corner + across, corner + 1])
    upper = np.column_stack([corner + 1, corner + across, corner + across + 1])
    return np.concatenate([lower, upper])


def write_vtu(
    path: Path, grid_points: FloatArray, fields: dict[str, FloatArray], cells: dict[str, FloatArray] | None = None
) -> Path:
    """Writes a surface on a grid (k, m, 3) as triangles; atomically.

    fields: by point, (k, m) or (k, m, 3); cells: by cell of the grid, (k - 1, m - 1).
    """
    along, across = grid_points.shape[:2]
    data = {
        name: np.ascontiguousarray(values.reshape(along * across, *values.shape[2:]), dtype=float)
        for name, values in fields.items()
    }
    by_cell = {name: [np.tile(np.ravel(values).astype(float), 2)] for name, values in (cells or {}).items()}
    shape = [("triangle", triangles(along, across))]
    mesh = meshio.Mesh(grid_points.reshape(-1, 3), shape, point_data=data, cell_data=by_cell)
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder) / "surface.vtu"
        meshio.write(scratch, mesh, file_format="vtu")
        return atomic_write_bytes(path, scratch.read_bytes())
