"""From a parsed TOML document with [[strip]] to a scene of several strips; every fault is a `BadInput`."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from compare.scene import keys as contract
from compare.scene.change import given_keys
from compare.scene.check import check_clamps, check_geometry
from compare.scene.held import NAME
from compare.scene.inputs.known import check_known
from compare.scene.inputs.source import name_of
from compare.scene.read import one_line, read_sections
from compare.scene.scene import Scene
from compare.scene.strips.check import check_together
from compare.scene.strips.path import read_stages, way
from compare.scene.strips.scene import Joined, StripsScene
from compare.scene.strips.spec import ENDS, KEYS, OWN, BetweenSpec, JointSpec
from compare.scene.strips.write import assign
from compare.scene.table import Table, missing, reject_unknown
from ribbonbench.errors import BadInput

#: Sections that stand round all strips.
SHARED = ("gravity", "wall", "obstacle")
#: Keys of [strip] that say its stiffness.
_STIFFNESS = ("young", "thickness", "poisson")
#: Keys of one strip that several refuse: why, and what to do.
_WHY_NOT = {
    "tip.tension": ("has no direction of its own among several strips", "give tip.force"),
}


def loads(text: str, source: str = "<text>", assignments: Mapping[str, Any] | None = None) -> StripsScene:
    """A scene of several strips from its text; assignments: dotted keys that are replaced, "strip.left.width"."""
    document = tomllib.loads(text)
    for dotted, value in (assignments or {}).items():
        assign(document, dotted, value)
    return build(document, source)


def build(document: Mapping[str, Any], source: str = "<text>") -> StripsScene:
    """A scene of several strips from a document."""
    scene = _alone(document, source)
    stages, steps = read_stages(document, lambda changed: _alone(changed, source))
    if not stages:
        return scene
    scene = replace(scene, stages=stages, steps=steps)
    for k in range(len(stages)):
        leg(scene, k)(0.5)
    return scene


def leg(scene: StripsScene, number: int) -> Callable[[float], StripsScene]:
    """The scene at t, 0 <= t <= 1, between stage `number` and the next one, at last the scene itself."""
    last = scene.stages[number + 1] if number + 1 < len(scene.stages) else scene
    return way(scene.stages[number], last, lambda document: _alone(document, scene.source))


def _alone(document: Mapping[str, Any], source: str) -> StripsScene:
    """The scene itself, without its path."""
    _reject(document)
    title = Table(document, "", KEYS).value("title")
    name = name_of(source, title)
    tables = _tables(document, "strip")
    names = _names(tables)
    strips = tuple(_strip(document, entry, name_) for entry, name_ in zip(tables, names, strict=True))
    joints = tuple(_joint(entry, number, names) for number, entry in enumerate(_tables(document, "joint", 0)))
    between = _between(document)
    scene = StripsScene(
        name, source, title or one_line(name), names, strips, joints, _distance(between, strips),
        _stiffness(strips, names), document,
        friction=between.friction if between else 0.0, itself=between is not None and between.itself,
    )  # fmt: skip
    check_together(scene)
    return scene


def _reject(document: Mapping[str, Any]) -> None:
    """Unknown keys; what a scene of one strip may have besides is named as such."""
    for name in document:
        if not any(key == name or key.startswith(f"{name}.") for key in KEYS):
            if any(key == name or key.startswith(f"{name}.") for key in contract.KEYS):
                where = "inside the [[strip]] that it is of" if name in OWN else "out, or solve one strip by itself"
                remedy = f"write [strip.{name}] behind its [[strip]]" if name in OWN else f"leave [{name}] {where}"
                raise BadInput(name, None, "is not known to a scene of several strips", remedy)
            reject_unknown({name: document[name]}, "", KEYS)
    for section in ("gravity", "contact", "model"):
        _known(document.get(section, {}), section)
    for section in ("wall", "obstacle"):
        for entry in _tables(document, section, 0):
            _known(entry, section)


def _known(data: Any, section: str) -> None:
    if not isinstance(data, Mapping):
        raise BadInput(section, None, "is not a single table", f"write it as a section [{section}]")
    for name in data:
        dotted = f"{section}.{name}"
        if dotted not in KEYS and dotted in contract.KEYS:
            raise BadInput(dotted, None, "is not known to a scene of several strips", f"leave {name} out")
    reject_unknown(data, section, KEYS)


def _tables(document: Mapping[str, Any], section: str, least: int = 1) -> list[Mapping[str, Any]]:
    data = document.get(section, [])
    if not isinstance(data, list) or not all(isinstance(entry, Mapping) for entry in data) or len(data) < least:
        problem = "is not an array of tables"
        raise BadInput(section, None, problem, f"write every {section} as a section [[{section}]] in double brackets")
    return data


def _names(tables: list[Mapping[str, Any]]) -> tuple[str, ...]:
    found: list[str] = []
    for index, entry in enumerate(tables):
        key = f"strip.{index}.name"
        if "name" not in entry:
            raise missing("strip.name", KEYS, f'add name = "strip_{index}" to the [[strip]] number {index}, from 0')
        name = entry["name"]
        if not isinstance(name, str) or not NAME.fullmatch(name):
            raise BadInput(key, name, "is not a name", 'give letters, digits and _, the first no digit, e.g. "left"')
        if name in found:
            raise BadInput(key, name, "is the name of an earlier strip too", "give every strip its own name")
        found.append(name)
    return tuple(found)


def _strip(document: Mapping[str, Any], entry: Mapping[str, Any], name: str) -> Scene:
    """The scene of one strip, with the sections that all share."""

    def named(dotted: str) -> str:
        section = dotted.partition(".")[0]
        if section == "strip":
            return f"strip.{name}{dotted.removeprefix('strip')}"
        return f"strip.{name}.{dotted}" if section in OWN else dotted

    def renamed(read: Callable[[], Any]) -> Any:
        try:
            return read()
        except BadInput as error:
            remedy = error.remedy.replace("strip.", f"strip.{name}.")
            raise BadInput(named(error.key), error.value, error.problem, remedy) from None

    own = {key: value for key, value in entry.items() if key not in ("name", *OWN)}
    renamed(lambda: _check_own(entry))
    alone: dict[str, Any] = {"title": str(name), "strip": own}
    alone |= {key: entry[key] for key in OWN if key in entry}
    alone |= {section: document[section] for section in SHARED if section in document}
    model = dict(document.get("model", {}))
    model.setdefault("elements", KEYS["model.elements"].default)
    alone["model"] = model

    def read() -> Scene:
        sections = read_sections(alone)
        scene = Scene(name=name, source=name, own_keys=given_keys(alone), **vars(sections))
        if scene.clamp_start is not None and scene.clamp_end is not None:
            check_geometry(scene)
        check_clamps(scene)
        check_known(scene)
        return scene

    return renamed(read)  # type: ignore[no-any-return]


def _check_own(entry: Mapping[str, Any]) -> None:
    """Keys of a [[strip]] and of what stands in it."""
    reject_unknown({key: value for key, value in entry.items() if key not in OWN}, "strip", KEYS)
    for section in OWN:
        if section not in entry:
            continue
        if not isinstance(entry[section], Mapping):
            raise BadInput(section, None, "is not a table", f"write it as [strip.{section}]")
        ends = entry[section] if section == "clamp" else {"": entry[section]}
        for end, data in ends.items():
            if section == "clamp" and end not in ENDS:
                raise BadInput(f"clamp.{end}", None, "is no end of a strip", "write [strip.clamp.start] or .end")
            dotted = f"{section}.{end}".rstrip(".")
            for key in data if isinstance(data, Mapping) else ():
                if f"strip.{dotted}.{key}" not in KEYS and f"{dotted}.{key}" in contract.KEYS:
                    why, remedy = _WHY_NOT.get(
                        f"{dotted}.{key}", ("is not known to one of several strips", "leave it out")
                    )
                    raise BadInput(f"{dotted}.{key}", None, why, remedy)


def _joint(entry: Mapping[str, Any], number: int, names: tuple[str, ...]) -> Joined:
    path = f"joint.{number}"
    keys = {f"{path}.{about.field}": about for key, about in KEYS.items() if key.startswith("joint.")}
    reject_unknown(entry, path, keys)
    table = Table(entry, path, keys)
    spec = table.read(JointSpec)
    return Joined(_end(table, "a", spec.a, names), _end(table, "b", spec.b, names), spec)


def _end(table: Table, key: str, value: str, names: tuple[str, ...]) -> tuple[int, int]:
    name, _, end = value.rpartition(".")
    if end not in ENDS or name not in names:
        known = ", ".join(f"{one}.{each}" for one in names for each in ENDS)
        raise table.bad(key, "is no end of a strip", f"give one of {known}")
    return names.index(name), 0 if end == "start" else -1


def _between(document: Mapping[str, Any]) -> BetweenSpec | None:
    return Table(document["contact"], "contact", KEYS).read(BetweenSpec) if "contact" in document else None


def _distance(between: BetweenSpec | None, strips: tuple[Scene, ...]) -> float | None:
    if between is None:
        return None
    given = between.distance
    length = min(strip.strip.length for strip in strips)
    if given is None:
        thick = [strip.strip.thickness for strip in strips]
        known = [h for h in thick if h is not None]
        if len(known) < len(thick):
            raise missing("contact.distance", KEYS, "give it, or the thickness of every strip")
        given = max(known)
    if not 1e-4 * length <= given < 0.5 * length:
        raise BadInput(
            "contact.distance", given, "is not between 1e-4 and 0.5 of the length of the shortest strip",
            f"give {1e-4 * length:g} to {0.5 * length:g}",
        )  # fmt: skip
    return given


def _stiffness(strips: tuple[Scene, ...], names: tuple[str, ...]) -> tuple[float, ...]:
    """D of every strip: of young, thickness and poisson; of thickness and poisson where none has a young (all are of
    one material); 1 where none has a thickness either (all are of one sheet)."""
    found = []
    for key in ("young", "thickness"):
        absent = [vars(strip.strip)[key] is None for strip in strips]
        if any(absent) and not all(absent):
            name = names[absent.index(True)]
            raise BadInput(
                f"strip.{name}.{key}", None, "is missing: it says how stiff this strip is beside the others",
                f"give {key} to every strip, or to none",
            )  # fmt: skip
    for strip in strips:
        young, thickness, nu = strip.strip.young, strip.strip.thickness, strip.strip.poisson
        cube = 1.0 if thickness is None else thickness**3
        found.append((1.0 if young is None else young) * cube / (12.0 * (1.0 - nu * nu)))
    return tuple(found)
