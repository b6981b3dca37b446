"""What `ribbonbench compare` writes: numbers, tables, pictures, surfaces, page.json, and the reports made from it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from compare.export import surfaces as export
from compare.page.page import Page, Picture, Surface, Table, write_page
from compare.pages import comparison as tables
from compare.pages import result as results
from compare.pages.solve import upwards
from compare.pages.written import Written, write_any
from compare.pictures import comparison as figures
from compare.report.write import MARKDOWN, read_report, write_report
from compare.store.store import atomic_write_json, atomic_write_text
from compare.studies.compare import Comparison

REPORT = MARKDOWN


def write(out: Path, comparison: Comparison, again: str) -> Path:
    """Writes everything of a comparison into the folder `out`, each file atomically, and returns report.md's path.

    report.html, report.md, page.json, result.json, table.csv, table.md, convergence.png, shapes.png, ribbon.png,
    surfaces.png, centreline.csv, ribbon.vtu, ribbon.npz and shell_wNNNN.vtu (NNNN: w/h). again: the command line.
    """
    atomic_write_json(out / "result.json", results.comparison_result(comparison))
    atomic_write_text(out / "table.csv", tables.as_csv(comparison))
    atomic_write_text(out / "table.md", tables.as_markdown(comparison))
    own = results.presenter(comparison.fast)
    written = (write_any if own is None else own.write)(out, comparison.scene, comparison.fast, comparison.grid)
    surfaces = [replace(surface, colour="") for surface in written.surfaces]
    for row, state in zip(comparison.rows, comparison.shells, strict=True):
        if state.ok:
            ratio = row.width_to_thickness
            name = f"shell_w{ratio:g}.vtu"
            export.write_shell(out / name, state.native, comparison.grid)
            surfaces.append(Surface(name, f"shell, w/h = {ratio:g}", "shell", width_to_thickness=ratio))
    figures.convergence(out / "convergence.png", comparison)
    figures.shapes(out / "shapes.png", comparison)
    write_page(out, page(comparison, written, surfaces, again))
    return write_report(out, read_report([out])).markdown


def page(comparison: Comparison, written: Written, surfaces: list[Surface], again: str) -> Page:
    """The page of a comparison whose surfaces have been written."""
    scene = comparison.scene
    result = results.comparison_result(comparison)
    chosen = tables.columns(comparison)
    rows = [tuple(c.text(c.value(row)) for c in chosen) for row in comparison.rows]
    rows.append(tuple(tables.ribbon_cells(comparison, chosen)))
    return Page(
        command="compare",
        title=scene.title,
        verdict=tuple(tables.verdict(comparison)),
        tables=(Table("Ribbon against shell", tuple(c.heading for c in chosen), tuple(rows), legend=tables.LEGEND),),
        pictures=(*_pictures(comparison), *written.pictures),
        surfaces=tuple(surfaces),
        files={
            "result.json": "all numbers",
            "table.csv": "the table with full digits",
            **written.files,
            **{s.file: f"{s.label}: surface with fields (ParaView)" for s in surfaces if s.kind == "shell"},
        },
        scene=scene.to_toml(),
        up=upwards(scene),
        provenance=result["provenance"],
        again=again,
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
            f"The ribbon's shape, in blue, on top of {len(shown)} shells, in grey, darker as they get thinner: two "
            "side views and one in perspective.",
            "The ribbon (blue) on top of the shells (grey, darker as they get thinner).",
        ),
    )
