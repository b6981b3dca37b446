"""The one exception that bad input to `ribbon` raises."""

from __future__ import annotations


class RibbonInputError(ValueError):
    """Input that no ribbon can have; the message names the argument, its value and what would be right.

    Attributes: ``key`` (name of the argument), ``value`` (what was given), ``remedy`` (what would be right).
    """

    def __init__(self, key: str, value: object, remedy: str) -> None:
        super().__init__(f"{key} = {value!r}: {remedy}")
        self.key = key
        self.value = value
        self.remedy = remedy
