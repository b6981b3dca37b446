"""A table as data: columns with key, heading, unit and kind, rows of values; text is made at the edge.

CSV, JSON, Markdown, HTML and the terminal are all made from the same `Table`: none of them is told a column apart.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from compare.record.column import LAST, USUAL, Cell, Column
from compare.record.quantity import ABSENT, Item, Quantity
from ribbonbench.numbers import of_numpy

__all__ = ["LAST", "USUAL", "Cell", "Column", "Rows", "Table"]

Rows = tuple[tuple[Cell, ...], ...]


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
    def of(cls, title: str, quantities: Sequence[Quantity[Item]], items: Iterable[Item], legend: str = "") -> Table:
        """One row for each item, with the columns of the quantities; empty where an item has no such thing."""
        columns = tuple(column for quantity in quantities for column in quantity.columns)
        rows = tuple(
            tuple(
                None if cell is ABSENT else cell
                for quantity in quantities
                for cell in quantity.cells(quantity.of(item))
            )
            for item in items
        )
        return cls(title, columns, rows, legend)

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
    if of_numpy(cell):
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
