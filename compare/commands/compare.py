"""`ribbonbench compare`: the ribbon against shells of several thicknesses."""

from __future__ import annotations

import argparse
import importlib
import importlib.util
from dataclasses import replace

from rich.console import Console

from compare.commands import common
from compare.store.progress import Reporter
from ribbonbench.errors import ShellMissing

HELP = "compare the ribbon of a scene with shells of several thicknesses"
EXAMPLE = "ribbonbench compare curl_4_3"


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.scene_arguments(parser)
    common.out_argument(parser)
    common.leave_saddle_argument(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    """Compares."""
    from compare.models import USUAL
    from compare.models.scope import require_shell
    from compare.page.si import for_reader
    from compare.page.terminal import print_table, print_verdict
    from compare.pages import comparison as tables
    from compare.pages import solve as alone
    from compare.store.shared import shared_store
    from compare.studies.compare import compare

    scene = common.scene_of(options)
    require_shell(scene)
    if importlib.util.find_spec("dolfinx") is not None:
        importlib.import_module("compare.pages.compare")  # what its pictures lack is said before anything is solved
    out = common.out_folder(options, scene.name)
    reporter = Reporter(quiet=options.quiet)
    with common.held(out, reporter.step):
        with reporter:
            try:
                comparison = compare(scene, shared_store(out), reporter, leave_saddle=common.leaves(options))
            except ShellMissing as missing:  # what is finished is kept and told; then what is missing
                kept = out / USUAL  # result.json beside it is a comparison's
                kept.mkdir(exist_ok=True)
                alone.write(kept, missing.scene, missing.found, options.line)
                if common.spoken(options):
                    units = common.units_of(options, scene)
                    print_verdict(console, alone.answer(missing.scene, missing.found, units))
                    console.print(f"Without the shell, as ribbonbench solve: {kept}")
                raise
        if common.spoken(options):
            with common.telling():  # first the answer, then what is drawn and written for its files
                units = common.units_of(options, scene)
                print_verdict(console, tables.answer(comparison, units))
                shown = for_reader(replace(tables.table(comparison), title=scene.title), units)
                print_table(console, shown, legend=False, wide=options.wide)
                for sentence in tables.verdict(comparison):
                    console.print(f"- {sentence}")
                console.file.flush()
        with reporter:
            from compare.pages import compare as pages
            from compare.pages.report.write import read_report, write_report

            reporter.step("writing tables, pictures and surfaces")
            pages.write(out, comparison, options.line)
            page = write_report(out, read_report([out])).markdown
    if common.spoken(options):
        console.print(f"Report: {page.with_suffix('.html')} and {page.name}")
    return common.DONE if comparison.ok else common.NOT_CONVERGED
