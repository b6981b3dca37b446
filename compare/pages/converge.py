"""What `ribbonbench converge` found as sentences, tables, a picture, result.json and page.json."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from compare.measure.grades import FAIR, GOOD, UNKNOWN, YARDSTICK, grade, worst
from compare.models import USUAL
from compare.page import study as page
from compare.page.drawing import save
from compare.page.page import Picture
from compare.page.pair import PAIR, Row
from compare.page.si import for_reader, with_si
from compare.page.table import Cell, Column, Table
from compare.page.verdict import Check, Verdict, unchecked
from compare.page.wording import length
from compare.pages import comparison as tables
from compare.pages.result import comparison_result
from compare.pages.written import write_fast, write_shells
from compare.record.quantity import Quantity, pick
from compare.scene.units import Units
from compare.studies.checks import of_rows, of_state
from compare.studies.converge import LEAST_FOR_LIMIT, line_band
from compare.studies.converge_run import Study

_COLOURS = {"free": "#2b8c83", "straight": "#1f5fa8"}


# -- words ------------------------------------------------------------------------------------------------------------


def _interval(value: tuple[float, float] | None, form: str) -> str:
    return "unknown" if value is None else f"{value[0]:{form}} to {value[1]:{form}}"


def _head(study: Study, several: bool) -> str:
    return f"Ruling {study.ruling} at the clamp: " if several and study.ruling else ""


def answer(found: Sequence[Study], units: Units | None = None) -> Verdict:
    """Whether the ribbon is what the shells tend to: of the first study."""
    one = found[0]
    scene = one.comparison.scene
    units = units or scene.units
    head = _head(one, len(found) > 1)
    if one.limit is None:
        text = f"{head}No limit: it takes {LEAST_FOR_LIMIT} distances above the errors"
        return Verdict.of("converge", text, _checks(one))
    low, high = one.limit.d0.both
    if low > 0.0:
        left = f"at least {length(units, low)} is left at h/w = 0"
        text = f"{head}The {one.model} is not the limit of these shells: {left}"
    elif high <= YARDSTICK:
        text = f"{head}The {one.model} is the limit of these shells, to {length(units, max(high, 0.0))}"
    else:
        far = length(units, max(high, 0.0))
        text = f"{head}The {one.model} may be the limit of these shells, to {far}; thinner shells would tell more"
    return Verdict.of("converge", text, _checks(one)).doubted("limit")


def _checks(one: Study) -> list[Check]:
    """What the answer rests on: the model's own state, the shells, the interval of what is left at h/w = 0."""
    comparison = one.comparison
    own = of_state(comparison.scene, comparison.fast, "converge")
    return [*own, *of_rows(comparison.rows, "converge"), _limit_check(one)]


def _limit_check(one: Study) -> Check:
    if one.limit is None:
        return unchecked("limit", f"it takes {LEAST_FOR_LIMIT} distances above the errors")
    low, high = one.limit.d0.both
    text = f"{low:.1e} to {high:.1e} l are left at h/w = 0"
    if low > 0.0:
        return Check("limit", worst(FAIR, grade("distance", low)), text, low, YARDSTICK)
    return Check("limit", GOOD if high <= YARDSTICK else UNKNOWN, text, high, YARDSTICK)


def sentences(found: Sequence[Study]) -> list[str]:
    """The verdict of every study and, of several, which ribbon is nearer."""
    said = []
    for one in found:
        said += [_head(one, len(found) > 1) + text for text in _sentences(one)]
    said += _nearer(found) if len(found) > 1 else []
    return said


