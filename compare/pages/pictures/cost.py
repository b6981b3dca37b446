"""Error against time: of every size of one model's ladders, and of every model that reads a scene."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from compare.measure.front import Mark, front
from compare.measure.grades import YARDSTICK
from compare.models import RICHEST
from compare.models.quantities.ladders import NAMES, SHADES, STYLES, UNSTYLED
from compare.page.drawing import save
from compare.studies.cost_plan import Cost
from compare.studies.priced.models import ModelCosts

_COLOURS = ("#1f5fa8", "#2f9e44", "#c92a2a", "#7048a8", "#e69f00", "#56b4e9", "#8c6d31", "#cc79a7", "#6b6b6b")
_MARKERS = "osD^v<>Pph"


def picture(path: Path, cost: Cost) -> Path:
    """Error against warm time, log-log: left of the discretisation, right in all, with the Pareto front of all models:
    an error against a model's own reference says nothing beside another model's."""
    figure = Figure(figsize=(12.5 if cost.common is not None else 6.8, 5.6), layout="constrained")
    kinds = (False, True) if cost.common is not None else (False,)
    for place, common in enumerate(kinds, start=1):
        axes = figure.add_subplot(1, len(kinds), place)
        _panel(axes, cost, common)
    named: dict[str, Any] = {}
    for axes in figure.axes:
        handles, labels = axes.get_legend_handles_labels()
        named |= dict(zip(labels, handles, strict=True))
    figure.legend(named.values(), named.keys(), fontsize=8, loc="outside lower center", ncols=5)
    figure.suptitle(f"{cost.scene.title}: what accuracy costs", fontsize=11)
    return save(figure, path)


def _panel(axes: Axes, cost: Cost, common: bool) -> None:
    marks = cost.marks(common=common)
    for solver in dict.fromkeys(row.run.solver for row in cost.rows):
        chosen = {row.label for row in cost.rows if row.run.solver == solver}
        mine = sorted((m for m in marks if m.label in chosen), key=lambda m: m.seconds)
        colour, marker = STYLES.get(solver, UNSTYLED)
        order = [m for row in cost.rows for m in mine if m.label == row.label]  # by size, not by time
        if not order:
            continue
        axes.plot(
            [m.seconds for m in order], [m.error for m in order], color=colour, marker=marker, ms=4.5, lw=1.1,
            label=NAMES.get(solver, solver), zorder=3,
        )  # fmt: skip
        flat = common and cost.common is not None and not solver.startswith(cost.common.model)
        few = [order[0], order[-1]] if flat else [order[0], *order[2:-1:2], order[-1]]
        for mark in order if len(order) < 3 else few:
            size = next(row.run.label for row in cost.rows if row.label == mark.label).split(" (")[0]
            axes.annotate(
                size,
                (mark.seconds, mark.error),
                (4, -9 if solver in ("mixed", "elastica 2") else 4),
                textcoords="offset points",
                fontsize=6.5,
                color=colour,
            )
    line = front(marks) if common or len({row.model for row in cost.rows}) == 1 else []  # across models: of the total
    if line:
        axes.plot(
            [m.seconds for m in line], [m.error for m in line], color="gold", lw=6.0, alpha=0.45, zorder=1,
            drawstyle="steps-post", label="Pareto front",
        )  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.axhline(YARDSTICK, color="0.35", lw=1, ls=":", label="1 permille of l")
    shown = [r for r in ((cost.common,) if common else cost.references) if r is not None and r.error]
    errors = [mark.error for mark in marks]
    if errors:
        least = min(errors)
        bottom = max(min([least, *(r.error for r in shown if r.error)]), 0.05 * least) / 2.0
        axes.set_ylim(bottom, 2.0 * max([*errors, YARDSTICK]))
        for reference in shown:
            if reference.error is not None and reference.error > bottom:
                colour = SHADES.get(reference.model, UNSTYLED[0])
                label = f"below the {reference.model} reference's own error"
                axes.axhspan(bottom, reference.error, color=colour, alpha=0.12, lw=0, label=label)
    axes.set_xlabel("time of a warm solve (s)")
    axes.set_ylabel("Hausdorff distance / l")
    own = "discretisation: to the own model's reference"
    title = own if not common or cost.common is None else f"total error: to the {cost.common.model}, {cost.common.what}"
    axes.set_title(title, fontsize=9)
    axes.grid(True, which="both", lw=0.3, alpha=0.6)


def models_picture(path: Path, costs: ModelCosts) -> Path:
    """Log-log, a line a model through its sizes; the shell in black, below its own error nothing is known."""
    figure = Figure(figsize=(8.6, 5.6), layout="constrained")
    axes = figure.add_subplot()
    shown = [row for row in costs.rows if row.ok and row.error is not None]
    names = [name for name in dict.fromkeys(row.name for row in shown) if name != RICHEST]
    for place, name in enumerate([*names, RICHEST]):
        rows = [row for row in shown if row.name == name]
        colour = "black" if name == RICHEST else _COLOURS[place % len(_COLOURS)]
        axes.plot(
            [row.seconds for row in rows], [row.error or 0.0 for row in rows], color=colour,
            marker="s" if name == RICHEST else _MARKERS[place % len(_MARKERS)], ms=5, lw=1.2, label=name, zorder=3,
        )  # fmt: skip
        for row in (rows[0], rows[-1]) if len(rows) > 1 else rows:
            axes.annotate(
                row.size, (row.seconds, row.error or 0.0), (4, 4), textcoords="offset points", fontsize=6.5,
                color=colour,
            )  # fmt: skip
    line = front([Mark(row.name, row.seconds, row.error or 0.0) for row in shown])
    axes.plot(
        [mark.seconds for mark in line], [mark.error for mark in line], color="gold", lw=6.0, alpha=0.45, zorder=1,
        drawstyle="steps-post", label="nothing better is faster",
    )  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("log")
    bottom = 0.5 * costs.error
    axes.set_ylim(bottom, 2.0 * max([row.error or 0.0 for row in shown], default=1.0))
    axes.axhspan(bottom, costs.error, color="0.5", alpha=0.25, lw=0, label="below the finest shell's own error")
    for target in costs.targets:
        if target > bottom:
            axes.axhline(target, color="0.35", lw=0.8, ls=":")
    axes.set_xlabel("time of a warm solve (s)")
    axes.set_ylabel("total error / l")
    axes.set_title(f"{costs.scene.title}: total error to the finest shell ({costs.finest})", fontsize=9)
    axes.grid(True, which="both", lw=0.3, alpha=0.6)
    figure.legend(fontsize=8, loc="outside lower center", ncols=6)
    return save(figure, path)
