"""10,000 cantilevers of 40 segments: `ribbon.solve_many`, and `ribbonbench sweep` over a grid of them
(results/batches.md)."""

from __future__ import annotations

import csv
import functools
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from ribbon import Clamp, Gravity, solve_many
from tests.validation import page
from tests.validation.number import Number
from tests.validation.ribbon.newton import BATCH, SEGMENTS, cantilevers

#: Direction against the weight: the strip stands up, leaning, and falls over.
UP = (0.6, 0.0, 0.8)
#: Points of the grid along each axis.
SIDE = 100
_SWEEP = """title = "Cantilevers"
scene = "cantilever"
solver = "ribbon"
[set]
"gravity.up" = [0.6, 0.0, 0.8]
"model.elements" = {segments}
[[axis]]
key = "strip.gamma"
spacing = "log"
first = 1.0
last = 1000.0
count = {side}
[[axis]]
key = "strip.natural_curvature"
spacing = "linear"
first = -2.0
last = 2.0
count = {side}
"""


def _cores() -> int:
    return len(os.sched_getaffinity(0))


#: So many of them are solved again by the probes.
FEW = 100


@functools.cache
def few() -> tuple[int, float]:
    """Of `FEW`: how many are stable, and Newton's steps in the mean."""
    many = solve_many(cantilevers(FEW), Clamp(), Gravity(UP), segments=SEGMENTS)
    return int(many.ok.sum()), float(many.iterations.mean())


PROBES = {"stable_of_few": lambda: few()[0], "steps_of_few": lambda: few()[1]}
_TIME = "time of one run"


def solved(count: int = BATCH) -> tuple[str, dict[str, Number]]:
    """`solve_many` on as many threads as there are cores: in words, and the numbers."""
    strips = cantilevers(count)
    solve_many(strips[:4], Clamp(), Gravity(UP), segments=SEGMENTS)
    began, spent = time.perf_counter(), time.process_time()
    many = solve_many(strips, Clamp(), Gravity(UP), segments=SEGMENTS)
    wall, cpu = time.perf_counter() - began, time.process_time() - spent
    steps = many.iterations
    stable, mean = few()
    numbers = {
        "cases": Number(count, 0, shown="d"),
        "cpu": Number(1e3 * cpu / count, None, "ms", ".2f", why=_TIME),
        "wall": Number(wall, None, "s", ".1f", why=_TIME),
        "steps": Number(float(steps.mean()), 0.1, shown=".1f"),
        "stable": Number(int(many.ok.sum()), 0, shown="d"),
        "again": Number(len(many.again), 0, shown="d"),
        "stable_of_few": Number(stable, 0, shown="d"),
        "steps_of_few": Number(mean, 0.05, shown=".2f"),
    }
    words = (
        f"{count} cantilevers of {SEGMENTS} segments (`cantilevers` of the page newton) by `ribbon.solve_many`: "
        f"{cpu:.1f} s of CPU time ({1e3 * cpu / count:.2f} ms a case), {wall:.1f} s of wall time on {_cores()} cores; "
        f"{int(many.ok.sum())} are stable, {len(many.again)} not plainly so. Newton's steps: {steps.mean():.1f} in the "
        f"mean, {np.median(steps):.0f} in the median, {steps.max()} at most."
    )
    return words, numbers


def swept(side: int = SIDE) -> tuple[str, dict[str, Number]]:
    """`ribbonbench sweep` over a grid of weights and curls, a process of its own with as many workers as cores."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cantilevers.toml"
        path.write_text(_SWEEP.format(segments=SEGMENTS, side=side), encoding="utf-8")
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        began = time.perf_counter()
        command = [
            sys.executable,
            "-m",
            "compare.cli",
            "sweep",
            str(path),
            "--out",
            str(Path(folder) / "out"),
            "--quiet",
        ]
        subprocess.run(command, check=False)
        wall = time.perf_counter() - began
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        result = json.loads((Path(folder) / "out" / "result.json").read_text(encoding="utf-8"))
        with (Path(folder) / "out" / "cases.csv").open(encoding="utf-8") as stream:
            own = sum(float(row["seconds"]) for row in csv.DictReader(stream))
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    count = side * side
    numbers = {
        "sweep_wall": Number(wall, None, "s", ".1f", why=_TIME),
        "sweep_stable": Number(result["ok"], 0, shown="d"),
    }
    words = (
        f"`ribbonbench sweep` over a grid of {side} x {side} of them: {cpu:.1f} s of CPU time ({1e3 * cpu / count:.2f} "
        f"ms a case), {wall:.1f} s of wall time on {_cores()} cores, starts of all processes, tables and the picture "
        f"included; {result['together']} cases went together, {result['ok']} are stable. From the first slice to the "
        f"last {result['seconds']['wall']:.1f} s of wall time; the cases themselves (solve, stability, row) {own:.1f} "
        "s, added up over the workers."
    )
    return words, numbers


def run(folder: Path) -> dict[str, Number]:
    """Writes batches.md into the folder."""
    (many, numbers), (sweep, more) = solved(), swept()
    page.write(
        folder / "batches.md",
        "Batches of small ribbons",
        "OMP_NUM_THREADS=1 python -m tests.validation batches",
        many,
        sweep,
    )
    return numbers | more
