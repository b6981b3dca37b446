"""Obstacles as they are drawn: nets of points around a strip, made from a scene's own geometry; without a library of
pictures and without a solver."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from compare.models.holds.planes import box
from compare.scene.inputs.bodies import Body

FloatArray = NDArray[np.float64]

#: Points round an obstacle.
ROUND = 49
#: Kinds with faces.
FLAT = ("box", "edge")


def reach(obstacle: Body) -> float:
    """How far an obstacle reaches from its point, across its axis where that has no end; infinite of an edge."""
    if obstacle.kind not in FLAT:
        return obstacle.radius
    return np.inf if obstacle.size is None else 0.5 * float(np.linalg.norm(obstacle.size))


def _box_grid(cuboid: Body) -> FloatArray:
    """Four loops (4, 5, 3) of a box: the middle of one face, its corners, those of the opposite face, its middle."""
    half = 0.5 * np.asarray(cuboid.size)
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])
    loops = [np.column_stack([part * corners, np.full(5, side)]) for side, part in ((-1, 0), (-1, 1), (1, 1), (1, 0))]
    return _onto(cuboid, cuboid.point + (half * np.array(loops)) @ cuboid.faces[0][:3])


def _edge_grid(edge: Body, low: FloatArray, high: FloatArray) -> FloatArray:
    """Lines (3, 2, 3) of an edge: on one face, the edge, on the other face, beside the box from `low` to `high`."""
    middle, far = 0.5 * (low + high), float(np.linalg.norm(high - low))
    assert edge.axis is not None
    one, two = edge.faces[0]
    ways = np.array([(one @ two) * one - two, np.zeros(3), (one @ two) * two - one])
    ways[[0, 2]] /= np.linalg.norm(ways[[0, 2]], axis=1)[:, None]
    along = float((middle - edge.point) @ edge.axis) + 0.5 * far * np.array([-1.0, 1.0])
    return _onto(edge, edge.point + far * ways[:, None] + along[:, None] * edge.axis)


def _onto(body: Body, grid: FloatArray) -> FloatArray:
    """Points of a grid (n, m, 3) on a body's surface: nearest to those given, which are outside it or on a room."""
    if body.inside:
        return grid
    gaps, normals = body.facing(grid.reshape(-1, 3))
    return np.asarray(grid - (gaps[:, None] * normals).reshape(grid.shape))


def round_grid(obstacle: Body, low: FloatArray, high: FloatArray) -> FloatArray:
    """Points (rows, columns, 3) of an obstacle: all of a sphere or a box, of a cylinder or an edge what is along the
    box from `low` to `high` (3,)."""
    if obstacle.kind in FLAT:
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


def patch(obstacle: Body, points: FloatArray) -> FloatArray:
    """Points (`ROUND`, `ROUND`, 3) of what is beside the strip's points (n, 3) of an obstacle larger than it."""
    middle = points.mean(axis=0)
    reach = 1.2 * float(np.linalg.norm(points - middle, axis=1).max())
    normal = obstacle.facing(middle[None])[1][0] * (
        -1.0 if obstacle.inside else 1.0
    )  # away from the centre or the axis
    first = np.eye(3)[np.argmin(np.abs(normal))] if obstacle.axis is None else np.asarray(obstacle.axis)
    first = first - (first @ normal) * normal
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)
    steps = np.linspace(-reach, reach, ROUND)
    u = steps[:, None, None] * first + steps[None, :, None] * second + middle
    grid = u.reshape(-1, 3)
    gaps, normals = obstacle.facing(grid)
    return np.asarray((grid - gaps[:, None] * normals).reshape(ROUND, ROUND, 3))


def net(obstacle: Body, points: FloatArray) -> FloatArray:
    """An obstacle as a grid (k, m, 3) around the strip's points (n, 3), lengths in l."""
    extent = box(points)[2]
    if obstacle.kind not in FLAT and obstacle.radius > extent:
        return patch(obstacle, points)
    return round_grid(obstacle, points.min(axis=0), points.max(axis=0))
