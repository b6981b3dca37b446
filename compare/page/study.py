"""What a command has found, as data, and the one writer of it: result.json, tables as CSV and Markdown, page.json."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from compare.page.csv import as_csv
from compare.page.markdown import as_markdown
from compare.page.page import Page, Picture, Surface, write_page
from compare.page.table import Table
from compare.page.verdict import Verdict
from compare.store.finite import explained
from compare.store.store import atomic_write_json, atomic_write_text, jsonable

RESULT = "result.json"
_WRITERS = {".csv": as_csv, ".md": as_markdown}


class Described(Protocol):
    """A scene, as far as a page shows it."""

    @property
    def up(self) -> Any:
        """Direction upwards (3,), None without weight."""

    def to_toml(self) -> str:
        """Its text."""

    def notes(self) -> tuple[str, ...]:
        """What in it has no effect, or can hardly be meant."""


@dataclass(frozen=True)
class Study:
    """A finished study. name: of the command; verdict: the answer; sentences: what else is said; tables, pictures,
    surfaces: in the order of
    the page; data: file (.csv, .md) -> the table that it holds; files: file -> what is in it, of all that are written.
    """

    name: str
    title: str
    tables: tuple[Table, ...] = ()
    verdict: Verdict | None = None
    sentences: tuple[str, ...] = ()
    pictures: tuple[Picture, ...] = ()
    surfaces: tuple[Surface, ...] = ()
    data: Mapping[str, Table] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=lambda: {RESULT: "all numbers"})

    def page(
        self, again: str, provenance: Mapping[str, Any], scene: Described | None = None, *, text: bool = True
    ) -> Page:
        """The page. again: the command that remakes it; text: whether the scene's text belongs to it, which one of many
        scenes does not."""
        return Page(
            command=self.name,
            title=self.title,
            verdict=self.verdict,
            sentences=self.sentences,
            tables=self.tables,
            pictures=self.pictures,
            surfaces=self.surfaces,
            files=self.files,
            scene="" if scene is None or not text else scene.to_toml(),
            up=upwards(scene),
            provenance=jsonable(provenance),
            again=again,
        )

    def write(
        self,
        out: Path,
        result: Mapping[str, Any],
        again: str,
        scene: Described | None = None,
        *,
        text: bool = True,
    ) -> Page:
        """Writes result.json, the tables of `data` and page.json into `out`, each atomically; the pictures and surfaces
        stand there already. result: with its `provenance`; the verdict is added to it as `answer`, what the scene has
        to be noted as `notes`. The rest as of `page`."""
        notes = {} if scene is None else {"notes": list(scene.notes())}
        atomic_write_json(out / RESULT, explained({**result, **notes, "answer": self.verdict}))
        for name, table in self.data.items():
            atomic_write_text(out / name, _WRITERS[Path(name).suffix](table))
        page = self.page(again, result["provenance"], scene, text=text)
        write_page(out, page)
        return page


def upwards(scene: Described | None) -> tuple[float, float, float] | None:
    """A scene's direction upwards; None without weight."""
    if scene is None or scene.up is None:
        return None
    x, y, z = (float(c) for c in scene.up)
    return x, y, z
