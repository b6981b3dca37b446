"""Surfaces on a grid as VTU files (ParaView), written and read back; no solver is imported."""

from __future__ import annotations

import base64
import contextlib
import html
import io
import sys
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.store.store import atomic_write_bytes
from ribbonbench.errors import BadInput

FloatArray = NDArray[np.float64]

#: Part of a surface's extent up to which points of its ends are one.
_MEET = 1e-6
#: Bytes of a file's array that are compressed together, and how much: fully takes twice the time and saves a hundredth.
_BLOCK, _QUICK = 32768, 1


def triangles(along: int, across: int) -> NDArray[np.int64]:
    """Triangles (2 (along - 1) (across - 1), 3) of a grid of points, last index fastest: all lower, then all upper."""
    corner = (np.arange(along - 1)[:, None] * across + np.arange(across - 1)[None, :]).ravel()
    lower = np.column_stack([corner, corner + across, corner + 1])
    upper = np.column_stack([corner + 1, corner + across, corner + across + 1])
    return np.concatenate([lower, upper])


def seam(grid: FloatArray) -> int:
    """How the ends of a grid (k, m, 3) meet: 1 as they are, -1 turned over, as a Moebius band's, 0 not at all."""
    if len(grid) < 4:
        return 0
    near = _MEET * float(np.ptp(grid.reshape(-1, 3), axis=0).max())
    for sign in (1, -1):
        if np.abs(grid[0] - grid[-1, ::sign]).max() <= near:
            return sign
    return 0


@dataclass(frozen=True)
class Sheet:
    """A triangulated surface: points (N, 3) in l, triangles (T, 3); fields by point (N,) or (N, 3), cells (T,)."""

    points: FloatArray
    triangles: NDArray[np.int64]
    fields: Mapping[str, FloatArray] = field(default_factory=dict)
    cells: Mapping[str, FloatArray] = field(default_factory=dict)

    @property
    def shape(self) -> tuple[int, int] | None:
        """(along, across) numbers of points where the points are a grid in S and v, last index fastest; else None."""
        if "S" not in self.fields or "v" not in self.fields:
            return None
        s = self.fields["S"]
        across = int(np.argmax(s != s[0])) or len(s)
        if across < 2 or len(s) % across or len(s) // across < 2:
            return None
        shape = len(s) // across, across
        expected = triangles(*shape)
        same = expected.shape == self.triangles.shape and np.array_equal(expected, self.triangles)
        return shape if same else None

    def normals(self) -> FloatArray:
        """Unit normals (N, 3): the field "normal" where the surface brings it (exact, also along a seam), otherwise the
        triangles' around a point weighted by their areas."""
        known = self.fields.get("normal")
        if known is not None and known.shape == self.points.shape and np.isfinite(known).all():
            return known / np.maximum(np.linalg.norm(known, axis=1, keepdims=True), 1e-300)
        corners, shape = self.points[self.triangles], self.shape
        area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        found = np.zeros_like(self.points)
        for corner in range(3):
            np.add.at(found, self.triangles[:, corner], area)
        joined = 0 if shape is None else seam(self.points.reshape(*shape, 3))
        if shape is not None and joined:  # the points of both ends are one, with one normal
            ends = found.reshape(*shape, 3)
            both = ends[0] + joined * ends[-1, ::joined]
            ends[0], ends[-1] = both, joined * both[::joined]
        length = np.linalg.norm(found, axis=1, keepdims=True)
        return np.where(length > 0.0, found / np.where(length > 0.0, length, 1.0), [0.0, 0.0, 1.0])

    def scalars(self) -> dict[str, FloatArray]:
        """Fields with one value a point (N,); those by triangle as the mean of the triangles around a point."""
        found = {name: values for name, values in self.fields.items() if values.ndim == 1}
        count = np.zeros(len(self.points))
        np.add.at(count, self.triangles, 1.0)
        for name, values in self.cells.items():
            total = np.zeros(len(self.points))
            np.add.at(total, self.triangles, values[:, None])
            found[name] = total / np.maximum(count, 1.0)
        return found


def grid_sheet(
    grid_points: FloatArray, fields: Mapping[str, FloatArray], cells: Mapping[str, FloatArray] | None = None
) -> Sheet:
    """A surface on a grid (k, m, 3); fields: by point, (k, m) or (k, m, 3); cells: by cell, (k - 1, m - 1)."""
    along, across = grid_points.shape[:2]
    data = {
        name: np.ascontiguousarray(values.reshape(along * across, *values.shape[2:]), dtype=float)
        for name, values in fields.items()
    }
    by_cell = {name: np.tile(np.ravel(values).astype(float), 2) for name, values in (cells or {}).items()}
    return Sheet(grid_points.reshape(-1, 3), triangles(along, across), data, by_cell)


