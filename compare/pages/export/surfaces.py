"""Surfaces as VTU files (ParaView), with the material coordinates and the model's fields at the points."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from compare.measure.energy_map import Mapped, by_name, density_on_grid
from compare.measure.grid import Grid, Surfaced
from compare.pages.export.vtu import write_vtu

FloatArray = NDArray[np.float64]


class Drawn(Surfaced, Protocol):
    """A deformed strip that knows fields on its surface (`compare.models.base.Shape`)."""

    def fields(self, s: FloatArray, v: FloatArray) -> dict[str, FloatArray]: ...


def write_surface(path: Path, shape: Drawn, grid: Grid) -> Path:
    """The surface of any shape on a grid with material coordinates and its own fields."""
    s, v = np.meshgrid(grid.s, grid.v, indexing="ij")
    return write_vtu(path, grid.of(shape), {"S": s, "v": v, **shape.fields(grid.s, grid.v)})


def write_shell(path: Path, case: Mapped, grid: Grid) -> Path:
    """A shell's surface with material coordinates and director, and by cell the energies of the element it lies in."""
    s, v = np.meshgrid(grid.s, grid.v, indexing="ij")
    fields = {"S": s, "v": v, "director": case.surface.director(s, v)}
    return write_vtu(path, case.surface.grid(grid.s, grid.v), fields, _energies(case, grid))


def _energies(case: Mapped, grid: Grid) -> dict[str, FloatArray]:
    """Bending, membrane and shear energy per area (D / l^2) and their shares on the cells of the grid; none where the
    case has not kept them."""
    try:
        density = density_on_grid(case)
    except KeyError:
        return {}
    surface = case.surface
    ends = surface.s_nodes[:: surface.degree], surface.v_nodes[:: surface.degree]
    rows, columns = (
        np.clip(np.searchsorted(nodes, 0.5 * (x[1:] + x[:-1]), side="right") - 1, 0, len(nodes) - 2)
        for nodes, x in zip(ends, (grid.s, grid.v), strict=True)
    )
    density = density[np.ix_(rows, columns)]
    return by_name(density)
