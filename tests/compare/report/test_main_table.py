"""Tables that fit: six columns in 80 letters, no number broken, of every table that a command prints; the full one in
the reports."""

from __future__ import annotations

import importlib
import io
import pkgutil
from collections.abc import Iterator

import pytest
from rich.console import Console

import compare.commands
import compare.pages
import compare.sweep
from compare.page.main_table import MOST, main_table, whole_in_parts
from compare.page.table import LAST, Column, Table
from compare.page.terminal import print_pairs, print_table
from compare.pages import limits
from compare.record.quantity import Quantity
from compare.record.views import columns_of

WIDTHS = (60, 80, 120, 200)


def sets() -> Iterator[tuple[str, tuple[Column, ...]]]:
    """Every set of columns that a module of the pages, of sweeps and of commands declares."""
    for room in (compare.pages, compare.sweep, compare.commands):
        for found in pkgutil.iter_modules(room.__path__):
            module = importlib.import_module(f"{room.__name__}.{found.name}")
            for name, value in vars(module).items():
                if not isinstance(value, tuple) or not value:
                    continue
                if all(isinstance(entry, Quantity) for entry in value):
                    value = columns_of(value)
                plain = value
                if plain and all(isinstance(c, Column) for c in plain) and len({c.key for c in plain}) == len(plain):
                    yield f"{found.name}.{name}", plain
    columns = limits.columns(["strip.gamma", "clamp.end.position"])
    yield "limits", columns_of(columns)
    yield "estimates", columns_of(c for c in columns if c.key in ("strip.gamma", *limits._ESTIMATED))


SETS = dict(sets())
LONGEST = {
    "integer": 1234567,
    "sizes": (1000, 80),
    "truth": True,
    "word": "not converged",
    "interval": (-0.12345, 1e-7),
}


def filled(columns: tuple[Column, ...]) -> Table:
    """Three rows without two alike in any column, of the longest numbers."""

    def cell(column, row):
        value = LONGEST.get(column.kind_name, -1.234567e-05)
        if column.kind_name == "truth":
            return row != 1
        if isinstance(value, str):
            return f"{value} {row}"
        if isinstance(value, tuple):
            return tuple(part + row for part in value)
        return value * (1 + row) if isinstance(value, float) else value + row

    return Table("A title that is rather long, so that it would be broken above a narrow table", columns,
                 tuple(tuple(cell(c, row) for c in columns) for row in range(3)))  # fmt: skip


def shown(table: Table, width: int = 80, **options) -> str:
    out = io.StringIO()
    print_table(Console(file=out, width=width, markup=False, highlight=False), table, **options)
    return out.getvalue()


def cells(said: str) -> list[list[str]]:
    return [[c.strip() for c in line.strip("│\n").split("│")] for line in said.splitlines() if line.startswith("│")]


def test_the_sets_are_found():
    assert len(SETS) >= 15
    assert {"comparison.TABLE", "cost.COLUMNS", "check._COLUMNS", "shell._COLUMNS", "record.RUN"} <= SETS.keys()


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("name", SETS)
def test_a_table_fits(name, width):
    table = filled(SETS[name])
    text = shown(table, width, legend=False)
    lines = [line for line in text.splitlines() if line[:1] in "┏┃┡│└├"]
    assert max(map(len, lines)) <= width
    body = cells(text)
    assert 1 <= len(body[0]) <= MOST
    short, _ = main_table(table)
    drawn = {cell for row in body for cell in row}
    heading = [line.strip("┃").split("┃") for line in lines if line.startswith("┃")]
    words = {word for line in heading for cell in line for word in cell.split()}
    for column in short.columns:
        texts = [column.text(cell) for cell in table.values(column.key)]
        if column.is_number and words.issuperset(column.heading.split()) and len(short.columns) == len(body[0]):
            assert drawn.issuperset(texts), column.key  # no number in two lines
    known = {word for column in short.columns for word in column.heading.split()}
    assert words <= known  # no heading in pieces
    assert short.columns[0].heading.split()[0] in words


