"""A flat strip that bends under its own weight (thesis 4.5, figure 4.7): elastica, ribbon, shell, both asymptotes."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from numpy.typing import NDArray

from compare.models.ribbon.build import ribbon_arguments
from compare.scene.scene import load
from ribbon import Equilibrium
from ribbon import solve as solve_ribbon
from shellref.elastica.solve import ElasticaProblem, graded_nodes, solve
from tests.reference.elastica_closed import heavy_cantilever
from tests.validation import page
from tests.validation.number import Number, rounding

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.ticker import NullFormatter

Array = NDArray[np.float64]

GAMMAS = np.logspace(-2.0, 6.0, 25)
DECADES = (1.0, 10.0, 1e2, 1e3, 1e4, 1e5)
ELEMENTS, DEGREE, SEGMENTS = 100, 4, 40
#: From the straight strip ribbons heavier than HEAVY settle in other equilibria: bent down in the first third, in 1/l;
#: above HEAVIEST in the first ninth.
BENT, HEAVY = (8.0, 0.0, 0.0, 0.0), 30.0
SHARPLY_BENT, HEAVIEST = (20.0, *(0.0,) * 9), 3000.0
SHELL_GAMMAS, RATIO, WIDTH, POISSON = (0.1, 1.0, 10.0, 100.0, 1000.0), 100.0, 0.05, (0.0, 0.4)
MESH, COARSE = (40, 4), (20, 2)
WORK = (10.0, 1000.0)
SIZES, REPEATS = (5, 10, 20, 40, 80), 9
PROMISED = {"elastica": 1e-9, "ribbon": 1e-5}


def exact(gamma: float) -> float:
    """y / x by Taylor shooting: no mesh."""
    x, drop = heavy_cantilever(gamma, 25 if gamma < 1.0 else None)  # light: small differences of doubles
    return float(drop / x)


def ratio_of(end: Any, reach: int = 0, height: int = 1) -> float:
    """y / x of an end, positive downwards."""
    return -float(end[height]) / float(end[reach])


def ribbon(gamma: float, lengths: Array, energy: str = "wunderlich", tolerance: float | None = None) -> Equilibrium:
    """The ribbon on segments of these lengths (n,), to the solver's own tolerance or another."""
    seed = "natural" if gamma <= HEAVY else BENT if gamma <= HEAVIEST else SHARPLY_BENT
    arguments = ribbon_arguments(load("cantilever").replace({"strip.gamma": gamma, "model.energy": energy}))
    arguments |= {"segments": lengths, "seed_curvature": seed}
    return solve_ribbon(**arguments, options=None if tolerance is None else {"tol": tolerance})


def segments(gamma: float, count: int, graded: bool) -> Array:
    """Lengths (count,) of equal or of graded segments, placed as the elastica's elements are."""
    if not graded:
        return np.full(count, 1.0 / count)
    lengths: Array = np.diff(graded_nodes(count, ElasticaProblem(gamma=gamma), 2))
    return lengths / lengths.sum()


def curves() -> dict[str, Array]:
    """y / x over GAMMAS: "exact", and relative errors of elastica and ribbon, graded and equal (nan: no minimum)."""
    names = ("elastica graded", "elastica equal", "ribbon graded", "ribbon equal")
    found = {name: np.full(GAMMAS.size, np.nan) for name in ("exact", *names)}
    for k, gamma in enumerate(GAMMAS):
        true = found["exact"][k] = exact(gamma)
        for kind, nodes in (("graded", ELEMENTS), ("equal", np.linspace(0.0, 1.0, ELEMENTS + 1))):
            result = solve(ElasticaProblem(gamma=gamma), nodes, DEGREE, estimate_error=False)
            found[f"elastica {kind}"][k] = ratio_of(result.end) / true - 1.0
            e = ribbon(gamma, segments(gamma, SEGMENTS, kind == "graded"))
            if e.ok:
                found[f"ribbon {kind}"][k] = ratio_of(e.end.position, 2) / true - 1.0
        print(f"  cantilever: Gamma = {gamma:.3g}", flush=True)
    return found


