"""Figures of `models_4_3`: distance against w/h, and error against time. Colours of Okabe and Ito, a mark per model."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from compare.measure.front import Mark

#: Colour, mark and dashes of each model.
STYLES = {
    "sadowsky": ("#999999", "s", ":"),
    "wunderlich": ("#D55E00", "o", "-"),
    "kirchhoff": ("#CC79A7", "v", ":"),
    "sadowsky_kt": ("#56B4E9", "P", ":"),
    "sano": ("#E69F00", "^", "--"),
    "extensible": ("#0072B2", "D", "--"),
    "finite": ("#009E73", "o", "-"),
    "finite + in_plane": ("#004D3A", "x", "--"),
    "shell": ("#000000", "*", "-"),
}


def _style(model: str) -> dict[str, Any]:
    colour, mark, dashes = STYLES[model]
    wide = model in ("finite", "shell", "wunderlich")
    size = 9 if model == "shell" else 6
    return {"color": colour, "marker": mark, "ls": dashes, "lw": 2.2 if wide else 1.2, "ms": size, "label": model}


def _figure(panels: int) -> tuple[Any, Any]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.6 * panels, 4.8), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(1, panels, sharey=True, squeeze=False)[0]
    for axis in axes:
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.grid(True, which="major", color="#dddddd")
        axis.tick_params(labelleft=True)
    return figure, axes


def distances(
    path: Path, rows: Sequence[Sequence[Any]], heads: Sequence[str], scenes: Sequence[str], models: Sequence[str]
) -> None:
    """Hausdorff distance to the shell against w/h, a panel per scene."""
    figure, axes = _figure(len(scenes))
    at = heads.index("hausdorff / l")
    for axis, scene in zip(axes, scenes, strict=True):
        for model in models:
            those = sorted((row[1], row[at]) for row in rows if row[0] == scene and row[2] == model)
            axis.plot(*zip(*those, strict=True), **_style(model))
        ticks = sorted({row[1] for row in rows})
        axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axis.minorticks_off()
        axis.set_xlabel("w / h")
        axis.set_title(scene, fontsize=11)
    axes[0].set_ylabel("distance of surfaces to the shell / l")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    figure.savefig(path, dpi=130)


def work(path: Path, marks: dict[tuple[str, float], dict[str, list[Mark]]]) -> None:
    """Total error against processor time, a panel per scene and w/h."""
    figure, axes = _figure(len(marks))
    for axis, ((scene, ratio), found) in zip(axes, marks.items(), strict=True):
        for model, those in found.items():
            axis.plot([m.seconds for m in those], [m.error for m in those], **_style(model))
            if model in ("finite", "shell"):
                for mark in those:
                    axis.annotate(
                        mark.label, (mark.seconds, mark.error), textcoords="offset points", xytext=(4, 5), fontsize=8,
                        color=STYLES[model][0],
                    )  # fmt: skip
        axis.margins(x=0.1, y=0.08)
        axis.set_xlabel("processor time of a solve, s")
        axis.set_title(f"{scene}, w/h = {ratio:g}", fontsize=11)
    axes[0].set_ylabel("total error / l (to the finest shell)")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=5, frameon=False)
    figure.savefig(path, dpi=130)
