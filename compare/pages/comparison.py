"""The comparison table as CSV, Markdown and on the terminal: the same columns in the same order."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.table import Table

from compare.models.elastica_start import PLANAR, out_of_plane
from compare.models.shell_build import line_weight
from compare.pages.elastica import BEGAN, message
from compare.pages.solve import sentences
from compare.studies.compare import Comparison, Row

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Column:
    """A column: its name in CSV, its heading, the value of a row, and how a reader sees it."""

    name: str
    heading: str
    value: Callable[[Row], Any]
    text: Callable[[Any], str]


def _number(form: str) -> Callable[[Any], str]:
    return lambda value: "-" if value is None else format(value, form)


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.3g}"


def _part(kind: str, name: str) -> Callable[[Row], Any]:
    def value(row: Row) -> Any:
        table = getattr(row, kind)
        return None if table is None else table.get(name)

    return value


def _energy(name: str) -> Callable[[Row], Any]:
    """A part of the energy, in the convention of every model."""

    def value(row: Row) -> Any:
        found = None if row.energy is None else getattr(row.energy, name)
        return None if found is None else found + 0.0

    return value


_COLUMNS = (
    Column("width_to_thickness", "w/h", lambda r: r.width_to_thickness, _number("g")),
    Column("status", "shell", lambda r: r.status, str),
    Column("start", "start", lambda r: r.start, str),
    Column("hausdorff", "distance", lambda r: r.hausdorff, _number(".2e")),
    Column("centreline", "centreline", lambda r: r.centreline, _number(".2e")),
    Column("ribbon_error", "ribbon error", lambda r: r.ribbon_error, _number(".1e")),
    Column("shell_error", "shell error", lambda r: r.shell_error, _number(".1e")),
    Column("claimed", "models differ", lambda r: r.claimed, lambda v: "yes" if v else "not shown"),
    Column("membrane_share", "membrane %", _part("share", "membrane"), _percent),
    Column("shear_share", "shear %", _part("share", "shear"), _percent),
    Column("elastic", "elastic", _energy("elastic"), _number(".6g")),
    Column("gravity", "gravity", _energy("gravity"), _number(".6g")),
    Column("total", "total", _energy("total"), _number(".6g")),
    Column("seconds_ribbon", "ribbon s", lambda r: r.seconds["ribbon"], _number(".2g")),
    Column("seconds_shell", "shell s", lambda r: r.seconds["shell"], _number(".3g")),
    Column("ratio", "ratio", lambda r: r.ratio, lambda v: "-" if v is None else f"{v:.0f}"),
)
_ELASTICA = Column("elastica", "to elastica", lambda r: r.elastica, _number(".2e"))
#: What the headings mean, under the table.
LEGEND = (
    "Lengths in l, energies in D w / l without the constant of the natural curvature, times in seconds of one solve "
    "(compilation apart). distance: symmetric Hausdorff distance of the surfaces; centreline: largest distance at "
    "equal s; errors: of the discretisations, by refinement; models differ: the distance exceeds the sum of both "
    "errors; ratio: shell time over ribbon time; start: where the shell's solve began, its path or the ribbon's "
    "surface (it then settles at the full load)."
)


def columns(comparison: Comparison) -> tuple[Column, ...]:
    """The columns of this comparison; the elastica's is absent where there is none."""
    return _COLUMNS if comparison.elastica is None else (*_COLUMNS, _ELASTICA)


def as_csv(comparison: Comparison) -> str:
    """All rows with full digits, names of the columns first; empty where there is no value."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    chosen = columns(comparison)
    writer.writerow([c.name for c in chosen])
    for row in comparison.rows:
        values = [c.value(row) for c in chosen]
        writer.writerow(["" if v is None else repr(v) if isinstance(v, float) else v for v in values])
    return out.getvalue()


def as_markdown(comparison: Comparison) -> str:
    """The table in Markdown, the ribbon's own energies as its last row."""
    chosen = columns(comparison)
    lines = [
        "| " + " | ".join(c.heading for c in chosen) + " |",
        "|" + "|".join("---:" for _ in chosen) + "|",
    ]
    lines += ["| " + " | ".join(c.text(c.value(row)) for c in chosen) + " |" for row in comparison.rows]
    lines.append("| " + " | ".join(ribbon_cells(comparison, chosen)) + " |")
    return "\n".join(lines) + "\n"


def ribbon_cells(comparison: Comparison, chosen: tuple[Column, ...]) -> list[str]:
    """The cells of the ribbon, the limit h/w = 0 of the inextensible model."""
    energy = comparison.fast.energy
    elastic, gravity, total = (None, None, None) if energy is None else (energy.elastic, energy.gravity, energy.total)
    cells = {
        "width_to_thickness": comparison.fast.model,
        "status": comparison.fast.word,
        "ribbon_error": _number(".1e")(comparison.fast.error),
        "elastic": _number(".6g")(elastic),
        "gravity": _number(".6g")(gravity),
        "total": _number(".6g")(total),
        "seconds_ribbon": f"{comparison.fast.seconds.warm:.2g}",
    }
    if comparison.elastica_distance is not None:
        cells["elastica"] = f"{comparison.elastica_distance:.2e}"
    return [cells.get(c.name, "") for c in chosen]


