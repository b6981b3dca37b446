"""A straight strip, held at its start, that begins through an obstacle: a note, for where it comes to lie is chance."""

from __future__ import annotations

import numpy as np

from compare.scene.data import SceneData

#: Points along the strip, and how deep (l) it begins in an obstacle that is told.
_POINTS, _DEEP = 401, 2e-3


def begins_through(scene: SceneData, seed: str | None = "[seed]") -> tuple[str, ...]:
    """A line for each obstacle that the straight start goes through; none for other starts, or with a path, which say
    where the strip is on its way. seed: what says the start, as its text is to name it; None: it is not straight."""
    position, frame = scene.start_position, scene.start_frame
    given = scene.path or scene.seed.curvature is not None or scene.clamp_end is not None or scene.closure is not None
    if seed is None or given or position is None or frame is None or any(scene.seed_curvature):
        return ()
    s = np.linspace(0.0, 1.0, _POINTS)
    points = position + s[:, None] * frame[:, 2]
    found = []
    for name, body in zip(scene.barrier_names[len(scene.walls) :], scene.bodies, strict=True):
        gaps = body.facing(points)[0]
        if body.inside or gaps.min() > -_DEEP:
            continue
        length = scene.strip.length
        at, deep = length * s[np.argmax(gaps < 0.0)], -length * float(gaps.min())
        text = (
            f"the straight strip begins through obstacle {name}, from s = {at:.3g} on, up to {deep:.3g} deep: on which "
            "side of it it comes to lie is not said; move the obstacle (a box's size is along axis, normal and across "
            f"both), or give {seed} or a [[path]]"
        )
        found.append(text)
    return tuple(found)
