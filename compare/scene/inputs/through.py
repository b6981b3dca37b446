"""A straight strip, held at its start, that begins through an obstacle: a note, for where it comes to lie is chance;
and one that begins outside of what it is to be inside of, which is seldom brought in by itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from compare.scene.data import SceneData
from compare.scene.inputs.bodies import Body

#: Points along the strip, and how deep (l) it begins in an obstacle that is told.
_POINTS, _DEEP = 401, 2e-3


def begins_through(scene: SceneData, seed: str | None = "[seed]") -> tuple[str, ...]:
    """A line for each obstacle that the straight start goes through, or out of; none for other starts, or with a path,
    which say where the strip is on its way. seed: what says the start, as its text is to name it; None: it is not
    straight."""
    position, frame = scene.start_position, scene.start_frame
    given = scene.path or scene.seed.curvature is not None or scene.clamp_end is not None or scene.closure is not None
    if seed is None or given or position is None or frame is None or any(scene.seed_curvature):
        return ()
    s = np.linspace(0.0, 1.0, _POINTS)
    points = position + s[:, None] * frame[:, 2]
    found = []
    for name, body in zip(scene.barrier_names[len(scene.walls) :], scene.bodies, strict=True):
        gaps = body.facing(points)[0]
        if gaps.min() > -_DEEP:
            continue
        length = scene.strip.length
        at, deep = length * s[np.argmax(gaps < 0.0)], -length * float(gaps.min())
        if body.inside:
            bent = _bent_inwards(scene, body, position, frame)
            found.append(
                f"the straight strip begins outside of obstacle {name}, from s = {at:.3g} on, up to {deep:.3g} away: "
                f"it has to be brought in first, which may fail; give {seed}{bent} or a [[path]]"
            )
            continue
        text = (
            f"the straight strip begins through obstacle {name}, from s = {at:.3g} on, up to {deep:.3g} deep: on which "
            "side of it it comes to lie is not said; move the obstacle (a box's size is along axis, normal and across "
            f"both), or give {seed} or a [[path]]"
        )
        found.append(text)
    return tuple(found)


def _bent_inwards(scene: SceneData, body: Body, position: NDArray[np.float64], frame: NDArray[np.float64]) -> str:
    """The seed with which the strip lies along the wall from within, where its start does: t_z' = -omega t_y."""
    if body.kind not in ("cylinder", "sphere"):
        return ""
    length = scene.strip.length
    towards = np.asarray(body.point) - position
    if body.axis is not None:
        axis = np.asarray(body.axis)
        towards = towards - (towards @ axis) * axis
    radius = float(body.radius)
    along = abs(float(np.linalg.norm(towards)) - radius) < 1e-6 * radius and abs(towards @ frame[:, 1]) > 0.999 * radius
    if not along:
        return ""
    return f" curvature = {-np.sign(towards @ frame[:, 1]) / (radius * length):.4g}"