def as_terminal(comparison: Comparison) -> Table:
    """The table for a terminal."""
    chosen = columns(comparison)
    table = Table(title=comparison.scene.title, title_justify="left")
    for column in chosen:
        table.add_column(column.heading, justify="right", overflow="fold")
    for row in comparison.rows:
        table.add_row(*(c.text(c.value(row)) for c in chosen))
    table.add_section()
    table.add_row(*ribbon_cells(comparison, chosen))
    return table


def verdict(comparison: Comparison) -> list[str]:
    """What the table says, in sentences that its numbers bear out."""
    said: list[str] = []
    fast = comparison.fast
    said += sentences(comparison.scene, fast)
    if comparison.slope is not None:
        low, high = comparison.slope.spread
        word = "falls" if comparison.falls else "does not fall on every row"
        said.append(
            f"The distance between the models {word} as h/w falls: slope {comparison.slope.value:.2f} in log-log over "
            f"{comparison.slope.rows} rows on which it exceeds both errors (between rows {low:.2f} to {high:.2f})."
        )
    else:
        said.append("No slope: fewer than two rows have a distance above the discretisation errors.")
    if not comparison.falls:
        said += _undecided(comparison)
        said += _other_model(comparison)
    times = [r for r in comparison.rows if r.ratio is not None and None not in (r.shell_error, r.ribbon_error)]
    if times:
        last = times[-1]
        said.append(
            f"Time: at w/h = {last.width_to_thickness:g} the shell takes {last.seconds['shell']:.3g} s (error "
            f"{last.shell_error:.1e} l), the {fast.model} {fast.seconds.warm:.2g} s (error {last.ribbon_error:.1e} l): "
            f"a factor {last.ratio:.0f}"
            + ("; the shell's time is from the run that stored it" if last.reused else "")
            + ("." if last.start.startswith("path") else "; the shell began at the ribbon's surface.")
        )
    weight = line_weight(comparison.scene)
    said += [weight] if weight else []
    if comparison.elastica is not None and comparison.elastica_distance is not None:
        third = comparison.elastica
        said.append(
            f"Elastica (the scene is planar; begun at {BEGAN[third.start]}): centreline "
            f"{comparison.elastica_distance:.1e} l from the {fast.model}'s; its own error {third.error or 0.0:.1e} l; "
            f"{message(third)}." + _left_plane(comparison)
        )
    said += [
        f"w/h = {row.width_to_thickness:g}: the shell is {row.status}: {row.message}"
        for row in comparison.rows
        if row.status != "converged"
    ]
    return said


def _left_plane(comparison: Comparison) -> str:
    """That the ribbon leaves the plane, where it does: then it is not the elastica's shape."""
    shape = comparison.fast.shape
    if shape is None:
        return ""
    across = out_of_plane(comparison.scene, shape, np.linspace(0.0, 1.0, 201))
    if across <= PLANAR:
        return ""
    return (
        f" The ribbon leaves the plane (its tangent by up to {across:.2g}): the planar shape is not the one it takes."
    )


def _other_model(comparison: Comparison) -> list[str]:
    """What makes this ribbon another model than the limit of its shells."""
    scene = comparison.scene
    found = []
    for name, clamp in (("start", scene.clamp_start), ("end", scene.clamp_end)):
        if clamp is None:
            continue
        if scene.shell.clamp == "edge" and clamp.ruling == "free":
            found.append(f'the shell holds its whole edge: clamp.{name}.ruling = "straight" does the same')
        if scene.shell.clamp == "corners" and clamp.ruling == "straight":
            found.append(f'the shell is held at its corners only: clamp.{name}.ruling = "free" is nearer to that')
    if not comparison.fast.numbers.get("knows_width", True):
        found.append('the shell has a finite width: model.energy = "wunderlich"')
    return [f"The ribbon need not be the shell's limit: {'; '.join(found)}."] if found else []


def _undecided(comparison: Comparison) -> list[str]:
    """Rows where no difference between the models can be claimed, and why."""
    said = []
    for row in comparison.rows:
        if row.hausdorff is None or row.claimed:
            continue
        head = f"w/h = {row.width_to_thickness:g}: no difference is claimed, "
        if row.ribbon_error is None:
            said.append(f"{head}the ribbon's discretisation error is unknown (it, or its refinement, is not stable).")
        elif row.shell_error is None:
            said.append(f"{head}the shell's discretisation error is unknown (the coarser mesh did not converge).")
        else:
            said.append(
                f"{head}the distance {row.hausdorff:.1e} l is not above the errors; use a finer shell (shell.elements) "
                "or more ribbon segments."
            )
    return said
