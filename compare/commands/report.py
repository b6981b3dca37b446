"""`ribbonbench report`: one HTML page and its Markdown twin from stored results."""

from __future__ import annotations

import argparse
from pathlib import Path

from rich.console import Console

from compare.commands import common
from compare.store.progress import Reporter

HELP = "one self-contained HTML page, and its Markdown twin, from stored results"
EXAMPLE = "ribbonbench report out/my"


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "folders", metavar="FOLDER", nargs="*",
        help="folder of results; one without results of its own (out/SCENE, out) stands for all in it "
        "(default out)",
    )  # fmt: skip
    common.out_argument(parser, "FOLDER itself, of several out/report")
    common.quiet_argument(parser)
    common.json_argument(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    """Reports."""
    from compare.pages.report.write import read_report, write_report
    from compare.store.store import check_writable

    given = [Path(name) for name in options.folders] or [common.OUT]
    parts = read_report(given)
    default = given[0] if len(given) == 1 else Path("out") / "report"
    out = check_writable(options.out if options.out is not None else default)
    with Reporter(quiet=options.quiet) as reporter, common.held(out, reporter.step):
        reporter.step(f"writing the report of {len(parts)} result{'s' if len(parts) != 1 else ''}")
        written = write_report(out, parts)
    options.result = {"html": written.html, "markdown": written.markdown, "results": written.results}
    if common.spoken(options):
        size = written.html.stat().st_size / 1e6
        console.print(f"Report: {written.html} ({size:.1f} MB) and {written.markdown}")
    return common.DONE
