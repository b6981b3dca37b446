"""docs/tables.md: the columns of every CSV file, with their units, are those that the code declares."""

from __future__ import annotations

import re

import pytest

from compare.measure.grades import FAIR_FACTOR, GOOD_UP_TO
from compare.models.ribbon.way import COLUMNS
from compare.page.claims import CLAIMS
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


def test_verdicts_claim_what_the_page_says():
    text = (DOCS / "verdicts.md").read_text()
    parts = re.split(r"^## (.*)$", text, flags=re.MULTILINE)[1:]
    told = {
        command: re.findall(r"^\| (\S+) \| (.*?) \| (.*?) \|$", part, re.MULTILINE)
        for command, part in zip(parts[::2], parts[1::2], strict=True)
    }
    known = {command: [(c.name, c.what, c.how) for c in claims] for command, claims in CLAIMS.items()}
    assert {command: rows[1:] for command, rows in told.items()} == known


def test_grades_of_the_page_are_the_codes():
    text = (DOCS / "verdicts.md").read_text()
    rows = dict(re.findall(r"^\| (good|fair) up to \|(.*)\|$", text, re.MULTILINE))
    percents = {name: [float(found) for found in re.findall(r"([0-9.]+) %", row)] for name, row in rows.items()}
    good = [100.0 * GOOD_UP_TO[kind] for kind in ("error", "distance", "share", "force")]
    assert percents["good"] == pytest.approx(good)
    assert percents["fair"] == pytest.approx([FAIR_FACTOR * value for value in good])
