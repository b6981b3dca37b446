"""Shells from w/h = 5 to 1000 on four meshes: does the error grow as they get thin, and what does a path cost?"""

from __future__ import annotations

import functools
import itertools
import time
from pathlib import Path
from typing import Any

import numpy as np

from compare.models.base import Options, State
from compare.models.choice import beside_the_shell
from compare.models.shell import starting_surface
from compare.models.shell_build import shell_options, shell_problem
from compare.scene.scene import Scene, load
from shellref.path.begin import Begun, begun
from shellref.shell.result import ShellStatus
from tests.validation import one_core, page
from tests.validation.number import PROCESSORS, Number, rounding

SCENES = ("cantilever", "curl_4_3", "shift_7_2")
RATIOS = (5.0, 20.0, 100.0, 300.0, 1000.0)
#: Each with twice as many elements, both ways, as the one before.
MESHES = ((25, 2), (50, 4), (100, 8), (200, 16))
#: What Newton leaves between two ways to one state (energies in D w / l, of some tens).
SAME = 1e-9


def _asked(name: str, ratio: float) -> tuple[Scene, State]:
    scene = load(name).replace({"shell.width_to_thickness": [ratio]})
    return scene, beside_the_shell(scene).solve(scene, options=Options())


def _solved(scene: Scene, ratio: float, mesh: tuple[int, int], ribbon: State | None) -> tuple[Begun, float]:
    """The shell by its own path, or begun at the ribbon's surface; processor time (s), the ribbon's solve not in it."""
    problem = shell_problem(scene, ratio, mesh)
    near = None if ribbon is None else starting_surface(ribbon.shape, problem)
    options = shell_options(scene, coarse=False, **({} if ribbon is None else {"begin": "stable"}))
    clock = time.process_time()
    one = begun(problem, options, lambda event: None, near)
    return one, time.process_time() - clock


@functools.cache
def energy(own: bool) -> float:
    """Total energy (D w / l) of the thinnest cantilever on the coarsest mesh, by its own path or from the ribbon."""
    scene, ribbon = _asked(SCENES[0], RATIOS[-1])
    return float(_solved(scene, RATIOS[-1], MESHES[0], None if own else ribbon)[0].result.energy["total"])


PROBES = {"energy_path": lambda: energy(True), "energy_ribbon": lambda: energy(False)}


def found(name: str, ratio: float) -> list[dict[str, Any]]:
    """By mesh: total and elastic energies (D w / l) of the path's state, how far the other's is, how and how long."""
    scene, ribbon = _asked(name, ratio)
    _solved(scene, ratio, MESHES[0], None)  # compilation
    rows = []
    for mesh in MESHES:
        (path, slow), (near, fast) = _solved(scene, ratio, mesh, None), _solved(scene, ratio, mesh, ribbon)
        if not path.result.status is near.result.status is ShellStatus.CONVERGED:
            raise AssertionError(f"{name}, w/h = {ratio:g}, {mesh}: {path.result.status}, {near.result.status}")
        values = path.result.energy
        rows.append(
            {"total": values["total"], "elastic": ribbon.energy.elastic, "slow": slow, "fast": fast,
             "given": near.how.startswith("given"), "apart": abs(near.result.energy["total"] - values["total"])}
        )  # fmt: skip
    return rows


def row(name: str, ratio: float, rows: list[dict[str, Any]]) -> tuple[list[str], float, bool]:
    """The cells of a case, the change to the finest mesh as a part of the elastic energy, and whether it is no more
    than half of the one before."""
    *_, first, second = (abs(b["total"] - a["total"]) for a, b in itertools.pairwise(rows))
    scale, last = abs(rows[-1]["elastic"]), rows[-1]
    order = f"{np.log2(first / second):.1f}" if first > second > 0 else "-"
    factor = f"{last['slow'] / last['fast']:.1f}" if last["given"] else "refused: path"
    return [
        name, f"{ratio:g}", *(f"{one['total']:.5f}" for one in rows), f"{first / scale:.1e}", f"{second / scale:.1e}",
        order, f"{last['slow']:.2f}", f"{last['fast']:.2f}", factor, f"{max(one['apart'] for one in rows):.0e}",
    ], second / scale, 2.0 * second <= first  # fmt: skip


def run(out: Path, names: tuple[str, ...] = SCENES, ratios: tuple[float, ...] = RATIOS) -> dict[str, Number]:
    cells, changes, factors, open_, apart = [], [], [], [], 0.0
    for name in names:
        for ratio in ratios:
            rows = one_core.call(found, name, ratio)
            cell, change, settled = row(name, ratio, rows)
            if not settled:
                open_.append(f"{name} at w/h = {ratio:g}")
            cells.append(cell)
            changes.append(change)
            apart = max(apart, *(one["apart"] for one in rows))
            if rows[-1]["given"]:
                factors.append(rows[-1]["slow"] / rows[-1]["fast"])
    page.write(
        out / "shell_thin.md", "Shells from w/h = 5 to 1000", "python -m tests.validation shell_thin",
        f"Not settled, the last change is more than half of the one before: {', '.join(open_) or 'none'}. The errors "
        "of this page are changes between meshes, no bounds.",
        "Energies (D w / l, total) of shells on " + ", ".join(f"{a} x {b}" for a, b in MESHES) + " elements by their "
        "own path. changes: between the last three meshes, as a part of the ribbon's elastic energy; order: of "
        "these two (- where they do not fall). A shell that locks is too stiff by a part that grows as (w/h)^2: "
        "here it would grow by 40,000. path, ribbon: seconds of the processor on the finest mesh, one thread, of "
        "the shell's own path and of one begun at the ribbon's surface and stable there (its check included, the "
        "ribbon's solve not); apart: largest difference of the energies of both, over the meshes. Where the start "
        "is refused, both walk the path.",
        f"Largest change to the finest mesh {max(changes):.1e}; begun at the ribbon "
        f"{min(factors):.1f} to {max(factors):.1f} times faster than the path (median {np.median(factors):.1f}), "
        f"refused in {len(cells) - len(factors)} of {len(cells)} cases.",
        page.table(
            ["scene", "w/h", *(f"{a} x {b}" for a, b in MESHES), "change", "last change", "order", "path s",
             "ribbon s", "path / ribbon", "apart"], cells,
        ),
    )  # fmt: skip
    if not apart < SAME:
        raise AssertionError(f"path and start at the ribbon end {apart:.1e} D w / l apart")
    # two ways to one state: what is between their energies is what Newton leaves, on other processors so much more
    left = PROCESSORS * max(abs(energy(True) - energy(False)), 1e-12)
    timed = "processor times of one run"
    return {
        "cases": Number(len(cells), 0, shown="d"),
        "refused": Number(len(cells) - len(factors), 0, shown="d"),
        "apart": rounding(apart, "D w / l"),
        "largest_change": Number(max(changes), max(changes), shown=".1e"),
        "factor_least": Number(min(factors), None, shown=".1f", why=timed),
        "factor_median": Number(float(np.median(factors)), None, shown=".1f", why=timed),
        "factor_most": Number(max(factors), None, shown=".1f", why=timed),
        "energy_path": Number(energy(True), left, "D w / l", ".8g"),
        "energy_ribbon": Number(energy(False), left, "D w / l", ".8g"),
    }
