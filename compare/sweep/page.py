"""A finished sweep as files: cases.csv (tidy), cases.json (provenance per case), result.json, page.json, a picture."""

from __future__ import annotations

import difflib
import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from compare.measure.grades import FAIR, GOOD, GOOD_UP_TO, POOR, grade
from compare.measure.load_curve import LoadCurve, load_curve_of, watched
from compare.page import force_displacement
from compare.page.drawing import pictured
from compare.page.page import Page, Picture
from compare.page.si import with_si
from compare.page.study import Study
from compare.page.table import Cell, Column, Table
from compare.page.verdict import Check, Verdict, unchecked
from compare.record.views import columns_of, row_of
from compare.scene.change import value_of
from compare.scene.units import Units
from compare.store.finite import explained
from compare.store.made_by import provenance
from compare.store.store import atomic_write_text, case_key
from compare.sweep import shapes
from compare.sweep.branches import branches, others
from compare.sweep.file import COMPARE, Sweep
from compare.sweep.finished import Finished
from compare.sweep.record import OF_GRID, Placed, run_of
from compare.sweep.run import summary
from ribbonbench.errors import BadInput

CASES_FORMAT = 1
"""Of cases.json."""

#: Rows of the page's table; all of them are in cases.csv.
ROWS_SHOWN = 20
#: Part of the cases that is nearly all.
_MOST = 0.9
#: What is shown when nothing is asked for: of a comparison, and of a model.
SHOWN_OF_COMPARE, SHOWN = "hausdorff", "energy.total"
Rows = list[dict[str, Any]]


def rows_of(finished: Finished) -> Rows:
    """One row per case and w/h: `case`, the varied keys, gamma, width (w / l), what the solver found, status, message.

    A case without a result has a row too.
    """
    found: Rows = []
    for case, branch in zip(finished.cases, branches(finished), strict=True):
        record = case.record
        for row, number in zip(record["rows"] or [{}], branch or [None], strict=True):
            own = row_of(OF_GRID, Placed(case, number))
            found.append({"status": record["status"], "stable": None, **case.point.values, **row, **own})
    for load_curve, numbers in _curves(finished, found).values():
        for place, values in force_displacement.curve_of(load_curve).items():
            found[numbers[place]].update(values)
    return found


def _curves(finished: Finished, rows: Rows) -> dict[Any, tuple[LoadCurve | None, list[int]]]:
    """Of a sweep over one axis: for each w/h (None: of a model without) the curve of what is moved, and the rows of its
    states."""
    if len(finished.sweep.axes) != 1 or finished.part:
        return {}
    scenes = {case.point.number: case.point.scene for case in finished.cases}
    keys = watched(finished.sweep.keys)
    found: dict[Any, tuple[LoadCurve | None, list[int]]] = {}
    for ratio in dict.fromkeys(row.get("width_to_thickness") for row in rows):
        numbers = [k for k, row in enumerate(rows) if row.get("width_to_thickness") == ratio and _held(row)]
        stands = []
        for k in numbers:
            values = {key: value_of(scenes[rows[k]["case"]], key) for key in keys}
            forces, moments = (
                {end: [rows[k][f"{kind}.{end}.{c}"] for c in "xyz"] if f"{kind}.{end}.x" in rows[k] else None
                 for end in ("start", "end")}
                for kind in ("force", "moment")
            )  # fmt: skip
            walls = dict.fromkeys(key.split(".")[2] for key in rows[k] if key.startswith("force.wall."))
            pushed = [[rows[k][f"force.wall.{name}.{c}"] for c in "xyz"] for name in walls]
            stands.append(force_displacement.load_point_of(values, {**forces, "walls": pushed}, moments, list(walls)))
        found[ratio] = load_curve_of(stands, finished.sweep.scene.strip.length), numbers
    return found


def _held(row: Mapping[str, Any]) -> bool:
    return row["status"] == "converged" and any(f"force.{end}.x" in row for end in ("start", "end"))


