"""What a report shows, as data: every command stores it as `page.json` beside its results, any reader can draw it.

Neither a solver nor a library for pictures is imported. Files are named relative to the folder of the page.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from compare.page.table import LAST, USUAL, Column, Table
from compare.page.verdict import Verdict
from compare.store.store import atomic_write_json, read_json
from ribbonbench.errors import BadInput

PAGE = "page.json"
FORMAT = 3
"""Of `page.json`; a reader knows the earlier ones too, refuses others and says which version wrote them."""


@dataclass(frozen=True)
class Picture:
    """A PNG file, its text alternative (what a reader who cannot see it should know) and a caption."""

    file: str
    alt: str
    caption: str = ""


#: Kinds of surfaces, as page.json has them: of a strip with lines across, of a shell, what the strip cannot cross, and
#: arrows of pushes and of friction.
STRIP, SHELL, WALL, PUSH, RUB = "ribbon", "shell", "wall", "push", "friction"
#: Arrows at places of contact.
ARROWS = (PUSH, RUB)


@dataclass(frozen=True)
class Surface:
    """A VTU file of a surface for the 3-D view; kind: one of those above; colour: field of the file to begin with;
    width_to_thickness: of a shell, when known; states: file of its states along a path (`compare.store.states`)."""

    file: str
    label: str
    kind: str
    colour: str = ""
    width_to_thickness: float | None = None
    states: str = ""

    @property
    def of_shell(self) -> bool:
        """Whether it is a shell's."""
        return self.kind == SHELL

    @property
    def of_strip(self) -> bool:
        """Whether it is the strip's own by another model than the shell."""
        return self.kind == STRIP


@dataclass(frozen=True)
class Page:
    """A finished run: which command made it, from which scene, what it says and shows.

    verdict: the answer, None of an older version; sentences: what else is said; tables, pictures, surfaces in order;
    files: name -> what is in it; scene: its TOML text, "" for
    none; up: direction upwards in the 3-D view; provenance: as in result.json; again: the command line that makes it
    again, as typed (`compare.commands.line`), "" where it was made through Python.
    """

    command: str
    title: str
    verdict: Verdict | None = None
    sentences: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    pictures: tuple[Picture, ...] = ()
    surfaces: tuple[Surface, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)
    scene: str = ""
    up: tuple[float, float, float] | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)
    again: str = ""


def write_page(folder: Path, page: Page) -> Path:
    """Stores the page in its folder, atomically."""
    content = {f.name: getattr(page, f.name) for f in fields(Page)}
    return atomic_write_json(folder / PAGE, {"format": FORMAT, **content})


def read_page(folder: Path) -> Page:
    """The page of a folder; `BadInput` names what is there instead."""
    path = Path(folder) / PAGE
    if not path.is_file():
        older = (Path(folder) / "result.json").is_file()
        problem = "has results of an older version, without page.json" if older else "has no page.json"
        raise BadInput("FOLDER", str(folder), problem, "run the command that made the results again, into this folder")
    try:
        data = read_json(path)
        found = data["format"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BadInput("FOLDER", str(folder), f"page.json cannot be read ({error})", "run the command again") from None
    if found not in range(1, FORMAT + 1):
        made_by = _version(data)
        raise BadInput(
            "FOLDER", str(folder), f"its page.json has format {found}{made_by}, this version reads format {FORMAT}",
            "run the command that made it again, with this version",
        )  # fmt: skip
    table, old = _TABLES.get(found, _table), found < 3
    try:
        return Page(
            command=data["command"],
            title=data["title"],
            verdict=None if old or data["verdict"] is None else Verdict.from_data(data["verdict"]),
            sentences=tuple(data["verdict"] if old else data["sentences"]),
            tables=tuple(table(entry) for entry in data["tables"]),
            pictures=tuple(Picture(**entry) for entry in data["pictures"]),
            surfaces=tuple(Surface(**entry) for entry in data["surfaces"]),
            files=data["files"],
            scene=data["scene"],
            up=None if data["up"] is None else tuple(data["up"]),  # type: ignore[arg-type]
            provenance=data["provenance"],
            again=data["again"],
        )
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise BadInput("FOLDER", str(folder), f"page.json is damaged ({error})", "run the command again") from None


def _version(data: Mapping[str, Any]) -> str:
    packages = (data.get("provenance") or {}).get("packages") or {}
    return f" (ribbonbench {packages['ribbonbench']})" if "ribbonbench" in packages else ""


def _table(entry: Mapping[str, Any]) -> Table:
    rows, below = (tuple(tuple(row) for row in entry[name]) for name in ("rows", "below"))
    return Table(entry["title"], tuple(Column(**column) for column in entry["columns"]), rows, entry["legend"], below)


def _table_of_format_1(entry: Mapping[str, Any]) -> Table:
    """A table of the first format: headings and Python's formats instead of columns, much of it text already."""
    headings, rows = entry["headings"], entry["rows"]
    formats = entry["formats"] or [""] * len(headings)
    columns = []
    for place, (heading, form) in enumerate(zip(headings, formats, strict=True)):
        column = Column(f"{place}", heading, kind=_kind_of_format(form))
        if not all(column.takes(row[place]) for row in rows):  # numbers among words
            column = Column(f"{place}", heading)
        columns.append(column)
    return Table(entry["title"], tuple(columns), tuple(map(tuple, rows)), entry["legend"])


def _table_of_format_2(entry: Mapping[str, Any]) -> Table:
    """A table of the second format: of each column, whether a terminal has room for it in the place of its rank."""
    columns = [{name: value for name, value in column.items() if name != "terminal"} for column in entry["columns"]]
    for column, before in zip(columns, entry["columns"], strict=True):
        column["rank"] = USUAL if before["terminal"] else LAST
    return _table({**entry, "columns": columns})


_TABLES = {1: _table_of_format_1, 2: _table_of_format_2}


def _kind_of_format(form: str) -> str:
    """The kind of a column that was written with a format such as ".2e"."""
    found = re.fullmatch(r"\.?(\d*)([defg])", form)
    if found is None:
        return "plain"
    kind = {"d": "integer", "e": "exponent", "f": "decimals", "g": "digits"}[found[2]]
    return f"{kind}:{found[1]}" if found[1] else kind
