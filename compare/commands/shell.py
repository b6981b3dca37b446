"""`ribbonbench shell`: the shell alone, also under mpirun."""

from __future__ import annotations

import argparse
from dataclasses import replace

from rich.console import Console

from compare.commands import common
from compare.commands.lists import ListOf
from compare.store.progress import Reporter

HELP = "solve the shell of a scene alone, also under mpirun"
EXAMPLE = "ribbonbench shell curl_4_3 --width-to-thickness 50,100"
PARALLEL = True


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.scene_arguments(parser)
    common.out_argument(parser)
    parser.add_argument(
        "--width-to-thickness", type=ListOf(float), metavar="R,R,...", default=None,
        help="w/h of the shells, one run each (default: the scene's)",
    )  # fmt: skip
    parser.add_argument(
        "--elements", type=ListOf(int, 2), metavar="ALONG,ACROSS", default=None,
        help="elements of the mesh; with --tolerance of the first one",
    )  # fmt: skip
    parser.add_argument(
        "--tolerance", type=float, metavar="X", default=None,
        help="refine the mesh until its estimated error (Hausdorff / length) is below X",
    )  # fmt: skip
    parser.add_argument("--plain", action="store_true", help="plain Newton's method instead of the mixed iteration")


def run(options: argparse.Namespace, console: Console) -> int:
    """Solves the shells."""
    from compare.models.scope import require_shell
    from compare.models.shell_here import run as run_here
    from compare.page.si import for_reader
    from compare.page.terminal import print_table, print_verdict
    from compare.pages import shell as pages
    from compare.store.shared import shared_store
    from ribbonbench.world import world

    options.assignments += [
        f"shell.{name}={value}"
        for name, value in (
            ("width_to_thickness", options.width_to_thickness),
            ("elements", options.elements),
            ("tolerance", options.tolerance),
        )
        if value is not None
    ]
    scene = common.scene_of(options)
    require_shell(scene)
    processes = world()
    out = processes.on_first(lambda: common.out_folder(options, scene.name))
    with Reporter(quiet=options.quiet or not processes.first) as reporter:
        holder = common.held(out, reporter.step)
        processes.on_first(holder.__enter__)
        try:
            iteration = "plain" if options.plain else "mixed"
            states = run_here(scene, shared_store(out), reporter, processes, iteration)
            if processes.first:
                reporter.step("writing results")
            processes.on_first(lambda: pages.write_all(out, scene, states, options.line))
        finally:
            if processes.first:
                holder.__exit__(None, None, None)
    if processes.first and common.spoken(options):
        units = common.units_of(options, scene)
        print_verdict(console, pages.answer(scene, states, units))
        shown = for_reader(replace(pages.table(scene, states), title=scene.title), units)
        print_table(console, shown, legend=False, wide=options.wide)
        for state in states:
            console.print(f"- w/h = {pages.ratio_of(state):g}: {state.message}")
        console.print(f"Results: {out}; as a page: ribbonbench report {out}")
    return common.DONE if all(state.ok for state in states) else common.NOT_CONVERGED
