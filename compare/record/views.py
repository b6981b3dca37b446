"""What is made from a record: the part of result.json with its numbers in SI, and the cells of a row."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from compare.record.column import Column
from compare.record.quantity import ABSENT, Item, Quantity
from compare.scene.units import Units, base_of

_NUMPY = (np.ndarray, np.generic)
#: Numbers that a vector has at most.
_VECTOR = 3


def document(quantities: Iterable[Quantity[Item]], item: Item) -> dict[str, Any]:
    """The values of an item by key, nested by dots, in the order of the quantities; without what is `ABSENT`."""
    found: dict[str, Any] = {}
    for quantity in quantities:
        value = quantity.of(item)
        if value is not ABSENT:
            *sections, name = quantity.key.split(".")
            place = found
            for section in sections:
                place = place.setdefault(section, {})
            place[name] = value
    return found


def in_si(quantities: Iterable[Quantity[Item]], found: Mapping[str, Any], units: Units) -> dict[str, Any] | None:
    """The numbers of a `document` that have a unit, in m, N, N m and J, of a pose its position; None where SI is not
    known."""
    if not units.known:
        return None
    si: dict[str, Any] = {}
    for quantity in quantities:
        *sections, name = quantity.key.split(".")
        source: Mapping[str, Any] = found
        for section in sections:
            source = source.get(section) or {}
        if base_of(quantity.unit) is None or name not in source:
            continue
        place = si
        for section in sections:
            place = place.setdefault(section, {})
        place[name] = _in_si(source[name], quantity.unit, units)
    return si


def _in_si(value: Any, unit: str, units: Units) -> Any:
    if isinstance(value, Mapping) and "position" in value:
        return {"position": scaled(value["position"], unit, units)}
    return scaled(value, unit, units)


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


def columns_of(quantities: Iterable[Quantity[Item]]) -> tuple[Column, ...]:
    """The columns of a table with a row for each item."""
    return tuple(column for quantity in quantities for column in quantity.columns)


def row_of(quantities: Iterable[Quantity[Item]], item: Item) -> dict[str, Any]:
    """The cells of an item by the keys of their columns, in Python's own types; without what is `ABSENT`."""
    found: dict[str, Any] = {}
    for quantity in quantities:
        if quantity.columns:
            cells = quantity.cells(quantity.of(item))
            found |= {column.key: cell for column, cell in zip(quantity.columns, cells, strict=True)}
    return {key: _plain(value) for key, value in found.items() if value is not ABSENT}


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, _NUMPY) else value


def cells(found: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """The numbers, words and vectors of a `document` by dotted path; longer lists and lists of lists are left out."""
    for name, value in found.items():
        if isinstance(value, Mapping):
            yield from cells(value, f"{before}{name}.")
        elif not isinstance(value, list):
            yield f"{before}{name}", value
        elif 0 < len(value) <= _VECTOR and all(isinstance(part, int | float) for part in value):
            yield f"{before}{name}", tuple(value)


def unit_of(quantities: Iterable[Quantity[Any]], path: str) -> str:
    """The unit of what stands at a path of a `document`: that of the quantity in which it lies; "" for none."""
    inner = [q for q in quantities if path == q.key or path.startswith(f"{q.key}.")]
    return max(inner, key=lambda quantity: len(quantity.key)).unit if inner else ""
