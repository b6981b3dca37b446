"""Friction of walls and obstacles: when the ribbon has it, and what is told of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from compare.scene.check import obstacle_name, wall_name
from compare.scene.scene import Scene
from ribbon import Equilibrium
from ribbonbench.errors import BadInput


def _coefficients(scene: Scene) -> Iterator[tuple[str, float]]:
    """Key and value of every friction that is not zero."""
    for index, wall in enumerate(scene.walls):
        if wall.friction:
            yield f"{wall_name(index, wall)}.friction", wall.friction
    for index, obstacle in enumerate(scene.obstacles):
        if obstacle.friction:
            yield f"{obstacle_name(index, obstacle)}.friction", obstacle.friction


def rubs(scene: Scene) -> bool:
    """Whether something in the scene, or in a stage of its path, has friction."""
    if any(True for _ in _coefficients(scene)):
        return True
    return any(name.endswith(".friction") and value for stage in scene.path for name, value in stage.items())


def without_way(scene: Scene, has_path: bool) -> BadInput | None:
    """Why friction of a scene cannot act: no path leads to it, or it is of edges; None: it can, or there is none."""
    key, value = next(_coefficients(scene), ("path", None))
    if value and not has_path:
        return BadInput(
            key, value, "needs a [[path]]: how a strip that rubs lies depends on the way there, and without one "
            "every state within mu N is an equilibrium",
            "add [[path]] stages that lead to the scene from elsewhere, or leave friction out",
        )  # fmt: skip
    for index, obstacle in enumerate(scene.obstacles):
        if obstacle.friction and obstacle.kind in ("box", "edge"):
            name = obstacle_name(index, obstacle)
            return BadInput(
                f"{name}.friction", obstacle.friction, f'is of an obstacle of kind = "{obstacle.kind}", whose edges '
                "have no one direction along them", "leave it out; walls, cylinders and spheres may have friction",
            )  # fmt: skip
    return None


def several_refused(scenes: Sequence[Scene]) -> BadInput | None:
    """Why several strips with friction are not computed; scenes: the first strip's in every stage of their path that
    is not the scene, then in the scene. None: they are, or have none."""
    for scene in scenes:
        refusal = without_way(scene, len(scenes) > 1)
        if refusal is not None:
            return refusal
    return None


def refused(scene: Scene) -> BadInput | None:
    """Why a scene with friction is not for the ribbon; None: it is, or it has none."""
    if not rubs(scene):
        return None
    key, value = next(_coefficients(scene), ("path", None))
    refusal = without_way(scene, bool(scene.path))
    if refusal is not None:
        return refusal
    if scene.model.tolerance is not None:
        return BadInput(
            "model.tolerance", scene.model.tolerance, "places elements at the end of a path, and with friction the "
            "state depends on those along it", "give model.elements, e.g. 40",
        )  # fmt: skip
    if scene.apart is not None:
        return BadInput(
            key, value, "and contact.itself are not known together: parts that touch have no friction between them",
            "leave one of the two out; of a scene of [[strip]], of one too, parts rub on each other",
        )  # fmt: skip
    if scene.closure is not None:
        return BadInput(key, value, "is of a strip with ends, and this one is closed", "leave friction or closure out")
    if scene.model.formulation not in ("auto", "mixed"):
        return BadInput(
            "model.formulation", scene.model.formulation, "knows no friction", 'leave it out, or "mixed"'
        )  # fmt: skip
    return None


def entry(wall: Any) -> dict[str, Any]:
    """What a wall's entry of result.json holds of friction; empty without."""
    if wall.friction is None:
        return {}
    return {
        "friction": wall.friction,
        "rubs": [
            {
                "s": rub.s, "v": rub.v, "point": rub.point, "push": rub.push, "friction": rub.friction,
                "slip": rub.slip, "state": "slips" if rub.slips else "sticks",
            }
            for rub in wall.rubs
        ],
    }  # fmt: skip


def along(e: Equilibrium) -> dict[str, Any]:
    """What the log of a way holds of friction at an accepted step: each wall's (None: it touches nothing there), and
    what it took away so far, in D w / l; empty without."""
    if e.rubbed is None:
        return {}
    each = [None if wall.friction is None else np.asarray(wall.friction).tolist() for wall in e.walls]
    return {"friction": {"walls": each, "lost": float(e.rubbed)}}
