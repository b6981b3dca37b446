"""What the shell costs: time against error over meshes and degrees, by its own kernels and by dolfinx's forms."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt

from compare.models.shell_process import shell_problem
from compare.scene.scene import load
from shellref import ShellOptions, ShellProblem, ShellResult
from shellref.path.adaptive import gap
from shellref.path.solve import solve
from tests.validation import page
from tests.validation.number import Number

RATIO = 100.0
REFERENCE = ((150, 12), 3)
MESHES = {
    2: ((25, 2), (50, 4), (100, 4), (100, 8), (150, 12)),
    3: ((25, 2), (50, 4), (70, 6)),
    4: ((15, 2), (30, 4), (45, 6)),
}
#: Meshes of each degree that are solved by forms too.
JUDGED = {2: 4, 3: 2, 4: 2}
#: The 100 x 4 run of 4.3 must stay under this, in seconds without compilation; it takes about a tenth of it.
MOST_SECONDS = 30.0
#: Largest distance over l between the states of kernels and of forms.
SAME = 1e-9


def spent(result: ShellResult) -> float:
    """Seconds without import and compilation."""
    return result.seconds["total"] - result.seconds["import"] - result.seconds["compile"]


def measured(problem: ShellProblem, engine: str, options: ShellOptions | None = None) -> tuple[ShellResult, float]:
    """A solve and its seconds of the processor; forms and kernels are loaded before."""
    begin = time.process_time()
    result = solve(problem, replace(options or ShellOptions(), engine=engine))
    return result, time.process_time() - begin


def problem_of(mesh: tuple[int, int], degree: int) -> ShellProblem:
    """The curl on a graded mesh."""
    return replace(shell_problem(load("curl_4_3"), RATIO, mesh), grading=(0.2, 0.1), degree=degree)


def membrane(mesh: tuple[int, int], degree: int) -> float:
    """Membrane share (%) of the elastic energy."""
    return 100.0 * float(solve(problem_of(mesh, degree)).share["membrane"])


PROBES = {"membrane_q2_25x2": lambda: membrane((25, 2), 2), "membrane_q3_25x2": lambda: membrane((25, 2), 3)}


def run(out: Path) -> dict[str, Number]:
    base = problem_of((100, 4), 2)
    numbers: dict[str, Number] = {}
    (elements, degree) = REFERENCE
    reference = solve(replace(base, elements=elements, degree=degree))
    finer_check = solve(replace(base, elements=(100, 8), degree=3))
    own = gap(reference.surface, finer_check.surface)
    rows, curves, steps, ratios = [], {}, [], []
    for k, meshes in MESHES.items():
        for mesh in meshes:
            problem = replace(base, elements=mesh, degree=k)
            if mesh == meshes[0]:
                for engine in ("kernels", "forms"):
                    measured(replace(problem, elements=(4, 1)), engine)
            result, seconds = measured(problem, "kernels")
            old = ["-"] * 3
            if mesh in meshes[: JUDGED[k]]:
                judge, before = measured(problem, "forms")
                apart = gap(result.surface, judge.surface)
                if not apart < SAME:
                    raise AssertionError(f"{mesh} of degree {k}: {apart:.1e} between kernels and forms")
                each = (before / judge.factorisations) / (seconds / result.factorisations)
                ratios.append(each)
                old = [f"{before:.2f}", f"{each:.1f}", f"{apart:.0e}"]
            print(f"  Q{k} {mesh}: {seconds:.2f} s, {old[0]} by forms", flush=True)
            error = gap(result.surface, reference.surface)
            share = abs(result.share["membrane"] - reference.share["membrane"])
            name = f"q{k}_{mesh[0]}x{mesh[1]}"
            numbers[f"error_{name}"] = Number(error, own, "l", ".1e")
            numbers[f"membrane_{name}"] = Number(100 * result.share["membrane"], 100 * share, "%", ".3f")
            numbers[f"seconds_{name}"] = Number(seconds, None, "s", ".2f", "processor time of one run")
            if old[0] != "-":
                numbers[f"forms_{name}"] = Number(float(old[0]), None, "s", ".2f", "processor time of one run")
            curves.setdefault(k, []).append((seconds, error))
            rows.append([
                f"Q{k} {mesh[0]} x {mesh[1]}", str(result.unknowns), result.status.value, f"{error:.1e}",
                f"{share:.1e}", str(result.newton_iterations), str(result.factorisations), f"{seconds:.2f}",
                *old,
            ])  # fmt: skip
    even, seconds = measured(replace(base, elements=(100, 4), grading=(1.0, 1.0)), "kernels")
    for s in even.steps:
        steps.append([
            s.stage, s.method, f"{s.load:.3f}", "yes" if s.accepted else "no", str(s.iterations),
            str(s.factorisations), f"{s.seconds:.2f}",
        ])  # fmt: skip
    figure(out / "shell_cost.png", curves)
    page.write(
        out / "shell_cost.md", "What the shell costs", "python -m tests.validation shell_cost",
        f"Scene curl_4_3 at w/h = {RATIO:g}, meshes graded (0.2, 0.1), one core, seconds of the processor, "
        "compilation apart, on a machine that others used: kernels, and forms (dolfinx's, MUMPS, reference BLAS), "
        "one after the other. "
        "error: largest "
        f"distance over l at equal material points to Q{degree} {elements[0]} x {elements[1]}, which is itself "
        f"{own:.1e} "
        "from Q3 100 x 8. membrane: difference of the membrane share of the elastic energy. apart: largest distance of "
        f"both states. An iteration takes {min(ratios):.1f} to {max(ratios):.1f} times as long by forms (ratio), "
        f"{np.median(ratios):.1f} in the middle.",
        page.table(
            ["mesh", "unknowns", "status", "error / l", "membrane", "Newton", "factorisations", "s", "forms s", "ratio",
             "apart"], rows
        ),
        "![time against error](shell_cost.png)",
        f"Load steps of the thesis's even 100 x 4 mesh ({seconds:.1f} s in all):",
        page.table(["stage", "method", "load", "accepted", "iterations", "factorisations", "s"], steps),
    )  # fmt: skip
    if not seconds < MOST_SECONDS:
        raise AssertionError(f"4.3 on 100 x 4 took {seconds:.0f} s")
    return numbers | {"reference": Number(own, own, "l", ".1e")}


def figure(path: Path, curves: dict[int, list[tuple[float, float]]]) -> None:
    """Error against time by degree."""
    fig, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    for k, points in curves.items():
        seconds, error = np.array(sorted(points)).T
        axis.loglog(seconds, error, "o-", label=f"Q{k}")
    axis.set(xlabel="time (s)", ylabel="error / l", title=f"curl_4_3, w/h = {RATIO:g}")
    axis.legend()
    axis.grid(True, which="both", lw=0.3, alpha=0.6)
    fig.savefig(path, dpi=110, metadata={"Software": None})
    plt.close(fig)
