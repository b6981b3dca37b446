"""A strict reader for one table of a TOML document: every fault becomes a `BadInput` that names the key.

Nothing here knows what a ribbon is. The declared keys (`Key`, handed in) say of each value its kind and range, and give
meaning, unit and an example for the remedies, so that an error can say what would be right.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, fields
from typing import Any, TypeVar

from compare.scene.declare import Key, Kind
from ribbonbench.errors import BadInput

MAX_ELEMENTS = 100_000
"""Largest number of elements that a scene may ask for: a guard against a slip of the keyboard eating the memory."""


UNIT_TOLERANCE = 1e-9
"""How far a unit vector's length may be from 1, and a scalar product of two orthogonal ones from 0."""

Spec = TypeVar("Spec")


def missing(key: str, keys: Mapping[str, Key], remedy: str = "") -> BadInput:
    """The error for a key that must be there and is not."""
    about = keys[key]
    return BadInput(
        key, None, "is missing", remedy or f"add e.g. {key.rpartition('.')[2]} = {about.example} ({about.meaning})"
    )


def reject_unknown(data: Mapping[str, Any], path: str, keys: Mapping[str, Key]) -> None:
    """Raise for the first key of `data` that the contract does not know.

    `path` is the dotted name of the table ("" at the top); a key is known when it, or something in it, is in `keys`.
    """
    prefix = f"{path}." if path else ""
    for name in data:
        dotted = prefix + name
        known = dotted in keys or any(key.startswith(f"{dotted}.") for key in keys)
        if "." in name or not known:
            here = sorted({name[len(prefix) :].partition(".")[0] for name in keys if name.startswith(prefix)})
            raise BadInput(dotted, brief(data[name]), "is not a known key", _suggest(name, dotted, here, keys))


def brief(value: Any) -> Any:
    """A value as an error shows it: tables are shown by their kind only."""
    if isinstance(value, dict):
        return None
    if isinstance(value, list) and any(isinstance(item, dict) for item in value):
        return None
    return _showable(value)


def _showable(value: Any) -> Any:
    """Python refuses to print integers of more than some 4300 digits; say their size instead."""
    if isinstance(value, int) and not isinstance(value, bool) and value.bit_length() > 1100:
        return f"an integer of {value.bit_length()} bits"
    if isinstance(value, list):
        return [_showable(item) for item in value]
    return value


def _suggest(name: str, dotted: str, here: Collection[str], keys: Mapping[str, Key]) -> str:
    close = difflib.get_close_matches(name.lower(), here, n=1, cutoff=0.6)
    close = close or [known for known in here if len(known) > 3 and known in name.lower()]
    prefix = dotted[: len(dotted) - len(name)]
    if close:
        return f"did you mean {prefix}{close[0]}?"
    elsewhere = [known for known in keys if known.rpartition(".")[2] == name]
    if elsewhere:
        return f"did you mean {elsewhere[0]}?"
    return f"known keys here: {', '.join(here)}"


