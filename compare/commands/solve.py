"""`ribbonbench solve`: the ribbon alone, or the elastica."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from compare.commands import common
from compare.errors import BadInput
from compare.store.progress import Reporter

if TYPE_CHECKING:
    from compare.models.ribbon_run import RibbonRun
    from compare.scene.scene import Scene

HELP = "solve the ribbon (or the elastica) of a scene"


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.scene_arguments(parser)
    common.out_argument(parser)
    common.leave_saddle_argument(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    """Solves the scene."""
    scene = common.scene_of(options)
    out = common.out_folder(options, scene.name)
    with common.ribbon_input(scene.name), Reporter(quiet=options.quiet) as reporter, common.held(out, reporter.step):
        if scene.model.energy == "elastica":
            if options.leave_saddle:
                raise BadInput(
                    "--leave-saddle", None, "is for the ribbon, and this scene asks for the elastica",
                    'leave it out, or choose model.energy = "wunderlich"',
                )  # fmt: skip
            return _elastica(options, console, reporter, scene, out)
        return _ribbon(options, console, reporter, scene, out)


def solve_ribbon(
    options: argparse.Namespace, reporter: Reporter, scene: Scene, out: Path
) -> tuple[RibbonRun, float | None]:
    """Solves the ribbon and writes its files; the run, and its discretisation error (Hausdorff / l) when known."""
    from compare.export import ribbon as export
    from compare.models.ribbon_run import run_ribbon
    from compare.pages.result import ribbon_result
    from compare.pages.solve import ribbon_study
    from compare.pictures import ribbon as profile
    from compare.store.store import atomic_write_bytes
    from compare.studies.compare import Grid, ribbon_discretisation_error

    run = run_ribbon(scene, reporter.step, leave_saddle=options.leave_saddle, folder=out, detail=reporter.detail)
    e = run.equilibrium
    grid = Grid.for_shape(scene, float(abs(e.omega([i / 2000 for i in range(2001)])).max()))
    error = ribbon_discretisation_error(e, grid, reporter)
    reporter.step("writing results")
    export.write_surface(out / "ribbon.vtu", e, grid.ribbon(e), grid.s, grid.v)
    export.write_arrays(out / "ribbon.npz", e)
    atomic_write_bytes(out / "centreline.csv", export.centreline_csv(e))
    profile.ribbon_profile(out / "ribbon.png", e, scene.title)
    ribbon_study(scene, run, error).write(out, ribbon_result(scene, run, error), _again(options), scene)
    return run, error


def _again(options: argparse.Namespace) -> str:
    """The command line that remakes the results."""
    from compare.page.page import again

    return again("solve", options.scene, options.assignments, *(["--leave-saddle"] if options.leave_saddle else []))


def _ribbon(options: argparse.Namespace, console: Console, reporter: Reporter, scene: Scene, out: Path) -> int:
    from compare.pages.comparison import ribbon_advice, solve_rows

    run, error = solve_ribbon(options, reporter, scene, out)
    if not options.quiet:
        _show(console, scene, [*solve_rows(scene, run, error), ("results", str(out))])
        advice = ribbon_advice(scene, error)
        if advice:
            console.print(advice)
        console.print(f"As a page: ribbonbench report {out}")
    return common.DONE if run.equilibrium.ok else common.NOT_CONVERGED


def _elastica(options: argparse.Namespace, console: Console, reporter: Reporter, scene: Scene, out: Path) -> int:
    from compare.models.ribbon_run import run_elastica
    from compare.pages.result import elastica_result
    from compare.pages.solve import ELASTICA_PICTURE, elastica_rows, elastica_study
    from compare.pictures.elastica import elastica_picture

    run = run_elastica(scene, reporter.step)
    result = elastica_result(scene, run)
    elastica_picture(out / ELASTICA_PICTURE, scene, run)
    elastica_study(scene, run, result).write(out, result, _again(options), scene)
    if not options.quiet:
        _show(console, scene, [*elastica_rows(run, result), ("results", str(out))])
    return common.DONE if run.result.status.value == "converged" else common.NOT_CONVERGED


def _show(console: Console, scene: Scene, rows: list[tuple[str, str]]) -> None:
    """Names and texts as a table."""
    table = Table(title=scene.title, title_justify="left", show_header=False)
    for name, text in rows:
        table.add_row(name, text)
    console.print(table)
