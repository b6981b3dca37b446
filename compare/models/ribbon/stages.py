"""Going the way that a scene declares: its [[path]] stages one after another, then the scene itself, resumable.

The first stage is solved from its seed. Every leg to the next stage is a homotopy (`compare.scene.homotopy`): what
cannot vary continuously (a wall that appears, other segments) switches first, the rest then goes in steps
(`ribbon.find.continuation`). After every accepted step the state is kept in a file, so that an interrupted run goes on
where it was.
"""

from __future__ import annotations

import json
import time
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from compare.measure.load_curve import watched
from compare.models.drawn.begun import Landing, begun, followed
from compare.models.holds import friction
from compare.models.holds.touches import touches
from compare.models.ribbon.build import ribbon_arguments, ribbon_problem
from compare.models.ribbon.fields import fields
from compare.scene.change import value_of
from compare.scene.homotopy import Homotopy, between
from compare.scene.scene import Scene
from compare.store.arrays import npz_bytes
from compare.store.provenance import software
from compare.store.states import Film, States, states_of
from compare.store.store import atomic_write_bytes, case_key, jsonable
from ribbon import Equilibrium, Status, archive, solve
from ribbon.find.adaptive import refine_to_tolerance
from ribbon.find.continuation import StepRecord, anchored, follow, switch
from ribbon.find.solve import Problem
from ribbon.problems.friction.particles import Rub
from ribbon.problems.itself.pairs import Pair
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.touching import Touch
from ribbon.solvers.budget import within

Progress = Callable[[str], None]
OnStep = Callable[[dict[str, Any]], None]

#: The file of an unfinished way, in the folder of its results.
STATE_FILE = "path_state.npz"
#: Where on a leg that both switches and varies the switched scene is solved: as good as its start.
ENTRY = 1e-9
#: Where every leg is checked for impossible scenes before anything is solved.
CHECKED_AT = (ENTRY, 0.25, 0.5, 0.75)
#: What stands in every entry of the log, in order (`ribbon.find.continuation.StepRecord`, after the stage approached,
#: from 1); accepted ones have `moved`, `forces` and `moments` too.
COLUMNS = ("stage", *StepRecord.__dataclass_fields__)
_GOOD = (Status.CONVERGED, Status.SADDLE)


@dataclass(frozen=True)
class LoadPath:
    """A finished (or stopped) way: the equilibrium with the log of all steps, how many stages there are, the scene
    included, how many steps were solved in this run, rejected ones included, whether it went on from a file, and the
    states along it where they were asked for."""

    equilibrium: Equilibrium
    stages: int
    solved: int
    resumed: bool
    states: States | None = None


@dataclass(frozen=True)
class _Place:
    """Where a way stands: on the leg to `stage` (from 0; 0: the seed's) at t, with the log up to there."""

    stage: int
    t: float
    equilibrium: Equilibrium
    log: tuple[dict[str, Any], ...]


