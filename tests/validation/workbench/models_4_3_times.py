"""Iterations and time of every model beside Wunderlich's energy, on the same elements (part of models_4_3)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from compare.models.base import Size
from compare.scene.scene import load
from tests.validation import one_core, page

SCENES = ("curl_4_3", "curl_4_3_down")
RATIO = 100.0
SIZES = (("chained", 20), ("chained", 40), ("mixed", 40), ("mixed", 160))
FIRST = "wunderlich"
HEADS = ("scene", "formulation", "elements", "model", "status", "iterations", "seconds")


def measured(models: Mapping[str, Mapping[str, Any]]) -> list[list[Any]]:
    """Rows (`HEADS`): median processor time of warm solves."""
    from compare.models.ribbon.model import sized
    from compare.models.ribbon.solving import solver

    rows: list[list[Any]] = []
    for name in SCENES:
        for formulation, elements in SIZES:
            for model, changes in models.items():
                scene = load(name).replace({"shell.width_to_thickness": [RATIO], **changes})
                once = solver(sized(scene, Size(formulation, (float(elements),))))
                once()
                state, seconds = one_core.timed(once, 5, 6.0)
                rows.append([name, formulation, elements, model, state.status.code, state.iterations, seconds])
                print("  ", *rows[-1], flush=True)
    return rows


def part(rows: list[list[Any]]) -> str:
    """A Markdown table: iterations and time over Wunderlich's, models down, scene and elements across."""
    cases = list(dict.fromkeys((row[0], row[1], row[2]) for row in rows))
    by = {(row[0], row[1], row[2], row[3]): row for row in rows}
    lines = []
    for model in dict.fromkeys(row[3] for row in rows):
        cells = []
        for case in cases:
            row, first = by[(*case, model)], by[(*case, FIRST)]
            cells.append(f"{row[5]}, {1e3 * row[6]:.3g} ms, {row[6] / first[6]:.2f}")
        lines.append([model, *cells])
    names = {"mixed": "glued"}
    return page.table(["model", *(f"{s}, {names.get(f, f)} {n}" for s, f, n in cases)], lines)


def worst(rows: list[list[Any]], model: str) -> float:
    """Largest time of a model over Wunderlich's."""
    first = {tuple(row[:3]): row[6] for row in rows if row[3] == FIRST}
    return max(float(row[6]) / float(first[tuple(row[:3])]) for row in rows if row[3] == model)
