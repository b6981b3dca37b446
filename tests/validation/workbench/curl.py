"""Section 4.3 for both signs of K: the full table, the slope, and what clamp and energy the shell tends to."""

from __future__ import annotations

import shutil
from pathlib import Path

from rich.console import Console

from compare.models.base import Options
from compare.models.choice import beside_the_shell
from compare.page.markdown import as_markdown
from compare.pages import compare as report
from compare.pages import comparison as tables
from compare.pages.report.write import read_report, write_report
from compare.scene.scene import load
from compare.store.progress import Reporter
from compare.store.store import CaseStore, atomic_write_text
from compare.studies.compare import Comparison, compare
from tests.validation.number import Number

#: Its times, or the workers it starts, want the machine.
ALONE = True

NAMES = ("curl_4_3", "curl_4_3_down")
KEPT = ("table.md", "table.csv", "convergence.png", "shapes.png")


SIGNS = dict(zip(NAMES, ("up", "down"), strict=True))


def total(name: str, finer: int = 1) -> float:
    """Total energy (D w / l) of the ribbon, on `finer` times the scene's elements."""
    scene = load(name)
    scene = scene.replace({"model.elements": finer * scene.model.elements})
    return float(beside_the_shell(scene).solve(scene, options=Options()).energy.total)


PROBES = {f"ribbon_{SIGNS[name]}": lambda name=name: total(name) for name in NAMES}


def numbers(name: str, found: Comparison) -> dict[str, Number]:
    """Distances with both discretisation errors, the errors, shares; the slope with its spread; ratios of times."""
    sign = SIGNS[name]
    value = total(name)
    values = {f"ribbon_{sign}": Number(value, abs(value - total(name, 2)), "D w / l", ".6g")}
    if found.slope is not None:
        low, high = found.slope.spread
        error = max(high - found.slope.value, found.slope.value - low)
        values[f"slope_{sign}"] = Number(found.slope.value, error, shown=".2f")
    for row in found.rows:
        at = f"{sign}_{row.width_to_thickness:g}"
        errors = [row.ribbon_error or 0.0, row.shell_error or 0.0]
        if row.hausdorff is not None:
            values[f"distance_{at}"] = Number(row.hausdorff, sum(errors), "l", ".2e")
        values[f"shell_error_{at}"] = Number(errors[1], errors[1], "l", ".1e")
        if row.share is not None:
            why = "" if row.share_error is not None else "no coarser shell"
            error = None if row.share_error is None else 100.0 * row.share_error
            values[f"membrane_{at}"] = Number(100.0 * row.share["membrane"], error, "%", ".3g", why)
        if row.energy is not None:
            values[f"total_{at}"] = Number(row.energy.total, None, "D w / l", ".6g", "of the mesh of the row")
    errors = [row.ribbon_error for row in found.rows if row.ribbon_error is not None]
    values[f"ribbon_error_{sign}"] = Number(max(errors), max(errors), "l", ".1e")
    return values


def run(out: Path) -> dict[str, Number]:
    values: dict[str, Number] = {}
    work = out.parent / "out" / "validate"
    for name in NAMES:
        scene = load(name)
        with Reporter(Console(stderr=True)) as reporter:
            found = compare(scene, CaseStore(work / name / "cases"), reporter)
        report.write(work / name, found, "python -m tests.validation curl")
        write_report(work / name, read_report([work / name]))
        target = out / name
        target.mkdir(parents=True, exist_ok=True)
        for file in KEPT:
            shutil.copyfile(work / name / file, target / file)
        words = "\n".join(f"- {sentence}" for sentence in tables.verdict(found))
        atomic_write_text(
            target / "README.md",
            f"# {scene.title}\n\nRemake: `python -m tests.validation curl`, or `ribbonbench compare {name}`.\n\n"
            f"{words}\n\n"
            f"{as_markdown(tables.table(found))}\n![distance against h/w](convergence.png)\n\n"
            "![shapes](shapes.png)\n",
        )
        if not (found.ok and found.falls and all(row.claimed for row in found.rows)):
            raise AssertionError(f"{name}: the distance does not fall, or is not above the errors, on every row")
        values |= numbers(name, found)
    return values
