"""Surfaces as VTU files (ParaView), with the material coordinates and the ribbon's fields at the points."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from compare.export import ribbon as export_ribbon
from compare.export.formats import array_csv
from compare.export.vtu import write_vtu
from compare.models.shell_process import ShellCase
from compare.pictures import shell as shell_figure
from compare.studies.compare import Grid
from ribbon import Equilibrium

FloatArray = NDArray[np.float64]


def write_ribbon(path: Path, equilibrium: Equilibrium, grid: Grid) -> Path:
    """The ribbon's surface with its fields."""
    return write_vtu(path, grid.ribbon(equilibrium), export_ribbon.fields(equilibrium, grid.s, grid.v))


def write_arrays(path: Path, equilibrium: Equilibrium) -> Path:
    """The ribbon's own segments and its centreline (`compare.export.ribbon.arrays`)."""
    return export_ribbon.write_arrays(path, equilibrium)


def write_shell(path: Path, case: ShellCase, grid: Grid) -> Path:
    """A shell's surface with material coordinates and director, and by cell the energies of the element it lies in."""
    s, v = np.meshgrid(grid.s, grid.v, indexing="ij")
    fields = {"S": s, "v": v, "director": case.surface.director(s, v)}
    return write_vtu(path, grid.shell(case), fields, _energies(case, grid))


def _energies(case: ShellCase, grid: Grid) -> dict[str, FloatArray]:
    """Bending, membrane and shear energy per area (D / l^2) and their shares on the cells of the grid; none where the
    case has not kept them."""
    try:
        density = shell_figure.density_on_grid(case)
    except KeyError:
        return {}
    surface = case.surface
    ends = surface.s_nodes[:: surface.degree], surface.v_nodes[:: surface.degree]
    rows, columns = (
        np.clip(np.searchsorted(nodes, 0.5 * (x[1:] + x[:-1]), side="right") - 1, 0, len(nodes) - 2)
        for nodes, x in zip(ends, (grid.s, grid.v), strict=True)
    )
    density = density[np.ix_(rows, columns)]
    return shell_figure.by_name(density)


def centreline_csv(equilibrium: Equilibrium, points: int = 401) -> bytes:
    """The centreline as CSV: s, x, y, z (in l), omega (1/l), eta, t_x, t_y, t_z by components."""
    s = np.linspace(0.0, 1.0, points)
    frame = equilibrium.frame(s)
    columns = [s, equilibrium.position(s), equilibrium.omega(s), equilibrium.eta(s)]
    names = ["s", "x", "y", "z", "omega", "eta"]
    names += [f"{axis}_{component}" for axis in ("tx", "ty", "tz") for component in "xyz"]
    return array_csv(names, np.column_stack(columns + [frame[:, :, column] for column in range(3)]))
