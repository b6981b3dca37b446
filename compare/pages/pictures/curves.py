"""Folds and branch points in the plane of two numbers, with their error bars."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from compare.page.drawing import RIBBON_COLOUR, SHELL_COLOURS, save
from compare.pages.pictures.branches import MARKS
from compare.studies.branches.over import Curves

_LINES = {"fold": "-", "branch_point": (0, (5, 2)), "ruling": (0, (1, 1.5))}
_WORDS = {"fold": "fold", "branch_point": "branch point", "ruling": "fall by rulings"}


def curves_picture(path: Path, found: Curves) -> Path:
    """All curves of all models."""
    figure = Figure(figsize=(7.0, 4.6), layout="constrained")
    axes = figure.subplots()
    colours: dict[str, str] = {}
    labels: set[str] = set()
    for curve in found.curves:
        palette = (RIBBON_COLOUR, *SHELL_COLOURS)
        colour = colours.setdefault(curve.model, palette[len(colours) % len(palette)])
        label = f"{curve.model}, {_WORDS[curve.kind]}"
        axes.errorbar(
            [m.other for m in curve.marks], [m.value for m in curve.marks], yerr=[m.error or 0.0 for m in curve.marks],
            ls=_LINES[curve.kind], marker=MARKS[curve.kind], color=colour, ms=4, lw=1.4, capsize=2,
            label=None if label in labels else label,
        )  # fmt: skip
        labels.add(label)
        for m in curve.marks:
            if m.settles is False:
                axes.plot([m.other], [m.value], marker=MARKS[curve.kind], color=colour, mfc="white", ms=5)
    for met in found.meetings:
        place = met.at if met.at is not None else 0.5 * sum(met.between)
        axes.plot([place], [met.value], marker="*", ms=12, color=colours[met.model])
    for axis, key, unit in (("x", found.over, found.unit), ("y", found.along.key, found.along.unit)):
        axes.set(**{f"{axis}label": f"{key} / {unit}" if unit else key})
    axes.grid(alpha=0.3)
    if labels:
        axes.legend(fontsize="small")
    axes.set_title("open: not settled on finer elements; star: two folds meet", fontsize=8)
    figure.suptitle(found.scene.title)
    return save(figure, path)
