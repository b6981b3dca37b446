"""Where a strip goes that leaves an equilibrium, without going through itself: downhill by short steps.

No place goes farther in a step than a part of the distance that parts keep, and all that could meet in the steps before
the next look is held apart: what is far from each other then cannot pass. A thin strip would take thousands of them:
steps of one that is not a round rod grow while nothing passes, and are taken back where a look at the way finds that
something did. Where no parts are kept apart steps are as long as those at once, and may pass. The way is that of a
minimiser, not of a strip with mass: which of several equilibria it ends in is not decided by mechanics.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ribbon.find import apart
from ribbon.find.solving.request import How, Options, Progress
from ribbon.find.solving.verdict import judged
from ribbon.judge import nearness, passage, strands
from ribbon.problems.itself.pairs import Pair
from ribbon.problems.mixed import MixedProblem
from ribbon.result import Equilibrium, Status
from ribbon.solvers import newton_rows
from ribbon.solvers.budget import spent
from ribbon.solvers.problem import Minimum

FloatArray = NDArray[np.float64]
#: Called at each look with how many there were, the unknowns (n,) and the energy (D w / l) there.
Look = Callable[[int, FloatArray, float], None]

#: How far a place may go in a step, over the distance to be kept; steps between two looks; looks.
_TRAVEL, _STEPS, _LOOKS = 0.125, 4, 120
#: How far (l) a place of a strip may go in a step at the most, where the steps before passed through nothing.
_FARTHEST = 0.01
#: Steps between two looks where it hardly moves any more.
_MOST = 64
#: Part of that step below which a way that leads through the strip itself is given up.
_SHORTEST = 0.2
#: Part of the distance to be kept that a pair may be short of in a step.
_FELL = 0.5
_PASSED = "The way downhill leads through the strip itself."
#: How far an unstable state is moved along its mode, over the distance to be kept.
_KICK = 0.2
#: Unstable states that are left in turn.
_DEPARTURES = 6


def downhill(
    problem: MixedProblem,
    x: FloatArray,
    options: Options | None = None,
    progress: Progress | None = None,
    look: Look | None = None,
) -> tuple[MixedProblem, Minimum]:
    """The problem with the pairs of places that its equilibrium needs, and the equilibrium, from unknowns x (n,) near
    its rows; one that has not arrived where none is found."""
    travel = _TRAVEL * problem.apart or _FARTHEST
    chosen = {"mu_init": 1e-5, **(options or {}), "travel": travel, "max_iter": _STEPS}
    minimum: Minimum | None = None
    iterations, far = 0, travel
    for looks in range(1, _LOOKS + 1):
        chosen["travel"] = far
        fresh = problem.with_changes(pairs=_what_could_meet(problem, x, 2.0 * max(far, travel) * _STEPS))
        fresh = fresh.anchored(problem.anchor(x))
        fresh.counters.add(problem.counters)
        warm = None if minimum is None else (apart.rows_of(problem, fresh, minimum), minimum.multipliers)
        chosen["sliding"] = newton_rows.SLIDING if fresh.round and fresh.pairs else 0.0
        minimum = newton_rows.minimise(fresh, x, chosen, progress, warm)
        iterations += minimum.iterations
        finite = bool(np.all(np.isfinite(minimum.x)))
        if finite and (fell(fresh, x, minimum.x) or passage.passage(problem, x, fresh, minimum.x) is not None):
            if far < _SHORTEST * travel or spent():
                problem = fresh
                minimum = replace(minimum, x=x, residual=1.0, finished=False, message=_PASSED)
                break
            far *= 0.5 if far <= travel else 0.25
            chosen["max_iter"] = _STEPS
            minimum = None
            continue
        moved = float(np.abs(problem.layout.positions(minimum.x) - problem.layout.positions(x)).max())
        problem, x = fresh, minimum.x
        if look is not None and finite:
            look(looks, x, float(problem.value(x)))
        chosen["max_iter"] = _STEPS if moved > max(far, travel) else min(2 * chosen["max_iter"], _MOST)
        if moved > far and not problem.round:
            far = min(2.0 * far, _FARTHEST)
        if minimum.finished or spent() or not np.all(np.isfinite(x)):
            break
        if minimum.code not in (newton_rows.SOLVED, newton_rows.MOST):
            minimum = None
            chosen["mu_init"] = 1e-4
    if minimum is None:
        minimum = newton_rows.minimise(problem, x, {**chosen, "max_iter": 0}, progress)
    return problem, replace(minimum, iterations=iterations)


def fell(problem: MixedProblem, x: FloatArray, after: FloatArray) -> bool:
    """Whether a pair that was not fell upon itself: which side its places are on is lost where they are one, and no
    step leads apart again. Samples of a thin strip (`ribbon.judge.passage`) may lie too far apart to see it."""
    if not problem.pairs:
        return False
    rows = problem.pair_rows()
    least = -_FELL * problem.apart
    return bool(((rows.gaps(after) < least) & (rows.gaps(x) >= least)).any())


def _what_could_meet(problem: MixedProblem, x: FloatArray, below: float) -> tuple[Pair, ...]:
    """The pairs of places nearer than `below` (l) beyond what they keep."""
    if not problem.apart:
        return ()
    if problem.round:
        return tuple(pair for _, pair in strands.places(problem, x, below))
    return apart.around(problem, [pair for _, pair in nearness.minima(problem, x, below)])


def landed(problem: MixedProblem, x: FloatArray, how: How, look: Look | None = None) -> Equilibrium:
    """The equilibrium that lies downhill of the unknowns x (n,)."""
    options = {key: value for key, value in (how.options or {}).items() if key != "max_iter"}
    found, minimum = downhill(problem, x, options, how.progress, look)
    found, minimum = apart.kept(found, minimum, options, how.progress)
    return judged(found, minimum, how)


def left(first: Equilibrium, how: How) -> Equilibrium:
    """The equilibrium that `first` is left for while it is unstable, along its unstable mode, of both ways the lower;
    `first` itself where it is stable or nothing lower is found."""
    state = first
    for _ in range(_DEPARTURES):
        if state.status is not Status.SADDLE or spent():
            break
        found = min(
            _beside(state, replace(how, leave_saddle=False)), key=lambda e: (not e.ok, e.energy.total), default=None
        )
        if found is None:
            break
        state = found
    return state


def _beside(saddle: Equilibrium, how: How) -> list[Equilibrium]:
    """Equilibria lower than a saddle, to both sides of it."""
    problem = saddle.problem
    assert isinstance(problem, MixedProblem)
    size = float(np.abs(problem.layout.positions(saddle.mode)).max())
    if not size > 0.0:
        return []
    found = []
    for side in (1.0, -1.0):
        state = landed(problem, saddle.x + side * _KICK * problem.apart / size * saddle.mode, how)
        if state.status in (Status.CONVERGED, Status.SADDLE) and state.energy.total < saddle.energy.total:
            found.append(state)
    return found
