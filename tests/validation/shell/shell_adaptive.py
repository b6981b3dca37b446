"""Meshes graded by dual-weighted estimates: effectivity on given meshes, and error over cells and time against meshes
cut everywhere."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt

from compare.models.shell_build import shell_problem
from compare.scene.scene import load
from shellref import ShellOptions, ShellProblem, ShellResult
from shellref.fenics import dolfinx_api as api
from shellref.path.graded import judged
from shellref.path.solve import solve
from shellref.path.solver import Solver
from shellref.path.weighted import PLACES
from shellref.shell.result import ShellStatus
from shellref.shell.strip import build_strip
from tests.validation import one_core, page
from tests.validation.number import Number

#: Scene, w/h, what is asked.
JUDGED = (
    ("curl_4_3", 100.0, "end"),
    ("curl_4_3", 100.0, "energy"),
    ("curl_4_3", 1000.0, "end"),
    ("two_clamps_5_3_2", 100.0, "middle"),
    ("bend_45", 20.0, "end"),
    ("cantilever", 1000.0, "end"),
)
#: What is other than in the scene: these estimates are for strips that are straight at rest.
CHANGED: dict[str, dict[str, Any]] = {"bend_45": {"rod.natural_in_plane": 0.0}}
MESHES = ((25, 2), (50, 4), (100, 4), (100, 8))
REFERENCE, CHECK, DEGREE = (120, 10), (90, 8), 3
#: Scene, w/h, what is asked, grading of the meshes cut everywhere, grading and elements of the first graded mesh.
RACES = (
    ("curl_4_3", 100.0, "end", (0.2, 0.1), (25, 2)),
    ("curl_4_3", 100.0, "end", (1.0, 1.0), (25, 2)),
    ("curl_4_3", 1000.0, "end", (0.2, 0.1), (50, 4)),
    ("cantilever", 1000.0, "end", (1.0, 1.0), (10, 2)),
    ("two_clamps_5_3_2", 100.0, "middle", (1.0, 1.0), (25, 2)),
)
TOLERANCES = (1e-3, 1e-4, 1e-5)
CUTS = (1, 2, 4, 6)
#: Tolerances of the whole surface (Hausdorff), by meshes that are cut everywhere and compared.
SURFACE = (1e-3, 1e-4)
#: The reference must be so many times nearer for an index; parts that cancel to less than this are not judged.
FINER, CANCELS = 5.0, 0.25
#: An effectivity index is between these in at least so many of the cases, on all meshes that are judged.
LEAST, MOST, SCENES = 0.5, 2.0, 5


@dataclass(frozen=True)
class Requested:
    """Scene, w/h and goal: its problem, the value on the reference mesh."""

    name: str
    ratio: float
    goal: str
    problem: ShellProblem
    value: np.ndarray
    own: float  # its distance to another reference mesh

    @property
    def label(self) -> str:
        return f"{self.name}, w/h = {self.ratio:g}, {self.goal}"

    def error(self, result: ShellResult) -> float:
        """Distance to the reference (l; of the energy over the elastic one)."""
        scale = 1.0 / result.energy["elastic"] if self.goal == "energy" else 1.0
        return scale * float(np.linalg.norm(value(result, self.goal) - self.value))


def value(result: ShellResult, goal: str) -> np.ndarray:
    """The asked quantity."""
    if goal == "energy":
        return np.array([result.energy["total"]])
    return result.surface.centreline(np.array(PLACES[goal]))


def asked(name: str, ratio: float, goal: str) -> tuple[Requested, ShellResult]:
    """With the reference's state."""
    problem = shell_problem(load(name).replace(CHANGED.get(name, {})), ratio)
    coarse = solve(dataclasses.replace(problem, elements=(50, 4)))
    fine = solve(dataclasses.replace(problem, elements=REFERENCE, degree=DEGREE), start=coarse.surface)
    if fine.status is not ShellStatus.CONVERGED or fine.stable is not True:
        raise AssertionError(f"{name}: the reference is {fine.status.value}: {fine.message}")
    check = solve(dataclasses.replace(problem, elements=CHECK, degree=DEGREE), start=fine.surface)
    case = Requested(name, ratio, goal, problem, value(fine, goal), 0.0)
    return dataclasses.replace(case, own=case.error(check)), fine


