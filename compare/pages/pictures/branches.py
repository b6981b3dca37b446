"""The bifurcation diagram as a picture: full where stable, dashed where not, special points with their error bars."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from compare.page.drawing import RIBBON_COLOUR, SHELL_COLOURS, save
from compare.studies.branches.diagram import Branch, Diagram

MARKS = {"fold": "s", "branch_point": "o", "ruling": "D", "event": "|"}
#: Ranges (l) below which a position is no ordinate.
_FLAT = 1e-3


def ordinate(diagram: Diagram) -> tuple[str, str, int]:
    """What stands on the vertical axis, in words, and which component of "end" or "middle" it is: the one that ranges
    most beside the line through its points over the parameter, which tells branches apart."""
    best, range_of = ("middle", 0), 0.0
    for name in ("middle", "end"):
        for component in range(3):
            spread = diagram.spread(name, component)
            if spread > 1.05 * range_of:
                best, range_of = (name, component), spread
    return f"{best[0]} {'xyz'[best[1]]} / l", *best


def _drawn(axes: Axes, branch: Branch, name: str, component: int, colour: str, label: str | None) -> None:
    """Runs of stable and unstable points, joined at the special ones."""
    points = branch.points
    x = np.array([p.parameter for p in points])
    y = np.array([getattr(p, name)[component] for p in points])
    stable = np.array([p.stable for p in points])
    begin = 0
    for k in range(1, len(points) + 1):
        if k < len(points) and (stable[k] == stable[begin] or points[k].kind in ("fold", "branch_point", "ruling")):
            continue
        piece = slice(max(begin - 1, 0) if begin else 0, k)
        style = "-" if stable[begin] else (0, (4, 2))
        axes.plot(x[piece], y[piece], ls=style, color=colour, lw=1.6, label=label)
        label, begin = None, k
    for p, height in zip(points, y, strict=True):
        if p.kind != "regular":
            axes.errorbar(
                [p.parameter], [height], xerr=None if p.error is None else [p.error], fmt=MARKS[p.kind], color=colour,
                mfc="white" if p.settles is False else colour, ms=5, capsize=3,
            )  # fmt: skip


def branches_picture(path: Path, diagram: Diagram) -> Path:
    """All branches of all models."""
    figure = Figure(figsize=(7.0, 4.6), layout="constrained")
    axes = figure.subplots()
    words, name, component = ordinate(diagram)
    seen: dict[str, str] = {}
    for branch in diagram.branches:
        colour = seen.get(branch.model)
        label = branch.model if colour is None else None
        if colour is None:
            colour = (RIBBON_COLOUR, *SHELL_COLOURS)[len(seen) % (1 + len(SHELL_COLOURS))]
            seen[branch.model] = colour
        _drawn(axes, branch, name, component, colour, label)
    unit = f" / {diagram.along.unit}" if diagram.along.unit else ""
    axes.set(xlabel=f"{diagram.along.key}{unit}", ylabel=words)
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
    axes.set_title(
        "full: stable; dashed: not; square: fold, circle: branch point (open: not settled), diamond: rulings",
        fontsize=8,
    )
    figure.suptitle(diagram.scene.title)
    return save(figure, path)
