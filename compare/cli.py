"""The command `ribbonbench`.

Exit codes: 0 done, 1 computed but not converged or not stable, 2 bad input, 3 something missing on this machine.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from compare.errors import BadInput, RibbonbenchError
from compare.progress import Reporter

DONE, NOT_CONVERGED, BAD_INPUT, MISSING = 0, 1, 2, 3
_INTERRUPTED = 130
_PLAIN_WIDTH = 180


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="ribbonbench",
        description="Thin elastic ribbons cross-validated: curvature-element ribbon, Naghdi shell, planar elastica.",
        epilog="Exit codes: 0 done, 1 computed but not converged or not stable, 2 bad input, 3 something missing.",
    )
    parser.add_argument("--version", action="store_true", help="print the version and stop")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")

    def add(name: str, text: str, out: str | None) -> argparse.ArgumentParser:
        command = commands.add_parser(name, help=text, description=text)
        if out is not None:
            command.add_argument("scene", metavar="SCENE", help="name of a shipped scene, or path of a TOML file")
            command.add_argument(
                "--set", action="append", default=[], metavar="KEY=VALUE", dest="assignments",
                help="replace a key of the scene, e.g. --set strip.gamma=50 (repeatable)",
            )  # fmt: skip
            command.add_argument("--quiet", action="store_true", help="files and exit code only")
        if out:
            command.add_argument("--out", metavar="FOLDER", default=None, help=f"where results go (default {out})")
        return command

    solve = add("solve", "solve the ribbon (or the elastica) of a scene", "out/SCENE")
    compare = add("compare", "compare the ribbon of a scene with shells of several thicknesses", "out/SCENE")
    shell = add("shell", "solve the shell of a scene alone, also under mpirun", "out/SCENE")
    shell.add_argument(
        "--width-to-thickness", nargs="+", type=float, metavar="R", default=None,
        help="w/h of the shells, one run each (default: the scene's)",
    )  # fmt: skip
    shell.add_argument(
        "--elements", nargs=2, type=int, metavar=("ALONG", "ACROSS"), default=None,
        help="elements of the mesh; with --tolerance of the first one",
    )  # fmt: skip
    shell.add_argument(
        "--tolerance", type=float, metavar="X", default=None,
        help="refine the mesh until its estimated error (Hausdorff / length) is below X",
    )  # fmt: skip
    shell.add_argument("--plain", action="store_true", help="plain Newton's method instead of the mixed iteration")
    for command in (solve, compare):
        command.add_argument(
            "--leave-saddle", action="store_true",
            help="where the ribbon stands on a saddle, follow the unstable direction to a stable state",
        )  # fmt: skip
    add("explain", "which effects a scene switches on, why, and what each costs", "")
    add("scenes", "list the shipped scenes", None)
    doctor = add("doctor", "versions, linear algebra, and what is missing with the command that mends it", None)
    doctor.add_argument("--json", action="store_true", help="machine-readable")
    return parser


def _console() -> Console:
    """Plain text (no markup in our words); wide enough for the tables where there is no terminal to ask."""
    console = Console(markup=False)
    return console if console.is_terminal else Console(markup=False, highlight=False, width=_PLAIN_WIDTH)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns the exit code; errors of the user's making are one line on stderr.

    Of several processes (mpirun) only the first speaks, and all end with the same code.
    """
    from compare.world import placed, quiet_but_first, world

    if placed()[1] == 1:
        return _main(arguments)
    with quiet_but_first():
        try:
            code = _main(arguments)
        except SystemExit as stop:  # argparse: a usage line was printed
            code = stop.code if isinstance(stop.code, int) else BAD_INPUT
        sys.stdout.flush()
        sys.stderr.flush()
        world().together()
    return code


