"""A strict reader for one table of a TOML document: every fault becomes a `BadInput` that names the key.

Nothing here knows what a ribbon is. The table of known keys (`Key`, handed in) supplies the meaning, the unit and an
example for the remedies, so that an error can say what would be right.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from compare.errors import BadInput

MAX_ELEMENTS = 100_000
"""Largest number of elements that a scene may ask for: a guard against a slip of the keyboard eating the memory."""


@dataclass(frozen=True)
class Key:
    """One key of the scene contract: what it means (with its unit) and a value that is right."""

    meaning: str
    example: str


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
    here = sorted({name[len(prefix) :].partition(".")[0] for name in keys if name.startswith(prefix)})
    for name in data:
        dotted = prefix + name
        if name not in here:
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

    def number(self, name: str) -> float:
        """A finite number; an integer counts as one, a truth value or a text does not."""
        return self._as_number(name, self.require(name))

    def positive(self, name: str) -> float:
        value = self.number(name)
        if value <= 0.0:
            raise self.bad(name, "must be greater than zero")
        return value

    def vector(self, name: str) -> tuple[float, float, float]:
        """Three finite numbers."""
        value = self.require(name)
        if not isinstance(value, list) or len(value) != 3:
            raise self.bad(name, "is not a list of three numbers")
        x, y, z = (self._as_number(name, item) for item in value)
        return x, y, z

    def numbers(self, name: str) -> tuple[float, ...]:
        """A number or a list of at least one number."""
        value = self.require(name)
        if isinstance(value, list):
            if not value:
                raise self.bad(name, "is an empty list")
            return tuple(self._as_number(name, item) for item in value)
        return (self._as_number(name, value),)

    def linear(self, name: str) -> tuple[float, float]:
        """A law linear in s: one number (constant) or [at start, at end]."""
        values = self.numbers(name)
        if len(values) > 2:
            raise self.bad(
                name, "has more than two entries", f"give one number or [at start, at end], e.g. {name} = [10.0, 0.0]"
            )
        return values[0], values[-1]

    def count(self, name: str, value: Any = None) -> int:
        """A whole number from 1 to MAX_ELEMENTS: `value`, an entry of the list at `name`, or by default all of it."""
        value = self.require(name) if value is None else value
        if isinstance(value, bool) or not isinstance(value, int):
            raise self.bad(name, "is not a whole number")
        if not 1 <= value <= MAX_ELEMENTS:
            raise self.bad(name, f"must lie between 1 and {MAX_ELEMENTS}")
        return value

    def truth(self, name: str) -> bool:
        value = self.require(name)
        if not isinstance(value, bool):
            raise self.bad(name, "is not true or false")
        return value

    def text(self, name: str) -> str:
        value = self.require(name)
        if not isinstance(value, str):
            raise self.bad(name, "is not a text in quotes")
        return value

    def choice(self, name: str, choices: Collection[str], later: Mapping[str, str] | None = None) -> str:
        """One of `choices`; the words in `later` are known but not available yet (value: what to do instead)."""
        later = later or {}
        value = self.text(name)
        if value in later:
            raise self.bad(name, "is not available in this version", later[value])
        if value not in choices:
            close = difflib.get_close_matches(value.lower(), choices, n=1, cutoff=0.6)
            hint = f"did you mean {close[0]!r}? " if close else ""
            listed = ", ".join(repr(choice) for choice in choices)
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


def _kind(value: Any) -> str:
    kinds = {bool: "a truth value", str: "a text", list: "a list", dict: "a table"}
    return kinds.get(type(value), f"a {type(value).__name__}")
