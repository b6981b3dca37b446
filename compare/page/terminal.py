"""Tables of a page on the terminal."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table as Grid

from compare.page.page import Table, right_aligned


def print_table(console: Console, table: Table, legend: bool = True) -> None:
    """The table with its legend; columns without any value are left out."""
    texts = table.texts()
    shown = [k for k in range(len(table.headings)) if any(row[k] not in ("-", "") for row in texts)]
    right = right_aligned(table)
    grid = Grid(title=table.title, title_justify="left")
    for k in shown:
        grid.add_column(table.headings[k], justify="right" if right[k] else "left", overflow="fold")
    for row in texts:
        grid.add_row(*(row[k] for k in shown))
    console.print(grid)
    if legend and table.legend:
        console.print(table.legend)
