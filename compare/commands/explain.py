"""`ribbonbench explain`: which effects are on, why, and what each costs and changes."""

from __future__ import annotations

import argparse
import contextlib
import tempfile
from collections.abc import Iterator
from pathlib import Path

from rich.console import Console

from compare.commands import common
from compare.store.progress import Reporter

HELP = "which effects a scene has, and what each, on or off, moves and costs"
EXAMPLE = "ribbonbench explain curl_4_3"


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.scene_arguments(parser)
    parser.add_argument("--out", metavar="FOLDER", default=None, help="write result.json and page.json there")
    parser.add_argument(
        "--run", action=argparse.BooleanOptionalAction, default=None,
        help="solve the scene, and again without each effect (default: where a solve is quick)",
    )  # fmt: skip
    parser.add_argument(
        "--shell", action="store_true", help="the same for the scene's thickest shell, on a coarse mesh (slow)"
    )


def run(options: argparse.Namespace, console: Console) -> int:
    """Explains."""
    from compare.models.scope import require_shell
    from compare.page.terminal import print_table, print_verdict
    from compare.pages import explain as effects_page
    from compare.store.shared import shared_store
    from compare.studies import effects_measured
    from compare.studies.effects import explain
    from compare.studies.priced import effects as effects_priced

    scene = common.scene_of(options, computes=False)
    if options.shell:
        require_shell(scene)
    out = None if options.out is None else common.out_folder(options, scene.name)
    solves = shell = prices = None
    with Reporter(quiet=options.quiet) as reporter, _place(out, reporter) as folder:
        choosing = scene.model.accuracy is not None
        reporter.step("the choice of an energy" if choosing else "evaluations with and without each effect")
        found = explain(scene, reporter)
        if options.run is not False or options.shell:
            one = scene if found.choice is None else found.choice.scene
            solves = effects_measured.solves(one, found, reporter, always=options.run)
            prices = effects_priced.priced(one, found, solves, reporter)
        if options.shell and solves is not None:
            shell = effects_measured.shells(scene, solves.grid, shared_store(folder), reporter)
        if out is not None:
            effects_page.write(out, scene, found, solves, shell, options.line, prices)
    if options.json and out is None:
        answer = effects_page.answer(scene, found, solves, prices)
        options.result = {**effects_page.result(scene, found, solves, shell, prices), "answer": answer}
    if common.spoken(options):
        print_verdict(console, effects_page.answer(scene, found, solves, prices))
        for table in effects_page.tables(scene, found, solves, shell, prices, options.wide):
            print_table(console, table, wide=options.wide)
        for sentence in effects_page.sentences(scene, found, solves, prices):
            console.print(f"- {sentence}")
        if out is not None:
            console.print(f"Results: {out}")
    return common.DONE if solves is None or solves.state.ok else common.NOT_CONVERGED


@contextlib.contextmanager
def _place(out: Path | None, reporter: Reporter) -> Iterator[Path]:
    """The folder of results, held; without one a folder for shells that goes away again."""
    if out is not None:
        with common.held(out, reporter.step):
            yield out
    else:
        with tempfile.TemporaryDirectory(prefix="ribbonbench-explain-") as folder:
            yield Path(folder)
