"""Options that take several values: with commas, with blanks, or as a TOML list, everywhere alike.

--width-to-thickness 20,50,100     --width-to-thickness 20 50 100     --width-to-thickness "[20, 50, 100]"
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Sequence
from typing import Any

#: A word, or a part of one, that is a value of a list behind an option: numbers, brackets, meshes as 50x4.
_VALUE = re.compile(r"[\[\],]*[+-]?(\d|\.\d)[\d.,eExX+\-\]\[]*|[\[\],]+")


class ListOf:
    """The type of an option for argparse: text -> list of `kind`; `count`: exactly so many."""

    def __init__(self, kind: Callable[[str], Any], count: int | None = None) -> None:
        self.kind, self.count = kind, count

    def __call__(self, text: str) -> list[Any]:
        parts = re.sub(r"[\[\],\"']", " ", text).split()
        if self.count == 2 and len(parts) == 1:
            parts = re.split("[xX]", parts[0])
        try:
            values = [self.kind(part) for part in parts]
        except ValueError:
            name = {float: "numbers", int: "whole numbers"}.get(self.kind, "values")  # type: ignore[call-overload]
            raise argparse.ArgumentTypeError(f"{text!r} are not {name}") from None
        if not values or (self.count is not None and len(values) != self.count):
            raise argparse.ArgumentTypeError(f"{text!r} are {len(values)} values, not {self.count or 'one or more'}")
        return values


def joined(words: Sequence[str], options: Sequence[str]) -> list[str]:
    """The words of a command line with the values behind each of the `options` joined into one word."""
    found: list[str] = []
    rest = list(words)
    while rest:
        word = rest.pop(0)
        found.append(word)
        if word == "--":
            return found + rest
        values = []
        if word in options:
            while rest and _VALUE.fullmatch(rest[0].replace(" ", "")):
                values.append(rest.pop(0))
        if values:
            found[-1] = f"{word}={','.join(values)}"  # in one word, since a value may begin with a minus
    return found
