"""What walls and obstacles exert on several strips: on each of them and on all, in l_0 and D_0 w_0 / l_0^2."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.models.ribbon.state import RibbonShape
from compare.scene.strips.scene import StripsScene

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class OnStrip:
    """What a wall exerts on one strip: force (3,), moment (3,) about the origin, where it touches: points (m, 3),
    normals (m, 3) there and pushes (m,), and contacts (k,), abscissae in the strip's own l; rubs: its places with
    friction, `ribbon.forces.RubForce`, s and v in the strip's own l, all else in the units of the first one. Force and
    moment are without friction."""

    name: str
    force: FloatArray
    moment: FloatArray
    points: FloatArray
    normals: FloatArray
    pushes: FloatArray
    contacts: FloatArray
    rubs: tuple[Any, ...] = ()


def walls_of_strip(scene: StripsScene, found: Any, k: int) -> list[OnStrip]:
    """Of strip k of a `ribbon.find.strips.result.StripsEquilibrium`, in the scene's order of walls and obstacles."""
    over, unit = found.problem.lengths_over[k], found.problem.stiffness_over[k]
    strip, first = found.strips[k], scene.first
    shape = RibbonShape(strip)
    bodies = first.bodies
    result = []
    for number, (name, wall) in enumerate(zip(first.barrier_names, strip.walls, strict=True)):
        ends = np.asarray(wall.ends, dtype=float).reshape(-1, 2)
        points = np.array([over * shape.points(end[:1], end[1:])[0, 0] for end in ends]).reshape(-1, 3)
        pushes = unit / over * np.asarray(wall.pushes, dtype=float)
        if number < len(first.walls):
            normals = np.broadcast_to(first.wall_normals[number], points.shape)
        else:
            normals = bodies[number - len(first.walls)].facing(points)[1] if len(points) else points
        force = unit / over * np.asarray(wall.force, dtype=float)
        moment = np.cross(points, pushes[:, None] * normals).sum(axis=0) if wall.moment is None else unit * wall.moment
        rubs = tuple(
            replace(
                rub, point=over * rub.point, push=unit / over * rub.push, friction=unit / over * rub.friction,
                slip=over * rub.slip,
            )
            for rub in wall.rubs or ()
        )  # fmt: skip
        contacts = np.asarray(wall.contacts)
        result.append(OnStrip(name, force, np.asarray(moment), points, normals, pushes, contacts, rubs))
    return result
