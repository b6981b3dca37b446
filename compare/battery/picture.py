"""The battery as a picture: how much of its bound every case uses."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from compare.battery.run import FAILED, KNOWN, MENDED, PASSED, SKIPPED, Outcome
from compare.page.drawing import save

_COLOURS = {PASSED: "#1f5fa8", MENDED: "#1f5fa8", KNOWN: "#e08e0b", FAILED: "#c0392b", SKIPPED: "#888888"}
#: Shares of a bound that are drawn; what is beyond stands at the edge.
_LOW, _HIGH = 1e-9, 1e3
_ROW = 0.2


def draw(path: Path, outcomes: Sequence[Outcome]) -> str:
    """Writes the picture; returns its text alternative."""
    figure = Figure(figsize=(9.0, 1.2 + _ROW * len(outcomes)), layout="constrained")
    axes = figure.add_subplot()
    rows = range(len(outcomes))
    for row, outcome in zip(rows, outcomes, strict=True):
        for tried in outcome.tried:
            worst = tried.worst
            if worst is None:
                continue
            share = worst.strain if math.isfinite(worst.strain) else _HIGH
            x = min(max(share, _LOW), _HIGH)
            axes.plot(x, row, "o", ms=4.5, color=_COLOURS[tried.ended], alpha=0.7, mew=0)
        if row % 2:
            axes.axhspan(row - 0.5, row + 0.5, color="#f3f3f3", zorder=-1)
    axes.axvline(1.0, color="#444444", lw=1.0)
    axes.set_xscale("log")
    axes.set_xlim(0.5 * _LOW, 2.0 * _HIGH)
    axes.set_ylim(max(len(outcomes), 1) - 0.5, -0.5)
    axes.set_yticks(list(rows), [outcome.case.name for outcome in outcomes], fontsize=7)
    axes.set_xlabel("worst number of each rung, over its bound (1: at the bound)")
    used = dict.fromkeys(t.ended for o in outcomes for t in o.tried if t.worst is not None)
    for ended in used:
        axes.plot([], [], "o", color=_COLOURS[ended], label=ended)
    if used:
        axes.legend(fontsize=7, loc="upper left", bbox_to_anchor=(0.0, 1.0))
    save(figure, path)
    beyond = sum(o.ended in (FAILED, KNOWN) for o in outcomes)
    return f"How much of its bound every one of {len(outcomes)} cases uses: {beyond} go beyond it on some rung."