class _Keeper:
    """Keeps the last accepted step of a way in a file of `folder` (None: nothing is kept), under the key of the run."""

    def __init__(self, folder: Path | None, key: str) -> None:
        self.path = None if folder is None else folder / STATE_FILE
        self.key = key
        self.film: Film | None = None

    def save(self, place: _Place) -> None:
        """Writes the place atomically; arrays as they are, everything else as JSON text."""
        if self.path is None:
            return
        e = place.equilibrium
        about = {
            "key": self.key, "stage": place.stage, "t": place.t, "log": place.log, "touching": e.problem.touching,
            "pairs": e.problem.pairs if isinstance(e.problem, MixedProblem) else (),
            "rubs": e.problem.rubs if isinstance(e.problem, MixedProblem) else (),
        }  # fmt: skip
        arrays = {"place": np.array(json.dumps(about)), "lengths": e.problem.lengths}
        arrays |= {f"found_{name}": values for name, values in archive.pack(replace(e, before=None)).items()}
        states = None if self.film is None else self.film.states
        kept = {} if states is None else {f"state_{name}": values for name, values in states.arrays().items()}
        atomic_write_bytes(self.path, npz_bytes({**arrays, **kept}))

    def load(self, problem_of: Callable[[int, float], Problem]) -> _Place | None:
        """The place kept by an interrupted run of the same scene and sources; None: none, or unusable."""
        if self.path is None or not self.path.exists():
            return None
        try:
            with np.load(self.path, allow_pickle=False) as data:
                about = json.loads(str(data["place"]))
                lengths = data["lengths"]
                arrays = {name.removeprefix("found_"): data[name] for name in data.files if name.startswith("found_")}
                kept = {name.removeprefix("state_"): data[name] for name in data.files if name.startswith("state_")}
                states = states_of(kept) if kept else None
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error):
            return None
        if about.get("key") != self.key:
            return None
        problem = problem_of(about["stage"], about["t"])
        if about["touching"]:
            problem = problem.with_changes(touching=tuple(Touch(*touch) for touch in about["touching"]))
        if about.get("pairs") and isinstance(problem, MixedProblem):
            problem = problem.with_changes(pairs=tuple(Pair(*pair) for pair in about["pairs"]))
        if about.get("rubs") and isinstance(problem, MixedProblem):
            problem = problem.with_changes(rubs=tuple(Rub(*(_tuples(part) for part in rub)) for rub in about["rubs"]))
        if not np.array_equal(problem.lengths, lengths) or problem.size != arrays["x"].size:
            return None
        try:
            found: Equilibrium = archive.unpack(arrays, problem)
        except (KeyError, ValueError, TypeError):
            return None
        found = replace(found, problem=anchored(problem, found))
        if self.film is not None and states is not None:
            self.film = Film(2.0 * problem.half_width, states)
        return _Place(about["stage"], about["t"], found, tuple(about["log"]))

    def landing(self, say: Progress | None) -> Landing:
        """What keeps the way downhill of a drawn curve, beside the place."""
        return Landing(None if self.path is None else self.path.parent, self.key, say)

    def remove(self) -> None:
        """Forgets the place: the way is finished."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)
            self.landing(None).remove()


class _Walk:
    """One run along the stages of a scene."""

    def __init__(
        self, scene: Scene, keeper: _Keeper, leave_saddle: bool, progress: Progress | None, on_step: OnStep | None
    ) -> None:
        self.stages = scene.stages()
        self.steps = [None if k >= len(scene.path) else scene.path[k].steps for k in range(len(self.stages))]
        self.legs = [between(*pair) for pair in pairwise(self.stages)]
        self.keys = watched([key for stage in scene.path for key in stage])
        self.keeper, self.leave_saddle = keeper, leave_saddle
        self.progress, self.on_step = progress, on_step
        self.rubs = friction.rubs(scene)
        self.solved = 0
        for leg in self.legs:
            for t in CHECKED_AT:
                leg(t)

    def scene(self, stage: int, t: float) -> Scene:
        """The scene on the leg to `stage` at t (t = 0: where the leg begins, switched)."""
        return self.stages[0] if stage == 0 else self.legs[stage - 1](max(t, ENTRY))

    def problem(self, stage: int, t: float) -> Problem:
        """The ribbon's problem there."""
        scene = self.scene(stage, t)
        return ribbon_problem(scene, _formulation(scene))

    def at(self, stage: int) -> Callable[[float], Problem]:
        """The problems along the leg to `stage`."""
        return lambda t: self.problem(stage, t)

    def entry(self, stage: int, record: StepRecord, equilibrium: Equilibrium) -> dict[str, Any]:
        """The entry of the log of a step that was accepted: the values of the path's keys there, forces, moments."""
        entry = _entry(stage, asdict(record))
        return entry if not record.accepted else entry | _held(equilibrium, self.scene(stage, record.t), self.keys)

    def run(self) -> tuple[Equilibrium, bool]:
        """The last equilibrium with the whole log, and whether the way went on from a file."""
        place = self.keeper.load(self.problem)
        resumed = place is not None
        if place is None:
            place = self._seeded()
        elif self.progress is not None:
            self.progress(f"path: goes on from stage {place.stage + 1} of {len(self.stages)}, t = {place.t:.4g}")
        while place.equilibrium.status in _GOOD:
            if place.t < 1.0:
                place = self._followed(place)
            elif place.stage + 1 < len(self.stages):
                place = self._entered(place)
            else:
                break
        found = place.equilibrium
        if found.status not in _GOOD and len(self.stages) > 1:
            found = replace(found, message=f"stage {place.stage + 1} of {len(self.stages)}: {found.message}")
        return replace(found, log=place.log), resumed

    def _accept(self, place: _Place) -> _Place:
        """Keeps a place that a step reached, and says so."""
        entry = place.log[-1]
        self.solved += 1
        if place.equilibrium.status not in _GOOD:
            return place
        if self.keeper.film is not None:
            e = place.equilibrium
            film = self.keeper.film
            grid = np.column_stack([x.ravel() for x in np.meshgrid(film.s, film.v, indexing="ij")])
            points = e.rulings(grid)[1].reshape(film.s.size, film.v.size, 3)
            film.add(entry["stage"], entry["t"], points, fields(e, film.s, film.v), touches(e))
        self.keeper.save(place)
        if self.progress is not None:
            self.progress(f"path: stage {entry['stage']} of {len(self.stages)}, t = {entry['t']:.4g}")
        if self.on_step is not None:
            self.on_step(entry)
        return place

    def _solved(self, stage: int, t: float, equilibrium: Equilibrium, seconds: float) -> dict[str, Any]:
        """The entry of a solve that is no step of a continuation: the seed, or a switch."""
        record = StepRecord(
            t, t, equilibrium.status.code, equilibrium.status in _GOOD, equilibrium.iterations, equilibrium.residual,
            equilibrium.energy.total, equilibrium.lowest_eigenvalue, seconds, False,
        )  # fmt: skip
        return self.entry(stage, record, equilibrium)

    def _seeded(self) -> _Place:
        """The first stage, from its seed."""
        first = self.stages[0]
        clock = time.perf_counter()
        if first.seed.curve is not None:
            found = begun(first, self.leave_saddle, self.keeper.landing(self.progress))
        else:
            arguments = {**ribbon_arguments(first), "formulation": _formulation(first)}
            arguments["walls"] = tuple(replace(wall, friction=0.0) for wall in arguments["walls"])  # put there without
            found = solve(**arguments, leave_saddle=self.leave_saddle, budget=first.model.budget)
        entry = self._solved(0, 1.0, found, time.perf_counter() - clock)
        return self._accept(_Place(0, 1.0, found, (entry,)))

    def _entered(self, place: _Place) -> _Place:
        """The start of the next leg: what switches is switched; all of the leg where nothing varies."""
        stage = place.stage + 1
        leg: Homotopy = self.legs[stage - 1]
        if leg.continuous and not leg.switched:
            return replace(place, stage=stage, t=0.0)
        t = 0.0 if leg.continuous else 1.0
        if self.rubs and not leg.switched:  # what rubs stays as it lies
            return replace(place, stage=stage, t=1.0)
        clock = time.perf_counter()
        with within(self.stages[stage].model.budget):
            problem, begin = self.problem(stage, t), replace(place.equilibrium, log=())
            if self.rubs and len(problem.walls) == len(begin.problem.walls):
                from ribbon.find.friction import path as rubbing

                found = rubbing.stepped(problem, begin)
            else:
                found = switch(problem, begin, leave_saddle=self.leave_saddle)
        entry = self._solved(stage, t, found, time.perf_counter() - clock)
        return self._accept(_Place(stage, t, found, (*place.log, entry)))

    def _followed(self, place: _Place) -> _Place:
        """The end of the leg on which the way stands, step by step."""
        taken: list[dict[str, Any]] = []

        def step(record: StepRecord, found: Equilibrium) -> None:
            taken.append(self.entry(place.stage, record, found))
            self._accept(_Place(place.stage, record.t, found, (*place.log, *taken)))

        begin, steps = replace(place.equilibrium, log=()), self.steps[place.stage]
        with within(self.stages[place.stage].model.budget):
            if self.rubs:
                from ribbon.find.friction import path as rubbing

                found = rubbing.follow(self.at(place.stage), begin, steps=steps, on_step=step, begin=place.t)
            else:
                found = follow(
                    self.at(place.stage), begin, steps=steps, leave_saddle=self.leave_saddle, on_step=step,
                    begin=place.t,
                )  # fmt: skip
        accepted = iter(taken)
        entries = [next(accepted) if step["accepted"] else _entry(place.stage, step) for step in found.log]
        self.solved += len(entries) - len(taken)
        return _Place(place.stage, 1.0, found, (*place.log, *entries))


