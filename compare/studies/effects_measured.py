"""Whole solves of a scene with each of its effects switched off alone: iterations, warm time, how far the shape moves.

The shape's move is the Hausdorff distance (over l) between the surfaces with and without the effect; where nothing
resists rigid motions they are taken out (`_laid_on`). A model that does not read the strip's width knows a curve alone:
there it is the largest distance between the centrelines. Beside it stands the discretisation error of the scene's own
state: a move below it is none that the model could show.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.measure.align import Motions, aligned
from compare.measure.distance import centreline_distance, grid_hausdorff
from compare.measure.grid import Grid
from compare.models.base import Effect, Model, Options, Shape, Size, State, Status
from compare.models.choice import chosen, coarse_shell
from compare.models.effects.weightless import loaded
from compare.models.scope import require_shell
from compare.models.timing import compiled
from compare.scene.scene import Scene
from compare.store.progress import Reporter
from compare.store.store import CaseStore
from compare.studies.effects import Explanation
from ribbonbench.clock import within
from ribbonbench.errors import BadInput

FloatArray = NDArray[np.float64]

#: Warm time (s) of the scene's own solve up to which those without each effect are made unasked; where the model has no
#: evaluations to show, whole solves are all there is to see, and are worth more.
CHEAP = 0.5
WORTH = 10.0
#: CPU time (s), without compiling, of a solve that nobody asked for, in warm solves of the scene's own, and at least: a
#: scene that is solved at once can take minutes with one other effect.
TIMES, LEAST = 10.0, 1.0
#: Abscissae at which centrelines are compared.
_LINE = np.linspace(0.0, 1.0, 401)
#: Keys of the scene without an effect and with it.
Pair = tuple[Mapping[str, Any], Mapping[str, Any]]
_SOLVED = (Status.CONVERGED, Status.UNSTABLE)
#: Share of a shell's loads whose answer is straight on: what is quadratic in it moves it by this part of the linear.
LITTLE = 1e-3
LINEAR = "nonlinearity of the loads"


@dataclass(frozen=True)
class Without:
    """A solve with one effect off. first, warm in s; moved: over l, to the scene's own shape, None: no shape.

    iterations: of all solves of a path, of the last one for placed segments; reason: why there was no solve, or "".
    """

    status: str
    iterations: int | None
    first: float | None
    warm: float | None
    moved: float | None
    reason: str = ""


@dataclass(frozen=True)
class Solves:
    """The scene's own state with its discretisation error, and those without an effect.

    surface: moves are between surfaces; otherwise between centrelines. limit: warm time (s) up to which those without
    an effect are made unasked. without: by name of the effect, empty when they were not made. each: CPU time (s) that
    every other solve may take; infinite where they were asked for.
    """

    state: State
    grid: Grid
    surface: bool
    limit: float
    without: Mapping[str, Without]
    each: float = math.inf


def iterations(state: State) -> int | None:
    """Iterations of the solver, over all steps of a way."""
    if not state.log:
        return state.iterations
    return sum(int(entry["iterations"] or 0) for entry in state.log)


def solves(scene: Scene, found: Explanation, reporter: Reporter, *, always: bool | None = None) -> Solves:
    """Solves the scene, and again without each effect that is on and can be off alone.

    always: True, False, or None for: when the scene's own solve takes less than `CHEAP`, or than `WORTH`.
    """
    model = chosen(scene)
    with compiled() as count:
        options = Options(error=True, repeats=None)
        if found.choice is None:
            own = model.solve(scene, options=options, say=reporter)
        else:
            own = found.choice.solve(options, reporter)
        fresh = count() > 0
    if fresh and not own.seconds.repeats:  # what compiled is no warm time
        own = replace(own, seconds=model.solve(scene, options=Options(repeats=1)).seconds)
    grid = Grid.for_shape(scene, own.shape.bend if own.shape is not None else 1.0)
    surface = "strip.width" in model.reads
    limit = WORTH if found.evaluation is None else CHEAP
    each = math.inf if always else max(TIMES * own.seconds.warm, LEAST)
    table: dict[str, Without] = {}
    if always or (always is None and own.seconds.warm <= limit):
        for effect in found.effects:
            if effect.on and effect.changes is not None:
                reporter.step(f"without {effect.key}")
                table[effect.key] = _solved(scene, effect, own, grid if surface else None, each)
    return Solves(own, grid, surface, limit, table, each)


def _solved(scene: Scene, effect: Effect, own: State, grid: Grid | None, each: float) -> Without:
    """The scene without one effect beside its own state; grid: of the surfaces, None for centrelines; each: as in
    `Solves`."""
    assert effect.changes is not None
    try:
        off = scene.replace(effect.changes)
        size = own.size if effect.same_size else None
        with within(each):
            state = chosen(off).solve(off, size, options=Options(repeats=None))
    except BadInput as refusal:
        return Without("not solved", None, None, None, None, _refused(refusal))
    moved = None
    if own.shape is not None and state.shape is not None and own.status in _SOLVED and state.status in _SOLVED:
        moved = _moved(off, own.shape, state.shape, state.motions, grid)
    return Without(state.word, iterations(state), state.seconds.first, state.seconds.warm, moved)


def between(scene: Scene, own: State, pair: Pair, grid: Grid | None, each: float) -> float | None:
    """How far apart (over l) the states are with the keys of the first of a pair and with those of the second (no keys:
    `own`); None where one of them is refused, or no stable equilibrium within its time `each` (as in `Solves`)."""
    states, scenes = [], []
    for keys in pair:
        state, changed = own, scene
        if keys:
            try:
                changed = scene.replace(dict(keys))
                with within(each):
                    state = chosen(changed).solve(changed, options=Options(repeats=0))
            except BadInput:
                return None
        if state.shape is None or state.status is not Status.CONVERGED:
            return None
        states.append(state)
        scenes.append(changed)
    without, with_it = states
    assert without.shape is not None
    assert with_it.shape is not None
    return _moved(scenes[1], without.shape, with_it.shape, with_it.motions, grid)


def _moved(scene: Scene, own: Shape, shape: Shape, motions: Motions | None, grid: Grid | None) -> float:
    """How far `shape`, the scene's, lies from the shape with all effects."""
    if grid is None:
        return centreline_distance(own.centreline(_LINE), shape.centreline(_LINE))
    points = grid.of(own)
    return grid_hausdorff(points, _laid_on(scene, grid.of(shape), points, motions))


