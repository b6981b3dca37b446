"""A sweep as a picture: a curve over one axis, a map over two, points against another quantity; failures marked."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

from compare.page.drawing import save
from compare.studies.axes import Axis
from compare.sweep.file import Sweep
from compare.sweep.finished import Finished

FloatArray = NDArray[np.float64]
Rows = list[dict[str, Any]]

BLUE, RED = "#1f5fa8", "#c0392b"
#: Ratio of largest to smallest from which an axis is logarithmic.
DECADES = 30.0
_MANY = 200  # points above which they are drawn small


def draw(path: Path, finished: Finished, rows: Rows, show: str, against: str) -> str:
    """Writes the picture; returns its text alternative."""
    bad = sum(not case.ok for case in finished.cases)
    return draw_rows(path, finished.sweep, rows, show, against, (bad, len(finished.cases)))


def draw_rows(path: Path, sweep: Sweep, rows: Rows, show: str, against: str, bad: tuple[int, int]) -> str:
    """The picture of rows, one or more for each point of the sweep's axes; bad: how many cases failed, of how many."""
    figure = Figure(figsize=(7.0, 5.0), layout="constrained")
    axes = figure.add_subplot()
    if against:
        words = _points(axes, sweep, rows, show, against)
    elif len(sweep.axes) == 1:
        words = _curve(axes, sweep.axes[0], rows, show)
    elif len(sweep.axes) == 2 and "width_to_thickness" not in rows[0]:
        words = _map(figure, axes, sweep.axes, rows, show)
    else:
        words = _curve(axes, sweep.axes[-1], rows, show, list(sweep.axes[:-1]))
    axes.set_title(sweep.title, fontsize=10)
    save(figure, path)
    return f"{sweep.title}: {words}. {_count(bad[0])} of {bad[1]} cases did not converge" + (
        ", marked by red crosses." if bad[0] else "."
    )


def _count(number: int) -> str:
    return "None" if number == 0 else str(number)


def _fine(row: dict[str, Any]) -> bool:
    return row["status"] == "converged" and row.get("stable") is not False


def _number(row: dict[str, Any], name: str) -> float:
    value = row.get(name)
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else math.nan


def _logarithmic(values: FloatArray) -> bool:
    finite = values[np.isfinite(values)]
    return finite.size > 1 and bool(finite.min() > 0.0) and bool(finite.max() / finite.min() > DECADES)


def _by_ratio(places: FloatArray) -> bool:
    """Whether values of an axis stand in equal ratios rather than at equal differences, or span decades."""
    if places.size < 3 or places.min() <= 0.0:
        return _logarithmic(places)
    ordered = np.sort(places)
    steps, ratios = np.diff(ordered), np.diff(np.log(ordered))
    return _logarithmic(places) or bool(np.ptp(ratios) / ratios.max() < np.ptp(steps) / steps.max() - 1e-9)


def _scales(axes: Any, x: FloatArray, y: FloatArray) -> None:
    if _logarithmic(x):
        axes.set_xscale("log")
    if _logarithmic(y):
        axes.set_yscale("log")
    axes.grid(True, lw=0.3, alpha=0.6)


def _range(values: FloatArray) -> str:
    finite = values[np.isfinite(values)]
    return f"{finite.min():.4g} to {finite.max():.4g}" if finite.size else "nothing known"


def _failures(axes: Any, x: FloatArray) -> None:
    """Failed cases: red crosses at the foot of the picture."""
    if x.size:
        axes.plot(x, np.zeros(x.size), "x", color=RED, ms=6, clip_on=False, label="not converged",
                  transform=axes.get_xaxis_transform())  # fmt: skip


def _points(axes: Any, sweep: Sweep, rows: Rows, show: str, against: str) -> str:
    good = [row for row in rows if _fine(row)]
    x, y = (np.array([_number(row, name) for row in good]) for name in (against, show))
    size = 3 if x.size > _MANY else 18
    axes.scatter(x, y, s=size, color=BLUE, label=f"{len(good)} cases of the {sweep.solver}", zorder=3)
    _scales(axes, x, y)
    known = x[np.isfinite(x) & (x > 0.0)]
    lines = []
    if known.size:
        t = np.geomspace(known.min(), known.max(), 200)
        low, high = axes.get_ylim()
        for curve, style in zip(sweep.curves, ("--", ":", "-.", "-") * 9, strict=False):
            axes.plot(t, curve.factor * t**curve.power, style, color="0.25", lw=1.2, label=curve.label)
            lines.append(curve.label)
        axes.set_ylim(low, high)
    _failures(axes, np.array([_number(row, against) for row in rows if not _fine(row)]))
    axes.set_xlabel(against)
    axes.set_ylabel(show)
    axes.legend(fontsize=8)
    beside = f", with the lines {' and '.join(lines)}" if lines else ""
    return f"{show} ({_range(y)}) against {against} ({_range(x)}), one point per case{beside}"


