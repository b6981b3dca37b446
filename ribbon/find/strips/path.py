"""Several strips along a path: clamps, walls and weight that vary, an equilibrium after each increment.

Every increment begins at the last one's shape with its multipliers, what is held put where it is now. It is cut where
no equilibrium is found, where the strips go much farther than the last increments let expect, and where a body went
through one of them (`ribbon.find.tubes.swept`); what is left at the smallest one is a jump, and told. On walls with
friction each is one of Coulomb's (`ribbon.find.strips.rubbing`).
Strips that are kept apart go downhill by short steps (`ribbon.find.strips.touch`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ribbon.find.strips import moment, rubbing, sliding, solve
from ribbon.find.strips.result import StripsEquilibrium
from ribbon.find.tubes import swept
from ribbon.problems.strips.problem import StripsProblem
from ribbon.result import Status
from ribbon.solvers import newton_rows
from ribbon.solvers.budget import spent
from ribbonbench.threads import alone

FloatArray = NDArray[np.float64]

#: Increment to begin with and at the least, where their number is not given; growth and cut.
LARGEST, SMALLEST, GROW, CUT = 0.1, 1e-3, 1.5, 0.4
#: The largest increment with friction, where their number is not given.
RUBBING = 0.05
#: How many times as far as the last increments let expect, and at the least (l_0), the strips go in a jump.
JUMP, LEAST = 5.0, 0.05
#: Iterations of an increment with the multipliers of the last one, and without.
_WARM, _COLD = 60, 200
_GOOD = (Status.CONVERGED, Status.SADDLE)


@dataclass(frozen=True)
class Increment:
    """One increment: t at its end, the status there, whether it was kept, how far (l_0) the strips went, and whether
    that was a jump."""

    t: float
    status: str
    kept: bool
    moved: float
    jump: bool


@alone
def follow(
    problem_at: Callable[[float], StripsProblem], start: StripsEquilibrium, steps: int | None = None
) -> tuple[StripsEquilibrium, float, list[Increment]]:
    """The equilibrium at t = 1 of the path ``t -> problem_at(t)`` from `start`, the one at t = 0; how far it got, and
    its increments. steps: how many at the least; None: chosen, with friction at either end at most `RUBBING` of the way
    each."""
    ends = [problem_at(t) for t in (0.0, 1.0)]
    rubs = any(rubbing.rub(end.parts[0].walls) or end.mu > 0.0 for end in ends)
    largest = RUBBING if rubs else LARGEST
    size = 1.0 / steps if steps else largest
    most, smallest = size if steps or rubs else 2.0 * LARGEST, min(SMALLEST, 0.02 * size)
    t, state, speed = 0.0, start, None
    log: list[Increment] = []
    while t < 1.0 - 1e-12 and not spent():
        target = min(1.0, t + size)
        if 1.0 - target < 0.1 * size:
            target = 1.0
        new = stepped(problem_at(target), state)
        good = new.status in _GOOD
        moved = solve.distance(state, new) if good else np.inf
        expected = None if speed is None else speed * (target - t)
        jump = good and expected is not None and moved > max(LEAST, JUMP * expected)
        jump = jump or (good and swept.through_strips(state.problem, state.x, new.problem, new.x))
        kept = good and (not jump or CUT * (target - t) < smallest)
        log.append(Increment(target, new.status.code, kept, moved, jump and kept))
        if not kept:
            size = CUT * (target - t)
            if size < smallest:
                break
            continue
        speed = None if jump else moved / (target - t)
        size = min(most, GROW * max(size, target - t))
        state, t = new, target
    return state, t, log


def stepped(problem: StripsProblem, state: StripsEquilibrium) -> StripsEquilibrium:
    """The equilibrium of `problem`, which has the segments of `state`, one increment behind it; whatever its status."""
    old = state.problem
    turns = [old.own(state.x, k)[part.layout.joint(0).quaternion] for k, part in enumerate(old.parts)]
    bare = problem.with_parts([{"reference": tuple(map(float, turn))} for turn in turns])
    bare = moment.taken_at(bare, state.x)
    held = bare.with_parts([{"touching": part.touching} for part in old.parts])
    on_walls = rubbing.rub(problem.parts[0].walls)
    if problem.apart and (on_walls or problem.mu > 0.0):
        return sliding.increment(held, state)
    if on_walls:
        return rubbing.increment(held, bare, state)
    return replace(_without_friction(held, bare, state), rubbed=state.rubbed)


def _without_friction(held: StripsProblem, bare: StripsProblem, state: StripsEquilibrium) -> StripsEquilibrium:
    """The equilibrium one increment behind `state`, with what it holds held, or without."""
    x = np.clip(state.x, *bare.bounds())
    if held.apart:
        return solve.judged(*solve.settled(*solve.descended(held, x)))
    warm = (state.rows, state.multipliers) if state.rows.size == held.row_count else None
    found = solve.judged(*solve.settled(held, newton_rows.minimise(held, x, {"max_iter": _WARM}, None, warm)))
    if found.status in _GOOD or spent():
        return found
    return solve.judged(*solve.settled(bare, newton_rows.minimise(bare, x, {"max_iter": _COLD, "mu_init": 1e-3})))
