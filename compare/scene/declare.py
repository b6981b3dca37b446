"""How a key of the scene contract is declared: once, on the field of a section's dataclass.

    width: float = key(NUMBER, "width w", LENGTH, "0 < w < length", "0.03")

Reading, writing back, `--set`, errors and the tables of docs/scenes.md all come from such lines (`compare.scene.keys`).
Nothing here knows what a ribbon is.
"""

from __future__ import annotations

import dataclasses
import enum
import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

LENGTH = "the unit of length"
FORCE = "N, or D w / l^2 without strip.young"
MOMENT = "N m, or D w / l without strip.young"
PER_LENGTH = "1/length"
NONE = ""
"""The unit of a number that has none; `unit=None` is for what is no number."""

REQUIRED: Any = object()
"""The default of a key that must be there."""

_BETWEEN = re.compile(r"(?P<low>\S+) (?P<left><=?) (?P<name>[^<]+) (?P<right><=?) (?P<high>[^<]+)")
_KNOWN = re.compile(r"(?:(?P<low>[\d.e+-]+) <= )?(?P<name>[^<>]+?) (?:<= (?P<high>[\d.e+-]+)|>= (?P<least>[\d.e+-]+))")
_ABOVE = re.compile(r"(?:(?P<name>\w+) )?(?P<left>>=?) (?P<low>\S+)")
_ESCAPES = {'"': '\\"', "\\": "\\\\"}


class Kind(enum.Enum):
    """What a value is; the words stand in the tables."""

    NUMBER = "number"
    NUMBERS = "a number or a list"
    LINEAR = "a number, or [at start, at end]"
    LAW = "a number, [at start, at end], or a table [[s, value], ...] from s = 0 to the length"
    PIECEWISE = "a number, [at start, at end] or more at equal distances"
    LIST = "list of numbers"
    PAIR = "two numbers"
    VECTOR = "three numbers"
    DIRECTION = "unit vector"
    POINTS = "a CSV file of x, y, z, or points [[x, y, z], ...]"
    COUNT = "whole number"
    COUNTS = "two whole numbers"
    TRUTH = "true or false"
    TEXT = "text"
    CHOICE = "choice"


_WITHIN = {
    Kind.VECTOR: "three numbers",
    Kind.DIRECTION: "three numbers",
    Kind.COUNT: "a whole number",
    Kind.COUNTS: "whole numbers",
}
"""How a sentence names the kind, before the range and the unit."""

_BEHIND = (Kind.NUMBERS, Kind.LINEAR, Kind.LAW, Kind.PIECEWISE, Kind.POINTS)
"""Kinds that a sentence names behind a colon."""


@dataclass(frozen=True)
class Range:
    """The numbers that are right, as written: "> 0", "each > 1", "-1 < nu <= 0.5" or "0 < w < length".

    An upper end that is not a number depends on other keys: it is checked where they meet, not here.
    """

    text: str
    low: float
    includes_low: bool
    high: float | None
    includes_high: bool

    @classmethod
    def of(cls, text: str) -> Range:
        """The range that `text` says; ValueError when it says none."""
        found = _BETWEEN.fullmatch(text) or _ABOVE.fullmatch(text)
        if found is None:
            raise ValueError(f"no range: {text!r}")
        parts = found.groupdict()
        try:
            high = float(parts["high"]) if "high" in parts else None
        except ValueError:
            high = None
        return cls(text, float(parts["low"]), parts["left"].endswith("="), high, parts.get("right") == "<=")

    def holds(self, value: float) -> bool:
        above = value >= self.low if self.includes_low else value > self.low
        return above and (self.high is None or (value <= self.high if self.includes_high else value < self.high))

    def problem(self, entry: bool) -> str:
        """What is wrong with a number outside, or with a list that has such an `entry`."""
        if self.high is not None:
            return f"has an entry outside {self.text}" if entry else f"lies outside {self.text}"
        if self.includes_low and self.low == 0.0:
            return "has a negative entry" if entry else "must not be negative"
        bound = ("at least " if self.includes_low else "greater than ") + (f"{self.low:g}" if self.low else "zero")
        return f"has an entry that is not {bound}" if entry else f"must be {bound}"


@dataclass(frozen=True)
class Known:
    """The dimensionless numbers for which the models are known to work: "-1e4 <= K l <= 1e4", "Gamma <= 1e12" or
    "h / l >= 1e-8", each entry where there are several. `compare.scene.inputs.known` checks them."""

    text: str
    symbol: str
    low: float
    high: float

    @classmethod
    def of(cls, text: str) -> Known:
        """The numbers that `text` says; ValueError when it says none."""
        found = _KNOWN.fullmatch(text)
        if found is None:
            raise ValueError(f"no numbers: {text!r}")
        low = found["low"] or found["least"]
        high = float(found["high"]) if found["high"] else math.inf
        return cls(text, found["name"], -math.inf if low is None else float(low), high)

    def holds(self, number: float) -> bool:
        """Whether a number is one of them."""
        return self.low <= number <= self.high


