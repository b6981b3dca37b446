"""What `ribbonbench branches --over` says and writes: curves.json, curves.csv, curves.png."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from compare.measure.grades import FAIR, GOOD, POOR
from compare.page.page import Picture
from compare.page.study import Study
from compare.page.table import Column, Table
from compare.page.verdict import Check, Verdict
from compare.pages.branches.words import WORDS
from compare.pages.pictures.curves import curves_picture
from compare.store.provenance import versions
from compare.store.store import atomic_write_json, jsonable
from compare.studies.branches.over import Curve, Curves

PICTURE, RECORD = "curves.png", "curves.json"


def _mark_columns(found: Curves) -> tuple[Column, ...]:
    return (
        Column("model", "model", kind="word"),
        Column("curve", "curve", kind="integer"),
        Column("kind", "kind", kind="word", words=WORDS),
        Column("other", found.over, found.unit, "digits:6"),
        Column(
            "parameter", found.along.key, found.along.unit, "digits:8",
            legend="the limit of finer elements, where it settles",
        ),
        Column("parameter_error", "+-", found.along.unit, "exponent:1", legend="of that; - : not settled, or a bound"),
        Column("unstable", "unstable modes", kind="integer", legend="of its side with fewer"),
        Column("energy", "energy", "D w / l", "digits:6", rank=9),
    )  # fmt: skip


def mark_table(found: Curves) -> Table:
    """A row for every mark, curve by curve."""
    rows = [
        (m.model, k, m.kind, m.other, m.value, m.error, m.unstable, m.energy)
        for k, curve in enumerate(found.curves)
        for m in curve.marks
    ]
    return Table(f"Folds and branch points over {found.over}", _mark_columns(found), tuple(rows))


def curve_table(found: Curves) -> Table:
    """A row for every curve."""
    columns = (
        Column("model", "model", kind="word"),
        Column("curve", "curve", kind="integer"),
        Column("kind", "kind", kind="word", words=WORDS),
        Column("unstable", "unstable modes", kind="integer", legend="on its side with fewer"),
        Column("first", f"from {found.over}", found.unit, "digits:5"),
        Column("last", "to", found.unit, "digits:5"),
        Column("low", f"least {found.along.key}", found.along.unit, "digits:6"),
        Column("high", "largest", found.along.unit, "digits:6"),
        Column("error", "+- at most", found.along.unit, "exponent:1", legend="- : one of them has none"),
    )
    rows = []
    for k, curve in enumerate(found.curves):
        values = [m.value for m in curve.marks]
        errors = [m.error for m in curve.marks]
        worst = None if any(e is None for e in errors) else max(e for e in errors if e is not None)
        rows.append(
            (curve.model, k, curve.kind, curve.marks[0].unstable, curve.marks[0].other, curve.marks[-1].other,
             min(values), max(values), worst)
        )  # fmt: skip
    return Table("Curves", columns, tuple(rows))


def _checks(found: Curves) -> list[Check]:
    marks = found.marks
    none = sum(bool(cut.why) for cut in found.cuts)
    short, left = sum(cut.short > 0 for cut in found.cuts), sum(cut.left > 0 for cut in found.cuts)
    worst = max(cut.residual for cut in found.cuts)
    loose = sum(m.settles is False for m in marks)
    unknown = sum(m.settles is None for m in marks)
    if not marks:
        settled = Check("settled", GOOD, "no fold and no branch point was met")
    elif loose:
        settled = Check("settled", POOR, f"{loose} of {len(marks)} places do not settle on finer elements")
    elif unknown:
        settled = Check("settled", FAIR, f"{unknown} of {len(marks)} places have no error: bounds, or not asked for")
    else:
        settled = Check("settled", GOOD, "all settle on finer elements")
    values = f"{len(found.cuts)} values of {found.over}"
    ends = f"a branch ends early at {short} of {values}" if short else f"every branch goes to an end at {values}"
    return [
        Check("residual", GOOD, f"residuals up to {worst:.1e}", worst),
        Check(
            "ends",
            POOR if none else FAIR if short else GOOD,
            f"nothing to follow at {none} of {values}" if none else ends,
        ),
        settled,
        Check("complete", FAIR if left else GOOD, f"branches were left out at {left} of {values}" if left else "all"),
    ]


def _told(curve: Curve, found: Curves) -> str:
    first, last = curve.marks[0], curve.marks[-1]

    def place(mark: Any) -> str:
        error = "" if mark.error is None else f" +- {mark.error:.1g}"
        return f"{mark.value:.6g}{error}"

    if len(curve.marks) == 1:
        return f"a {WORDS[curve.kind]} at {found.along.key} = {place(first)} for {found.over} = {first.other:.5g} alone"
    ends = f"{place(first)} at {found.over} = {first.other:.5g} to {place(last)} at {last.other:.5g}"
    return f"a {WORDS[curve.kind]} goes from {found.along.key} = {ends}"


def answer(found: Curves) -> Verdict:
    """Where each model's first special point goes, and which folds meet."""
    said = []
    for model in dict.fromkeys(curve.model for curve in found.curves):
        own = [curve for curve in found.curves if curve.model == model]
        longest = max(own, key=lambda curve: len(curve.marks))
        more = f" (of {len(own)} curves)" if len(own) > 1 else ""
        said.append(f"{model}: {_told(longest, found)}{more}")
    for met in found.meetings:
        place = f"at {met.at:.5g}, " if met.at is not None else ""
        said.append(
            f"two folds of {met.model} meet {place}between {found.over} = {met.between[0]:.5g} and {met.between[1]:.5g}"
        )
    text = "; ".join(said) or f"no fold and no branch point over {found.along.key}, for any {found.over}"
    loose = sum(m.settles is False for m in found.marks)
    first = f"Not settled: {loose} of {len(found.marks)} places are these elements' own. " if loose else ""
    return Verdict.of("branches", first + text, _checks(found)).doubted("settled")


