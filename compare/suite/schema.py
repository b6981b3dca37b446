"""JSON schema, the part of draft 2020-12 that `schema.json` uses: its keywords are all checked, others refused.

No library for it is a dependency of this package; the file is read by any other validator as well.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Mapping
from importlib import resources
from typing import Any

from ribbonbench.errors import BadInput

Document = Mapping[str, Any]
#: Keywords that say nothing of a value.
_WORDS = {"$schema", "$id", "title", "description"}


@functools.cache
def schema() -> Document:
    """The schema of a case."""
    found: Document = json.loads(resources.files("compare.suite").joinpath("schema.json").read_text(encoding="utf-8"))
    return found


def _number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < float("inf")


_TYPES: Mapping[str, Callable[[object], bool]] = {
    "object": lambda value: isinstance(value, Mapping),
    "array": lambda value: isinstance(value, list),
    "string": lambda value: isinstance(value, str),
    "boolean": lambda value: isinstance(value, bool),
    "number": _number,
}
#: Keyword -> (whether the value keeps it, what is wrong otherwise); asked of values of the right type alone.
_RULES: Mapping[str, tuple[Callable[[Any, Any], bool], str]] = {
    "const": (lambda value, bound: value == bound and type(value) is type(bound), "is not {}"),
    "enum": (lambda value, bound: value in bound, "is none of {}"),
    "minLength": (lambda value, bound: len(value) >= bound, "is shorter than {}"),
    "minItems": (lambda value, bound: not isinstance(value, list) or len(value) >= bound, "has fewer than {} entries"),
    "maxItems": (lambda value, bound: not isinstance(value, list) or len(value) <= bound, "has more than {} entries"),
    "minimum": (lambda value, bound: value >= bound, "is below {}"),
    "maximum": (lambda value, bound: value <= bound, "is above {}"),
    "exclusiveMinimum": (lambda value, bound: value > bound, "is not above {}"),
}


def check(value: Any, rules: Document, where: str = "case") -> None:
    """`BadInput` that names the first place at which `value` breaks the rules. ValueError for a keyword that is not
    known here."""
    wanted = rules.get("type")
    if wanted is not None:
        names = [wanted] if isinstance(wanted, str) else list(wanted)
        if not any(_TYPES[name](value) for name in names):
            raise BadInput(where, value, "is of the wrong kind", f"give {' or '.join(names)}")
    for keyword, bound in rules.items():
        if keyword in _RULES:
            keeps, problem = _RULES[keyword]
            if not keeps(value, bound):
                shown = " ".join(map(str, bound)) if isinstance(bound, list) else str(bound)
                raise BadInput(where, value, problem.format(shown), "mend it (docs/suite.md)")
        elif keyword not in {*_WORDS, "type", "required", "properties", "additionalProperties", "items"}:
            raise ValueError(f"the keyword {keyword} is not known")
    if isinstance(value, Mapping):
        _check_members(value, rules, where)
    elif isinstance(value, list) and "items" in rules:
        for index, item in enumerate(value):
            check(item, rules["items"], f"{where}.{index}")


def _check_members(value: Document, rules: Document, where: str) -> None:
    known: Document = rules.get("properties", {})
    for name in rules.get("required", ()):
        if name not in value:
            raise BadInput(f"{where}.{name}", None, "is missing", "add it (docs/suite.md)")
    for name, item in value.items():
        if name in known:
            check(item, known[name], f"{where}.{name}")
        elif rules.get("additionalProperties") is False:
            raise BadInput(f"{where}.{name}", None, "is not a key of a case", f"known are {', '.join(known)}")
