"""Renders the columns of docs/tables.md from the records that tables are made from. From the project's root:

python -m docs.tables                # tests/test_docs_tables.py holds the page to the records
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from compare.page.state import STATE
from compare.pages import comparison, cost, limits, ribbon, shell
from compare.record.quantity import Quantity
from compare.scene.units import base_of
from compare.sweep.record import RUN

PAGE = Path(__file__).with_name("tables.md")
#: Heading of the page -> the record whose columns stand below it.
TABLES: Mapping[str, tuple[Quantity[Any], ...]] = {
    "table.csv of compare and converge": comparison.TABLE,
    "table.csv of cost": cost.COLUMNS,
    "limits.csv": tuple(quantity for quantity in limits.columns([]) if quantity.key != "distance"),
    "cases.csv of sweep": RUN,
    "path.csv of solve": (*ribbon.PATH, *ribbon.PATH_SUPPORTS),
    "path.csv of shell": shell.PATH,
}
#: Heading -> the record of a document, whose keys stand below it.
DOCUMENTS: Mapping[str, tuple[Quantity[Any], ...]] = {"result.json of solve": STATE}
_TABLE = re.compile(r"(?:^\|.*\n)+", re.MULTILINE)


def columns(record: Iterable[Quantity[Any]]) -> str:
    """The columns of a record as rows in Markdown: key, unit, meaning."""
    rows = [
        f"| `{column.key}` | {column.unit} | {note} |\n"
        for quantity in record
        for column, note in zip(quantity.columns, quantity.notes, strict=True)
    ]
    return "| column | unit | |\n|---|---|---|\n" + "".join(rows)


def keys(record: Iterable[Quantity[Any]]) -> str:
    """The keys of a document that have a unit, which stand in `si` too."""
    rows = [f"| `{one.key}` | {one.unit} | {base_of(one.unit)} |\n" for one in record if base_of(one.unit)]
    return "| key | unit | in `si` |\n|---|---|---|\n" + "".join(rows)


def rendered(text: str) -> str:
    """The page with the tables of its headings made anew. ValueError: a heading is not there, or has no table."""
    made = {name: columns(record) for name, record in TABLES.items()}
    made |= {name: keys(record) for name, record in DOCUMENTS.items()}
    parts = re.split(r"^## (.*)\n", text, flags=re.MULTILINE)
    found = dict(zip(parts[1::2], parts[2::2], strict=True))
    for name, table in made.items():
        if name not in found or not _TABLE.search(found[name]):
            raise ValueError(f"docs/tables.md has no table under {name!r}")
        found[name] = _TABLE.sub(lambda _, table=table: table, found[name], count=1)  # type: ignore[misc]
    return parts[0] + "".join(f"## {name}\n{body}" for name, body in found.items())


def main() -> None:
    """Writes the page."""
    PAGE.write_text(rendered(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
