"""A case: physics, what is asked of it, and references with intervals, each found in two ways or more.

A case is a TOML file that keeps `schema.json`. Its physics are those sections of a scene that say what a strip is, what
holds it and what loads it (docs/scenes.md), and no setting of a solver. `Case.scene` is that scene; a program that
knows no scene reads `Case.physics`, or takes the rod of `compare.suite.section`.
"""

from __future__ import annotations

import functools
import hashlib
import itertools
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from compare.models import registry
from compare.suite.schema import check, schema
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from compare.scene.scene import Scene

Value = float | bool | tuple[float, ...]
Kind = Literal["number", "curve", "yes_no"]
#: What each question needs beside its name; all others are refused.
_NEEDS: Mapping[str, tuple[set[str], set[str]]] = {
    "position": ({"axis"}, {"at", "sign"}),
    "radius": ({"axes"}, {"at"}),
    "ratio": ({"axes"}, {"at", "sign"}),
    "extent": ({"axis"}, set()),
    "energy": (set(), set()),
    "force": ({"axis", "on"}, {"sign"}),
    "moment": ({"axis", "on"}, {"sign"}),
    "stable": (set(), set()),
    "critical": ({"key", "between"}, set()),
}
_ALWAYS = {"name", "of", "reference", "interval", "way", "elsewhere", "unit"}


def _value(given: Any) -> Value:
    if isinstance(given, list):
        return tuple(map(float, given))
    return given if isinstance(given, bool) else float(given)


@dataclass(frozen=True)
class Way:
    """How a reference was obtained: by what, with which value; measured: in a laboratory."""

    by: str
    value: Value
    measured: bool = False


@dataclass(frozen=True)
class Ask:
    """A question.

    of: "position" (coordinate `axis` of the centreline at the part `at` of its length), "radius" and "ratio" of the
    coordinates `axes`, "extent" (greatest less least coordinate), "energy" (elastic), "force" and "moment" on the strip
    by the end or wall `on`, "stable", "critical" (where between two values of the physics' `key` the state at the first
    one loses its stability). A curve is asked `over` values of a key. interval: half its width, of a curve one or one a
    point. elsewhere: values of other equilibria of the same physics.
    """

    name: str
    of: str
    reference: Value
    interval: tuple[float, ...]
    ways: tuple[Way, ...]
    axis: str = ""
    axes: tuple[str, ...] = ()
    at: float = 1.0
    on: str = ""
    sign: int = 1
    key: str = ""
    between: tuple[float, float] = (0.0, 0.0)
    over: tuple[str, tuple[Any, ...]] | None = None
    unit: str = ""
    elsewhere: tuple[float, ...] = ()

    @property
    def kind(self) -> Kind:
        """Of the answer."""
        if isinstance(self.reference, bool):
            return "yes_no"
        return "curve" if isinstance(self.reference, tuple) else "number"

    def distance(self, value: Value) -> float:
        """How many intervals a value is from the reference: of a curve at its worst point; a wrong yes or no is
        infinitely far. ValueError for a value of another kind."""
        if isinstance(self.reference, bool) or isinstance(value, bool):
            if isinstance(value, bool) and isinstance(self.reference, bool):
                return 0.0 if value == self.reference else float("inf")
            raise ValueError(f"{self.name}: {value!r} is no {self.kind}")
        wanted, given = _row(self.reference), _row(value)
        if isinstance(value, tuple) != isinstance(self.reference, tuple) or len(wanted) != len(given):
            raise ValueError(f"{self.name}: {value!r} is no {self.kind}")
        if not all(abs(v) < float("inf") for v in given):
            raise ValueError(f"{self.name}: {value!r} is not finite")
        widths = self.interval if len(self.interval) > 1 else self.interval * len(wanted)
        return max(abs(v - w) / width for v, w, width in zip(given, wanted, widths, strict=True))


def _row(value: float | tuple[float, ...]) -> tuple[float, ...]:
    return value if isinstance(value, tuple) else (value,)


@dataclass(frozen=True)
class Case:
    """A case as its file has it (docs/suite.md); digest: of the file, by which answers know what they answered."""

    name: str
    title: str
    level: str
    units: str
    theory: str
    says: str
    licence: str
    cite: tuple[str, ...]
    physics: Mapping[str, Any]
    asks: tuple[Ask, ...]
    begin: Mapping[str, Any] = field(default_factory=dict)
    fast: bool = False
    digest: str = ""

    def scene(self, model: Mapping[str, Any] | None = None, shell: Mapping[str, Any] | None = None) -> Scene:
        """The physics and the beginning as a scene, with these sections of a model and a shell. Raises `BadInput` for
        physics that are none."""
        from compare.scene.keys import SHELL
        from compare.scene.scene import loads
        from compare.scene.toml import toml_text

        sections = {"model": dict(model or {}), SHELL: dict(shell or {})}
        said = {"title": self.title, **self.physics, **self.begin, **{k: v for k, v in sections.items() if v}}
        return loads(toml_text(said), f"{self.name}.toml")

    @property
    def length(self) -> float:
        """Of the strip, in the case's unit of length."""
        return float(self.physics["strip"]["length"])


