"""What holds the strip, as a scene gives it: clamps, closure and walls, each checked on its own.

How they go together with each other and with the strip is checked by `compare.scene.check`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from compare.scene import keys as contract
from compare.scene.inputs import bodies
from compare.scene.spec import ClampSpec, ClosureSpec, ObstacleSpec, Vector, WallSpec
from compare.scene.table import UNIT_TOLERANCE, Table, missing, reject_unknown, show
from ribbonbench.errors import BadInput

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
"""A wall's name: usable in a dotted key, and never an index."""


def read_clamp(table: Table) -> ClampSpec:
    """`[clamp.start]` or `[clamp.end]`."""
    clamp = table.read(ClampSpec)
    if "frame" in table:
        if table.data["frame"] != contract.FREE:
            raise table.bad("frame", 'is not "free"', 'give frame = "free", or tangent and normal to hold it')
        for name in ("tangent", "normal", "across"):
            if name in table:
                raise table.bad(name, f'conflicts with {table.dotted("frame")} = "free"', f"remove {name} or frame")
    if clamp.tangent is not None or clamp.normal is not None:
        _check_axes(table, clamp.tangent, clamp.normal)
    elif "across" in table:
        raise table.bad(
            "across", "has no tangent and normal to be checked against", "add tangent and normal, or remove it"
        )
    elif "ruling" not in table:
        clamp = replace(clamp, ruling="free")  # a point that is held says nothing about the edge through it
    if clamp.position is None and clamp.tangent is None and clamp.ruling == "free":
        raise BadInput(
            table.path,
            None,
            "holds nothing: position, frame and ruling are free",
            f"give position, tangent and normal, or remove [{table.path}]: the end is then free",
        )
    if clamp.slide is not None and clamp.position is None:
        raise table.bad("slide", "has no meaning where the position is free", "remove it, or give position")
    return clamp


def _check_axes(table: Table, tangent: Vector | None, normal: Vector | None) -> None:
    """Tangent and normal are both there and orthogonal to each other."""
    if tangent is None or normal is None:
        name, other = ("tangent", "normal") if tangent is None else ("normal", "tangent")
        about = table.keys[table.dotted(name)]
        raise missing(
            table.dotted(name),
            table.keys,
            f"add e.g. {name} = {about.example} ({about.meaning}), or remove {other} too: the frame is then free",
        )
    product = _dot(tangent, normal)
    if abs(product) > UNIT_TOLERANCE:
        across = tuple(n - product * t for n, t in zip(normal, tangent, strict=True))
        norm = math.sqrt(_dot(across, across))
        remedy = (
            f"the part of it orthogonal to the tangent is {show(tuple(c / norm for c in across))}"
            if norm > 1e-6
            else "give a unit vector orthogonal to the tangent"
        )
        raise table.bad(
            "normal", f"is not orthogonal to {table.dotted('tangent')} (their product is {product:.6g})", remedy
        )
    if "across" in table:
        _check_handedness(table, tangent, normal)


def _check_handedness(table: Table, tangent: Vector, normal: Vector) -> None:
    """t_x, when given, must be t_y x t_z."""
    across = table.value("across")
    expected = cross(normal, tangent)
    if math.dist(across, expected) <= 4.0 * UNIT_TOLERANCE:
        return
    mirrored = math.dist(across, tuple(-c for c in expected)) <= 4.0 * UNIT_TOLERANCE
    problem = "makes the frame left-handed" if mirrored else "is not t_x = t_y x t_z"
    raise table.bad("across", problem, f"give {show(expected)} or leave it out: it follows from normal x tangent")


def read_closure(table: Table) -> ClosureSpec:
    """`[closure]`."""
    closure = table.read(ClosureSpec)
    if "turns" in table and closure.kind != "circle":
        raise table.bad(
            "turns", f'has no meaning for closure.kind = "{closure.kind}"', "remove it: only a circle has turns"
        )
    if "twist" in table and closure.kind != "circle":
        raise table.bad("twist", f'has no meaning for closure.kind = "{closure.kind}"', "remove it, or close a circle")
    if closure.half_turns is not None:
        odd, other = closure.half_turns % 2 == 1, {"moebius": "circle", "circle": "moebius"}[closure.kind]
        if odd != (closure.kind == "moebius"):
            raise table.bad(
                "half_turns", f'{closure.half_turns} contradicts closure.kind = "{closure.kind}", whose half turns are '
                f"{'odd' if closure.kind == 'moebius' else 'even'}", f'give another number, or kind = "{other}"',
            )  # fmt: skip
        if closure.turns > 1:
            raise table.bad("half_turns", "turns a circle of several turns", "remove turns or half_turns")
    return closure


def read_walls(data: Any) -> tuple[WallSpec, ...]:
    """`[[wall]]`: `data` is what stands at `wall`."""
    if not isinstance(data, list) or not all(isinstance(entry, Mapping) for entry in data):
        raise BadInput(
            "wall", None, "is not an array of tables", "write every wall as a section [[wall]] in double brackets"
        )
    walls: list[WallSpec] = []
    for index, entry in enumerate(data):
        wall = _numbered(entry, "wall", index).read(WallSpec)
        _check_name("wall", index, wall.name, [other.name for other in walls], 'name = "roof"')
        walls.append(wall)
    return tuple(walls)


def read_obstacles(data: Any, walls: Sequence[WallSpec]) -> tuple[ObstacleSpec, ...]:
    """`[[obstacle]]`: `data` is what stands at `obstacle`; walls: the scene's, which have names too."""
    if not isinstance(data, list) or not all(isinstance(entry, Mapping) for entry in data):
        raise BadInput(
            "obstacle", None, "is not an array of tables",
            "write every obstacle as a section [[obstacle]] in double brackets",
        )  # fmt: skip
    obstacles: list[ObstacleSpec] = []
    for index, entry in enumerate(data):
        table = _numbered(entry, "obstacle", index)
        obstacle = table.read(ObstacleSpec)
        bodies.check_keys(f"obstacle.{index}", obstacle)
        names = [other.name for other in walls] + [other.name for other in obstacles]
        _check_name("obstacle", index, obstacle.name, names, 'name = "tube"')
        obstacles.append(obstacle)
    return tuple(obstacles)


def _numbered(data: Mapping[str, Any], section: str, index: int) -> Table:
    """The table of entry `index` of a section that a scene may have several of, its keys known."""
    path = f"{section}.{index}"
    keys = {f"{path}.{about.field}": about for name, about in contract.KEYS.items() if name.startswith(f"{section}.")}
    reject_unknown(data, path, keys)
    return Table(data, path, keys)


def _check_name(section: str, index: int, name: str | None, others: list[str | None], example: str) -> None:
    if name is None:
        return
    key = f"{section}.{index}.name"
    if not NAME.fullmatch(name):
        raise BadInput(key, name, "is not a name", f"give letters, digits and _, the first no digit, e.g. {example}")
    if name in others:
        earlier = "wall" if section == "wall" else "wall or obstacle"
        raise BadInput(key, name, f"is the name of an earlier {earlier} too",
                       f"give every {section} its own name")  # fmt: skip


def _dot(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    return math.fsum(x * y for x, y in zip(a, b, strict=True))


def cross(a: Vector, b: Vector) -> Vector:
    """a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
