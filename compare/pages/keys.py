"""The tables of docs/scenes.md: every key of the contract with kind, range, unit, default and meaning.

python -m compare.pages.keys docs/scenes.md    # writes them into the page; without a page, to the terminal
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from compare.scene.declare import LENGTH, NONE, Key, Kind, keys_of, literal
from compare.scene.keys import KEYS, SPECS

MARKS = ("<!-- keys: made by python -m compare.pages.keys docs/scenes.md -->", "<!-- end of keys -->")
"""What stands before and behind the tables in the page."""

UNITS = {None: "", NONE: "none", LENGTH: "length"}
"""How the tables name units; the others as declared."""

HEAD = ("key", "kind", "range", "unit", "default", "meaning")


def tables() -> str:
    """Markdown: one table for each section, the two clamps in one."""
    return "\n".join(line for section in SPECS if section != "clamp.end" for line in _table(section))


def _table(section: str) -> Iterator[str]:
    """Heading and rows of a section; both clamps are that of the start, with the end's defaults where they differ."""
    brackets = f"`[[{section}]]`" if section in ("wall", "path") else f"`[{section}]`"
    yield f"**{brackets}{' and `[clamp.end]`' * (section == 'clamp.start')}**" if section else "**Above all sections**"
    yield from ("", f"| {' | '.join(HEAD)} |", f"|{'---|' * len(HEAD)}")
    for about in keys_of(SPECS[section], section, at="this end").values():
        default = _default(about)
        if section == "clamp.start" and (other := _default(KEYS[f"clamp.end.{about.field}"])) != default:
            default += f"; at the end {other}"
        range_ = about.range.text if about.range else ""
        unit = UNITS.get(about.unit, about.unit)
        yield f"| `{about.field}` | {_kind(about)} | {range_} | {unit} | {default} | {_meaning(about)} |"
    yield ""


def _kind(about: Key) -> str:
    kind = " or ".join(f'`"{word}"`' for word in about.choices) if about.choices else about.kind.value
    return kind + "".join(f', or `"{word}"`' for word in about.words)


def _meaning(about: Key) -> str:
    texts = {**about.choices, **{word: what for word, (what, _) in about.words.items()}}
    explained = ", ".join(f'`"{word}"`: {what}' for word, what in texts.items() if what)
    return "; ".join(filter(None, (about.about, explained, about.note)))


def _default(about: Key) -> str:
    if about.required:
        return "required"
    if about.default in (None, (), ""):
        word = next((word for word, (_, value) in about.words.items() if value is None and about.default is None), None)
        return f'`"{word}"`' if word else about.absent or "absent"
    value: Any = about.written(about.default)
    if about.kind in (Kind.LINEAR, Kind.PIECEWISE) and len(set(value)) == 1:
        value = value[0]
    return f"`{literal(value)}`"


def in_page(text: str) -> str:
    """The text of a page with the tables between the marks made anew; ValueError for a page without the marks."""
    before, first, rest = text.partition(MARKS[0])
    _, last, behind = rest.partition(MARKS[1])
    if not first or not last:
        raise ValueError(f"the page has no {MARKS[0]} ... {MARKS[1]}")
    return f"{before}{first}\n\n{tables()}\n{last}{behind}"


def main(arguments: Sequence[str]) -> None:
    """Write the tables into the page named, or to the terminal."""
    if not arguments:
        print(tables())
        return
    page = Path(arguments[0])
    page.write_text(in_page(page.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
