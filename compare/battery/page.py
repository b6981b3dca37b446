"""The battery's table, answer and files: every case with its difficulty, how far it goes, and its worst number."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from compare.battery.case import Case, Rung
from compare.battery.run import FAILED, KNOWN, MENDED, PASSED, SKIPPED, Outcome, counted
from compare.measure.grades import FAIR, GOOD, POOR, UNKNOWN
from compare.page.drawing import pictured
from compare.page.page import Page, Picture
from compare.page.study import Study
from compare.page.table import Table
from compare.page.verdict import Check, Verdict
from compare.record.quantity import Quantity
from compare.store.provenance import versions

TITLE = "Hard cases"
_PICTURE = "battery.png"


def shown(rung: Rung | None) -> str:
    """A rung as a reader sees it; a stroke for none."""
    return "-" if rung is None else f"{rung:g}" if isinstance(rung, float) else str(rung)


_OUTCOMES: tuple[Quantity[Outcome], ...] = (
    Quantity("case", "case", kind="word", rank=0, of=lambda o: o.case.name),
    Quantity("parameter", "difficulty", kind="word", legend="the parameter that its rungs vary", rank=3,
             of=lambda o: o.case.parameter),
    Quantity("reaches", "goes to", kind="word", legend="its value on the last rung before the first that failed",
            rank=1, of=lambda o: shown(o.reaches)),
    Quantity("rungs", "passed", kind="word", legend="rungs that passed, of all that were tried", rank=1,
             of=lambda o: f"{sum(t.ended in (PASSED, MENDED) for t in o.tried)} of {len(o.tried)}"),
    Quantity("worst", "worst", kind="exponent:1", legend="the number that uses most of its bound", rank=1,
             of=lambda o: None if o.worst is None else o.worst.value),
    Quantity("bound", "bound", kind="exponent:1", rank=2, of=lambda o: None if o.worst is None else o.worst.bound),
    Quantity("what", "of", kind="word", legend="what that number is", rank=4,
             of=lambda o: None if o.worst is None else o.worst.what),
    Quantity("ended", "ended", kind="word", rank=0, of=lambda o: o.ended),
    Quantity("seconds", "CPU s", "s", "seconds:2", rank=5, of=lambda o: o.seconds),
    Quantity("why", "why", kind="word", rank=6, of=lambda o: o.why),
    Quantity("hard", "what is hard", kind="word", rank=7, of=lambda o: o.case.hard),
    Quantity("expected", "what is expected, and why", kind="word", rank=7, of=lambda o: o.case.expected),
)  # fmt: skip
_CASES: tuple[Quantity[Case], ...] = (
    Quantity("case", "case", kind="word", rank=0, of=lambda c: c.name),
    Quantity("parameter", "difficulty", kind="word", rank=0, of=lambda c: c.parameter),
    Quantity("hard", "what is hard", kind="word", rank=1, of=lambda c: c.hard),
    Quantity("expected", "what is expected, and why", kind="word", rank=2, of=lambda c: c.expected),
    Quantity("rungs", "rungs", kind="word", rank=3, of=lambda c: " ".join(map(shown, c.rungs))),
    Quantity("long", "more with --long", kind="word", rank=4, of=lambda c: " ".join(map(shown, c.long))),
    Quantity("known", "known failures", kind="word", rank=5, of=lambda c: "; ".join(
        f"{shown(rung)}: {why}" for rung, why in c.known.items())),
)  # fmt: skip


def listed(cases: Sequence[Case]) -> Table:
    """The cases without running them."""
    return Table.of(TITLE, _CASES, cases)


def write_list(out: Path, cases: Sequence[Case], again: str) -> Page:
    """Writes the list of the cases into `out`."""
    found = listed(cases)
    told = Verdict(f"{len(cases)} hard cases with {sum(len(c.ladder(True)) for c in cases)} rungs")
    files = {"result.json": "every case", "cases.csv": "one row for each case"}
    study = Study("battery", TITLE, tables=(found,), verdict=told, data={"cases.csv": found}, files=files)
    return study.write(out, {"cases": found.records(), "provenance": versions()}, again)


def table(outcomes: Sequence[Outcome]) -> Table:
    """One row for each case."""
    return Table.of(TITLE, _OUTCOMES, outcomes)


def answer(outcomes: Sequence[Outcome]) -> Verdict:
    """How many cases hold."""
    ends = [outcome.ended for outcome in outcomes]
    held = sum(end in (PASSED, MENDED) for end in ends)
    failed, known, skipped = (ends.count(end) for end in (FAILED, KNOWN, SKIPPED))
    rest = [f"{failed} failed"] if failed else []
    rest += [f"{known} known to fail somewhere"] if known else []
    rest += [f"{skipped} skipped for what this machine lacks"] if skipped else []
    what = "1 hard case holds" if len(ends) == held == 1 else f"{held} of {len(ends)} hard cases hold"
    grade = POOR if failed else FAIR if known else UNKNOWN if skipped == len(ends) else GOOD
    return Verdict.of("battery", ", ".join([what, *rest]), [Check("cases", grade, what)])


def sentences(outcomes: Sequence[Outcome]) -> list[str]:
    """Every case that does not hold throughout, with why; the worst number of those that do."""
    said = [f"{o.case.name}, {o.ended}: {o.why}." for o in outcomes if o.ended not in (PASSED, SKIPPED)]
    lacking = sorted({t.why for o in outcomes for t in o.tried if t.ended == SKIPPED})
    said += [f"Skipped: {why}." for why in lacking]
    fine = [(o, o.worst) for o in outcomes if o.ended == PASSED and o.worst is not None and not o.worst.timed]
    if fine:
        case, check = max(fine, key=lambda pair: pair[1].strain)
        nearest = f"{case.case.name}, {check.what} {check.value:.2g} of {check.bound:g}"
        said.append(f"Nearest to its bound of those that hold: {nearest}.")
    return said


def result(outcomes: Sequence[Outcome], long: bool) -> dict[str, Any]:
    """result.json: counts of rungs and cases, every case, every rung with its checks."""
    return {
        "long": long,
        "rungs": counted(outcomes),
        "cases": [
            {
                **record,
                "tried": [
                    {"rung": t.rung, "ended": t.ended, "seconds": t.seconds, "why": t.why, "checks": list(t.checks)}
                    for t in outcome.tried
                ],
            }
            for record, outcome in zip(table(outcomes).records(), outcomes, strict=True)
        ],
        "provenance": versions(),
    }


def study(out: Path, outcomes: Sequence[Outcome]) -> Study:
    """The study, its picture drawn into `out`."""
    drawn: list[Picture] = []

    def draw() -> None:
        from compare.battery import picture

        drawn.append(Picture(_PICTURE, picture.draw(out / _PICTURE, outcomes)))

    pictured(draw)
    full = table(outcomes)
    return Study(
        "battery",
        TITLE,
        tables=(full,),
        verdict=answer(outcomes),
        sentences=tuple(sentences(outcomes)),
        pictures=tuple(drawn),
        data={"battery.csv": full, "battery.md": full.select(_MARKDOWN)},
        files={
            "result.json": "every case, rung and check", "battery.csv": "one row for each case",
            "battery.md": "the same as a table",
        },
    )  # fmt: skip


_MARKDOWN = ("case", "parameter", "reaches", "rungs", "worst", "bound", "what", "ended", "why")


def write(out: Path, outcomes: Sequence[Outcome], long: bool, again: str) -> Page:
    """Writes result.json, tables, picture and page.json into `out`."""
    return study(out, outcomes).write(out, result(outcomes, long), again)
