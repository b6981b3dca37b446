"""What `ribbonbench cost` measures and what it found, as data. Lengths in l, times in s."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.measure.front import Mark
from compare.models.ribbon_run import RibbonRun
from compare.scene.scene import Scene
from compare.studies.compare import Grid
from compare.studies.cost_runs import Run

FloatArray = NDArray[np.float64]

SOLVERS = ("chained", "mixed", "placed", "elastica", "shell")
REFERENCES = ("shell", "ribbon", "elastica", "own")
SEGMENTS = (5, 10, 20, 40, 80, 160, 320)
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5)
ELASTICA_ELEMENTS = (5, 10, 20, 40, 80)
DEGREES = (1, 2, 3)
MESHES = ((25, 2), (50, 4), (100, 4), (100, 8))
TARGETS = (1e-2, 1e-3, 1e-4)
#: Seconds after which no new run is begun.
BUDGET = 180.0


@dataclass(frozen=True)
class Plan:
    """What is measured. segments: of the ribbons; meshes: (along, across) of the shells of `ratio` = w/h (None: no
    shell); targets: errors (l) whose times are asked for; reference: of `REFERENCES`; compilation: also from an empty
    cache of compiled code."""

    solvers: tuple[str, ...] = SOLVERS
    segments: tuple[int, ...] = SEGMENTS
    tolerances: tuple[float, ...] = TOLERANCES
    elastica_elements: tuple[int, ...] = ELASTICA_ELEMENTS
    degrees: tuple[int, ...] = DEGREES
    meshes: tuple[tuple[int, int], ...] = MESHES
    ratio: float | None = None
    reference: str = "shell"
    targets: tuple[float, ...] = TARGETS
    repeats: int = 3
    budget: float = BUDGET
    leave_saddle: bool = False
    compilation: bool = False


@dataclass(frozen=True)
class Reference:
    """A fine solution of one model ("ribbon", "elastica", "shell"): what it is, its surface (k, m, 3) and its own error
    (Hausdorff / l) by the comparison that `checked` names; None where that did not converge."""

    model: str
    what: str
    points: FloatArray
    error: float | None
    checked: str


@dataclass(frozen=True)
class Row:
    """A run with its errors over l: Hausdorff (`error`, `distance`) and of the end point (`error_end`, `distance_end`);
    None where there is no surface or no reference. shown: the error is above the reference's own; `distance_shown`: the
    same of the common one."""

    run: Run
    model: str
    error: float | None
    error_end: float | None
    shown: bool | None
    distance: float | None
    distance_end: float | None
    distance_shown: bool | None

    @property
    def label(self) -> str:
        """Solver and size."""
        solver, _, degree = self.run.solver.partition(" ")
        return f"{solver} {self.run.label}" + (f" of degree {degree}" if degree else "")


@dataclass(frozen=True)
class Start:
    """First calls in fresh processes: seconds (s) beyond the warm solve, medians; compiled: the same with everything to
    be compiled, None when not measured."""

    solver: str
    seconds: float
    compiled: float | None


@dataclass(frozen=True)
class Cost:
    """A finished measurement; left_out: sentences about what was not run; common: the common reference or None."""

    scene: Scene
    plan: Plan
    base: RibbonRun
    grid: Grid
    rows: tuple[Row, ...]
    references: tuple[Reference, ...]
    common: Reference | None
    starts: tuple[Start, ...]
    left_out: tuple[str, ...]
    machine: dict[str, Any]

    @property
    def ok(self) -> bool:
        """The scene's ribbon is stable and every model has a reference with a known error."""
        known = all(reference.error is not None for reference in self.references)
        wanted = {row.model for row in self.rows}
        return self.base.equilibrium.ok and known and wanted == {r.model for r in self.references} and bool(wanted)

    def marks(self, model: str | None = None, common: bool = False) -> list[Mark]:
        """The converged runs of a model (None: of all) as marks; common: by distance instead of error.

        An error below its reference's own counts as that (nothing finer is known). A distance counts at least as much
        as the run's own discretisation error: a coarse run may be near another model by accident.
        """
        found = []
        for row in self.rows:
            value = row.distance if common else row.error
            own = self.common if common else self.reference_of(row.model)
            if not row.run.ok or value is None or row.run.warm is None or own is None or own.error is None:
                continue
            if common:
                value = max(value, row.error or 0.0)
            if model is None or row.model == model:
                found.append(Mark(row.label, row.run.warm, max(value, own.error, 1e-15)))
        return found

    def reference_of(self, model: str) -> Reference | None:
        """The model's own reference."""
        return next((r for r in self.references if r.model == model), None)


def model_of(solver: str) -> str:
    """The model ("ribbon", "elastica", "shell") that a solver discretises."""
    return solver.split()[0] if solver.startswith(("elastica", "shell")) else "ribbon"
