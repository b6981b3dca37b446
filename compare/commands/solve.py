"""`ribbonbench solve`: the ribbon alone, or the elastica."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from compare.commands import common
from compare.store.progress import Reporter

if TYPE_CHECKING:
    from compare.models.base import State
    from compare.scene.scene import Scene

HELP = "solve the model of a scene alone: the ribbon, or what model.energy names"


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.scene_arguments(parser)
    common.out_argument(parser)
    common.leave_saddle_argument(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    """Solves the scene."""
    from compare.page.terminal import print_pairs
    from compare.pages.solve import rows, sentences

    scene = common.scene_of(options)
    out = common.out_folder(options, scene.name)
    with Reporter(quiet=options.quiet) as reporter, common.held(out, reporter.step):
        state = solve_into(out, scene, reporter, options)
    if not options.quiet:
        print_pairs(console, scene.title, [*rows(scene, state), ("results", str(out))])
        for sentence in sentences(scene, state)[1:]:  # what to do; the first one says what the table says
            console.print(sentence)
        console.print(f"As a page: ribbonbench report {out}")
    return common.DONE if state.ok else common.NOT_CONVERGED


def solve_into(out: Path, scene: Scene, reporter: Reporter, options: argparse.Namespace) -> State:
    """Solves the scene's own model and writes its files into the folder `out`."""
    from compare.models.base import Options, check_keys
    from compare.models.choice import chosen
    from compare.pages.solve import write
    from compare.store.store import CaseStore

    model = chosen(scene)
    check_keys(model, scene)
    asked = Options(leave_saddle=options.leave_saddle, error=True, repeats=None, store=CaseStore(out / "cases"))
    state = model.solve(scene, options=asked, say=reporter)
    reporter.step("writing results")
    write(out, scene, state, options.line)
    return state
