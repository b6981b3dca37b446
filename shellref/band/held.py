"""From ends that are held as a whole to ends of which the point is held: the frames are let go, and the strip settles.

A strip that may turn has no path of its own that is sure: without its loads nothing says where it is. With the frames
held too, where the beginning has them, it has the usual one. There it is turned about its one held point until the dead
loads have no moment about it, which leaves its energy of deformation as it is, and the frames are let go at the full
load. The turn is the rotation R that makes the loads' potential -sum f_i . R (x_i - p) the least, the orthogonal factor
of sum f_i (x_i - p)^T (Kabsch 1976, doi:10.1107/S0567739476001873).
"""

from __future__ import annotations

import dataclasses

import numpy as np

from shellref.holds import parts
from shellref.shell.problem import ShellProblem
from shellref.shell.strip import strip_grid
from shellref.shell.surface import ShellSurface


def whole(problem: ShellProblem) -> ShellProblem | None:
    """The same strip with clamps that hold all of an end where they hold its point; None: there are none, and it has a
    path of its own.
    """
    if parts.POSITION not in problem.ends:
        return None
    ends = [
        (parts.ALL, "undeformed") if part == parts.POSITION else (part, section)
        for part, section in zip(problem.holds, problem.sections, strict=True)
    ]
    (start, first), (end, last) = ends
    return dataclasses.replace(problem, holds=(start, end), sections=(first, last))


def swung(problem: ShellProblem, surface: ShellSurface) -> ShellSurface:
    """The surface turned about the one held point of a strip whose frames are free; another one as it is."""
    at = [k for k, part in enumerate(problem.ends) if part == parts.POSITION]
    if len(at) != 1 or any(map(parts.has_frame, problem.ends)) or not (problem.loaded or problem.pulled):
        return surface
    pivot = surface.centreline(np.array(float(at[0])))
    arms = surface.points - pivot
    grid = strip_grid(problem)
    share = np.outer(grid.nodal_shares(0), grid.nodal_shares(1)) / problem.width
    seen = np.zeros((3, 3))
    if problem.loaded:
        seen -= problem.gamma * np.outer(problem.up or (), np.tensordot(share, arms, axes=2))
    if problem.pulled:
        seen += np.outer(problem.tip or (), surface.centreline(np.array(1.0)) - pivot)
    if not seen.any():
        return surface
    left, _, right = np.linalg.svd(seen)
    turn = left @ np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))]) @ right
    return dataclasses.replace(surface, points=pivot + arms @ turn.T, directors=surface.directors @ turn.T)
