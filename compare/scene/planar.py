"""Is a scene planar, and if not, what breaks it? The planar elastica is for those that are.

The plane is that of t_y and t_z at the start clamp. A strip in it has eta = 0; every clamp and load has to stay in it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from compare.scene.data import SceneData
from compare.scene.inputs import law

PLANAR_TOLERANCE = 1e-9
"""Largest component along t_x, of a unit vector or of a distance over l, for which a scene counts as planar."""

TAUT = 1.0 - 1e-9
"""Distance of the clamps over l from which the strip between them is straight and its force not determined."""

#: What is no circle, in words.
_KINDS = {"sphere": "a sphere", "box": "a box", "edge": "an edge"}


def nonplanar_reason(scene: SceneData) -> str | None:
    """Why the planar elastica cannot be asked: the clamp or load that leaves the plane of t_y and t_z with its
    component along t_x, or what holds the strip otherwise; None: it can."""
    if scene.closure is not None:
        return f'[closure] kind = "{scene.closure.kind}" closes the strip, and the elastica has two ends'
    if scene.walls:
        return "[[wall]] confines the strip, and the elastica knows no planes"
    if scene.rod is not None or (scene.tip is not None and scene.tip.moment is not None):
        return "[rod] or tip.moment is for rods in space, which the elastica does not know"
    if scene.strip.transverse_curvature:
        return "strip.transverse_curvature makes it a tape spring, and the elastica has no section"
    if scene.shaped:
        key = "natural_twist" if any(law.values(scene.twist)) else "natural_geodesic_curvature"
        return f"strip.{key} shapes it in space, and the elastica is planar"
    if any(clamp is not None and clamp.slide is not None for clamp in (scene.clamp_start, scene.clamp_end)):
        return "a clamp slides, and the elastica's hold all of a point or nothing of it"
    frame, position = scene.start_frame, scene.start_position
    if frame is None or position is None:
        return "the frame or the position at s = 0 is free, and the elastica is clamped there"
    names = scene.barrier_names[len(scene.walls) :]
    for name, one, axis in zip(names, scene.obstacles, scene.obstacle_axes, strict=True):
        if one.kind != "cylinder" or axis is None:
            return f"obstacle {name} is {_KINDS[one.kind]}, which is no circle across the plane"
        if float(np.linalg.norm(axis - (axis @ frame[:, 0]) * frame[:, 0])) > PLANAR_TOLERANCE:
            return f"the axis of obstacle {name} does not go straight through the plane, along {_axis(frame[:, 0])}"
    found = _load_out_of_plane(scene, frame)
    return found if found is not None else _end_out_of_plane(scene, frame, position)


def _axis(across: NDArray[np.float64]) -> str:
    listed = ", ".join(f"{c + 0.0:.4g}" for c in across)
    return f"t_x = clamp.start.normal x clamp.start.tangent = [{listed}]"


def _load_out_of_plane(scene: SceneData, frame: NDArray[np.float64]) -> str | None:
    """The weight and the load at the tip along gravity.up, and the whole force at the tip."""
    up, force = scene.up, scene.tip_force
    size = float(np.linalg.norm(force))
    for vector, loads, what in (
        (up, scene.gamma, "gravity.up has the component {} along {}, so the weight"),
        (up, scene.tip_load, "gravity.up has the component {} along {}, so the load at the tip"),
        (force / size if size else None, size, "the force at the tip has the component {} of its own along {}, so it"),
    ):
        if vector is None or loads == 0.0:
            continue
        component = float(vector @ frame[:, 0])
        if abs(component) > PLANAR_TOLERANCE:
            pulls = what.format(f"{component:.4g}", _axis(frame[:, 0]))
            return f"{pulls} pulls the strip out of the plane of t_y and t_z"
    return None


def _end_out_of_plane(scene: SceneData, frame: NDArray[np.float64], position: NDArray[np.float64]) -> str | None:
    """The clamp at s = l: its point lies in the plane, its t_x is that of the start."""
    across = frame[:, 0]
    held, end_frame = scene.end_position, scene.end_frame
    if held is not None:
        component = float((held - position) @ across)
        if abs(component) > PLANAR_TOLERANCE:
            return (
                f"clamp.end.position stands {component:.4g} l out of the plane of t_y and t_z at the start, along "
                f"{_axis(across)}"
            )
        distance = float(np.linalg.norm(held - position))
        if distance >= TAUT:
            return f"the clamps stand {distance:.6g} l apart: the strip is straight and its force not determined"
    if end_frame is None:
        return None
    for name, column in (("tangent", 2), ("normal", 1)):
        component = float(end_frame[:, column] @ across)
        if abs(component) > PLANAR_TOLERANCE:
            return (
                f"clamp.end.{name} has the component {component:.4g} along {_axis(across)}, so the clamp turns the "
                "strip out of the plane of t_y and t_z"
            )
    if float(end_frame[:, 0] @ across) < 0.0:
        return (
            "clamp.end has t_x = clamp.end.normal x clamp.end.tangent against that of clamp.start, so the strip has "
            "half a turn of twist between them"
        )
    return None
