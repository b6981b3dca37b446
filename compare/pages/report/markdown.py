"""The report in Markdown, as a forge shows it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from urllib.parse import quote

from compare.page.main_table import main_table, whole_in_parts, with_values
from compare.page.markdown import as_markdown, markdown_text
from compare.page.table import Table
from compare.pages.report.folders import Part
from compare.pages.report.words import THROUGH_PYTHON, provenance_rows, report_title, view_text


def document(parts: Sequence[Part], links: Sequence[str], still: str) -> str:
    """The report; links: for each part the folder with its pictures ("" : beside the report, otherwise ending in /);
    still: name of the picture of the surfaces there."""
    lines = [f"# {markdown_text(report_title(parts))}", ""]
    if len(parts) > 1:
        for number, part in enumerate(parts, start=1):
            text = "" if part.page.verdict is None else f": **{markdown_text(part.page.verdict.line)}**"
            lines.append(f"{number}. [{markdown_text(part.page.title)}](#r{number}) ({_code(part.name)}){text}")
        lines.append("")
    for number, (part, link) in enumerate(zip(parts, links, strict=True), start=1):
        lines += _part(part, link, still, number if len(parts) > 1 else 0)
    return "\n".join(lines).rstrip() + "\n"


def _part(part: Part, link: str, still: str, number: int) -> list[str]:
    """One result; number: of its section, 0 where it is the only one."""
    page, level = part.page, "###" if number else "##"
    lines = [f'<a id="r{number}"></a>', "", f"## {markdown_text(page.title)}", ""] if number else []
    if page.verdict is not None:
        lines += [f"**{markdown_text(page.verdict.line)}**", ""]
    lines += [_code(page.again) if page.again else THROUGH_PYTHON, ""]
    lines += [*(f"- {markdown_text(sentence)}" for sentence in page.sentences), ""]
    for table in page.tables:
        lines += [f"{level} {markdown_text(table.title)}", "", *_tables(table)]
    for picture in page.pictures:
        lines += [f"![{markdown_text(picture.alt)}]({quote(link + picture.file)})", ""]
        lines += [markdown_text(picture.caption), ""] if picture.caption else []
    if page.surfaces:
        lines += [f"{level} Surfaces", "", f"![{markdown_text(view_text(page))}]({quote(link + still)})", ""]
        lines += ["To turn them: report.html.", ""]
    if page.files:
        lines += [f"{level} Files", ""]
        lines += [f"- {_code(name)}: {markdown_text(what)}" for name, what in page.files.items()]
        lines.append("")
    lines += [f"{level} How it was made", ""]
    lines += [f"- {name}: {markdown_text(text)}" for name, text in provenance_rows(page)]
    lines.append("")
    if page.scene:
        lines += [*_fenced(page.scene.rstrip(), "toml"), ""]
    return lines


def _tables(table: Table) -> list[str]:
    """The main columns of a table, what all rows have in common, and to fold out all columns."""
    short, common = main_table(table)
    count = len(with_values(table).columns)
    if len(short.columns) == count:
        return [as_markdown(short)]
    lines = [as_markdown(short), *([markdown_text(common), ""] if common else [])]
    parts = [as_markdown(part) for part in whole_in_parts(table)]
    return [*lines, f"<details><summary>All {count} columns</summary>", "", *parts, "</details>", ""]


def _code(text: str) -> str:
    """Text as code, whatever backticks are in it."""
    ticks = "`" * (1 + max((len(run) for run in re.findall("`+", text)), default=0))
    room = " " if text.startswith("`") or text.endswith("`") else ""
    return f"{ticks}{room}{' '.join(text.split())}{room}{ticks}"


def _fenced(text: str, language: str) -> list[str]:
    ticks = "`" * max(3, 1 + max((len(run) for run in re.findall("`+", text)), default=0))
    return [f"{ticks}{language}", text, ticks]
