"""A scene as a nested dictionary of the contract's keys: made from the sections, and changed by dotted keys."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from dataclasses import fields
from functools import cache
from typing import Any

from compare.scene.data import SceneData
from compare.scene.keys import DEEPEST, FREE, KEYS, LISTED, SECTIONS, SHELL, contract_name
from compare.scene.spec import ClampSpec, ClosureSpec, ModelSpec, StageSpec
from ribbonbench.errors import BadInput
from ribbonbench.numbers import of_numpy

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

OPTIONAL = ("model", "seed", SHELL, "uncertainty")
"""Sections that say nothing when they are empty."""


def document_of(scene: SceneData) -> dict[str, Any]:
    """What the scene gives (`own_keys` and its path), as the contract's keys without the title."""
    document: dict[str, Any] = {}
    for name, section in _sections(scene).items():
        if section is not None:
            given = {key: value for key, value in _said(name, section).items() if f"{name}.{key}" in scene.own_keys}
            if given or name not in OPTIONAL:
                _place(document, name, given)
    return document | _lists(scene)


def canonical_of(scene: SceneData) -> dict[str, Any]:
    """All that can influence the result as the contract's keys; what is newer only where the scene uses it."""
    document: dict[str, Any] = {}
    for name, section in _sections(scene).items():
        if name == "uncertainty":
            continue  # how sure the inputs are moves no result
        if section is not None:
            _place(document, name, _significant(name, section))
        elif name not in ("clamp.end", "closure", "tip", "rod", "contact"):
            _place(document, name, None)
    if document["clamp"] == {"start": None}:
        document["clamp"] = None
    return document | _lists(scene)


def _sections(scene: SceneData) -> dict[str, Any]:
    """The single sections by their dotted names; None: absent."""
    return {
        "strip": scene.strip,
        "gravity": scene.gravity,
        "clamp.start": scene.clamp_start,
        "clamp.end": scene.clamp_end,
        "model": scene.model,
        "seed": scene.seed,
        SHELL: scene.shell,
        "closure": scene.closure,
        "tip": scene.tip,
        "uncertainty": scene.uncertainty,
        "rod": scene.rod,
        "contact": scene.contact,
    }


def _lists(scene: SceneData) -> dict[str, Any]:
    """Walls, obstacles and path, where the scene has them."""
    found = {
        "wall": [_significant("wall", wall) for wall in scene.walls],
        "obstacle": [_significant("obstacle", obstacle) for obstacle in scene.obstacles],
        "path": [_stage(stage) for stage in scene.path],
    }
    return {name: entries for name, entries in found.items() if entries}


def _place(document: dict[str, Any], name: str, entries: dict[str, Any] | None) -> None:
    *outer, last = name.split(".")
    for section in outer:
        document = document.setdefault(section, {})
    document[last] = entries


@cache
def _declared(name: str, kind: Any) -> tuple[tuple[str, Any], ...]:
    """The fields of a section that are keys, with what is declared of them."""
    found = ((item.name, KEYS.get(f"{name}.{item.name}")) for item in fields(kind))
    return tuple((field, about) for field, about in found if about is not None)


def _said(name: str, section: Any) -> dict[str, Any]:
    """Every key of a section that has a field, with the value as the file gives it; a frame not held as such."""
    said = {field: about.written(getattr(section, field)) for field, about in _declared(name, section.__class__)}
    if isinstance(section, ClampSpec) and section.tangent is None:
        return {"position": said["position"], "frame": FREE, **{k: said[k] for k in ("ruling", "slide", "section")}}
    return said


def _significant(name: str, section: Any) -> dict[str, Any]:
    """The keys of a section that can influence the result: newer ones where they differ from their default."""
    said = _said(name, section)
    if isinstance(section, ClosureSpec) and section.kind != "circle":
        del said["turns"], said["twist"]
    if isinstance(section, ModelSpec) and not (section.element_lengths is None and section.tolerance is None):
        del said["elements"], said["grading"]
    if isinstance(section, ModelSpec) and section.tolerance is None:
        del said["tolerance"]
    newer = {key: about for key in said if (about := KEYS[f"{name}.{key}"]).newer}
    return {key: value for key, value in said.items() if key not in newer or value != newer[key].default}


