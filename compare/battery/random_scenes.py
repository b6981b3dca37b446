"""Scenes at random, from the declared keys: most of them nearly right, some wild. The same number is the same scene."""

from __future__ import annotations

import json
import math
import random
from collections.abc import Callable
from typing import Any

from compare.scene.declare import Key, Kind
from compare.scene.keys import KEYS, SHELL

#: What every random scene is made from: small, cheap, and with a budget that ends it soon.
BUDGET = 1.0
_STRIP = {"length": 1.0, "width": 0.05, "thickness": 1e-3, "poisson": 0.4, "gamma": 10.0}
_START = {"position": [0.0, 0.0, 0.0], "tangent": [1.0, 0.0, 0.0], "normal": [0.0, 0.0, 1.0]}
_END = {"position": [0.8, 0.0, 0.1], "tangent": [1.0, 0.0, 0.0], "normal": [0.0, 0.0, 1.0]}
_FLOOR = {"point": [0.0, 0.0, -0.2], "normal": [0.0, 0.0, 1.0]}
_BASES: tuple[dict[str, Any], ...] = (
    {"gravity": {"up": [0.0, 0.0, 1.0]}, "clamp": {"start": _START}},
    {"gravity": {"up": [0.0, 0.0, 1.0]}, "clamp": {"start": _START, "end": _END}},
    {"clamp": {"start": _START, "end": _END}, "strip": {"natural_curvature": 3.0}},
    {"closure": {"kind": "circle"}},
    {"closure": {"kind": "moebius"}},
    {"gravity": {"up": [0.0, 1.0, 0.0]}, "clamp": {"start": _START}, "wall": [_FLOOR]},
)  # fmt: skip

#: Texts that mean something to somebody: markup, formulas, paths, control characters, marks that turn a line round.
WORDS = (
    "", "x", "<script>alert(1)</script>", "</title><img src=x onerror=alert(1)>", '"><svg onload=alert(1)>',
    "=cmd|'/c calc'!A1", "+1+1", "-1+1", "@SUM(A1)", "\t=1+1", "../../etc/passwd", "/etc/passwd", "..", "a/b", "a\\b",
    "\x1b[31mred\x1b[0m", "\x1b]0;title\x07", "bell\x07", "nul\x00", "line\nbreak", "line\r\n=1+1", "\u202egnp.exe",
    "\u2066isolated", "\ufeffmark", "| a | b |", "[link](javascript:alert(1))", "![](x)", "`code`", "**bold**", "$x$",
    "&amp;", "{{7*7}}", "${HOME}", "%s%n", "\ud7ff", "\U0001f600", "e\u0301", "a" * 5000, "NaN", "true", "]", "'", '"',
    "CON", "nul.txt", "$\\frac{$", "-rf", "--help", "~", ".", "#", ";", "a,b", "\u2028",
)  # fmt: skip

_NUMBERS = (0.0, -0.0, 1.0, -1.0, 0.5, 1e-3, 1e3, 1e-12, 1e12, 1e-300, 1e300, 5e-324, math.inf, -math.inf, math.nan)
_ODD: tuple[Any, ...] = (
    True,
    "text",
    [],
    [[]],
    {},
    10**400,
    -1,
    0,
    [1.0, "x"],
    [math.nan] * 3,
    "1.0",
    [0.0, 0.0],
    [0.0] * 3,
    [1e308] * 3,
)


def scene_text(number: int, changes: int = 3, wild: float = 0.2) -> str:
    """The TOML of random scene `number`: one of six small scenes with up to so many keys set at random.

    wild: share of the values that are of any kind at all; the others are of the right kind, at times at the edge of
    what is right or beyond.
    """
    chance = random.Random(number)
    scene = json.loads(json.dumps(chance.choice(_BASES)))
    scene["strip"] = {**_STRIP, **scene.get("strip", {})}
    scene["model"] = {"elements": chance.choice((2, 4, 6)), "budget": BUDGET}
    names = [name for name in KEYS if name != "model.budget"]
    for _ in range(chance.randint(1, changes)):
        name = chance.choice(names)
        value = (
            chance.choice((*_ODD, *WORDS)) if chance.random() < wild else _VALUES[KEYS[name].kind](KEYS[name], chance)
        )
        _set(scene, name, value, chance)
    if chance.random() < 0.1 * wild:
        scene[chance.choice(WORDS[1:])] = chance.choice(_ODD)
    return toml(scene)


