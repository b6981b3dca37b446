"""What `ribbonbench cost` measures and what it found, as data. Lengths in l, times in s."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.measure.front import Mark
from compare.measure.grades import FAIR_FACTOR, GOOD_UP_TO
from compare.measure.grid import Grid
from compare.models import RICHEST, USUAL, model, names
from compare.models.base import NEAR, Ladder, Model, Size, State, check_keys
from compare.models.quantities.ladders import GIVEN
from compare.scene.scene import Scene
from compare.studies.cost_runs import Run
from ribbonbench.errors import BadInput

FloatArray = NDArray[np.float64]

TARGETS = (1e-2, 1e-3, 1e-4)
#: Seconds after which no new run is begun.
BUDGET = 180.0
#: Distance (l) to the common reference from which a model is another one than the scene's, or in another state: it is
#: named and left out of fronts and times.
FAR = FAIR_FACTOR * GOOD_UP_TO["distance"]
#: In place of a common reference.
OWN = "own"


@dataclass(frozen=True)
class Plan:
    """What is measured. solvers: families of ladders (empty: all that the scene allows); segments, tolerances,
    elastica_elements, meshes: sizes of the ladders in `GIVEN` (None: the model's usual ones); ratio: w/h of the shells
    (None: the scene's); targets: errors (l) whose times are asked for; reference: the common one, a model's name or
    `OWN` for none; compilation: also first calls from an empty cache of compiled code."""

    solvers: tuple[str, ...] = ()
    segments: tuple[int, ...] | None = None
    tolerances: tuple[float, ...] | None = None
    elastica_elements: tuple[int, ...] | None = None
    meshes: tuple[tuple[int, int], ...] | None = None
    ratio: float | None = None
    reference: str = RICHEST
    targets: tuple[float, ...] = TARGETS
    repeats: int = 3
    budget: float = BUDGET
    leave_saddle: bool | None = None
    compilation: bool = False


def family(ladder: str) -> str:
    """The name by which `--solvers` chooses a ladder: "elastica" is that of "elastica 1" and "elastica 2"."""
    return ladder.split()[0]


def families(scene: Scene) -> tuple[str, ...]:
    """Those of all ladders of all models, whether the scene allows them or not."""
    return tuple(dict.fromkeys(family(ladder.name) for name in names() for ladder in model(name).ladders(scene)))


@dataclass(frozen=True)
class Entry:
    """A ladder that is measured: its model, the model's own scene, and the ladder with the plan's sizes."""

    model: Model
    scene: Scene
    ladder: Ladder


def chosen(scene: Scene, plan: Plan) -> tuple[tuple[Entry, ...], tuple[str, ...]]:
    """The ladders of the plan's solvers that the scene allows, and why others are left out.

    A model that would ignore a key of the scene is left out, as `ribbonbench solve` refuses it. Of a model that a scene
    asks several solves of the last one counts. Raises `BadInput` where none is left.
    """
    requested = scene if plan.ratio is None else scene.replace({"shell.width_to_thickness": [plan.ratio]})
    found: list[Entry] = []
    why: dict[str, str] = {}
    for name in names():
        one: Model = model(name)
        ladders = [x for x in one.ladders(requested) if not plan.solvers or family(x.name) in plan.solvers]
        refused = _refused(one, requested) if any(ladder.sizes for ladder in ladders) else None
        for ladder in ladders:
            reason = ladder.why if not ladder.sizes else None if refused is None else str(refused)
            if ladder.sizes and refused is None:
                found.append(Entry(one, one.variants(requested)[-1].scene, sized(ladder, plan)))
            elif reason is not None:
                why.setdefault(family(ladder.name), f"{family(ladder.name)}: {reason}")
    if not found:
        wanted = plan.solvers or families(requested)
        raise BadInput("--solvers", ", ".join(wanted), f"none can solve the scene ({'; '.join(why.values())})")
    return tuple(found), tuple(why.values())


def _refused(one: Model, scene: Scene) -> BadInput | None:
    """Why a model is not for a scene (`check_keys`); None: it is."""
    try:
        check_keys(one, scene)
    except BadInput as refused:
        return refused
    return None


def sized(ladder: Ladder, plan: Plan) -> Ladder:
    """The ladder with the sizes that the plan gives for it, small ones first."""
    name = GIVEN.get(family(ladder.name))
    given: Sequence[Any] | None = None if name is None else getattr(plan, name)
    if given is None:
        return ladder
    values = [tuple(float(x) for x in value) if isinstance(value, tuple) else (float(value),) for value in given]
    values.sort(key=lambda v: float(np.prod(v)), reverse=name == "tolerances")
    degree = ladder.sizes[0].degree
    return replace(ladder, sizes=tuple(Size(ladder.name, value, degree) for value in dict.fromkeys(values)))


@dataclass(frozen=True)
class Reference:
    """A fine solution of one model: what it is, its surface (k, m, 3) and its own error (Hausdorff / l) by the
    comparison that `checked` names; None where that did not converge."""

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
    def near(self) -> bool:
        """Whether it began at the shape of `Cost.base`, as all of its ladder did."""
        return self.run.solver.endswith(f" {NEAR}")

    @property
    def label(self) -> str:
        """Solver and size."""
        solver, _, degree = self.run.solver.partition(" ")
        if self.near:
            return f"{solver} {self.run.label} {NEAR}"
        return f"{solver} {self.run.label}" + (f" of degree {degree}" if degree else "")


@dataclass(frozen=True)
class Party:
    """Whose times are compared: a model, and of one that was begun in two ways which (near: at the shape of `base`)."""

    model: str
    near: bool | None
    words: str


@dataclass(frozen=True)
class Start:
    """First calls in fresh processes: seconds (s) beyond the warm solve, medians; compiled: the same with everything to
    be compiled, None when not measured."""

    solver: str
    seconds: float
    compiled: float | None


@dataclass(frozen=True)
class Cost:
    """A finished measurement; base: the state of the model beside the shells, as the scene asks for it; left_out:
    sentences about what was not run; common: the common reference or None."""

    scene: Scene
    plan: Plan
    base: State
    grid: Grid
    rows: tuple[Row, ...]
    references: tuple[Reference, ...]
    common: Reference | None
    starts: tuple[Start, ...]
    left_out: tuple[str, ...]
    machine: dict[str, Any]

    @property
    def ok(self) -> bool:
        """The scene's own state is stable and every model has a reference with a known error."""
        known = all(reference.error is not None for reference in self.references)
        wanted = {row.model for row in self.rows}
        return self.base.ok and known and wanted == {r.model for r in self.references} and bool(wanted)

    @property
    def parties(self) -> tuple[Party, ...]:
        """The models in the order of their rows; one that was also begun at the shape of `base` is two."""
        found = []
        beside = USUAL if self.base is None else self.base.model
        for name in dict.fromkeys(row.model for row in self.rows):
            if len({row.near for row in self.rows if row.model == name}) > 1:
                found += [
                    Party(name, False, f"{name} on its own"),
                    Party(name, True, f"{name} from the {beside}'s surface"),
                ]
            else:
                found.append(Party(name, None, name))
        return tuple(found)

    def marks(self, model: str | None = None, common: bool = False, near: bool | None = None) -> list[Mark]:
        """The converged runs of a model (None: of all that are not `far`) as marks; common: by total error instead of
        that of the discretisation; near: those that began at the shape of `base` (False: the others).

        An error below its reference's own counts as that (nothing finer is known). The total error is the distance to
        the common reference and that one's own error, which bound together the distance to what it stands for; a
        distance counts at least as much as the run's own discretisation error: a coarse run may be near another model
        by accident.
        """
        found = []
        for row in self.rows:
            value = row.distance if common else row.error
            own = self.common if common else self.reference_of(row.model)
            if not row.run.ok or value is None or row.run.warm is None or own is None or own.error is None:
                continue
            if row.model in self.far:
                continue
            if common:
                value = max(value, row.error or 0.0) + own.error
            if (model is None or row.model == model) and near in (None, row.near):
                found.append(Mark(row.label, row.run.warm, max(value, own.error, 1e-15)))
        return found

    @property
    def far(self) -> dict[str, float]:
        """Models whose most accurate run is farther than `FAR` from the common reference, and how far (l)."""
        found: dict[str, float] = {}
        for name in dict.fromkeys(row.model for row in self.rows):
            rows = [r for r in self.rows if r.model == name and r.run.ok and r.distance is not None]
            best = min(rows, key=lambda r: math.inf if r.error is None else r.error, default=None)
            if self.common is not None and best is not None and (best.distance or 0.0) > FAR:
                found[name] = best.distance or 0.0
        return found

    def reference_of(self, model: str) -> Reference | None:
        """The model's own reference."""
        return next((r for r in self.references if r.model == model), None)
