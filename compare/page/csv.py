"""The one writer of CSV, and its dialect.

Keys of the columns in the first line; commas, lines that end with a line feed; numbers with all their digits, in the
unit of the column; `true` and `false`; empty where nothing is known; values of several parts as a JSON list. A text
that a spreadsheet would take for a formula begins with an apostrophe, which makes it a text there.
"""

from __future__ import annotations

import csv
import io
import json

from compare.page.table import Cell, Table


def as_csv(table: Table) -> str:
    """The rows of a table in CSV; those below its line are left out."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([inert(key) for key in table.keys])
    writer.writerows([field(cell) for cell in row] for row in table.rows)
    return out.getvalue()


def field(cell: Cell) -> str:
    """A value as it stands in CSV."""
    if cell is None:
        return ""
    if isinstance(cell, bool):
        return "true" if cell else "false"
    if isinstance(cell, tuple):
        return json.dumps(cell, ensure_ascii=False)
    return inert(cell) if isinstance(cell, str) else repr(cell)


def inert(text: str) -> str:
    """A text as no spreadsheet takes it for a formula; numbers stay what they are."""
    if text.lstrip()[:1] not in _FORMULA:
        return text
    try:
        float(text)
    except ValueError:
        return f"'{text}"
    return text


_FORMULA = ("=", "+", "-", "@", "\uff1d", "\uff0b", "\uff0d", "\uff20")
