"""From a scene to the solvers of this process: the ribbon, and the elastica where the scene is planar."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from compare.errors import BadInput
from compare.scene import Scene
from ribbon import Clamp, Equilibrium, Gravity, Strip, solve
from shellref.elastica import ElasticaProblem, ElasticaResult, embed, embed_frames, to_plane
from shellref.elastica import solve as solve_elastica

FloatArray = NDArray[np.float64]
Progress = Callable[[str], None]
T = TypeVar("T")

#: The energy behind "auto", and beside an elastica: the one that is exact in the width (thesis, eq. 2.11).
AUTO_ENERGY = "wunderlich"
#: A repeated solve is timed up to REPEATS times, while that takes less than REPEAT_BUDGET seconds; the median counts.
REPEATS = 5
REPEAT_BUDGET = 2.0


def ribbon_energy(scene: Scene) -> str:
    """The energy the ribbon uses: the scene's own, "wunderlich" for "auto" and beside an elastica."""
    return AUTO_ENERGY if scene.model.energy in ("auto", "elastica") else scene.model.energy


def ribbon_strip(scene: Scene) -> Strip:
    """The scene's strip with l = 1."""
    return Strip(
        length=1.0,
        width=scene.width,
        poisson=scene.strip.poisson,
        natural_curvature=scene.curvature,
        gamma=scene.gamma,
    )


def ribbon_clamp(scene: Scene) -> Clamp:
    """The scene's clamp at s = 0, position in units of l."""
    frame = scene.frame
    return Clamp(scene.position, tangent=frame[:, 2], normal=frame[:, 1], ruling=scene.clamp_start.ruling)


def ribbon_gravity(scene: Scene) -> Gravity | None:
    """The weight's direction, or None for a weightless scene: the term is then absent."""
    return None if scene.up is None or not scene.gamma else Gravity(up=scene.up)


def _timed(once: Callable[[], T]) -> tuple[T, float, float]:
    """The result, the time of the first call (s) and the median time of repeated calls (s)."""
    clock = time.perf_counter()
    result = once()
    first = time.perf_counter() - clock
    times: list[float] = []
    while not times or (len(times) < REPEATS and sum(times) < REPEAT_BUDGET):
        clock = time.perf_counter()
        once()
        times.append(time.perf_counter() - clock)
    return result, first, statistics.median(times)


@dataclass(frozen=True)
class RibbonRun:
    """A ribbon solve with its times in s.

    first: the first solve in this process, loading (or compiling) the kernels included; warm: median of repeats.
    """

    equilibrium: Equilibrium
    first: float
    warm: float


def run_ribbon(scene: Scene, progress: Progress | None = None) -> RibbonRun:
    """Solves the scene's ribbon from its seed, and again for the warm time."""
    energy = ribbon_energy(scene)
    segments = np.asarray(scene.model.lengths)
    if progress:
        progress(f"ribbon: {energy}, {segments.size} segments")
    return RibbonRun(
        *_timed(
            lambda: solve(
                ribbon_strip(scene),
                ribbon_clamp(scene),
                ribbon_gravity(scene),
                energy=energy,
                segments=segments,
                seed_curvature=scene.seed_curvature,
                seed_ruling=scene.seed.ruling,
            )
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


def run_elastica(scene: Scene, progress: Progress | None = None) -> ElasticaRun:
    """Solves a planar scene as an elastica in theta(s); `BadInput` names what breaks planarity otherwise."""
    reason = scene.nonplanar_reason()
    if reason:
        raise BadInput("model.energy", "elastica", f"is planar, but {reason}", 'choose "wunderlich" or turn the clamp')
    if progress:
        progress("elastica: the scene is planar")
    up, gamma = (0.0, 1.0), 0.0
    if scene.up is not None and scene.gamma:
        plane, _ = to_plane(scene.frame, scene.up)
        norm = float(np.hypot(*plane))
        up, gamma = (plane[0] / norm, plane[1] / norm), scene.gamma
    problem = ElasticaProblem(gamma=gamma, up=up, curvature=scene.curvature)
    _, first, warm = _timed(lambda: solve_elastica(problem, estimate_error=False))
    return ElasticaRun(solve_elastica(problem), np.asarray(scene.position), scene.frame, first, warm)