def _units_of_rows(finished: Finished) -> list[Units]:
    """Of every row of `rows_of`: a varied strip has others."""
    return [case.point.scene.units for case in finished.cases for _ in case.record["rows"] or [{}]]


def _units(finished: Finished) -> dict[str, Any] | None:
    """`units` of result.json; None where the cases have different ones."""
    each = list(dict.fromkeys(case.point.scene.units for case in finished.cases))
    return {**each[0].to_dict(), "known": each[0].known} if len(each) == 1 else None


def cases_table(finished: Finished, rows: Rows) -> Table:
    """All rows: number, varied keys, then what has a value in some row, in the order of
    `compare.sweep.record.RUN`."""
    varied = [Column(key, key) for key in finished.sweep.keys]
    first, *known = columns_of(run_of(finished.sweep))
    walls = force_displacement.wall_columns(rows)
    others = [column for column in (*known, *walls) if column.key not in finished.sweep.keys]
    full = Table.of_records("All rows", [first, *varied, *others], rows)
    shown = {"case", *finished.sweep.keys, *full.known().keys}
    return full.select(key for key in full.keys if key in shown)


def cases_json(finished: Finished) -> str:
    """The cases with their provenance: key, hash of the scene, status, time, worker, rows; one line for each.

    What all have in common (versions, the scene before it is varied, solver) stands once, at the top: a case is only
    reused under the very same versions and sources.
    """
    sweep = finished.sweep
    head = {
        "format": CASES_FORMAT,
        "sweep": sweep.name,
        "title": sweep.title,
        "solver": sweep.solver,
        "options": sweep.options,
        "axes": [{"keys": axis.keys, "values": axis.values} for axis in sweep.axes],
        "provenance": provenance(sweep.scene),
    }
    lines = [
        {
            "case": case.point.number,
            "key": case.key,
            "scene_hash": case_key(case.point.scene.canonical()),
            "values": dict(case.point.values),
            "reused": case.reused,
            "warm": case.warm,
            **{name: case.record.get(name) for name in ("status", "message", "seconds", "time", "worker", "rows")},
        }
        for case in finished.cases
    ]
    top = json.dumps(explained(head), indent=2, ensure_ascii=False, allow_nan=False).rstrip().removesuffix("}").rstrip()
    body = ",\n".join("    " + json.dumps(explained(line), ensure_ascii=False, allow_nan=False) for line in lines)
    return f'{top},\n  "cases": [\n{body}\n  ]\n}}\n'


def result(finished: Finished, rows: Rows) -> dict[str, Any]:
    """`result.json`: the summary, with the contract's keys over all cases (worst residual, lowest eigenvalue)."""
    numbers = summary(finished)
    stable = [row["stable"] for row in rows]
    bad = next((case.status for case in finished.cases if not case.ok), "converged")
    return {
        "sweep": finished.sweep.name,
        "title": finished.sweep.title,
        "solver": finished.sweep.solver,
        "status": bad if bad != "converged" or finished.ok else "unstable",
        "stable": False if False in stable else None if None in stable else True,
        "lowest_eigenvalue": _extreme(rows, "lowest_eigenvalue", min),
        "residual": _extreme(rows, "residual", max),
        "iterations": sum(int(row.get("iterations") or 0) for row in rows),
        "complete": finished.ok,
        **numbers,
        "axes": [{"keys": axis.keys, "values": axis.values} for axis in finished.sweep.axes],
        "failed": [
            {"case": case.point.number, "values": dict(case.point.values), "status": case.status,
             "message": case.record["message"]}
            for case in finished.cases if not case.ok
        ],
        "warm": [
            {"case": case.point.number, "start": case.warm} for case in finished.cases if case.warm is not None
        ],
        "other_branches": [{"case": number, "branch": branch} for number, branch in others(finished)],
        "units": _units(finished),
        "provenance": provenance(finished.sweep.scene, {"solver": finished.sweep.solver}),
    }  # fmt: skip


def _extreme(rows: Rows, name: str, pick: Any) -> float | None:
    values = [float(row[name]) for row in rows if row.get(name) is not None]
    return pick(values) if values else None


