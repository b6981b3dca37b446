"""Every key of the contract with kind, range, unit, default and meaning: the table of docs/scenes.md, and what
`ribbonbench keys` answers.

python -m compare.pages.keys docs/scenes.md    # writes it into the page; without a page, to the terminal
"""

from __future__ import annotations

import difflib
import fnmatch
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from compare.models import registry
from compare.page.table import Column, Table
from compare.scene.declare import LENGTH, NONE, Key, Kind, keys_of, literal
from compare.scene.keys import KEYS, LISTED, SPECS
from compare.scene.strips.spec import BetweenSpec, JointSpec, NamedSpec

MARKS = ("<!-- keys: made by python -m compare.pages.keys docs/scenes.md -->", "<!-- end of keys -->")
"""What stands before and behind the tables in the page."""

STRIPS_MARKS = ("<!-- keys of [[strip]]: made with the table of every key -->", "<!-- end of keys of [[strip]] -->")
"""The same of the table of what a scene of several strips has besides."""

UNITS = {None: "", NONE: "none", LENGTH: "length"}
"""How the tables name units; the others as declared."""

HEAD = ("key", "kind", "range", "unit", "default", "meaning")


def tables() -> str:
    """Markdown: one table of all keys by their dotted names, both clamps in one row ("clamp.*.ruling")."""
    head = (f"| {' | '.join(HEAD)} |", f"|{'---|' * len(HEAD)}")
    return "\n".join([*head, *(row for section in SPECS if section != "clamp.end" for row in _rows(section)), ""])


def strips_tables() -> str:
    """Markdown: the keys that only a scene of several strips has."""
    head = (f"| {' | '.join(HEAD)} |", f"|{'---|' * len(HEAD)}")
    keys = [*keys_of(NamedSpec, "strip").values(), *keys_of(JointSpec, "joint").values()]
    rows = (_row(about, about.name) for about in [*keys, *keys_of(BetweenSpec, "contact").values()])
    return "\n".join([*head, *rows, ""])


def _rows(section: str) -> Iterator[str]:
    """The rows of a section; those of both clamps are that of the start, with the end's defaults where they differ."""
    for about in keys_of(SPECS[section], section, at="this end").values():
        default = _default(about)
        if section == "clamp.start" and (other := _default(KEYS[f"clamp.end.{about.field}"])) != default:
            default += f"; at the end {other}"
        yield _row(about, about.name.replace("clamp.start.", "clamp.*."), default)


def _row(about: Key, name: str, default: str = "") -> str:
    unit = UNITS.get(about.unit, about.unit)
    return (
        f"| `{name}` | {_kind(about)} | {_range(about)} | {unit} | {default or _default(about)} | {_meaning(about)} |"
    )


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
    if about.kind in (Kind.LINEAR, Kind.LAW, Kind.PIECEWISE) and len(set(value)) == 1:
        value = value[0]
    return f"`{literal(value)}`"


# -- for `ribbonbench keys` -------------------------------------------------------------------------------------------

_COLUMNS = (
    Column("key", "key", kind="word"),
    Column("unit", "unit", kind="word", rank=2),
    Column("range", "range", kind="word", rank=4),
    Column("default", "default", kind="word", rank=3),
    Column("meaning", "meaning", kind="word", rank=1),
)


def matching(pattern: str | None) -> tuple[list[str], bool]:
    """The keys that a pattern means, and whether it means them as it stands (False: only nearly).

    None: all. A name, or a glob of names ("strip.*"); or else what has the pattern in its name or, with three letters
    or more, in its meaning; or else the nearest names, three at most. Capitals do not count.
    """
    if pattern is None:
        return list(KEYS), True
    requested = pattern.strip().strip("[]").lower()
    for test in (
        lambda name: name == requested,
        lambda name: fnmatch.fnmatchcase(name, requested) or fnmatch.fnmatchcase(name.rpartition(".")[2], requested),
        lambda name: requested in name,
        lambda name: len(requested) > 2 and requested in _plain_meaning(KEYS[name]).lower(),
    ):
        found = [name for name in KEYS if test(name)]
        if found:
            return found, True
    whole = difflib.get_close_matches(requested, KEYS, n=3, cutoff=0.8)
    if whole or "." in requested:
        return whole or difflib.get_close_matches(requested, KEYS, n=3, cutoff=0.5), False
    fields = {name.rpartition(".")[2]: name for name in reversed(list(KEYS))}
    return [fields[field] for field in difflib.get_close_matches(requested, fields, n=3, cutoff=0.6)], False


def table_of(names: Sequence[str]) -> Table:
    """One row for each key: unit, range, default, meaning."""
    about = [KEYS[name] for name in names]
    rows = ((key.name, _unit(key), _range(key), _plain(_default(key)), _plain_meaning(key)) for key in about)
    return Table("", _COLUMNS, tuple(rows))


def described(name: str) -> list[tuple[str, str]]:
    """All that is known of a key, as names and texts; which models read it (which are imported for it)."""
    about = KEYS[name]
    readers = [model for model in registry.names() if name in registry.model(model).reads]
    said = [
        ("meaning", _plain_meaning(about)),
        ("kind", _plain(_kind(about))),
        ("range", _range(about)),
        ("unit", _unit(about)),
        ("default", _plain(_default(about))),
        ("example", _example(about)),
        ("on a command line", f"--set '{name}={about.example}'" if _can_be_set(name) else ""),
        ("read by", ", ".join(readers)),
    ]
    return [(heading, text) for heading, text in said if text]


def _can_be_set(name: str) -> bool:
    """Walls go by number or name there, and a path as a whole."""
    return name.split(".")[0] not in (*LISTED, "path")


def _example(about: Key) -> str:
    section = about.name.rpartition(".")[0]
    brackets = f"[[{section}]] " if section in (*LISTED, "path") else f"[{section}] " if section else ""
    return f"{brackets}{about.field} = {about.example}"


def _unit(about: Key) -> str:
    return UNITS.get(about.unit, about.unit) or ""


def _range(about: Key) -> str:
    """What is right at all, and for which numbers the models are known to work."""
    return "; ".join(part.text for part in (about.range, about.known) if part is not None)


def _plain(text: str) -> str:
    """Without the marks of Markdown."""
    return text.replace("`", "")


def _plain_meaning(about: Key) -> str:
    return _plain(_meaning(about))


def in_page(text: str) -> str:
    """The text of a page with the tables between the marks made anew; ValueError for a page without the marks."""
    for marks, made in ((MARKS, tables), (STRIPS_MARKS, strips_tables)):
        before, first, rest = text.partition(marks[0])
        _, last, behind = rest.partition(marks[1])
        if not first or not last:
            raise ValueError(f"the page has no {marks[0]} ... {marks[1]}")
        text = f"{before}{first}\n\n{made()}\n{last}{behind}"
    return text


def main(arguments: Sequence[str]) -> None:
    """Write the tables into the page named, or to the terminal."""
    if not arguments:
        print(tables())
        return
    page = Path(arguments[0])
    page.write_text(in_page(page.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
