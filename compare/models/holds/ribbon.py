"""What a ribbon cannot cross, as it is drawn: planes around the strip, nets of obstacles; without a library
of pictures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.models.holds.bodies import net
from compare.models.holds.planes import box, plane_net
from compare.scene.inputs.bodies import Body
from ribbon import Equilibrium, Wall
from ribbon.contact import Barrier
from ribbon.obstacle import Obstacle
from ribbon.solid import Face, Solid

FloatArray = NDArray[np.float64]


def walls(equilibrium: Equilibrium) -> list[tuple[FloatArray, FloatArray]]:
    """A point (3,) in l and the normal (3,) of every plane, a pressure plate where it has moved to."""
    problem: Any = equilibrium.problem
    found = []
    held = whole(() if problem.formulation == "chained" else problem.walls)
    heights = [exerted.height for exerted in equilibrium.walls] or [None] * len(held)  # of undetermined forces: none
    for wall, moved in zip(held, heights, strict=True):
        if not isinstance(wall, Wall):
            continue
        normal = np.asarray(wall.normal, dtype=float)
        height = 0.0 if moved is None else moved
        found.append((np.asarray(wall.point) / problem.strip.length + height * normal, normal))
    return found


def obstacles(equilibrium: Equilibrium) -> list[Body]:
    """The obstacles, lengths in l; the planes of a room together are one."""
    problem: Any = equilibrium.problem
    held = () if problem.formulation == "chained" else problem.walls
    return [body_of(wall.scaled(problem.strip.length)) for wall in whole(held) if isinstance(wall, Obstacle)]


def whole(held: Sequence[Barrier]) -> list[Barrier]:
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


def body_of(obstacle: Obstacle) -> Body:
    """A ribbon's obstacle as the geometry of a scene."""
    axis, normal, size, angle = obstacle.axis, None, None, 0.0
    if isinstance(obstacle, Solid):
        normal, size, angle = obstacle.normal, obstacle.size, obstacle.angle or 0.0
    axis, normal, size = (None if v is None else np.asarray(v, dtype=float) for v in (axis, normal, size))
    point = np.asarray(obstacle.point, dtype=float)
    return Body(obstacle.kind, point, obstacle.radius, axis, normal, size, angle, obstacle.inside)


def nets(equilibrium: Equilibrium, points: FloatArray) -> list[FloatArray]:
    """Every plane and every obstacle, in the order of the solver, as a grid (k, m, 3) in l around the strip's points
    (n, 3)."""
    problem: Any = equilibrium.problem
    held = () if problem.formulation == "chained" else problem.walls
    low, high, _ = box(points)
    flat = iter(walls(equilibrium))
    found = []
    for wall in whole(held):
        if isinstance(wall, Obstacle):
            found.append(net(body_of(wall.scaled(problem.strip.length)), points))
        else:
            found.append(plane_net(*next(flat), low, high))
    return found
