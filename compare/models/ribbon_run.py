"""From a scene to the ribbon in this process; the elastica of a planar scene: `compare.models.elastica_run`."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from compare.models.elastica_run import ElasticaRun, elastica_problem, run_elastica
from compare.models.ribbon_build import (
    AUTO_ENERGY,
    build_arguments,
    check_model,
    ribbon_arguments,
    ribbon_clamp,
    ribbon_closure,
    ribbon_end,
    ribbon_energy,
    ribbon_gravity,
    ribbon_problem,
    ribbon_strip,
    ribbon_walls,
)
from compare.models.ribbon_way import Way, run_way
from compare.models.timing import REPEAT_BUDGET, repeated, timed
from compare.scene.scene import Scene
from ribbon import Equilibrium, solve
from ribbon.find.adaptive import solve_to_tolerance

__all__ = [
    "AUTO_ENERGY",
    "ElasticaRun",
    "RibbonRun",
    "build_arguments",
    "elastica_problem",
    "ribbon_arguments",
    "ribbon_clamp",
    "ribbon_closure",
    "ribbon_end",
    "ribbon_energy",
    "ribbon_gravity",
    "ribbon_problem",
    "ribbon_strip",
    "ribbon_walls",
    "run_elastica",
    "run_ribbon",
]

Progress = Callable[[str], None]


@dataclass(frozen=True)
class RibbonRun:
    """A ribbon solve with its times in s, and the way there of a scene with a path.

    first: the first solve in this process, loading (or compiling) the kernels included; warm: median of repeats. For a
    path both are of the whole way, from the first stage's seed; one that took longer than the budget for repeats is not
    gone again, `warm` is then `first`. (Solving the last problem again from its own solution would flatter.)
    """

    equilibrium: Equilibrium
    first: float
    warm: float
    way: Way | None = None


def run_ribbon(
    scene: Scene,
    progress: Progress | None = None,
    *,
    leave_saddle: bool = False,
    folder: Path | None = None,
    detail: Progress | None = None,
    repeat: bool = True,
) -> RibbonRun:
    """Solves the scene's ribbon from its seed, or along its path, and again for the warm time.

    leave_saddle: follow the unstable direction of a saddle to a stable state. folder: where the state of an interrupted
    path is kept and found again. progress, detail: told what is being done, and where it is. repeat: False leaves the
    repeated solves out, `warm` is then `first`.
    """
    check_model(scene)
    energy, tolerance = ribbon_energy(scene), scene.model.tolerance
    size = f"tolerance {tolerance:g}" if tolerance is not None else f"{len(scene.model.lengths)} segments"
    if progress:
        progress(f"ribbon: {energy}, {size}" + (f", {len(scene.path) + 1} stages" if scene.path else ""))
    if scene.path:
        clock = time.perf_counter()
        way = run_way(scene, folder, leave_saddle=leave_saddle, progress=detail)
        first = time.perf_counter() - clock
        again = repeat and first < REPEAT_BUDGET and not way.resumed
        warm = repeated(lambda: run_way(scene, leave_saddle=leave_saddle)) if again else first
        return RibbonRun(way.equilibrium, first, warm, way)
    arguments = ribbon_arguments(scene)
    if tolerance is None:
        return RibbonRun(*timed(lambda: solve(**arguments, leave_saddle=leave_saddle), repeat))
    del arguments["segments"]
    first_three = [arguments.pop(name) for name in ("strip", "clamp", "gravity")]
    return RibbonRun(
        *timed(
            lambda: solve_to_tolerance(*first_three, **arguments, tolerance=tolerance, leave_saddle=leave_saddle),
            repeat,
        )
    )
