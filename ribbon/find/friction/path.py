"""A path with friction, increment by increment: what rubs depends on the way there, and every state keeps it.

A path begins where the strip is put on its walls, without friction; from there on the particles that a wall pushes go
along it only against Coulomb's friction (`ribbon.find.friction.increment`). What touches anew has none in its first
increment, and where the strip snaps its friction is that of the straight way there: a jump is told. One after which a
body has gone through the strip (`ribbon.find.tubes.swept`) is cut as a jump is. What friction has
taken away is the sum of its work, |T| times the slip, over all increments.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbon.find.continuation import (
    CUT,
    EASY,
    GROW,
    HARD,
    SHRINK,
    StepRecord,
    anchored,
    movement,
    record_of,
    stopped,
)
from ribbon.find.friction.history import History
from ribbon.find.friction.increment import increment
from ribbon.find.solving import search
from ribbon.find.solving.request import How, Progress
from ribbon.find.tubes import swept
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.result import Equilibrium, Status
from ribbonbench.threads import alone

FloatArray = NDArray[np.float64]

#: Largest step and smallest one where their number is not given.
LARGEST, SMALLEST = 0.05, 1e-3
#: Change of curvature (1/l) below which nothing jumps.
_STILL = 1e-6
_GOOD = (Status.CONVERGED, Status.SADDLE)


def rubs(problem: Problem) -> bool:
    """Whether a wall of the problem has friction."""
    return any(wall.friction > 0.0 for wall in problem.walls)


@alone
def follow(
    problem_at: Callable[[float], Problem],
    start: Equilibrium,
    *,
    steps: int | None = None,
    smallest: float | None = None,
    on_step: Callable[[StepRecord, Equilibrium], None] | None = None,
    begin: float = 0.0,
    progress: Progress | None = None,
) -> Equilibrium:
    """The equilibrium at t = 1 of the path ``t -> problem_at(t)`` from `start`, the one at t = `begin`, with friction.

    Keywords as in `ribbon.find.continuation.follow`; every state is held on its walls' side between the joints too, and
    `Equilibrium.rubbed` says what friction has taken away since `start` was found. Steps are at most `LARGEST`."""
    size = 1.0 / steps if steps else LARGEST
    if smallest is None:
        smallest = 0.02 * size if steps else SMALLEST
    t, state, speed = begin, _held(start, progress), None
    log: list[dict[str, Any]] = []
    most = size
    while t < 1.0 - 1e-12:
        target = min(1.0, t + size)
        if 1.0 - target < 0.1 * size:
            target = 1.0
        step = target - t
        clock = time.perf_counter()
        new = stepped(problem_at(target), state, How(progress=progress))
        seconds = time.perf_counter() - clock
        moved, jump, _ = movement(state, new, speed, step) if new.status in _GOOD else (0.0, False, None)
        jump = jump and moved > _STILL
        went = new.status in _GOOD and swept.through(state.problem, state.x, new.problem, new.x)
        jump, least = jump or went, min(smallest, SMALLEST) if went else smallest
        if new.status not in _GOOD or (jump and CUT * step >= least):
            log.append(asdict(record_of(target, step, new, False, seconds, jump)))
            size = CUT * step
            if size < least:
                return stopped(state, new, t, start, log)
            continue
        record = record_of(target, step, new, True, seconds, jump)
        log.append(asdict(record))
        speed = None if jump else moved / step
        state, t = new, target
        if on_step is not None:
            on_step(record, state)
        size = _next(size, step, most, new.iterations, steps)
    return replace(state, log=(*start.log, *log))


def _next(size: float, step: float, most: float, iterations: int, steps: int | None) -> float:
    if steps or iterations <= EASY:
        return min(most, max(size, step) * GROW)
    return max(step * SHRINK, 0.2 * most) if iterations >= HARD * 4 else min(most, max(size, step))


def _held(start: Equilibrium, progress: Progress | None) -> Equilibrium:
    """The state held on its walls' side between the joints too: where its particles are is where they begin."""
    if start.rubbed is not None or not start.problem.walls:
        return start
    found = search.from_state(start.problem, start.x, How(progress=progress), (start.rows, start.multipliers))
    return replace(found if found.status in _GOOD else start, log=start.log)


def stepped(problem: Problem, state: Equilibrium, how: How | None = None) -> Equilibrium:
    """The equilibrium of `problem` one increment behind `state`; whatever its status."""
    problem = anchored(problem, state)
    assert isinstance(problem, MixedProblem)
    history = History.of(state)
    new = increment(problem, state, history, how or How())
    if new.status not in _GOOD:
        return new
    return replace(new, rubbed=(state.rubbed or 0.0) + lost(new), before=history.state)


def lost(state: Equilibrium) -> float:
    """What friction took away in the last increment, D w / l: the sum of T . u."""
    problem = state.problem
    if not isinstance(problem, MixedProblem) or problem.friction is None:
        return 0.0
    return float(np.sum(problem.friction.forces(state.x) * problem.friction.slips(state.x)))


def finer(state: Equilibrium, parts: int, how: How) -> Equilibrium:
    """The end of the last increment on segments cut into `parts`: what came before it stays as it was."""
    assert state.before is not None
    old = state.problem
    assert isinstance(old, MixedProblem)
    kept = tuple(touch for touch in old.touching if not touch.slides)
    problem = old.with_changes(lengths=np.repeat(old.lengths / parts, parts), touching=kept, rubs=())
    new = increment(problem, state, History.of(state.before), how)
    if new.status not in _GOOD:
        return new
    return replace(new, rubbed=(state.rubbed or 0.0) - lost(state) + lost(new), before=state.before)
