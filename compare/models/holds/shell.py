"""Ends of a shell that a scene holds in part: which part, where its path begins, and the motions that nothing resists.

Only NumPy and the shell's dataclasses are imported, as in `compare.models.shell_build`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from compare.measure.align import Motions
from compare.scene.data import unit
from compare.scene.scene import Scene
from compare.scene.spec import ClampSpec
from shellref.holds import motions, parts
from shellref.shell.problem import Pose
from shellref.shell.strip import arc_end

FloatArray = NDArray[np.float64]


def part(clamp: ClampSpec | None) -> str:
    """What a clamp holds of an end (shellref.holds.parts)."""
    if clamp is None:
        return parts.NOTHING
    if clamp.position is not None:
        return parts.ALL if clamp.tangent is not None else parts.POSITION
    return parts.FRAME if clamp.tangent is not None else parts.SECTION


def holds(scene: Scene) -> tuple[str, str]:
    """What is held of both ends; "all" of a free end, of a tape spring's that turns, and of a band's that is no end, by
    which the problem of a strip that is held as a whole is what it was."""
    start = parts.ALL if scene.clamp_start is None and scene.clamp_end is None else part(scene.clamp_start)
    end = parts.ALL if scene.clamp_end is None or scene.transverse_curvature else part(scene.clamp_end)
    return start, end


def partly(scene: Scene) -> bool:
    """Whether a part of an end is held, other than the frame of the end alone."""
    start, end = holds(scene)
    return start != parts.ALL or end not in (parts.ALL, parts.FRAME)


def section(scene: Scene, clamp: ClampSpec | None) -> str:
    """How a clamp leaves the section: of a tape spring as it says; where the frame is free, as the ruling."""
    if clamp is not None and part(clamp) == parts.POSITION and not scene.transverse_curvature:
        return "free" if clamp.ruling == "free" else "undeformed"
    return "undeformed" if clamp is None or clamp.section is None else clamp.section


def poses(scene: Scene, curvature: float | None) -> tuple[Pose, Pose | None]:
    """Poses of both ends as the scene holds them, and for what it does not hold those in which the path begins.

    curvature: 1/l, of the arc between two held points; elsewhere the strip begins in its natural shape, hanging where
    it weighs something and only a point is held.
    """
    points = [scene.start_position, scene.end_position]
    frames = [scene.start_frame, scene.end_frame]
    if points[0] is not None and points[1] is not None:
        frames = _between(points[0], points[1], frames, curvature or 0.0, scene)
    elif scene.clamp_end is None:
        frames[0] = _hanging(scene, -1.0) if frames[0] is None else frames[0]
        return _pose(np.zeros(3) if points[0] is None else points[0], frames[0]), None
    elif frames[0] is None or points[0] is None:
        if frames[0] is None or frames[1] is None:
            points, frames = _other(scene, points, frames)
        if points[0] is None:
            shift = _place(arc_end(_pose(np.zeros(3), frames[0]), scene.curvature))
            points[0] = np.zeros(3) if points[1] is None else points[1] - shift
    assert points[0] is not None
    frames[1] = frames[0] if frames[1] is None else frames[1]
    at = points[1] if points[1] is not None else np.zeros(3)
    return _pose(points[0], frames[0]), _pose(at, frames[1])


def _other(
    scene: Scene, points: list[FloatArray | None], frames: list[FloatArray | None]
) -> tuple[list[FloatArray | None], list[FloatArray | None]]:
    """Of a strip that is held by one end's frame, or by a point alone: the other end where the natural shape has it."""
    home = arc_end(_pose(np.zeros(3), np.eye(3)), scene.curvature)
    turn = np.array(home.frame)
    if frames[0] is None:
        frames[1] = _hanging(scene, 1.0) if frames[1] is None else frames[1]
        frames[0] = frames[1] @ turn.T
    else:
        frames[1] = frames[0] @ turn
    return points, frames


def _place(pose: Pose) -> FloatArray:
    return np.array(pose.position)


def _pose(position: FloatArray, frame: FloatArray | None) -> Pose:
    assert frame is not None
    return Pose(tuple(position.tolist()), tuple(map(tuple, frame.tolist())))  # type: ignore[arg-type]


def _hanging(scene: Scene, sign: float) -> FloatArray:
    """A frame whose tangent is `sign` times up, or along the force at the end, or along z."""
    path = np.array([0.0, 0.0, 1.0])
    if scene.gamma and scene.up is not None:
        path = sign * scene.up
    elif scene.tip_force.any():
        path = unit(scene.tip_force)
    across = np.eye(3)[int(np.argmin(np.abs(path)))]
    normal = unit(np.cross(path, across))
    return np.stack([np.cross(normal, path), normal, path], axis=1)


def _between(
    first: FloatArray, last: FloatArray, frames: list[FloatArray | None], curvature: float, scene: Scene
) -> list[FloatArray | None]:
    """Frames of the arc between two points, in the plane of a frame that is held, else of the weight, where one is not
    held."""
    chord = last - first
    known = [frame for frame in frames if frame is not None]
    along = unit(chord) if float(np.linalg.norm(chord)) > 1e-9 else (known[0] if known else np.eye(3))[:, 2]
    ways = [frame[:, k] for frame in known for k in (1, 2, 0)]
    ways += [] if scene.up is None else [scene.up]
    ways += list(np.eye(3)[[1, 0, 2]])
    normal = next(x for x in (path - (path @ along) * along for path in ways) if np.linalg.norm(x) > 1e-3)
    middle = np.stack([np.cross(unit(normal), along), unit(normal), along], axis=1)
    found: list[FloatArray | None] = []
    for frame, angle in zip(frames, (-0.5 * curvature, 0.5 * curvature), strict=True):
        cosine, sine = math.cos(angle), math.sin(angle)
        turned = middle @ np.array([[1.0, 0.0, 0.0], [0.0, cosine, -sine], [0.0, sine, cosine]])
        found.append(turned if frame is None else frame)
    return found


def motions_of(scene: Scene) -> Motions | None:
    """The rigid motions of an open strip, or of a band held at a point, that neither supports nor loads resist."""
    ends = ((part(scene.clamp_start), scene.start_position, scene.clamp_start),
            (part(scene.clamp_end), scene.end_position, scene.clamp_end))  # fmt: skip
    supports = [
        motions.Support(
            place if parts.at_a_point(held) else None, parts.has_frame(held) or bool(scene.transverse_curvature),
            None if clamp is None or clamp.slide is None else unit(clamp.slide),
        )
        for held, place, clamp in ends
        if held != parts.NOTHING
    ]  # fmt: skip
    loads = [scene.up] if scene.gamma and scene.up is not None else []
    loads += [unit(scene.tip_force)] if scene.tip_force.any() else []
    loads += list(scene.wall_normals)  # nor does a motion along a wall change a gap
    pivot = next((held.point for held in supports if held.point is not None), None)
    found = motions.free(supports, loads, np.zeros(3) if pivot is None else pivot)
    if not len(found):
        return None
    left, sizes, right = np.linalg.svd(found[:, 3:])
    turning = int(np.sum(sizes > motions.RANK))
    return Motions((left[:, turning:].T @ found)[:, :3], right[:turning], pivot)
