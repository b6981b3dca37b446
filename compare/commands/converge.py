"""`ribbonbench converge`: how the shell approaches the ribbon as h/w falls."""

from __future__ import annotations

import argparse
import math

from rich.console import Console

from compare.commands import common
from compare.commands.lists import ListOf
from compare.store.progress import Reporter
from ribbonbench.errors import BadInput

HELP = "convergence as h/w falls: slope with its interval, the limit, the ribbon's (or another model's) place in it"
EXAMPLE = "ribbonbench converge cantilever --width-to-thickness 20,50,100"
RULINGS = ("free", "straight", "both")


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.scene_arguments(parser)
    common.out_argument(parser)
    common.leave_saddle_argument(parser)
    parser.add_argument(
        "--width-to-thickness", type=ListOf(float), metavar="R,R,...", default=None,
        help="w/h of the shells, two at least (default: the scene's; 20 50 100 200 where it gives one or none)",
    )  # fmt: skip
    parser.add_argument(
        "--elements", type=ListOf(int, 2), metavar="ALONG,ACROSS", default=None, help="elements of the shells"
    )
    parser.add_argument(
        "--ruling", default=None, metavar="KIND",
        help="of the ribbon at s = 0: free, straight, or both of them against the same shells (default: the scene's)",
    )  # fmt: skip


def run(options: argparse.Namespace, console: Console) -> int:
    """Compares and fits."""
    from compare.page.si import for_reader
    from compare.page.terminal import print_table, print_verdict
    from compare.pages import converge as convergence_write
    from compare.store.shared import shared_store
    from compare.studies import converge_run as convergence_run

    for ratio in options.width_to_thickness or []:
        if not (math.isfinite(ratio) and ratio > 1.0):
            raise BadInput("--width-to-thickness", ratio, "is no w/h of a shell", "give numbers above 1")
    if options.elements is not None and min(options.elements) < 1:
        raise BadInput("--elements", " ".join(map(str, options.elements)), "is no mesh", "e.g. --elements 100 8")
    if options.ruling is not None and options.ruling not in RULINGS:
        raise BadInput("--ruling", options.ruling, "is not known", f"choose from {', '.join(RULINGS)}")
    elements = None if options.elements is None else (options.elements[0], options.elements[1])
    scene = convergence_run.prepared(common.scene_of(options), options.width_to_thickness, elements)
    rulings = ("straight", "free") if options.ruling == "both" else (options.ruling,) if options.ruling else ()
    convergence_run.check_rulings(scene, rulings)
    out = common.out_folder(options, scene.name)
    with Reporter(quiet=options.quiet) as reporter, common.held(out, reporter.step):
        found = convergence_run.studies(
            scene, rulings, shared_store(out), reporter, leave_saddle=common.leaves(options)
        )
        reporter.step("writing tables, the picture and surfaces")
        convergence_write.write(out, found, options.line)
    if common.spoken(options):
        units = common.units_of(options, scene)
        print_verdict(console, convergence_write.answer(found, units))
        for one in found:
            last = one is found[-1]
            shown = for_reader(convergence_write.row_table(one, len(found) > 1), units)
            print_table(console, shown, legend=last, wide=options.wide)
            if one.scalars:
                print_table(
                    console, convergence_write.scalar_table(one, len(found) > 1), legend=last, wide=options.wide
                )
        for sentence in convergence_write.sentences(found):
            console.print(f"- {sentence}")
        console.print(f"Results: {out}")
    return common.DONE if all(one.comparison.ok for one in found) else common.NOT_CONVERGED
