"""From a circle to a band that is joined after half turns: its end, held in a clamp, is turned about the tangent.

The open strip is a circle with both edges clamped at one place; the end's frame turns about t_z by pi n, in steps of
less than a radian on a coarse mesh (thesis, algorithm 2, without its small twist: a turned end leaves no symmetry).
Where it ends, the nodes of both edges are where the seam wants them: the clamps go, and the band settles.

A shell passes through itself. An end that is turned by more than half a turn finds ways past the twist (the band of
three half turns ends as one of one half turn of the other hand), so there the beginning is the twisted circle,

    phi = c(S) + v a_x(S) ,  d = a_y(S) ,  a_x, a_y: the circle's normal plane turned by pi n S

whose strains, of order (pi n v)^2, are those of no equilibrium: the shell settles from it by way of thicker ones. Half
turns about n axes map it onto itself, and Newton's iteration keeps them: beyond three half turns it ends at a saddle,
which is left for nothing (what goes down from there passes through itself and has fewer).
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from shellref.shell.clamps import rotation
from shellref.shell.midsurface import natural_strip
from shellref.shell.problem import Matrix, Pose, ShellProblem, Waypoint
from shellref.shell.strip import lifted, strip_grid
from shellref.shell.surface import ShellSurface

#: Largest turn (radians) of the end on one leg of its way.
MOST_TURN = 1.0
#: Elements along and across of the open strip, at most, and at least where the band has them.
MOST, LEAST = (50, 8), (50, 4)


def opened(problem: ShellProblem) -> ShellProblem:
    """The open strip whose end is turned by the band's half turns, without its weight, on a coarse mesh."""
    angle = math.pi * (problem.half_turns or 0)
    frame = np.array(problem.clamp_frame)
    legs = max(1, math.ceil(abs(angle) / MOST_TURN))
    ends = [
        Pose(problem.clamp_position, _matrix(rotation(angle * k / legs * frame[:, 2]) @ frame)) for k in range(legs + 1)
    ]
    along, across = (
        min(own, max(least, min(own // 2, most)))
        for own, least, most in zip(problem.elements, LEAST, MOST, strict=True)
    )
    return dataclasses.replace(
        problem, half_turns=None, clamp="edge", end=ends[-1], gamma=0.0, walls=(), obstacles=(), apart=None,
        elements=(along, across), grading=(1.0, problem.grading[1]),
        path=(Waypoint(natural=1.0, name="natural"), *(Waypoint(end=end, name="turn") for end in ends[1:])),
    )  # fmt: skip


def laid(problem: ShellProblem, surface: ShellSurface) -> ShellSurface:
    """The surface brought onto the wall that carries the band; as it is where something else holds it."""
    path = lifted(problem, surface.points.reshape(-1, 3), surface.directors.reshape(-1, 3))
    return dataclasses.replace(surface, points=surface.points + path)


def _matrix(frame: np.ndarray) -> Matrix:
    return tuple(map(tuple, frame.tolist()))  # type: ignore[return-value]


def twisted(problem: ShellProblem) -> ShellSurface:
    """The twisted circle of a band."""
    grid = strip_grid(problem)
    s, v = (x.ravel() for x in np.meshgrid(grid.s_nodes, grid.v_nodes, indexing="ij"))
    curvature = problem.start_curvature or 0.0
    frame = np.array(problem.clamp_frame)
    centre, normal = natural_strip(s, 0.0 * v, np.array(problem.clamp_position), frame, (curvature, curvature))
    across, angle = frame[:, 0], math.pi * (problem.half_turns or 0) * s[:, None]
    points = centre + v[:, None] * (np.cos(angle) * across + np.sin(angle) * normal)
    directors = np.cos(angle) * normal - np.sin(angle) * across
    shape = (len(grid.s_nodes), len(grid.v_nodes), 3)
    return ShellSurface(grid.s_nodes, grid.v_nodes, points.reshape(shape), directors.reshape(shape), grid.degree)