def _set(scene: dict[str, Any], name: str, value: Any, chance: random.Random) -> None:
    """Sets a key; walls and stages of a path are lists, a stage sets a key of another section."""
    section, _, field = name.rpartition(".")
    if section in ("wall", "path"):
        rows = scene.setdefault(section, [])
        if section == "path":
            moved = chance.choice([key for key in KEYS if not key.startswith(("path", "wall", SHELL))])
            rows.append({moved: _value(KEYS[moved], chance), field: value})
        elif rows and chance.random() < 0.7:
            rows[0][field] = value
        else:
            rows.append({"point": [0.0, 0.0, -0.3], "normal": [0.0, 0.0, 1.0], field: value})
        return
    place = scene
    for part in section.split(".") if section else ():
        place = place.setdefault(part, {})
    place[field] = value


def _number(key: Key, chance: random.Random) -> float:
    try:
        usual = abs(float(key.example)) or 1.0
    except ValueError:
        usual = 1.0
    if chance.random() < 0.15:
        return chance.choice(_NUMBERS)
    value = usual * 10.0 ** chance.gauss(0.0, 0.7)
    if key.range is not None and not key.range.holds(value) and chance.random() < 0.9:
        return usual
    return -value if key.range is None and chance.random() < 0.5 else value


def _direction(key: Key, chance: random.Random) -> list[float]:
    if chance.random() < 0.6:
        unit = [0.0, 0.0, 0.0]
        unit[chance.randrange(3)] = chance.choice((1.0, -1.0))
        return unit
    found = [chance.gauss(0.0, 1.0) for _ in range(3)]
    size = math.hypot(*found)
    return [x / size for x in found] if chance.random() < 0.9 else found


def _point(chance: random.Random) -> list[float]:
    return [chance.uniform(-1.0, 1.0) for _ in range(3)]


def _choice(key: Key, chance: random.Random) -> str:
    return chance.choice([*key.choices, *key.later]) if key.choices and chance.random() < 0.95 else chance.choice(WORDS)


def _count(key: Key, chance: random.Random) -> int:
    return chance.choice((0, 1, 1, 2, 2, 3, 5, 8, 10**6, -1)) if chance.random() < 0.3 else chance.randint(1, 8)


def _table(key: Key, chance: random.Random) -> list[list[float]]:
    """A table along the strip, at times one that does not cover it."""
    inner = sorted(chance.random() for _ in range(chance.randint(0, 3)))
    end = 1.0 if chance.random() < 0.9 else 0.7
    return [[s, _number(key, chance)] for s in (0.0, *inner, end)]


_VALUES: dict[Kind, Callable[[Key, random.Random], Any]] = {
    Kind.NUMBER: _number,
    Kind.NUMBERS: lambda key, chance: [_number(key, chance) for _ in range(chance.randint(1, 3))],
    Kind.LINEAR: lambda key, chance: [_number(key, chance), _number(key, chance)],
    Kind.LAW: lambda key, chance: (
        _table(key, chance) if chance.random() < 0.3 else [_number(key, chance), _number(key, chance)]
    ),
    Kind.PIECEWISE: lambda key, chance: [_number(key, chance) for _ in range(chance.randint(1, 4))],
    Kind.LIST: lambda key, chance: [_number(key, chance) for _ in range(chance.randint(1, 4))],
    Kind.PAIR: lambda key, chance: [_number(key, chance), _number(key, chance)],
    Kind.VECTOR: lambda key, chance: [chance.uniform(-1.0, 1.0) for _ in range(3)],
    Kind.POINTS: lambda key, chance: [_point(chance) for _ in range(chance.randint(1, 6))],
    Kind.DIRECTION: _direction,
    Kind.COUNT: _count,
    Kind.COUNTS: lambda key, chance: [_count(key, chance), _count(key, chance)],
    Kind.TRUTH: lambda key, chance: chance.random() < 0.5,
    Kind.TEXT: lambda key, chance: chance.choice(WORDS),
    Kind.CHOICE: _choice,
}


def _value(key: Key, chance: random.Random) -> Any:
    """A value of the right kind."""
    return _VALUES[key.kind](key, chance)


def toml(value: dict[str, Any]) -> str:
    """A document of inline values: what `tomllib` reads as this dictionary."""
    return "".join(f"{literal(name)} = {_inline(item)}\n" for name, item in value.items())


def _inline(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return literal(value)
    if isinstance(value, float) and not math.isfinite(value):
        return "nan" if math.isnan(value) else ("inf" if value > 0.0 else "-inf")
    if isinstance(value, list):
        return f"[{', '.join(_inline(item) for item in value)}]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{literal(name)} = {_inline(item)}" for name, item in value.items()) + "}"
    return repr(value)


def literal(text: str) -> str:
    """A basic string; every letter that is not plain by its number."""
    plain = (c if " " <= c <= "~" and c not in '"\\' else f"\\U{ord(c):08x}" for c in text)
    return f'"{"".join(plain)}"'
