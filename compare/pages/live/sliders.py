"""The sliders of a scene: its declared numbers that a hand can move, each with the stretch that its slider covers.

A slider is named by its key ("strip.gamma"), by the number in a list ("clamp.end.position.2"), or is made of several
keys: "clamp.end.turn.0" turns the held frame about the x axis (degrees, one rotation vector with .1 and .2, from the
frame of the scene), "wall.0.offset" moves a wall along its normal (from its place). What a slider covers is a
convenience: any number may be typed, and the scene says what is right.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from compare.models.base import Model
from compare.scene import change
from compare.scene.data import frame_of
from compare.scene.declare import LENGTH, PER_LENGTH
from compare.scene.inputs.law import Law
from compare.scene.keys import KEYS, contract_name
from compare.scene.scene import Scene
from compare.scene.spec import ClampSpec
from ribbonbench.errors import BadInput

#: What a slider of a length, a place or a wall reaches to either side (l), and one of a turn (degrees).
_REACH, _TURN = 0.5, 170.0
#: Factor to either side of a number of a material.
_MATERIAL = 5.0
#: Curvature (1/l), weight and force (D w / l^2) that a slider reaches at least.
_CURL, _WEIGHT, _PULL = 10.0, 20.0, 5.0
_AXES = ("x", "y", "z")
_MATERIALS = ("strip.thickness", "strip.young", "strip.density")


@dataclass(frozen=True)
class Slider:
    """One number of a scene. label, about: short and whole meaning; unit: of the value; low, high: what the slider
    covers; log: it goes by factors."""

    name: str
    label: str
    about: str
    unit: str
    low: float
    high: float
    value: float
    log: bool = False

    def to_dict(self) -> dict[str, Any]:
        """For the page."""
        return asdict(self)


def sliders(scene: Scene, model: Model) -> tuple[Slider, ...]:
    """The sliders of a scene whose model reads their keys."""
    found = (*_strip(scene), *_tip(scene), *_shell(scene), *_clamps(scene), *_walls(scene), *_obstacles(scene))
    read = model.reads | {"shell.width_to_thickness"}
    return tuple(one for one in found if any(key in read for key in _keys(one.name)))


def _keys(name: str) -> tuple[str, ...]:
    """The contract's keys that a slider sets."""
    section, _, last = name.rpartition(".")
    if section.endswith(".turn"):
        clamp = section.removesuffix(".turn")
        return (f"{clamp}.tangent", f"{clamp}.normal")
    if last == "offset":
        return ("wall.point",)
    return (contract_name(section if last.isdigit() else name),)


def _unit(scene: Scene, unit: str | None) -> str:
    """A unit in short."""
    short = {LENGTH: "m", PER_LENGTH: "1/m"} if scene.units.known else {LENGTH: "", PER_LENGTH: "1/length"}
    return short.get(unit or "", (unit or "").partition(",")[0])


def _declared(
    scene: Scene, name: str, low: float, high: float, value: float, label: str = "", log: bool = False
) -> Slider:
    """A slider of a declared key; label: "": the key's own name."""
    key = KEYS[_keys(name)[0]]
    unit = _unit(scene, key.unit)
    if key.range is not None:
        least = key.range.low
        low = max(low, least if key.range.includes_low else least + 1e-3 * (high - least))
        high = high if key.range.high is None else min(high, key.range.high)
    return Slider(name, label or key.field.replace("_", " "), key.meaning, unit, low, high, value, log)


def _around(value: float, least: float) -> tuple[float, float]:
    """A stretch from the other side of zero to twice a value, or `least` to either side."""
    most = max(2.0 * abs(value), least)
    return -most, most


def _strip(scene: Scene) -> Iterator[Slider]:
    strip = scene.strip
    if strip.gamma is not None and scene.gravity is not None:
        yield _declared(scene, "strip.gamma", 0.0, max(2.5 * strip.gamma, _WEIGHT), strip.gamma)
    if not _is_table(strip.natural_curvature):
        ends = [float(x) for x in strip.natural_curvature]  # type: ignore[arg-type]
        stretch = _around(max(ends, key=abs), _CURL / strip.length)
        if ends[0] == ends[1]:
            yield _declared(scene, "strip.natural_curvature", *stretch, ends[0])
        else:
            for number, end in enumerate(ends):
                where = f"natural curvature at s = {'0' if number == 0 else 'length'}"
                yield _declared(scene, f"strip.natural_curvature.{number}", *stretch, end, where)
    width = min(4.0 * strip.width, max(0.5 * strip.length, strip.width))
    yield _declared(scene, "strip.width", strip.width / 4.0, width, strip.width)
    for name in _MATERIALS:
        value = getattr(strip, name.removeprefix("strip."))
        if value is not None:
            most = _MATERIAL * value
            if name == "strip.thickness":
                most = min(most, 0.5 * strip.width)
            yield _declared(scene, name, value / _MATERIAL, max(most, value), value, log=True)
    yield _declared(scene, "strip.poisson", 0.0, 0.5, strip.poisson)


def _is_table(law: Law) -> bool:
    return isinstance(law[0], tuple)


def _tip(scene: Scene) -> Iterator[Slider]:
    tip = scene.tip
    if tip is None:
        return
    for name in ("mass", "load"):
        value = getattr(tip, name)
        if value is not None:
            yield _declared(scene, f"tip.{name}", 0.0, 2.5 * value or 1.0, value)
    if tip.tension is not None:
        yield _declared(scene, "tip.tension", *_around(tip.tension, 0.0 if tip.tension else _PULL), tip.tension)
    if tip.force is not None:
        most = max(abs(x) for x in tip.force)
        for axis, value in enumerate(tip.force):
            yield _declared(
                scene, f"tip.force.{axis}", *_around(most, 0.0 if most else _PULL), value, f"tip force {_AXES[axis]}"
            )