def _main(arguments: Sequence[str] | None) -> int:
    parser = _parser()
    options = parser.parse_args(arguments)
    console = _console()
    if options.version:
        from compare import __version__

        console.print(f"ribbonbench {__version__}")
        return DONE
    if options.command is None:
        parser.print_help()
        return BAD_INPUT
    run = {
        "solve": _solve,
        "compare": _compare,
        "shell": _shell,
        "explain": _explain,
        "scenes": _scenes,
        "doctor": _doctor,
    }
    try:
        _check_alone(options.command)
        return run[options.command](options, console)
    except RibbonbenchError as error:
        print(f"ribbonbench: {error}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        print(
            "ribbonbench: interrupted; what is finished (cases, steps of a path) is kept, the same command goes on",
            file=sys.stderr,
        )
        return _INTERRUPTED
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE


def _check_alone(command: str) -> None:
    """Only the shell is solved by several processes."""
    from compare.world import placed

    if placed()[1] > 1 and command != "shell":
        raise BadInput(
            "mpirun", None, f"cannot run ribbonbench {command}: its work is not shared among processes",
            "run it without mpirun; ribbonbench shell can be run so",
        )  # fmt: skip


def _scene(options: argparse.Namespace) -> Any:
    """The scene with the assignments of --set, and its notes on stderr."""
    from compare.scene import load, parse_assignment

    scene = load(options.scene)
    keys = dict(parse_assignment(text) for text in options.assignments)
    if keys:
        scene = scene.replace(keys)
    for note in scene.notes():
        print(f"ribbonbench: note: {note}", file=sys.stderr)
    return scene


def _out(options: argparse.Namespace, scene: Any) -> Path:
    from compare.store import check_writable

    return check_writable(options.out if options.out is not None else Path("out") / scene.name)


def _ribbon_errors() -> type[Exception]:
    from ribbon import RibbonInputError

    return RibbonInputError


def _solve(options: argparse.Namespace, console: Console) -> int:
    scene = _scene(options)
    out = _out(options, scene)
    try:
        if scene.model.energy == "elastica":
            if options.leave_saddle:
                raise BadInput(
                    "--leave-saddle", None, "is for the ribbon, and this scene asks for the elastica",
                    'leave it out, or choose model.energy = "wunderlich"',
                )  # fmt: skip
            return _solve_elastica(options, console, scene, out)
        return _solve_ribbon(options, console, scene, out)
    except _ribbon_errors() as error:
        raise BadInput("scene", scene.name, str(error)) from None


def _solve_ribbon(options: argparse.Namespace, console: Console, scene: Any, out: Path) -> int:
    from compare import export, profile, way
    from compare.comparison import Grid, ribbon_discretisation_error
    from compare.results import ribbon_result
    from compare.run import run_ribbon
    from compare.store import atomic_write_json, atomic_write_text
    from compare.tables import ribbon_advice, solve_rows

    with Reporter(quiet=options.quiet) as reporter:
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
    return DONE if e.ok else NOT_CONVERGED


def _solve_elastica(options: argparse.Namespace, console: Console, scene: Any, out: Path) -> int:
    from compare.results import elastica_result
    from compare.run import run_elastica
    from compare.store import atomic_write_json

    with Reporter(quiet=options.quiet) as reporter:
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
    return DONE if r.status.value == "converged" else NOT_CONVERGED


def _compare(options: argparse.Namespace, console: Console) -> int:
    from compare import report, tables
    from compare.comparison import compare
    from compare.store import CaseStore

    scene = _scene(options)
    scene.require_shell()
    out = _out(options, scene)
    try:
        with Reporter(quiet=options.quiet) as reporter:
            comparison = compare(scene, CaseStore(out / "cases"), reporter, leave_saddle=options.leave_saddle)
            reporter.step("writing tables, pictures and surfaces")
            page = report.write(out, comparison)
    except _ribbon_errors() as error:
        raise BadInput("scene", scene.name, str(error)) from None
    if not options.quiet:
        console.print(tables.as_terminal(comparison))
        for sentence in tables.verdict(comparison):
            console.print(f"- {sentence}")
        console.print(f"Report: {page}")
    return DONE if comparison.ok else NOT_CONVERGED