def shell_ratio(nu: float, gamma: float, mesh: tuple[int, int]) -> float:
    """y / x of the shell on a mesh."""
    from shellref import ShellOptions, ShellProblem, ShellStatus
    from shellref.path.solve import solve as solve_it

    problem = ShellProblem(
        WIDTH, WIDTH / RATIO, nu, gamma=gamma, up=(0.0, 1.0, 0.0), elements=mesh,
        grading=(1.0 if gamma < HEAVY else 0.3, 1.0),
    )  # fmt: skip
    result = solve_it(problem, ShellOptions(stability=False))
    if result.status is not ShellStatus.CONVERGED:
        raise AssertionError(f"shell, nu = {nu:g}, Gamma = {gamma:g}: {result.message}")
    return ratio_of(result.section(1.0)["position"], 2)


def shells() -> list[tuple[float, float, float, float]]:
    """(nu, Gamma, relative difference to the elastica, relative change from the coarser mesh) of every shell."""
    found = []
    for nu in POISSON:
        for gamma in SHELL_GAMMAS:
            ends = [shell_ratio(nu, gamma, mesh) for mesh in (MESH, COARSE)]
            true = exact(gamma)
            found.append((nu, gamma, ends[0] / true - 1.0, abs(ends[1] / ends[0] - 1.0)))
            print(f"  cantilever: shell, nu = {nu:g}, Gamma = {gamma:g}: {found[-1][2]:+.1e}", flush=True)
    return found


def digits_table(shown: tuple[float, ...] = DECADES) -> tuple[str, float]:
    """y / x to ten digits with the errors of both meshes; the largest of the graded elastica's."""
    rows, worst = [], 0.0
    for gamma in shown:
        true, row = exact(gamma), []
        for nodes in (ELEMENTS, np.linspace(0.0, 1.0, ELEMENTS + 1)):
            miss = ratio_of(solve(ElasticaProblem(gamma=gamma), nodes, DEGREE, estimate_error=False).end) / true - 1.0
            row.append(f"{miss:+.0e}")
            if isinstance(nodes, int):
                worst, value = max(worst, abs(miss)), true * (1.0 + miss)
        for graded in (True, False):
            e = ribbon(gamma, segments(gamma, SEGMENTS, graded))
            row.append(f"{ratio_of(e.end.position, 2) / true - 1.0:+.0e}" if e.ok else e.status.code)
        rows.append(
            [f"{gamma:g}", f"{value:.10g}", *row, f"{8.0 * true / gamma - 1.0:+.2e}",
             f"{true / np.sqrt(gamma / 2.0) - 1.0:+.2e}"]
        )  # fmt: skip
    heads = ["Gamma", "y / x", "elastica graded", "equal", "ribbon graded", "equal", "to Gamma / 8",
             "to sqrt(Gamma / 2)"]  # fmt: skip
    return page.table(heads, rows), worst


