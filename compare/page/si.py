"""SI beside the dimensionless numbers: of a table's columns, of arrays of points.

Stored numbers stay in l and D w (the contract); where the scene says what these are (`compare.scene.units`), the same
numbers stand beside them in m, N, N m and J: in columns KEY_m, KEY_N, KEY_Nm, KEY_J of CSV (in `si` of result.json:
`compare.record.views`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.page.table import Cell, Column, Table
from compare.record.views import scaled
from compare.scene.units import Units, base_of


def ending(unit: str) -> str | None:
    """How the name of the column in SI ends that stands beside one of this unit: "m", "N", "per_m"; None: there is
    none."""
    base = base_of(unit)
    return None if base is None else base.replace("1/", "per_").replace(" ", "").replace("/", "_per_")


def with_si(table: Table, units: Units | Sequence[Units]) -> Table:
    """The table with a column in SI behind each that has a unit with one, for CSV; units: of all rows, or of each.

    The table itself where no row's are known.
    """
    each = [units] * len(table.rows) if isinstance(units, Units) else list(units)
    if not any(one.known for one in each):
        return table
    columns: list[Column] = []
    cells: list[tuple[Cell, ...]] = []
    for k, column in enumerate(table.columns):
        values = tuple(row[k] for row in table.rows)
        columns.append(column)
        cells.append(values)
        if ending(column.unit) and column.is_number:
            name, told = si_column(column)
            columns.append(replace(column, key=name, unit=told))
            cells.append(tuple(_cell(scaled(v, column.unit, one)) for v, one in zip(values, each, strict=True)))
    return Table(table.title, tuple(columns), tuple(zip(*cells, strict=True)), table.legend)


#: Units of columns that a reader gets in SI.
_READ = ("l", "D w / l^2", "D w / l")
#: Ranks by which a column comes after all others.
_LAST = 100


def for_reader(table: Table, units: Units) -> Table:
    """The table with a column in mm, mN or mJ (what its largest number asks for) before each with such a unit, which
    itself comes after all the others; the table itself where SI is not known."""
    if not units.known:
        return table
    columns: list[Column] = []
    cells: list[list[Cell]] = []
    for k, column in enumerate(table.columns):
        values = [row[k] for row in table.rows]
        below = [row[k] for row in table.below]
        numbers = [abs(n) for v in (*values, *below) for n in _numbers(v)]
        if column.unit in _READ and column.is_number and numbers:
            told = units.reading(max(numbers), column.unit)
            assert told is not None
            factor, unit = told
            heading = f"{column.heading.removesuffix(' / l')} {unit}"
            shown = replace(column, key=f"{column.key}_si", heading=heading, unit=unit, kind="digits:3")
            columns.append(shown)
            cells.append([_times(v, factor) for v in (*values, *below)])
            if not column.heading.endswith(column.unit):
                column = replace(column, heading=f"{column.heading} / {_brackets(column.unit)}")
            column = replace(column, rank=column.rank + _LAST, legend="")
        columns.append(column)
        cells.append([*values, *below])
    rows = tuple(zip(*cells, strict=True))
    split = len(table.rows)
    legend = f"{table.legend} Where a heading names a unit, in that unit.".strip()
    return replace(table, columns=tuple(columns), rows=rows[:split], below=rows[split:], legend=legend)


def _brackets(unit: str) -> str:
    return unit if " " not in unit else f"({unit})"


def _numbers(cell: Cell) -> list[float]:
    parts = cell if isinstance(cell, tuple) else (cell,)
    return [float(p) for p in parts if isinstance(p, int | float) and not isinstance(p, bool) and np.isfinite(p)]


def _times(cell: Cell, factor: float) -> Cell:
    if isinstance(cell, tuple):
        return tuple(_times(part, factor) for part in cell)  # type: ignore[misc]
    return cell * factor if isinstance(cell, int | float) and not isinstance(cell, bool) else cell


def _cell(value: Any) -> Cell:
    return tuple(value) if isinstance(value, list) else value


def si_column(column: Column) -> tuple[str, str]:
    """Name and unit of the column in SI that stands beside this one: ("hausdorff_m", "m")."""
    return f"{column.key}_{ending(column.unit)}", base_of(column.unit) or ""


def array_with_si(
    names: Sequence[str], array: NDArray[np.float64], of: Mapping[str, str], units: Units
) -> tuple[list[str], NDArray[np.float64]]:
    """Columns (n, k) of numbers under k names, with those in SI behind all of them; of: name -> its unit."""
    added = [name for name in names if name in of] if units.known else []
    more = [scaled(array[:, list(names).index(name)], of[name], units) for name in added]
    return [*names, *(f"{name}_{ending(of[name])}" for name in added)], np.column_stack([array, *more])
