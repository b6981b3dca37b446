"""Grids of scenes: axes of keys and values, their product, and one scene (strictly read) for each point."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from compare.scene.declare import Kind
from compare.scene.keys import KEYS, contract_name
from compare.scene.scene import Scene, parse_assignment
from ribbonbench.errors import BadInput

MOST_CASES = 1_000_000
#: Numbers that Python writes and TOML does not: ".5" and "1.".
_SHORT, _OPEN = re.compile(r"(?<![\w.])\.(?=\d)"), re.compile(r"(?<=\d)\.(?=[,\]\s]|$)")
_SPACED = re.compile(r"(log|linear)\s*\((.*)\)")


@dataclass(frozen=True)
class Axis:
    """One key, or several that change together (`keys`), and the values it takes, one tuple per point."""

    keys: tuple[str, ...]
    values: tuple[tuple[Any, ...], ...]

    @classmethod
    def of(cls, key: str, values: Sequence[Any]) -> Axis:
        """An axis of a single key."""
        return cls((key,), tuple((value,) for value in values))


@dataclass(frozen=True)
class Point:
    """A point of a grid: its number, the keys that it gives, and the scene."""

    number: int
    values: Mapping[str, Any]
    scene: Scene


Value = float | list[float]
"""What an axis goes from and to: a number, or a vector."""


def spaced(kind: str, first: Value, last: Value, count: int) -> list[Any]:
    """`count` values from `first` to `last`, both included: equal differences ("linear", vectors by component) or, of
    numbers, ratios ("log").

    Rounded to 12 digits, so that the ends, and powers of ten between them, are what one would write.
    """
    if count == 1:
        return [first]
    if isinstance(first, list) or isinstance(last, list):
        assert isinstance(first, list)
        assert isinstance(last, list)
        return [
            list(v) for v in zip(*(spaced(kind, a, b, count) for a, b in zip(first, last, strict=True)), strict=True)
        ]
    if kind == "log":
        low, high = math.log10(first), math.log10(last)
        return [float(f"{10 ** (low + (high - low) * k / (count - 1)):.12g}") for k in range(count)]
    return [float(f"{first + (last - first) * k / (count - 1):.12g}") for k in range(count)]


def checked_spaced(kind: str, first: Any, last: Any, count: Any, given: Callable[[str], tuple[str, Any]]) -> list[Any]:
    """`spaced` of what somebody has written. `BadInput` for ends that are no numbers or vectors of one size, no count,
    ratios of what is not above zero; given: from "first", "last", "count" or "spacing" to the key and value it names.
    """
    sizes = []
    for name, end in (("first", first), ("last", last)):
        parts = end if isinstance(end, list) else [end]
        if not parts or not all(isinstance(v, int | float) and not isinstance(v, bool) for v in parts):
            raise BadInput(*given(name), "is no number or vector", "e.g. 0.9, or [0, 0, 0.9]")
        if not all(math.isfinite(v) for v in parts):
            raise BadInput(*given(name), "is not finite", "give a finite number")
        sizes.append(len(end) if isinstance(end, list) else 0)
    if sizes[0] != sizes[1]:
        raise BadInput(*given("last"), "is not of the size of the first", "e.g. from [0, 0, 0.9] to [0, 0, 0.8]")
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MOST_CASES:
        raise BadInput(*given("count"), "is not a number of values", "a whole number >= 1, e.g. 9")
    if kind == "log" and (sizes[0] or not (first > 0.0 and last > 0.0)):
        raise BadInput(*given("spacing"), "takes equal ratios of numbers above zero", "use linear, or other ends")
    first, last = ([float(v) for v in end] if isinstance(end, list) else float(end) for end in (first, last))
    return spaced(kind, first, last, count)


def parse_axis(text: str, option: str = "--vary") -> Axis:
    """An axis from KEY=V1,V2,... or KEY=[V1, V2, ...] (TOML; a V may be a vector), or a range of numbers or vectors:
    KEY=FIRST:LAST:COUNT, KEY=linear(FIRST,LAST,COUNT), or of numbers KEY=log(FIRST,LAST,COUNT)."""
    key, equals, right = text.partition("=")
    key, right = key.strip(), right.strip()
    if not equals or not key or not right:
        raise BadInput(option, text, "is not KEY=VALUES", f"e.g. {option} strip.gamma=10,100,1000")
    spacing = _SPACED.fullmatch(right)
    if spacing is not None:
        found = _toml_list(key, f"[{spacing[2]}]")
        if found is None or len(found) != 3:
            raise BadInput(
                option, text, f"{spacing[1]}(...) takes first, last and how many",
                f"e.g. {option} 'strip.gamma=log(0.01,1e6,50)'",
            )  # fmt: skip
        return Axis.of(key, checked_spaced(spacing[1], found[0], found[1], found[2], lambda _: (option, text)))
    if '"' not in right and right.count(":") == 2:
        found = _toml_list(key, f"[{right.replace(':', ',')}]")
        if found is None or len(found) != 3:
            raise BadInput(option, text, "is no range FIRST:LAST:COUNT", f"e.g. {option} strip.gamma=1:100:12")
        return Axis.of(key, checked_spaced("linear", found[0], found[1], found[2], lambda _: (option, text)))
    about = KEYS.get(contract_name(key))
    vector = about is not None and about.kind in (Kind.VECTOR, Kind.DIRECTION)
    values = _toml_list(key, right) if right.startswith("[") else None
    if values is None or (vector and not all(isinstance(value, list) for value in values)):
        values = _toml_list(key, f"[{right}]")
    if values is None:
        raise BadInput(
            option, text, "has values that are not TOML", 'give numbers, or texts in quotes: 1.0,2.0 or "a","b"'
        )
    return checked(Axis.of(key, values), option)


def _toml_list(key: str, text: str) -> list[Any] | None:
    """A list in TOML; None: it is none. Numbers may be written as Python's (1., .5)."""
    try:
        _, values = parse_assignment(f"{key}={_SHORT.sub(r'0.', _OPEN.sub(r'.0', text))}")
    except BadInput:
        return None
    return values if isinstance(values, list) else None