def figure(path: Path, found: dict[str, Array], shell: list[tuple[float, float, float, float]]) -> None:
    """Above: y / x over Gamma with both asymptotes; below: relative distances to the exact value."""
    drawing, (above, below) = plt.subplots(
        2, 1, figsize=(8.0, 8.0), sharex=True, layout="constrained", height_ratios=(3, 4)
    )
    above.loglog(GAMMAS, found["exact"], "k", label="elastica")
    above.loglog(GAMMAS, GAMMAS / 8.0, "--", color="C0", label="$\\Gamma / 8$")
    above.loglog(GAMMAS, np.sqrt(GAMMAS / 2.0), "--", color="C1", label="$\\sqrt{\\Gamma / 2}$")
    above.loglog(
        GAMMAS[::2], (found["exact"] * (1.0 + found["ribbon graded"]))[::2], "o", mfc="none", color="C2", label="ribbon"
    )
    for nu, marker in zip(POISSON, "x+", strict=True):
        points = [(g, exact(g) * (1.0 + d)) for n, g, d, _ in shell if n == nu]
        above.loglog(*zip(*points, strict=True), marker, color="C3", ms=9, ls="", label=f"shell, $\\nu$ = {nu:g}")
    above.set(ylabel="y / x", ylim=(5e-4, 3e3), title="Cantilever under its own weight (thesis, figure 4.7)")
    above.legend(ncols=2)
    lines = (
        ("elastica graded", "k", "-", f"elastica, {ELEMENTS} P{DEGREE}, graded"),
        ("elastica equal", "k", ":", "the same, equal elements"),
        ("ribbon graded", "C2", "-", f"ribbon, {SEGMENTS} segments, graded"),
        ("ribbon equal", "C2", ":", "the same, equal segments"),
    )
    for name, colour, style, label in lines:
        below.loglog(GAMMAS, np.maximum(np.abs(found[name]), 1e-16), style, color=colour, label=label)
    below.loglog(GAMMAS, np.abs(GAMMAS / 8.0 / found["exact"] - 1.0), "--", color="C0", label="$\\Gamma / 8$")
    below.loglog(
        GAMMAS, np.abs(np.sqrt(GAMMAS / 2.0) / found["exact"] - 1.0), "--", color="C1", label="$\\sqrt{\\Gamma / 2}$"
    )
    for nu, marker in zip(POISSON, "x+", strict=True):
        points = [(g, abs(d)) for n, g, d, _ in shell if n == nu]
        below.loglog(*zip(*points, strict=True), marker, color="C3", ms=9, ls="", label=f"shell, $\\nu$ = {nu:g}")
    below.set(xlabel="$\\Gamma$", ylabel="relative distance to the exact y / x", ylim=(1e-16, 1e8), xlim=(8e-3, 1.3e6))
    below.legend(ncols=3, fontsize="small", loc="upper center")
    for axes in (above, below):
        axes.grid(alpha=0.3)
    drawing.savefig(path, dpi=120)
    plt.close(drawing)


def timed(once: Callable[[], Any]) -> tuple[Any, float, float]:
    """Result, first time and median of REPEATS more (s)."""
    clock = time.perf_counter()
    result = once()
    first = time.perf_counter() - clock
    times = []
    for _ in range(REPEATS):
        clock = time.perf_counter()
        once()
        times.append(time.perf_counter() - clock)
    return result, first, statistics.median(times)


def work(gamma: float) -> tuple[dict[str, list[tuple[int, float, float]]], dict[str, float]]:
    """Of every solver the (size, error / l, warm s) of each size; and the first call (s) of each solver."""
    s = np.linspace(0.0, 1.0, 1001)
    reference = solve(ElasticaProblem(gamma=gamma), 400, 4, estimate_error=False).position(s)
    solvers: dict[str, Callable[[int], Any]] = {}
    for degree in (1, 2, 4):
        for graded in (True, False):
            name = f"elastica P{degree}, {'graded' if graded else 'equal'}"
            solvers[name] = lambda n, q=degree, g=graded: solve(
                ElasticaProblem(gamma=gamma), n if g else np.linspace(0.0, 1.0, n + 1), q, estimate_error=False
            )
    for energy in ("sadowsky", "wunderlich"):
        for graded in (True, False):
            name = f"{energy}, {'graded' if graded else 'equal'}"
            solvers[name] = lambda n, e=energy, g=graded: ribbon(gamma, segments(gamma, n, g), e)
    found: dict[str, list[tuple[int, float, float]]] = {}
    begun = {}
    for name, solver in solvers.items():
        found[name] = []
        for count in SIZES:
            result, first, warm = timed(lambda solver=solver, count=count: solver(count))
            begun.setdefault(name, first)
            if isinstance(result, Equilibrium):
                if not result.ok:
                    continue
                line = result.position(s)[:, [2, 1]]
            else:
                line = result.position(s)
            found[name].append((count, float(np.linalg.norm(line - reference, axis=1).max()), warm))
        print(f"  cantilever: work, Gamma = {gamma:g}, {name}", flush=True)
    return found, begun


