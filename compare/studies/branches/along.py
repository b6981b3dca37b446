"""The number that a branch is followed over: a key of the scene, one component of it, or its [[path]]."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from compare.scene.change import plain, value_of
from compare.scene.homotopy import Homotopy, between
from compare.scene.keys import KEYS, contract_name
from compare.scene.scene import Scene
from ribbonbench.errors import BadInput

#: The word for the way from the scene's last stage of [[path]] to the scene itself.
PATH = "path"
_COMPONENT = re.compile(r"(.*)\[(\d+)\]")
#: Sections of scenes that say how a strip is solved, and last words of keys that are unit vectors.
HOW, DIRECTIONS = ("model", "seed", "path"), ("tangent", "normal", "up", "slide")
_REMEDY = "choose a number of the strip, its clamps, loads or walls"
#: Scenes kept.
_KEPT = 64


@dataclass(frozen=True)
class Along:
    """key: as given, "clamp.end.position[1]", or "path"; first, last: its values at t = 0 and 1, in the scene's unit;
    way: the scenes between."""

    key: str
    first: float
    last: float
    way: Homotopy = field(repr=False, compare=False)

    @classmethod
    def of(cls, scene: Scene, key: str, first: float | None = None, last: float | None = None) -> Along:
        """What --along, --from and --to ask for. `BadInput` for a key that is none, that the scene does not give as a
        number, that cannot vary continuously, and for a value that the scene cannot have."""
        if key == PATH:
            return _along_path(scene, first, last)
        if first is None or last is None:
            raise BadInput("--along", key, "needs a range", f"give --from and --to, the values of {key}")
        for option, value in (("--from", first), ("--to", last)):
            if not math.isfinite(value):
                raise BadInput(option, value, "is no number", "give a finite one")
        if first == last:
            raise BadInput("--to", last, "is where --from begins: there is no way to go", "give two values")
        way = between(*(placed(scene, "--along", key, value, at) for at, value in (("--from", first), ("--to", last))))
        if way.switched or not way.continuous:
            why = f"cannot vary continuously: {', '.join(way.switched) or 'nothing moves'}"
            raise BadInput("--along", key, why, _REMEDY)
        return cls(key, float(first), float(last), way)

    @property
    def scene_at(self) -> Callable[[float], Scene]:
        """t in [0, 1] -> the scene; ValueError beyond."""
        return lru_cache(maxsize=_KEPT)(self.way)

    def value(self, t: float) -> float:
        """The number at t."""
        return self.first + t * (self.last - self.first)

    @property
    def unit(self) -> str:
        """Its unit in the scene, "" for none or where it is a path's."""
        about = KEYS.get(contract_name(taken_apart(self.key)[0]))
        return "" if about is None else about.unit or ""


def taken_apart(key: str) -> tuple[str, int | None]:
    """A key and which of its components is meant, None: all of it."""
    found = _COMPONENT.fullmatch(key)
    return (found[1], int(found[2])) if found else (key, None)


def number_of(scene: Scene, key: str) -> float:
    """The scene's own value of a key, or of one component of it."""
    whole, component = taken_apart(key)
    now = value_of(scene, whole)
    return float(now if component is None else now[component])


def placed(scene: Scene, option: str, key: str, value: float, at: str | None = None) -> Scene:
    """The scene with a number replaced, a key or one component of it. `BadInput`, of the option, for a key that is
    none, and, of the option `at` where there is one, for a value that cannot be."""
    whole, component = taken_apart(key)
    if contract_name(whole) not in KEYS and not whole.startswith("wall."):
        counted = "; components are counted from 0" if "[" in whole else ""
        raise BadInput(option, key, "is not a known key", f"ribbonbench keys lists them all{counted}")
    if whole.split(".")[0] in HOW:
        raise BadInput(option, key, "is how the strip is solved, and moves no equilibrium", _REMEDY)
    try:
        return scene.replace({whole: _with(scene, option, key, whole, component, value)})
    except BadInput as error:
        if error.key == option:
            raise
        remedy = "choose another range"
        if whole.rpartition(".")[2] in DIRECTIONS:
            remedy = (
                "turn it by the last stage of a [[path]], and give --along path: one component alone is no direction"
            )
        raise BadInput(at or option, value, f"cannot be: {error}", remedy) from None


def _with(scene: Scene, option: str, key: str, whole: str, component: int | None, value: float) -> Any:
    """The value of the whole key with the component replaced."""
    now = value_of(scene, whole)
    if component is None:
        if isinstance(now, list):
            if all(isinstance(part, int | float) for part in now) and len(set(now)) == 1 and len(now) == 2:
                return value  # a law that is constant
            raise BadInput(option, key, f"has {len(now)} components", f"name one of them, e.g. {whole}[{len(now) - 1}]")
        if now is not None and (isinstance(now, bool) or not isinstance(now, int | float)):
            raise BadInput(option, key, f"is {now!r}, no number", "choose a key with a number")
        return value
    if now is None:
        raise BadInput(option, key, f"has no value: the scene gives no {whole}", f"give {whole} in the scene")
    if not isinstance(now, list):
        raise BadInput(option, key, "has no components", f"name it without them, as {whole}")
    if not component < len(now):
        raise BadInput(option, key, f"has {len(now)} components", f"they are counted from 0 to {len(now) - 1}")
    changed = [*plain(now)]
    changed[component] = value
    return changed


def _along_path(scene: Scene, first: float | None, last: float | None) -> Along:
    if not scene.path:
        raise BadInput("--along", PATH, "is asked for, and the scene has none", "add a [[path]], or name a key")
    if first is not None or last is not None:
        option = "--from" if first is not None else "--to"
        raise BadInput(option, first if first is not None else last, "goes with a key", "a path goes from 0 to 1")
    *_, stage, end = scene.stages()
    way = between(stage, end)
    if way.switched or not way.continuous:
        why = f"cannot be gone continuously in its last stage: {', '.join(way.switched) or 'nothing moves'}"
        raise BadInput("--along", PATH, why, "leave what switches to an earlier stage")
    return Along(PATH, 0.0, 1.0, way)
