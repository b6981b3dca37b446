"""docs/tables.md is rendered from the records; docs/verdicts.md is held to the claims and grades."""

from __future__ import annotations

import re

import pytest

from compare.measure.grades import FAIR_FACTOR, GOOD_UP_TO
from compare.models.ribbon.stages import COLUMNS
from compare.page.claims import CLAIMS
from compare.pages import ribbon
from docs import tables
from tests.docs_blocks import DOCS


def test_the_page_is_what_the_records_say():
    """Red where a column is added, renamed or given another unit without `python -m docs.tables`."""
    text = tables.PAGE.read_text(encoding="utf-8")
    assert tables.rendered(text) == text


def test_every_table_of_the_page_is_a_record():
    parts = re.split(r"^## (.*)\n", tables.PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    with_columns = {name for name, body in zip(parts[1::2], parts[2::2], strict=True) if "\n|---" in body}
    assert with_columns == {*tables.TABLES, *tables.DOCUMENTS}


def test_a_page_without_a_table_is_refused():
    text = tables.PAGE.read_text(encoding="utf-8").replace("## limits.csv\n", "## other.csv\n")
    with pytest.raises(ValueError, match=r"limits\.csv"):
        tables.rendered(text)


def test_the_path_has_every_entry_of_its_log():
    assert tuple(quantity.key for quantity in ribbon.PATH) == COLUMNS


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
