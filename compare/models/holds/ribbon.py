"""What a ribbon cannot cross, as it is drawn: planes around the strip, nets of cylinders and spheres; without a library
of pictures."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.models.holds.planes import box, plane_net
from ribbon import Equilibrium, Wall
from ribbon.obstacle import Obstacle

FloatArray = NDArray[np.float64]

#: Points round an obstacle.
ROUND = 49


def walls(equilibrium: Equilibrium) -> list[tuple[FloatArray, FloatArray]]:
    """A point (3,) in l and the normal (3,) of every plane, a pressure plate where it has moved to."""
    problem: Any = equilibrium.problem
    found = []
    held = () if problem.formulation == "chained" else problem.walls
    heights = [exerted.height for exerted in equilibrium.walls] or [None] * len(held)  # of undetermined forces: none
    for wall, moved in zip(held, heights, strict=True):
        if not isinstance(wall, Wall):
            continue
        normal = np.asarray(wall.normal, dtype=float)
        height = 0.0 if moved is None else moved
        found.append((np.asarray(wall.point) / problem.strip.length + height * normal, normal))
    return found


def obstacles(equilibrium: Equilibrium) -> list[Obstacle]:
    """The round obstacles, lengths in l."""
    problem: Any = equilibrium.problem
    held = () if problem.formulation == "chained" else problem.walls
    return [wall.scaled(problem.strip.length) for wall in held if isinstance(wall, Obstacle)]


def round_grid(obstacle: Obstacle, low: FloatArray, high: FloatArray) -> FloatArray:
    """Points (rows, columns, 3) of an obstacle: all of a sphere, of a cylinder what is along the box from `low` to
    `high` (3,)."""
    centre, turns = np.asarray(obstacle.point), np.linspace(0.0, 2.0 * np.pi, ROUND)
    if obstacle.axis is None:
        heights = np.linspace(0.0, np.pi, ROUND // 2)[:, None]
        directions = [np.sin(heights) * np.cos(turns), np.sin(heights) * np.sin(turns), np.cos(heights) + 0.0 * turns]
        return np.asarray(centre + obstacle.radius * np.stack(directions, axis=-1))
    axis = np.asarray(obstacle.axis)
    first = np.linalg.svd(axis[None, :])[2][1]
    second = np.cross(axis, first)
    corners = np.array([[low[0], low[1], low[2]], [high[0], high[1], high[2]]])
    middle, reach = corners.mean(axis=0), 0.5 * float(np.linalg.norm(corners[1] - corners[0]))
    along = float((middle - centre) @ axis) + np.array([-reach, reach])
    circle = np.cos(turns)[:, None] * first + np.sin(turns)[:, None] * second
    return np.asarray(centre + along[:, None, None] * axis + obstacle.radius * circle)


def patch(obstacle: Obstacle, points: FloatArray) -> FloatArray:
    """Points (`ROUND`, `ROUND`, 3) of what is beside the strip's points (n, 3) of an obstacle larger than it."""
    middle = points.mean(axis=0)
    reach = 1.2 * float(np.linalg.norm(points - middle, axis=1).max())
    normal = obstacle.derivatives(middle[None])[1][0] * obstacle.sign  # away from the centre or the axis
    first = np.eye(3)[np.argmin(np.abs(normal))] if obstacle.axis is None else np.asarray(obstacle.axis)
    first = first - (first @ normal) * normal
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)
    steps = np.linspace(-reach, reach, ROUND)
    u = steps[:, None, None] * first + steps[None, :, None] * second + middle
    grid = u.reshape(-1, 3)
    gaps, normals, _ = obstacle.derivatives(grid)
    return np.asarray((grid - gaps[:, None] * normals).reshape(ROUND, ROUND, 3))


def nets(equilibrium: Equilibrium, points: FloatArray) -> list[FloatArray]:
    """Every plane and every obstacle, in the order of the solver, as a grid (k, m, 3) in l around the strip's points
    (n, 3)."""
    problem: Any = equilibrium.problem
    held = () if problem.formulation == "chained" else problem.walls
    low, high, extent = box(points)
    flat = iter(walls(equilibrium))
    found = []
    for wall in held:
        if isinstance(wall, Obstacle):
            own = wall.scaled(problem.strip.length)
            near = own.radius > extent
            found.append(patch(own, points) if near else round_grid(own, points.min(axis=0), points.max(axis=0)))
        else:
            found.append(plane_net(*next(flat), low, high))
    return found