def quantity(cases: Table, rows: Rows, name: str, option: str) -> str:
    """The name of a column of the `cases_table` that holds numbers; `BadInput` lists them otherwise."""
    able = [key for key in cases.keys if any(is_number(row.get(key)) for row in rows)]
    if name not in able and any(row.get("residual") is not None for row in rows):
        raise BadInput(option, name, "is no column of numbers in cases.csv", f"choose from {', '.join(able)}")
    return name


def check_shown(sweep: Sweep) -> None:
    """`BadInput` for a quantity to show that no result can have, before anything is computed."""
    for option, name in (("--show", sweep.show), ("--against", sweep.against)):
        able = [*sweep.keys, *(column.key for column in columns_of(run_of(sweep)) if column.is_number)]
        if name and name not in able:
            close = difflib.get_close_matches(name, able, n=1)
            hint = f"did you mean {close[0]}? " if close else ""
            raise BadInput(option, name, "is no quantity of a sweep", f"{hint}choose from {', '.join(able)}")


def is_number(value: Any) -> bool:
    """Finite and no truth value."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def answer(finished: Finished) -> Verdict:
    """How many cases are stable equilibria, on one branch, and how accurately: good where all are, fair where nine of
    ten are."""
    found = summary(finished)
    ok, count = found["ok"], found["cases"]
    several = f"{ok} of {count} cases are" if count != 1 else "The case is" if ok else "The case is not"
    aside = len(others(finished))
    if aside:
        several_lie = "one lies" if aside == 1 else f"{aside} lie"
        several = f"Of {count} cases {several_lie} on another branch than the others; {several}"
    checks = [
        shared("cases", ok, count, "stable equilibria"),
        shared("branch", count - aside, count, "on the branch of most"),
        _finite_check(finished),
        _elements_check(finished),
    ]
    return Verdict.of("sweep", f"{several} in a stable equilibrium", checks).doubted("cases", "branch")


def shared(name: str, held: int, count: int, what: str) -> Check:
    """A check of how many of the cases are something: all, nine of ten, fewer."""
    grade = GOOD if held == count else FAIR if held >= _MOST * count else POOR
    return Check(name, grade, f"{held} of {count} {what}", held / max(1, count), 1.0)


def _stable_rows(finished: Finished) -> Rows:
    return [row for row in rows_of(finished) if row["status"] == "converged" and row.get("stable") is not False]


def _finite_check(finished: Finished) -> Check:
    """Whether the energy of every state in the table is a number, and its forces are determined."""
    bad = sum(not is_number(row.get("energy.total")) for row in _stable_rows(finished))
    if bad:
        return Check("finite", POOR, f"{bad} energies are no numbers")
    untold = sum(any("forces_why" in row for row in case.record["rows"]) for case in finished.cases)
    if untold:
        return Check("finite", FAIR, f"of {untold} the forces are undetermined (forces_why)")
    return Check("finite", GOOD, "energies and forces are numbers")


def _elements_check(finished: Finished) -> Check:
    """The largest discretisation error of the states, where each is known."""
    rows = _stable_rows(finished)
    names = ("error", "ribbon_error", "shell_error")
    errors = [[float(row[name]) for name in names if is_number(row.get(name))] for row in rows]
    if not all(errors) or not errors:
        lacking = sum(not one for one in errors)
        return unchecked("elements", f"discretisation errors of {lacking} cases were not measured (--errors)")
    most = max(max(one) for one in errors)
    return Check("elements", grade("error", most), f"errors of {most:.1e} l at most", most, GOOD_UP_TO["error"])


def verdict(finished: Finished) -> list[str]:
    """Sentences: how many converged, what failed, times, the sampled error when it was measured."""
    n = summary(finished)
    keys = " x ".join(str(len(axis.values)) for axis in finished.sweep.axes)
    first = f"{n['ok']} of {n['cases']} cases ({keys}) converged"
    others = {status: count for status, count in n["statuses"].items() if status != "converged"}
    if others:
        first += "; " + ", ".join(f"{count} {status}" for status, count in others.items())
    sentences = [first + "."]
    sentences += _asides(finished)
    failed = [case for case in finished.cases if not case.ok]
    for case in failed[:3]:
        where = ", ".join(f"{key} = {value_text(value)}" for key, value in case.point.values.items())
        sentences.append(f"Case {case.point.number} ({where}): {case.record['message']}.")
    if len(failed) > 3:
        sentences.append(f"{len(failed) - 3} more are in cases.csv.")
    errors = [row["error"] for row in rows_of(finished) if is_number(row.get("error"))]
    if errors:
        errors.sort()
        sentences.append(f"Discretisation errors: median {errors[len(errors) // 2]:.1e} l, largest {errors[-1]:.1e} l.")
    spent = n["seconds"]
    if n["new"] and spent["median"] is not None:
        more = f", {n['cases'] - n['new']} were finished before" if n["new"] < n["cases"] else ""
        sentences.append(
            f"{n['new']} cases in {spent['wall']:.3g} s of wall time with {n['workers']} at once ({n['rate']:.3g} a "
            f"second{more}); a case takes {time_text(spent['median'])} in the median, {time_text(spent['slowest'])} at "
            "most."
        )
    elif not n["new"]:
        sentences.append(f"All {n['cases']} were finished before.")
    return sentences


def _asides(finished: Finished) -> list[str]:
    """Which cases lie on another branch than most, or not on the side of their seed."""
    found = []
    again = sum(case.warm is not None for case in finished.cases)
    if finished.walks:
        found.append(
            f"{again} cases ended beside their neighbours and were brought to the state that theirs lead to (column "
            f"warm; {finished.walks} tried)."
        )
    places = {case.point.number: case.point.values for case in finished.cases}
    aside = others(finished)
    for number, branch in aside[:3]:
        where = ", ".join(f"{key} = {value_text(value)}" for key, value in places[number].items())
        found.append(f"Case {number} ({where}) lies on branch {branch}: its state is none that its neighbours lead to.")
    if len(aside) > 3:
        found.append(f"{len(aside) - 3} more are on other branches: column branch of cases.csv.")
    sides = [row.get("side") for case in finished.cases for row in case.record["rows"]]
    for side, words in (
        ("slid", "slide from the side of their seed, where the strip would not stay, to the other"),
        ("left", "are on the other side of the clamps than their seed"),
    ):
        if side in sides:
            found.append(f"{sides.count(side)} of {len(sides)} states {words} (column side).")
    return found


def time_text(seconds: float) -> str:
    """A time as a reader sees it."""
    return f"{1e3 * seconds:.3g} ms" if seconds < 1.0 else f"{seconds:.3g} s"


def value_text(value: Any) -> str:
    """A varied value as a reader sees it."""
    return f"{value:g}" if isinstance(value, float) else str(value)


def tables(finished: Finished, cases: Table, rows: Rows, show: str) -> list[Table]:
    """The quantity along each axis (smallest, median, largest, failed), and the first rows of the `cases_table`."""
    sweep = finished.sweep
    by_axis: list[tuple[Cell, ...]] = []
    for axis in sweep.axes:
        for value in _ends(axis.values):
            here = [row for row in rows if all(row[k] == v for k, v in zip(axis.keys, value, strict=True))]
            numbers = sorted(row[show] for row in here if is_number(row.get(show)) and row["status"] == "converged")
            name = ", ".join(f"{k} = {value_text(v)}" for k, v in zip(axis.keys, value, strict=True))
            bad = sum(row["status"] != "converged" or row.get("stable") is False for row in here)
            some = (numbers[0], numbers[len(numbers) // 2], numbers[-1]) if numbers else (None, None, None)
            by_axis.append((name, len(here), bad, *some))
    unit = next((column.unit for column in cases.columns if column.key == show), "")
    columns = (
        Column("at", "at", kind="word"),
        Column("rows", "rows", kind="integer"),
        Column("bad", "not converged", kind="integer"),
        *(Column(name, name, unit, "digits:4") for name in ("smallest", "median", "largest")),
    )
    brief = (
        "width_to_thickness",
        "status",
        "stable",
        "branch",
        "iterations",
        show,
        "hausdorff",
        "y_over_x",
        "error",
        "seconds",
    )
    chosen = ["case", *sweep.keys, *(key for key in brief if key in cases.keys)]
    first = cases.select(dict.fromkeys(chosen))
    order = ["case", *sweep.keys, show, "status"]
    ranked = tuple(replace(c, rank=order.index(c.key)) if c.key in order else c for c in first.columns)
    title = "All rows" if len(rows) <= ROWS_SHOWN else f"The first {ROWS_SHOWN} of {len(rows)} rows"
    return [
        Table(f"{show} along the axes", columns, tuple(by_axis), LEGEND),
        replace(
            first,
            title=title,
            columns=ranked,
            rows=first.rows[:ROWS_SHOWN],
            legend="All rows and columns are in cases.csv.",
        ),
    ]


LEGEND = "Lengths in l, energies in D w / l; failed cases are counted, and left out of the numbers."


def _ends(values: tuple[tuple[Any, ...], ...]) -> list[tuple[Any, ...]]:
    """All values, or seven of many, the ends included."""
    if len(values) <= 9:
        return list(values)
    return [values[round(k * (len(values) - 1) / 6)] for k in range(7)]


def draw_so_far(out: str, finished: Finished) -> None:
    """sweep.png of the cases that are there while a sweep runs; nothing where nothing can be shown yet."""
    from compare.sweep import picture as sweep_picture

    sweep, rows = finished.sweep, rows_of(finished)
    show = sweep.show or (SHOWN_OF_COMPARE if sweep.solver == COMPARE else SHOWN)
    if any(is_number(row.get(show)) for row in rows):
        sweep_picture.draw(Path(out) / "sweep.png", finished, rows, show, sweep.against)


def write(out: Path, finished: Finished, again: str) -> Page:
    """Writes everything, each file atomically; returns the page."""
    sweep = finished.sweep
    rows = rows_of(finished)
    atomic_write_text(out / "cases.json", cases_json(finished))
    if sweep.shapes:
        shapes.write(out, (case.record for case in finished.cases), sweep.shapes)
    data: Mapping[str, Any] = result(finished, rows)
    cases = cases_table(finished, rows)
    show = quantity(cases, rows, sweep.show or (SHOWN_OF_COMPARE if sweep.solver == COMPARE else SHOWN), "--show")
    against = quantity(cases, rows, sweep.against, "--against") if sweep.against else ""
    pictures: list[Picture] = []

    def draw() -> None:
        from compare.sweep import picture as sweep_picture

        alt = sweep_picture.draw(out / "sweep.png", finished, rows, show, against)
        pictures.append(Picture("sweep.png", alt, f"{show} over the sweep"))
        curves = {
            ratio: load_curve for ratio, (load_curve, _) in _curves(finished, rows).items() if load_curve is not None
        }
        if curves:
            ratio, load_curve = list(curves.items())[-1]
            title = f"{sweep.title}: force against displacement" + (f", w/h = {ratio:g}" if len(curves) > 1 else "")
            units = sweep.scene.units if _units(finished) is not None else Units()
            pictures.append(force_displacement.draw(out / force_displacement.PICTURE, load_curve, units, title))

    if not finished.part:
        pictured(draw)
    return Study(
        "sweep",
        sweep.title,
        verdict=answer(finished),
        tables=tuple(tables(finished, cases, rows, show)[1 if finished.part else 0 :]),
        sentences=tuple(verdict(finished)),
        pictures=tuple(pictures),
        data={"cases.csv": with_si(cases, _units_of_rows(finished))},
        files={
            "cases.csv": "one row per case (and w/h): varied keys, status, what the solver found",
            "cases.json": "the same with provenance per case",
            "result.json": "summary: counts by status, times, failed cases",
            "journal.jsonl": "the finished cases as they came, from which the same command goes on",
            **({shapes.FILE: "the centreline of each row of cases.csv (NumPy), in l"} if sweep.shapes else {}),
        },
    ).write(out, data, again, sweep.scene)
