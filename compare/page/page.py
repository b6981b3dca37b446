"""What a report shows, as data: every command stores it as `page.json` beside its results, any reader can draw it.

Neither a solver nor a library for pictures is imported. Files are named relative to the folder of the page.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from compare.errors import BadInput
from compare.store.store import atomic_write_json, read_json

PAGE = "page.json"
FORMAT = 1
"""Of `page.json`; a reader refuses others and says which version wrote them."""

Cell = str | float | int | bool | None


@dataclass(frozen=True)
class Table:
    """A table: `rows` hold numbers or text in the order of `headings`; `formats` say how numbers are written ("" : as
    text, otherwise a format such as ".2e"), one per column; `legend` what the columns mean."""

    title: str
    headings: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    formats: tuple[str, ...] = ()
    legend: str = ""

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.headings):
                raise ValueError(f"a row of {self.title!r} has {len(row)} cells, not {len(self.headings)}")
        if self.formats and len(self.formats) != len(self.headings):
            raise ValueError(f"{self.title!r} has {len(self.formats)} formats, not {len(self.headings)}")

    def texts(self) -> list[tuple[str, ...]]:
        """The rows as text: "-" for what is not known."""
        formats = self.formats or ("",) * len(self.headings)
        return [tuple(_text(cell, form) for cell, form in zip(row, formats, strict=True)) for row in self.rows]


@dataclass(frozen=True)
class Picture:
    """A PNG file, its text alternative (what a reader who cannot see it should know) and a caption."""

    file: str
    alt: str
    caption: str = ""


@dataclass(frozen=True)
class Surface:
    """A VTU file of a surface for the 3-D view; kind: "ribbon" or "shell"; colour: field of the file to begin with;
    width_to_thickness: of a shell, when known."""

    file: str
    label: str
    kind: str
    colour: str = ""
    width_to_thickness: float | None = None


@dataclass(frozen=True)
class Page:
    """A finished run: which command made it, from which scene, what it says and shows.

    verdict: sentences; tables, pictures, surfaces in order; files: name -> what is in it; scene: its TOML text, "" for
    none; up: direction upwards in the 3-D view; provenance: as in result.json; again: the command line that makes it
    again, as typed (`compare.commands.line`), "" where it was made through Python.
    """

    command: str
    title: str
    verdict: tuple[str, ...] = ()
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
    if found != FORMAT:
        made_by = _version(data)
        raise BadInput(
            "FOLDER", str(folder), f"its page.json has format {found}{made_by}, this version reads format {FORMAT}",
            "run the command that made it again, with this version",
        )  # fmt: skip
    try:
        return Page(
            command=data["command"],
            title=data["title"],
            verdict=tuple(data["verdict"]),
            tables=tuple(_table(entry) for entry in data["tables"]),
            pictures=tuple(Picture(**entry) for entry in data["pictures"]),
            surfaces=tuple(Surface(**entry) for entry in data["surfaces"]),
            files=data["files"],
            scene=data["scene"],
            up=None if data["up"] is None else tuple(data["up"]),  # type: ignore[arg-type]
            provenance=data["provenance"],
            again=data["again"],
        )
    except (KeyError, TypeError, ValueError) as error:
        raise BadInput("FOLDER", str(folder), f"page.json is damaged ({error})", "run the command again") from None


def _version(data: Mapping[str, Any]) -> str:
    packages = (data.get("provenance") or {}).get("packages") or {}
    return f" (ribbonbench {packages['ribbonbench']})" if "ribbonbench" in packages else ""


def _table(entry: Mapping[str, Any]) -> Table:
    return Table(
        title=entry["title"],
        headings=tuple(entry["headings"]),
        rows=tuple(tuple(row) for row in entry["rows"]),
        formats=tuple(entry["formats"]),
        legend=entry["legend"],
    )


def _text(cell: Cell, form: str) -> str:
    if cell is None:
        return "-"
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    if isinstance(cell, str):
        return cell
    if form:
        return format(cell, form)
    return f"{cell:g}" if isinstance(cell, float) else str(cell)


def as_markdown(table: Table) -> str:
    """The table in Markdown, numbers to the right; legend below."""
    lines = [
        f"| {' | '.join(_escaped(table.headings))} |",
        "|" + "|".join("---:" if right else "---" for right in right_aligned(table)) + "|",
    ]
    lines += [f"| {' | '.join(_escaped(row))} |" for row in table.texts()]
    return "\n".join(lines) + "\n" + (f"\n{table.legend}\n" if table.legend else "")


def right_aligned(table: Table) -> list[bool]:
    """Whether each column holds numbers (or nothing); text that reads as a number is one."""
    columns: Sequence[Sequence[Cell]] = list(zip(*table.rows, strict=True)) or [()] * len(table.headings)
    return [all(_is_number(cell) for cell in column) for column in columns]


def _is_number(cell: Cell) -> bool:
    if not isinstance(cell, str) or cell in ("", "-"):
        return True
    try:
        float(cell)
    except ValueError:
        return False
    return True


def markdown_text(text: str) -> str:
    """Text from data as Markdown shows it literally: on one line, no tag, no link, no picture."""
    plain = " ".join(text.split()).replace("\\", "\\\\").replace("&", "&amp;").replace("<", "&lt;")
    return plain.replace("[", "\\[").replace("`", "\\`").replace("*", "\\*")


def _escaped(cells: Sequence[str]) -> list[str]:
    return [markdown_text(cell).replace("|", "\\|") for cell in cells]
