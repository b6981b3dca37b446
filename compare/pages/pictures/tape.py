"""The picture of a tape spring: its way, its sections, its shape from the side."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from compare.models.base import State
from compare.page.drawing import save
from compare.scene.scene import Scene

BLUE, RED = "#4a86c8", "#c2662d"

SECTIONS = 7
"""Sections that are drawn, from the clamp to the fold."""


def tape_picture(path: Path, scene: Scene, state: State) -> Path:
    """Left: moment against the turn of the end, or force against its way; middle: sections; right: from the side."""
    figure = Figure(figsize=(12.0, 3.8), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    _way(left, scene, state)
    _sections(middle, scene, state)
    shape = state.shape
    assert shape is not None
    s = np.linspace(0.0, 1.0, 801)
    _, normal, along = scene.frame.T
    for v, width, colour in ((0.5 * scene.width, 1.0, "0.65"), (0.0, 2.0, BLUE)):
        line = shape.points(s, np.array([v]))[:, 0] - scene.position
        right.plot(line @ along, line @ normal, color=colour, lw=width, label="edge" if v else "middle")
    right.set(xlabel="along t_z / l", ylabel="along t_y / l", title="from the side")
    right.set_aspect("equal", adjustable="datalim")
    right.legend(fontsize="small")
    for axes in (left, middle, right):
        axes.grid(alpha=0.3)
    figure.suptitle(scene.title)
    return save(figure, path)


def _way(axes: object, scene: Scene, state: State) -> None:
    """Moment (turned ends) or force (moved end) along the way; unstable points hollow, jumps marked."""
    units = scene.units
    rows = state.log
    turned = scene.end_frame is not None
    x = np.array([row["turn_end" if turned else "end_y"] for row in rows])
    y = np.array([row["moment_end" if turned else "force_y"] for row in rows])
    labels = ("turn of the end, rad", "moment, D w / l") if turned else ("way of the end / l", "force, D w / l^2")
    if units.known:
        scale = units.energy if turned else units.force
        y = y * scale
        labels = (labels[0], "moment, N m" if turned else "force, N")
    stable = np.array([bool(row["stable"]) for row in rows])
    axes.plot(x, y, "-", color=BLUE, lw=1.0)  # type: ignore[attr-defined]
    axes.plot(x[stable], y[stable], "o", color=BLUE, ms=3, label="stable")  # type: ignore[attr-defined]
    if not stable.all():
        axes.plot(x[~stable], y[~stable], "o", mfc="white", mec=RED, ms=4, label="unstable")  # type: ignore[attr-defined]
    axes.legend(fontsize="small")  # type: ignore[attr-defined]
    axes.set(xlabel=labels[0], ylabel=labels[1], title="the way")  # type: ignore[attr-defined]


def _sections(axes: object, scene: Scene, state: State) -> None:
    """Sections between the nearer end and the fold, in the frame of each; equal scales."""
    shape = state.shape
    assert shape is not None
    v = np.linspace(-0.5 * scene.width, 0.5 * scene.width, 61)
    fold = float(state.numbers.get("fold", 0.5))
    near = 0.0 if fold <= 0.5 else 1.0
    s = near + (fold - near) * np.linspace(0.0, 1.0, SECTIONS) ** 0.3
    frames, points, line = shape.frames(s), shape.points(s, v), shape.centreline(s)
    for k, at in enumerate(s):
        local = points[k] - line[k]
        shade = k / (SECTIONS - 1.0)
        colour = (0.29 + 0.47 * shade, 0.53 - 0.13 * shade, 0.78 - 0.60 * shade)
        axes.plot(local @ frames[k, :, 0], local @ frames[k, :, 1], color=colour, lw=1.2, label=f"s = {at:.3f}")  # type: ignore[attr-defined]
    axes.set_aspect("equal", adjustable="datalim")  # type: ignore[attr-defined]
    axes.legend(fontsize="x-small")  # type: ignore[attr-defined]
    axes.set(xlabel="along t_x / l", ylabel="along t_y / l", title="sections")  # type: ignore[attr-defined]
