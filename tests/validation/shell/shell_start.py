"""Where shells begin: at the ribbon's surface, with the path on a coarse mesh, or with their own path; one state?"""

from __future__ import annotations

import dataclasses
import functools
import time
from pathlib import Path
from typing import Any

import numpy as np

from compare.models.base import Options
from compare.models.choice import beside_the_shell
from compare.models.shell import starting_surface
from compare.models.shell_build import shell_options, shell_problem
from compare.scene.scene import Scene, load
from shellref.path.adaptive import gap
from shellref.path.begin import Begun, begun
from shellref.shell.problem import ShellProblem
from shellref.shell.result import ShellStatus
from tests.validation import one_core, page
from tests.validation.number import PROCESSORS, Number, rounding

#: Scene, w/h, mesh.
CASES = (
    ("cantilever", 200.0, (50, 4)),
    ("curl_4_3", 10.0, (50, 4)),
    ("curl_4_3", 100.0, (50, 4)),
    ("curl_4_3", 100.0, (100, 8)),
    ("curl_4_3", 1000.0, (100, 8)),
    ("curl_4_3_down", 100.0, (50, 4)),
    ("curl_4_4_long", 100.0, (50, 4)),
    ("coil_10_100", 100.0, (50, 4)),
    ("figure_4_1", 100.0, (50, 4)),
    ("limits_7_3", 100.0, (50, 4)),
    ("limits_7_3", 100.0, (100, 8)),
)
WAYS = {"path": {}, "coarse": {"coarse": True}, "ribbon": {"begin": "stable"}, "checked": {"begin": "checked"}}
SAME = 1e-9


def _asked(name: str, ratio: float, mesh: tuple[int, int]) -> tuple[Scene, ShellProblem, Any]:
    """A case's scene, its problem, and the ribbon's surface to begin at."""
    scene = load(name).replace({"shell.width_to_thickness": [ratio]})
    ribbon = beside_the_shell(scene).solve(scene, options=Options())
    problem = shell_problem(scene, ratio, mesh)
    return scene, problem, starting_surface(ribbon.shape, problem)


@functools.cache
def energy(way: str) -> float:
    """Total energy (D w / l) of the state that the first case ends in, begun in one of `WAYS`."""
    scene, problem, near = _asked(*CASES[0])
    options = shell_options(scene, **{"coarse": way == "checked", **WAYS[way]})
    one = begun(problem, options, lambda event: None, near if "begin" in WAYS[way] else None)
    return float(one.result.energy["total"])


PROBES = {f"energy_{way}": lambda way=way: energy(way) for way in ("path", "ribbon")}


def found(name: str, ratio: float, mesh: tuple[int, int]) -> dict[str, tuple[Begun, int, float]]:
    """By way: how it began and what came of it, Newton iterations and CPU time (s) of all that it took."""
    scene, problem, near = _asked(name, ratio, mesh)
    begun(dataclasses.replace(problem, elements=(30, 4)), shell_options(scene, coarse=False), lambda event: None)
    out = {}
    for way, changes in WAYS.items():
        steps: list[int] = []

        def say(event: dict, steps: list[int] = steps) -> None:
            if event["event"] == "step":
                steps.append(event["iterations"])

        options = shell_options(scene, **{"coarse": way == "checked", **changes})
        clock = time.process_time()
        result = begun(problem, options, say, near if "begin" in changes else None)
        out[way] = (result, sum(steps), time.process_time() - clock)
    return out


def row(name: str, ratio: float, mesh: tuple[int, int], cells: list[list[str]]) -> list[str]:
    """Adds the rows of a case; what is not as it should be."""
    ways = one_core.call(found, name, ratio, mesh)
    path, _, slow = ways["path"]
    wrong = []
    for way, (one, iterations, seconds) in ways.items():
        far = gap(one.result.surface, path.result.surface)
        apart = abs(one.result.energy["total"] - path.result.energy["total"])
        refused = "; ".join(one.notes.get("refused", [])) or "-"
        coarse = " x ".join(map(str, one.notes["coarse"])) if "coarse" in one.notes else "-"
        cells.append([
            name, f"{ratio:g}", " x ".join(map(str, mesh)), way, one.how, one.result.status.value, coarse,
            str(iterations), f"{seconds:.2f}", f"{slow / seconds:.1f}", f"{far:.0e}", f"{apart:.0e}", refused,
        ])  # fmt: skip
        if one.result.status is ShellStatus.CONVERGED is path.result.status and not max(far, apart) < SAME:
            wrong.append(f"{name} {ratio:g} {mesh} {way}: {far:.1e} l from the path's state")
    return wrong


def run(out: Path, cases: tuple[tuple[str, float, tuple[int, int]], ...] = CASES) -> dict[str, Number]:
    cells: list[list[str]] = []
    wrong = [text for case in cases for text in row(*case, cells)]
    factors = {way: [float(c[9]) for c in cells if c[3] == way] for way in WAYS if way != "path"}
    said = ", ".join(f"{way} {np.median(f):.1f} ({min(f):.1f} to {max(f):.1f})" for way, f in factors.items())
    page.write(
        out / "shell_start.md", "Where shells begin", "python -m tests.validation shell_start",
        "path: its own, on its mesh. coarse: the path on a coarse mesh, its end interpolated and settled at the full "
        "load; the fine state, interpolated back, must settle in the very state of the coarse path. ribbon: settled at "
        "the ribbon's surface, believed when stable without a kick. checked: the same, and the coarse path must lead "
        "to the same state. What is refused walks its path. iterations, s: Newton iterations and CPU time of all of "
        "it, one thread, coarse paths and checks included, the ribbon's solve not; factor: times faster than the path. "
        "distance, energy: largest difference at equal material points (l), of energies (D w / l), to the path's "
        "state.",
        f"Median factor, and from the least to the most: {said}. "
        + ("Every state is the path's." if not wrong else f"NOT the path's state: {'; '.join(wrong)}."),
        page.table(
            ["scene", "w/h", "mesh", "way", "began", "status", "coarse", "iterations", "s", "factor", "distance",
             "energy", "refused"], cells,
        ),
    )  # fmt: skip
    if any("ribbon:" not in text for text in wrong):
        raise AssertionError("; ".join(wrong))
    numbers = {}
    for way, column in (("farthest", 10), ("energy_apart", 11)):
        worst = max((float(c[column]) for c in cells if c[5] == ShellStatus.CONVERGED.value), default=0.0)
        numbers[way] = rounding(worst, "l" if column == 10 else "D w / l")
    for way, values in factors.items():
        for word, value in (("median", float(np.median(values))), ("least", min(values)), ("most", max(values))):
            numbers[f"{way}_{word}"] = Number(value, None, shown=".1f", why="processor times of one run")
    # two ways to one state: what is between their energies is what Newton leaves, on other processors so much more
    left = PROCESSORS * max(abs(energy("path") - energy("ribbon")), 1e-12)
    numbers["cases"] = Number(len(cases), 0, shown="d")
    return numbers | {f"energy_{way}": Number(energy(way), left, "D w / l", ".8g") for way in ("path", "ribbon")}
