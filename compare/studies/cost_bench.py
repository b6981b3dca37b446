"""A measurement of `ribbonbench cost` under way: references, ladders of sizes, first calls, within a budget of time."""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from compare.measure.grid import Grid
from compare.models import RICHEST, home
from compare.models.base import BESIDE, Model, Options, Shape, Size, check_keys
from compare.models.choice import beside_the_shell, third_opinion
from compare.models.reference import reference
from compare.scene.scene import Scene
from compare.store.progress import Reporter
from compare.store.provenance import software
from compare.store.shared import shared_store
from compare.studies.cost_plan import Entry, Plan, Reference, Start, family
from compare.studies.cost_runs import CachedRun, Finest, Run, finest, run_of, together
from compare.studies.cost_start import request, seconds_of_first
from ribbonbench.errors import BadInput

#: How many times longer than the last size of a ladder the next one may take, all its repetitions together.
GROWTH = 8.0


class _Within(Reporter):
    """What a model says while it is timed: details of the step that the measurement is at."""

    def __init__(self, outer: Reporter) -> None:
        super().__init__(quiet=True)
        self._outer = outer

    def step(self, text: str) -> None:
        self._outer.detail(text)

    def detail(self, text: str) -> None:
        self._outer.detail(text)


class Bench:
    """A measurement under way. base: the state of the model beside the shells, as the scene asks for it."""

    def __init__(self, scene: Scene, plan: Plan, kept: CachedRun, reporter: Reporter, began: float) -> None:
        self.scene, self.plan, self.kept, self.reporter, self.began = scene, plan, kept, reporter, began
        self.left_out: list[str] = []
        #: Models whose every solve is a process of its own, known from their references.
        self.apart: set[str] = set()
        beside = beside_the_shell(scene)
        check_keys(beside, scene)
        self.base = beside.solve(scene, options=Options(leave_saddle=plan.leave_saddle, repeats=None), say=reporter)
        self.grid = Grid.for_shape(scene, self.base.shape.bend if self.base.shape is not None else 1.0)
        self.surface = None if self.base.shape is None else self.grid.of(self.base.shape)
        third = third_opinion(scene, beside)
        self._beside = beside.name
        self._third = None if third is None else third.name
        self._key = [scene.canonical(), plan.leave_saddle, self.grid.s.size, self.grid.v.size]

    @property
    def _left(self) -> float:
        return self.plan.budget - (time.perf_counter() - self.began)

    def near(self, model: Model) -> Shape | None:
        """The shape near which a model begins, as in `compare.studies.compare.compare`: that of `base`, for the shell
        and the third opinion always, for every other model where the scene may have several equilibria."""
        if model.name == self.base.model or not self.base.ok:
            return None
        return self.base.shape if model.name in (self._third, RICHEST) or self._several else None

    @property
    def _several(self) -> bool:
        return self.scene.several_equilibria or bool(self.plan.leave_saddle) or self.base.left_saddle is not None

    def _options(self, model: Model, **more: Any) -> Options:
        """selects: the shell of a scene with one equilibrium finds its own."""
        leave = self.plan.leave_saddle if model.name == self.base.model else None
        selects = self._several or model.name != RICHEST
        return Options(leave_saddle=leave, fallback=True, grid=self.grid, selects=selects, **more)

    def _parts(self, model: Model, scene: Scene, *parts: Any) -> list[Any]:
        """What determines a kept run, the sources of its model, of that of `base` and of this study included."""
        return [model.name, *parts, scene.canonical(), self._key, made_by(model.name, self._beside)]

    # -- references ---------------------------------------------------------------------------------------------------

    def reference(self, entries: Sequence[Entry]) -> tuple[Reference | None, Run | None]:
        """The reference of the model of these entries, and the run that it was checked on, where that is a size of a
        ladder with a time of its own."""
        one, scene = entries[0].model, entries[0].scene
        sizes = [size for entry in entries for size in entry.ladder.sizes]

        def make() -> Finest:
            options = self._options(one, store=shared_store(self.kept.root.parent))
            found = reference(one, scene, sizes, near=self.near(one), options=options, say=self.reporter)
            return finest(found, self.grid, self.surface)

        key = [[size.ladder, size.values, size.degree] for size in sizes]
        try:
            found = self.kept.finest(self._parts(one, scene, key), make)
        except BadInput as refused:
            self.left_out.append(f"the {one.name}'s reference: {refused}")
            return None, None
        if found.run.start is not None:
            self.apart.add(one.name)
        if not found.run.ok or found.run.points is None:
            said = ": ".join(text for text in (found.run.status, found.run.message) if text)
            self.left_out.append(f"the {one.name}'s reference ({found.run.label}) is {said}")
            return None, found.against
        return Reference(one.name, found.run.label, found.run.points, found.error, found.checked), found.against

    # -- ladders ------------------------------------------------------------------------------------------------------

    def ladder(self, entry: Entry) -> list[Run]:
        """All sizes of a ladder, small ones first. One model repeats every size at once; one whose every solve is a
        process of its own solves all sizes once, then again and again while the budget lasts."""
        name, repeats = entry.ladder.name, self.plan.repeats
        found: dict[Size, list[Run]] = {}
        self.reporter.step(f"{name}: {repeats} runs of each size")
        for number in range(repeats):
            for size in entry.ladder.sizes:
                if number and (size not in found or found[size][0].start is None):
                    continue
                label = f"{name} {size.label}"
                too_long = self._too_long(entry, size, found)
                if too_long is not None:
                    if number < 2:
                        once = f"timed once (budget of {self.plan.budget:g} s)"
                        self.left_out.append(f"{label}: {once if number else too_long}")
                    continue
                tell = self.reporter.step if entry.model.name in self.apart else self.reporter.detail
                tell(f"{label}, run {number + 1} of {repeats}")
                run = self._timed(entry, size, number)
                if run is None or (not number and _same(run, size, found)):
                    continue
                if run.start is not None:
                    self.apart.add(entry.model.name)
                found.setdefault(size, []).append(run)
        return [together(runs) for runs in found.values()]

    def _timed(self, entry: Entry, size: Size, number: int) -> Run | None:
        """Repetition `number` of a size; None where the model refuses that."""
        one, scene, repeats = entry.model, entry.scene, self.plan.repeats

        def make() -> Run:
            options = self._options(one, repeats=repeats)
            state = one.solve(scene, size, near=self.near(one), options=options, say=_Within(self.reporter))
            return run_of(state, size, self.grid, self.surface)

        key = [size.ladder, size.values, size.degree, number, repeats]
        try:
            return replace(self.kept.run(self._parts(one, scene, key), make), size=size)
        except BadInput as refused:
            self.left_out.append(f"{size.ladder} {size.label}: {refused}")
            return None

    def _too_long(self, entry: Entry, size: Size, found: dict[Size, list[Run]]) -> str | None:
        """Why a size is not run any more, from the times of others; None: it is run."""
        if entry.model.name in self.apart:
            return f"no time left of {self.plan.budget:g} s" if _predicted(size, found) > self._left else None
        last = next((runs[0] for runs in reversed(found.values()) if runs[0].warm is not None), None)
        if last is not None and last.warm is not None and GROWTH * last.warm > max(self._left, 0.0):
            return "it may take longer than what is left of the budget"
        return None

    # -- first calls --------------------------------------------------------------------------------------------------

    def starts(self, entries: Sequence[Entry], runs: Sequence[Run]) -> tuple[Start, ...]:
        """First calls of every family of ladders in fresh processes, beyond the warm solve of the same size."""
        found = []
        for name in dict.fromkeys(family(entry.ladder.name) for entry in entries):
            mine = [run for run in runs if family(run.solver) == name and run.warm is not None]
            values = [run.start for run in mine if run.start is not None]
            if values:
                found.append(Start(name, float(np.median(values)), None))
            elif mine:
                start = self._start(name, entries, mine[0])
                found += [] if start is None else [start]
        return tuple(found)

    def _start(self, name: str, entries: Sequence[Entry], run: Run) -> Start | None:
        """The first calls of the family `name`, at the size of `run`."""
        if self.scene.path:
            self.left_out.append(f"first calls of {name}: the scene's [[path]] is gone in each of them")
            return None
        if run.begun.startswith(BESIDE):
            self.left_out.append(
                f"first calls of {name}: it begins at the shape of another model, which has to be there"
            )
            return None
        entry = next(entry for entry in entries if entry.ladder.name == run.solver)
        assert run.size is not None
        requested = request(entry.scene, entry.model.name, run.size)
        self.reporter.step(f"{name}: first calls in fresh processes")
        seconds = [seconds_of_first(requested) for _ in range(self.plan.repeats)]
        good = [s for s in seconds if s is not None]
        if not good:
            return None
        compiled = None
        if self.plan.compilation:
            self.reporter.step(f"{name}: a first call that compiles everything")
            with tempfile.TemporaryDirectory(prefix="ribbonbench-cache-") as cache:
                compiled = seconds_of_first(requested, Path(cache))
        warm = run.warm or 0.0
        return Start(name, float(np.median(good)) - warm, None if compiled is None else compiled - warm)


def made_by(*models: str) -> dict[str, Any]:
    """What stands for versions and sources in the key of a run that these models make."""
    return software(*sorted({__name__, *map(home, models)}))


def _predicted(size: Size, found: dict[Size, list[Run]]) -> float:
    """Seconds that a process with this size may take: as it did, or in proportion to the values of another size."""
    for known in (size, *reversed(found)):
        if known in found and found[known][0].start is not None:
            run = found[known][0]
            return (run.seconds[0] + (run.start or 0.0)) * math.prod(size.values) / math.prod(known.values)
    return 0.0


def _same(run: Run, size: Size, found: dict[Size, list[Run]]) -> bool:
    """Whether a size whose meaning the run has found out (segments for a tolerance) is the last one again."""
    last = next(reversed(found.values()), None)
    return last is not None and run.label != size.label and run.unknowns == last[0].unknowns
