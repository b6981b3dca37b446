"""The plane of a tape spring: that of t_z and t_y at the start of the path, and what holds the tape in it.

X, Y of `ribbon.tape` are along t_z and t_y; k of the rod is -omega there, and its moment turns t_z towards t_y.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from compare.scene.scene import Scene
    from compare.scene.spec import ClampSpec
    from ribbon.tape.held import Hold

FloatArray = NDArray[np.float64]

OUT_OF_PLANE = 1e-9
"""Component along t_x for which a clamp counts as in the plane."""


def plane_of(scene: Scene) -> tuple[FloatArray, FloatArray]:
    """Origin (3,) and axes (3, 3), columns t_x t_y t_z, of the tape's plane: the start clamp as the path begins."""
    first = scene.stages()[0]
    return np.asarray(first.position), np.asarray(first.frame)


def leaves(scene: Scene, plane: tuple[FloatArray, FloatArray]) -> str | None:
    """The clamp that leaves the plane, with its component along t_x."""
    origin, axes = plane
    across = axes[:, 0]
    for name, position, frame, clamp in (
        ("start", scene.start_position, scene.start_frame, scene.clamp_start),
        ("end", scene.end_position, scene.end_frame, scene.clamp_end),
    ):
        found = {
            "position": None if position is None else float((position - origin) @ across),
            "tangent": None if frame is None else float(frame[:, 2] @ across),
            "normal": None if frame is None else float(frame[:, 1] @ across),
            "slide": None if clamp is None or clamp.slide is None else float(np.array(clamp.slide) @ across),
        }
        for key, component in found.items():
            if component is not None and abs(component) > OUT_OF_PLANE:
                return f"clamp.{name}.{key} has the component {component:.4g} along t_x, out of the plane of t_y, t_z"
        if frame is not None and float(frame[:, 0] @ across) < 0.0:
            return f"clamp.{name} has its t_x against that of the start: half a turn of twist"
    return None


def holds(scene: Scene, plane: tuple[FloatArray, FloatArray]) -> tuple[Hold, Hold]:
    origin, axes = plane
    return (
        _hold(scene.clamp_start, scene.start_position, scene.start_frame, origin, axes),
        _hold(scene.clamp_end, scene.end_position, scene.end_frame, origin, axes),
    )


def _hold(
    clamp: ClampSpec | None,
    position: FloatArray | None,
    frame: FloatArray | None,
    origin: FloatArray,
    axes: FloatArray,
) -> Hold:
    """A clamp in the plane; a free end has a free section."""
    from ribbon.tape.held import Hold

    if clamp is None:
        return Hold(undeformed=False)

    def angle(vector: FloatArray) -> float:
        return math.atan2(float(vector @ axes[:, 1]), float(vector @ axes[:, 2]))

    point = None if position is None else (position - origin) @ axes
    return Hold(
        point=None if point is None else (float(point[2]), float(point[1])),
        slide=None if clamp.slide is None else angle(np.array(clamp.slide)),
        angle=None if frame is None else angle(frame[:, 2]),
        undeformed=clamp.section != "free",
    )


def unwound(stages: list[tuple[Hold, Hold]]) -> list[tuple[Hold, Hold]]:
    """The stages with angles that follow each other by the shorter way."""
    found: list[tuple[Hold, Hold]] = []
    for stage in stages:
        before = found[-1] if found else (None, None)
        turned = []
        for hold, old in zip(stage, before, strict=True):
            last = 0.0 if old is None or old.angle is None else old.angle
            if hold.angle is not None:
                whole = 2.0 * math.pi * round((last - hold.angle) / (2.0 * math.pi))
                turned.append(replace(hold, angle=hold.angle + whole))
            else:
                turned.append(hold)
        found.append((turned[0], turned[1]))
    return found