def work_figure(path: Path, works: dict[float, dict[str, list[tuple[int, float, float]]]]) -> None:
    """Error over warm time, one panel per Gamma."""
    drawing, panels = plt.subplots(1, len(works), figsize=(12.0, 5.0), sharey=True, layout="constrained")
    colours = {"elastica P1": "C0", "elastica P2": "C1", "elastica P4": "C2", "sadowsky": "C3", "wunderlich": "k"}
    for axes, (gamma, found) in zip(np.atleast_1d(panels), works.items(), strict=True):
        for name, points in found.items():
            kind, placed = name.split(", ")
            if points:
                _, error, warm = zip(*points, strict=True)
                axes.loglog(
                    1e3 * np.array(warm), error, marker="o" if placed == "graded" else "s",
                    ls="-" if placed == "graded" else ":", mfc=None if placed == "graded" else "none",
                    color=colours[kind], label=name,
                )  # fmt: skip
        axes.set_xticks([5, 10, 20, 50, 100], labels=["5", "10", "20", "50", "100"])
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.set(xlabel="time of a warm solve, ms", title=f"$\\Gamma$ = {gamma:g}")
        axes.grid(alpha=0.3)
    np.atleast_1d(panels)[0].set(ylabel="largest distance to the reference centreline / l")
    np.atleast_1d(panels)[-1].legend(fontsize="small", loc="center left", bbox_to_anchor=(1.0, 0.5))
    drawing.savefig(path, dpi=120)
    plt.close(drawing)


def work_table(works: dict[float, dict[str, list[tuple[int, float, float]]]], begun: dict[str, float]) -> str:
    """One row per solver and Gamma: error and time of three sizes."""
    rows = []
    for gamma, found in works.items():
        for name, points in found.items():
            cells = {n: f"{error:.1e}, {1e3 * warm:.3g} ms" for n, error, warm in points}
            first = f"{begun[name]:.2g}" if gamma == WORK[0] else ""
            rows.append([f"{gamma:g}", name, *(cells.get(n, "no minimum") for n in (5, 20, 80)), first])
    return page.table(["Gamma", "solver", "5", "20", "80", "first call, s"], rows)


def elastica_ratio(gamma: float) -> float:
    """y / x by the elastica on graded elements."""
    return ratio_of(solve(ElasticaProblem(gamma=gamma), ELEMENTS, DEGREE, estimate_error=False).end)


def ribbon_miss(gamma: float) -> float:
    """Relative error of the ribbon's y / x on graded segments."""
    return ratio_of(ribbon(gamma, segments(gamma, SEGMENTS, True)).end.position, 2) / exact(gamma) - 1.0


#: A hundred times the ribbon's own tolerance; weights at which it is asked what stopping so early changes.
EARLY, REQUESTED = 1e-6, (10.0, 100.0, 1000.0, 1e4, 1e5)


def ribbon_left(gamma: float) -> float:
    """What the ribbon's tolerance may leave of its y / x, relative: the change where it stops a hundred times earlier,
    at least as much."""
    lengths = segments(gamma, SEGMENTS, True)
    own, early = (ribbon(gamma, lengths, tolerance=tolerance) for tolerance in (None, EARLY))
    return abs(ratio_of(early.end.position, 2) / ratio_of(own.end.position, 2) - 1.0)


PROBES = {
    "ratio_10": lambda: elastica_ratio(10.0),
    "ribbon_100": lambda: ribbon_miss(100.0),
    "ribbon_1000": lambda: ribbon_miss(1000.0),
    "shell_10_coarse": lambda: shell_ratio(0.4, 10.0, COARSE),
}


