"""The pages of the documentation as data: fenced blocks, links, anchors."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"


def pages() -> list[Path]:
    """README, the page of what was measured and every page under docs/."""
    return [ROOT / "README.md", ROOT / "results" / "README.md", *sorted(DOCS.rglob("*.md"))]


def name_of(page: Path) -> str:
    """The page seen from the project's root."""
    return page.relative_to(ROOT).as_posix()


@dataclass(frozen=True)
class Block:
    """A fenced block: `info` is its kind ("python", "toml scene"), `line` that of its first line.

    file: the name behind the kind ("toml scene tape.toml"): scene and sweep are written under it.
    """

    info: str
    text: str
    line: int
    file: str = ""


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
            kind, _, file = info.rpartition(" ") if re.search(r" [\w./-]+\.(toml|py)$", info) else (info, "", "")
            found.append(Block(kind, "\n".join(held) + "\n", start, file))
            info = None
    if info is not None:
        raise ValueError(f"the fence at line {start - 1} is not closed")
    return found


def prose(text: str) -> str:
    """The page without its fenced blocks."""
    return re.sub(r"^```.*?^```$", "", text, flags=re.S | re.M)


@dataclass(frozen=True)
class Command:
    """A line "$ ..." of a console block and what is shown below it.

    code: the exit code it ends with ("# exit code N" below it, 0 otherwise).
    """

    line: str
    code: int
    shown: str = ""


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
        shown = []
        for below in lines[at:]:
            if below.startswith("$ "):
                break
            noted = re.fullmatch(r"# exit code (\d+)", below.strip())
            if noted:
                code = int(noted[1])
            else:
                shown.append(below)
        yield Command(line[2:].strip(), code, "\n".join(shown))


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
