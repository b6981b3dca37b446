"""The picture of an elastica: its curvature along it, and its shape in the plane of the start clamp."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from compare.models.base import State
from compare.page.drawing import save
from compare.scene.scene import Scene


def elastica_picture(path: Path, scene: Scene, state: State) -> Path:
    """Left: theta(s); right: the centreline seen along t_x, upwards (t_z without a load) on the page."""
    s = np.linspace(0.0, 1.0, 801)
    assert state.shape is not None
    frame = scene.frame
    line = state.shape.centreline(s) - scene.position
    up = frame[:, 2] if scene.up is None else scene.up
    up = up - (up @ frame[:, 0]) * frame[:, 0]
    up = up / np.linalg.norm(up)
    side = np.cross(up, frame[:, 0])
    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(s, state.native.angle(s), color="#4a86c8")
    left.set(xlabel="s / l", ylabel="theta, rad", title="angle of the tangent")
    right.plot(line @ side, line @ up, color="#4a86c8", lw=2)
    right.plot(0.0, 0.0, "s", color="#c2662d", label="clamp")
    if scene.tip is not None:
        right.plot(line[-1] @ side, line[-1] @ up, "o", ms=10, color="#e0b050", label="load at the tip")
    elif scene.clamp_end is not None:
        right.plot(line[-1] @ side, line[-1] @ up, "s", color="#c2662d")
    right.set(xlabel="x / l", ylabel="upwards / l", title="shape")
    right.set_aspect("equal", adjustable="datalim")
    right.legend(fontsize="small")
    for axes in (left, right):
        axes.grid(alpha=0.3)
    figure.suptitle(scene.title)
    return save(figure, path)