def vtu_bytes(sheet: Sheet) -> bytes:
    """The surface as a VTU file: numbers whole, in the machine's byte order, as VTK's zlib compressor reads them
    (file formats in VTK's user guide, 2010, chapter 19)."""
    triangle, corners = 5, len(sheet.triangles)
    many = f'NumberOfPoints="{len(sheet.points)}" NumberOfCells="{corners}"'
    parts: dict[str, Mapping[str, NDArray[Any]]] = {
        "Points": {"Points": sheet.points},
        "Cells": {
            "connectivity": np.ravel(sheet.triangles),
            "offsets": 3 * np.arange(1, corners + 1),
            "types": np.full(corners, triangle, dtype=np.uint8),
        },
        "PointData": sheet.fields,
        "CellData": sheet.cells,
    }
    written = [f"<{part}>\n{''.join(map(_array, own, own.values()))}</{part}>\n" for part, own in parts.items() if own]
    order = f'byte_order="{sys.byteorder.capitalize()}Endian" compressor="vtkZLibDataCompressor"'
    return (
        f'<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="0.1" {order}>\n<UnstructuredGrid>\n'
        f"<Piece {many}>\n{''.join(written)}</Piece>\n</UnstructuredGrid>\n</VTKFile>\n"
    ).encode()


def _array(name: str, values: NDArray[Any]) -> str:
    """An array (n,) or (n, k) of a VTU file: how many blocks, their size, that of the last one, their sizes compressed,
    and the blocks, in base 64."""
    whole = values.astype(np.uint8 if values.dtype == np.uint8 else np.int64 if values.dtype.kind in "iu" else float)
    kind = f"{ {'f': 'Float', 'i': 'Int', 'u': 'UInt'}[whole.dtype.kind] }{8 * whole.dtype.itemsize}"
    raw = np.ascontiguousarray(whole).tobytes()
    blocks = [zlib.compress(raw[k : k + _BLOCK], _QUICK) for k in range(0, len(raw), _BLOCK)]
    last = len(raw) - _BLOCK * (len(blocks) - 1)
    head = np.array([len(blocks), _BLOCK, last, *map(len, blocks)], dtype=np.uint32)
    columns = f' NumberOfComponents="{whole.shape[1]}"' if whole.ndim == 2 else ""
    text = (base64.b64encode(head.tobytes()) + base64.b64encode(b"".join(blocks))).decode()
    return f'<DataArray type="{kind}" Name="{html.escape(name)}"{columns} format="binary">\n{text}\n</DataArray>\n'


def write_vtu(
    path: Path, grid_points: FloatArray, fields: dict[str, FloatArray], cells: dict[str, FloatArray] | None = None
) -> Path:
    """Writes a surface on a grid (k, m, 3) as triangles; atomically.

    fields: by point, (k, m) or (k, m, 3); cells: by cell of the grid, (k - 1, m - 1).
    """
    return atomic_write_bytes(path, vtu_bytes(grid_sheet(grid_points, fields, cells)))


def read_vtu(path: Path) -> Sheet:
    """The triangles of a VTU file with their fields; `BadInput` when it is damaged or holds none."""
    import meshio

    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            mesh = meshio.read(path, file_format="vtu")
        kinds = [block.type for block in mesh.cells]
        points = np.ascontiguousarray(mesh.points, dtype=float)
        found = np.asarray(mesh.cells[kinds.index("triangle")].data, dtype=np.int64)
        fields = {name: np.asarray(values, dtype=float) for name, values in mesh.point_data.items()}
        cells = {
            name: np.asarray(values[kinds.index("triangle")], dtype=float) for name, values in mesh.cell_data.items()
        }
        sound = points.ndim == 2 and points.shape[1] == 3 and len(found) and np.isfinite(points).all()
        if not sound or found.min() < 0 or found.max() >= len(points):
            raise ValueError("its points or triangles are impossible")
    except (KeyboardInterrupt, MemoryError):
        raise
    except BaseException as error:  # meshio prints and ends the process, or lets zlib, base64 and XML errors through
        ended = isinstance(error, SystemExit)
        reason = "it is no VTU file" if ended else f"{type(error).__name__}: {error}"
        raise BadInput("surface", path.name, f"cannot be read ({reason})", "make the results again") from None
    return Sheet(points, found, fields, cells)
