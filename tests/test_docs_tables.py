"""docs/tables.md: the columns of every CSV file, with their units, are those that the code declares."""

from __future__ import annotations

import re

import pytest

from compare.models.ribbon.way import COLUMNS
from compare.pages import comparison, cost, limits, ribbon, shell
from compare.sweep import page as sweep
from tests.docs_blocks import DOCS


def listed(heading: str) -> list[tuple[str, str]]:
    """Column and unit of every row under a heading of the page."""
    text = (DOCS / "tables.md").read_text().split(f"## {heading}\n")[1].split("\n## ")[0]
    return re.findall(r"^\| `([^`]+)` \| ([^|]*?) \|", text, re.MULTILINE)


def declared(columns) -> list[tuple[str, str]]:
    plain = [entry[0] if isinstance(entry, tuple) else entry for entry in columns]
    return [(column.key, column.unit) for column in plain]


@pytest.mark.parametrize(
    ("heading", "columns"),
    [
        ("table.csv of compare and converge", (*comparison._COLUMNS, comparison._ELASTICA)),
        ("table.csv of cost", cost._COLUMNS),
        ("cases.csv of sweep", sweep._COLUMNS),
        ("path.csv of solve", (*ribbon._PATH, *ribbon.PATH_SUPPORTS)),
        ("path.csv of shell", shell._PATH),
    ],
)
def test_columns_and_units(heading, columns):
    assert listed(heading) == declared(columns)


def test_columns_of_limits():
    """The page's distance is `hausdorff` there, or the estimate's."""
    pairs = [pair for pair in declared(limits._columns([])) if pair[0] != "distance"]
    assert listed("limits.csv") == pairs


def test_the_path_has_every_entry_of_its_log():
    assert tuple(column.key for column in ribbon._PATH) == COLUMNS
