"""The picture of a rod in space: its shape, its curvatures and the moments of its section."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from compare.models.base import State
from compare.page.drawing import save
from compare.scene.scene import Scene

FloatArray = NDArray[np.float64]

COLOURS = ("#4a86c8", "#c2662d", "#4f9d5d")


def rod_picture(path: Path, scene: Scene, state: State, along: FloatArray) -> Path:
    """Left: the strip in space, up on the page where there is weight; middle: kappa_1, kappa_2, kappa_3, dashed at
    rest; right: moments. along (k, 13): s, six strains, forces and moments of the section."""
    s = along[:, 0]
    assert state.shape is not None
    half = 0.5 * scene.width
    points = state.shape.points(s, np.array([-half, 0.0, half]))
    up = np.array([0.0, 0.0, 1.0]) if scene.up is None else scene.up
    side = np.cross(up, [0.0, 0.0, 1.0] if abs(up[2]) < 0.9 else [0.0, 1.0, 0.0])
    side = side / np.linalg.norm(side)
    axes = np.column_stack([side, np.cross(up, side), up])
    seen = points @ axes
    figure = Figure(figsize=(12.0, 4.2), layout="constrained")
    left: Any = figure.add_subplot(1, 3, 1, projection="3d")
    left.plot_surface(*(seen[:, :, k] for k in range(3)), color=COLOURS[0], alpha=0.6, rcount=200, ccount=3)
    left.plot(*seen[:, 1].T, color=COLOURS[0], lw=1.5)
    for held, index in ((scene.clamp_start, 0), (scene.clamp_end, -1)):
        if held is not None:
            left.scatter(*seen[index, 1], color=COLOURS[1], s=40)
    left.set_box_aspect(np.maximum(np.ptp(seen.reshape(-1, 3), axis=0), 0.05))
    left.set(title="shape, upwards, in l")
    left.locator_params(nbins=3)
    middle, right = figure.add_subplot(1, 3, 2), figure.add_subplot(1, 3, 3)
    rest = state.native.problem.rest
    for k, colour in enumerate(COLOURS):
        middle.plot(s, along[:, 4 + k], color=colour, label=f"kappa_{k + 1}")
        middle.plot([0.0, 1.0], rest[k], "--", color=colour, lw=1)
        right.plot(s, along[:, 10 + k], color=colour, label=f"about t_{'xyz'[k]}")
    middle.set(xlabel="s / l", ylabel="1 / l", title="curvatures and twist, dashed at rest")
    right.set(xlabel="s / l", ylabel="D w / l", title="moment of the section")
    for panel in (middle, right):
        panel.legend(fontsize="small")
        panel.grid(alpha=0.3)
    figure.suptitle(scene.title)
    return save(figure, path)