def _shell(options: argparse.Namespace, console: Console) -> int:
    os.environ.setdefault("OMP_NUM_THREADS", "1")  # read by BLAS when it is loaded
    from compare import shell_run
    from compare.store import CaseStore
    from compare.world import world

    options.assignments += [
        f"shell.{name}={value}"
        for name, value in (
            ("width_to_thickness", options.width_to_thickness),
            ("elements", options.elements),
            ("tolerance", options.tolerance),
        )
        if value is not None
    ]
    scene = _scene(options)
    scene.require_shell()
    processes = world()
    out = processes.on_first(lambda: _out(options, scene))
    with Reporter(quiet=options.quiet or not processes.first) as reporter:
        iteration = "plain" if options.plain else "mixed"
        runs = shell_run.run(scene, CaseStore(out / "cases"), reporter, processes, iteration)
        if processes.first:
            reporter.step("writing results")
        processes.on_first(lambda: shell_run.write(out, scene, runs))
    if processes.first and not options.quiet:
        headings, *lines = shell_run.terminal_rows(scene, runs)
        table = Table(title=scene.title, title_justify="left")
        for heading in headings:
            table.add_column(heading, justify="right", overflow="fold")
        for line in lines:
            table.add_row(*line)
        console.print(table)
        for found in runs:
            console.print(f"- w/h = {found.width_to_thickness:g}: {found.case.data['message']}")
        console.print(f"Results: {out}")
    return DONE if all(found.ok for found in runs) else NOT_CONVERGED


def _explain(options: argparse.Namespace, console: Console) -> int:
    from compare.effects import explain

    scene = _scene(options)
    found = explain(scene)
    if options.quiet:
        return DONE
    table = Table(title=f"{scene.title}: effects", title_justify="left")
    for heading in ("effect", "on", "why", "what it adds"):
        table.add_column(heading, overflow="fold")
    table.add_column("measured cost", justify="right")
    for effect in found.effects:
        cost = "" if effect.seconds is None else f"{max(effect.seconds, 0.0) / found.evaluation:.0%} of an evaluation"
        table.add_row(effect.name, "yes" if effect.on else "no", effect.why, effect.adds, cost)
    console.print(table)
    rows = f"{found.constraints} constraints" if found.constraints else "no constraints"
    asked = "energy, gradient, Hessian" + (", constraints and their Jacobian" if found.constraints else "")
    console.print(
        f"Ribbon: {found.formulation} ({found.formulation_why}); {found.unknowns} unknowns, {found.bounds} "
        f"with bounds, {rows}; one evaluation of {asked} {found.evaluation * 1e6:.0f} us."
    )
    console.print(f"Shell: {found.shell}")
    console.print(f"Third opinion: {found.third_opinion}.")
    return DONE


def _scenes(options: argparse.Namespace, console: Console) -> int:
    from compare.scene import load, shipped

    table = Table(title="Shipped scenes", title_justify="left")
    table.add_column("name", no_wrap=True)
    for heading in ("title", "w/l", "K l", "Gamma", "energy", "elements", "shell w/h"):
        table.add_column(heading, overflow="fold")
    for name in shipped():
        scene = load(name)
        start, end = scene.curvature
        table.add_row(
            name,
            scene.title,
            f"{scene.width:g}",
            f"{start:g}" if start == end else f"{start:g} to {end:g}",
            f"{scene.gamma:.4g}",
            scene.model.energy,
            str(len(scene.model.lengths)),
            ", ".join(f"{r:g}" for r in scene.require_shell()) if scene.has_shell() else "-",
        )
    console.print(table)
    return DONE


def _doctor(options: argparse.Namespace, console: Console) -> int:
    from compare.doctor import main as examine

    return examine(console, as_json=options.json)


if __name__ == "__main__":
    sys.exit(main())