def _nearer(found: Sequence[Study]) -> list[str]:
    """Which of two ribbons is nearer to the thinnest shell: said when the errors, which may move both distances, cannot
    turn it round."""
    last = [(one, one.thinnest) for one in found]
    known = [(one, row, row.hausdorff) for one, row in last if row is not None and row.hausdorff is not None]
    if len(known) < 2:
        return []
    (first, row, d), (other, other_row, far) = sorted(known, key=lambda entry: entry[2])
    words = f"{first.ruling} {d:.1e} l, {other.ruling} {far:.1e} l"
    errors = (row.ribbon_error, other_row.ribbon_error, row.shell_error)
    told = all(error is not None for error in errors)
    if told and far - d > (row.ribbon_error or 0.0) + (other_row.ribbon_error or 0.0) + 2.0 * (row.shell_error or 0.0):
        verdict = f"the ribbon with the {first.ruling} ruling is nearer to the shell"
    else:
        verdict = "the errors do not allow to say which ribbon is nearer to the shell"
    return [f"At w/h = {row.width_to_thickness:g} {verdict} ({words})."]


def _sentences(one: Study) -> list[str]:
    rows, claimed = len(one.comparison.rows), len(one.points)
    said = [
        f"{claimed} of {rows} rows have a distance above the sum of both discretisation errors"
        + ("." if claimed == rows else "; the others are shown and take no part.")
    ]
    if one.slope is None:
        said.append(f"No slope: it takes two such rows. Use a finer shell (--elements) or a finer {one.model}.")
    else:
        s = one.slope
        apart = (
            "scatter: unknown with two rows"
            if s.scatter is None
            else f"scatter {_interval(s.scatter, '.2f')} (Student t, {claimed - 2} degrees of freedom)"
        )
        said.append(
            f"Slope of the distance against h/w in log-log: {s.value:.3f}, 95 % interval {_interval(s.both, '.2f')}; "
            f"{apart}, discretisation errors {_interval(s.errors, '.2f')}{_steps(one)}."
        )
    if one.limit is None:
        said.append(f"No limit: it takes {LEAST_FOR_LIMIT} such rows.")
    else:
        f = one.limit
        said.append(
            f"Limit: distance = {f.d0.value:.2e} + {f.c:.3g} (h/w)^{f.power.value:.2f}, within {f.residual:.1%} on "
            f"every row; left at h/w = 0: 95 % interval {_interval(f.d0.both, '.1e')} l "
            f"(discretisation errors alone {_interval(f.d0.errors, '.1e')})."
        )
        said.append(_place(one))
    inside = [s.name for s in one.scalars if s.inside]
    outside = [s.name for s in one.scalars if s.inside is False]
    if inside:
        said.append(f"Extrapolated to h/w = 0, the {one.model}'s value lies in the interval of: {', '.join(inside)}.")
    if outside:
        said.append(
            f"Extrapolated to h/w = 0, the {one.model}'s value lies outside the interval of: {', '.join(outside)}."
        )
    said += [
        f"w/h = {row.width_to_thickness:g}: the shell is {row.status}: {row.message}"
        for row in one.comparison.rows
        if row.status != "converged"
    ]
    return said


def _steps(one: Study) -> str:
    """The slopes between neighbouring rows, thick to thin: whether the rows follow one power."""
    steps = np.diff(np.log(one.points.distance)) / np.diff(np.log(one.points.x))
    return f"; from row to row, thick to thin: {', '.join(f'{step:.2f}' for step in steps)}" if steps.size > 1 else ""


def _place(one: Study) -> str:
    assert one.limit is not None
    low, high = one.limit.d0.both
    thinnest = one.thinnest
    known = (
        ""
        if thinnest is None or thinnest.hausdorff is None
        else f" (the thinnest shell is {thinnest.hausdorff:.1e} l away)"
    )
    if low > 0.0:
        return f"The {one.model} is not the limit of these shells: at least {low:.1e} l is left at h/w = 0{known}."
    if high <= YARDSTICK:
        return f"The {one.model} is the limit of these shells to {max(high, 0.0):.1e} l{known}."
    return (
        f"The {one.model} may be the limit of these shells: the interval contains 0, and reaches up to "
        f"{high:.1e} l{known}. Thinner shells would tell more."
    )


# -- tables -----------------------------------------------------------------------------------------------------------