def effectivity(name: str, ratio: float, goal: str) -> list[list[str]]:
    """Rows of one scene: error, estimate, index, on given meshes."""
    case, near = asked(name, ratio, goal)
    options = ShellOptions(goal=goal)
    rows = []
    for mesh in MESHES:
        problem = dataclasses.replace(case.problem, elements=mesh)
        solver = Solver(build_strip(problem, options), options, api.communicator("self"), lambda event: None)
        clock = time.process_time()
        result = solver.run(near.surface)
        if result.status is not ShellStatus.CONVERGED:
            rows.append([name, f"{ratio:g}", goal, " x ".join(map(str, mesh)), result.status.value, *["-"] * 6])
            continue
        settled = time.process_time() - clock
        clock = time.process_time()
        row, _ = judged(result, solver, 1e-12)
        spent = time.process_time() - clock
        error, change = case.error(result), float(np.linalg.norm(np.sum(row["change"], axis=0)))
        sharp = all(row["sharp"])
        rows.append([
            name, f"{ratio:g}", goal, " x ".join(map(str, mesh)), f"{error:.2e}", f"{change:.2e}",
            f"{change / error:.2f}", f"{row['estimate'] / error:.2f}", "yes" if sharp else "no", f"{settled:.2f}",
            f"{spent:.2f}",
        ])  # fmt: skip
        together = row["along"] + row["across"]
        # no index where the reference is no better, or what comes from along and across cancels
        if error < FINER * case.own or change < CANCELS * together:
            rows[-1][6] += " (-)"
        elif sharp and not LEAST < change / error < MOST:
            rows[-1][6] += " (!)"
        print("  ", *rows[-1], flush=True)
    return rows


def timed(run: Callable[[], ShellResult]) -> tuple[ShellResult, float]:
    """A result and its CPU time (s)."""
    clock = time.process_time()
    return run(), time.process_time() - clock


def race(
    name: str, ratio: float, goal: str, grading: tuple[float, float], first: tuple[int, int]
) -> tuple[str, list[list[str]], dict[str, Any]]:
    """Rows of meshes cut everywhere and of graded ones from the same first mesh; curves (cells, seconds, error); the
    last graded result's knots and indicators."""
    case, _ = asked(name, ratio, goal)
    problem = dataclasses.replace(case.problem, grading=grading, elements=first)
    coarse, path = timed(lambda: solve(problem))
    coarse, path = timed(lambda: solve(problem))  # kernels loaded
    rows, curves = [], {"all cut": [], "surface": [], "graded": []}
    text = f"{grading[0]:g}, {grading[1]:g}"

    def note(way: str, result: ShellResult, seconds: float, tolerance: str, estimate: str, meshes: str) -> None:
        error, cells = case.error(result), result.elements[0] * result.elements[1]
        if result.status is ShellStatus.CONVERGED:
            curves[way].append((cells, seconds, error))
        rows.append([
            name, f"{ratio:g}", goal, text, way, tolerance, " x ".join(map(str, result.elements)), str(cells),
            meshes, str(result.newton_iterations), estimate, f"{error:.1e}", f"{seconds:.2f}", result.status.value,
        ])  # fmt: skip
        print("  ", *rows[-1], flush=True)

    for k in CUTS:
        mesh = dataclasses.replace(problem, elements=(k * first[0], k * first[1]))
        if k == 1:
            note("all cut", coarse, path, "-", "-", "1")
            continue
        result, seconds = timed(lambda mesh=mesh: solve(mesh, start=coarse.surface))
        together = dataclasses.replace(result, newton_iterations=coarse.newton_iterations + result.newton_iterations)
        note("all cut", together, path + seconds, "-", "-", "2")
    for tolerance in SURFACE:
        options = ShellOptions(accuracy=tolerance)
        result, seconds = timed(lambda options=options: solve(problem, options))
        found = result.discretisation or {}
        note(
            "surface", result, seconds, f"{tolerance:.0e}", f"{found.get('estimate', np.nan):.1e}",
            str(3 * len(found.get("meshes", []))),
        )  # fmt: skip
    last: dict[str, Any] = {}
    for tolerance in TOLERANCES:
        options = ShellOptions(accuracy=tolerance, goal=goal)
        result, seconds = timed(lambda options=options: solve(problem, options))
        found = result.discretisation or {}
        note(
            "graded", result, seconds, f"{tolerance:.0e}", f"{found.get('estimate', np.nan):.1e}",
            str(len(found.get("meshes", []))),
        )  # fmt: skip
        last = found or last
    return f"{case.label}, {text}", rows, {**curves, "last": last}


