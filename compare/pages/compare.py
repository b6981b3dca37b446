"""What `ribbonbench compare` writes: numbers, tables, pictures, surfaces and page.json."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from compare.page.page import Picture, Surface
from compare.page.si import for_reader, with_si
from compare.page.study import Study
from compare.pages import comparison as tables
from compare.pages import result as results
from compare.pages.models.supports import side_by_side
from compare.pages.pictures import comparison as figures
from compare.pages.presenter import presenter
from compare.pages.written import Written, write_shells
from compare.studies.compare import Comparison


def write(out: Path, comparison: Comparison, again: str) -> None:
    """Writes everything of a comparison but its report into the folder `out`, each file atomically.

    page.json, result.json, table.csv, table.md, convergence.png, shapes.png, ribbon.png,
    surfaces.png, centreline.csv, ribbon.vtu, ribbon.npz and shell_wNNNN.vtu (NNNN: w/h). again: the command line.
    """
    scene = comparison.scene
    written = presenter(comparison.fast).write(out, scene, comparison.fast, comparison.grid)
    figures.convergence(out / "convergence.png", comparison)
    figures.shapes(out / "shapes.png", comparison)
    result = results.comparison_result(comparison)
    surfaces = [*(replace(surface, colour="") for surface in written.surfaces), *write_shells(out, comparison)]
    study(comparison, written, surfaces).write(out, result, again, scene)


def study(comparison: Comparison, written: Written, surfaces: Sequence[Surface]) -> Study:
    """A comparison whose surfaces have been written."""
    table, held = tables.table(comparison), side_by_side(comparison.fast, comparison.rows)
    return Study(
        "compare",
        comparison.scene.title,
        verdict=tables.answer(comparison),
        tables=tuple(for_reader(one, comparison.scene.units) for one in (table, held) if one is not None),
        sentences=tuple(tables.verdict(comparison)),
        pictures=(*_pictures(comparison), *written.pictures),
        surfaces=tuple(surfaces),
        data={
            "table.csv": with_si(table, comparison.scene.units),
            "table.md": table,
            **written.data,
            **({} if held is None else {"supports.csv": with_si(held, comparison.scene.units)}),
        },
        files={
            "result.json": "all numbers",
            "table.csv": "the table with full digits",
            **({} if held is None else {"supports.csv": "forces of ends and walls, every model's"}),
            **written.files,
            **{s.file: f"{s.label}: surface with fields (ParaView)" for s in surfaces if s.of_shell},
        },
    )


def _pictures(comparison: Comparison) -> tuple[Picture, ...]:
    """Distance and shapes, in words."""
    shown = [(row.width_to_thickness, row.hausdorff) for row in comparison.rows if row.hausdorff is not None]
    ends = ""
    if shown:
        (first, far), (last, near) = shown[0], shown[-1]
        ends = f" {far:.2e} l at w/h = {first:g}" + (f", {near:.2e} l at w/h = {last:g}." if len(shown) > 1 else ".")
    slope = "" if comparison.slope is None else f" Slope {comparison.slope.value:.2f} in log-log."
    return (
        Picture(
            "convergence.png",
            f"Distance between the models, and the discretisation errors, against h/w.{ends}{slope}",
            "Distance between the models against h/w, beside the discretisation error of each.",
        ),
        Picture(
            "shapes.png",
            f"The ribbon's shape, in blue, on top of {len(shown)} shells, a colour each: two "
            "side views and one in perspective.",
            "The ribbon (blue) on top of the shells (a colour each).",
        ),
    )
