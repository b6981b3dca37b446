"""What the shell costs on large meshes: one load step against the number of elements, each in a process of its own."""

from __future__ import annotations

import functools
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt

from shellref import ShellOptions, ShellProblem
from tests.validation import page
from tests.validation.number import Number
from tests.validation.shell.shell_cost import measured

CELLS = ((100, 4), (250, 8), (500, 20), (1000, 40))
JUDGED = 2  # meshes that are solved by forms too
#: Seconds and GB by forms on the two large meshes on 2026-11-21, in THEN iterations, on another machine.
THEN = 5
EARLIER = {(500, 20): (34.7, 1.25), (1000, 40): (228.3, 4.92)}
LIMIT = 1500.0  # seconds for one mesh on a machine that others use; what takes longer is named


def large(elements: tuple[int, int], engine: str) -> dict[str, float] | None:
    """One load step of a wide strip on a large mesh, in a process (and memory) of its own; None over the limit."""
    call = f"step({elements!r}, {engine!r})"
    code = f"import json; from tests.validation.shell.shell_size import step; print(json.dumps({call}))"
    try:
        found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=LIMIT)
    except subprocess.TimeoutExpired:
        return None
    data: dict[str, float] = json.loads(found.stdout.splitlines()[-1])
    return data


def step(elements: tuple[int, int], engine: str) -> dict[str, float]:
    """A clamped strip w/l = 0.16, w/h = 100, K = 3, under a weight of Gamma = 5 in one load step."""
    problem = ShellProblem(
        0.16, 0.0016, 0.3, (3.0, 3.0), 5.0, (1.0, 0.0, 0.0), elements=elements, grading=(1.0, 1.0),
        clamp_frame=((0.6, -0.8, 0.0), (0.8, 0.6, 0.0), (0.0, 0.0, 1.0)),
    )  # fmt: skip
    options = ShellOptions(first_step=1.0, max_step=1.0, stability=False, tolerance=1e-4)
    measured(replace(problem, elements=(4, 1)), engine, options)
    result, seconds = measured(problem, engine, options)
    whole = sum(result.seconds.get(name, 0.0) for name in ("tangent", "reduce", "factor", "forces"))
    return {
        "cells": elements[0] * elements[1], "unknowns": result.unknowns, "iterations": result.newton_iterations,
        "factorisations": result.factorisations, "seconds": seconds, "memory": result.memory_mb,
        "tangent": (result.seconds["tangent"] + result.seconds.get("reduce", 0.0)) / whole,
        "factor": result.seconds["factor"] / whole, "mumps": result.seconds.get("mumps", 0.0),
        "converged": result.status.value == "converged",
    }  # fmt: skip


@functools.cache
def smallest() -> dict[str, float]:
    """The step on the smallest mesh, in this process."""
    return step(CELLS[0], "kernels")


PROBES = {"unknowns_100x4": lambda: smallest()["unknowns"], "iterations_100x4": lambda: smallest()["iterations"]}


def run(out: Path) -> dict[str, Number]:
    rows, kept, judges, missed = [], [], [], []
    for i, mesh in enumerate(CELLS):
        d = large(mesh, "kernels")
        before = large(mesh, "forms") if i < JUDGED else None
        missed += [f"{mesh[0]} x {mesh[1]}"] * (d is None)
        if d is None:
            continue
        if not d["converged"] or d["mumps"]:
            raise AssertionError(f"{mesh} did not converge, or its factors were not safe")
        print(f"  {mesh}: {d['seconds']:.1f} s, {'-' if before is None else before['seconds']} by forms", flush=True)
        kept.append(d)
        judges += [] if before is None else [before]
        old = ["-"] * 3
        if before is not None:
            old = [f"{before['seconds']:.1f}", f"{before['memory'] / 1024:.2f}"]
            each = before["seconds"] / before["iterations"] / (d["seconds"] / d["iterations"])
            old.append(f"{each:.1f}")
        elif mesh in EARLIER:
            seconds, memory = EARLIER[mesh]
            old = [f"({seconds:.1f})", f"({memory:.2f})", "-"]  # times of two machines have no ratio
        rows.append([
            f"{mesh[0]} x {mesh[1]}", f"{d['cells']:,}", f"{d['unknowns']:,}", str(d["iterations"]),
            f"{d['seconds']:.2f}", f"{d['tangent']:.0%}", f"{d['factor']:.0%}", f"{d['memory'] / 1024:.2f}", *old,
        ])  # fmt: skip
    figure(out / "shell_size.png", kept, judges)
    a, b = kept[-2:]
    times = [d["seconds"] / d["iterations"] for d in (a, b)]
    exponent = np.log(times[1] / times[0]) / np.log(b["cells"] / a["cells"])
    page.write(
        out / "shell_size.md", "What the shell costs on large meshes", "python -m tests.validation shell_size",
        "One load step of a wide strip (w/l = 0.16, w/h = 100, K = 3, Gamma = 5 at once, correction 1e-4), seconds of "
        "the processor on one thread of a machine that others used, compilation apart; tangent, factor: shares of the "
        "time of all iterations. Forms: dolfinx's, P^T K P and MUMPS with the reference BLAS; in brackets what they "
        "took on 2026-11-21, in "
        f"{THEN} iterations, on another machine. ratio: of the times of an iteration, in one run. The price that a "
        "command says before a solve is made of such rows of another machine; "
        "tests/compare/models/test_shell_price.py holds this page to it. "
        f"The time per iteration grows as cells^{exponent:.2f} between the last two meshes (which grow in both "
        "directions; at equal width it is linear in the length). Not "
        f"finished within {LIMIT:g} s: {', '.join(missed) or 'none'}.",
        page.table(
            ["mesh", "cells", "unknowns", "Newton", "s", "tangent", "factor", "memory GB", "forms s", "forms GB",
             "ratio"], rows
        ),
        "![time and memory against cells](shell_size.png)",
    )  # fmt: skip
    numbers = {"exponent": Number(float(exponent), None, shown=".2f", why="of wall times of one run")}
    for mesh, d in zip([mesh for mesh in CELLS if f"{mesh[0]} x {mesh[1]}" not in missed], kept, strict=True):
        name = f"{mesh[0]}x{mesh[1]}"
        numbers[f"unknowns_{name}"] = Number(int(d["unknowns"]), 0, shown="d")
        numbers[f"iterations_{name}"] = Number(int(d["iterations"]), 0, shown="d")
        numbers[f"seconds_{name}"] = Number(d["seconds"], None, "s", ".2f", "processor time of one run")
        numbers[f"memory_{name}"] = Number(d["memory"] / 1024, None, "GB", ".2f", "peak memory of one process")
    return numbers


def figure(path: Path, kept: list[dict[str, float]], judges: list[dict[str, float]]) -> None:
    """Seconds per iteration and memory against cells, by kernels and by forms."""
    fig, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    for name, runs, mark in (("kernels", kept, "o-"), ("forms", judges, "s--")):
        cells = [d["cells"] for d in runs]
        axis.loglog(cells, [d["seconds"] / d["iterations"] for d in runs], "C0" + mark, label=f"{name}: s / iteration")
        axis.loglog(cells, [d["memory"] / 1024 for d in runs], "C1" + mark, label=f"{name}: memory (GB)")
    axis.set(xlabel="cells", ylabel="s per iteration; GB", title="one load step")
    axis.legend()
    axis.grid(True, which="both", lw=0.3, alpha=0.6)
    fig.savefig(path, dpi=110, metadata={"Software": None})
    plt.close(fig)