@dataclass(frozen=True)
class Table:
    """One table, e.g. `[strip]`, with typed access. `path` is its dotted name, `keys` the whole contract."""

    data: Mapping[str, Any]
    path: str
    keys: Mapping[str, Key]

    def __contains__(self, name: str) -> bool:
        return name in self.data

    def dotted(self, name: str) -> str:
        return f"{self.path}.{name}" if self.path else name

    def bad(self, name: str, problem: str, remedy: str = "") -> BadInput:
        """The error for the value that stands at `name`; the remedy defaults to the key's meaning and an example."""
        about = self.keys[self.dotted(name)]
        remedy = remedy or f"give the {about.meaning}, e.g. {name} = {about.example}"
        return BadInput(self.dotted(name), brief(self.data.get(name)), problem, remedy)

    def require(self, name: str) -> Any:
        if name not in self.data:
            raise missing(self.dotted(name), self.keys)
        return self.data[name]

    def read(self, spec: type[Spec]) -> Spec:
        """The section whose dataclass is `spec`: every declared field by its kind and range, absent ones by default."""
        names = [item.name for item in fields(spec)]  # type: ignore[arg-type]
        return spec(**{name: self.value(name) for name in names if self.dotted(name) in self.keys})

    def value(self, name: str) -> Any:
        """The value at `name` as its field holds it; the default when it is absent."""
        about = self.keys[self.dotted(name)]
        if name not in self.data and not about.required:
            return about.default
        value = self.require(name)
        if isinstance(value, str) and about.words:
            if value not in about.words:
                numbers = {Kind.NUMBER: "a number", Kind.VECTOR: "three numbers"}.get(about.kind, "numbers")
                raise self.bad(name, f'is neither "{next(iter(about.words))}" nor {numbers}')
            return about.words[value][1]
        return self._of_kind(name, value, about)

    def _of_kind(self, name: str, value: Any, about: Key) -> Any:
        match about.kind:
            case Kind.NUMBER:
                return self._numbers(name, [value], entry=False)[0]
            case Kind.VECTOR:
                return self._vector(name, value)
            case Kind.POINTS:
                return self._places(name, value)
            case Kind.DIRECTION:
                return self._direction(name, value)
            case Kind.COUNT:
                return self._count(name, value)
            case Kind.COUNTS:
                if not isinstance(value, list) or len(value) != 2:
                    raise self.bad(name, "is not a list of two whole numbers")
                return tuple(self._count(name, item) for item in value)
            case Kind.TRUTH:
                if not isinstance(value, bool):
                    raise self.bad(name, "is not true or false")
                return value
            case Kind.TEXT | Kind.CHOICE:
                if not isinstance(value, str):
                    raise self.bad(name, "is not a text in quotes")
                return value if about.kind is Kind.TEXT else self._choice(name, value, about)
            case Kind.LAW if isinstance(value, list) and any(isinstance(item, list) for item in value):
                return self._points(name, value)
            case _:
                return self._law(name, value, about.kind)

    def _points(self, name: str, value: list[Any]) -> tuple[tuple[float, float], ...]:
        """The points [s, value] of a table, whatever its abscissae."""
        if not all(isinstance(item, list) and len(item) == 2 for item in value):
            raise self.bad(name, "is a table with an entry that is not [s, value]")
        return tuple((self._as_number(name, s), self._as_number(name, y)) for s, y in value)

    def _places(self, name: str, value: Any) -> tuple[tuple[float, float, float], ...]:
        """Points in space; a file's are put in its place before (`compare.scene.inputs.curve`)."""
        points = isinstance(value, list) and value and all(isinstance(item, list) and len(item) == 3 for item in value)
        if not points:
            raise self.bad(name, "is not a list of points [x, y, z]")
        return tuple(self._vector(name, item) for item in value)

    def _law(self, name: str, value: Any, kind: Kind) -> tuple[float, ...]:
        """A list of numbers; where the kind allows one number, it stands for all."""
        if kind is Kind.PAIR and not (isinstance(value, list) and len(value) == 2):
            raise self.bad(name, "is not a list of two numbers")
        if kind is Kind.LIST and not isinstance(value, list):
            raise self.bad(name, "is not a list")
        if value == []:
            raise self.bad(name, "is an empty list")
        given = isinstance(value, list)
        values = self._numbers(name, value if given else [value], entry=given)
        if kind in (Kind.LINEAR, Kind.LAW) and len(values) > 2:
            raise self.bad(
                name, "has more than two entries", f"give one number or [at start, at end], e.g. {name} = [10.0, 0.0]"
            )
        return values * 2 if len(values) == 1 and kind in (Kind.LINEAR, Kind.LAW, Kind.PIECEWISE) else values

    def _numbers(self, name: str, values: list[Any], entry: bool) -> tuple[float, ...]:
        """Finite numbers within the key's range; an integer counts as one, a truth value or a text does not."""
        numbers = tuple(self._as_number(name, item) for item in values)
        within = self.keys[self.dotted(name)].range
        if within is not None and not all(within.holds(number) for number in numbers):
            raise self.bad(name, within.problem(entry), self.keys[self.dotted(name)].hint)
        return numbers

    def _vector(self, name: str, value: Any) -> tuple[float, float, float]:
        if not isinstance(value, list) or len(value) != 3:
            raise self.bad(name, "is not a list of three numbers")
        x, y, z = (self._as_number(name, item) for item in value)
        return x, y, z

    def _direction(self, name: str, value: Any) -> tuple[float, float, float]:
        """A unit vector, to UNIT_TOLERANCE; otherwise the error says what the normalised vector would be."""
        vector = self._vector(name, value)
        norm = math.hypot(*vector)
        if norm == 0.0:
            raise self.bad(name, "has no direction (zero vector)")
        if not abs(norm - 1.0) <= UNIT_TOLERANCE:
            largest = max(abs(c) for c in vector)
            scaled = tuple(c / largest for c in vector)
            length = math.hypot(*scaled)
            raise self.bad(
                name,
                f"is not a unit vector (its length is {norm:.10g})",
                f"normalised it is {show(tuple(c / length for c in scaled))}",
            )
        return vector

    def _count(self, name: str, value: Any) -> int:
        """A whole number within the key's range, and MAX_ELEMENTS at most."""
        if isinstance(value, bool) or not isinstance(value, int):
            raise self.bad(name, "is not a whole number")
        within = self.keys[self.dotted(name)].range
        lowest = 1 if within is None else int(within.low)
        if not lowest <= value <= MAX_ELEMENTS:
            raise self.bad(name, f"must lie between {lowest} and {MAX_ELEMENTS}")
        return value

    def _choice(self, name: str, value: str, about: Key) -> str:
        """One of the choices; the words in `later` are known but not available yet."""
        if value in about.later:
            raise self.bad(name, "is not available in this version", about.later[value])
        if value not in about.choices and not about.also(value):
            close = difflib.get_close_matches(value.lower(), about.choices, n=1, cutoff=0.6)
            hint = f"did you mean {close[0]!r}? " if close else ""
            listed = ", ".join(repr(choice) for choice in about.choices)
            raise self.bad(name, "is not one of the choices", f"{hint}choose from {listed}")
        return value

    def _as_number(self, name: str, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.bad(name, f"is not a number ({_kind(value)})")
        try:
            number = float(value) + 0.0  # -0.0 becomes 0.0, so that equal scenes hash equally
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise self.bad(name, "is not finite")
        return number


def show(vector: tuple[float, ...]) -> str:
    """A vector as it can be pasted into a scene: all digits."""
    return "[" + ", ".join(repr(float(c) + 0.0) for c in vector) + "]"


def _kind(value: Any) -> str:
    kinds = {bool: "a truth value", str: "a text", list: "a list", dict: "a table"}
    return kinds.get(type(value), f"a {type(value).__name__}")
