"""What both reports say: headings, the words for a view, provenance as names and texts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from compare.page.page import Page
from compare.pages.report.folders import Part
from compare.store.made_by import SHELL_RUN

#: The packages named in a report; all of them stand in result.json.
PACKAGES = ("ribbonbench", "numpy", "numba", "cyipopt", "scikit-fem", "fenics-dolfinx", "petsc4py")


#: Stands where a page has no command line.
THROUGH_PYTHON = "Made through Python, by no command line."


def report_title(parts: Sequence[Part]) -> str:
    """The page's own title, or how many results there are."""
    return parts[0].page.title if len(parts) == 1 else f"ribbonbench: {len(parts)} results"


def view_text(page: Page) -> str:
    """The text alternative of a 3-D view."""
    labels = [surface.label for surface in page.surfaces]
    few = labels if len(labels) <= 8 else [*labels[:7], f"{len(labels) - 7} more"]
    return f"Surfaces of {page.title}, seen from the side and a little above: {'; '.join(few)}."


def provenance_rows(page: Page) -> list[tuple[str, str]]:
    """Names and texts: time, machine, versions, scene. What a provenance does not say is left out."""
    made: Mapping[str, Any] = page.provenance
    shell = made.get(SHELL_RUN) if isinstance(made.get(SHELL_RUN), Mapping) else None
    packages = made.get("packages") or {}
    git = made.get("git") or {}
    commit = str(git.get("commit") or "")[:12]
    rows = [
        ("made", made.get("time")),
        ("machine", ", ".join(str(made[k]) for k in ("cpu", "system") if made.get(k))),
        ("cores", _cores(made)),
        ("Python", made.get("python")),
        ("packages", ", ".join(f"{name} {packages[name]}" for name in PACKAGES if name in packages)),
        (SHELL_RUN, _flat(shell.get("versions")) if shell else None),
        ("linear solver", made.get("linear_solver")),
        ("options", _flat(made.get("options"))),
        ("commit", f"{commit}, with changes" if commit and git.get("modified") else commit),
        ("scene", f"hash {str(made['scene_hash'])[:12]}" if made.get("scene_hash") else ""),
    ]  # fmt: skip
    return [(name, str(text)) for name, text in rows if text]


def _cores(made: Mapping[str, Any]) -> str:
    if not made.get("cores"):
        return ""
    return str(made["cores"]) + (f" ({_flat(made['threads'])})" if made.get("threads") else "")


def _flat(table: Any) -> str:
    """A table as "name value, name value"; tables in it in brackets."""
    if not isinstance(table, Mapping):
        return "" if table is None else str(table)
    return ", ".join(
        f"{name} ({_flat(value)})" if isinstance(value, Mapping) else f"{name} {_short(value)}"
        for name, value in table.items()
        if value not in (None, {}, [], "")
    )


def _short(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:g}"
    text = str(value)
    return text if len(text) <= 80 else f"{text[:77]}..."
