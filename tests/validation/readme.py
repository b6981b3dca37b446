"""Pages of prose whose measured numbers come from the data, by name: `FILE.in` is typed, `FILE` is rendered from it.

A placeholder is `{PAGE.NUMBER}` (as the number is shown), `{PAGE.NUMBER:.1e}` (in a format of its own),
`{PAGE.NUMBER.error}`, or one of the page's own words: `{PAGE.day}`, `{PAGE.seconds}`, `{PAGE.command}`, and
`{PAGE.remade}` for command and day together. PAGE is a measurement's name.

A page that was made before data were kept has none: `{PAGE.NUMBER|1.23}` is then what it says, `{PAGE.remade|DAY}` its
command, its day and that its data are missing. With the first data `write` takes what stands behind the stroke out of
the template.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from compare.store.store import atomic_write_text
from tests.validation.record import Pages, Record

#: The rendered pages, from the project's root.
RENDERED = ("results/README.md", "README.md", "docs/which_model.md")
PLACEHOLDER = re.compile(r"\{([a-z][a-z0-9_]*)\.([a-z][a-z0-9_]*)(\.error)?(?::([^{}|\s]*))?(?:\|([^{}|]*))?\}")
#: What is said of the numbers of a page that has no data.
WITHOUT = "before its data were kept"


def template(page: Path) -> Path:
    """The file that a page is rendered from."""
    return page.with_name(page.name + ".in")


def named(text: str) -> dict[str, set[str]]:
    """Page -> the numbers and words that a template takes from it."""
    found: dict[str, set[str]] = {}
    for page, what, *_ in PLACEHOLDER.findall(text):
        found.setdefault(page, set()).add(what)
    return found


def render(text: str, records: Mapping[str, Record]) -> str:
    """The text with every placeholder replaced. Raises ValueError for a page, number or error that is not there."""

    def value(match: re.Match[str]) -> str:
        page, what, error, shown, typed = match.groups()
        record = records.get(page)
        if record is None and typed is not None:
            return typed if what != "remade" else f"`python -m tests.validation {page}`, {typed}, {WITHOUT}"
        if record is None:
            raise ValueError(f"{match[0]}: no data of {page}; python -m tests.validation {page} makes it")
        words = {"day": record.time[:10], "command": f"`{record.command}`", "seconds": f"{record.seconds:.0f}"}
        words["remade"] = f"{words['command']}, {words['day']}"
        if what in words:
            return words[what]
        if what not in record.numbers:
            raise ValueError(f"{match[0]}: {page} has no such number; there are {', '.join(record.numbers) or 'none'}")
        number = record.numbers[what]
        if error is None:
            return format(number.value, shown) if shown else str(number)
        if number.error is None:
            raise ValueError(f"{match[0]}: the number has no error: {number.why}")
        return format(number.error, shown or ".1e")

    return PLACEHOLDER.sub(value, text)


def rendered(pages: Pages, page: str) -> str:
    """A page of `RENDERED` as its template and the data have it."""
    text = template(pages.root / page).read_text()
    found = {name: pages.read(name) for name in named(text)}
    return render(text, {name: record for name, record in found.items() if record is not None})


def settled(text: str, records: Mapping[str, Record]) -> str:
    """A template without what was typed for pages that have data now."""

    def without(match: re.Match[str]) -> str:
        typed = match[5]
        return match[0] if typed is None or match[1] not in records else match[0].removesuffix(f"|{typed}}}") + "}"

    return PLACEHOLDER.sub(without, text)


def typed(text: str) -> set[str]:
    """The pages for which a template has something typed, in want of data."""
    return {page for page, _, _, _, words in PLACEHOLDER.findall(text) if words}


def wrong(pages: Pages, page: str) -> list[str]:
    """What keeps a page of `RENDERED` from being rendered: placeholders that name what is not there."""
    found, kept = [], {name: pages.read(name) for name in named(template(pages.root / page).read_text())}
    records = {name: record for name, record in kept.items() if record is not None}
    for match in PLACEHOLDER.finditer(template(pages.root / page).read_text()):
        try:
            render(match[0], records)
        except ValueError as error:
            found.append(f"{page}: {error}")
    return found


def write(pages: Pages) -> list[str]:
    """Renders every page of `RENDERED`; one with a placeholder that names what is not there stays as it is, and each
    of these is returned in words."""
    problems = []
    for page in RENDERED:
        if found := wrong(pages, page):
            problems += found
            continue
        place = template(pages.root / page)
        text = place.read_text()
        kept = {name: record for name in named(text) if (record := pages.read(name)) is not None}
        if (shorter := settled(text, kept)) != text:
            atomic_write_text(place, shorter)
        atomic_write_text(pages.root / page, rendered(pages, page))
    return problems
