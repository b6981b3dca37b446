"""Grids of scenes: axes of keys and values, their product, and one scene (strictly read) for each point."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from compare.errors import BadInput
from compare.scene.scene import Scene, parse_assignment

MOST_CASES = 1_000_000
_SPACED = re.compile(r"(log|linear)\(([^,]+),([^,]+),([^,]+)\)")


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


def spaced(kind: str, first: float, last: float, count: int) -> list[float]:
    """`count` values from `first` to `last`, both included: equal differences ("linear") or ratios ("log").

    Rounded to 12 digits, so that the ends, and powers of ten between them, are what one would write.
    """
    if count == 1:
        return [first]
    if kind == "log":
        low, high = math.log10(first), math.log10(last)
        return [float(f"{10 ** (low + (high - low) * k / (count - 1)):.12g}") for k in range(count)]
    return [float(f"{first + (last - first) * k / (count - 1):.12g}") for k in range(count)]


def parse_axis(text: str, option: str = "--vary") -> Axis:
    """An axis from KEY=V1,V2,... or KEY=[...] (TOML), KEY=log(FIRST,LAST,COUNT) or KEY=linear(FIRST,LAST,COUNT)."""
    key, equals, right = text.partition("=")
    key, right = key.strip(), right.strip()
    if not equals or not key or not right:
        raise BadInput(option, text, "is not KEY=VALUES", f"e.g. {option} strip.gamma=10,100,1000")
    spacing = _SPACED.fullmatch(right.replace(" ", ""))
    if spacing is not None:
        return Axis.of(key, _spaced_values(option, text, *spacing.groups()))
    if not right.startswith("["):
        right = f"[{right}]"
    try:
        _, values = parse_assignment(f"{key}={right}")
    except BadInput:
        values = None
    if not isinstance(values, list):
        raise BadInput(
            option, text, "has values that are not TOML", 'give numbers, or texts in quotes: 1.0,2.0 or "a","b"'
        )
    return checked(Axis.of(key, values), option)


def _spaced_values(option: str, text: str, kind: str, first: str, last: str, count: str) -> list[float]:
    try:
        low, high, number = float(first), float(last), int(count)
    except ValueError:
        raise BadInput(
            option, text, f"{kind}(...) takes first, last and how many", f"e.g. {option} 'strip.gamma=log(0.01,1e6,50)'"
        ) from None
    if number < 1 or not math.isfinite(low) or not math.isfinite(high):
        raise BadInput(option, text, "has no values", "give finite ends and a count of 1 or more")
    if kind == "log" and not (low > 0.0 and high > 0.0):
        raise BadInput(option, text, "equal ratios need ends above zero", "use linear(...), or other ends")
    return spaced(kind, low, high, number)


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


def points(scene: Scene, axes: Sequence[Axis]) -> list[Point]:
    """One scene for each point of the grid, the last axis fastest; an unknown key or an impossible value raises
    `BadInput` before anything is computed."""
    names = [key for axis in axes for key in axis.keys]
    for name in names:
        if names.count(name) > 1:
            raise BadInput(name, None, "is varied twice", "give one axis per key")
    size = math.prod(len(axis.values) for axis in axes)
    if size > MOST_CASES:
        raise BadInput("grid", size, f"has more than {MOST_CASES} cases", "give fewer values")
    return list(_points(scene, axes))


def _points(scene: Scene, axes: Sequence[Axis]) -> Iterator[Point]:
    for number, chosen in enumerate(itertools.product(*(axis.values for axis in axes))):
        values = {
            key: value
            for axis, group in zip(axes, chosen, strict=True)
            for key, value in zip(axis.keys, group, strict=True)
        }
        try:
            there = scene.replace(values) if values else scene
        except BadInput as error:
            where = ", ".join(f"{key} = {value}" for key, value in values.items())
            problem = f"{error.problem} (point {number}: {where})"
            raise BadInput(error.key, error.value, problem, error.remedy) from None
        yield Point(number, values, there)
