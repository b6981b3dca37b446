"""Pictures of the limits of inextensibility: figures 7.8, 7.9 and 7.10 of the thesis, for one scene or a grid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, Normalize
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import NDArray

from compare.measure.energy_map import HARDLY, hardly_stored, shares
from compare.page.drawing import NOTHING, quads, save, screen_axes
from compare.pages.pictures.varied import axes_of, label, text_of, varied
from compare.studies.limits import Finding

FloatArray = NDArray[np.float64]

#: As in the thesis: green, yellow, red for growing weight; more colours where there are more values.
_SHAPES = ("#2f9e44", "#e0a800", "#c92a2a", "#1f5fa8", "#7048a8", "#555555")
_KINDS = (
    ("bending", "#1f5fa8", "o"),
    ("membrane", "#c92a2a", "s"),
    ("shear", "#2f9e44", "^"),
    ("gravity", "0.45", "d"),
)
#: Most strips side by side, most rows, of the pictures.
_MOST = 8
#: Narrowest that a strip is drawn, over the widest; inches for a strip's length.
_LEAST_DRAWN = 0.2
_INCHES = 2.4


def _layout(findings: Sequence[Finding]) -> tuple[str | None, list[dict[str, Any]]]:
    """The key of the horizontal axis and the other keys' combinations (one panel each).

    The horizontal axis is the first numeric key with the most values; w/h only when nothing else is varied.
    """
    keys = varied(findings)
    numeric = [
        key for key in keys if all(isinstance(axes_of(f).get(key), int | float) for f in findings) and key != "w/h"
    ]
    count = {key: len({axes_of(f)[key] for f in findings}) for key in numeric}
    across = max(numeric, key=lambda key: count[key]) if numeric else ("w/h" if "w/h" in keys else None)
    rest = [key for key in keys if key not in (across, "w/h")]
    if across != "w/h" and "w/h" in keys:  # w/h follows from the others, or is an axis of its own
        lines = {tuple(text_of(axes_of(f).get(str(k))) for k in (across, *rest)) for f in findings}
        if len(lines) < len(findings):
            rest.append("w/h")
    panels: list[dict[str, Any]] = []
    for finding in findings:
        here = {key: axes_of(finding)[key] for key in rest}
        if here not in panels:
            panels.append(here)
    return across, panels


def _in_panel(findings: Sequence[Finding], panel: Mapping[str, Any]) -> list[Finding]:
    return [f for f in findings if all(axes_of(f)[key] == value for key, value in panel.items())]


def shares_picture(path: Path, findings: Sequence[Finding], title: str) -> Path:
    """Energies by kind (figure 7.9): left of elastic + |gravity|, right of the elastic energy, one row per panel."""
    known = [f for f in findings if f.share_of_total is not None]
    if len(known) == 1:
        return _bars(path, known[0], title)
    across, panels = _layout(known)
    figure = Figure(figsize=(10.0, 2.6 * len(panels) + 0.8), layout="constrained")
    grid = figure.subplots(len(panels), 2, squeeze=False, sharex=True)
    for row, panel in enumerate(panels):
        here = sorted(_in_panel(known, panel), key=lambda f: axes_of(f)[across] if across else 0.0)
        x = [axes_of(f)[across] if across else 0.0 for f in here]
        for column, whole in enumerate(("elastic + |gravity|", "elastic")):
            axes = grid[row, column]
            for kind, colour, mark in _KINDS:
                of = [f.share_of_total if column == 0 else (f.row.share if f.row else None) for f in here]
                y = [100.0 * part[kind] for part in of if part is not None and kind in part]
                if len(y) == len(x):
                    axes.plot(x, y, marker=mark, color=colour, ms=4, lw=1.2, label=kind)
            stretch = [100.0 * f.estimate.share for f in here]
            if column == 1:
                axes.plot(x, stretch, ":", color="#c92a2a", lw=1.2, label="membrane + shear, by estimate")
                axes.axhline(1.0, color="0.6", lw=0.8, ls="--")
            axes.set_ylim(0.0, 102.0)
            axes.grid(True, which="major", lw=0.3, alpha=0.7)
            axes.set_ylabel(f"% of {whole}", fontsize=8)
            if panel:
                axes.set_title(label(panel), fontsize=9)
            if row == len(panels) - 1 and across:
                axes.set_xlabel(across)
    grid[0, 0].legend(fontsize=7, loc="best")
    grid[0, 1].legend(fontsize=7, loc="best")
    figure.suptitle(f"{title}: energies by kind")
    return save(figure, path)


def _bars(path: Path, finding: Finding, title: str) -> Path:
    """The energies of a single case as bars."""
    assert finding.share_of_total is not None
    assert finding.row is not None
    assert finding.row.share is not None
    figure = Figure(figsize=(9.0, 2.6), layout="constrained")
    parts = (("elastic + |gravity|", finding.share_of_total), ("elastic", finding.row.share))
    for place, (whole, part) in enumerate(parts):
        axes = figure.add_subplot(1, 2, place + 1)
        shown = [(kind, colour, 100.0 * part[kind]) for kind, colour, _ in _KINDS if part.get(kind)]
        bars = axes.barh([k[0] for k in shown], [k[2] for k in shown], color=[k[1] for k in shown])
        axes.bar_label(bars, labels=[f"{k[2]:.3g} %" for k in shown], padding=3, fontsize=8)
        axes.set_xlim(0.0, 120.0)
        axes.invert_yaxis()
        axes.set_xlabel(f"% of {whole}", fontsize=8)
        if place == 1:
            axes.axvline(1.0, color="0.6", lw=0.8, ls="--")
    figure.suptitle(f"{title}: energies by kind", fontsize=10)
    return save(figure, path)


def maps_picture(path: Path, findings: Sequence[Finding], title: str) -> Path:
    """Local shares over the flattened strip (figure 7.10): bending, membrane, shear, clamp at the top; width to scale
    (strips narrower than a fifth of the widest are drawn wider)."""
    known = [f for f in findings if f.maps is not None]
    across, panels = _layout(known)
    panels = panels[:_MOST]
    columns = max(len(_in_panel(known, panel)) for panel in panels)
    columns = min(columns, _MOST)
    widest = max(f.scene.width for f in known)
    drawn = [[max(f.scene.width, _LEAST_DRAWN * widest) for f in _in_panel(known, panel)[:_MOST]] for panel in panels]
    ratios = [max((row[c] for row in drawn if c < len(row)), default=widest) for c in range(columns)]
    size = (max(_INCHES * 3.75 * sum(ratios) + 1.4, 4.0), _INCHES * len(panels) + 0.9)
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(len(panels), columns, squeeze=False, width_ratios=ratios)
    for row, panel in enumerate(panels):
        here = _in_panel(known, panel)[:_MOST]
        for column in range(columns):
            axes = grid[row, column]
            axes.set_axis_off()
            if column >= len(here):
                continue
            finding = here[column]
            _three_strips(axes, finding, drawn[row][column])
            text = f"{across.split('.', 1)[-1]} = {text_of(axes_of(finding)[across])}" if across else ""
            axes.set_title(text, fontsize=8)
        if panel:
            grid[row, 0].text(
                -0.12, 0.5, label(panel), rotation=90, va="center", ha="right", fontsize=8,
                transform=grid[row, 0].transAxes,
            )  # fmt: skip
    colours = ScalarMappable(Normalize(0.0, 1.0), _map())
    words = f"share of the local elastic energy\n(grey: below {100 * HARDLY:g} % of the mean energy per area)"
    figure.colorbar(colours, ax=list(grid.ravel()), label=words, shrink=0.8, aspect=30)
    figure.suptitle(f"{title}: bending | membrane | shear on the flat strip, clamp at the top", fontsize=10)
    return save(figure, path)


def _map() -> Colormap:
    """Blue for none, as in the thesis; grey where hardly any energy is stored."""
    return colormaps["coolwarm"].with_extremes(bad=NOTHING)


def _three_strips(axes: Any, finding: Finding, drawn: float) -> None:
    """Three flat strips side by side in `axes`, S downwards, each `drawn` wide."""
    maps = finding.maps
    assert maps is not None
    local = shares(maps.density)
    local[hardly_stored(maps.density)] = np.nan
    stretch = drawn / finding.scene.width
    gap = 0.25 * drawn
    for place in range(3):
        shift = place * (drawn + gap) + 0.5 * drawn
        image = axes.pcolormesh(maps.v * stretch + shift, -maps.s, local[..., place], cmap=_map(), vmin=0.0, vmax=1.0)
        image.set_rasterized(True)
    axes.set_xlim(-gap, 3.0 * drawn + 3.0 * gap)
    axes.set_ylim(-1.02, 0.02)
    axes.set_aspect("equal")


def shapes_picture(path: Path, findings: Sequence[Finding], title: str) -> Path:
    """Shells at rest from two sides (figure 7.8), one column per value of the horizontal axis, colours for the rest;
    the ribbon's outline in black."""
    known = [f for f in findings if f.maps is not None]
    across, panels = _layout(known)
    columns: list[Any] = []
    for finding in known:
        value = axes_of(finding)[across] if across else None
        if value not in columns:
            columns.append(value)
    columns = columns[:_MOST]
    figure = Figure(figsize=(max(2.9 * len(columns), 6.0), 6.4), layout="constrained")
    up = known[0].scene.up
    vertical = np.array([0.0, 0.0, 1.0]) if up is None else up
    for place, value in enumerate(columns):
        here = [f for f in known if not across or axes_of(f)[across] == value]
        clouds = [f.maps.points for f in here if f.maps is not None]
        first, second = (pair[0] for pair in screen_axes(clouds, up))
        turn = np.array([first, second, vertical])
        for line, azimuth in enumerate((-62.0, 28.0)):
            axes: Any = figure.add_subplot(2, len(columns), line * len(columns) + place + 1, projection="3d")
            for finding in here:
                panel = next(i for i, p in enumerate(panels) if finding in _in_panel(known, p))
                _shape(axes, finding, turn, _SHAPES[panel % len(_SHAPES)])
            _frame(axes, np.concatenate([c.reshape(-1, 3) for c in clouds]) @ turn.T, azimuth)
            if across and line == 0:
                axes.set_title(f"{across.split('.', 1)[-1]} = {text_of(value)}", fontsize=9)
    if panels[0]:
        from matplotlib.patches import Patch

        marks = [Patch(color=_SHAPES[i % len(_SHAPES)], label=label(panel)) for i, panel in enumerate(panels)]
        figure.legend(handles=marks, loc="lower center", ncols=min(len(marks), 3), fontsize=8)
    figure.suptitle(f"{title}: shells at rest, two views (ribbon's outline in black)")
    return save(figure, path, dpi=120)


