"""From a scene to the solvers of this process: the ribbon, and the elastica where the scene is planar."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from compare.build import (
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
from compare.errors import BadInput
from compare.scene import Scene
from compare.way import Way, run_way
from ribbon import Equilibrium, solve
from ribbon.adaptive import solve_to_tolerance
from shellref.elastica import ElasticaProblem, ElasticaResult, embed, embed_frames, to_plane
from shellref.elastica import solve as solve_elastica

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

FloatArray = NDArray[np.float64]
Progress = Callable[[str], None]
T = TypeVar("T")

#: A repeated solve is timed up to REPEATS times, while that takes less than REPEAT_BUDGET seconds; the median counts.
REPEATS = 5
REPEAT_BUDGET = 2.0


def _timed(once: Callable[[], T], repeat: bool = True) -> tuple[T, float, float]:
    """The result, the time of the first call (s) and the median time of repeated calls (s), at least one of them;
    without `repeat` the first time again."""
    clock = time.perf_counter()
    result = once()
    first = time.perf_counter() - clock
    return result, first, _repeated(once) if repeat else first


def _repeated(once: Callable[[], object]) -> float:
    """Median time (s) of calls, repeated within the budget."""
    times: list[float] = []
    while not times or (len(times) < REPEATS and sum(times) < REPEAT_BUDGET):
        clock = time.perf_counter()
        once()
        times.append(time.perf_counter() - clock)
    return statistics.median(times)


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
        warm = _repeated(lambda: run_way(scene, leave_saddle=leave_saddle)) if again else first
        return RibbonRun(way.equilibrium, first, warm, way)
    arguments = ribbon_arguments(scene)
    if tolerance is None:
        return RibbonRun(*_timed(lambda: solve(**arguments, leave_saddle=leave_saddle), repeat))
    del arguments["segments"]
    first_three = [arguments.pop(name) for name in ("strip", "clamp", "gravity")]
    return RibbonRun(
        *_timed(
            lambda: solve_to_tolerance(*first_three, **arguments, tolerance=tolerance, leave_saddle=leave_saddle),
            repeat,
        )
    )


@dataclass(frozen=True)
class ElasticaRun:
    """An elastica solve put into space (clamp at `position` (3,), `frame` (3, 3)), times in s."""

    result: ElasticaResult
    position: FloatArray
    frame: FloatArray
    first: float
    warm: float

    def centreline(self, s: FloatArray) -> FloatArray:
        """Positions (k, 3) at abscissae s (k,), units of l."""
        return embed(self.result, self.position, self.frame, s)

    def frames(self, s: FloatArray) -> FloatArray:
        """Material frames (k, 3, 3) at abscissae s (k,)."""
        return embed_frames(self.result, self.frame, s)


def elastica_problem(scene: Scene) -> ElasticaProblem:
    """The elastica's problem of a planar scene; `BadInput` names what breaks planarity otherwise."""
    reason = scene.nonplanar_reason()
    if reason:
        raise BadInput("model.energy", "elastica", f"is planar, but {reason}", 'choose "wunderlich" or turn the clamp')
    up, gamma = (0.0, 1.0), 0.0
    if scene.up is not None and scene.gamma:
        plane, _ = to_plane(scene.frame, scene.up)
        norm = float(np.hypot(*plane))
        up, gamma = (plane[0] / norm, plane[1] / norm), scene.gamma
    return ElasticaProblem(gamma=gamma, up=up, curvature=scene.curvature)


def run_elastica(scene: Scene, progress: Progress | None = None) -> ElasticaRun:
    """Solves a planar scene as an elastica in theta(s); `BadInput` names what breaks planarity otherwise."""
    problem = elastica_problem(scene)
    if progress:
        progress("elastica: the scene is planar")
    _, first, warm = _timed(lambda: solve_elastica(problem, estimate_error=False))
    return ElasticaRun(solve_elastica(problem), np.asarray(scene.position), scene.frame, first, warm)
