"""The notebooks: Python files in the percent format (for jupytext, VS Code, Spyder), as cells and as Jupyter's JSON.

`# %% [markdown]` begins a cell whose lines are comments, `# %%` one of code; behind it may stand metadata, `key=JSON`.
A notebook is a program too: `python docs/notebooks/first_strip.py` runs it, without Jupyter.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

FOLDER = "docs/notebooks"
_HEAD = re.compile(r"# %%(?P<markdown> \[markdown\])?(?P<metadata>(?: \w+=.*)?)")


@dataclass(frozen=True)
class Cell:
    """A cell: "markdown" or "code", its text, its metadata, the line of the file where the text begins (from 1)."""

    kind: str
    text: str
    line: int
    metadata: Mapping[str, object] = field(default_factory=dict)


def notebooks(root: Path) -> list[str]:
    """The notebooks of the project, without their ending."""
    return [path.relative_to(root).with_suffix("").as_posix() for path in sorted((root / FOLDER).glob("*.py"))]


def cells(text: str) -> list[Cell]:
    """The cells of a notebook, in order; ValueError for what stands before the first one, and for a head or a line of
    Markdown that is none."""
    found: list[Cell] = []
    lines = text.splitlines()
    starts = [at for at, line in enumerate(lines) if line.startswith("# %%")]
    if any(line.strip() for line in lines[: starts[0] if starts else None]):
        raise ValueError("line 1: a notebook begins with # %%")
    for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        head = _HEAD.fullmatch(lines[start])
        if head is None:
            raise ValueError(f"line {start + 1}: {lines[start]!r} begins no cell")
        body = lines[start + 1 : end]
        if head["markdown"]:
            wrong = [n for n, line in enumerate(body) if line.strip() and not re.match(r"#( |$)", line)]
            if wrong:
                raise ValueError(f"line {start + 2 + wrong[0]}: Markdown stands in comments")
            body = [line[2:] for line in body]
        found.append(
            Cell(
                "markdown" if head["markdown"] else "code", "\n".join(body).strip("\n") + "\n", start + 2,
                _metadata(head["metadata"]),
            )
        )  # fmt: skip
    return found


def _metadata(text: str) -> dict[str, object]:
    """`key=JSON key=JSON` as a dictionary."""
    found: dict[str, object] = {}
    rest, decoder = text.strip(), json.JSONDecoder()
    while rest:
        key, _, rest = rest.partition("=")
        found[key.strip()], end = decoder.raw_decode(rest)
        rest = rest[end:].strip()
    return found


def notebook(text: str, markdown: Callable[[str], str] = str) -> dict[str, object]:
    """Jupyter's JSON (nbformat 4.5), without outputs; `markdown` is done to every cell of Markdown."""
    made = []
    for number, cell in enumerate(cells(text)):
        code = {"outputs": [], "execution_count": None} if cell.kind == "code" else {}
        source = cell.text if cell.kind == "code" else markdown(cell.text)
        made.append(
            {"id": f"cell-{number}", "cell_type": cell.kind, "metadata": dict(cell.metadata), **code,
             "source": source.rstrip("\n").splitlines(keepends=True)}
        )  # fmt: skip
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return {"cells": made, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}


def run(path: Path) -> dict[str, object]:
    """The names that a notebook has at its end, its code run cell by cell in one namespace; errors show its lines."""
    names: dict[str, object] = {"__name__": path.stem}
    for cell in cells(path.read_text(encoding="utf-8")):
        if cell.kind == "code":
            exec(compile("\n" * (cell.line - 1) + cell.text, str(path), "exec", dont_inherit=True), names)
    return names
