"""Tables, answer and files of the suite: the cases, one case, and what runners made of them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from compare.measure.grades import FAIR, GOOD, POOR, UNKNOWN
from compare.page.page import Page
from compare.page.study import Study
from compare.page.table import Table
from compare.page.verdict import Check, Verdict
from compare.record.column import Cell
from compare.record.quantity import Quantity
from compare.store.provenance import versions
from compare.store.store import atomic_write_json
from compare.suite.answers import MISTAKE, NOT_REPRESENTABLE, Answers
from compare.suite.case import Ask, Case, Value
from compare.suite.score import MET, Score, counted
from ribbonbench.errors import BadInput

TITLE = "The suite"
ANSWERS = "answers.json"
_VERSION = 1


def _cell(value: Value | None) -> str | None:
    """A value as a reader sees it."""
    if value is None or isinstance(value, bool):
        return None if value is None else "yes" if value else "no"
    if isinstance(value, tuple):
        return " ".join(f"{v:.6g}" for v in value)
    return f"{value:.7g}"


def _interval(widths: Sequence[float]) -> str:
    return " ".join(f"{width:.2g}" for width in widths)


_CASES: tuple[Quantity[Case], ...] = (
    Quantity("case", "case", kind="word", rank=0, of=lambda c: c.name),
    Quantity("level", "level", kind="word", rank=1, of=lambda c: c.level),
    Quantity("title", "title", kind="word", rank=1, of=lambda c: c.title),
    Quantity("asks", "asks", kind="integer", rank=2, of=lambda c: len(c.asks)),
    Quantity("fast", "fast", kind="truth", rank=2, legend="takes seconds", of=lambda c: c.fast),
    Quantity("theory", "theory", kind="word", rank=3, of=lambda c: c.theory),
    Quantity("units", "units", kind="word", rank=4, of=lambda c: c.units),
    Quantity("licence", "licence", kind="word", rank=7, of=lambda c: c.licence),
)
_ASKS: tuple[Quantity[Ask], ...] = (
    Quantity("ask", "asked", kind="word", rank=0, of=lambda a: a.name),
    Quantity("unit", "unit", kind="word", rank=2, of=lambda a: a.unit),
    Quantity("reference", "reference", kind="word", rank=0, of=lambda a: _cell(a.reference)),
    Quantity("interval", "+-", kind="word", rank=1, of=lambda a: _interval(a.interval)),
    Quantity("ways", "obtained by", kind="word", rank=3, of=lambda a: "; ".join(
        f"{way.by}: {_cell(way.value)}" for way in a.ways)),
)  # fmt: skip
_SCORES: tuple[Quantity[Score], ...] = (
    Quantity("case", "case", kind="word", rank=0, of=lambda s: s.case),
    Quantity("ask", "asked", kind="word", rank=0, of=lambda s: s.ask),
    Quantity("runner", "runner", kind="word", rank=3, of=lambda s: s.runner),
    Quantity("way", "by", kind="word", rank=0, of=lambda s: s.way or s.runner),
    Quantity("outcome", "outcome", kind="word", rank=0, of=lambda s: s.told),
    Quantity("value", "value", kind="word", rank=1, of=lambda s: _cell(s.value)),
    Quantity("reference", "reference", kind="word", rank=2, of=lambda s: _cell(s.reference)),
    Quantity("interval", "+-", kind="word", legend="half the interval of the reference", rank=2,
             of=lambda s: _interval(s.interval)),
    Quantity("off", "off", kind="digits:2", legend="distance to the reference in intervals", rank=3,
             of=lambda s: s.off),
    Quantity("mesh", "mesh", kind="digits:2", legend="own change from half as fine, in intervals", rank=3,
             of=lambda s: s.mesh),
    Quantity("seconds", "s", "s", "seconds:2", rank=3, of=lambda s: s.seconds),
    Quantity("unit", "unit", kind="word", rank=5, of=lambda s: s.unit),
    Quantity("why", "why", kind="word", rank=6, of=lambda s: s.why),
    Quantity("version", "version", kind="word", rank=6, of=lambda s: s.version),
)  # fmt: skip


def listed(cases: Sequence[Case]) -> Table:
    """The cases."""
    return Table.of(TITLE, _CASES, cases)


def asked(case: Case) -> Table:
    """What a case asks, with its references."""
    return Table.of(f"{case.title} ({case.name})", _ASKS, case.asks)


def table(scores: Sequence[Score]) -> Table:
    """One row for each question and way; those that a way cannot represent stand in the files alone."""
    return Table.of(TITLE, _SCORES, scores)


def told(scores: Sequence[Score]) -> list[Score]:
    """The scores that a reader is shown: all but those that are not representable, unless these are all of a case."""
    answered = {(score.case, score.runner) for score in scores if score.outcome != NOT_REPRESENTABLE}
    return [s for s in scores if s.outcome != NOT_REPRESENTABLE or (s.case, s.runner) not in answered]


def answer(scores: Sequence[Score]) -> Verdict:
    """How many questions are met by one way at least."""
    asks = {(score.case, score.ask) for score in scores}
    met = {(score.case, score.ask) for score in scores if score.outcome == MET}
    mistakes = counted(scores).get(MISTAKE, 0)
    what = f"{len(met)} of {len(asks)} questions are met within the interval of the reference"
    what += f", {mistakes} answers are an adapter's mistake" if mistakes else ""
    grade = POOR if mistakes else UNKNOWN if not asks else GOOD if met == asks else FAIR
    return Verdict.of("suite", what, [Check("answers", grade, what)])


def record(runner: str, cases: Sequence[Case], said: Mapping[str, Sequence[Answers]]) -> dict[str, Any]:
    """answers.json: what a runner said, case by case, with the digest of the case that it answered."""
    digests = {case.name: case.digest for case in cases}
    entries = [
        {"case": name, "digest": digests[name], "said": [one.to_dict() for one in answers]}
        for name, answers in said.items()
    ]
    return {"version": _VERSION, "runner": runner, "cases": entries}


def read_answers(path: Path) -> tuple[list[tuple[str, str, str, tuple[Answers, ...]]], list[str]]:
    """(runner, case, digest, answers) of every entry of a file of answers, and the runners. `BadInput` for a file that
    is none."""
    try:
        files = json.loads(path.read_text(encoding="utf-8"))
        runs = files if isinstance(files, list) else [files]
        found = [
            (str(run["runner"]), str(entry["case"]), str(entry["digest"]), tuple(map(Answers.from_dict, entry["said"])))
            for run in runs
            for entry in run["cases"]
        ]
    except OSError as fault:
        raise BadInput("CASE", str(path), f"cannot be read: {fault.strerror}", "give a file of answers") from None
    except (ValueError, KeyError, TypeError, AttributeError) as fault:
        raise BadInput(
            "CASE", str(path), f"is no file of answers: {fault!r}", "docs/suite.md says what is in it"
        ) from None
    return found, sorted({runner for runner, *_ in found})


def write(
    out: Path, scores: Sequence[Score], runs: Sequence[Mapping[str, Any]], notes: Sequence[str], again: str
) -> Page:
    """Writes result.json, suite.csv, suite.md, answers.json and page.json into `out`."""
    full = table(scores)
    atomic_write_json(out / ANSWERS, list(runs))
    shown = table(told(scores)).select(("case", "ask", "way", "outcome", "value", "reference", "interval", "seconds"))
    files = {
        "result.json": "every score", ANSWERS: "what the runners said", "suite.csv": "one row for each score",
        "suite.md": "the same as a table",
    }  # fmt: skip
    data = {"suite.csv": full, "suite.md": shown}
    verdict = answer(scores)
    study = Study(
        "suite", TITLE, tables=(table(told(scores)),), verdict=verdict, sentences=tuple(notes), data=data, files=files
    )
    rows: list[dict[str, Cell]] = list(full.records())
    return study.write(out, {"scores": rows, "outcomes": dict(counted(scores)), "provenance": versions()}, again)
