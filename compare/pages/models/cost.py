"""What accuracy costs among all models, as one sentence, ten rows, a picture, result.json and page.json."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from compare.measure.grades import GOOD, POOR
from compare.models import RICHEST, in_words
from compare.page.drawing import pictured
from compare.page.page import Picture
from compare.page.si import with_si
from compare.page.study import Study
from compare.page.table import Table
from compare.page.verdict import Check, Verdict
from compare.page.wording import percent
from compare.pages.cost import seconds_text
from compare.pages.pictures.cost import models_picture
from compare.pages.result import state_result
from compare.record.quantity import Quantity
from compare.studies.cost_plan import FAR
from compare.studies.priced.models import ModelCosts, Timed

#: Most rows of the short table.
ROWS = 10
_MODELS: tuple[Quantity[Timed], ...] = (
    Quantity("name", "model", kind="word", rank=0, of=lambda r: r.name),
    Quantity("size", "size", kind="word", rank=0, of=lambda r: r.size),
    Quantity("error", "total error %", "l", "share:2", rank=1, of=lambda r: r.error,
             legend="distance (Hausdorff) to the finest shell and that shell's own error, in % of l"),
    Quantity("seconds", "warm ms", "s", "milliseconds:3", rank=1, of=lambda r: r.seconds,
             legend="the solve alone, the fastest"),
    Quantity("spread", "± ms", "s", "milliseconds:2", rank=2, of=lambda r: r.spread,
             legend="how far the median is above it"),
    Quantity("unknowns", "unknowns", kind="integer", rank=3, of=lambda r: r.unknowns),
    Quantity("status", "status", kind="word", rank=4, of=lambda r: r.status),
)  # fmt: skip


def answer(costs: ModelCosts) -> Verdict:
    """What each target costs, in one sentence."""
    parts: list[str] = []
    for target in costs.targets:
        row = costs.reached(target)
        if row is not None:
            rivals = {one.name for one in costs.rows if one.ok and one.error is not None and one.error <= target}
            only = "only " if rivals == {RICHEST} else ""
            parts.append(f"{_percent(target)} {only}{in_words(row.name)}, {seconds_text(row.seconds)}")
        elif costs.error > target:
            parts.append(f"{_percent(target)} nothing here: the finest shell itself is known to {percent(costs.error)}")
        else:
            parts.append(f"{_percent(target)} no run")
    best = costs.reached(max(costs.targets))
    most, said = max(costs.targets), "the largest target is reached"
    reached = (
        Check("reached", POOR, said, None, most) if best is None else Check("reached", GOOD, said, best.error, most)
    )
    far = [row.name for row in costs.best if row.far]
    near = Check("near", GOOD, f"farther than {FAR:g} l: {', '.join(far) or 'none'}", bound=FAR)
    read = Check("read", GOOD, "a model that would ignore a key takes no part")
    return Verdict.of("cost", "To " + "; to ".join(parts), [reached, read, near])


def _percent(target: float) -> str:
    """E.g. "1 % of l", "1 permille of l"."""
    return f"{100.0 * target:g} % of l" if target >= 1e-2 else f"{1e3 * target:g} permille of l"


def table(costs: ModelCosts, whole: bool = False) -> Table:
    """The best run of every model and what the targets took, `ROWS` at most, the most accurate first; whole: all."""
    if whole:
        return Table.of("Every run", _MODELS, costs.rows)
    targets = [costs.reached(target) for target in costs.targets]
    rows = list(dict.fromkeys(row for row in (*targets, *costs.best) if row is not None))[:ROWS]
    rows.sort(key=lambda row: row.error or 0.0)
    return Table.of("Most accurate of each model, and what the targets took", _MODELS, rows)


def sentences(costs: ModelCosts) -> list[str]:
    """What the errors are to, which models are in another state, and which do not read the scene."""
    said = [f"Errors: to the shell of {costs.finest}, own error {percent(costs.error)} of l, which they include."]
    far = [f"{row.name} ({percent(row.error or 0.0)})" for row in costs.best if row.far]
    if far:
        said.append(f"In another state, or no model of this scene (beyond {percent(FAR)} of l): {', '.join(far)}.")
    none = [name for name in costs.left_out if name not in {row.name for row in costs.rows}]
    if none:
        said.append(f"Do not read the scene: {', '.join(none)} (result.json says why).")
    said.append("Errors of the elements alone, more sizes and first calls: --wide.")
    return said


def result(costs: ModelCosts) -> dict[str, Any]:
    """`result.json`: the contract's keys of the scene's own state, and the measurement under `cost`."""
    document = state_result(costs.scene, costs.base)
    document["cost"] = {
        "kind": "models",
        "width_to_thickness": costs.ratio,
        "reference": {"model": RICHEST, "what": costs.finest, "error": costs.error},
        "rows": [
            {
                "model": row.name, "size": row.size, "unknowns": row.unknowns, "status": row.status, "ok": row.ok,
                "error": row.error, "error_error": costs.error, "seconds": row.seconds, "seconds_error": row.spread,
            }
            for row in costs.rows
        ],
        "targets": [
            {"target": target, "model": None if row is None else row.name, "size": None if row is None else row.size,
             "seconds": None if row is None else row.seconds}
            for target, row in ((target, costs.reached(target)) for target in costs.targets)
        ],
        "left_out": dict(costs.left_out),
        "machine": costs.machine,
    }  # fmt: skip
    return document


def write(out: Path, costs: ModelCosts, again: str) -> None:
    """result.json, table.csv, cost.png, page.json; `again`: the command that makes them again."""
    verdict = answer(costs)
    pictures: tuple[Picture, ...] = ()
    if pictured(lambda: models_picture(out / "cost.png", costs)):
        alt = f"Total error against the time of a warm solve, both logarithmic, a line for each model. {verdict.text}"
        pictures = (Picture("cost.png", alt, "Total error against time"),)
    Study(
        "cost",
        f"{costs.scene.title}: what accuracy costs",
        verdict=verdict,
        tables=(table(costs), table(costs, whole=True)),
        sentences=tuple(sentences(costs)),
        pictures=pictures,
        data={"table.csv": with_si(table(costs, whole=True), costs.scene.units)},
        files={"result.json": "all numbers", "table.csv": "every run"},
    ).write(out, result(costs), again, costs.scene)
