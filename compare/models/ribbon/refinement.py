"""What a ribbon is on finer segments: its discretisation error, and whether it is stable there too."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from compare.measure.align import aligned
from compare.measure.distance import grid_hausdorff
from compare.measure.error import extrapolated
from compare.measure.grid import Grid
from compare.models.base import Options, Refinement, Seconds, Size, State
from compare.models.ribbon.state import own_size, state_of

if TYPE_CHECKING:
    from compare.scene.scene import Scene
    from compare.store.progress import Reporter
    from ribbon import Equilibrium

#: Segments up to which a ribbon is solved again for the error estimate: with a dense Hessian, with a sparse one. Once
#: beyond is allowed, for the cruder of the two estimates.
MOST_SEGMENTS = 320
MOST_SPARSE_SEGMENTS = 4000


def refined(state: State) -> State | None:
    """Every segment cut in two, solved again from the state; None where it is not stable."""
    from ribbon import refine

    if not state.ok:
        return None
    finer = refine(state.native)
    size = Size(state.size.ladder, (float(finer.problem.lengths.size),))
    return state_of(None, finer, size, Seconds(float("nan")), None)


def judged(state: State, say: Reporter | None = None, grid: Grid | None = None, scene: Scene | None = None) -> State:
    """The state with its discretisation error, the distance (Hausdorff / l) to its own limit of many segments on
    the same branch, and with what it is on finer segments.

    The error is `compare.measure.error.extrapolated` over segments cut in two and in four; rigid motions that
    nothing resists are none. Segments placed by a tolerance bring their own. A state that is a saddle on finer
    segments is one: the answer is then what was found there. scene: names its walls.
    """
    from ribbon.solvers.budget import SPENT, spent

    if not state.ok or state.shape is None:
        return replace(state, refinements=_all_tried(state.native), error_why="it is no stable equilibrium")
    e = state.native
    if e.tolerance_error is not None:
        return replace(
            state, error=float(e.tolerance_error), refinements=_all_tried(e), error_why="of the placed segments"
        )
    most = MOST_SEGMENTS if e.problem.formulation == "chained" else MOST_SPARSE_SEGMENTS
    grid = grid or Grid.for_shape(_Wide(2.0 * e.problem.half_width), state.shape.bend)  # type: ignore[arg-type]
    shapes = [grid.of(state.shape)]
    tried = [*_all_tried(e)]
    why = "extrapolated from two and four times the segments"
    current = state
    for _ in range(2):
        segments = 2 * current.native.problem.lengths.size
        if segments > (2 * most if len(shapes) == 1 else most):
            why = f"from one refinement: {segments} segments are more than are tried"
            break
        if spent():
            why = f"{SPENT} before {segments} segments were tried"
            break
        if say is not None:
            say.step(f"ribbon: {segments} segments, for the discretisation error")
        finer = refined(current)
        assert finer is not None  # `current` is stable
        if finer.shape is None or not finer.is_equilibrium:
            tried.append(_tried(finer.native, None))
            why = f"not known beyond: on {segments} segments {finer.message}"
            break
        there = aligned(grid.of(finer.shape), shapes[-1], finer.motions)
        tried.append(_tried(finer.native, grid_hausdorff(shapes[-1], there)))
        if not finer.ok:
            there_too = state_of(scene, finer.native, own_size(finer.native), state.seconds)
            return _hidden_saddle(state, there_too, tuple(tried))
        shapes.append(there)
        current = finer
    return replace(state, error=extrapolated(shapes), refinements=tuple(tried), error_why=why)


def left(scene: Scene, state: State, say: Reporter | None, options: Options) -> State:
    """From a saddle that only finer segments show (the native of `state`) along its unstable direction."""
    from ribbon import switch

    saddle = state.native
    found = switch(saddle.problem, saddle, leave_saddle=True)
    if not found.ok:
        return state
    fresh = state_of(scene, found, own_size(found), state.seconds)
    finer = judged(fresh, say, options.grid, scene)
    return replace(finer, log=state.log, refinements=(*state.refinements, *finer.refinements))


@dataclass(frozen=True)
class _Wide:
    """What `Grid.for_shape` asks of a scene: w / l."""

    width: float


def _tried(found: Equilibrium, distance: float | None) -> Refinement:
    """One equilibrium as a refinement."""
    return _refinement(found.problem.lengths.size, found.status.code, found.lowest_eigenvalue, distance)


def _all_tried(found: Equilibrium) -> tuple[Refinement, ...]:
    """The equilibrium itself, or all on the way of a tolerance that placed its segments."""
    if not found.refinements:
        return (_tried(found, None),)
    return tuple(
        _refinement(one.segments, one.status.code, one.lowest_eigenvalue, one.distance) for one in found.refinements
    )


def _refinement(segments: int, word: str, lowest: float, distance: float | None) -> Refinement:
    return Refinement(int(segments), word, float(lowest) if np.isfinite(lowest) else None, distance)


def _hidden_saddle(state: State, finer: State, tried: tuple[Refinement, ...]) -> State:
    """A state that is stable on its own segments and a saddle on finer ones: the saddle, of which all is known."""
    few, many = state.native.problem.lengths.size, finer.native.problem.lengths.size
    lowest = f"{finer.lowest_eigenvalue:.2g}"
    return replace(
        finer,
        message=f"saddle: stable on {few} segments only; on {many} the lowest eigenvalue is {lowest}, it is not stable",
        log=state.log,
        start=state.start,
        reused=state.reused,
        refinements=tried,
        error_why=f"on {many} segments the state is a saddle",
    )
