"""The picture of several strips: two side views and one in perspective, each strip in a colour of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import NDArray

from compare.page.drawing import RIBBON_COLOUR, SHELL_COLOURS, quads, save, screen_axes

FloatArray = NDArray[np.float64]

#: Cells of a strip in the perspective view.
_CELLS = 160
_JOINT, _TOUCH = "#c2662d", "#d40000"


def colour(number: int) -> str:
    """The colour of a strip, by its number."""
    return (RIBBON_COLOUR, *SHELL_COLOURS)[number % (1 + len(SHELL_COLOURS))]


def draw(
    path: Path,
    grids: Mapping[str, FloatArray],
    joints: Sequence[FloatArray],
    touches: Sequence[FloatArray],
    title: str,
    up: FloatArray | None,
) -> Path:
    """Draws grids (k, m, 3) by name, joints and places of contact (3,), all in one unit."""
    figure = Figure(figsize=(12.0, 4.4))
    sides = screen_axes(list(grids.values()), up)
    for place, screen in enumerate(sides):
        axes = figure.add_subplot(1, 3, place + 1)
        for number, grid in enumerate(grids.values()):
            flat = grid[:, grid.shape[1] // 2] @ screen.T
            axes.plot(flat[:, 0], flat[:, 1], color=colour(number), lw=1.4)
        for points, mark, of in ((joints, "o", _JOINT), (touches, "x", _TOUCH)):
            for point in points:
                axes.plot(*(screen @ point), mark, color=of, ms=5)
        axes.set_aspect("equal", adjustable="datalim")
        axes.grid(True, lw=0.3, alpha=0.6)
    space = figure.add_subplot(1, 3, 3, projection="3d")
    vertical = np.array([0.0, 0.0, 1.0]) if up is None else np.asarray(up, dtype=float)
    turn = np.array([sides[0][0], sides[1][0], vertical])
    clouds = []
    for number, (name, grid) in enumerate(grids.items()):
        step = max(1, (len(grid) - 1) // _CELLS)
        points = grid[::step] @ turn.T
        clouds.append(points.reshape(-1, 3))
        faces = Poly3DCollection(list(quads(points)), facecolors=colour(number), edgecolors="none", alpha=0.85)
        space.add_collection3d(faces)
        space.plot([], [], color=colour(number), lw=3.0, label=name)
    cloud = np.concatenate(clouds)
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    size = np.maximum(high - low, 0.25 * float((high - low).max()))
    for setter, a in ((space.set_xlim, 0), (space.set_ylim, 1), (space.set_zlim, 2)):
        setter(*(0.5 * (low + high)[a] + 0.5 * size[a] * np.array([-1.0, 1.0])))
    space.set_box_aspect(size)
    space.view_init(elev=28.0, azim=-62.0)
    space.set_axis_off()
    if len(grids) <= 8:
        space.legend(fontsize=8, loc="upper right")
    figure.suptitle(title, fontsize=10)
    return save(figure, path)
