"""`ribbonbench suite`: cases that any simulator can be held against, and what runners make of them."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from compare.commands import common
from compare.store.progress import Reporter
from ribbonbench.errors import BadInput, Missing

if TYPE_CHECKING:
    from compare.suite.answers import Answers
    from compare.suite.case import Case
    from compare.suite.score import Score

HELP = "cases with references that any simulator can be held against, and its score"
EXAMPLE = "ribbonbench suite run planar --runner ours"
ACTIONS = ("list", "show", "run", "score")


def register(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "action", choices=ACTIONS,
        help="list: the cases; show: one with its references; run: let runners answer; score: answers of one's own",
    )  # fmt: skip
    parser.add_argument(
        "cases", metavar="CASE", nargs="*", default=[],
        help="a case, a level (planar, rods, ...), part of a name, a TOML file or a folder of them (default: all); "
        "with score files of answers",
    )  # fmt: skip
    parser.add_argument(
        "--runner", metavar="NAME", action="append", default=[],
        help="who answers (repeatable; default: ours); entry points of the group ribbonbench.suite add some",
    )  # fmt: skip
    parser.add_argument("--fast", action="store_true", help="only cases that take seconds")
    parser.add_argument(
        "--seconds", metavar="S", type=float, default=60.0, help="seconds for each model and case (default 60)"
    )  # fmt: skip
    parser.add_argument(
        "--hidden", metavar="SEED", type=int, default=None,
        help="take the hidden half: cases drawn with this seed, their references computed on the spot",
    )  # fmt: skip
    common.out_argument(parser, default="out/suite")
    common.printed_arguments(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    """Lists, shows, runs or scores."""
    if not options.seconds > 0.0:
        raise BadInput("--seconds", options.seconds, "is no time above 0", "give seconds, e.g. --seconds 60")
    return {"list": _list, "show": _show, "run": _run, "score": _score}[options.action](options, console)


def _cases(options: argparse.Namespace) -> tuple[Case, ...]:
    """The cases that are meant; of the hidden half those in whose name one of the words is."""
    from compare.suite.case import chosen

    if options.hidden is None:
        return chosen(options.cases, options.fast)
    if options.hidden < 0:
        raise BadInput("--hidden", options.hidden, "is no seed", "give a whole number from 0 on")
    from compare.suite.hidden import drawn

    found = drawn(options.hidden)
    kept = tuple(case for case in found if not options.cases or any(word in case.name for word in options.cases))
    if not kept:
        raise BadInput("CASE", options.cases[0], "is no hidden case", f"known are {', '.join(c.name for c in found)}")
    return kept


def _list(options: argparse.Namespace, console: Console) -> int:
    from compare.page.terminal import print_table
    from compare.suite import page

    found = page.listed(_cases(options))
    options.result = found.records()
    if common.spoken(options):
        print_table(console, found, wide=options.wide)
    return common.DONE


def _show(options: argparse.Namespace, console: Console) -> int:
    from compare.page.terminal import print_table
    from compare.suite import page

    if not options.cases:
        raise BadInput("CASE", None, "is missing", "say which case: ribbonbench suite show michell_ring")
    cases = _cases(options)
    options.result = [
        {"case": case.name, "title": case.title, "says": case.says.strip(), "physics": case.physics,
         "cite": list(case.cite), "licence": case.licence, "asks": page.asked(case).records()}
        for case in cases
    ]  # fmt: skip
    if common.spoken(options):
        for case in cases:
            print_table(console, page.asked(case), wide=True)
            console.print(" ".join(case.says.split()), markup=False, highlight=False)
            console.print(f"After {'; '.join(case.cite)}. Licence: {case.licence}.", markup=False, highlight=False)
    return common.DONE


def _run(options: argparse.Namespace, console: Console) -> int:
    from compare.store.store import check_writable
    from compare.suite import page
    from compare.suite.answers import Absent
    from compare.suite.runners import answered, runner
    from compare.suite.score import scored

    cases = _cases(options)
    runners = {name: runner(name) for name in dict.fromkeys(options.runner or ["ours"])}
    out = check_writable(options.out if options.out is not None else common.OUT / options.command)
    options.results = out
    scores: list[Score] = []
    runs: list[dict[str, Any]] = []
    notes: list[str] = []
    with Reporter(quiet=options.quiet) as reporter, common.held(out, reporter.step):
        for name, function in runners.items():
            said: dict[str, tuple[Answers, ...]] = {}
            try:
                for case in cases:
                    reporter.step(f"{name}: {case.name}")
                    said[case.name] = answered(function, case, options.seconds)
                    scores += [score for one in said[case.name] for score in scored(case, name, one)]
            except Absent as why:
                notes.append(f"{name} was skipped: {why}.")
                continue
            runs.append(page.record(name, cases, said))
        if not runs:
            raise Missing(f"every runner ({' '.join(notes).rstrip('.')})", "install one, or take --runner ours")
        page.write(out, scores, runs, notes, options.line)
    return _told(options, console, scores, notes)


def _score(options: argparse.Namespace, console: Console) -> int:
    from compare.store.store import check_writable
    from compare.suite import page
    from compare.suite.case import load, shipped
    from compare.suite.score import scored

    if not options.cases:
        raise BadInput("CASE", None, "is missing", "give a file of answers: ribbonbench suite score answers.json")
    wanted = options.runner
    scores: list[Score] = []
    runs: list[dict[str, Any]] = []
    notes: list[str] = []
    for name in options.cases:
        found, runners = page.read_answers(Path(name))
        for runner in runners:
            if wanted and runner not in wanted:
                continue
            said: dict[str, tuple[Answers, ...]] = {}
            cases: list[Case] = []
            for who, case_name, digest, answers in found:
                if who != runner:
                    continue
                if case_name not in shipped():
                    notes.append(f"{case_name} of {runner} is no case of this suite.")
                    continue
                case = load(case_name)
                if digest != case.digest:
                    notes.append(f"{case_name} has changed since {runner} answered it.")
                if options.fast and not case.fast:
                    continue
                cases.append(case)
                said[case_name] = answers
                scores += [score for one in answers for score in scored(case, runner, one)]
            runs.append(page.record(runner, cases, said))
    out = check_writable(options.out if options.out is not None else common.OUT / options.command)
    options.results = out
    with common.held(out):
        page.write(out, scores, runs, notes, options.line)
    return _told(options, console, scores, notes)


def _told(options: argparse.Namespace, console: Console, scores: list[Score], notes: list[str]) -> int:
    from compare.page.terminal import print_table, print_verdict
    from compare.suite import page
    from compare.suite.answers import MISTAKE

    if common.spoken(options):
        print_verdict(console, page.answer(scores))
        print_table(console, page.table(page.told(scores)), wide=options.wide)
        for note in notes:
            console.print(f"- {note}", markup=False)
        console.print(f"Results: {options.results}")
    return common.NOT_CONVERGED if any(score.outcome == MISTAKE for score in scores) else common.DONE
