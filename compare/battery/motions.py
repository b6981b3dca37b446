"""Scenes in another unit, of another stiffness, elsewhere, mirrored, end for end; and states compared across them.

A scene is moved key by key, by the kind and the unit that each key declares, so that any model's scenes can be moved.
With reflections Q (det Q = -1) held frames keep t_y and t_z, t_x = t_y x t_z turns over: omega stays, eta changes its
sign. End for end t_z and t_x turn over; omega and eta keep their signs, in reversed order.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.battery.case import Check, holds
from compare.models.base import Force, State
from compare.scene import Scene
from compare.scene.declare import LENGTH, Kind
from compare.scene.inputs.law import is_table
from compare.scene.keys import KEYS, contract_name

FloatArray = NDArray[np.float64]

#: Unit of a key -> powers of (length, stiffness) by which its value scales; with gravity as it is.
_POWERS: Mapping[str, tuple[int, int]] = {
    "m": (1, 0), LENGTH: (1, 0), "1/length": (-1, 0), "Pa": (0, 1), "kg/m^3": (-1, 1), "kg": (2, 1), "m^4": (4, 0),
}  # fmt: skip
#: The same for keys that are in newtons where the scene knows Young's modulus, and else dimensionless.
_IN_NEWTONS: Mapping[str, tuple[int, int]] = {"tip.force": (2, 1), "tip.tension": (2, 1), "tip.moment": (3, 1)}
#: Keys of vectors that are axes of rotation.
_AXES = frozenset({"tip.moment"})
#: Keys that change sign where right is left.
_HANDED = frozenset({"seed.ruling", "closure.twist", "rod.natural_twist", "rod.natural_in_plane"})
#: Sections that move no result.
_APART = ("uncertainty",)

Leaf = Callable[[str, Any], Any]


def _leaves(document: Mapping[str, Any], change: Leaf) -> dict[str, Any]:
    """The dotted keys of a scene's document, walls by number, path whole, each with the value that `change` gives."""
    found: dict[str, Any] = {}

    def walk(table: Mapping[str, Any], prefix: str) -> None:
        for name, value in table.items():
            dotted = f"{prefix}{name}"
            if dotted in _APART or value is None:
                continue
            if dotted == "path":
                found["path"] = [
                    {key: v if key == "steps" else change(contract_name(key), v) for key, v in stage.items()}
                    for stage in value
                ]
            elif dotted == "wall":
                for number, wall in enumerate(value):
                    walk(wall, f"wall.{number}.")
            elif isinstance(value, Mapping):
                walk(value, f"{dotted}.")
            elif contract_name(dotted) in KEYS:
                found[dotted] = change(contract_name(dotted), value)

    walk(document, "")
    return found


def _changed(scene: Scene, change: Leaf) -> Scene:
    """The scene with every key's value replaced by what `change` makes of it, where that is another one."""
    document = scene.canonical()
    old = _leaves(document, lambda key, value: value)
    new = _leaves(document, change)
    return scene.replace({key: value for key, value in new.items() if value != old[key]})


def scaled(scene: Scene, length: float = 1.0, stiffness: float = 1.0) -> Scene:
    """The same dimensionless scene, `length` times as large and, where it is in SI, `stiffness` times as stiff."""
    in_si = scene.strip.young is not None

    def change(key: str, value: Any) -> Any:
        powers = _IN_NEWTONS.get(key, (0, 0)) if in_si else (0, 0)
        powers = _POWERS.get(KEYS[key].unit or "", powers)
        factor = length ** powers[0] * stiffness ** powers[1]
        if factor == 1.0 or isinstance(value, (str, bool)):
            return value
        return (factor * np.asarray(value, dtype=float)).tolist()

    return _changed(scene, change)


def moved(scene: Scene, rotation: FloatArray, shift: FloatArray) -> Scene:
    """The scene turned, or mirrored, by an orthogonal matrix (3, 3), and shifted (3,), in l."""
    sign = float(np.sign(np.linalg.det(rotation)))

    def change(key: str, value: Any) -> Any:
        if key in _HANDED and sign < 0.0:
            return (-np.asarray(value, dtype=float)).tolist()
        if KEYS[key].kind is Kind.POINTS:
            return (np.asarray(value, dtype=float) @ rotation.T + scene.strip.length * shift).tolist()
        if KEYS[key].kind not in (Kind.VECTOR, Kind.DIRECTION) or isinstance(value, str):
            return value
        turned = rotation @ np.asarray(value, dtype=float)
        if key in _AXES or key.endswith(".across"):
            turned = sign * turned
        if KEYS[key].unit == LENGTH:
            turned = turned + scene.strip.length * shift
        return turned.tolist()

    return _changed(scene, change)


def mirrored(scene: Scene) -> Scene:
    """The mirror image in an oblique plane."""
    normal = np.array([2.0, -1.0, 2.0]) / 3.0
    return moved(scene, np.eye(3) - 2.0 * np.outer(normal, normal), np.zeros(3))


def rotation(turn: FloatArray) -> FloatArray:
    """The rotation (3, 3) by a vector (3,), rad."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(turn).as_matrix())


def reversible(scene: Scene) -> bool:
    """Whether the scene can be said end for end: nothing is hung at its end, nothing is a rod's own."""
    return scene.tip is None and scene.rod is None and (scene.closure is None or not scene.closure.twist)


