"""A sweep whose table is in parts as a page: result.json, page.json, a picture of some of its rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from compare.measure.grades import FAIR, GOOD, GOOD_UP_TO, POOR, grade
from compare.page.drawing import pictured
from compare.page.page import Page, Picture
from compare.page.study import Study
from compare.page.table import Cell, Column, Table
from compare.page.verdict import Check, Verdict, unchecked
from compare.store.made_by import provenance
from compare.studies.axes import Axis
from compare.sweep.file import COMPARE, Sweep
from compare.sweep.large.aside import aside
from compare.sweep.large.parts import SHAPES, TABLE, TIMES
from compare.sweep.large.stream import Streamed
from compare.sweep.large.summary import Summary, places_told, summary, thinned
from compare.sweep.page import LEGEND, SHOWN, SHOWN_OF_COMPARE, shared, time_text, value_text

_FILES = {
    f"{TABLE}/": "one row per case (and w/h) in Parquet: varied keys, status, what the solver found",
    f"{TIMES}/": "the time of each case in Parquet",
    f"{SHAPES}/": "the centreline of each row in Parquet, single precision, in l",
    "sweep.json": "whose the folder is, and which part of the sweep",
    "result.json": "summary: counts by status, times, failed cases",
}


def write(out: Path, ended: Streamed, again: str) -> tuple[Page, Verdict, bool]:
    """Writes everything but the table; returns the page, the verdict, and whether all cases are stable states."""
    sweep = ended.sweep
    show = sweep.show or (SHOWN_OF_COMPARE if sweep.solver == COMPARE else SHOWN)
    wanted = (show, *((sweep.against,) if sweep.against else ()))
    found: Summary = aside(summary, out, ended.layout.key, sweep.axes, wanted)
    ended = replace(ended, damaged=(*ended.damaged, *found.faults))
    pictures: list[Picture] = []

    def draw() -> None:
        pictures.append(Picture("sweep.png", _drawn(out, sweep, found, show), f"{show} over the sweep"))

    if found.drawn:
        pictured(draw)
    verdict = _answer(ended, found)
    page = Study(
        "sweep",
        sweep.title,
        verdict=verdict,
        tables=(_along(ended, found, show),),
        sentences=tuple(_sentences(ended, found)),
        pictures=tuple(pictures),
        files={name: about for name, about in _FILES.items() if sweep.shapes or name != f"{SHAPES}/"},
    ).write(out, _result(ended, found), again, sweep.scene)
    return page, verdict, found.ok == ended.cases and not ended.damaged


def _drawn(out: Path, sweep: Sweep, found: Summary, show: str) -> str:
    """sweep.png of some of the rows; returns its text alternative."""
    from compare.sweep.picture import draw_rows

    few = tuple(
        Axis(axis.keys, tuple(axis.values[k] for k in some))
        for axis, some in zip(sweep.axes, thinned(sweep.axes), strict=True)
    )
    bad = found.cases - found.ok, found.cases
    return draw_rows(out / "sweep.png", replace(sweep, axes=few), found.drawn, show, sweep.against, bad)


def draw_so_far(out: str, sweep: Sweep, key: str) -> None:
    """sweep.png of the parts that are there while a sweep runs."""
    show = sweep.show or (SHOWN_OF_COMPARE if sweep.solver == COMPARE else SHOWN)
    found = summary(Path(out), key, sweep.axes, (show, *((sweep.against,) if sweep.against else ())))
    if found.drawn:
        _drawn(Path(out), sweep, found, show)


def _answer(ended: Streamed, found: Summary) -> Verdict:
    count = ended.cases
    several = f"{found.ok} of {count} cases are" if count != 1 else "The case is" if found.ok else "The case is not"
    checks = [
        shared("cases", found.ok, count, "stable equilibria"),
        unchecked("branch", "neighbours were not compared")
        if ended.sweep.scene.several_equilibria
        else Check("branch", GOOD, "each scene has one branch"),
        Check("finite", POOR, f"{found.infinite} energies are no numbers")
        if found.infinite
        else Check("finite", FAIR, f"of {found.undetermined} the forces are undetermined (forces_why)")
        if found.undetermined
        else Check("finite", GOOD, "energies and forces are numbers"),
        unchecked("elements", "discretisation errors were not measured (--errors)")
        if found.error is None or found.without_error
        else Check(
            "elements", grade("error", found.error), f"errors of {found.error:.1e} l at most", found.error,
            GOOD_UP_TO["error"],
        ),
    ]  # fmt: skip
    return Verdict.of("sweep", f"{several} in a stable equilibrium", checks).doubted("cases")


def _sentences(ended: Streamed, found: Summary) -> list[str]:
    sizes = " x ".join(str(len(axis.values)) for axis in ended.sweep.axes)
    of = sizes if ended.shard.whole else f"part {ended.shard} of {sizes}"
    others = {status: count for status, count in found.statuses.items() if status != "converged"}
    first = f"{found.ok} of {ended.cases} cases ({of}) converged"
    sentences = ["; ".join([first, ", ".join(f"{n} {status}" for status, n in others.items())]).rstrip("; ") + "."]
    for number, _, text in found.failed[:3]:
        where = ", ".join(f"{key} = {value_text(value)}" for key, value in ended.grid.values(number).items())
        sentences.append(f"Case {number} ({where}): {text}.")
    if sum(others.values()) > 3:
        sentences.append(f"{sum(others.values()) - 3} more are in the table (status).")
    sentences += [f"Damaged, and left out: {fault}." for fault in ended.damaged]
    if ended.missing:
        sentences.append(f"{ended.missing} cases are in none of the folders; the same command without --join goes on.")
    _, middle, most = found.seconds
    if ended.new and middle is not None and most is not None:
        rate = ended.new / max(ended.seconds, 1e-9)
        before = ended.cases - ended.new
        more = f", {before} were finished before" if before else ""
        sentences.append(
            f"{ended.new} cases in {ended.seconds:.3g} s of wall time with {ended.workers} at once ({rate:.3g} a second"
            f"{more}); a case takes about {time_text(middle)} in the median, {time_text(most)} at most."
        )
    elif not ended.missing:
        sentences.append(f"All {ended.cases} were finished before.")
    sentences.append(f"The table is in {TABLE}/, {found.bytes / 1e6:.3g} MB of Parquet.")
    return sentences


def _along(ended: Streamed, found: Summary, show: str) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for axis, along in zip(ended.sweep.axes, found.along, strict=True):
        for place in places_told(axis):
            at, here = axis.values[place], along[place]
            name = ", ".join(f"{key} = {value_text(value)}" for key, value in zip(axis.keys, at, strict=True))
            rows.append((name, here.count, here.bad, *here.spread()))
    columns = (
        Column("at", "at", kind="word"),
        Column("rows", "rows", kind="integer"),
        Column("bad", "not converged", kind="integer"),
        *(Column(name, name, _unit(ended, show), "digits:4") for name in ("smallest", "median", "largest")),
    )
    return Table(f"{show} along the axes", columns, tuple(rows), LEGEND)


def _unit(ended: Streamed, show: str) -> str:
    return next((field.unit for field in ended.layout.fields if field.key == show), "")


def _result(ended: Streamed, found: Summary) -> dict[str, Any]:
    ok = found.ok == ended.cases
    bad = next((status for status in found.statuses if status != "converged"), "converged")
    total, middle, most = found.seconds
    return {
        "sweep": ended.sweep.name,
        "title": ended.sweep.title,
        "solver": ended.sweep.solver,
        "status": bad if bad != "converged" or ok else "missing" if ended.missing else "unstable",
        "stable": found.stable,
        "lowest_eigenvalue": found.lowest,
        "residual": found.residual,
        "iterations": found.iterations,
        "complete": ok and not ended.damaged,
        "cases": ended.cases,
        "ok": found.ok,
        "new": ended.new,
        "shard": str(ended.shard),
        "missing": ended.missing,
        "damaged": list(ended.damaged),
        "statuses": dict(found.statuses),
        "seconds": {"wall": ended.seconds, "sum": total, "median": middle, "slowest": most},
        "rate": ended.new / ended.seconds if ended.new and ended.seconds > 0.0 else None,
        "workers": ended.workers,
        "table": {"rows": found.rows, "bytes": found.bytes, "columns": [f.to_dict() for f in ended.layout.fields]},
        "axes": _axes(ended.sweep.axes),
        "failed": [
            {"case": number, "values": ended.grid.values(number), "status": status, "message": text}
            for number, status, text in found.failed
        ],
        "units": ended.layout.units,
        "provenance": provenance(ended.sweep.scene, {"solver": ended.sweep.solver}),
    }  # fmt: skip


def _axes(axes: Sequence[Axis]) -> list[dict[str, Any]]:
    return [{"keys": axis.keys, "values": axis.values} for axis in axes]
