"""The report as one HTML file: pictures, styles, script and surfaces in it, and a policy that forbids every request."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files

from compare.page.main_table import main_table, whole_in_parts, with_values
from compare.page.page import PUSH, RUB, Page
from compare.page.table import Table
from compare.pages.report.folders import Part
from compare.pages.report.surfaces import View, as_data
from compare.pages.report.words import THROUGH_PYTHON, provenance_rows, report_title, view_text

#: The parts of the viewer, in order.
SCRIPTS = ("maths.js", "paint.js", "view.js", "controls.js")
#: Rows from which a table gets a box of its own height; letters from which a cell needs a wide column.
_LONG_TABLE = 40
_MUCH = 30


def document(parts: Sequence[Part], views: Sequence[View | None], stills: Sequence[bytes | None]) -> str:
    """The report of the parts; views, stills: of each, None without surfaces."""
    title = escape(report_title(parts))
    style = asset("report.css")
    running = script() if any(view is not None for view in views) else ""
    several = len(parts) > 1
    sections = [
        _section(part, view, still, number if several else 0)
        for number, (part, view, still) in enumerate(zip(parts, views, stills, strict=True), start=1)
    ]
    lines = [
        *head(title, style, running),
        "<body>",
        f"<header><h1>{title}</h1>{'' if several else _run(parts[0])}</header>",
        *(_contents(parts) if several else []),
        "<main>",
        *sections,
        "</main>",
        *([f"<script>{running}</script>"] if running else []),
        "</body>",
        "</html>",
        "",
    ]
    return "\n".join(lines)


def script(own: str = "") -> str:
    """The viewer: its files one after another within a function, and a page's own part behind them."""
    parts = "".join(asset(name) for name in SCRIPTS)
    return f'(function () {{\n"use strict";\n{parts}{own}}})();\n'


def asset(name: str) -> str:
    """The text of a file of the viewer."""
    return files("compare.pages.report").joinpath("viewer", name).read_text(encoding="utf-8")


def head(title: str, style: str, running: str) -> tuple[str, ...]:
    """The lines of a page in one file up to its body; title: escaped; nothing is loaded from elsewhere (`policy`)."""
    return (
        "<!DOCTYPE html>",
        '<html lang="en">',
        "<head>",
        '<meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{policy(style, running)}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        '<link rel="icon" href="data:,">',
        f"<title>{title}</title>",
        f"<style>{style}</style>",
        "</head>",
    )


