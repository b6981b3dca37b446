"""`ribbonbench branches`: bifurcation diagrams, with an error on every special point."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from compare.commands import common
from compare.commands.lists import ListOf
from compare.store.progress import Reporter
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from compare.scene.scene import Scene
    from compare.studies.branches.run import Asked

HELP = "bifurcation diagrams: what else is an equilibrium, where branches fold, fork and lose stability"
EXAMPLE = "ribbonbench branches shift_7_2 --along clamp.end.position[1] --from 0.01 --to 0.6"


#: What is solved so far, until all is.
JOURNAL = "unfinished.journal"
#: Words of --errors.
ERRORS = ("all", "special", "none")


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.scene_arguments(parser)
    parser.add_argument(
        "--along", metavar="KEY", required=True,
        help="the number that varies: a key of the scene, one component of it (clamp.end.position[1]), or path",
    )  # fmt: skip
    parser.add_argument("--from", type=float, metavar="A", default=None, dest="first", help="its first value")
    parser.add_argument("--to", type=float, metavar="B", default=None, dest="last", help="its last value")
    parser.add_argument(
        "--model", type=ListOf(str), metavar="M,M,...", default=None,
        help="energies or models in one picture, e.g. wunderlich,sadowsky (default: the scene's)",
    )  # fmt: skip
    parser.add_argument(
        "--over", metavar="KEY=VALUES", default=None,
        help="a second number, e.g. strip.width=0.02:0.1:5: where folds and branch points go over it",
    )  # fmt: skip
    parser.add_argument("--branches", type=int, metavar="N", default=None, help="most branches of a model (default 8)")
    parser.add_argument("--steps", type=int, metavar="N", default=None, help="most points of a branch (default 200)")
    parser.add_argument(
        "--within", type=float, metavar="SECONDS", default=None, help="follow nothing further after this time"
    )
    parser.add_argument(
        "--moving", action="store_true",
        help="elements that stand where the curvature passes zero, and move with it: for wide twisted strips",
    )  # fmt: skip
    parser.add_argument(
        "--errors", choices=ERRORS, default=None,
        help="of which points, by elements halved twice (default all, of a shell special ones)",
    )  # fmt: skip
    parser.add_argument("--no-errors", action="store_true", help="the same as --errors none")
    common.out_argument(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    """Follows."""
    from compare.studies.branches.run import BRANCHES, STEPS, Asked

    for option, count in (("--branches", options.branches), ("--steps", options.steps)):
        if count is not None and count < (1 if option == "--branches" else 2):
            raise BadInput(option, count, "is too few", "give a larger whole number")
    if options.within is not None and not (math.isfinite(options.within) and options.within > 0.0):
        raise BadInput("--within", options.within, "is no time", "give seconds, above zero")
    if options.no_errors and options.errors not in (None, "none"):
        raise BadInput("--no-errors", True, f"contradicts --errors {options.errors}", "give one of both")
    errors = "none" if options.no_errors else options.errors
    asked = Asked(
        options.branches or BRANCHES, options.steps or STEPS, errors != "none", options.within, options.moving,
        None if errors is None else errors == "all",
    )  # fmt: skip
    scene = common.scene_of(options)
    out = common.out_folder(options, scene.name)
    over = None if options.over is None else _values(options.over)
    return (
        _diagram(options, console, scene, out, asked)
        if over is None
        else _curves(options, console, scene, out, asked, *over)
    )


def _values(text: str) -> tuple[str, tuple[float, ...]]:
    from compare.studies.branches.over import asked_values

    return asked_values(text)


def _curves(
    options: argparse.Namespace, console: Console, scene: Scene, out: Path, asked: Asked, key: str,
    values: tuple[float, ...],
) -> int:  # fmt: skip
    """Over two numbers."""
    from compare.page.terminal import print_table, print_verdict
    from compare.pages.branches import curves as write
    from compare.studies.branches.over import curves

    with Reporter(quiet=options.quiet) as reporter, common.held(out, reporter.step):
        found = curves(
            scene, options.along, options.first, options.last, key, values, options.model or (), asked, reporter,
            out / "cuts",
        )  # fmt: skip
        reporter.step("writing tables and the picture")
        write.write(out, found, options.line)
    if common.spoken(options):
        print_verdict(console, write.answer(found))
        print_table(console, write.curve_table(found), wide=options.wide)
        for sentence in write.sentences(found):
            console.print(f"- {sentence}")
        console.print(f"Results: {out}")
    return common.DONE if found.ok else common.NOT_CONVERGED


def _diagram(options: argparse.Namespace, console: Console, scene: Scene, out: Path, asked: Asked) -> int:
    """Over one."""
    from compare.page.terminal import print_table, print_verdict
    from compare.pages.branches import page as write
    from compare.studies.branches.run import diagram

    with Reporter(quiet=options.quiet) as reporter, common.held(out, reporter.step):
        found = diagram(
            scene, options.along, options.first, options.last, options.model or (), asked, reporter, out / JOURNAL
        )
        reporter.step("writing tables, shapes and the picture")
        write.write(out, found, options.line)
        if not any(branch.ended == "stopped" for branch in found.branches):
            (out / JOURNAL).unlink(missing_ok=True)
    if common.spoken(options):
        print_verdict(console, write.answer(found))
        special = write.special_table(found)
        if special.rows:
            print_table(console, special, wide=options.wide)
        print_table(console, write.branch_table(found), wide=options.wide)
        for sentence in write.sentences(found):
            console.print(f"- {sentence}")
        console.print(f"Results: {out}")
    return common.DONE if found.ok else common.NOT_CONVERGED
