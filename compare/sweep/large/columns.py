"""The columns of a table in parts: known before anything is solved, so that all parts of a sweep have the same."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from compare.page import force_displacement
from compare.record.quantity import Quantity
from compare.record.views import row_of
from compare.studies.axes import Grid
from compare.sweep.file import Sweep
from compare.sweep.finished import Case
from compare.sweep.record import OF_GRID, Placed, run_of

#: Of what a column holds: a number, a whole number, a truth value, a text, several numbers, anything as JSON.
KINDS = ("number", "integer", "truth", "text", "numbers", "json")
#: What needs neighbours, or is no answer of a case: not in these tables.
_NOT_HERE = {"branch", *(column.key for q in force_displacement.CURVE for column in q.columns)}
SECONDS = "seconds"


@dataclass(frozen=True)
class Field:
    """A column. unit: as in docs/tables.md; note: what it means."""

    key: str
    kind: str
    unit: str = ""
    note: str = ""

    def to_dict(self) -> dict[str, str]:
        """Ready for JSON."""
        return asdict(self)


_OF_KIND = {"integer": "integer", "truth": "truth", "word": "text", "plain": "json", "sizes": "json"}


def fields_of(sweep: Sweep, grid: Grid) -> tuple[Field, ...]:
    """The columns of a sweep's table: the number of the case, the varied keys, what its model says."""
    varied = [Field(key, _kind(values), "", "varied") for key, values in _values_of(grid)]
    known = {"case", *_NOT_HERE, SECONDS, *(field.key for field in varied)}
    first = Field("case", "integer", "", "number of the case, from 0")
    found = [field for q in run_of(sweep) for field in _fields(q) if field.key not in known]
    walls = {f"force.wall.{wall.name}.x": 0.0 for wall in sweep.scene.walls}
    walls |= {f"force_error.wall.{wall.name}": 0.0 for wall in sweep.scene.walls} if sweep.errors else {}
    more = [Field(c.key, "number", c.unit) for c in force_displacement.wall_columns([walls])]
    return (first, *varied, *found[:-1], *more, found[-1])


def _fields(quantity: Quantity[Any]) -> list[Field]:
    return [
        Field(column.key, _OF_KIND.get(column.kind_name, "number"), column.unit, note)
        for column, note in zip(quantity.columns, quantity.notes, strict=True)
    ]


def _values_of(grid: Grid) -> list[tuple[str, list[Any]]]:
    return [(key, [v[k] for v in axis.values]) for axis in grid.axes for k, key in enumerate(axis.keys)]


def _kind(values: Sequence[Any]) -> str:
    if all(isinstance(v, bool) for v in values):
        return "truth"
    if all(_number(v) for v in values):
        return "number"
    if all(isinstance(v, str) for v in values):
        return "text"
    if all(isinstance(v, list) and all(map(_number, v)) for v in values):
        return "numbers"
    return "json"


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def rows_of_case(case: Case) -> list[dict[str, Any]]:
    """The rows of a case, one for each w/h; a case without a result has a row too."""
    own = row_of(OF_GRID, Placed(case, None))
    known = {"status": case.record["status"], "stable": None, **case.point.values}
    return [{**known, **row, **own} for row in case.record["rows"] or [{}]]


def cell(kind: str, value: Any) -> Any:
    """A value as a column of this kind holds it."""
    if value is None:
        return None
    if kind == "number":
        return float(value)
    if kind == "numbers":
        return [float(part) for part in value]
    if kind == "json":
        return json.dumps(value, sort_keys=True)
    return value


def by_column(fields: Sequence[Field], rows: Sequence[Mapping[str, Any]]) -> dict[str, list[Any]]:
    """The values of the rows by column; without columns in which nothing is known."""
    found = {}
    for field in fields:
        values = [cell(field.kind, row.get(field.key)) for row in rows]
        if any(value is not None for value in values):
            found[field.key] = values
    return found
