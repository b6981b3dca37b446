"""Tables of a page on the terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table as Grid
from rich.text import Text

from compare.page.main_table import main_table, with_values
from compare.page.table import Table
from compare.page.verdict import Verdict

#: Letters between two columns, and those outside: a blank each side of a cell, and a line.
_BETWEEN, _OUTSIDE = 3, 1
#: Letters that a column of words has at least, where its words are longer: only then is a word broken.
_LEAST, _MOST_WORD = 6, 40
#: Letters of a first column of names that are kept in one line.
_NAME = 26


def print_table(console: Console, table: Table, legend: bool = True, wide: bool = False) -> None:
    """The main columns, as many as fit into the console's width without a broken number; below what all rows have in
    common, and the legend. wide: all columns that have a value, each as wide as it needs, whatever the width."""
    shown, common = (with_values(table), "") if wide else main_table(table)
    while not wide and len(shown.columns) > 1 and sum(_least(shown)) + _frame(shown) > console.width:
        shown = _without_one(shown)
    widths = _most(shown) if wide else _widths(shown, console.width - _frame(shown))
    grid = Grid()
    for column, right, letters in zip(shown.columns, shown.right_aligned(), widths, strict=True):
        heading = "\n".join(_lines(column.heading, letters))
        grid.add_column(Text(heading), justify="right" if right else "left", overflow="fold", width=letters)
    for number, row in enumerate(shown.texts()):
        if number == len(shown.rows):
            grid.add_section()
        grid.add_row(*map(Text, row))
    if table.title:
        console.print(Text(table.title, style="italic"))
    paper = console
    if wide:
        room = max(sum(widths) + _frame(shown), console.width)
        paper = Console(file=console.file, width=room, highlight=False, force_terminal=console.is_terminal)
    paper.print(grid, soft_wrap=False)
    if common:
        console.print(common)
    meaning = shown.explanation()
    if legend and meaning:
        console.print(meaning)


def _widths(table: Table, room: int) -> list[int]:
    """Letters of each column: what its longest cell takes where there is room for all, otherwise the columns of words
    share what the numbers leave."""
    least = _least(table)
    most = list(map(max, least, _most(table)))
    found = list(least)
    if not table.columns[0].is_number:  # a name stays in one line where the others can do with less
        found[0] = max(least[0], min(most[0], _NAME, room - sum(least[1:])))
    spare = room - sum(found)
    while spare > 0 and found != most:
        open_ones = [k for k in range(len(found)) if found[k] < most[k]]
        k = min(open_ones, key=lambda k: found[k] / most[k])
        found[k] += 1
        spare -= 1
    if sum(found) > room:  # a single column that is too wide by itself
        found[-1] = max(1, room - sum(found[:-1]))
    return found


def _most(table: Table) -> list[int]:
    """Letters that each column needs so that nothing in it goes on in another line."""
    texts = table.texts()
    return [
        max([len(column.heading), 1, *(len(line) for row in texts for line in (row[k].splitlines() or [""]))])
        for k, column in enumerate(table.columns)
    ]


def _frame(table: Table) -> int:
    """Letters of a table besides its cells."""
    return _BETWEEN * len(table.columns) + _OUTSIDE


def _least(table: Table) -> list[int]:
    """Letters that each column needs so that no number and no word is broken."""
    texts = table.texts()
    found = []
    for place, (column, right) in enumerate(zip(table.columns, table.right_aligned(), strict=True)):
        cells = [row[place] for row in texts]
        whole = column.is_number or right
        parts = cells if whole else [word for cell in cells for word in cell.split()]
        longest = max(map(len, parts), default=1)
        heading = max(map(len, column.heading.split()), default=1)
        found.append(max(heading, longest if whole else min(max(longest, _LEAST), _MOST_WORD)))
    return found


def _lines(heading: str, letters: int) -> Sequence[str]:
    """A heading in lines of whole words."""
    return textwrap.wrap(heading, max(letters, 1), break_long_words=False, break_on_hyphens=False) or [""]


def _without_one(table: Table) -> Table:
    """The table without the column of the highest rank, the first one apart."""
    last = max(range(1, len(table.columns)), key=lambda k: (table.columns[k].rank, k))
    return table.select(key for k, key in enumerate(table.keys) if k != last)


def print_pairs(console: Console, title: str, rows: Sequence[tuple[str, str]]) -> None:
    """Names and texts, one pair a row; a text that is too long goes on below, broken between words."""
    grid = Grid(show_header=False)
    names = max((len(name) for name, _ in rows), default=1)
    grid.add_column(min_width=min(names, console.width // 2), overflow="fold")
    grid.add_column(overflow="fold")
    for pair in rows:
        grid.add_row(*map(Text, pair))
    console.print(Text(title, style="italic"))
    console.print(grid, soft_wrap=False)


_COLOURS = {"good": "bold green", "fair": "bold yellow", "poor": "bold red"}


def print_verdict(console: Console, verdict: Verdict) -> None:
    """The answer, in the colour of its grade (none in a pipe)."""
    console.print(Text(verdict.line, style=_COLOURS.get(verdict.grade, "bold")))
