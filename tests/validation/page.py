"""Small Markdown pages under results/, each with the command that remakes it and what it was made on."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from compare.store.provenance import versions
from compare.store.store import atomic_write_text


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(heads) + " |", "|" + "|".join("---:" for _ in heads) + "|"]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])


def write(path: Path, title: str, command: str, *parts: str) -> None:
    """Writes a page: title, how to remake it, the parts, provenance."""
    made = versions()
    packages = made["packages"]
    named = ", ".join(
        f"{name} {packages[name]}" for name in ("numpy", "numba", "cyipopt", "mpmath") if name in packages
    )
    foot = f"Made {made['time'][:10]} with Python {made['python']}, {named}; {made['cpu']}, {made['cores']} cores."
    atomic_write_text(path, "\n\n".join([f"# {title}", f"Remake: `{command}`", *parts, foot]) + "\n")
