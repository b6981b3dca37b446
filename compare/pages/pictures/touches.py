"""Contacts in a picture: a dot at every place that touches, an arrow for its push and one for its friction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from compare.page.drawing import PUSH_COLOUR, RUB_COLOUR
from compare.scene.units import Units
from compare.store.touches import Touches

FloatArray = NDArray[np.float64]

#: The longest arrow over the extent of what is drawn.
LONGEST = 0.16
#: Part of the longest below which an arrow would be less than its head: its place is a dot.
_LEAST = 0.02


def arrows(touches: Touches, extent: float) -> list[tuple[FloatArray, FloatArray, str]]:
    """Of pushes, then of friction: places (k, 3), arrows (k, 3) on the strip to one scale, the longest `LONGEST` of the
    extent, and their colour; forces that are nothing beside the largest have none."""
    largest = touches.largest
    found = []
    for forces, colour in ((touches.push, PUSH_COLOUR), (touches.friction, RUB_COLOUR)):
        seen = np.linalg.norm(forces, axis=1) > _LEAST * largest
        if largest > 0.0 and seen.any():
            found.append((touches.points[seen], LONGEST * extent / largest * forces[seen], colour))
    return found


def flat(axes: Any, touches: Touches, screen: FloatArray, extent: float) -> None:
    """Draws them in a plane view; screen (2, 3): its axes. Nothing where nothing touches."""
    if not len(touches):
        return
    places = touches.points @ screen.T
    axes.scatter(*places.T, s=9.0, color=PUSH_COLOUR, zorder=6, label="contact")
    for points, ways, colour in arrows(touches, extent):
        foot, way = points @ screen.T, ways @ screen.T
        axes.quiver(
            *foot.T, *way.T, angles="xy", scale_units="xy", scale=1.0, color=colour, width=0.005, headwidth=5.0,
            headlength=6.0, headaxislength=5.5, zorder=5,
        )  # fmt: skip
        axes.update_datalim(foot + way)


def space(axes: Any, touches: Touches, turn: FloatArray, extent: float) -> None:
    """Draws them in perspective; turn (3, 3): rows are the axes of the picture."""
    if not len(touches):
        return
    axes.plot(*(touches.points @ turn.T).T, "o", color=PUSH_COLOUR, ms=2.5, zorder=12)
    for points, ways, colour in arrows(touches, extent):
        axes.quiver(*(points @ turn.T).T, *(ways @ turn.T).T, color=colour, lw=1.0, arrow_length_ratio=0.3, zorder=11)


def traced(axes: Any, lines: Sequence[FloatArray], **more: Any) -> None:
    """Lines of contact, in the view's own axes (k, 2) or (k, 3)."""
    for line in lines:
        axes.plot(*line.T, color=PUSH_COLOUR, lw=3.0, alpha=0.35, solid_capstyle="butt", **more)


def legend(axes: Any, touches: Touches, units: Units | None, **where: Any) -> None:
    """What dots and arrows are, and how much the longest is; nothing where nothing touches."""
    if not len(touches):
        return
    unit = units or Units()
    handles = [Line2D([], [], color=PUSH_COLOUR, marker="o", ms=3.0, lw=0.0, label=f"contact: {_places(touches)}")]
    for forces, colour, name in (
        (touches.push, PUSH_COLOUR, "push on the strip"),
        (touches.friction, RUB_COLOUR, "friction on it"),
    ):
        most = float(np.linalg.norm(forces, axis=1).max())
        if most > 0.0:
            text = f"{name}, at most {unit.text(most, 'D w / l^2')}"
            handles.append(Line2D([], [], color=colour, marker=r"$\rightarrow$", ms=8.0, lw=0.0, label=text))
    axes.legend(handles=handles, **{"fontsize": 7, "framealpha": 0.85, "handletextpad": 0.3, **where})


def _places(touches: Touches) -> str:
    count = len(touches)
    return f"{count} place{'s' if count != 1 else ''}"
