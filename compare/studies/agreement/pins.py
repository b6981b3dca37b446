"""Pins: what one claims about ribbon and shell of a scene, written as [[agreement]] in a TOML file, strictly read."""

from __future__ import annotations

import math
import os
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from compare.models.scope import require_shell
from compare.scene.scene import Scene, load, shipped
from ribbonbench.errors import BadInput

SHIPPED = Path(__file__).parents[1] / "agreements.toml"
"""The pins of the shipped scenes."""

#: Key of an [[agreement]] -> what it is.
KEYS = {
    "scene": "name of a shipped scene, or path of a TOML file from the folder of the pins",
    "distance": "largest Hausdorff distance between the surfaces, over l",
    "share": "largest membrane share of the shell's elastic energy, 0 to 1",
    "slope": "[lowest, highest] slope of log(distance) against log(h/w)",
    "width_to_thickness": "w/h of the shells, a number or several; absent: the scene's own",
    "set": "table of the scene's keys that are replaced",
    "leave_saddle": "true: saddles are left, false: they are not; absent: a ribbon without a path leaves one",
    "validate": "true: long, checked by `make validate` only",
}


@dataclass(frozen=True)
class Pin:
    """A claim: the scene with its keys replaced, and bounds of which one at least is given.

    distance: over l; share: of the elastic energy; slope: lowest and highest; keys: those replaced, for the record.
    """

    scene: Scene
    distance: float | None = None
    share: float | None = None
    slope: tuple[float, float] | None = None
    keys: tuple[tuple[str, Any], ...] = ()
    leave_saddle: bool | None = None
    validate: bool = False

    @classmethod
    def of(
        cls,
        scene: Scene,
        distance: Any = None,
        share: Any = None,
        slope: Any = None,
        width_to_thickness: Sequence[float] | None = None,
        keys: Mapping[str, Any] | None = None,
        leave_saddle: bool | None = None,
        validate: bool = False,
        where: str = "",
    ) -> Pin:
        """The pin, checked; `BadInput` names what cannot be claimed (`where`: prefix of the keys)."""
        changes = {"shell.width_to_thickness": list(width_to_thickness)} if width_to_thickness is not None else {}
        for key in keys or {}:
            if key in changes:
                raise BadInput(f"{where}set", key, "is given as width_to_thickness too", "give one of them")
        changes.update(keys or {})
        if changes:
            scene = scene.replace(changes)
        ratios = require_shell(scene)
        bounds = None if slope is None else _pair(f"{where}slope", slope)
        if distance is None and share is None and slope is None:
            raise BadInput(f"{where}distance", None, "is missing: nothing is claimed", "give distance, share or slope")
        if bounds is not None and len(ratios) < 2:
            raise BadInput(
                f"{where}slope", list(bounds), "needs shells of two w/h or more", "give width_to_thickness = [50, 200]"
            )
        return cls(
            scene,
            None if distance is None else _bound(f"{where}distance", distance, 10.0),
            None if share is None else _bound(f"{where}share", share, 1.0),
            bounds,
            tuple(changes.items()),
            leave_saddle,
            validate,
        )

    @property
    def label(self) -> str:
        """The scene and the w/h, for people and for the names of tests."""
        ratios = ", ".join(f"{ratio:g}" for ratio in require_shell(self.scene))
        others = [f"{key}={value}" for key, value in self.keys if not key.startswith("shell.")]
        return " ".join([self.scene.name, f"w/h={ratios}", *others])

    def __str__(self) -> str:
        return self.label


def _number(key: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise BadInput(key, value, "is not a number", "give a finite number")
    return float(value)


def _bound(key: str, value: Any, most: float) -> float:
    number = _number(key, value)
    if not 0.0 < number <= most:
        raise BadInput(key, value, f"is not in (0, {most:g}]", "distances are in units of l, shares parts of one")
    return number


def _pair(key: str, value: Any) -> tuple[float, float]:
    if isinstance(value, str) or not isinstance(value, Sequence) or len(value) != 2:
        raise BadInput(key, value, "is not [lowest, highest]", "e.g. slope = [0.5, 0.7]")
    low, high = (_number(key, part) for part in value)
    if not low < high:
        raise BadInput(key, value, "has its lowest value not below the highest", "e.g. slope = [0.5, 0.7]")
    return low, high


def read_pins(path: str | os.PathLike[str] = SHIPPED) -> list[Pin]:
    """The pins of a TOML file, its scenes looked for from its own folder; `BadInput` names what is wrong, and where."""
    place = Path(path)
    try:
        document = tomllib.loads(place.read_text(encoding="utf-8"))
    except OSError as error:
        raise BadInput("FILE", str(path), f"cannot be read ({os.strerror(error.errno or 0).lower()})") from None
    except (ValueError, RecursionError) as error:
        raise BadInput("FILE", str(path), f"is not valid TOML: {error}", "mend that line") from None
    for key in document:
        if key != "agreement":
            raise BadInput(key, None, "is not a key of a file of pins", "write every pin as a section [[agreement]]")
    entries = document.get("agreement")
    if not isinstance(entries, list) or not entries or not all(isinstance(entry, dict) for entry in entries):
        raise BadInput("agreement", None, "has no pin", "write every pin as a section [[agreement]], double brackets")
    return [_pin(entry, f"agreement.{number}.", place.parent) for number, entry in enumerate(entries)]


def is_pins(path: str | os.PathLike[str]) -> bool:
    """Whether a TOML file holds pins rather than a scene (any [[agreement]] in it)."""
    place = Path(path)
    if str(path) in shipped() or not place.is_file():
        return False
    try:
        return re.search(r"^\s*\[+\s*agreement\b", place.read_text(encoding="utf-8"), re.MULTILINE) is not None
    except (OSError, ValueError):
        return False


def _pin(entry: Mapping[str, Any], where: str, folder: Path) -> Pin:
    for key in entry:
        if key not in KEYS:
            near = get_close_matches(key, KEYS, 1)
            remedy = f"did you mean {near[0]}?" if near else f"known: {', '.join(KEYS)}"
            raise BadInput(f"{where}{key}", entry[key], "is not a known key", remedy)
    name = entry.get("scene")
    if not isinstance(name, str) or not name:
        raise BadInput(f"{where}scene", name, "is missing or not a text", KEYS["scene"])
    for key in ("leave_saddle", "validate"):
        if not isinstance(entry.get(key, False), bool):
            raise BadInput(f"{where}{key}", entry[key], "is not true or false", KEYS[key])
    keys = entry.get("set", {})
    if not isinstance(keys, dict):
        raise BadInput(f"{where}set", keys, "is not a table", 'e.g. set = { "shell.elements" = [40, 4] }')
    ratios = entry.get("width_to_thickness")
    if ratios is not None and not isinstance(ratios, list):
        ratios = [ratios]
    scene = load(name if name in shipped() else folder / name)
    return Pin.of(
        scene, entry.get("distance"), entry.get("share"), entry.get("slope"), ratios, _flat(keys),
        entry.get("leave_saddle"), entry.get("validate", False), where,
    )  # fmt: skip


def _flat(table: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested tables as dotted keys: `set.shell.elements = ...` is the same as `set = {"shell.elements" = ...}`."""
    found: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, dict):
            found.update(_flat(value, f"{prefix}{key}."))
        else:
            found[f"{prefix}{key}"] = value
    return found