def _entry(stage: int, record: dict[str, Any]) -> dict[str, Any]:
    """An entry of the log: a step's record under the number of its stage, from 1; None where nothing was judged."""
    return {"stage": stage + 1, **jsonable(record)}


def _held(equilibrium: Equilibrium, scene: Scene, keys: tuple[str, ...]) -> dict[str, Any]:
    """`moved`: the values of the path's keys, in the scene's unit; `forces` and `moments` as in result.json."""
    ends = {"start": equilibrium.start if scene.clamp_start is not None else None, "end": equilibrium.end_support}
    return {
        "moved": {key: jsonable(value_of(scene, key)) for key in keys},
        "forces": {
            **{name: None if at is None else at.force.tolist() for name, at in ends.items()},
            "walls": [wall.force.tolist() for wall in equilibrium.walls],
        },
        "moments": {name: None if at is None else at.moment.tolist() for name, at in ends.items()},
        **friction.along(equilibrium),
        **(
            {"forces_why": equilibrium.forces_why, "moments_why": equilibrium.forces_why}
            if equilibrium.forces_why
            else {}
        ),
    }


def _tuples(part: Any) -> Any:
    """Lists of a file as the tuples that they were."""
    return tuple(part) if isinstance(part, list) else part


def _formulation(scene: Scene) -> str:
    """The stage's own formulation; "auto" is the mixed model: its steps start warm (`compare.models.ribbon.build`)."""
    return "mixed" if scene.model.formulation == "auto" else scene.model.formulation


