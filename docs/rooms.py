"""Draws docs/rooms.svg: the rooms of the packages on their floors, with what they import. From the project's root:

python -m docs.rooms                 # tests/test_rooms.py holds the file to the import graph
"""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

from tests.test_rooms import LEVELS, PACKAGES, SOURCES, between_rooms, graph

PLACE = Path(__file__).with_name("rooms.svg")
PAGE = Path(__file__).with_name("architecture.md")
HEADS = "| room | what stands there |\n|---|---|\n"
TITLES = {"compare": "compare: the workbench", "ribbon": "ribbon: the solver", "shellref": "shellref: the references"}
#: Columns from left to right, and their measures on the paper.
COLUMNS = ("ribbon", "compare", "shellref")
BOX, HEIGHT, GAP, FLOOR, MARGIN, HEAD = 104, 26, 8, 52, 24, 46
ROW = 4
INK, FACE, EDGE, LINE = "#1f2a36", "#e8eef4", "#8899aa", "#0072b2"

Arrows = Mapping[str, set[str]]


def floors(package: str) -> list[list[str]]:
    """The rooms of a package, floor by floor from the top, at most ROW in a row."""
    own = [[room for room in rooms if room.split(".")[0] == package] for rooms in LEVELS]
    return [rooms[k : k + ROW] for rooms in own if rooms for k in range(0, len(rooms), ROW)]


def placed(package: str, left: float) -> dict[str, tuple[float, float]]:
    """Upper left corner of every room of a package whose column begins at `left`."""
    rows = floors(package)
    width = _width(package)
    found: dict[str, tuple[float, float]] = {}
    for floor, rooms in enumerate(rows):
        row = len(rooms) * BOX + (len(rooms) - 1) * GAP
        for k, room in enumerate(rooms):
            found[room] = (left + 0.5 * (width - row) + k * (BOX + GAP), HEAD + floor * FLOOR)
    return found


def _width(package: str) -> float:
    most = max(len(rooms) for rooms in floors(package))
    return most * BOX + (most - 1) * GAP


def drawing(arrows: Arrows) -> str:
    """The picture as SVG: one box a room, one line an import between rooms (data-from, data-to)."""
    left, where, heads = float(MARGIN), {}, []
    for package in COLUMNS:
        where |= placed(package, left)
        heads.append(_text(left + 0.5 * _width(package), 24, TITLES[package], 14, True))
        left += _width(package) + 2 * MARGIN
    tall = max(y for _, y in where.values()) + HEIGHT + MARGIN
    lines = [_line(where[one], where[other], one, other) for one in sorted(arrows) for other in sorted(arrows[one])]
    boxes = [_box(room, *corner) for room, corner in where.items()]
    size = f'width="{left - MARGIN:g}" height="{tall:g}" viewBox="0 0 {left - MARGIN:g} {tall:g}"'
    return "\n".join([
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif">',
        "<title>The rooms: a room imports from those below it</title>",
        '<rect width="100%" height="100%" fill="white"/>',
        *lines, *boxes, *heads, "</svg>", "",
    ])  # fmt: skip


def _line(here: Sequence[float], there: Sequence[float], one: str, other: str) -> str:
    x, y, u, v = here[0] + 0.5 * BOX, here[1] + HEIGHT, there[0] + 0.5 * BOX, there[1]
    middle = 0.5 * (y + v)
    return (
        f'<path d="M{x:g} {y:g} C{x:g} {middle:g} {u:g} {middle:g} {u:g} {v:g}" fill="none" stroke="{LINE}" '
        f'stroke-opacity="0.28" data-from="{one}" data-to="{other}"/>'
    )


def _box(room: str, x: float, y: float) -> str:
    name = room.partition(".")[2] or room
    shape = f'<rect x="{x:g}" y="{y:g}" width="{BOX}" height="{HEIGHT}" rx="4" fill="{FACE}" stroke="{EDGE}"/>'
    return shape + _text(x + 0.5 * BOX, y + 17, name, 11)


def _text(x: float, y: float, words: str, size: int, bold: bool = False) -> str:
    weight = ' font-weight="bold"' if bold else ""
    return (
        f'<text x="{x:g}" y="{y:g}" font-size="{size}" fill="{INK}" text-anchor="middle"{weight}>{escape(words)}</text>'
    )


def table() -> str:
    """The rows of docs/architecture.md: every room with the first sentence that it says of itself, top to bottom."""
    files = SOURCES.every(*PACKAGES)
    rooms = [room for column in COLUMNS for floor in floors(column) for room in floor]
    return "".join(f"| `{room}` | {_says(files[room])} |\n" for room in rooms)


def _says(file: Path) -> str:
    first = (ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or "").partition("\n\n")[0]
    words = " ".join(first.split())
    return re.split(r"(?<=[a-z)`])\. (?=[A-Z`])", words)[0].rstrip(".")


def main() -> None:
    """Writes the picture, and the rows of the page below its heading."""
    assert set(COLUMNS) == set(PACKAGES)
    PLACE.write_text(drawing(between_rooms(graph())), encoding="utf-8")
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(text[: text.index(HEADS) + len(HEADS)] + table(), encoding="utf-8")


if __name__ == "__main__":
    main()
