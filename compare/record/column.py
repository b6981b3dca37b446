"""A column of a table: key, heading, unit and kind; text is made at the edge."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field

Scalar = str | float | int | bool | None
Cell = Scalar | tuple[float | int | str, ...]
"""A value: a number, a word, a truth value, None for what is not known, or several numbers (a position, a mesh)."""

#: How a reader sees a value: format and factor of each kind of number; the digits stand after a colon ("exponent:2").
_NUMBERS = {
    "digits": ("g", 1.0),  # significant digits
    "exponent": ("e", 1.0),  # decimals before the power of ten
    "decimals": ("f", 1.0),
    "seconds": ("g", 1.0),  # a time in s, significant digits; the next two: a time in s, as a reader sees it
    "milliseconds": ("g", 1e3),
    "microseconds": ("f", 1e6),
    "share": ("g", 100.0),  # a part of 1, in percent with significant digits
    "percent": ("f", 100.0),  # the same with decimals
    "interval": ("g", 1.0),  # a number, or the two ends of an interval
}
#: The digits where a kind names none.
_DIGITS = {"digits": 6, "exponent": 1, "decimals": 2, "share": 3, "percent": 2, "interval": 6} | {
    "seconds": 3, "milliseconds": 3, "microseconds": 1,
}  # fmt: skip
#: What stands between the parts of a value that has several.
_BETWEEN = {"interval": " to ", "sizes": " x "}
#: Kinds without digits. plain: whatever the value is, numbers to six digits; sizes: a mesh.
_OTHERS = ("word", "truth", "integer", "sizes", "plain")
#: The rank of a column that says nothing of it, and of one that is for the full table alone.
USUAL, LAST = 5, 9


@dataclass(frozen=True)
class Column:
    """A column of a table.

    key: its name in CSV and JSON; heading: what a reader sees above it; unit: of the stored value ("l", "D w / l", "s",
    "" for pure numbers and words); kind: how a reader sees a value, "word", "truth", "integer", "sizes", "plain" or a
    kind of number with its digits ("exponent:2", see `_NUMBERS`); rank: the columns of the lowest stand in the main
    table (`compare.page.main_table`), the others in the full one; legend: what it means; words: how a reader sees a
    word, or "true" and "false", of the data.
    """

    key: str
    heading: str
    unit: str = ""
    kind: str = "plain"
    rank: int = USUAL
    legend: str = ""
    words: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        name, _, digits = self.kind.partition(":")
        if (name in _OTHERS and not digits) or (name in _NUMBERS and re.fullmatch(r"\d{0,2}", digits)):
            return
        raise ValueError(f"column {self.key!r}: no kind {self.kind!r}")

    @property
    def kind_name(self) -> str:
        """The kind without its digits."""
        return self.kind.partition(":")[0]

    @property
    def is_number(self) -> bool:
        """Its values are numbers."""
        return self.kind_name in _NUMBERS or self.kind_name in ("integer", "sizes")

    def takes(self, cell: Cell) -> bool:
        """Whether a value is of this kind; None always is."""
        if cell is None or self.kind == "plain":
            return True
        if self.kind in ("word", "truth"):
            return isinstance(cell, str if self.kind == "word" else bool)
        parts = cell if isinstance(cell, tuple) else (cell,)
        types = int if self.kind in ("integer", "sizes") else int | float
        return all(isinstance(part, types) and not isinstance(part, bool) for part in parts)

    def text(self, cell: Cell) -> str:
        """A value as a reader sees it: "-" for what is not known."""
        if cell is None:
            return "-"
        if isinstance(cell, bool):
            return self.words.get(str(cell).lower(), "yes" if cell else "no")
        if isinstance(cell, str):
            return self.words.get(cell, cell)
        if isinstance(cell, tuple):
            return _BETWEEN.get(self.kind_name, " ").join(map(self.text, cell))
        if not math.isfinite(cell):
            return "-"
        if self.kind_name not in _NUMBERS:
            return f"{cell:g}" if isinstance(cell, float) else str(cell)
        form, factor = _NUMBERS[self.kind_name]
        digits = self.kind.partition(":")[2] or _DIGITS[self.kind_name]
        return format(factor * cell + 0.0, f".{digits}{form}")  # + 0.0: no -0