_ROWS: tuple[Quantity[Row], ...] = (
    *pick(PAIR, "width_to_thickness", "status", "hausdorff", "centreline", "ribbon_error", "shell_error"),
    Quantity(
        "claimed",
        "takes part",
        kind="truth",
        legend="the distance exceeds the sum of both errors",
        rank=1,
        of=lambda r: r.claimed,
    ),
)
_TIMES: tuple[Quantity[Row], ...] = (
    *pick(PAIR, "seconds.ribbon", "seconds.shell"),
    Quantity("reused", "kept", kind="truth", legend="the shell's time is from an earlier run", of=lambda r: r.reused),
)


def row_table(one: Study, several: bool) -> Table:
    """The three numbers of every row, and whether it takes part."""

    def fit(row: Row) -> float | None:
        return None if one.limit is None else float(one.limit.at(1.0 / row.width_to_thickness))

    fitted = Quantity("fit", "fit", "l", "exponent:2", legend="of distance = d0 + c (h/w)^q", rank=3, of=fit)
    return Table.of(
        f"{_head(one, several)}Distance between ribbon and shell",
        (*_ROWS, fitted, *_TIMES),
        one.comparison.rows,
        "Lengths in l, times in seconds of one solve (compilation apart).",
    )


_SCALARS = (
    Column("quantity", "quantity", kind="word", rank=0),
    Column("value", "value", kind="digits:6", rank=1),
    Column("low", "low", kind="digits:6", legend="lower end of the 95 % interval", rank=2),
    Column("high", "high", kind="digits:6", legend="its upper end", rank=2),
    Column(USUAL, USUAL, kind="digits:6", rank=1),
    Column(
        "inside", "ribbon inside", kind="truth", legend="in the interval, widened by the ribbon's own error", rank=1
    ),
)


def scalar_table(one: Study, several: bool) -> Table:
    """What the shell tends to as h/w falls, beside the ribbon."""
    rows: list[tuple[Cell, ...]] = []
    if one.limit is not None:
        d0 = one.limit.d0
        rows.append(("distance / l", d0.value, *d0.both, 0.0, one.inside))
    rows += [(s.name, s.value.value, *s.value.both, s.ribbon, s.inside) for s in one.scalars]
    return Table(
        f"{_head(one, several)}Extrapolated to h/w = 0",
        _SCALARS,
        tuple(rows),
        "Richardson's extrapolation with the fitted power of h/w; the intervals are of scatter, power and, for the "
        "end, discretisation errors together (those of the energies are not known). Energies in D w / l without the "
        "constant of the natural curvature.",
    )


# -- picture ----------------------------------------------------------------------------------------------------------


def picture(path: Path, found: Sequence[Study]) -> Path:
    """Distances with their errors against h/w, the fits with their bands, limit and ribbon's error."""
    figure = Figure(figsize=(7.2, 6.2), layout="constrained")
    axes = figure.add_subplot()
    for one in found:
        _curve(axes, one, _COLOURS.get(one.ruling, "#1f5fa8"), f" ({one.ruling})" if len(found) > 1 else "")
    axes.axhline(YARDSTICK, color="0.35", lw=1, ls=":", label="1 permille of l")
    axes.set_xscale("log")
    axes.set_yscale("log")
    ratios = sorted({row.width_to_thickness for one in found for row in one.comparison.rows})
    axes.set_xticks([1.0 / r for r in ratios], labels=[f"1/{r:g}" for r in ratios])
    axes.set_xticks([], minor=True)
    axes.set_xlabel("h / w")
    axes.set_ylabel("Hausdorff distance / l")
    axes.set_title(found[0].comparison.scene.title)
    axes.grid(True, which="both", lw=0.3, alpha=0.6)
    figure.legend(*axes.get_legend_handles_labels(), fontsize=7.5, loc="outside lower center", ncols=2)
    return save(figure, path)


