"""What the shell costs: time against error over meshes and degrees, per load step, and against cells up to 10^5."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt

from compare.scene import load
from compare.shell_process import shell_problem
from shellref import ShellOptions, ShellProblem, ShellResult
from shellref.adaptive import gap
from shellref.solve import solve
from tests.validation import page

RATIO = 100.0
REFERENCE = ((150, 12), 3)
MESHES = {
    2: ((25, 2), (50, 4), (100, 4), (100, 8), (150, 12)),
    3: ((25, 2), (50, 4), (70, 6)),
    4: ((15, 2), (30, 4), (45, 6)),
}
CELLS = ((100, 4), (250, 8), (500, 20), (1000, 40), (2500, 40))
#: The 100 x 4 run of 4.3 must stay under this, in seconds without compilation; it takes about a tenth of it.
MOST_SECONDS = 30.0


def spent(result: ShellResult) -> float:
    """Seconds without import and compilation."""
    return result.seconds["total"] - result.seconds["import"] - result.seconds["compile"]


def large(elements: tuple[int, int]) -> dict[str, float]:
    """One load step of a wide strip on a large mesh, in a process of its own, so that memory is its own."""
    code = f"import json, sys; from tests.validation.shell_cost import step; print(json.dumps(step({elements!r})))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    data: dict[str, float] = json.loads(found.stdout.splitlines()[-1])
    return data


def step(elements: tuple[int, int]) -> dict[str, float]:
    """A clamped strip w/l = 0.16, w/h = 100, K = 3, under a weight of Gamma = 5 in one load step."""
    problem = ShellProblem(
        0.16, 0.0016, 0.3, (3.0, 3.0), 5.0, (1.0, 0.0, 0.0), elements=elements, grading=(1.0, 1.0),
        clamp_frame=((0.6, -0.8, 0.0), (0.8, 0.6, 0.0), (0.0, 0.0, 1.0)),
    )  # fmt: skip
    options = ShellOptions(first_step=1.0, max_step=1.0, stability=False, tolerance=1e-4)
    result = solve(problem, options)
    last = [s for s in result.steps if s.accepted][-1]
    return {
        "cells": elements[0] * elements[1], "unknowns": result.unknowns, "iterations": result.newton_iterations,
        "factorisations": result.factorisations, "seconds": spent(result), "memory": result.memory_mb,
        "tangent": result.seconds["tangent"], "factor": result.seconds["factor"], "reduce": result.seconds["reduce"],
        "step": last.seconds, "converged": result.status.value == "converged",
    }  # fmt: skip


def run(out: Path) -> None:
    scene = load("curl_4_3")
    base = replace(shell_problem(scene, RATIO, (100, 4)), grading=(0.2, 0.1))
    (elements, degree) = REFERENCE
    reference = solve(replace(base, elements=elements, degree=degree))
    finer_check = solve(replace(base, elements=(100, 8), degree=3))
    own = gap(reference.surface, finer_check.surface)
    rows, curves, steps = [], {}, []
    for k, meshes in MESHES.items():
        for mesh in meshes:
            result = solve(replace(base, elements=mesh, degree=k))
            error = gap(result.surface, reference.surface)
            share = abs(result.share["membrane"] - reference.share["membrane"])
            curves.setdefault(k, []).append((spent(result), error))
            rows.append([
                f"Q{k} {mesh[0]} x {mesh[1]}", str(result.unknowns), result.status.value, f"{error:.1e}",
                f"{share:.1e}", str(result.newton_iterations), str(result.factorisations), f"{spent(result):.1f}",
                f"{result.memory_mb:.0f}",
            ])  # fmt: skip
    even = solve(replace(base, elements=(100, 4), grading=(1.0, 1.0)))
    for s in even.steps:
        steps.append([
            s.stage, s.method, f"{s.load:.3f}", "yes" if s.accepted else "no", str(s.iterations),
            str(s.factorisations), f"{s.seconds:.2f}",
        ])  # fmt: skip
    sizes = []
    for mesh in CELLS:
        began = time.perf_counter()
        d = large(mesh)
        print(f"  {mesh}: {time.perf_counter() - began:.0f} s", flush=True)
        per = d["factorisations"]
        sizes.append((d["cells"], [
            f"{mesh[0]} x {mesh[1]}", f"{d['cells']:,}", f"{d['unknowns']:,}", str(d["iterations"]),
            f"{d['seconds']:.1f}", f"{d['tangent'] / per:.2f}", f"{d['reduce'] / per:.2f}", f"{d['factor'] / per:.2f}",
            f"{d['memory'] / 1024:.2f}",
        ], d))  # fmt: skip
    figure(out / "shell_cost.png", curves, sizes)
    (c0, _, d0), (c1, _, d1) = sizes[-2], sizes[-1]
    exponent = np.log(d1["seconds"] / d1["iterations"] / (d0["seconds"] / d0["iterations"])) / np.log(c1 / c0)
    page.write(
        out / "shell_cost.md", "What the shell costs", "python -m tests.validation shell_cost",
        f"Scene curl_4_3 at w/h = {RATIO:g}, meshes graded (0.2, 0.1), one core, compilation apart. error: largest "
        f"distance over l at equal material points to Q{degree} {elements[0]} x {elements[1]}, which is itself "
        f"{own:.1e} "
        "from Q3 100 x 8. membrane: difference of the membrane share of the elastic energy.",
        page.table(
            ["mesh", "unknowns", "status", "error / l", "membrane", "Newton", "factorisations", "s", "MB"], rows
        ),
        "![time against error, time against cells](shell_cost.png)",
        f"Load steps of the thesis's even 100 x 4 mesh ({spent(even):.1f} s in all):",
        page.table(["stage", "method", "load", "accepted", "iterations", "factorisations", "s"], steps),
        "One load step of a wide strip (w/l = 0.16, w/h = 100, K = 3, Gamma = 5 at once, correction 1e-4), each in a "
        "process of its own. Times per iteration: assembly of the tangent, its reduction to five unknowns a node, "
        f"factorisation. The time per iteration grows as cells^{exponent:.2f} between the last two meshes.",
        page.table(
            ["mesh", "cells", "unknowns", "Newton", "s", "tangent s", "reduce s", "factor s", "memory GB"],
            [row for _, row, _ in sizes],
        ),
    )  # fmt: skip
    if not spent(even) < MOST_SECONDS:
        raise AssertionError(f"4.3 on 100 x 4 took {spent(even):.0f} s")
    if not all(d["converged"] for _, _, d in sizes):
        raise AssertionError("a large mesh did not converge")


def figure(path: Path, curves: dict, sizes: list) -> None:
    """Error against time by degree; seconds per iteration and memory against cells."""
    fig, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    for k, points in curves.items():
        t, e = np.array(sorted(points)).T
        left.loglog(t, e, "o-", label=f"Q{k}")
    left.set(xlabel="time (s)", ylabel="error / l", title="curl_4_3, w/h = 100")
    left.legend()
    cells = np.array([c for c, _, _ in sizes], dtype=float)
    for part in ("tangent", "reduce", "factor"):
        right.loglog(cells, [d[part] / d["factorisations"] for _, _, d in sizes], "o-", label=part)
    right.loglog(cells, [d["memory"] / 1024 for _, _, d in sizes], "k--", label="memory (GB)")
    right.set(xlabel="cells", ylabel="s per iteration; GB", title="one load step")
    right.legend()
    for axis in (left, right):
        axis.grid(True, which="both", lw=0.3, alpha=0.6)
    fig.savefig(path, dpi=110, metadata={"Software": None})
    plt.close(fig)
