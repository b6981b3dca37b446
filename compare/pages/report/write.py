"""Reports from stored pages: one HTML file that needs nothing else, and a Markdown twin with pictures beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from compare.pages.report import (
    html as report_html,
)
from compare.pages.report import (
    markdown as report_markdown,
)
from compare.pages.report import (
    still as report_still,
)
from compare.pages.report import (
    surfaces as report_surfaces,
)
from compare.pages.report.folders import Part, folders_of, read_part
from compare.store.store import atomic_write_bytes, atomic_write_text

HTML = "report.html"
MARKDOWN = "report.md"
PICTURES = "report_files"
#: The picture of the surfaces, beside the pictures of a page.
STILL = "surfaces.png"


@dataclass(frozen=True)
class Written:
    """The files of a report, and how many results are in it."""

    html: Path
    markdown: Path
    results: int


def read_report(given: Sequence[Path]) -> list[Part]:
    """The results in the given folders, every file of them read and checked."""
    parts = [read_part(folder) for folder in folders_of(given)]
    names = [part.name for part in parts]
    return [
        part if names.count(part.name) == 1 else replace(part, name=f"{part.folder.resolve().parent.name}/{part.name}")
        for part in parts
    ]


def write_report(out: Path, parts: Sequence[Part]) -> Written:
    """Makes the reports of the results in the folder `out`.

    A picture that stands in `out` already is named where it stands, others are copied to `report_files`.
    """
    count = sum(len(part.surfaces) for part in parts)
    each = report_surfaces.points_each(count)
    views = [
        report_surfaces.view(part.surfaces, part.page.up, each, part.states) if part.surfaces else None
        for part in parts
    ]
    stills = [None if view is None else report_still.picture(view) for view in views]
    html = report_html.document(parts, views, stills)
    links = []
    for number, (part, still) in enumerate(zip(parts, stills, strict=True), start=1):
        beside = part.folder.resolve() == out.resolve()
        place = "" if beside else f"{PICTURES}/{number:02d}_{_plain(part)}/"
        if not beside:
            for file, content in part.pictures.items():
                atomic_write_bytes(out / f"{place}{file}", content)
        if still is not None:
            atomic_write_bytes(out / f"{place}{STILL}", still)
        links.append(place)
    markdown = atomic_write_text(out / MARKDOWN, report_markdown.document(parts, links, STILL))
    return Written(atomic_write_text(out / HTML, html), markdown, len(parts))


def _plain(part: Part) -> str:
    """The folder's name as a name of a file that needs no escaping."""
    return "".join(c if c.isascii() and (c.isalnum() or c in "-_") else "_" for c in part.name)[:60]