def bend(name: str, ratio: float, mesh: tuple[int, int] = MESHES[0]) -> float:
    """How far (l) the end of a scene's shell is from its clamp, on a mesh."""
    result = solve(dataclasses.replace(shell_problem(load(name), ratio), elements=mesh))
    return float(np.linalg.norm(value(result, "end")))


#: The scene whose races the summary of results quotes.
QUOTED = "two_clamps_5_3_2"
#: Scene and w/h of ends that `make test` computes again on the coarsest mesh.
PROBED = (("curl_4_3", 100.0), ("cantilever", 1000.0))
PROBES = {f"end_{name}": lambda name=name, ratio=ratio: bend(name, ratio) for name, ratio in PROBED}


def numbers(judged_rows: list[list[str]], rows: list[list[str]], sharp: list[float]) -> dict[str, Number]:
    """Ends on the coarsest mesh with their change on the next; errors and indices of the meshes that are judged, whose
    reference is `FINER` times nearer; errors and cells of the races."""
    found = {}
    for name, ratio in PROBED:
        found[f"end_{name}"] = Number(bend(name, ratio), abs(bend(name, ratio) - bend(name, ratio, MESHES[1])), "l")
    for name, ratio, goal, mesh, error, _, index, *_ in judged_rows:
        if index != "-" and "(-)" not in index:  # "-": the mesh has no state, its error is a status
            at = f"{name}_{ratio}_{goal}_{mesh.replace(' ', '')}"
            found[f"error_{at}"] = Number(float(error), float(error) / FINER, "l", ".1e")
    for k, row in enumerate(rows):
        name, ratio, goal, _, path, _, _, cells, *_ = row
        at = f"{name}_{ratio}_{goal}_{path.replace(' ', '_')}_{k}"
        found[f"race_{at}"] = Number(float(row[11]), None, "l", ".1e", "one race; the page has the reference's error")
        found[f"cells_{at}"] = Number(int(cells), 0, shown="d")
    for word, path in (("graded", "graded"), ("cut", "all cut")):  # the finest of each between two clamps
        row = max((row for row in rows if row[0] == QUOTED and row[4] == path), key=lambda row: int(row[7]))
        found[f"{word}_cells"] = Number(int(row[7]), 0, shown="d")
        found[f"{word}_error"] = Number(float(row[11]), None, "l", ".1e", "the page has the reference's error")
    for word, number in (("least", min(sharp)), ("most", max(sharp)), ("middle", float(np.median(sharp)))):
        found[f"index_{word}"] = Number(number, number / FINER, shown=".2f")
    return found


