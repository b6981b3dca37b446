"""Tables of a page on the terminal."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table as Grid

from compare.page.table import Table


def print_table(console: Console, table: Table, legend: bool = True) -> None:
    """The columns that a terminal has room for, without those that have no value; the legend below."""
    shown = table.for_terminal()
    grid = Grid(title=table.title, title_justify="left")
    for column, right in zip(shown.columns, shown.right_aligned(), strict=True):
        grid.add_column(column.heading, justify="right" if right else "left", overflow="fold")
    for number, row in enumerate(shown.texts()):
        if number == len(shown.rows):
            grid.add_section()
        grid.add_row(*row)
    console.print(grid)
    meaning = shown.explanation()
    if legend and meaning:
        console.print(meaning)
