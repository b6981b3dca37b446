"""The folders that a report is made from: their pages, with every file that they name read and checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from compare.page.page import PAGE, Page, Surface, read_page
from compare.pages.export.source import inside
from compare.pages.export.vtu import Sheet, read_vtu
from compare.store.states import States, read_states
from ribbonbench.errors import BadInput

#: Where results are below a folder that has none: out/SCENE/COMMAND from out/SCENE, and from out.
_DEPTHS = (f"[!.]*/{PAGE}", f"[!.]*/[!.]*/{PAGE}")
_PNG = b"\x89PNG\r\n\x1a\n"


@dataclass(frozen=True)
class Part:
    """One result in a report: its folder and the folder's name, its page, pictures by file, surfaces, and states along
    paths by file."""

    folder: Path
    name: str
    page: Page
    pictures: dict[str, bytes]
    surfaces: tuple[tuple[Surface, Sheet], ...]
    states: dict[str, States]


def folders_of(given: Sequence[Path]) -> list[Path]:
    """The folders with a page among those given and, where one has none, in it or in the folders there; each once, in
    order."""
    found: list[Path] = []
    for folder in given:
        if not folder.exists():
            raise BadInput("FOLDER", str(folder), "is not there", "give folders that ribbonbench has written")
        if not folder.is_dir():
            raise BadInput("FOLDER", str(folder), "is a file, not a folder", "give the folder that it stands in")
        inner = [folder]
        if not (folder / PAGE).is_file():
            found_there = {path.parent for depth in _DEPTHS for path in folder.glob(depth)}
            inner = sorted(place for place in found_there if place.parent not in found_there)  # no export of a result
        if not inner and not (folder / "result.json").is_file():
            raise BadInput(
                "FOLDER", str(folder), f"holds no results: neither it nor a folder in it has {PAGE}",
                "give a folder that ribbonbench solve, compare, shell or another command has written",
            )  # fmt: skip
        found += inner or [folder]  # results without a page are of an older version: the reader says so
    unique = {path.resolve(): path for path in reversed(found)}
    return [path for path in found if unique.pop(path.resolve(), None) is not None]


def read_part(folder: Path) -> Part:
    """The page of a folder with its files; `BadInput` names one that is missing or damaged."""
    page = read_page(folder)
    pictures = {}
    for picture in page.pictures:
        content = inside(folder, picture.file).read_bytes()
        if not content.startswith(_PNG):
            raise BadInput("FOLDER", str(folder), f"{picture.file!r} is no PNG picture", "run the command again")
        pictures[picture.file] = content
    surfaces = tuple((surface, read_vtu(inside(folder, surface.file))) for surface in page.surfaces)
    states = {s.states: read_states(inside(folder, s.states)) for s in page.surfaces if s.states}
    return Part(folder, folder.resolve().name, page, pictures, surfaces, states)