def test_more_room_shows_no_fewer_columns():
    for name, columns in SETS.items():
        counts = [len(cells(shown(filled(columns), width, legend=False))[0]) for width in WIDTHS]
        assert counts == sorted(counts), name
        assert counts[WIDTHS.index(120)] >= min(4, len(columns)), name


@pytest.mark.parametrize("name", SETS)
def test_wide_shows_every_column_on_one_line_each(name):
    table = filled(SETS[name])
    body = cells(shown(table, 60, legend=False, wide=True))
    assert body == [list(row) for row in table.texts()]


COLUMNS = (
    Column("ratio", "w/h", rank=0),
    Column("status", "shell", kind="word", rank=1),
    Column("error", "ribbon error", "l", "exponent:1", legend="of the ribbon"),
    Column("none", "nothing known"),
    Column("seconds", "time", "s", "seconds:2", rank=LAST, legend="of a solve"),
    Column("kept", "kept", kind="truth", rank=LAST),
)


def table(rows, below=()):
    return Table("T", COLUMNS, rows, "Lengths in l.", below)


def test_what_all_rows_have_in_common_is_a_sentence():
    two = table(((10, "converged", 2e-3, None, 0.5, True), (20, "converged", 2e-3, None, 0.7, True)))
    short, said = main_table(two)
    assert short.keys == ("ratio", "seconds")
    assert all(text in said for text in ("shell converged", "ribbon error 2.0e-03", "kept yes"))
    below = (("ribbon", "saddle", 2e-3, None, None, None),)
    assert main_table(table(two.rows, below))[0].keys == ("ratio", "status", "seconds")
    one = table(two.rows[:1])
    assert main_table(one) == (one.known(), "")
    same = table((two.rows[0], two.rows[0]))
    assert main_table(same)[0].keys == ("ratio",)
    assert main_table(table(()))[0].columns


def test_true_is_not_one():
    plain = (Column("a", "a"), Column("b", "b"))
    assert main_table(Table("T", plain, ((1, 1), (2, True))))[0].keys == ("a", "b")


def test_the_lowest_ranks_stay_in_their_order():
    columns = tuple(Column(f"c{k}", f"c{k}", rank=9 - k) for k in range(10))
    rows = tuple(tuple(10 * row + k for k in range(10)) for row in range(2))
    full = Table("T", columns, rows)
    assert main_table(full)[0].keys == ("c4", "c5", "c6", "c7", "c8", "c9")
    parts = whole_in_parts(full)
    assert [len(part.columns) for part in parts] == [6, 5]
    assert {key for part in parts for key in part.keys} == set(full.keys)
    assert all(part.keys[0] == "c0" for part in parts)


def test_a_line_above_what_stands_below():
    text = shown(table(((10, "a", 1e-3, None, 0.5, True), (20, "b", 2e-3, None, 0.7, False)),
                       (("ribbon", None, 5e-4, None, None, None),)))  # fmt: skip
    assert text.index("ribbon", text.index("└") - 200) > text.index("├") > text.index("20")
    assert "of the ribbon" in text


def test_pairs_fit_too():
    out = io.StringIO()
    print_pairs(
        Console(file=out, width=60), "T" * 90, [("force at s = 0 / (D w / l^2)", "0 10 0"), ("why", "word " * 40)]
    )
    assert max(len(line) for line in out.getvalue().splitlines()) <= 60
    assert all(word == "word" for row in cells(out.getvalue())[1:] for word in row[1].split())


def test_a_row_below_without_values_is_left_out():
    columns = (Column("name", "name"), Column("same", "same", kind="digits"), Column("other", "other", kind="digits"))
    rows = (("a", 1.0, 2.0), ("b", 1.0, 3.0))
    empty, told = (Table("t", columns, rows, below=(("c", 1.0, cell),)) for cell in (None, 4.0))
    assert main_table(empty)[0].below == ()
    assert main_table(told)[0].below == (("c", 4.0),)