def _shell(scene: Scene) -> Iterator[Slider]:
    ratios = scene.shell.width_to_thickness
    if ratios:
        yield _declared(scene, "shell.width_to_thickness", 5.0, 1000.0, max(ratios), "w/h of the shell", log=True)


def _clamps(scene: Scene) -> Iterator[Slider]:
    reach = _REACH * scene.strip.length
    held = (("end", scene.clamp_end), ("start", scene.clamp_start))
    for name, clamp in held:
        if clamp is None or (name == "start" and scene.clamp_end is not None):
            continue  # two clamps: what counts is how they stand to each other
        if clamp.position is not None and name == "end":
            for axis, value in enumerate(clamp.position):
                key = f"clamp.{name}.position.{axis}"
                yield _declared(scene, key, value - reach, value + reach, value, f"{name} {_AXES[axis]}")
        if frame_of(clamp) is not None:
            about = f"turn of the clamp at s = {'0' if name == 'start' else 'length'} about the fixed {{}} axis"
            for axis, letter in enumerate(_AXES):
                turn = f"clamp.{name}.turn.{axis}"
                yield Slider(turn, f"{name} turned about {letter}", about.format(letter), "degrees", -_TURN, _TURN, 0.0)


def _walls(scene: Scene) -> Iterator[Slider]:
    reach = _REACH * scene.strip.length
    for number, wall in enumerate(scene.walls):
        about = "how far the wall stands along its normal from where the scene has it"
        label = f"wall {wall.name or number}"
        yield Slider(f"wall.{number}.offset", label, about, _unit(scene, LENGTH), -reach, reach, 0.0)


def _obstacles(scene: Scene) -> Iterator[Slider]:
    reach = _REACH * scene.strip.length
    for number, one in enumerate(scene.obstacles):
        name = one.name or f"{one.kind} {number}"
        for axis, value in enumerate(one.point):
            key = f"obstacle.{number}.point.{axis}"
            yield _declared(scene, key, value - reach, value + reach, value, f"{name} {_AXES[axis]}")
        if one.radius is not None:
            least, most = one.radius / _MATERIAL, _MATERIAL * one.radius
            yield _declared(scene, f"obstacle.{number}.radius", least, most, one.radius, f"{name} radius", log=True)
        for axis, value in enumerate(one.size or ()):
            key = f"obstacle.{number}.size.{axis}"
            least, most, label = value / _MATERIAL, _MATERIAL * value, f"{name} size {axis + 1}"
            yield _declared(scene, key, least, most, value, label, log=True)


def changed(scene: Scene, model: Model, values: Mapping[str, Any]) -> Scene:
    """The scene with its sliders at these values (others as they are); `BadInput` for a slider that is not there, a
    value that is no number, and whatever the scene refuses."""
    known = {one.name: one for one in sliders(scene, model)}
    moved: dict[str, float] = {}
    for name, value in values.items():
        if name not in known:
            raise BadInput(name, value, "is no slider of this scene", f"use {', '.join(known)}")
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise BadInput(name, value, "is not a number", f"give the {known[name].about}")
        if float(value) != known[name].value:
            moved[name] = float(value)
    keys = keys_of(scene, moved)
    return scene.replace(keys) if keys else scene


def value_of(scene: Scene, key: str) -> Any:
    """What a dotted key that a slider changes is in the scene."""
    if key.endswith((".tangent", ".normal")):
        frame = frame_of(_clamp(scene, key))
        assert frame is not None  # it has a slider
        return frame[:, 2 if key.endswith(".tangent") else 1].tolist()
    return change.value_of(scene, key)


def keys_of(scene: Scene, moved: Mapping[str, float]) -> dict[str, Any]:
    """The dotted keys of the scene that sliders at these values change."""
    keys: dict[str, Any] = {}
    for name, value in moved.items():
        section, _, last = name.rpartition(".")
        if section.endswith(".turn"):
            keys |= _turned(scene, section, moved)
        elif last == "offset":
            wall = scene.walls[int(section.removeprefix("wall."))]
            keys[f"{section}.point"] = (np.asarray(wall.point) + value * np.asarray(wall.normal)).tolist()
        elif last.isdigit():
            whole = keys.get(section) or list(_listed(scene, section))
            whole[int(last)] = value
            keys[section] = whole
        else:
            keys[name] = [value] if name == "shell.width_to_thickness" else value
    return keys


def _clamp(scene: Scene, section: str) -> ClampSpec:
    found = scene.clamp_start if section.startswith("clamp.start") else scene.clamp_end
    assert found is not None  # it has a slider
    return found


def _listed(scene: Scene, section: str) -> tuple[float, ...]:
    """The numbers of a key with several."""
    if section.startswith("clamp."):
        return _clamp(scene, section).position or ()
    if section.startswith("obstacle."):
        _, number, key = section.split(".")
        return tuple(getattr(scene.obstacles[int(number)], key))
    if section == "tip.force":
        return (scene.tip.force if scene.tip is not None else None) or ()
    return tuple(float(x) for x in scene.strip.natural_curvature)  # type: ignore[arg-type]


def _turned(scene: Scene, section: str, moved: Mapping[str, float]) -> dict[str, Any]:
    from scipy.spatial.transform import Rotation

    frame = frame_of(_clamp(scene, section))
    assert frame is not None  # it has a slider
    vector = np.radians([moved.get(f"{section}.{axis}", 0.0) for axis in range(3)])
    there = Rotation.from_rotvec(vector).as_matrix() @ frame
    clamp = section.removesuffix(".turn")
    return {f"{clamp}.tangent": there[:, 2].tolist(), f"{clamp}.normal": there[:, 1].tolist()}
