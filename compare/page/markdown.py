"""Tables and words in Markdown."""

from __future__ import annotations

from collections.abc import Iterable

from compare.page.table import Table


def as_markdown(table: Table) -> str:
    """The table in Markdown, numbers to the right; what its columns mean below."""
    lines = [
        _line(column.heading for column in table.columns),
        "|" + "|".join("---:" if right else "---" for right in table.right_aligned()) + "|",
        *(_line(row) for row in table.texts()),
    ]
    meaning = table.explanation()
    return "\n".join(lines) + "\n" + (f"\n{meaning}\n" if meaning else "")


def markdown_text(text: str) -> str:
    """Text from data as Markdown shows it literally: on one line, no tag, no link, no picture."""
    plain = " ".join(text.split()).replace("\\", "\\\\").replace("&", "&amp;").replace("<", "&lt;")
    return plain.replace("[", "\\[").replace("`", "\\`").replace("*", "\\*")


def _line(cells: Iterable[str]) -> str:
    return "| " + " | ".join(markdown_text(cell).replace("|", "\\|") for cell in cells) + " |"