def run(out: Path) -> dict[str, Number]:
    judged_rows = [row for case in JUDGED for row in one_core.call(effectivity, *case)]
    races = [one_core.call(race, *case) for case in RACES]
    rows = [row for _, some, _ in races for row in some]
    figure(out / "shell_adaptive.png", [(label, curves) for label, _, curves in races])
    sharp = [float(row[6].split()[0]) for row in judged_rows if row[8] == "yes" and "(-)" not in row[6]]
    wrong = [row for row in judged_rows if row[6].endswith("(!)")]
    page.write(
        out / "shell_adaptive.md", "Meshes graded by dual-weighted estimates",
        "python -m tests.validation shell_adaptive",
        f"Errors: distance of the asked quantity to Q{DEGREE} {REFERENCE[0]} x {REFERENCE[1]} (l; of the energy over "
        "the elastic one). change: the estimate of how far the quantity is from that of the mesh cut in two along and "
        "across (docs/theory.md, eq. (7.18) to (7.21)); index: change over error; bound index: of what stops the "
        "refinement, 4/3 of the sum of both directions. sharp: the tangent of the cut mesh had the state's inertia; "
        "elsewhere the sum of the indicators stands in, and the mesh is cut everywhere. (-): the error is below "
        f"{FINER:g} times that of the reference (by Q{DEGREE} {CHECK[0]} x {CHECK[1]}), or the parts of along and "
        f"across cancel to less than a quarter: not judged. {' and '.join(CHANGED)}: made straight at rest. "
        f"(!): outside {LEAST:g} to {MOST:g}. solve s, estimate s: CPU time "
        "to settle (the tangents' loading included in the first row), and of the estimate, one thread.",
        f"Index where sharp: {min(sharp):.2f} to {max(sharp):.2f}, {np.median(sharp):.2f} in the middle, "
        f"{len(sharp)} of {len(judged_rows)} meshes are judged.",
        page.table(
            ["scene", "w/h", "asked", "mesh", "error", "change", "index", "bound index", "sharp", "solve s",
             "estimate s"], judged_rows,
        ),
        "Error over cells and CPU time. all cut: the path on the first mesh, its end settled on a mesh with all cells "
        "cut; surface: `shell.tolerance` alone, which solves twice more for each estimate; graded: `shell.goal` with "
        "a tolerance, from the same first mesh. All with the path on the first mesh "
        "in their time. grading: of the first mesh at clamps and long edges.",
        page.table(
            ["scene", "w/h", "asked", "grading", "way", "tolerance", "mesh", "cells", "meshes", "Newton", "estimate",
             "error", "s", "status"], rows,
        ),
        "![error over cells and time; the last graded mesh with its indicators](shell_adaptive.png)",
        *SAID,
    )  # fmt: skip
    good = {tuple(row[:3]) for row in judged_rows} - {tuple(row[:3]) for row in wrong}
    if len(good) < SCENES:
        raise AssertionError(f"effectivity outside {LEAST} to {MOST}: {wrong}")
    return numbers(judged_rows, rows, sharp)


SAID: tuple[str, ...] = ()


def figure(path: Path, races: list[tuple[str, dict[str, Any]]]) -> None:
    """A row for each race: error over cells, over time, and sizes of columns with their indicators."""
    fig, axes = plt.subplots(len(races), 3, figsize=(13, 3.2 * len(races)), layout="constrained", squeeze=False)
    for (label, curves), (cells, seconds, mesh) in zip(races, axes, strict=True):
        for way, style in (("all cut", "o-"), ("surface", "^:"), ("graded", "s--")):
            count, spent, error = np.array(sorted(curves[way])).T
            cells.loglog(count, error, style, label=way)
            seconds.loglog(spent, error, style, label=way)
        cells.set(xlabel="cells", ylabel="error", title=label)
        seconds.set(xlabel="CPU time (s)", ylabel="error")
        knots, columns = np.array(curves["last"]["s_knots"]), np.array(curves["last"]["columns"])
        mesh.stairs(columns, knots, fill=True, color="0.8", label="indicator")
        mesh.set(xlabel="S / l", ylabel="indicator of a column", yscale="log", title="last graded mesh")
        size = mesh.twinx()
        size.stairs(np.diff(knots), knots, baseline=None, color="C3")
        size.set(ylabel="size of a column / l", yscale="log")
        for axis in (cells, seconds):
            axis.legend()
            axis.grid(True, which="both", lw=0.3, alpha=0.6)
    fig.savefig(path, dpi=90, metadata={"Software": None})
    plt.close(fig)