def run_key(scene: Scene, leave_saddle: bool) -> str:
    """What a kept state belongs to: the scene, the option, and all that goes the way: versions, and the sources of
    this module."""
    return case_key(scene.canonical(), {"leave_saddle": leave_saddle}, software(__name__))


def run_way(
    scene: Scene,
    folder: Path | None = None,
    *,
    leave_saddle: bool = False,
    progress: Progress | None = None,
    on_step: OnStep | None = None,
    film: bool = False,
) -> LoadPath:
    """The scene's equilibrium at the end of its path; segments by tolerance, where asked for, are placed there.

    folder: where the state of an unfinished run is kept and looked for; None: nowhere. on_step: called with every
    accepted step's entry of the log. film: keep states along the way (`compare.store.states`). A stage that fails
    stops the way: the result has its status. `BadInput` when the way leads through an impossible scene.
    """
    keeper = _Keeper(folder, "" if folder is None else run_key(scene, leave_saddle))
    keeper.film = Film(scene.width) if film else None
    walk = _Walk(scene, keeper, leave_saddle, progress, on_step)
    found, resumed = walk.run()
    if scene.model.tolerance is not None and found.status in _GOOD:
        if progress is not None:
            progress(f"path: segments for the tolerance {scene.model.tolerance:g}")
        log = found.log
        bare = replace(found, log=())
        with within(scene.model.budget):
            found = refine_to_tolerance(bare, scene.model.tolerance, leave_saddle=leave_saddle, strict=scene.strict)
        found = replace(found, log=log)
    if scene.follows and (found.status in _GOOD or not scene.path):
        found = followed(scene, found, progress)
    keeper.remove()
    return LoadPath(found, len(walk.stages), walk.solved, resumed, None if keeper.film is None else keeper.film.states)
