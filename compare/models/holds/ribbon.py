"""What a ribbon cannot cross, as it is drawn: planes around the strip, nets of obstacles; without a library
of pictures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.models.holds.planes import box, plane_net
from ribbon import Equilibrium, Wall
from ribbon.contact import Barrier
from ribbon.obstacle import Obstacle
from ribbon.solid import Face, Solid

FloatArray = NDArray[np.float64]

#: Points round an obstacle.
ROUND = 49


def walls(equilibrium: Equilibrium) -> list[tuple[FloatArray, FloatArray]]:
    """A point (3,) in l and the normal (3,) of every plane, a pressure plate where it has moved to."""
    problem: Any = equilibrium.problem
    found = []
    held = _whole(() if problem.formulation == "chained" else problem.walls)
    heights = [exerted.height for exerted in equilibrium.walls] or [None] * len(held)  # of undetermined forces: none
    for wall, moved in zip(held, heights, strict=True):
        if not isinstance(wall, Wall):
            continue
        normal = np.asarray(wall.normal, dtype=float)
        height = 0.0 if moved is None else moved
        found.append((np.asarray(wall.point) / problem.strip.length + height * normal, normal))
    return found


def obstacles(equilibrium: Equilibrium) -> list[Obstacle]:
    """The obstacles, lengths in l; the planes of a room together are one."""
    problem: Any = equilibrium.problem
    held = () if problem.formulation == "chained" else problem.walls
    return [wall.scaled(problem.strip.length) for wall in _whole(held) if isinstance(wall, Obstacle)]


def _whole(held: Sequence[Barrier]) -> list[Barrier]:
    """What a strip cannot cross, a room in the place of its planes."""
    found: list[Barrier] = []
    rooms = set()
    for wall in held:
        if not isinstance(wall, Face):
            found.append(wall)
        elif wall.room not in rooms and wall.body is not None:
            rooms.add(wall.room)
            found.append(wall.body)
    return found


def reach(obstacle: Obstacle) -> float:
    """How far an obstacle reaches from its point, across its axis where that has no end; infinite of an edge."""
    if not isinstance(obstacle, Solid):
        return obstacle.radius
    return np.inf if obstacle.size is None else 0.5 * float(np.linalg.norm(obstacle.size))


def _box_grid(box: Solid) -> FloatArray:
    """Four loops (4, 5, 3) of a box: the middle of one face, its corners, those of the opposite face, its middle."""
    half = 0.5 * np.asarray(box.size)
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])
    loops = [np.column_stack([part * corners, np.full(5, side)]) for side, part in ((-1, 0), (-1, 1), (1, 1), (1, 0))]
    return _onto(box, np.asarray(box.point) + (half * np.array(loops)) @ box.frame)


def _edge_grid(edge: Solid, low: FloatArray, high: FloatArray) -> FloatArray:
    """Lines (3, 2, 3) of an edge: on one face, the edge, on the other face, beside the box from `low` to `high`."""
    middle, far = 0.5 * (low + high), float(np.linalg.norm(high - low))
    one, two = edge.normals
    ways = np.array([(one @ two) * one - two, np.zeros(3), (one @ two) * two - one])
    ways[[0, 2]] /= np.linalg.norm(ways[[0, 2]], axis=1)[:, None]
    along = float((middle - np.asarray(edge.point)) @ edge.frame[0]) + 0.5 * far * np.array([-1.0, 1.0])
    return _onto(edge, np.asarray(edge.point) + far * ways[:, None] + along[:, None] * edge.frame[0])


def _onto(body: Solid, grid: FloatArray) -> FloatArray:
    """Points of a grid (n, m, 3) on a body's surface: nearest to those given, which are outside it or on a room."""
    if body.inside:
        return grid
    gaps, normals, _ = body.derivatives(grid.reshape(-1, 3))
    return np.asarray(grid - (gaps[:, None] * normals).reshape(grid.shape))


def round_grid(obstacle: Obstacle, low: FloatArray, high: FloatArray) -> FloatArray:
    """Points (rows, columns, 3) of an obstacle: all of a sphere or a box, of a cylinder or an edge what is along the
    box from `low` to `high` (3,)."""
    if isinstance(obstacle, Solid):
        return _box_grid(obstacle) if obstacle.kind == "box" else _edge_grid(obstacle, low, high)
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


def net(obstacle: Obstacle, points: FloatArray) -> FloatArray:
    """An obstacle as a grid (k, m, 3) around the strip's points (n, 3), lengths in l."""
    extent = box(points)[2]
    if not isinstance(obstacle, Solid) and obstacle.radius > extent:
        return patch(obstacle, points)
    return round_grid(obstacle, points.min(axis=0), points.max(axis=0))


def nets(equilibrium: Equilibrium, points: FloatArray) -> list[FloatArray]:
    """Every plane and every obstacle, in the order of the solver, as a grid (k, m, 3) in l around the strip's points
    (n, 3)."""
    problem: Any = equilibrium.problem
    held = () if problem.formulation == "chained" else problem.walls
    low, high, _ = box(points)
    flat = iter(walls(equilibrium))
    found = []
    for wall in _whole(held):
        if isinstance(wall, Obstacle):
            found.append(net(wall.scaled(problem.strip.length), points))
        else:
            found.append(plane_net(*next(flat), low, high))
    return found