def end_for_end(scene: Scene) -> Scene:
    """The scene with s counted from the other end."""
    swap = {"start": "end", "end": "start"}

    def clamp(value: Mapping[str, Any] | None) -> Any:
        if value is None:
            return None
        turned = ("tangent", "slide")
        return {k: [-x for x in v] if k in turned and isinstance(v, (list, tuple)) else v for k, v in value.items()}

    document = scene.canonical()
    keys: dict[str, Any] = {}
    clamps = document.get("clamp") or {}
    for name, other in swap.items():
        keys[f"clamp.{other}"] = None  # removed first, so that nothing of it is left
        for key, value in (clamp(clamps.get(name)) or {}).items():
            keys[f"clamp.{other}.{key}"] = value
    for key in ("strip.natural_curvature", "seed.curvature", "seed.ruling", "seed.curve"):
        section, _, last = key.partition(".")
        value = (document.get(section) or {}).get(last)
        if isinstance(value, (list, tuple)):
            keys[key] = list(value)[::-1]
    if scene.model.tolerance is None and len(set(scene.model.lengths)) > 1:
        keys["model.element_lengths"] = [scene.strip.length * x for x in scene.model.lengths[::-1]]
    if scene.path:
        keys["path"] = [dict(_backwards(key, value) for key, value in stage.items()) for stage in document["path"]]
    return scene.replace(keys)


def _backwards(key: str, value: Any) -> tuple[str, Any]:
    """A stage's key and value end for end."""
    if key.startswith("clamp."):
        _, end, name = key.split(".")
        if name in ("tangent", "slide") and isinstance(value, (list, tuple)):
            value = [-x for x in value]
        return f"clamp.{'end' if end == 'start' else 'start'}.{name}", value
    kinds = (Kind.LINEAR, Kind.LAW, Kind.PIECEWISE)
    if KEYS.get(key) is not None and KEYS[key].kind in kinds and isinstance(value, list):
        return key, [[value[-1][0] - s, y] for s, y in value[::-1]] if is_table(value) else value[::-1]
    return key, value


@dataclass(frozen=True)
class Alike:
    """How a state's numbers go over into those of the moved scene's: v and s count the other way, ends are swapped.

    either: the mirror image is a state as well, and nothing tells which; energies: elastic ones of all states that the
    scene is known to have; where the answers are two of them, that is all that is asked.
    """

    across: bool = False
    along: bool = False
    either: bool = False
    energies: tuple[float, ...] = ()

    def apart(self, state: State, other: State, bound: float = 1e-9) -> list[Check]:
        """Checks that another state is the same: status, energy, distances between particles, forces, eigenvalue."""
        checks = [holds("the same status", state.word == other.word, f"{state.word}, {other.word}: {other.message}")]
        if state.energy is None or other.energy is None or state.shape is None or other.shape is None:
            return checks
        one, two = state.energy.elastic or 0.0, other.energy.elastic or 0.0
        text = f"{one:.12g}, {two:.12g}"
        if self.energies and abs(one - two) > bound * max(1.0, abs(one)):
            far = max(min(abs(e - known) for known in self.energies) / max(1.0, abs(e)) for e in (one, two))
            return [*checks, Check("elastic energy apart from the known states', relative", far, bound, said=text)]
        checks.append(Check("elastic energy apart, relative", abs(one - two) / max(1.0, abs(one)), bound, said=text))
        s, v = np.linspace(0.0, 1.0, 21), 0.5 * state.width * np.array([-1.0, 0.0, 1.0])
        near, there = state.shape.points(s, v), other.shape.points(s, v)
        there = there[::-1] if self.along else there
        there = there[:, ::-1] if self.across != self.along else there
        hands = (there, there[:, ::-1]) if self.either else (there,)
        apart = min(float(np.abs(_distances(near) - _distances(hand)).max()) for hand in hands)
        checks.append(Check("distances of particles apart (l)", apart, bound))
        forces = [_sizes(state), _sizes(other)]
        if self.along:
            forces[1] = forces[1][::-1]
        for a, b in zip(*forces, strict=True):
            if a is not None and b is not None:
                off = float(np.abs(a - b).max()) / max(1.0, float(a.max()))
                checks.append(Check("forces and moments apart, relative", off, bound, said=f"{a}, {b}"))
        low, least = state.lowest_eigenvalue, other.lowest_eigenvalue
        if (
            low is not None
            and least is not None
            and np.isfinite([low, least]).all()
            and not self.along
            and not state.motions
        ):
            text = f"{low:.10g}, {least:.10g}"
            off = abs(low - least) / max(1.0, abs(low))
            checks.append(Check("lowest eigenvalue apart, relative", off, 100.0 * bound, said=text))
        return checks


def _distances(points: FloatArray) -> FloatArray:
    """Distances (k, k) of all particles (..., 3) from each other: what no motion changes."""
    flat = points.reshape(-1, 3)
    flat = flat - flat.mean(axis=0)
    return np.asarray(np.linalg.norm(flat[:, None] - flat[None], axis=2))


def _sizes(state: State) -> list[FloatArray | None]:
    """|force| and |moment| (2,) at both ends; None where nothing is held or known."""

    def size(found: Force | None) -> FloatArray | None:
        return None if found is None else np.array([np.linalg.norm(found.force), np.linalg.norm(found.moment)])

    return [size(state.supports.start), size(state.supports.end)]