@dataclass(frozen=True)
class Key:
    """One declared key.

    name : dotted, set when the section is known ("clamp.start.position").
    example : a value that is right, as TOML.
    unit : None for what is no number, `NONE` for a number without unit.
    known : the dimensionless numbers for which the models are known to work; None: no number, or all in `range`.
    default : what an absent key is read as; REQUIRED: it must be there.
    defaults : the default in single sections, where one dataclass is read in several.
    choices : the texts allowed, each with what it means (may be empty).
    later : texts known but not available in this version, each with what to do instead.
    also : whether a text that is none of the choices is allowed all the same: the energy of a model from outside.
    words : texts allowed beside numbers, each with its meaning and the value that the field gets.
    absent : what an absent key means, where that is no value of the key.
    note : what else to know, in parentheses.
    hint : what a number outside the range should be, where more is to say than meaning and example.
    newer : left out of a scene's canonical form at its default: the keys that came after the first version of the
        contract, so that the hash of an older scene stays what it was.
    """

    kind: Kind
    about: str
    example: str
    unit: str | None = None
    range: Range | None = None
    known: Known | None = None
    default: Any = REQUIRED
    defaults: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    choices: Mapping[str, str] = dataclasses.field(default_factory=dict)
    later: Mapping[str, str] = dataclasses.field(default_factory=dict)
    also: Callable[[str], bool] = lambda value: False
    words: Mapping[str, tuple[str, Any]] = dataclasses.field(default_factory=dict)
    absent: str = ""
    note: str = ""
    hint: str = ""
    newer: bool = False
    name: str = ""

    @property
    def field(self) -> str:
        """The last part of the name: the key as its section writes it."""
        return self.name.rpartition(".")[2]

    @property
    def required(self) -> bool:
        return self.default is REQUIRED

    @property
    def meaning(self) -> str:
        """All of it as one sentence, for remedies and the comments of a scene that is written."""
        said = self.about
        within = " ".join(filter(None, (_WITHIN.get(self.kind, ""), self.range.text if self.range else "")))
        if within:
            said += f", {within}"
        if self.unit == NONE:
            said += " without unit" if self.kind in _WITHIN else ", no unit"
        elif self.unit is not None:
            said += f"{'' if self.kind in _WITHIN else ','} in {self.unit}"
        behind = self.kind.value if self.kind in _BEHIND else listed(self.choices)
        if behind:
            said += f": {behind}"
        for word, (what, _) in self.words.items():
            said += f', or "{word}"' + (f" ({what})" if what else "")
        if not self.note:
            return said
        return f"{said}; {self.note}" if said.endswith(")") else f"{said} ({self.note})"

    def written(self, value: Any) -> Any:
        """The value of the field as the file gives it: tuples as lists, a word where it is meant; None: absent."""
        for word, (_, stands_for) in self.words.items():
            if value is None and stands_for is None:
                return word
        return ([list(x) if isinstance(x, tuple) else x for x in value] or None) if isinstance(value, tuple) else value


def literal(value: Any) -> str:
    """A text, number, truth value or list of them as TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return '"' + "".join(_ESCAPES.get(letter, letter) for letter in value) + '"'
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(literal(item) for item in value) + "]"
    return repr(value)


def listed(choices: Mapping[str, str]) -> str:
    """The choices as a sentence lists them: '"a", "b" (what b is) or "c"'."""
    words = [f'"{word}"' + (f" ({what})" if what else "") for word, what in choices.items()]
    return " or ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))


def declared(
    kind: Kind, about: str, unit: str | None = None, range: str = "", example: str = "", choices: Any = (),
    known: str = "", **more: Any,
) -> Key:  # fmt: skip
    """A key without a field of its own; `choices`: texts, or texts with their meanings; `more`: attributes of `Key`."""
    texts = dict(choices) if isinstance(choices, Mapping) else dict.fromkeys(choices, "")
    within, works = Range.of(range) if range else None, Known.of(known) if known else None
    return Key(kind, about, example, unit, within, works, choices=texts, **more)


def key(
    kind: Kind, about: str, unit: str | None = None, range: str = "", example: str = "", choices: Any = (), **more: Any
) -> Any:
    """The field of a section's dataclass that the key of its name sets; see `declared`."""
    found = declared(kind, about, unit, range, example, choices, **more)
    if found.required:
        return dataclasses.field(metadata={"key": found})
    return dataclasses.field(default=found.default, metadata={"key": found})


def keys_of(spec: type, section: str, at: str = "") -> dict[str, Key]:
    """The keys that a section's dataclass declares, by dotted name in the order of the class; "{at}" in their texts is
    where the section stands. Fields without a declaration, and attributes that are no `Key`, are none."""
    fields = {item.name: item.metadata.get("key") for item in dataclasses.fields(spec)}
    found: dict[str, Key] = {}
    for name in spec.__annotations__:
        one = fields.get(name) or vars(spec).get(name)
        if isinstance(one, Key):
            dotted = f"{section}.{name}" if section else name
            found[dotted] = dataclasses.replace(
                one, name=dotted, about=one.about.replace("{at}", at), default=one.defaults.get(section, one.default)
            )
    return found


def collected(sections: Iterable[Mapping[str, Key]]) -> dict[str, Key]:
    """All keys of the contract; ValueError for a name that is declared twice."""
    found: dict[str, Key] = {}
    for keys in sections:
        for name, one in keys.items():
            if name in found:
                raise ValueError(f"{name} is declared twice")
            found[name] = one
    return found
