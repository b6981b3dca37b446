"""A table as data: columns with key, heading, unit and kind, rows of values; text is made at the edge.

CSV, JSON, Markdown, HTML and the terminal are all made from the same `Table`: none of them is told a column apart.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

Scalar = str | float | int | bool | None
Cell = Scalar | tuple[float | int | str, ...]
"""A value: a number, a word, a truth value, None for what is not known, or several numbers (a position, a mesh)."""
Rows = tuple[tuple[Cell, ...], ...]
Item = TypeVar("Item")

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


ColumnOf = tuple[Column, Callable[[Item], Any]]
"""A column and what takes its value from an item, of which a table has one in each row."""


@dataclass(frozen=True)
class Table:
    """A table: `rows` hold values in the order of `columns`, `below` rows that stand under a line (a limit, a sum; not
    in CSV; a word may stand in their first cell, None is a blank); `legend` what all columns have in common.

    NumPy's scalars become Python's, numbers that are not finite None. ValueError: two columns of one key, a row of
    another length, a value that is not of its column's kind, such as a number that somebody has made text of.
    """

    title: str
    columns: tuple[Column, ...]
    rows: Rows = ()
    legend: str = ""
    below: Rows = ()

    def __post_init__(self) -> None:
        keys = self.keys
        if len(set(keys)) != len(keys):
            raise ValueError(f"{self.title!r} has two columns of one key: {', '.join(keys)}")
        for name in ("rows", "below"):
            object.__setattr__(self, name, tuple(tuple(map(_plain, row)) for row in getattr(self, name)))
        for row in (*self.rows, *self.below):
            if len(row) != len(keys):
                raise ValueError(f"a row of {self.title!r} has {len(row)} cells, not {len(keys)}")
        for row in (*self.rows, *(row[1:] for row in self.below)):
            for column, cell in zip(self.columns[len(keys) - len(row) :], row, strict=True):
                if not column.takes(cell):
                    raise ValueError(f"{self.title!r}, column {column.key!r}: {cell!r} is no {column.kind}")

    @classmethod
    def of(
        cls,
        title: str,
        columns: Sequence[ColumnOf[Item]],
        items: Iterable[Item],
        legend: str = "",
    ) -> Table:
        """One row for each item; every column stands beside the function that takes its value from an item."""
        rows = tuple(tuple(value(item) for _, value in columns) for item in items)
        return cls(title, tuple(column for column, _ in columns), rows, legend)

    @classmethod
    def of_records(
        cls, title: str, columns: Sequence[Column], records: Iterable[Mapping[str, Any]], legend: str = ""
    ) -> Table:
        """One row for each record, a mapping from keys to values: None where it has no such key."""
        rows = tuple(tuple(record.get(column.key) for column in columns) for record in records)
        return cls(title, tuple(columns), rows, legend)

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys of the columns."""
        return tuple(column.key for column in self.columns)

    def values(self, key: str) -> tuple[Cell, ...]:
        """The values of a column, without what stands below."""
        place = self.keys.index(key)
        return tuple(row[place] for row in self.rows)

    def records(self) -> list[dict[str, Cell]]:
        """The rows as mappings from keys to values, for JSON."""
        return [dict(zip(self.keys, row, strict=True)) for row in self.rows]

    def select(self, keys: Iterable[str]) -> Table:
        """The table with these columns alone, in this order."""
        places = [self.keys.index(key) for key in keys]
        cut = tuple(self.columns[k] for k in places)
        rows, below = (tuple(tuple(row[k] for k in places) for row in part) for part in (self.rows, self.below))
        return replace(self, columns=cut, rows=rows, below=below)

    def known(self) -> Table:
        """The table without columns that have no value in any row."""
        every = (*self.rows, *self.below)
        return self.select(c.key for k, c in enumerate(self.columns) if any(row[k] not in (None, "") for row in every))

    def texts(self) -> list[tuple[str, ...]]:
        """The rows as a reader sees them, those below at the end."""
        texts = [tuple(c.text(cell) for c, cell in zip(self.columns, row, strict=True)) for row in self.rows]
        return texts + [
            tuple("" if cell is None else c.text(cell) for c, cell in zip(self.columns, row, strict=True))
            for row in self.below
        ]

    def explanation(self) -> str:
        """The legend: what all columns have in common, then what each of them means."""
        each = "; ".join(f"{c.heading}: {c.legend}" for c in self.columns if c.legend)
        return " ".join(part for part in (self.legend, each and f"{each}.") if part)

    def right_aligned(self) -> list[bool]:
        """Whether each column stands to the right: numbers and truth values, and plain columns that hold no other
        word than one that reads as a number."""
        columns: Sequence[Sequence[Cell]] = list(zip(*self.rows, strict=True)) or [()] * len(self.columns)
        return [
            column.kind != "word" and (column.kind != "plain" or all(map(_reads_as_number, cells)))
            for column, cells in zip(self.columns, columns, strict=True)
        ]


def _plain(cell: Any) -> Cell:
    """A value in Python's own types: lists and arrays as tuples, NumPy's scalars as numbers."""
    if hasattr(cell, "tolist") and hasattr(cell, "dtype"):  # NumPy's, without importing it
        cell = cell.tolist()
    if isinstance(cell, list | tuple):
        return tuple(_plain(part) for part in cell)  # type: ignore[misc]
    if isinstance(cell, float) and not math.isfinite(cell):
        return None  # as in JSON: a number that is none is not known
    if cell is None or isinstance(cell, str | bool | int | float):
        return cell
    raise ValueError(f"{cell!r} is no value of a table")


def _reads_as_number(cell: Cell) -> bool:
    if not isinstance(cell, str) or cell in ("", "-"):
        return True
    try:
        float(cell)
    except ValueError:
        return False
    return True
