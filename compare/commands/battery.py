"""`ribbonbench battery`: hard cases, judged by checks that are independent of the solvers."""

from __future__ import annotations

import argparse

from rich.console import Console

from compare.commands import common
from compare.store.progress import Reporter

HELP = "hard cases of every model, judged by independent checks: what holds, and how far"
EXAMPLE = "ribbonbench battery contact --long"


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "pattern", metavar="PATTERN", nargs="?", default=None,
        help="a group (contact, shell, ...) or part of a case's name (default: all cases)",
    )  # fmt: skip
    parser.add_argument("--long", action="store_true", help="all rungs of every case (hours; default: the quick ones)")
    parser.add_argument("--list", action="store_true", help="say what the cases are, and run none")
    parser.add_argument("--fresh", action="store_true", help="begin anew (default: go on with what an earlier run did)")
    common.out_argument(parser, default="out/battery")
    common.printed_arguments(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    """Runs the cases; what is done is kept in a journal, and a run that was interrupted goes on."""
    from compare.battery import page
    from compare.battery import run as battery
    from compare.battery.groups import chosen
    from compare.page.terminal import print_table, print_verdict
    from compare.store.store import check_writable
    from compare.sweep.journal import Journal

    cases = chosen(options.pattern)
    out = check_writable(options.out if options.out is not None else common.OUT / options.command)
    options.results = out
    if options.list:
        with common.held(out):
            page.write_list(out, cases, options.line)
        if common.spoken(options):
            print_table(console, page.listed(cases), wide=options.wide)
            console.print(f"Results: {out}")
        return common.DONE
    with Reporter(quiet=options.quiet) as reporter, common.held(out, reporter.step):
        software = battery.software()
        with Journal(out, software, options.fresh) as journal:
            kept = {name: record for name, record in journal.found.items() if name.startswith(software)}
            outcomes = list(battery.run(cases, options.long, software, kept, journal.add, reporter.step))
        reporter.step("writing the tables and the picture")
        written = page.write(out, outcomes, options.long, options.line)
    if common.spoken(options):
        print_verdict(console, page.answer(outcomes))
        print_table(console, page.table(outcomes), wide=options.wide)
        for sentence in written.sentences:
            console.print(f"- {sentence}", markup=False)
        console.print(f"Results: {out}")
    failed = any(outcome.ended == battery.FAILED for outcome in outcomes)
    return common.NOT_CONVERGED if failed else common.DONE