def _ask(table: Mapping[str, Any], where: str) -> Ask:
    of = table["of"]
    needs, may = _NEEDS[of]
    over = table.get("over")
    for name in sorted(needs - table.keys()):
        raise BadInput(f"{where}.{name}", None, f'is missing, which "{of}" needs', "add it (docs/suite.md)")
    known = needs | may | _ALWAYS | ({"over"} if of not in ("critical", "stable") else set())
    for name in sorted(table.keys() - known):
        raise BadInput(f"{where}.{name}", table[name], f'has no meaning for "{of}"', "leave it out")
    reference = _value(table["reference"])
    interval = table["interval"]
    found = Ask(
        name=table["name"], of=of, reference=reference,
        interval=tuple(map(float, interval)) if isinstance(interval, list) else (float(interval),),
        ways=tuple(Way(way["by"], _value(way["value"]), way.get("measured", False)) for way in table["way"]),
        axis=table.get("axis", ""), axes=tuple(table.get("axes", ())), at=float(table.get("at", 1.0)),
        on=table.get("on", ""), sign=table.get("sign", 1), key=table.get("key", ""),
        between=tuple(map(float, table.get("between", (0.0, 0.0)))),  # type: ignore[arg-type]
        over=None if over is None else (over["key"], tuple(over["values"])), unit=table.get("unit", ""),
        elsewhere=tuple(map(float, table.get("elsewhere", ()))),
    )  # fmt: skip
    _check_ask(found, where)
    return found


def _check_ask(ask: Ask, where: str) -> None:
    """The parts of a question fit each other."""
    points = len(ask.over[1]) if ask.over is not None else 0
    if (ask.of == "stable") != (ask.kind == "yes_no"):
        raise BadInput(f"{where}.reference", None, f'is no answer to "{ask.of}"', "yes or no answers stable alone")
    if (ask.kind == "curve") != bool(points) or (points and len(_row(ask.reference)) != points):
        raise BadInput(f"{where}.reference", None, "is not one number for each value of over", "give as many")
    if len(ask.interval) not in (1, points) or min(ask.interval) <= 0.0:
        raise BadInput(f"{where}.interval", None, "is not one positive number, or one for each point", "mend it")
    for number, way in enumerate(ask.ways):
        try:
            ask.distance(way.value)
        except ValueError:
            raise BadInput(f"{where}.way.{number}.value", None, "is of another kind than the reference") from None
    if len({way.by for way in ask.ways}) < len(ask.ways):
        raise BadInput(f"{where}.way", None, "names one way twice", "two ways share no code")


def read(text: str, name: str) -> Case:
    """A case from its TOML text. Raises `BadInput` with the key that is wrong."""
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise BadInput("case", name, f"is not valid TOML: {error}", "mend that line") from None
    check(table, schema(), name)
    asks = tuple(_ask(ask, f"{name}.ask.{number}") for number, ask in enumerate(table["ask"]))
    if len({ask.name for ask in asks}) < len(asks):
        raise BadInput(f"{name}.ask", None, "asks two questions of one name", "give each a name of its own")
    found = Case(
        name=name, asks=asks, cite=tuple(table["cite"]), begin=table.get("begin", {}), fast=table.get("fast", False),
        digest=hashlib.sha256(text.encode()).hexdigest()[:16],
        **{key: table[key] for key in ("title", "level", "units", "theory", "says", "licence", "physics")},
    )  # fmt: skip
    scene = first_scene(found)
    if (scene.strip.young is not None) != (found.units == "si"):
        raise BadInput(
            f"{name}.units", found.units, "does not fit strip.young", "with young: si, without: dimensionless"
        )
    for ask in asks:
        _check_keys(found, scene, ask)
    return found


def first_scene(case: Case) -> Scene:
    """The physics as a scene of the first energy that can be asked for it: some physics are for some models alone.
    `BadInput` of the usual one where there is none."""
    faults: list[BadInput] = []
    for energy in ("auto", *registry.energies()):
        try:
            return case.scene({"energy": energy})
        except BadInput as fault:
            faults.append(fault)
    raise faults[0]


def _check_keys(case: Case, scene: Scene, ask: Ask) -> None:
    """Every value that the physics is asked over makes a scene."""
    values = ask.between if ask.of == "critical" else ask.over[1] if ask.over is not None else ()
    key = ask.key if ask.of == "critical" else ask.over[0] if ask.over is not None else ""
    for value in values:
        scene.replace({key: value})
    if ask.on and ask.on not in {"start", "end", *(wall.name for wall in scene.walls)}:
        raise BadInput(f"{case.name}.ask.on", ask.on, "is no end and no wall", "give start, end or the name of a wall")


@functools.cache
def shipped() -> tuple[str, ...]:
    """Names of the cases that come with the package."""
    folder = resources.files("compare.suite").joinpath("cases")
    return tuple(sorted(file.name[:-5] for file in folder.iterdir() if file.name.endswith(".toml")))


@functools.cache
def load(name: str) -> Case:
    """A shipped case by its name. `BadInput` for a name that none has."""
    if name not in shipped():
        raise BadInput("CASE", name, "is no case of the suite and no file", "ribbonbench suite list shows all")
    file = resources.files("compare.suite").joinpath("cases", f"{name}.toml")
    return read(file.read_text(encoding="utf-8"), name)


def chosen(words: Sequence[str], fast: bool = False) -> tuple[Case, ...]:
    """Cases by name, level, part of a name, path of a file or folder of one's own; none said: all that are shipped.
    fast: those alone that take seconds."""
    found = [load(name) for name in shipped()] if not words else list(
        itertools.chain.from_iterable(map(_of_word, words))
    )  # fmt: skip
    return tuple({case.name: case for case in found if case.fast or not fast}.values())


def _of_word(word: str) -> list[Case]:
    path = Path(word)
    if word.endswith(".toml") or path.is_dir():
        files = sorted(path.glob("*.toml")) if path.is_dir() else [path]
        if not files or not all(file.is_file() for file in files):
            raise BadInput("CASE", word, "is no file of a case", "give a TOML file, or a folder of them")
        return [read(file.read_text(encoding="utf-8"), file.stem) for file in files]
    if word in shipped():
        return [load(word)]
    cases = [load(name) for name in shipped()]
    found = [case for case in cases if word == case.level] or [case for case in cases if word in case.name]
    if not found:
        load(word)
    return found