def sentences(found: Curves) -> list[str]:
    """What else to know."""
    said = [f"{found.over} = {cut.other:.6g}: {cut.why}" for cut in found.cuts if cut.why]
    met = {meeting.between for meeting in found.meetings}
    for k, curve in enumerate(found.curves):
        for word, interval in (("begins", curve.begins), ("ends", curve.ends)):
            if interval is not None and interval not in met:
                said.append(
                    f"Curve {k}, of a {WORDS[curve.kind]}, {word} between {found.over} = {interval[0]:.6g} and "
                    f"{interval[1]:.6g}: it leaves the range of {found.along.key}, or what it lies on is not reached."
                )
    said.append("What is not connected with the scene's own branch at a value is not seen there.")
    return said


def record(found: Curves) -> dict[str, Any]:
    """curves.json."""
    return {
        "along": found.along.key, "from": found.along.first, "to": found.along.last, "unit": found.along.unit,
        "over": found.over, "over_unit": found.unit,
        "values": [{"value": cut.other, "whole": cut.whole, "why": cut.why} for cut in found.cuts],
        "curves": [
            {
                "model": curve.model, "kind": curve.kind, "unstable_modes": curve.marks[0].unstable,
                "begins": curve.begins, "ends": curve.ends,
                "points": [
                    {"over": m.other, "parameter": m.value, "error": m.error, "settles": m.settles, "energy": m.energy}
                    for m in curve.marks
                ],
            }
            for curve in found.curves
        ],
        "cusps": [
            {"model": met.model, "between": met.between, "at": met.at, "parameter": met.value}
            for met in found.meetings
        ],
    }  # fmt: skip


def write(out: Path, found: Curves, again: str) -> None:
    """Writes everything into the folder `out`, each file atomically."""
    curves_picture(out / PICTURE, found)
    data = record(found)
    atomic_write_json(out / RECORD, jsonable(data))
    marks = mark_table(found)
    Study(
        "branches",
        f"{found.scene.title}: folds and branch points over {found.over}",
        tables=(curve_table(found), marks),
        verdict=answer(found),
        sentences=tuple(sentences(found)),
        pictures=(
            Picture(
                PICTURE,
                f"{found.along.key} of {len(found.curves)} curves of folds and branch points over {found.over}, with "
                "their errors; a star where two folds meet.",
                "Folds and branch points in the plane of both",
            ),
        ),
        data={"curves.csv": marks},
        files={
            "result.json": "the curves", RECORD: "every point of every curve", "curves.csv": "the same as a table",
        },
    ).write(out, {"branches": data, "provenance": versions()}, again, found.scene)  # fmt: skip
