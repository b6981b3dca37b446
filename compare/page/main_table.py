"""The main table of a full one: six columns that say most, and what all rows have in common as a sentence."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from compare.page.table import Cell, Table

#: Most columns of a main table.
MOST = 6


def main_table(table: Table, most: int = MOST) -> tuple[Table, str]:
    """The table's columns of the lowest rank, `most` of them at the most, in their order, and the sentence on those
    that have one value in all rows ("" for none).

    Columns without any value are left out; of several rows, columns that are the same in each are told in the sentence
    (of many, those of the lowest rank). One column stays at least. A row below with nothing but its name is left out.
    """
    known = with_values(table)
    same = _constant(known)
    if len(same) == len(known.columns):
        same = same[1:]
    varied = [k for k in range(len(known.columns)) if k not in same]
    cut = known.select(known.keys[k] for k in _first(known, varied, most))
    cut = replace(cut, below=tuple(row for row in cut.below if any(cell not in (None, "") for cell in row[1:])))
    facts = [known.columns[k] for k in _first(known, same, most)]
    said = ", ".join(f"{column.heading} {column.text(known.values(column.key)[0])}" for column in facts)
    return cut, said and f"All rows: {said}."


def whole_in_parts(table: Table, most: int = MOST) -> list[Table]:
    """All columns with a value, as tables of `most` columns at the most that each begin with the first column, so that
    no page is too narrow for them."""
    known = with_values(table)
    first, *others = known.keys
    step = most - 1
    parts = [others[k : k + step] for k in range(0, len(others), step)] or [[]]
    return [known.select((first, *part)) for part in parts]


def with_values(table: Table) -> Table:
    """The table without columns that have no value; all of them where none has one."""
    known = table.known()
    return known if known.columns else table


def _first(table: Table, places: Iterable[int], most: int) -> list[int]:
    """Of the places of columns those of the lowest rank, in their order."""
    return sorted(sorted(places, key=lambda k: (table.columns[k].rank, k))[:most])


def _constant(table: Table) -> list[int]:
    """Places of the columns that have one value in all rows, and below no other."""
    if len(table.rows) < 2:
        return []
    return [k for k in range(len(table.columns)) if _one(row[k] for row in table.rows) and _below(table, k)]


def _one(cells: Iterable[Cell]) -> bool:
    first, *others = cells
    return first is not None and all(type(cell) is type(first) and cell == first for cell in others)


def _below(table: Table, place: int) -> bool:
    return all(row[place] in (None, table.rows[0][place]) for row in table.below)