def run(out: Path) -> dict[str, Number]:
    works, begun = {}, {}
    for gamma in WORK:
        works[gamma], first = work(gamma)
        begun = begun or first
    found = curves()
    shell = shells()
    digits, worst = digits_table()
    figure(out / "cantilever.png", found, shell)
    work_figure(out / "cantilever_work.png", works)
    ribbon_worst = float(np.max(np.abs(found["ribbon graded"])))
    page.write(
        out / "cantilever.md", "A cantilever under its own weight (thesis 4.5, figure 4.7)",
        "OMP_NUM_THREADS=1 python -m tests.validation cantilever",
        "A naturally flat strip is clamped horizontally; y/x is how far down its end comes over how far out. Exact: "
        "Taylor series shooting from the free end, without a mesh (`tests/reference/elastica_closed.py`).",
        "![y/x over Gamma from 1e-2 to 1e6 with both asymptotes, and the relative distance of elastica, ribbon, shell "
        "and asymptotes to the exact value](cantilever.png)",
        "## Digits, and what grading is worth",
        f"y/x by the elastica ({ELEMENTS} elements of degree {DEGREE}, graded towards the clamp) and relative errors: "
        f"of the same number of equal elements, of {SEGMENTS} ribbon segments (Wunderlich, chained) graded alike and "
        "equal. The strip bends within a layer of width Gamma^(-1/2) at the clamp, which equal elements miss. Last "
        f"columns: of the exact value to the asymptotes. Ribbons heavier than Gamma = {HEAVY:g} start bent down in "
        "their first third (ninth, above 3000); from the straight seed they find other equilibria. From 1e-2 to 1e6 "
        f"the graded ribbon is off by {ribbon_worst:.1e} at most; the elastica by what Newton's tolerance "
        "of 1e-11 leaves.",
        digits,
        "## The shell",
        f"w/l = {WIDTH:g}, w/h = {RATIO:g}, {MESH[0]} x {MESH[1]} Q2 elements, graded along where Gamma is 100 or "
        "more. To the elastica: relative difference of y/x; mesh: relative change from "
        f"{COARSE[0]} x {COARSE[1]}. With nu = 0 the shell is the elastica, but for shear and stretch. With nu = 0.4 a "
        "light strip curls across and bends with Y I instead of D w: y/x is larger by 1 / (1 - nu^2) = 1.19; the "
        "heavier it is, the stronger its curvature w^2 kappa / h keeps it flat across, and the nearer it comes to the "
        "ribbon, which knows no nu.",
        page.table(
            ["nu", "Gamma", "to the elastica", "mesh"],
            [[f"{nu:g}", f"{g:g}", f"{d:+.1e}", f"{m:.0e}"] for nu, g, d, m in shell],
        ),
        "## Error against time",
        "Largest distance of the centreline to that of 400 graded elements of degree 4, and the median time of "
        f"{REPEATS} warm solves (stability included, one core) with 5, 20 and 80 elements. First call: of the first "
        "size in this process, with what is then loaded (Sadowsky's loads the ribbon's kernels).",
        "![error against warm time for Gamma = 10 and 1000](cantilever_work.png)",
        work_table(works, begun),
    )  # fmt: skip
    if not worst < PROMISED["elastica"]:
        raise AssertionError(f"the graded elastica is off by {worst:.1e}")
    if not ribbon_worst < PROMISED["ribbon"]:
        raise AssertionError(f"the graded ribbon is off by {ribbon_worst:.1e}, or has no minimum")
    numbers = {
        "ratio_10": Number(elastica_ratio(10.0), abs(elastica_ratio(10.0) - exact(10.0)), shown=".10g"),
        "worst_elastica": rounding(worst, shown=".0e"),
        # what the elastica and the shooting leave together, and the ribbon's own tolerance
        "worst_ribbon": Number(ribbon_worst, 2.0 * worst + max(map(ribbon_left, REQUESTED)), shown=".1e"),
    }
    for gamma in (100.0, 1000.0):
        numbers[f"ribbon_{gamma:g}"] = Number(ribbon_miss(gamma), 2.0 * worst + ribbon_left(gamma), shown="+.0e")
    coarse = shell_ratio(0.4, 10.0, COARSE)
    numbers["shell_10_coarse"] = Number(coarse, abs(shell_ratio(0.4, 10.0, MESH) - coarse))
    for nu, gamma, apart, change in shell:
        name = f"shell_{'nu_' if nu else ''}{f'{gamma:g}'.replace('.', '_')}"
        numbers[name] = Number(apart, change, shown="+.1e")
    return numbers