def checked(axis: Axis, where: str) -> Axis:
    """The axis, when it has values and none twice."""
    if not axis.values:
        raise BadInput(where, ", ".join(axis.keys), "has no values", "give one at least")
    seen: list[Any] = []
    for value in axis.values:
        if value in seen:
            raise BadInput(where, ", ".join(axis.keys), f"has the value {value[0]!r} twice", "give each value once")
        seen.append(value)
    return axis


@dataclass(frozen=True)
class Grid:
    """The points of a grid, the last axis fastest, each made when it is asked for.

    BadInput: a key is varied twice, or there are more than `most` points.
    """

    scene: Scene
    axes: tuple[Axis, ...]
    most: int = MOST_CASES

    def __post_init__(self) -> None:
        names = [key for axis in self.axes for key in axis.keys]
        for name in names:
            if names.count(name) > 1:
                raise BadInput(name, None, "is varied twice", "give one axis per key")
        if len(self) > self.most:
            raise BadInput("grid", len(self), f"has more than {self.most} cases", "give fewer values")

    def __len__(self) -> int:
        return math.prod(len(axis.values) for axis in self.axes)

    def values(self, number: int) -> dict[str, Any]:
        """The varied keys at a point."""
        return values_at(self.axes, number)

    def point(self, number: int) -> Point:
        """A point with its scene; an unknown key or an impossible value raises `BadInput`."""
        values = self.values(number)
        try:
            there = self.scene.replace(values) if values else self.scene
        except BadInput as error:
            raise at_point(error, number, values) from None
        return Point(number, values, there)


def values_at(axes: Sequence[Axis], number: int) -> dict[str, Any]:
    """The varied keys at a point of the grid of these axes, the last one fastest."""
    chosen: list[tuple[Any, ...]] = []
    for axis in reversed(axes):
        number, place = divmod(number, len(axis.values))
        chosen.append(axis.values[place])
    return {
        key: value
        for axis, group in zip(axes, reversed(chosen), strict=True)
        for key, value in zip(axis.keys, group, strict=True)
    }


def at_point(error: BadInput, number: int, values: Mapping[str, Any]) -> BadInput:
    """An error with the point at which it stands."""
    where = ", ".join(f"{key} = {value}" for key, value in values.items())
    return BadInput(error.key, error.value, f"{error.problem} (point {number}: {where})", error.remedy)


def points(scene: Scene, axes: Sequence[Axis]) -> list[Point]:
    """One scene for each point of the grid, the last axis fastest; an unknown key or an impossible value raises
    `BadInput` before anything is computed."""
    grid = Grid(scene, tuple(axes))
    return [grid.point(number) for number in range(len(grid))]
