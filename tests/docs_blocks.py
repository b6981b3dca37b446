"""The pages of the documentation as data: fenced blocks, links, anchors."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"


def pages() -> list[Path]:
    """README and every page under docs/."""
    return [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]


def name_of(page: Path) -> str:
    """The page seen from the project's root."""
    return page.relative_to(ROOT).as_posix()


@dataclass(frozen=True)
class Block:
    """A fenced block: `info` is what follows the fence ("python", "toml scene"), `line` that of its first line."""

    info: str
    text: str
    line: int


def blocks(text: str) -> list[Block]:
    """The fenced blocks of a page, in order; ValueError for a fence that is not closed."""
    found: list[Block] = []
    info: str | None = None
    held: list[str] = []
    start = 0
    for number, line in enumerate(text.splitlines(), 1):
        if not line.startswith("```"):
            held.append(line)
        elif info is None:
            info, held, start = line[3:].strip(), [], number + 1
        else:
            found.append(Block(info, "\n".join(held) + "\n", start))
            info = None
    if info is not None:
        raise ValueError(f"the fence at line {start - 1} is not closed")
    return found


def prose(text: str) -> str:
    """The page without its fenced blocks."""
    return re.sub(r"^```.*?^```$", "", text, flags=re.S | re.M)


@dataclass(frozen=True)
class Command:
    """A line "$ ..." of a console block and the exit code it ends with ("# exit code N" below it, 0 otherwise)."""

    line: str
    code: int


def commands(block: Block) -> Iterator[Command]:
    """The commands of a console block; a backslash at the end continues a line."""
    lines = block.text.splitlines()
    at = 0
    while at < len(lines):
        line = lines[at]
        at += 1
        if not line.startswith("$ "):
            continue
        while line.endswith("\\"):
            line = line[:-1].rstrip() + " " + lines[at].strip()
            at += 1
        code = 0
        for below in lines[at:]:
            if below.startswith("$ "):
                break
            noted = re.fullmatch(r"# exit code (\d+)", below.strip())
            if noted:
                code = int(noted[1])
                break
        yield Command(line[2:].strip(), code)


def links(text: str) -> list[str]:
    """Targets of links and pictures that are not addresses of the web."""
    found = re.findall(r"\]\(([^)\s]+)\)", prose(text))
    return [target for target in found if not re.match(r"[a-z]+:", target)]


def anchors(text: str) -> set[str]:
    """The anchors that GitHub gives to the headings of a page."""
    found = set()
    for heading in re.findall(r"^#+ (.*)$", prose(text), re.M):
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)|[`*]", r"\1", heading).strip().lower()
        found.add(re.sub(r"[^\w\- ]", "", plain).replace(" ", "-"))
    return found
