"""Segments placed by a tolerance, chained and glued: the same states, and what either costs."""

from __future__ import annotations

import statistics
import time
from pathlib import Path
from typing import Any

import numpy as np

from compare.models.ribbon.build import ribbon_arguments
from compare.scene.scene import Scene, load
from ribbon import Equilibrium
from ribbon.find.adaptive import distance, solve_to_tolerance
from tests.validation import one_core, page
from tests.validation.number import Number

SCENES = (
    "curl_4_3", "coil_10_100", "coil_40_1200", "coil_100_7500", "figure_4_1", "hanging_5_3_1", "lateral_7_1",
    "curl_4_4_long", "cantilever", "edge_published", "jfig_5_2", "limits_7_3",
)  # fmt: skip
ENERGIES = ("wunderlich", "sadowsky")
TOLERANCES = (1e-3, 1e-5)
FORMULATIONS = ("chained", "mixed")
#: Timed in turn this many times, after one call that compiles.
ROUNDS = 3
#: Wall seconds for one of them.
BUDGET = 60.0


def _placed(scene: Scene, energy: str, formulation: str, tolerance: float) -> tuple[Equilibrium, float]:
    """The state and its CPU time (s)."""
    arguments: dict[str, Any] = {**ribbon_arguments(scene), "energy": energy, "formulation": formulation}
    del arguments["segments"]
    begun = time.process_time()
    equilibrium = solve_to_tolerance(tolerance=tolerance, budget=BUDGET, **arguments)
    return equilibrium, time.process_time() - begun


def _coarse(name: str, energy: str) -> Equilibrium:
    """A scene's chained state at the looser tolerance."""
    return _placed(load(name), energy, FORMULATIONS[0], TOLERANCES[0])[0]


PROBES = {
    "energy_coil_10_100_sadowsky": lambda: _coarse("coil_10_100", "sadowsky").energy.total,
    "energy_hanging_5_3_1_wunderlich": lambda: _coarse("hanging_5_3_1", "wunderlich").energy.total,
    "segments_coil_10_100_sadowsky": lambda: _coarse("coil_10_100", "sadowsky").problem.lengths.size,
}


def _measured() -> tuple[list[list[str]], list[float], dict[str, Number]]:
    """Rows of the table, the ratios of the times, and the chained states at the looser tolerance: segments, and the
    energy with its change to the tighter one."""
    rows, ratios, numbers = [], [], {}
    for name in SCENES:
        scene = load(name)
        for energy in ENERGIES:
            energies, sizes_found = [], []
            for tolerance in TOLERANCES:
                times: dict[str, list[float]] = {f: [] for f in FORMULATIONS}
                states = {}
                for turn in range(ROUNDS + 1):
                    for formulation in FORMULATIONS:
                        states[formulation], seconds = _placed(scene, energy, formulation, tolerance)
                        times[formulation] += [seconds] if turn else []
                chained, mixed = (states[f] for f in FORMULATIONS)
                quick, slow = (statistics.median(times[f]) for f in FORMULATIONS)
                ratios.append(slow / quick)
                sizes = " / ".join(str(states[f].problem.lengths.size) for f in FORMULATIONS)
                codes = " / ".join(dict.fromkeys(states[f].status.code for f in FORMULATIONS))
                rows.append([
                    name, energy, f"{tolerance:g}", sizes, codes, f"{distance(chained, mixed):.1e}",
                    f"{1e3 * quick:.0f}", f"{1e3 * slow:.0f}", f"{ratios[-1]:.1f}",
                ])  # fmt: skip
                print(" ".join(rows[-1]), flush=True)
                energies.append(chained.energy.total)
                sizes_found.append(chained.problem.lengths.size)
            error = abs(energies[0] - energies[-1])
            numbers[f"energy_{name}_{energy}"] = Number(energies[0], error, "D w / l", ".6g")
            numbers[f"segments_{name}_{energy}"] = Number(sizes_found[0], 0, shown="d")
    return rows, ratios, numbers


def run(out: Path) -> dict[str, Number]:
    """Writes placed.md."""
    rows, ratios, numbers = one_core.call(_measured)
    heads = [
        "scene", "energy", "tolerance", "segments", "status", "apart (l)", "chained (CPU ms)", "mixed (CPU ms)",
        "ratio",
    ]  # fmt: skip
    page.write(
        out / "placed.md", "Segments placed by a tolerance, chained and glued", "python -m tests.validation placed",
        "`solve_to_tolerance` on ribbons held at s = 0, in the chained unknowns (its own choice) and in the mixed "
        "model; medians in turn. Segments: chained / mixed; apart: Hausdorff distance of the two states.",
        page.table(heads, rows),
        f"Mixed over chained: {min(ratios):.1f} to {max(ratios):.1f}, median {np.median(ratios):.1f}.",
    )  # fmt: skip
    why = "CPU times of one run"
    return numbers | {
        "runs": Number(len(rows), 0, shown="d"),
        "scenes": Number(len(SCENES), 0, shown="d"),
        "ratio": Number(float(np.median(ratios)), None, shown=".1f", why=why),
        "ratio_least": Number(min(ratios), None, shown=".1f", why=why),
        "ratio_most": Number(max(ratios), None, shown=".1f", why=why),
    }
