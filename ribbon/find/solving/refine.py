"""The same scene on other segments, started from its state on those before: the same branch, a smaller error."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from ribbon.errors import RibbonInputError
from ribbon.find import doubling, stretched
from ribbon.find.bands import folds
from ribbon.find.solving.request import How
from ribbon.find.solving.search import from_near, from_state
from ribbon.find.solving.verdict import judged
from ribbon.notes import Note
from ribbon.problems import transfer
from ribbon.problems.chained import ChainedProblem
from ribbon.problems.mixed import MixedProblem
from ribbon.result import Equilibrium, Status
from ribbon.solvers import choose, newton
from ribbon.solvers.problem import (
    DENSE,
    KNOWN,
    RESIDUAL_TOLERANCE,
    FloatArray,
    Minimum,
    approach,
    force_scale,
)


def cut_into(equilibrium: Equilibrium, parts: int, how: How) -> Equilibrium:
    """The state on segments cut into `parts` equal pieces. `RibbonInputError` for less than one piece."""
    if parts < 1:
        raise RibbonInputError("parts", parts, "cut every segment into at least one piece")
    old = equilibrium.problem
    if isinstance(old, ChainedProblem):
        lengths, x = split_state(old.lengths, equilibrium.x, parts)
        return _beside(old.with_changes(lengths=lengths), x, how)
    return onto(equilibrium, np.repeat(old.lengths / parts, parts), how)


def onto(equilibrium: Equilibrium, lengths: FloatArray, how: How) -> Equilibrium:
    """The state on segments of other `lengths` (k,); how.check and the like hold for the search from its shape."""
    old = equilibrium.problem
    if isinstance(old, ChainedProblem):
        chained = old.with_changes(lengths=lengths)
        return _beside(chained, transfer.on_joints(old, equilibrium.x, chained), how)
    assert isinstance(old, MixedProblem)
    fresh = old.with_changes(lengths=lengths)
    if old.touching:
        fresh = fresh.with_changes(touching=tuple(touch for touch in old.touching if not touch.slides))
    if stretched.is_stretched(fresh):
        return stretched.straight(fresh)
    if folds.is_folded(fresh) and folds.is_alike(fresh) and equilibrium.status in (Status.CONVERGED, Status.SADDLE):
        same = folds.beside(old, equilibrium.x, fresh)
        if same is not None:
            return judged(fresh, same, how)
    plain = how.check and how.hold and doubling.is_possible(fresh, how.options)
    if plain and equilibrium.ok and doubling.nested(old, fresh):
        state = climbed(equilibrium, fresh)
        if state is not None and state.ok:
            return state
    start = transfer.transferred(old, equilibrium.x, fresh)
    lain = _lain(old, equilibrium.x, fresh, start, how) if old.pairs else None
    if lain is not None:
        return judged(*lain, how)
    state = from_near(fresh, start, how)
    alike = state.ok and equilibrium.ok and not fresh.walls and doubling.nested(old, fresh)
    if not alike or not doubling.above(fresh, state.x, start):
        return state
    ended = Note.ANOTHER_STATE.text(segments=fresh.lengths.size)
    return replace(state, status=Status.NOT_CONVERGED, stable=None, message=ended, notes=(Note.ANOTHER_STATE,))


def _lain(
    old: MixedProblem, x: FloatArray, fresh: MixedProblem, start: FloatArray, how: How
) -> tuple[MixedProblem, Minimum] | None:
    """Layers in a plane again, from `start` (n,); None: the old state x has none, or none are found."""
    from ribbon.find.layers import plane

    return plane.lain(fresh, start, how.options, how.progress) if plane.is_layered(old, x) else None


def climbed(few: Equilibrium, problem: MixedProblem) -> Equilibrium | None:
    """The state of `problem` above that on few segments, judged; None where it is not followed up to there."""
    coarse = few.problem
    assert isinstance(coarse, MixedProblem)
    start = Minimum(
        few.x, few.multipliers, few.rows, few.residual, few.iterations, 0, "", True, few.seconds["solve"], few.solver
    )
    minimum = None if few.active_bounds else doubling.by_doublings(coarse, start, problem)
    if minimum is None:
        return None
    state = judged(problem, minimum, How())
    seen = "" if few.minima is None or len(few.minima.energies) < 2 else f"; {few.minima}"
    return replace(state, minima=few.minima, branch=few.branch, message=state.message + seen)


def split_state(lengths: FloatArray, x: FloatArray, parts: int) -> tuple[FloatArray, FloatArray]:
    """Segments cut into `parts` equal pieces and the chained unknowns of the same shape on them (exactly the same)."""
    finer = np.repeat(lengths / parts, parts)
    by_segment = x.reshape(lengths.size + 1, -1)
    return finer, np.concatenate([by_segment[0], np.repeat(by_segment[1:], parts, axis=0).ravel()])


def _beside(problem: ChainedProblem, x: FloatArray, how: How) -> Equilibrium:
    """Equilibrium of a problem without rows close to x (n,)."""
    # a few steps of Newton's from so near; a minimiser with a barrier loses the start
    clock = time.perf_counter()
    x, steps, solver = _approached(problem, x)
    spent = time.perf_counter() - clock
    state = from_state(problem, x, replace(how, near=True))
    seconds = {**state.seconds, "solve": state.seconds["solve"] + spent}
    arrived = state.solver == KNOWN and steps
    return replace(
        state, iterations=state.iterations + steps, seconds=seconds, solver=solver if arrived else state.solver
    )


def _approached(problem: ChainedProblem, x: FloatArray) -> tuple[FloatArray, int, str]:
    """The stationary point close to x (n,), the steps there and what made them; x itself, or near it, where there is
    none."""
    if choose.asked() == "ipopt":
        return *approach(problem, x, 0.01 * RESIDUAL_TOLERANCE * force_scale(problem)), DENSE
    minimum = newton.minimise(problem, x, near=True)
    return minimum.x if minimum.residual <= RESIDUAL_TOLERANCE else x, minimum.iterations, minimum.solver