def _shape(axes: Any, finding: Finding, turn: FloatArray, colour: str) -> None:
    assert finding.maps is not None
    points = finding.maps.points @ turn.T
    step = max(1, (points.shape[0] - 1) // 60)
    cells = quads(points[::step, :: max(1, (points.shape[1] - 1) // 8)])
    axes.add_collection3d(Poly3DCollection(cells, facecolors=colour, edgecolors=colour, linewidths=0.1, alpha=0.75))
    outline = finding.ribbon.native.surface(80, 2).grid @ turn.T
    for edge in (outline[:, 0], outline[:, -1], outline[-1]):
        axes.plot(*edge.T, color="black", lw=0.6)


def _frame(axes: Any, cloud: FloatArray, azimuth: float) -> None:
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    size = np.maximum(high - low, 0.2 * float((high - low).max()))
    middle = 0.5 * (low + high)
    for setter, a in ((axes.set_xlim, 0), (axes.set_ylim, 1), (axes.set_zlim, 2)):
        setter(middle[a] - 0.5 * size[a], middle[a] + 0.5 * size[a])
    axes.set_box_aspect(size, zoom=1.1)
    axes.view_init(elev=18.0, azim=azimuth)
    axes.set_axis_off()


def estimate_picture(path: Path, findings: Sequence[Finding], title: str) -> Path:
    """Estimates against the shells, log-log: distance and share, with a factor of 2 either way."""
    known = [f for f in findings if f.row is not None and f.share is not None and f.distance is not None]
    figure = Figure(figsize=(9.6, 4.6), layout="constrained")
    both: tuple[tuple[str, list[tuple[Any, Any, Finding]]], ...] = (
        ("distance / l", [(f.distance, f.estimate.distance, f) for f in known]),
        ("membrane + shear, share of the elastic energy", [(f.share, f.estimate.share, f) for f in known]),
    )
    for place, (name, pairs) in enumerate(both):
        axes = figure.add_subplot(1, 2, place + 1)
        for clamp, colour, mark in (("edge", "#1f5fa8", "o"), ("corners", "#c2662d", "s")):
            here = [(x, y) for x, y, f in pairs if f.scene.shell.clamp == clamp and y]
            if here:
                axes.loglog(*zip(*here, strict=True), mark, color=colour, ms=5, alpha=0.8, label=f"{clamp} held")
        low, high = axes.get_xlim()
        ends = np.array([low, high])
        axes.loglog(ends, ends, "-", color="0.3", lw=1)
        for factor in (0.5, 2.0):
            axes.loglog(ends, factor * ends, ":", color="0.5", lw=0.8)
        axes.set_xlabel(f"shell: {name}")
        axes.set_ylabel("estimate from the ribbon alone")
        axes.grid(True, which="both", lw=0.3, alpha=0.6)
        axes.legend(fontsize=8)
    figure.suptitle(title)
    return save(figure, path)
