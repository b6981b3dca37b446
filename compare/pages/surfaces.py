"""Surfaces of a comparison as VTU files, and what a page says of them."""

from __future__ import annotations

from pathlib import Path

from compare.export.surfaces import write_shell, write_surface
from compare.page.page import Surface
from compare.studies.compare import Comparison


def write_fast(out: Path, comparison: Comparison, ending: str = "", before: str = "") -> tuple[Surface, ...]:
    """The surface of the model beside the shells, where it has one; `ending` of the file's name, `before` the label."""
    fast, grid = comparison.fast, comparison.grid
    if fast.shape is None:
        return ()
    name = f"{fast.model}{ending}.vtu"
    write_surface(out / name, fast.shape, grid)
    return (Surface(name, f"{before}{fast.model}", "ribbon"),)


def write_shells(out: Path, comparison: Comparison, colour: str = "") -> tuple[Surface, ...]:
    """shell_wNNNN.vtu (NNNN: w/h) of every shell that has a surface; `colour`: the field to begin with."""
    found = []
    for row, state in zip(comparison.rows, comparison.shells, strict=True):
        if state.ok:
            ratio = row.width_to_thickness
            name = f"shell_w{ratio:g}.vtu"
            write_shell(out / name, state.native, comparison.grid)
            found.append(Surface(name, f"shell, w/h = {ratio:g}", "shell", colour, width_to_thickness=ratio))
    return tuple(found)
