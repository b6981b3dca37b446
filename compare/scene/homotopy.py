"""From one scene to another in small steps: what varies continuously is interpolated, the rest switches at once.

A path (`Scene.stages`) is a chain of such ways; the continuation walks along each of them and decides the steps.

Numbers, positions and walls' points are interpolated linearly in t; held frames by the shortest rotation,
F(t) = F(0) exp(t log(F(0)^T F(1))), and the directions `gravity.up` and `wall.N.normal` along their great circle.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.scene.check import obstacle_name, wall_name
from compare.scene.data import unit
from compare.scene.inputs.bodies import Body
from compare.scene.scene import Scene
from ribbonbench.errors import BadInput

HALF_TURN = 1e-9
"""How close, in radians, two directions or frames may come to a half turn, where the shortest way is not unique."""

SAME = 1e-12
"""Angle in radians below which two directions or frames count as the same."""

SAME_DIGITS = 12
"""Decimals to which element lengths, as fractions of the length, are compared."""

Move = Callable[[float], dict[str, Any]]
"""From t, 0 < t < 1, to the dotted keys that vary and their values."""

REMEDY = "add a [[path]] stage in between that says which way round"


@dataclass(frozen=True)
class Homotopy:
    """The way from `first` (t = 0) to `last` (t = 1), both exact; see `between`.

    `switched`: dotted keys and sections that cannot be interpolated and have the value of `last` for every t > 0.
    Seed, shell and title have no bearing on the way and are those of `last`, without being listed.
    """

    first: Scene
    last: Scene
    switched: tuple[str, ...]
    moves: tuple[Move, ...] = field(repr=False)

    @property
    def continuous(self) -> bool:
        """True when something varies continuously; otherwise every t > 0 gives `last`."""
        return bool(self.moves)

    def __call__(self, t: float) -> Scene:
        """The scene at t, 0 <= t <= 1; `BadInput` when the way leads through an impossible one."""
        if not 0.0 <= t <= 1.0:
            raise ValueError(f"t = {t} lies outside 0 <= t <= 1")
        if t == 0.0:
            return self.first
        if t == 1.0 or not self.continuous:
            return self.last
        keys: dict[str, Any] = {"path": None}
        for move in self.moves:
            keys |= move(t)
        try:
            return self.last.replace(keys | self._kept_valid(keys))
        except BadInput as error:
            problem = f"{error.problem} (on the way between two scenes, {t:.3g} of it behind)"
            raise BadInput(error.key, error.value, problem, REMEDY) from None

    def _kept_valid(self, keys: Mapping[str, Any]) -> dict[str, Any]:
        """What follows from a varying length or width: elements in proportion, a seed whose rulings do not cross."""
        strip, model, ruling = self.last.strip, self.last.model, self.last.seed.ruling
        length, width = keys.get("strip.length", strip.length), keys.get("strip.width", strip.width)
        kept: dict[str, Any] = {}
        if model.element_lengths is not None and "strip.length" in keys:
            kept["model.element_lengths"] = [part * length for part in model.lengths]
        steepest = max(abs(after - before) for before, after in pairwise(ruling)) * (len(ruling) - 1)
        if steepest * width >= 2.0 * length:
            kept["seed.ruling"] = None
        return kept


def between(first: Scene, last: Scene) -> Homotopy:
    """The way from `first` to `last`, two scenes that hold the same things; what only one of them holds switches.

    `BadInput` when a frame or a direction turns by half a turn: the way round is then for the user to say.
    """
    moves, switched = moves_between(first, last)
    return Homotopy(first, last, tuple(switched), tuple(moves))


def moves_between(first: Scene, last: Scene) -> tuple[list[Move], list[str]]:
    """What varies from `first` to `last`, and the dotted keys and sections that switch."""
    moves: list[Move] = []
    switched: list[str] = []
    one, other = first.canonical(), last.canonical()
    _numbers("strip", one["strip"], other["strip"], moves, switched)
    _gravity(first, last, moves, switched)
    _tip(first, last, moves, switched)
    for end in ("start", "end"):
        _clamp(f"clamp.{end}", _entry(one, end), _entry(other, end), moves, switched)
        _frame(f"clamp.{end}", getattr(first, f"{end}_frame"), getattr(last, f"{end}_frame"), moves, switched)
    _switch("closure", one.get("closure"), other.get("closure"), switched)
    _walls(first, last, moves, switched)
    _obstacles(first, last, moves, switched)
    _switch("model", _model(first), _model(last), switched)
    return moves, switched


def _model(scene: Scene) -> dict[str, Any]:
    """The keys of [model], with the element lengths as fractions (rounded) of the length, which may vary."""
    model = dict(scene.canonical()["model"])
    if "element_lengths" in model:
        model["element_lengths"] = [round(part, SAME_DIGITS) for part in scene.model.lengths]
    return model


def _entry(document: Mapping[str, Any], end: str) -> Mapping[str, Any] | None:
    return (document["clamp"] or {}).get(end)


def _switch(section: str, one: Mapping[str, Any] | None, other: Mapping[str, Any] | None, switched: list[str]) -> None:
    """Every difference switches: the section as a whole when only one scene has it, else key by key."""
    if one is None or other is None:
        if one is not other:
            switched.append(section)
        return
    switched.extend(f"{section}.{key}" for key in {**one, **other} if one.get(key) != other.get(key))


def _numbers(
    section: str, one: Mapping[str, Any], other: Mapping[str, Any], moves: list[Move], switched: list[str]
) -> None:
    """Numbers, and lists of equally many numbers, vary linearly; other differences switch."""
    for key in {**one, **other}:
        a, b = one.get(key), other.get(key)
        if a == b:
            continue
        start, end = _numeric(a), _numeric(b)
        if start is not None and end is not None and start.shape == end.shape and _same_points(start, end):
            moves.append(_linear(f"{section}.{key}", start, end))
        else:
            switched.append(f"{section}.{key}")


def _same_points(start: NDArray[np.float64], end: NDArray[np.float64]) -> bool:
    """Whether two tables [s, value] have their points at the same s; True for what is no table."""
    return start.ndim < 2 or bool(np.array_equal(start[:, 0], end[:, 0]))


def _numeric(value: Any) -> NDArray[np.float64] | None:
    """A number (shape ()) or a list of numbers (shape (n,)) as an array; None: something else."""
    values = value if isinstance(value, list) else [value]
    if values and all(isinstance(item, list) for item in values):
        return np.array(value, dtype=float)  # the points of a table
    if all(isinstance(item, (int, float)) and not isinstance(item, bool) for item in values):
        return np.array(value, dtype=float)
    return None


def _linear(key: str, start: NDArray[np.float64], end: NDArray[np.float64]) -> Move:
    return lambda t: {key: ((1.0 - t) * start + t * end).tolist()}


def _gravity(first: Scene, last: Scene, moves: list[Move], switched: list[str]) -> None:
    one, other = first.canonical()["gravity"], last.canonical()["gravity"]
    if one is None or other is None or first.up is None or last.up is None:
        _switch("gravity", one, other, switched)
        return
    _direction("gravity.up", first.up, last.up, moves)
    _numbers("gravity", {**one, "up": None}, {**other, "up": None}, moves, switched)


def _tip(first: Scene, last: Scene, moves: list[Move], switched: list[str]) -> None:
    """Loads at the end vary linearly, one that only one scene has from or to zero. They switch where the end's position
    is held in one of them, and a load that hangs where it is said in two ways."""
    one, other = (dict(scene.canonical().get("tip") or {}) for scene in (first, last))
    if first.end_position is not None or last.end_position is not None:
        _switch("tip", one or None, other or None, switched)
        return
    hang = {"mass", "load"} & (set(one) | set(other))
    for key in {**one, **other}:
        if one.get(key) == other.get(key):
            continue
        if key in hang and (len(hang) > 1 or first.gravity is None or last.gravity is None):
            switched.append(f"tip.{key}")
            continue
        none = [0.0, 0.0, 0.0] if key == "force" else 0.0
        moves.append(_linear(f"tip.{key}", np.array(one.get(key, none)), np.array(other.get(key, none))))


def _clamp(
    section: str,
    one: Mapping[str, Any] | None,
    other: Mapping[str, Any] | None,
    moves: list[Move],
    switched: list[str],
) -> None:
    """Position and ruling of a clamp; a clamp that only one scene has switches as a whole."""
    if one is None or other is None:
        _switch(section, one, other, switched)
        return
    kept = ("position", "ruling")
    _numbers(section, {key: one[key] for key in kept}, {key: other[key] for key in kept}, moves, switched)


def _frame(
    section: str,
    one: NDArray[np.float64] | None,
    other: NDArray[np.float64] | None,
    moves: list[Move],
    switched: list[str],
    keys: tuple[str, str] = ("tangent", "normal"),
) -> None:
    """The held frames, 3x3 with columns t_x, t_y, t_z, by the shortest rotation; held in one scene only: a switch."""
    if one is None or other is None:
        if one is not other and section not in switched:
            switched.append(f"{section}.frame")
        return
    from scipy.spatial.transform import Rotation  # not before it is needed: it loads half of scipy

    turn = Rotation.from_matrix(one.T @ other).as_rotvec()
    angle = float(np.linalg.norm(turn))
    if angle < SAME:
        return
    if math.pi - angle < HALF_TURN:
        raise BadInput(
            f"{section}.{keys[0]}",
            other[:, 2].tolist(),
            "makes, with the normal, a half turn from the frame before: there is no shortest way round",
            f'{REMEDY}, e.g. a quarter turn with "{section}.{keys[0]}" and "{section}.{keys[1]}"',
        )

    def move(t: float) -> dict[str, Any]:
        frame = one @ Rotation.from_rotvec(t * turn).as_matrix()
        return {f"{section}.{keys[0]}": frame[:, 2], f"{section}.{keys[1]}": frame[:, 1]}

    moves.append(move)


def _direction(key: str, one: NDArray[np.float64], other: NDArray[np.float64], moves: list[Move]) -> None:
    """Unit vectors, shape (3,), along their great circle."""
    angle = 2.0 * math.atan2(float(np.linalg.norm(one - other)), float(np.linalg.norm(one + other)))
    if angle < SAME:
        return
    if math.pi - angle < HALF_TURN:
        raise BadInput(
            key,
            other.tolist(),
            "is opposite to the direction before: there is no shortest way round",
            f'{REMEDY}, e.g. "{key}" at a right angle to both',
        )
    aside = unit(other - (other @ one) * one)
    moves.append(lambda t: {key: unit(math.cos(t * angle) * one + math.sin(t * angle) * aside)})


def _walls(first: Scene, last: Scene, moves: list[Move], switched: list[str]) -> None:
    if len(first.walls) != len(last.walls):
        switched.append("wall")
        return
    normals = zip(first.wall_normals, last.wall_normals, strict=True)
    for index, (one, other, pair) in enumerate(zip(first.walls, last.walls, normals, strict=True)):
        section = wall_name(index, other)
        _numbers(
            section,
            {"point": list(one.point), "stiffness": one.stiffness, "friction": one.friction},
            {"point": list(other.point), "stiffness": other.stiffness, "friction": other.friction},
            moves,
            switched,
        )
        _direction(f"{section}.normal", *pair, moves)


def _frame_of(body: Body) -> NDArray[np.float64]:
    """A box's or an edge's frame (3, 3), its columns axis x normal turned back, normal and axis as a clamp has them."""
    assert body.axis is not None
    assert body.normal is not None
    return np.column_stack([np.cross(body.normal, body.axis), body.normal, body.axis])


def _obstacles(first: Scene, last: Scene, moves: list[Move], switched: list[str]) -> None:
    kinds = [[(one.kind, one.inside) for one in scene.obstacles] for scene in (first, last)]
    if kinds[0] != kinds[1]:
        switched.append("obstacle")
        return
    for index, (one, other) in enumerate(zip(first.obstacles, last.obstacles, strict=True)):
        section = obstacle_name(index, other)
        before, after = (
            {
                "point": list(each.point),
                "radius": each.radius,
                "size": None if each.size is None else list(each.size),
                "angle": each.angle,
                "rounding": each.rounding,
                "friction": each.friction,
            }
            for each in (one, other)
        )
        _numbers(section, before, after, moves, switched)
        axis, turned = first.obstacle_axes[index], last.obstacle_axes[index]
        body, moved = first.bodies[index], last.bodies[index]
        if body.normal is not None and moved.normal is not None:
            _frame(section, _frame_of(body), _frame_of(moved), moves, switched, ("axis", "normal"))
        elif axis is not None and turned is not None:
            _direction(f"{section}.axis", axis, turned, moves)