def policy(style: str, script: str) -> str:
    """Nothing but this file's own style and script, known by their digests, and pictures within it."""

    def digest(text: str) -> str:
        return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"

    scripts = digest(script) if script else "'none'"
    return (
        f"default-src 'none'; script-src {scripts}; style-src {digest(style)}; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


def _contents(parts: Sequence[Part]) -> list[str]:
    entries = [
        f'<li><a href="#r{number}">{escape(part.page.title)}</a> '
        f"<small>{escape(part.page.command)}, {escape(part.name)}</small>{_answer(part.page)}</li>"
        for number, part in enumerate(parts, start=1)
    ]
    return ['<nav aria-label="Contents"><ol>', *entries, "</ol></nav>"]


def _answer(page: Page) -> str:
    """The verdict in the list of contents."""
    found = page.verdict
    return "" if found is None else f'<br><span class="answer {found.grade}">{escape(found.line)}</span>'


def _run(part: Part) -> str:
    made = part.page.provenance.get("time")
    when = f", {escape(str(made))}" if made else ""
    return f'<p class="run">ribbonbench {escape(part.page.command)}, folder {escape(part.name)}{when}</p>'


def _section(part: Part, view: View | None, still: bytes | None, number: int) -> str:
    """One result; number: of its section, 0 where it is the only one, whose title is the page's."""
    page, level = part.page, "h3" if number else "h2"
    lines = [f'<section class="result" id="r{number or 1}">']
    if number:
        lines += [f"<h2>{escape(page.title)}</h2>", _run(part)]
    if page.verdict is not None:
        lines.append(f'<p class="answer {page.verdict.grade}">{escape(page.verdict.line)}</p>')
    if page.sentences:
        lines += ['<ul class="verdict">', *(f"<li>{escape(sentence)}</li>" for sentence in page.sentences), "</ul>"]
    for table in page.tables:
        lines += [f"<{level}>{escape(table.title)}</{level}>", table_html(table)]
    if view is not None and still is not None:
        lines += [f"<{level}>Surfaces</{level}>", _view(page, view, still)]
    if page.pictures:
        lines.append(f"<{level}>Pictures</{level}>")
    for picture in page.pictures:
        caption = f"<figcaption>{escape(picture.caption)}</figcaption>" if picture.caption else ""
        lines.append(f"<figure>{_image(part.pictures[picture.file], picture.alt)}{caption}</figure>")
    lines.append(f"<{level}>How it was made</{level}>")
    lines.append(f"<pre>{escape(page.again)}</pre>" if page.again else f"<p>{THROUGH_PYTHON}</p>")
    lines.append(_pairs(provenance_rows(page)))
    if page.files:
        named = [(name, what) for name, what in page.files.items()]
        lines.append(f"<details><summary>Files in the folder {escape(part.name)}</summary>{_pairs(named)}</details>")
    if page.scene:
        lines.append(f"<details><summary>The scene</summary><pre>{escape(page.scene)}</pre></details>")
    return "\n".join([*lines, "</section>"])


def _pairs(rows: Iterable[tuple[str, str]]) -> str:
    return "<dl>" + "".join(f"<dt>{escape(name)}</dt><dd>{escape(text)}</dd>" for name, text in rows) + "</dl>"


def _image(content: bytes, alt: str) -> str:
    """A PNG at half its size in pixels, so that it is sharp where a screen has two of them to a point."""
    width = int.from_bytes(content[16:20], "big")
    source = f"data:image/png;base64,{base64.b64encode(content).decode()}"
    return f'<img alt="{escape(alt)}" width="{max(1, width // 2)}" src="{source}">'


def table_html(table: Table) -> str:
    """The main columns of a table, what all rows have in common, and to fold out all columns, in parts that are no
    wider than the main table: readable on a phone and on paper."""
    short, common = main_table(table)
    text = f"<p>{escape(common)}</p>" if common else ""
    if len(short.columns) == len(with_values(table).columns):
        return _table(short)
    parts = "".join(map(_table, whole_in_parts(table)))
    count = len(with_values(table).columns)
    return f'{_table(short)}{text}<details class="all"><summary>All {count} columns</summary>{parts}</details>'


def _table(table: Table) -> str:
    """A table in a box that scrolls by itself; its first column names the rows and stays in sight."""
    right, headings, meaning = table.right_aligned(), [c.heading for c in table.columns], table.explanation()
    texts = table.texts()
    kinds = []
    for column, numeric in enumerate(right):
        most = max((len(row[column]) for row in texts), default=0)
        kinds.append("number" if numeric else "words much" if most > _MUCH else "words")
    head = "".join(f'<th scope="col" class="{k}">{escape(h)}</th>' for h, k in zip(headings, kinds, strict=True))
    body = []
    for row in texts:
        cells = [f'<td class="{k}">{escape(text)}</td>' for text, k in zip(row[1:], kinds[1:], strict=True)]
        body.append(f'<tr><th scope="row" class="{kinds[0]}">{escape(row[0])}</th>{"".join(cells)}</tr>')
    long = " long" if len(texts) > _LONG_TABLE else ""
    legend = f'<p class="legend">{escape(meaning)}</p>' if meaning else ""
    return (
        f'<div class="box{long}" role="region" tabindex="0" aria-label="{escape(table.title)}"><table>'
        f"<thead><tr>{head}</tr></thead><tbody>{''.join(body)}</tbody></table></div>{legend}"
    )


def _view(page: Page, view: View, still: bytes) -> str:
    """The 3-D view: a picture for those who cannot turn it, and the surfaces as data for those who can."""
    alt = view_text(page)
    kinds = {one.surface.kind for one in view.surfaces}
    marks = " Red arrows: pushes where the strip touches." if PUSH in kinds else ""
    marks += " Violet: friction." if RUB in kinds else ""
    data = json.dumps(as_data(view, alt), allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    return (
        f'<figure class="view"><div class="stage">{_image(still, alt)}</div>'
        f'<script type="application/json">{data}</script>'
        '<figcaption><span class="hands">Drag or arrow keys turn, wheel (after a click), pinch or + and - zoom, shift '
        "and drag or two fingers move, 0 goes back; the pointer, a touch or the key i tells values. </span>The ribbon "
        "lies in front of what it coincides with. Thin lines: edges; orange: their start, s = 0."
        f"{marks}</figcaption></figure>"
    )
