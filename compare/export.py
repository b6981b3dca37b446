"""Surfaces as VTU files (ParaView), with the material coordinates and the ribbon's fields at the points."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from compare.comparison import Grid
from compare.shell_process import ShellCase
from compare.vtu import write_vtu
from ribbon import Equilibrium
from ribbon.surface import ruling_foot

FloatArray = NDArray[np.float64]


def ribbon_fields(equilibrium: Equilibrium, grid: Grid) -> dict[str, FloatArray]:
    """Fields on the grid (k, m): S, v (material), foot of the ruling, omega, eta; ruling and normal (k, m, 3)."""
    s, v = np.meshgrid(grid.s, grid.v, indexing="ij")
    material = np.column_stack([s.ravel(), v.ravel()])
    foot = ruling_foot(equilibrium.parameters, equilibrium.problem.lengths, material)
    eta = equilibrium.eta(foot)
    frame = equilibrium.frame(foot)
    ruling = frame[:, :, 0] + eta[:, None] * frame[:, :, 2]
    shape = s.shape
    return {
        "S": s,
        "v": v,
        "ruling_foot": foot.reshape(shape),
        "omega": equilibrium.omega(foot).reshape(shape),
        "eta": eta.reshape(shape),
        "ruling": ruling.reshape(*shape, 3),
        "normal": frame[:, :, 1].reshape(*shape, 3),
    }


def write_ribbon(path: Path, equilibrium: Equilibrium, grid: Grid) -> Path:
    """The ribbon's surface with its fields."""
    return write_vtu(path, grid.ribbon(equilibrium), ribbon_fields(equilibrium, grid))


def write_shell(path: Path, case: ShellCase, grid: Grid) -> Path:
    """A shell's surface with material coordinates and director."""
    s, v = np.meshgrid(grid.s, grid.v, indexing="ij")
    return write_vtu(path, grid.shell(case), {"S": s, "v": v, "director": case.surface.director(s, v)})


def centreline_csv(equilibrium: Equilibrium, points: int = 401) -> str:
    """The centreline as CSV: s, x, y, z (in l), omega (1/l), eta, t_x, t_y, t_z by components."""
    s = np.linspace(0.0, 1.0, points)
    frame = equilibrium.frame(s)
    table = np.column_stack(
        [s, equilibrium.position(s), equilibrium.omega(s), equilibrium.eta(s)]
        + [frame[:, :, column] for column in range(3)]
    )
    names = ["s", "x", "y", "z", "omega", "eta"]
    names += [f"{axis}_{component}" for axis in ("tx", "ty", "tz") for component in "xyz"]
    out = io.StringIO()
    np.savetxt(out, table, delimiter=",", header=",".join(names), comments="", fmt="%.12g")
    return out.getvalue()