def _laid_on(scene: Scene, moved: FloatArray, points: FloatArray, motions: Motions | None) -> FloatArray:
    """The surface `moved` (k, m, 3) laid on `points` as far as nothing resists; where no clamp holds, any way.

    (Without its weight a strip beside a wall may be anywhere.)
    """
    if scene.clamp_start is not None or scene.clamp_end is not None:
        return aligned(moved, points, motions)
    return aligned(moved, points, Motions(np.eye(3), np.eye(3)))


def _refused(refusal: BadInput) -> str:
    """Why a scene is refused without an effect, in a few words."""
    where = "" if refusal.key == "scene" else f"{refusal.key} "  # what a solver refuses names no key
    return f"not alone: {where}{refusal.problem}"


@dataclass(frozen=True)
class ShellWithout:
    """A shell with one effect off ("": with all). seconds: of the solve; moved: Hausdorff / l to that with all."""

    name: str
    status: str
    iterations: int | None
    seconds: float | None
    moved: float | None
    error: float | None = None
    reason: str = ""


@dataclass(frozen=True)
class ShellSolves:
    """Shells of one w/h on one mesh (along, across), the first with all effects; its error: to half the mesh."""

    width_to_thickness: float
    elements: tuple[int, int]
    rows: tuple[ShellWithout, ...]


def shells(scene: Scene, grid: Grid, store: CaseStore, reporter: Reporter) -> ShellSolves:
    """Solves the scene's thickest shell, on a coarse mesh, and again without each effect that it has.

    Raises `BadInput` for a scene without a shell.
    """
    shell, alone, size = coarse_shell(scene)
    own = shell.solve(alone, size, options=Options(error=True, store=store, grid=grid), say=reporter)
    points = grid.of(own.shape) if own.ok and own.shape is not None else None
    rows = [ShellWithout("", own.word, own.iterations, own.seconds.warm, None, own.error)]
    for effect in shell.effects(alone):
        if not effect.on or effect.changes is None:
            continue
        reporter.step(f"shell: without {effect.key}")
        try:
            state = shell.solve(alone.replace(effect.changes), size, options=Options(store=store), say=reporter)
        except BadInput as refusal:
            rows.append(ShellWithout(effect.key, "not solved", None, None, None, None, _refused(refusal)))
            continue
        moved = None
        if points is not None and state.ok and state.shape is not None:
            moved = grid_hausdorff(points, grid.of(state.shape))
        rows.append(ShellWithout(effect.key, state.word, state.iterations, state.seconds.warm, moved))
    linear = _straight_on(shell, alone, size, points, grid, store, reporter)
    along, across = (int(value) for value in size.values)
    rows += [] if linear is None else [linear]
    return ShellSolves(require_shell(alone)[0], (along, across), tuple(rows))


def _straight_on(
    shell: Model, scene: Scene, size: Size, points: FloatArray | None, grid: Grid, store: CaseStore, reporter: Reporter
) -> ShellWithout | None:
    """The shell without the nonlinearity of its loads: the unloaded shape and `LITTLE` of the loads, their difference
    straight on. None where something else than loads bends it away from its rest (a clamp at the end, a wall, a seam, a
    path), or nothing loads it."""
    held = scene.clamp_end is not None or scene.closure is not None or scene.barriers or scene.path
    if held or points is None or not (scene.gamma or scene.tip_force.any()):
        return None
    reporter.step("shell: linear in its loads")
    ends = []
    for share in (0.0, LITTLE):
        try:
            state = shell.solve(scene.replace(loaded(scene, share)), size, options=Options(store=store), say=reporter)
        except BadInput as refusal:
            return ShellWithout(LINEAR, "not solved", None, None, None, None, _refused(refusal))
        if not state.ok or state.shape is None:
            return ShellWithout(LINEAR, state.word, state.iterations, state.seconds.warm, None)
        ends.append(grid.of(state.shape))
    straight = ends[0] + (ends[1] - ends[0]) / LITTLE
    return ShellWithout(LINEAR, state.word, state.iterations, state.seconds.warm, grid_hausdorff(points, straight))
