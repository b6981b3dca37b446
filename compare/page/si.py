"""SI beside the dimensionless numbers: of a result's keys, of a table's columns, of arrays of points.

Stored numbers stay in l and D w (the contract); where the scene says what these are (`compare.scene.units`), the same
numbers stand beside them in m, N, N m and J: in `si` of result.json, in columns KEY_m, KEY_N, KEY_Nm, KEY_J of CSV.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.page.table import Cell, Column, Table
from compare.scene.data import SceneData
from compare.scene.units import Units

#: Keys of a result, or of a row, that have a unit, each with the unit of every number in it.
KEYS = {
    "end": "l", "middle": "l", "shell_end": "l", "shell_middle": "l",
    "forces": "D w / l^2", "moments": "moment", "energy": "D w / l",
    "forces_error": "D w / l^2", "moments_error": "moment", "energy_error": "D w / l", "max_abs_tau_error": "1/l",
    "taut_tension": "D w / l^2", "taut_sag": "l",
    "tip_load": "D w / l^2", "tip_force": "D w / l^2", "max_abs_tau": "1/l",
    **dict.fromkeys(("discretisation_error", "tolerance_error", "penetration", "hausdorff", "centreline",
                     "ribbon_error", "shell_error", "elastica", "ribbon_centreline"), "l"),
}  # fmt: skip
#: Units of a column, and how the name of the one in SI ends.
ENDINGS = {"l": "m", "1/l": "per_m", "D w / l^2": "N", "D w / l": "J", "moment": "Nm"}


def dimensions(scene: SceneData) -> dict[str, Any]:
    """What a scene's numbers are made dimensionless with, for result.json: `units` in SI (None: not known), `length` in
    the scene's own unit, `D` in N m, and the groups `gamma`, `width_to_thickness` (w/h; None: no thickness),
    `width_to_length` (w/l), and the dead force `tip_force` at s = l in D w / l^2 where there is one."""
    units = Units.of(scene)
    thickness = scene.strip.thickness
    return {
        "units": {**units.to_dict(), "known": units.known},
        "length": scene.strip.length,
        "D": units.bending,
        "gamma": scene.gamma,
        "width_to_thickness": None if thickness is None else scene.strip.width / thickness,
        "width_to_length": scene.width,
        **({} if scene.tip is None else {"tip_force": scene.tip_force.tolist()}),
    }


def si_of(result: Mapping[str, Any], units: Units) -> dict[str, Any] | None:
    """The keys of a result, or of a row, that have a unit (`KEYS`), in m, N, N m and J; None where SI is not known.

    Of a pose the position alone; an `elastica` that is itself a result has its own keys.
    """
    if not units.known:
        return None
    found: dict[str, Any] = {}
    for key, unit in KEYS.items():
        value = result.get(key)
        if key == "elastica" and isinstance(value, Mapping):
            found[key] = si_of(value, units)
        elif isinstance(value, Mapping) and "position" in value:
            found[key] = {"position": scaled(value["position"], unit, units)}
        elif key in result:
            found[key] = scaled(value, unit, units)
    return found


def scaled(value: Any, unit: str, units: Units) -> Any:
    """Every number of a value (a number, list, array, mapping of those) in SI, in Python's own types; None stays."""
    if value is None:
        return None
    if isinstance(value, Mapping):
        return {name: scaled(part, unit, units) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [scaled(part, unit, units) for part in value]
    told = units.si(1.0, unit)
    if told is None:
        return None
    return (np.asarray(value, dtype=float) * told[0]).tolist()


def with_si(table: Table, units: Units | Sequence[Units]) -> Table:
    """The table with a column in SI behind each that has a unit of `ENDINGS`, for CSV; units: of all rows, or of each.

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
        if column.unit in ENDINGS and column.is_number:
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
    ending = ENDINGS[column.unit]
    return f"{column.key}_{ending}", {"per_m": "1/m", "Nm": "N m"}.get(ending, ending)


def array_with_si(
    names: Sequence[str], array: NDArray[np.float64], of: Mapping[str, str], units: Units
) -> tuple[list[str], NDArray[np.float64]]:
    """Columns (n, k) of numbers under k names, with those in SI behind all of them; of: name -> its unit."""
    added = [name for name in names if name in of] if units.known else []
    more = [scaled(array[:, list(names).index(name)], of[name], units) for name in added]
    return [*names, *(f"{name}_{ENDINGS[of[name]]}" for name in added)], np.column_stack([array, *more])
