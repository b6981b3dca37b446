"""`ribbonbench solve`: the ribbon alone, or the elastica."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from compare.commands import common
from compare.errors import BadInput
from compare.progress import Reporter

if TYPE_CHECKING:
    from compare.scene import Scene

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


def _ribbon(options: argparse.Namespace, console: Console, reporter: Reporter, scene: Scene, out: Path) -> int:
    from compare import export, profile, way
    from compare.comparison import Grid, ribbon_discretisation_error
    from compare.results import ribbon_result
    from compare.run import run_ribbon
    from compare.store import atomic_write_json, atomic_write_text
    from compare.tables import ribbon_advice, solve_rows

    run = run_ribbon(scene, reporter.step, leave_saddle=options.leave_saddle, folder=out, detail=reporter.detail)
    e = run.equilibrium
    grid = Grid.for_shape(scene, float(abs(e.omega([i / 2000 for i in range(2001)])).max()))
    error = ribbon_discretisation_error(e, grid, reporter)
    reporter.step("writing results")
    export.write_ribbon(out / "ribbon.vtu", e, grid)
    atomic_write_text(out / "centreline.csv", export.centreline_csv(e))
    if run.way is not None:
        atomic_write_text(out / "path.csv", way.log_csv(e.log))
    profile.ribbon_profile(out / "ribbon.png", e, scene.title)
    atomic_write_json(out / "result.json", ribbon_result(scene, run, error))
    if not options.quiet:
        table = Table(title=scene.title, title_justify="left", show_header=False)
        for name, text in (*solve_rows(scene, run, error), ("results", str(out))):
            table.add_row(name, text)
        console.print(table)
        advice = ribbon_advice(scene, error)
        if advice:
            console.print(advice)
    return common.DONE if e.ok else common.NOT_CONVERGED


def _elastica(options: argparse.Namespace, console: Console, reporter: Reporter, scene: Scene, out: Path) -> int:
    from compare.results import elastica_result
    from compare.run import run_elastica
    from compare.store import atomic_write_json

    run = run_elastica(scene, reporter.step)
    result = elastica_result(scene, run)
    atomic_write_json(out / "result.json", result)
    r = run.result
    if not options.quiet:
        table = Table(title=scene.title, title_justify="left", show_header=False)
        table.add_row("status", r.message)
        table.add_row("residual", f"{r.residual:.1e} after {r.iterations} iterations")
        table.add_row("energy / (D w / l)", f"elastic {r.energy.bending:.6f}, gravity {r.energy.gravity:.6f}")
        table.add_row("free end / l", " ".join(f"{c:.6f}" for c in result["end"]["position"]))
        table.add_row("discretisation error", "unknown" if r.error is None else f"{r.error:.1e} l")
        table.add_row("time", f"{run.warm * 1e3:.3g} ms warm, {run.first:.3g} s for the first solve")
        table.add_row("results", str(out))
        console.print(table)
    return common.DONE if r.status.value == "converged" else common.NOT_CONVERGED
