"""Surfaces of a comparison as VTU files, and what a page says of them."""

from __future__ import annotations

from pathlib import Path

from compare.export.ribbon import write_surface
from compare.export.surfaces import write_shell
from compare.page.page import Surface
from compare.studies.compare import Comparison


def write_ribbon(out: Path, comparison: Comparison, name: str = "ribbon.vtu", label: str = "ribbon") -> Surface:
    """The ribbon's surface."""
    equilibrium, grid = comparison.ribbon.equilibrium, comparison.grid
    write_surface(out / name, equilibrium, grid.ribbon(equilibrium), grid.s, grid.v)
    return Surface(name, label, "ribbon")


def write_shells(out: Path, comparison: Comparison, colour: str = "") -> tuple[Surface, ...]:
    """shell_wNNNN.vtu (NNNN: w/h) of every shell that has a surface; `colour`: the field to begin with."""
    found = []
    for row, case in zip(comparison.rows, comparison.shells, strict=True):
        if case.ok:
            ratio = row.width_to_thickness
            name = f"shell_w{ratio:g}.vtu"
            write_shell(out / name, case, comparison.grid)
            found.append(Surface(name, f"shell, w/h = {ratio:g}", "shell", colour, width_to_thickness=ratio))
    return tuple(found)
