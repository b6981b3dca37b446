"""Bars of how far each effect of a scene moves its strip."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from compare.page.drawing import RIBBON_COLOUR, SHELL_COLOURS, save
from compare.studies.priced.effects import PricedEffects

#: Part of the length below which no bar is drawn, and most bars.
_LEAST, _MOST = 1e-9, 24


def effects_picture(path: Path, title: str, prices: PricedEffects) -> Path:
    """One bar an effect, in % of the length on a logarithmic axis, those that are on in the ribbon's colour; a line to
    as far as first order may be off, a mark where whole solves tell the move."""
    rows = [row for row in prices.rows if (row.moves or 0.0) > _LEAST][:_MOST]
    figure = Figure(figsize=(8.0, 1.2 + 0.28 * max(len(rows), 1)), layout="constrained")
    axes = figure.add_subplot()
    colours = {True: RIBBON_COLOUR, False: SHELL_COLOURS[0]}
    for place, row in enumerate(rows):
        own = row.moves or 0.0
        axes.barh(place, 100.0 * own, color=colours[row.priced.on], height=0.7)
        if row.solved is None:
            axes.plot([100.0 * own, 100.0 * (own + (row.priced.moves_error or 0.0))], [place] * 2, color="0.3", lw=1.0)
        else:
            axes.plot(100.0 * row.solved, place, "k|", ms=9)
    axes.set_yticks(range(len(rows)), [row.priced.effect for row in rows], fontsize=8)
    axes.invert_yaxis()
    if rows:
        axes.set_xscale("log")
    axes.set_xlabel("moves the strip by, % of its length", fontsize=8)
    for on, words in ((True, "on"), (False, "off")):
        axes.barh([float("nan")], [1.0], color=colours[on], label=words)
    axes.plot([], [], "k|", ms=9, label="by whole solves")
    axes.legend(fontsize=8, loc="lower right")
    axes.set_title(title, fontsize=10)
    return save(figure, path)
