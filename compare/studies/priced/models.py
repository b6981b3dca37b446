"""What accuracy costs among all models that read a scene: total error against time, within a minute.

The total error of a run is its distance (Hausdorff over l) to the finest shell and that shell's own error: together
they bound the distance to what the shell stands for. Every value of `model.energy` whose model reads the scene takes
part on a few sizes, warm; the shell on its meshes, beside the scene's own state, as `compare` has it. Finished shells
are kept, so that an interrupted measurement goes on.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.measure.align import aligned
from compare.measure.distance import grid_hausdorff
from compare.measure.grid import Grid
from compare.models import RICHEST, model
from compare.models.base import Model, Options, Shape, Size, State, check_keys
from compare.models.choice import beside_the_shell, chosen
from compare.registry import energies
from compare.scene.scene import Scene
from compare.store.progress import Reporter
from compare.store.shared import shared_store
from compare.studies.cost_plan import FAR, TARGETS
from compare.studies.cost_runs import machine
from ribbonbench.errors import BadInput

FloatArray = NDArray[np.float64]

#: Places on a model's ladder of usual sizes that are run (10, 20, 40 segments).
SIZES = slice(1, 4)
#: Energies that are measured first: those among which an accuracy chooses.
FIRST = ("sadowsky", "wunderlich", "finite")
#: Timed solves of a size beside the first, time (s) of one from which it is timed once, and CPU time of all lines.
REPEATS, LONG, BUDGET = 5, 0.5, 20.0
#: Meshes of the shell, small ones first.
MESHES = ((25, 2), (50, 4), (100, 8))
#: The value of `model.energy` that leaves the choice to the model: another value's model again.
_AUTO = "auto"


@dataclass(frozen=True)
class Timed:
    """One model on one size. name: the value of `model.energy`, or the shell; error: total, over l, None: no surface;
    seconds, spread: of a warm solve, the fastest, and how far the median is above it (None: timed once), s."""

    name: str
    size: str
    unknowns: int
    status: str
    ok: bool
    error: float | None
    seconds: float
    spread: float | None

    @property
    def far(self) -> bool:
        """Another state than the shell's, or no model of the scene."""
        return self.error is None or self.error > FAR


@dataclass(frozen=True)
class ModelCosts:
    """All runs; finest: the shell to which errors are measured, error: its own (Hausdorff / l); base: the scene's own
    state; left_out: model -> why; machine: what the times belong to."""

    scene: Scene
    base: State
    ratio: float
    rows: tuple[Timed, ...]
    finest: str
    error: float
    left_out: Mapping[str, str]
    machine: Mapping[str, Any]
    targets: tuple[float, ...] = TARGETS

    def reached(self, target: float) -> Timed | None:
        """The fastest run within a total error; None: none is."""
        good = [row for row in self.rows if row.ok and row.error is not None and row.error <= target]
        return min(good, key=lambda row: row.seconds, default=None)

    @property
    def best(self) -> tuple[Timed, ...]:
        """Of every model its most accurate run, the fastest where several are alike within a twentieth."""
        found = []
        for name in dict.fromkeys(row.name for row in self.rows):
            mine = [row for row in self.rows if row.name == name and row.ok and row.error is not None]
            if mine:
                least = min(row.error or 0.0 for row in mine)
                found.append(min((r for r in mine if (r.error or 0.0) <= 1.05 * least), key=lambda r: r.seconds))
        return tuple(sorted(found, key=lambda row: row.error or 0.0))


def measure_models(scene: Scene, ratio: float, folder: Path, reporter: Reporter) -> ModelCosts:
    """Solves and times them all for the shell of this w/h.

    Raises `BadInput` for a scene that its own model or the shell refuses, or whose finest shell has no known error.
    """
    scene = scene.replace({"shell.width_to_thickness": [ratio]})
    beside = beside_the_shell(scene)
    check_keys(beside, scene)
    base = beside.solve(scene, options=Options(repeats=0), say=reporter)
    grid = Grid.for_shape(scene, base.shape.bend if base.shape is not None else 1.0)
    store = shared_store(folder)
    shell: Model = model(RICHEST)
    several = scene.several_equilibria or base.left_saddle is not None
    shells: list[State] = []
    for number, mesh in enumerate(MESHES):
        finest = number == len(MESHES) - 1
        words = ", the finest, with its error" if finest else ""
        reporter.step(f"waits for the shell, {mesh[0]} x {mesh[1]} elements{words}")
        options = Options(error=finest, store=store, grid=grid, fallback=True, selects=several)
        near: Shape | None = base.shape if base.ok else None
        size = Size(RICHEST, tuple(float(n) for n in mesh))
        shells.append(shell.solve(scene, size, near=near, options=options, say=reporter))
    last = shells[-1]
    if not last.ok or last.shape is None or last.error is None:
        raise BadInput(
            "shell.width_to_thickness", ratio, f"has no state with a known error: {last.message}",
            "ribbonbench compare says more; ribbonbench cost --reference own measures without a shell",
        )  # fmt: skip
    points = grid.of(last.shape)
    lines, left_out = _lines(scene, grid, points, last.error, reporter)
    rows = [*lines, *(_timed(RICHEST, state, grid, points, last.error) for state in shells)]
    what = f"{MESHES[-1][0]} x {MESHES[-1][1]} elements, w/h = {ratio:g}"
    return ModelCosts(scene, base, ratio, tuple(rows), what, last.error, left_out, machine())


def _lines(
    scene: Scene, grid: Grid, points: FloatArray, own: float, reporter: Reporter
) -> tuple[list[Timed], dict[str, str]]:
    """Every model of a line that reads the scene, on its sizes, and why others do not."""
    begun = time.process_time()
    found: list[Timed] = []
    left_out: dict[str, str] = {}
    for energy in sorted((e for e in energies() if e != _AUTO), key=lambda e: (e not in FIRST, e)):
        keys: dict[str, Any] = {"model.energy": energy, "model.accuracy": None, "model.tolerance": None}
        try:
            other = scene.replace(keys)
            one = chosen(other)
            check_keys(one, other)
            sizes = next((ladder.sizes for ladder in one.ladders(other) if ladder.sizes), ())[SIZES]
            reporter.step(f"{energy}: {len(sizes)} sizes")
            for size in sizes:
                if time.process_time() - begun > BUDGET:
                    left_out.setdefault(energy, f"not all sizes: {BUDGET:g} s of CPU time for all lines were over")
                    break
                state = one.solve(other, size, options=Options(repeats=0))
                if state.is_equilibrium and state.seconds.first < LONG:
                    state = one.solve(other, size, options=Options(repeats=REPEATS))
                found.append(_timed(energy, state, grid, points, own))
        except BadInput as refused:
            left_out[energy] = str(refused)
    return found, left_out


def _timed(name: str, state: State, grid: Grid, points: FloatArray, own: float) -> Timed:
    """A state as a row. points (k, m, 3): the finest shell's surface, own: its error."""
    error = None
    if state.shape is not None and state.is_equilibrium:
        error = grid_hausdorff(aligned(grid.of(state.shape), points, state.motions), points) + own
    times = state.seconds.repeats or (state.seconds.first,)
    least = float(min(times))
    spread = float(np.median(times)) - least if len(times) > 1 else None
    return Timed(name, state.size.label, state.unknowns, state.word, state.ok, error, least, spread)