def _positions(axis: Axis) -> tuple[FloatArray, list[str] | None]:
    """Places of an axis's values: themselves where they are numbers, else 0, 1, 2 ... with labels."""
    first = [value[0] for value in axis.values]
    if all(isinstance(v, int | float) and not isinstance(v, bool) for v in first):
        return np.array(first, dtype=float), None
    return np.arange(len(first), dtype=float), [str(v) for v in first]


def _label(axes: Any, axis: Axis, labels: list[str] | None) -> None:
    axes.set_xlabel(", ".join(axis.keys))
    if labels is not None:
        axes.set_xticks(range(len(labels)), labels, fontsize=7)


def _curve(axes: Any, axis: Axis, rows: Rows, show: str, others: list[Axis] | None = None) -> str:
    """One line for each combination of the other axes and w/h."""
    places, labels = _positions(axis)
    place = {str(value): at for value, at in zip(axis.values, places, strict=True)}
    groups: dict[tuple[str, ...], Rows] = {}
    other_keys = [key for other in others or () for key in other.keys]
    for row in rows:
        name = tuple(f"{k} = {_brief(row[k])}" for k in other_keys if row.get(k) is not None)
        if row.get("width_to_thickness") is not None:
            name += (f"w/h = {row['width_to_thickness']:g}",)
        groups.setdefault(name, []).append(row)
    every: list[FloatArray] = []
    for k, (name, members) in enumerate(groups.items()):
        x = np.array([place[str(tuple(row[key] for key in axis.keys))] for row in members])
        y = np.array([_number(row, show) if _fine(row) else math.nan for row in members])
        shade = 0.15 + 0.75 * k / max(len(groups) - 1, 1)
        colour = BLUE if len(groups) == 1 else (0.12, 0.37, 0.66, shade)
        order = np.argsort(x)
        axes.plot(x[order], y[order], "o-", ms=4, color=colour, label=", ".join(name) if len(groups) < 13 else None)
        every.append(y)
    _failures(axes, np.array([place[str(tuple(r[key] for key in axis.keys))] for r in rows if not _fine(r)]))
    values = np.concatenate(every)
    _scales(axes, places if labels is None else np.zeros(1), values)
    _label(axes, axis, labels)
    axes.set_ylabel(show)
    if axes.get_legend_handles_labels()[1]:
        axes.legend(fontsize=8)
    lines = "" if len(groups) == 1 else f", {len(groups)} lines"
    return f"{show} ({_range(values)}) over {', '.join(axis.keys)}{lines}"


def _brief(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _edges(places: FloatArray) -> FloatArray:
    """Edges (k + 1,) of cells around k places, halfway between them (in ratio where they grow by decades)."""
    if places.size == 1:
        return places[0] + np.array([-0.5, 0.5])
    log = _by_ratio(places)
    p = np.log(places) if log else places
    middle = 0.5 * (p[1:] + p[:-1])
    edges = np.concatenate([[2 * p[0] - middle[0]], middle, [2 * p[-1] - middle[-1]]])
    return np.exp(edges) if log else edges


def _map(figure: Figure, axes: Any, both: tuple[Axis, ...], rows: Rows, show: str) -> str:
    (down, down_labels), (across, across_labels) = (_positions(axis) for axis in both)
    grid = np.full((down.size, across.size), np.nan)
    bad: list[tuple[float, float]] = []
    places = [{str(value): k for k, value in enumerate(axis.values)} for axis in both]
    for row in rows:  # of a sweep that runs, some
        i, j = (at[str(tuple(row[key] for key in axis.keys))] for at, axis in zip(places, both, strict=True))
        if _fine(row):
            grid[i, j] = _number(row, show)
        else:
            bad.append((across[j], down[i]))
    rising = np.argsort(across), np.argsort(down)
    norm = LogNorm() if _logarithmic(grid.ravel()) else None
    values = grid[np.ix_(rising[1], rising[0])]
    mesh = axes.pcolormesh(_edges(across[rising[0]]), _edges(down[rising[1]]), values, cmap="viridis", norm=norm)
    figure.colorbar(mesh, label=show)
    if bad:
        axes.plot(*zip(*bad, strict=True), "x", color=RED, ms=6, label="not converged")
        axes.legend(fontsize=8)
    if across_labels is None and _by_ratio(across):
        axes.set_xscale("log")
    if down_labels is None and _by_ratio(down):
        axes.set_yscale("log")
    _label(axes, both[1], across_labels)
    axes.set_ylabel(", ".join(both[0].keys))
    if down_labels is not None:
        axes.set_yticks(range(len(down_labels)), down_labels, fontsize=7)
    return f"map of {show} ({_range(grid)}) over {', '.join(both[1].keys)} and {', '.join(both[0].keys)}"