def _stage(stage: StageSpec) -> dict[str, Any]:
    keys = {key: plain(value) for key, value in stage.changes}
    return keys if stage.steps is None else {**keys, "steps": stage.steps}


def value_of(scene: SceneData, key: str) -> Any:
    """The value of a dotted key (a wall by number or name) of a scene; None: it has none."""
    part: Any = canonical_of(scene)
    for name in key.split("."):
        if isinstance(part, list):
            listed = scene.obstacles if key.startswith("obstacle.") else scene.walls
            number = wall_index([one.name for one in listed], name)
            part = None if number is None or number >= len(part) else part[number]
        else:
            part = part.get(name) if isinstance(part, Mapping) else None
    return None if isinstance(part, Mapping) else part


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
        elif dotted in LISTED:
            for entry in value or ():
                yield from _leaves(entry, f"{dotted}.")
        else:
            yield contract_name(dotted), value


# -- changing keys ----------------------------------------------------------------------------------------------------


def changed(document: Mapping[str, Any], keys: Mapping[str, Any]) -> dict[str, Any]:
    """A copy of `document` with dotted `keys` replaced; None removes a key, and so does false a section.

    A key that says the same thing in another way (gamma for young and density, ...) replaces it. The result is not
    checked.
    """
    result = copy.deepcopy(dict(document))
    given = {key for key, value in keys.items() if value is not None}
    for ways in EXCLUSIVE:
        if any(key in given for path in ways for key in path):
            for path in ways:
                if not any(key in given for key in path):
                    for key in path:
                        _assign(result, key, None)
    if keys.get("shell.clamp") == "edge" and "shell.corner" not in given:
        _assign(result, "shell.corner", None)  # the whole edge has no corners of a size
    if keys.get("model.energy", "auto") != "auto" and "model.accuracy" not in given:
        _assign(result, "model.accuracy", None)  # an energy that is named leaves nothing to choose
    for key, value in keys.items():
        _assign(result, key, None if value is False and key in SECTIONS else plain(value))
    if result.get("clamp") == {}:
        del result["clamp"]
    return result


def _assign(document: dict[str, Any], key: str, value: Any) -> None:
    """Set (or, with None, remove) the dotted `key` of a nested dictionary, making the tables on the way."""
    if key.count(".") > DEEPEST:
        raise BadInput(key, value, "is not a known key", "check the dots")
    *path, last = key.split(".")
    table: Any = document
    for name in path:
        if isinstance(table, list):
            table = table[_wall_index(table, name, key, value)]
            continue
        if name == "path" or (name in LISTED and name not in table):
            raise _whole_path(key, value) if name == "path" else _no_wall(key, value, [])
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
    section = key.partition(".")[0]
    article = "an" if section == "obstacle" else "a"
    problem = f"is about {article} {section} that the scene does not have"
    return BadInput(key, value, problem, known_walls(names, section))


def known_walls(names: list[str | None], section: str = "wall") -> str:
    """What to write instead of an unknown wall or obstacle: the names and numbers of those there are."""
    if not names:
        return (
            f"add a section [[{section}]] with {'point and normal' if section == 'wall' else 'kind, point and radius'}"
        )
    listed = ", ".join(f"{section}.{index if name is None else name}" for index, name in enumerate(names))
    return f"{section}s here: {listed}"


def _whole_path(key: str, value: Any) -> BadInput:
    return BadInput(key, value, "is one stage of a path, which cannot be changed alone", "replace path as a whole")


def plain(value: Any) -> Any:
    """A value as TOML would give it: tuples and arrays become lists."""
    if of_numpy(value):
        return value.tolist()
    if isinstance(value, Mapping):
        return {name: plain(item) for name, item in value.items()}
    return [plain(item) for item in value] if isinstance(value, (tuple, list)) else value
