"""The thesis's 2500 cantilevers (4.5, figure 4.7): y/x against Gamma on one curve, with both asymptotes."""

from __future__ import annotations

import csv
import json
import math
import statistics
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from compare.cli import main
from compare.store.store import atomic_write_bytes
from compare.studies.axes import points
from compare.sweep.case import Task, run_case
from compare.sweep.file import load_sweep
from shellref.elastica.solve import ElasticaProblem, solve
from tests.validation import page
from tests.validation.number import Number

#: Its times, or the workers it starts, want the machine.
ALONE = True

CASES = 2500
#: Every so-manieth case, in order of Gamma, is solved as an elastica too; largest relative difference of y/x allowed.
EVERY = 50
AGREES = 2e-3
#: Relative error of the elastica, at most.
ELASTICA = 1e-6


#: Numbers (from 0, the grid's) of the cases that `make test` solves again: light, in the middle, heavy.
PROBED = (0, 1275, 2499)


def solved(number: int) -> tuple[float, float]:
    """y/x of a case of the sweep, and its Gamma."""
    sweep = load_sweep("cantilever_4_5", {}, [])
    first, second = divmod(number, len(sweep.axes[1].values))
    axes = [replace(axis, values=axis.values[k : k + 1]) for axis, k in zip(sweep.axes, (first, second), strict=True)]
    (point,) = points(sweep.scene, axes)
    with tempfile.TemporaryDirectory() as folder:
        record = run_case(Task("", point.scene, sweep.solver, False, False, folder))
    (row,) = record["rows"]
    return float(row["y_over_x"]), point.scene.gamma


PROBES = {f"case_{number}": lambda number=number: solved(number)[0] for number in PROBED}


#: Processes at once.
WORKERS = 2


def run(out: Path) -> dict[str, Number]:
    folder = out.parent / "out" / "validate" / "sweep"
    began = time.perf_counter()
    words = ["sweep", "cantilever_4_5", "--fresh", "--workers", str(WORKERS), "--out", str(folder), "--quiet"]
    code = main(words)
    wall = time.perf_counter() - began
    verdict = json.loads((folder / "page.json").read_text())["verdict"]
    said = str(verdict["text"]).rstrip(".")
    with (folder / "cases.csv").open() as file:
        cases = sorted(csv.DictReader(file), key=lambda case: float(case["gamma"]))
    if code != 0 or len(cases) != CASES or any(case["status"] != "converged" for case in cases):
        raise AssertionError(f"exit code {code}, {len(cases)} cases")
    median = 1e3 * statistics.median(float(case["seconds"]) for case in cases)
    rows, worst = [], 0.0
    for case in [*cases[::EVERY], cases[-1]]:
        gamma, ratio = float(case["gamma"]), float(case["y_over_x"])
        elastica = _ratio(gamma)
        difference = ratio / elastica - 1.0
        worst = max(worst, abs(difference))
        small, large = gamma / 8.0, math.sqrt(gamma / 2.0)
        rows.append(
            [
                f"{gamma:.5g}", f"{ratio:.6g}", f"{difference:.1e}", f"{small / ratio - 1.0:+.1e}",
                f"{large / ratio - 1.0:+.1e}", case["iterations"],
            ]
        )  # fmt: skip
    if not worst < AGREES:
        raise AssertionError(f"y/x is {worst:.1e} from the elastica's")
    atomic_write_bytes(out / "cantilever_4_5.png", (folder / "sweep.png").read_bytes())
    page.write(
        out / "cantilever_4_5.md",
        "2500 cantilevers (thesis, 4.5)",
        "python -m tests.validation sweep",
        "`ribbonbench sweep cantilever_4_5`: 50 Young's moduli from 0.5 to 10 MPa times 50 lengths from 5 to 90 cm, h "
        "= 1 mm, nu = 0.5 (the elastica and the flat ribbon do not depend on it), Wunderlich, 40 graded segments. "
        + said
        + f". All of it: {wall:.1f} s of wall time with {WORKERS} processes, {median:.3g} ms a case in the median.",
        f"Every {EVERY}th case in order of Gamma. difference: of y/x from the elastica's (scikit-fem, its error below "
        "1e-6), relative; Gamma/8, sqrt(Gamma/2): the asymptotes over y/x, less 1.",
        page.table(["Gamma", "y/x", "difference", "Gamma/8", "sqrt(Gamma/2)", "iterations"], rows),
        f"Largest difference of these: {worst:.1e}. The start of the solves bends down near the clamp "
        "(`seed.curvature` of the sweep): from the straight strip heavy cantilevers settle in other equilibria, stable "
        "ones too.",
        "![y/x against Gamma](cantilever_4_5.png)",
    )
    found = {number: solved(number) for number in PROBED}
    numbers = {
        "converged": Number(len(cases), 0, shown="d"),
        "cases": Number(CASES, 0, shown="d"),
        "wall": Number(wall, None, "s", ".1f", "wall time of one run"),
        "workers": Number(WORKERS, 0, shown="d"),
        "worst": Number(worst, worst, shown=".1e"),
        "median_ms": Number(median, None, "ms", ".3g", "wall times of one run"),
    }
    for k, (one, gamma) in found.items():
        elastica = _ratio(gamma)
        numbers[f"case_{k}"] = Number(one, abs(one - elastica) + ELASTICA * elastica, shown=".6g")
    return numbers


def _ratio(gamma: float) -> float:
    """y/x of the elastica: how far down over how far out."""
    found = solve(ElasticaProblem(gamma=gamma))
    x, y = found.end
    return -y / x
