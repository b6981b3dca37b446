"""What the shell costs on large meshes: one load step against the number of elements, each in a process of its own."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt

from shellref import ShellOptions, ShellProblem
from shellref.path.solve import solve
from tests.validation import page
from tests.validation.shell.shell_cost import spent

CELLS = ((100, 4), (250, 8), (500, 20), (1000, 40), (2500, 40))
LIMIT = 240.0  # seconds for one mesh; what takes longer is named


def large(elements: tuple[int, int]) -> dict[str, float] | None:
    """One load step of a wide strip on a large mesh, in a process (and memory) of its own; None over the limit."""
    code = (
        f"import json, sys; from tests.validation.shell.shell_size import step; print(json.dumps(step({elements!r})))"
    )
    try:
        found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=LIMIT)
    except subprocess.TimeoutExpired:
        return None
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
    rows, kept, missed = [], [], []
    for mesh in CELLS:
        d = large(mesh)
        if d is None:
            missed.append(f"{mesh[0]} x {mesh[1]}")
            continue
        if not d["converged"]:
            raise AssertionError(f"{mesh} did not converge")
        print(f"  {mesh}: {d['seconds']:.0f} s", flush=True)
        per = d["factorisations"]
        kept.append(d)
        rows.append([
            f"{mesh[0]} x {mesh[1]}", f"{d['cells']:,}", f"{d['unknowns']:,}", str(d["iterations"]),
            f"{d['seconds']:.1f}", f"{d['tangent'] / per:.2f}", f"{d['reduce'] / per:.2f}", f"{d['factor'] / per:.2f}",
            f"{d['memory'] / 1024:.2f}",
        ])  # fmt: skip
    figure(out / "shell_size.png", kept)
    a, b = kept[-2:]
    times = [d["seconds"] / d["iterations"] for d in (a, b)]
    exponent = np.log(times[1] / times[0]) / np.log(b["cells"] / a["cells"])
    page.write(
        out / "shell_size.md", "What the shell costs on large meshes", "python -m tests.validation shell_size",
        "One load step of a wide strip (w/l = 0.16, w/h = 100, K = 3, Gamma = 5 at once, correction 1e-4), reference "
        "BLAS. Times per iteration: assembly of the tangent, its reduction to five unknowns a node, factorisation. The "
        f"time per iteration grows as cells^{exponent:.2f} between the last two meshes. Over the limit of "
        f"{LIMIT:g} s on "
        f"this machine, which was shared: {', '.join(missed) or 'none'}.",
        page.table(
            ["mesh", "cells", "unknowns", "Newton", "s", "tangent s", "reduce s", "factor s", "memory GB"], rows
        ),
        "![time and memory against cells](shell_size.png)",
    )  # fmt: skip


def figure(path: Path, kept: list[dict[str, float]]) -> None:
    """Seconds per iteration by part, and memory, against cells."""
    fig, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    cells = [d["cells"] for d in kept]
    for part in ("tangent", "reduce", "factor"):
        axis.loglog(cells, [d[part] / d["factorisations"] for d in kept], "o-", label=part)
    axis.loglog(cells, [d["memory"] / 1024 for d in kept], "k--", label="memory (GB)")
    axis.set(xlabel="cells", ylabel="s per iteration; GB", title="one load step")
    axis.legend()
    axis.grid(True, which="both", lw=0.3, alpha=0.6)
    fig.savefig(path, dpi=110, metadata={"Software": None})
    plt.close(fig)
