"""What is asked of obstacles and of contact with itself, checked before a mesh is made. NumPy only."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from ribbonbench import statics
from shellref.contact.obstacles import Obstacle
from shellref.contact.walls import FACES
from shellref.inputs import ShellInputError, Vector, number, numbers

#: Places across a held edge at which it is looked at.
ACROSS = 33
#: Distance that parts keep, over l, at most.
MOST_APART = 0.25


def points_of(key: str, value: Any) -> tuple[Vector, ...]:
    """A list of points."""
    if isinstance(value, (str, bytes, Mapping)) or not isinstance(value, Iterable):
        raise ShellInputError(key, value, "must be a list of points")
    return tuple(numbers(key, point, 3) for point in value)  # type: ignore[misc]


def held_edge(problem: Any, pose: Any) -> np.ndarray:
    """Points (m, 3) of an edge of a problem that is held at a pose, of its faces where these touch."""
    lever = 0.5 * problem.thickness if problem.contact == FACES else 0.0
    frame, v = np.array(pose.frame), 0.5 * problem.width * np.linspace(-1.0, 1.0, ACROSS)
    middle = np.array(pose.position) + v[:, None] * frame[:, 0]
    return np.vstack([middle + lever * frame[:, 1], middle - lever * frame[:, 1]])


def check_contact(problem: Any, put: Callable[[str, object], None]) -> None:
    """Reads `obstacles` and `apart` of a problem (shellref.shell.problem). Raises ShellInputError."""
    given = problem.obstacles
    if isinstance(given, (str, bytes, Mapping)) or not isinstance(given, Iterable):
        raise ShellInputError("obstacles", given, "must be a list of obstacles")
    put("obstacles", tuple(Obstacle.read(item) for item in given))
    if problem.apart is not None:
        put("apart", number("apart", problem.apart))
        if not 0.0 <= problem.apart <= MOST_APART:
            raise ShellInputError("apart", problem.apart, f"must be from 0 to {MOST_APART:g} of the length")
        for key, value in (("transverse_curvature", problem.transverse_curvature),):
            if value:
                raise ShellInputError("apart", problem.apart, f"is not known for strips with {key}: leave one out")
    if not problem.obstacles:
        return
    if problem.clamp == "free" or (problem.partly_held and not problem.closed):
        remedy = (
            "a strip that may move as a whole is not followed along obstacles: hold one end with position and frame"
        )
        raise ShellInputError("obstacles", f"{len(problem.obstacles)} of them", remedy)
    for pose in problem.held_poses:
        edge = held_edge(problem, pose)
        for k, body in enumerate(problem.obstacles):
            behind = -float(body.gaps(edge, np.array(body.point)).min())
            if behind > statics.BEHIND_WALL:
                remedy = f"cuts a clamp: a held edge is {behind:.3g} l behind its surface; move one of them"
                raise ShellInputError(f"obstacles[{k}].point", body.point, remedy)