def _curve(axes: Axes, one: Study, colour: str, name: str) -> None:
    rows = [r for r in one.comparison.rows if r.hausdorff is not None]
    if not rows:
        return
    x = np.array([1.0 / r.width_to_thickness for r in rows])
    d = np.array([r.hausdorff for r in rows], dtype=float)
    error = np.array([(r.ribbon_error or 0.0) + (r.shell_error or 0.0) for r in rows])
    claimed = np.array([r.claimed for r in rows])
    bars = np.vstack([np.minimum(error, 0.95 * d), error])
    axes.errorbar(
        x[claimed], d[claimed], bars[:, claimed], fmt="o", color=colour, capsize=3, ms=5, zorder=4,
        label=f"ribbon to shell{name}, with both errors",
    )  # fmt: skip
    if not claimed.all():
        axes.errorbar(
            x[~claimed], d[~claimed], bars[:, ~claimed], fmt="o", mfc="white", color=colour, capsize=3, ms=7, zorder=4,
            label=f"not above the errors{name}",
        )  # fmt: skip
    if one.slope is not None:
        fine = np.geomspace(0.6 * x.min(), 1.3 * x.max(), 200)
        middle, low, high = line_band(one.points, fine)
        axes.plot(fine, middle, color=colour, lw=1.1, label=f"slope {one.slope.value:.2f}{name}")
        axes.fill_between(fine, low, high, color=colour, alpha=0.12, lw=0, label=f"95 % band of the line{name}")
        if one.limit is not None:
            curve = one.limit.at(fine)
            axes.plot(
                fine[curve > 0.0], curve[curve > 0.0], color=colour, lw=1.1, ls="-.",
                label=f"{one.limit.d0.value:.1e} + c (h/w)^{one.limit.power.value:.2f}{name}",
            )  # fmt: skip
            if one.limit.d0.both[1] > 0.0:
                axes.axhline(
                    one.limit.d0.both[1], color=colour, lw=0.9, ls=(0, (1, 2)), label=f"limit: upper end, 95 %{name}"
                )
    if one.comparison.fast.error:
        axes.axhline(one.comparison.fast.error, color=colour, lw=0.9, ls="--", label=f"ribbon's error{name}")


# -- files ------------------------------------------------------------------------------------------------------------


def _numbers(one: Study) -> dict[str, Any]:
    return {
        "ruling": one.ruling or None,
        "claimed": len(one.points),
        "slope": one.slope,
        "limit": one.limit,
        "ribbon_in_limit": one.inside,
        "scalars": one.scalars,
        "sentences": _sentences(one),
    }


def result(found: Sequence[Study]) -> dict[str, Any]:
    """`result.json`: the comparison's keys of the first study, its fits under `convergence`, all of several in
    `rulings`."""
    document = comparison_result(found[0].comparison)
    document["convergence"] = _numbers(found[0])
    if len(found) > 1:
        document["rulings"] = [{**_numbers(one), "rows": comparison_result(one.comparison)["rows"]} for one in found]
    return document


def write(out: Path, found: Sequence[Study], again: str) -> None:
    """result.json, table.csv (of several: table_RULING.csv), converge.png, surfaces, page.json."""
    several = len(found) > 1
    first = found[0].comparison
    files, data = {"result.json": "all numbers"}, {}
    for one in found:
        name = f"table_{one.ruling}.csv" if several else "table.csv"
        data[name] = with_si(tables.table(one.comparison), first.scene.units)
        files[name] = f"{_head(one, several)}rows with full digits"
    picture(out / "converge.png", found)
    fast = [
        surface
        for one in found
        for surface in write_fast(out, one.comparison, f"_{one.ruling}" if several else "", _head(one, several))
    ]
    lines = sentences(found)
    page.Study(
        "converge",
        f"{first.scene.title}: convergence as h/w falls",
        verdict=answer(found),
        tables=tuple(
            t
            for one in found
            for t in (for_reader(row_table(one, several), first.scene.units), scalar_table(one, several))
        ),
        sentences=tuple(lines),
        pictures=(
            Picture(
                "converge.png",
                "Distance between ribbon and shell against h/w, both logarithmic, with error bars, fitted lines "
                f"and their bands. {' '.join(lines[:4])}",
                "Convergence as h/w falls",
            ),
        ),
        surfaces=(*fast, *write_shells(out, first)),
        data=data,
        files=files,
    ).write(out, result(found), again, first.scene)
