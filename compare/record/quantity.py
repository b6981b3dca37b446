"""What a result is made of: a `Quantity` says key, heading, unit, kind, rank and meaning of a number, and takes it.

A tuple of quantities is the record of an item (a state, a row beside a shell, a case of a sweep). result.json, its
numbers in SI, CSV, tables on the terminal and on pages, rows of sweeps and docs/tables.md are made from it
(`compare.record.views`), so that a fact about a number stands in one place.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Final, Generic, TypeVar

from compare.record.column import USUAL, Column

Item = TypeVar("Item")
Other = TypeVar("Other")


class Absent:
    """What an item does not have at all, unlike None, which is not known: no key stands for it."""

    def __repr__(self) -> str:
        return "ABSENT"


ABSENT: Final = Absent()
#: The kind of what stands in files alone: a text of its own, a list of records, a mesh.
DATA = "data"


@dataclass(frozen=True)
class Part:
    """A number in a quantity that has several: path inside it (``elastic``, ``start.x``), and where they are not the
    quantity's, name, heading, kind, unit, rank and legend of its column, and the note."""

    path: str
    name: str = ""
    heading: str = ""
    kind: str = ""
    unit: str | None = None
    rank: int | None = None
    legend: str = ""
    note: str = ""


@dataclass(frozen=True)
class Quantity(Generic[Item]):
    """A quantity of a result, declared once.

    key: its place in result.json, nested by dots; heading: above its column ("": its name); unit: of the value and of
    every number in it (`compare.scene.units`); kind: as of `Column`, or `DATA`: in no table; rank, legend, words: as of
    `Column`; of: takes the value from an item, None where it is not known, `ABSENT` where the item has no such thing;
    name: of the column, where that is not the key; parts: the numbers that have a column each, of a vector or mapping;
    note: what docs/tables.md says of it, where that is not the legend.

    ValueError: a kind that no column has.
    """

    key: str
    heading: str = ""
    unit: str = ""
    kind: str = "plain"
    rank: int = USUAL
    legend: str = ""
    words: Mapping[str, str] = field(default_factory=dict)
    name: str = ""
    parts: tuple[Part | str, ...] = ()
    note: str = ""
    of: Callable[[Item], Any] = field(kw_only=True)

    def __post_init__(self) -> None:
        _ = self.columns  # refuses what is no column

    @property
    def is_number(self) -> bool:
        """It has columns of numbers, other than counts."""
        return any(column.is_number and column.kind_name not in ("integer", "sizes") for column in self.columns)

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """Its columns in a table: one, one for each part, or none."""
        if self.kind == DATA:
            return ()
        name = self.name or self.key
        if not self.parts:
            return (Column(name, self.heading or name, self.unit, self.kind, self.rank, self.legend, self.words),)
        return tuple(self._column(name, _part(part)) for part in self.parts)

    def _column(self, name: str, part: Part) -> Column:
        own = part.name or f"{name}.{part.path}"
        return Column(
            own,
            part.heading or own,
            self.unit if part.unit is None else part.unit,
            part.kind or self.kind,
            self.rank if part.rank is None else part.rank,
            part.legend or self.legend,
            self.words,
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """What docs/tables.md says of each column."""
        if not self.parts:
            return (self.note or self.legend,) if self.columns else ()
        return tuple(_part(part).note or _part(part).legend or self.note for part in self.parts)

    def cells(self, value: Any) -> tuple[Any, ...]:
        """The values of its columns, of a value of its own."""
        if self.kind == DATA:
            return ()
        return tuple(inside(value, path) for path in self._paths) if self.parts else (value,)

    @cached_property
    def _paths(self) -> tuple[str, ...]:
        return tuple(_part(part).path for part in self.parts)

    def about(self, item: Callable[[Other], Item | None]) -> Quantity[Other]:
        """The same of what holds such an item, or none: None, then."""

        def of(other: Other) -> Any:
            found = item(other)
            return None if found is None else self.of(found)

        return replace(self, of=of)  # type: ignore[arg-type, return-value]


def _part(part: Part | str) -> Part:
    return Part(part) if isinstance(part, str) else part


def inside(value: Any, path: str) -> Any:
    """What stands at a path inside a value: names of a mapping, x, y, z of a vector; None in None, `ABSENT` where a
    mapping has no such name."""
    for name in path.split("."):
        if value is None or value is ABSENT:
            return value
        inner = type(value) is dict or isinstance(value, Mapping)  # most are
        value = value.get(name, ABSENT) if inner else value["xyz".index(name)]
    return value


def pick(quantities: Iterable[Quantity[Item]], *keys: str) -> tuple[Quantity[Item], ...]:
    """The quantities of these keys, in this order. KeyError: there is none of that key."""
    by_key = {quantity.key: quantity for quantity in quantities}
    return tuple(by_key[key] for key in keys)


def first(quantities: Iterable[Quantity[Item]], *keys: str) -> tuple[Quantity[Item], ...]:
    """All of them, those of these keys in front."""
    every = tuple(quantities)
    return (*pick(every, *keys), *(quantity for quantity in every if quantity.key not in keys))


def joined(quantities: Iterable[Quantity[Item]], own: Iterable[Quantity[Item]]) -> tuple[Quantity[Item], ...]:
    """Those of every item with what one kind of item has of its own: of one key in that place, others behind. Where its
    own is `ABSENT`, what every item has."""
    mine = {quantity.key: quantity for quantity in own}
    every = tuple(quantities)
    known = {quantity.key for quantity in every}
    return (
        *(_instead(quantity, mine.get(quantity.key)) for quantity in every),
        *(quantity for key, quantity in mine.items() if key not in known),
    )


def _instead(usual: Quantity[Item], own: Quantity[Item] | None) -> Quantity[Item]:
    if own is None:
        return usual
    mine = own.of

    def of(item: Item) -> Any:
        value = mine(item)
        return usual.of(item) if value is ABSENT else value

    return replace(own, of=of)


def plainly(quantities: Iterable[Quantity[Item]], number: str) -> tuple[Quantity[Item], ...]:
    """The same as a tidy table has them: columns named and headed as in result.json, nested by dots, all numbers of the
    kind `number`, none in front of the others."""
    return tuple(
        replace(
            quantity,
            name="",
            heading="",
            kind=number if quantity.is_number else quantity.kind,
            rank=USUAL,
            legend="",
            words={},
            parts=tuple(Part(_part(part).path, note=_part(part).note) for part in quantity.parts),
            note=quantity.note or quantity.legend,
        )
        for quantity in quantities
    )
