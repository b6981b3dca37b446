"""A straight strip, held at its start, that begins through an obstacle: a note, for where it comes to lie is chance;
and one that begins outside of what it is to be inside of, which is seldom brought in by itself.

A strip across a tube of radius R, along its wall, lies on it turned by l / R (but for its free arc)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from compare.scene.data import SceneData
from compare.scene.inputs.bodies import Body
from ribbonbench.accepted import accepted
from ribbonbench.errors import BadInput

#: Points along the strip, and how deep (l) it begins in an obstacle that is told.
_POINTS, _DEEP = 401, 2e-3
#: Turn (rad) up to which a strip in a tube is known to settle, from the seed of its note, a segment for each radian or
#: more (results/obstacles.md).
MOST_TURN = 300.0


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


def check_wound(scene: SceneData) -> None:
    """`BadInput` for a tube in which the strip would be turned by more than `MOST_TURN`, unless all is `accepted`."""
    position, frame = scene.start_position, scene.start_frame
    held = scene.path or scene.clamp_end is not None or scene.closure is not None
    if accepted() or held or position is None or frame is None:
        return
    for key, spec, body in zip(scene.barrier_names[len(scene.walls) :], scene.obstacles, scene.bodies, strict=True):
        turn = _turn(body, position, frame) if body.inside else 0.0
        if abs(turn) > MOST_TURN:
            least = scene.strip.length / MOST_TURN
            raise BadInput(
                f"obstacle.{key}.radius", spec.radius,
                f"turns the strip by {abs(turn):.4g} rad on its wall; more than {MOST_TURN:g} are not known to settle",
                f"take a radius of {least:.3g} or more, or a shorter strip; to try it all the same, say --yes (and "
                "model.budget, seconds)",
            )  # fmt: skip


def _turn(body: Body, position: NDArray[np.float64], frame: NDArray[np.float64]) -> float:
    """omega l (rad) of a strip that starts on the wall of a tube or a sphere, across its axis, and lies along it from
    within: t_z' = -omega t_y; 0 where it does not start so."""
    if body.kind not in ("cylinder", "sphere"):
        return 0.0
    towards, radius = np.asarray(body.point) - position, float(body.radius)
    if body.axis is not None:
        axis = np.asarray(body.axis)
        towards = towards - (towards @ axis) * axis
        if abs(frame[:, 2] @ axis) > 1e-6:
            return 0.0
    rise = float(towards @ frame[:, 1])
    on_wall = abs(float(np.linalg.norm(towards)) - radius) < 1e-6 * radius and abs(rise) > 0.999 * radius
    return -np.sign(rise) / radius if on_wall else 0.0


def _bent_inwards(scene: SceneData, body: Body, position: NDArray[np.float64], frame: NDArray[np.float64]) -> str:
    """The seed with which the strip lies along the wall, and the segments that it needs: one for each radian."""
    turn = _turn(body, position, frame)
    if not turn:
        return ""
    few = abs(turn) > len(scene.model.lengths)
    segments = f" and model.elements = {int(np.ceil(abs(turn)))} (one for each radian)" if few else ""
    return f" curvature = {turn / scene.strip.length:.4g}{segments}"
