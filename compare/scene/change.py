"""A scene as a nested dictionary of the contract's keys: made from the sections, and changed by dotted keys."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from compare.errors import BadInput
from compare.scene.keys import FREE, SECTIONS
from compare.scene.spec import (
    ClampSpec,
    ModelSpec,
    SeedSpec,
    ShellSpec,
    StageSpec,
    StripSpec,
    WallSpec,
)

if TYPE_CHECKING:
    from compare.scene.scene import Scene

EXCLUSIVE: tuple[tuple[tuple[str, ...], ...], ...] = (
    (("strip.gamma",), ("strip.young", "strip.density", "strip.second_moment")),
    (("tip.mass",), ("tip.load",)),
    (("model.elements", "model.grading"), ("model.element_lengths",), ("model.tolerance",)),
    (("shell.grading",), ("shell.edge_layer",)),
    *(
        ((f"clamp.{end}.frame",), (f"clamp.{end}.tangent", f"clamp.{end}.normal", f"clamp.{end}.across"))
        for end in ("start", "end")
    ),
)
"""Groups of ways to say one thing; a change in one way drops the others."""

NO_BEARING = frozenset({"title", "steps", "clamp.start.across", "clamp.end.across"})
"""Keys that say nothing about the strip: the title, the steps of a stage, and what only checks other keys."""

OPTIONAL = ("model", "seed", "shell")
"""Sections that say nothing when they are empty."""


def document_of(scene: Scene, defaults: bool) -> dict[str, Any]:
    """The scene as the contract's keys without the title: what it gives; with `defaults`, all that can influence the
    result, where what came after the first version of the contract is left out when it has its default, so that the
    hash of an older scene stays what it was.
    """
    gravity: dict[str, Any] | None = None
    if scene.gravity is not None:
        gravity = {
            "up": list(scene.gravity.up),
            "acceleration": scene.gravity.acceleration,
            "exact": scene.gravity.exact,
        }
    clamps: dict[str, Any] = {"start": _clamp(scene.clamp_start)}
    if scene.clamp_end is not None:
        clamps["end"] = _clamp(scene.clamp_end)
    document: dict[str, Any] = {
        "strip": _strip(scene.strip),
        "gravity": gravity,
        "clamp": clamps if scene.clamp_start is not None or scene.clamp_end is not None else None,
        "model": _model(scene.model),
        "seed": _seed(scene.seed),
        "shell": _shell(scene.shell),
    }
    closure = scene.closure
    if closure is not None:
        document["closure"] = {"kind": closure.kind, "ruling": closure.ruling}
        if closure.kind == "circle":
            document["closure"]["turns"] = closure.turns
    if scene.tip is not None:
        document["tip"] = _without_none({"mass": scene.tip.mass, "load": scene.tip.load})
    if scene.walls:
        document["wall"] = [_wall(wall) for wall in scene.walls]
    if scene.path:
        document["path"] = [_stage(stage) for stage in scene.path]
    if defaults:
        return document
    document["model"] |= {"held_by": scene.model.held_by, "arc_length": scene.model.arc_length}
    return {name: value for name, value in _kept(document, "", scene.keys).items() if name not in OPTIONAL or value}


def _kept(table: Mapping[str, Any], prefix: str, given: frozenset[str]) -> dict[str, Any]:
    """The entries of a nested table whose dotted keys are among `given`; walls and path as they are."""
    return {
        name: _kept(value, f"{prefix}{name}.", given) if isinstance(value, Mapping) else value
        for name, value in table.items()
        if value is not None and (isinstance(value, Mapping) or name in ("wall", "path") or prefix + name in given)
    }


def _shell(shell: ShellSpec) -> dict[str, Any]:
    later = {
        "corner": shell.corner,
        "tolerance": shell.tolerance,
        "grading": None if shell.grading is None else list(shell.grading),
        "edge_layer": shell.edge_layer,
        "start_curvature": shell.start_curvature,
    }
    return {
        "width_to_thickness": list(shell.width_to_thickness) or None,
        "clamp": shell.clamp,
        "elements": None if shell.elements is None else list(shell.elements),
        **_without_none(later),
    }


def _strip(strip: StripSpec) -> dict[str, Any]:
    later = {"second_moment": strip.second_moment}
    return {
        "length": strip.length,
        "width": strip.width,
        "thickness": strip.thickness,
        "poisson": strip.poisson,
        "natural_curvature": list(strip.natural_curvature),
        "gamma": strip.gamma,
        "young": strip.young,
        "density": strip.density,
        **_without_none(later),
    }


def _clamp(clamp: ClampSpec | None) -> dict[str, Any] | None:
    if clamp is None:
        return None
    document: dict[str, Any] = {"position": FREE if clamp.position is None else list(clamp.position)}
    if clamp.tangent is None or clamp.normal is None:
        document["frame"] = FREE
    else:
        document |= {"tangent": list(clamp.tangent), "normal": list(clamp.normal)}
    return {**document, "ruling": clamp.ruling}


def _wall(wall: WallSpec) -> dict[str, Any]:
    document: dict[str, Any] = {"point": list(wall.point), "normal": list(wall.normal)}
    return document | _without_none({"stiffness": wall.stiffness, "name": wall.name})


def _model(model: ModelSpec) -> dict[str, Any]:
    placed: dict[str, Any] = {"elements": model.elements, "grading": model.grading}
    if model.element_lengths is not None:
        placed = {"element_lengths": list(model.element_lengths)}
    elif model.tolerance is not None:
        placed = {"tolerance": model.tolerance}
    document = {"energy": model.energy, **placed, "formulation": model.formulation}
    later = {"held_by": (model.held_by, "elimination"), "arc_length": (model.arc_length, "auto")}
    return document | {name: value for name, (value, default) in later.items() if value != default}


def _seed(seed: SeedSpec) -> dict[str, Any]:
    return {
        "curvature": "natural" if seed.curvature is None else list(seed.curvature),
        "ruling": list(seed.ruling),
    }


def _stage(stage: StageSpec) -> dict[str, Any]:
    keys = {key: plain(value) for key, value in stage.changes}
    return keys if stage.steps is None else {**keys, "steps": stage.steps}


# -- which keys a document gives --------------------------------------------------------------------------------------


def given_keys(document: Mapping[str, Any]) -> frozenset[str]:
    """The dotted keys of `document`, or of a stage, that have a value; walls without number or name ("wall.stiffness").

    The path, what has no bearing on a result and a section left out by false give nothing.
    """
    return frozenset(key for key, value in _leaves(document, "") if value is not None) - NO_BEARING


def _leaves(table: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    """Dotted key and value of every entry but the path, tables and walls taken apart."""
    for name, value in table.items():
        dotted = f"{prefix}{name}"
        if dotted == "path" or (dotted in SECTIONS and value is False):
            continue
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{dotted}.")
        elif dotted == "wall":
            for wall in value or ():
                yield from _leaves(wall, "wall.")
        else:
            section, _, rest = dotted.partition(".")
            yield f"wall.{rest.rpartition('.')[2]}" if section == "wall" else dotted, value


# -- changing keys ----------------------------------------------------------------------------------------------------


def changed(document: Mapping[str, Any], keys: Mapping[str, Any]) -> dict[str, Any]:
    """A copy of `document` with dotted `keys` replaced; None removes a key, and so does false a section.

    A key that says the same thing in another way (gamma for young and density, ...) replaces it. The result is not
    checked.
    """
    result = copy.deepcopy(dict(document))
    given = {key for key, value in keys.items() if value is not None}
    for ways in EXCLUSIVE:
        if any(key in given for way in ways for key in way):
            for way in ways:
                if not any(key in given for key in way):
                    for key in way:
                        _assign(result, key, None)
    if keys.get("shell.clamp") == "edge" and "shell.corner" not in given:
        _assign(result, "shell.corner", None)  # the whole edge has no corners of a size
    for key, value in keys.items():
        _assign(result, key, None if value is False and key in SECTIONS else plain(value))
    if result.get("clamp") == {}:
        del result["clamp"]
    return result


def _assign(document: dict[str, Any], key: str, value: Any) -> None:
    """Set (or, with None, remove) the dotted `key` of a nested dictionary, making the tables on the way."""
    *path, last = key.split(".")
    table: Any = document
    for name in path:
        if isinstance(table, list):
            table = table[_wall_index(table, name, key, value)]
            continue
        if name == "path" or (name == "wall" and name not in table):
            raise _no_wall(key, value, []) if name == "wall" else _whole_path(key, value)
        if value is None and name not in table:
            return
        table = table.setdefault(name, {})
        if not isinstance(table, (dict, list)):
            raise BadInput(key, value, f"is not a known key: {name} is a value, not a section", "check the dots")
    if isinstance(table, list):
        index = _wall_index(table, last, key, value)
        if value is None:
            del table[index]
        else:
            table[index] = value
    elif value is None:
        table.pop(last, None)
    else:
        table[last] = value


def wall_index(names: list[str | None], name: str) -> int | None:
    """The index of the wall that a dotted key calls `name`: its 0-based number or its name; None: there is none."""
    if name in names:
        return names.index(name)
    return int(name) if name.isascii() and name.isdigit() and len(name) < 9 and int(name) < len(names) else None


def _wall_index(walls: list[Any], name: str, key: str, value: Any) -> int:
    names = [wall.get("name") if isinstance(wall, dict) else None for wall in walls]
    index = wall_index(names, name)
    if index is None:
        raise _no_wall(key, value, names)
    return index


def _no_wall(key: str, value: Any, names: list[str | None]) -> BadInput:
    return BadInput(key, value, "is about a wall that the scene does not have", known_walls(names))


def known_walls(names: list[str | None]) -> str:
    """What to write instead of an unknown wall: the names and numbers of those there are."""
    if not names:
        return "add a section [[wall]] with point and normal"
    return f"walls here: {', '.join(f'wall.{index if name is None else name}' for index, name in enumerate(names))}"


def _whole_path(key: str, value: Any) -> BadInput:
    return BadInput(key, value, "is one stage of a path, which cannot be changed alone", "replace path as a whole")


def plain(value: Any) -> Any:
    """A value as TOML would give it: tuples and arrays become lists."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, Mapping):
        return {name: plain(item) for name, item in value.items()}
    return [plain(item) for item in value] if isinstance(value, (tuple, list)) else value


def _without_none(table: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: _without_none(value) if isinstance(value, Mapping) else value
        for name, value in table.items()
        if value is not None
    }
