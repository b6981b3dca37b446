"""The picture of several strips: two side views and one in perspective, each strip in a colour of its own, with joints
and with what they touch and how they are pushed there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import NDArray

from compare.page.drawing import RIBBON_COLOUR, SHELL_COLOURS, quads, save, screen_axes
from compare.pages.pictures import touches as contacts
from compare.pages.pictures.ribbon import length_axis
from compare.scene.units import Units
from compare.store.touches import Touches

FloatArray = NDArray[np.float64]

#: Cells of a strip in the perspective view.
_CELLS = 160
_JOINT = "#c2662d"


def colour(number: int) -> str:
    """The colour of a strip, by its number."""
    return (RIBBON_COLOUR, *SHELL_COLOURS)[number % (1 + len(SHELL_COLOURS))]


def draw(
    path: Path,
    grids: Mapping[str, FloatArray],
    joints: Sequence[FloatArray],
    touches: Touches,
    title: str,
    up: FloatArray | None,
    units: Units | None = None,
) -> Path:
    """Draws grids (k, m, 3) by name, joints (3,) and places of contact with forces, all in l (D w / l^2) of the first
    strip; units: what that is."""
    figure = Figure(figsize=(12.0, 4.6))
    sides = screen_axes(list(grids.values()), up)
    cloud = np.concatenate([grid.reshape(-1, 3) for grid in grids.values()])
    extent = float(np.ptp(cloud, axis=0).max())
    size, unit = length_axis(units)
    for place, screen in enumerate(sides):
        axes = figure.add_subplot(1, 3, place + 1)
        for number, grid in enumerate(grids.values()):
            line = grid[:, grid.shape[1] // 2] @ screen.T
            axes.plot(line[:, 0], line[:, 1], color=colour(number), lw=1.4)
        for point in joints:
            axes.plot(*(screen @ point), "o", color=_JOINT, ms=5)
        contacts.flat(axes, touches, screen, extent)
        axes.set_aspect("equal", adjustable="datalim")
        axes.grid(True, lw=0.3, alpha=0.6)
        for axis, name in ((axes.xaxis, f"{_direction(screen[0])} / {unit}"), (axes.yaxis, _direction(screen[1]))):
            axis.set_major_formatter(lambda value, _: f"{size * value:.4g}")
            axis.set_label_text(name, fontsize=8)
            axis.set_tick_params(labelsize=8)
        axes.set_title(f"{'seen from the side' if place == 0 else 'turned by 90 degrees'} / {unit}", fontsize=9)
        if place == 0:
            where = {"loc": "upper left", "bbox_to_anchor": (0.0, -0.13), "ncols": 3, "frameon": False}
            contacts.legend(axes, touches, units, **where)
    _space(figure.add_subplot(1, 3, 3, projection="3d"), grids, sides, up, touches, extent)
    figure.suptitle(title, fontsize=10)
    return save(figure, path)


def _direction(axis: FloatArray) -> str:
    """A direction in space by the letter of the axis that it is along, else by its components."""
    for letter, unit in zip("xyz", np.eye(3), strict=True):
        if abs(float(axis @ unit)) > 1.0 - 1e-9:
            return letter if axis @ unit > 0.0 else f"-{letter}"
    return "along (" + ", ".join(f"{c + 0.0:.2f}" for c in axis.round(2)) + ")"


def _space(
    space: Any, grids: Mapping[str, FloatArray], sides: Sequence[FloatArray], up: FloatArray | None, touches: Touches,
    extent: float,
) -> None:  # fmt: skip
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
    contacts.space(space, touches, turn, extent)
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
