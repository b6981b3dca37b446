"""Several strips that rub on their walls: one increment of their path (docs/theory.md, eq. (5.15)).

What rubs on each strip, the bounds that the pushes give and the guesses of its friction are found as for one strip
alone, in its own units (`ribbon.find.friction.increment`); the minimum between them is that of all strips.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ribbon.contact import Barrier
from ribbon.find.friction import increment as alone
from ribbon.find.friction.history import History
from ribbon.find.friction.path import lost as lost_alone
from ribbon.find.strips import solve
from ribbon.find.strips.result import StripsEquilibrium
from ribbon.find.strips.walls import each_of
from ribbon.notes import Note
from ribbon.problems.friction.particles import Rub
from ribbon.problems.strips.problem import StripsProblem
from ribbon.result import Status
from ribbon.solvers import newton_rows
from ribbon.solvers.budget import spent
from ribbon.solvers.problem import RESIDUAL_TOLERANCE, Minimum

_GOOD = (Status.CONVERGED, Status.SADDLE)
#: Steps of a minimiser in the first round, without multipliers, and in one after it.
_STEPS, _COLD, _STEPS_NEXT = 150, 200, 30


def rub(walls: Sequence[Barrier]) -> bool:
    """Whether a wall has friction."""
    return any(wall.friction > 0.0 for wall in walls)


def increment(problem: StripsProblem, bare: StripsProblem, state: StripsEquilibrium) -> StripsEquilibrium:
    """The equilibrium one increment behind `state` of `problem`, with what `state` holds held, or of `bare`, without;
    not converged where no minimum is found, or bounds and friction do not settle."""
    own = histories(state)
    new = _settled(*_begun(problem, bare, state, own), own)
    if new.status not in _GOOD:
        return new
    return replace(new, rubbed=(state.rubbed or 0.0) + lost(new), before=replace(state, before=None))


def lost(state: StripsEquilibrium) -> float:
    """What friction took away in the last increment, D_0 w_0 / l_0: the sum of T . u."""
    each = zip(state.problem.stiffness_over, state.strips, strict=True)
    return float(sum(c * lost_alone(strip) for c, strip in each))


def finer(fresh: StripsProblem, state: StripsEquilibrium) -> StripsEquilibrium:
    """The end of the last increment by `fresh`, the problem of `state` on shorter segments; what came before it stays
    as it was."""
    assert state.before is not None
    own = histories(state.before)
    softly = begun(fresh, state, own)
    x = solve.carried(state, fresh)
    point = newton_rows.minimise(softly, x, {"max_iter": _COLD, "mu_init": 1e-5})
    return _settled(softly, point, own)


def histories(state: StripsEquilibrium) -> list[History]:
    """Each strip's, of the state at the end of an increment."""
    return [History.of(strip) for strip in state.strips]


def rubbed(problem: StripsProblem, rubs: Sequence[tuple[Rub, ...]]) -> StripsProblem:
    """The problem whose strips rub on walls as given."""
    return problem.with_parts([{"rubs": own} for own in rubs])


def begun(problem: StripsProblem, state: StripsEquilibrium, before: Sequence[History]) -> StripsProblem:
    """The problem at the beginning of its increment: what rubbed at the end of the last one rubs on."""
    each = zip(problem.parts, state.strips, before, strict=True)
    return rubbed(problem, [alone.again(part, strip, history) for part, strip, history in each])


def found(problem: StripsProblem, point: Minimum, before: Sequence[History]) -> list[tuple[Rub, ...]]:
    """What rubs on walls at an equilibrium with what the walls push there, of each strip in its own units."""
    each = zip(problem.parts, each_of(problem, point), before, strict=True)
    return [alone.rubbing(part, own.x, own.rows, history) for part, own, history in each]


def difference(problem: StripsProblem, point: Minimum, rubs: Sequence[tuple[Rub, ...]]) -> float:
    """By how much bounds and friction of `rubs` differ from those of the problem: the largest of the strips'."""
    each = zip(problem.parts, each_of(problem, point), rubs, strict=True)
    return max(alone.difference(part, own, some) for part, own, some in each)


def softer(rubs: Sequence[tuple[Rub, ...]]) -> list[tuple[Rub, ...]]:
    """The same places with the stiffness that an increment begins with."""
    return [tuple(one._replace(stiffness=alone.SOFT) for one in own) for own in rubs]


def _begun(
    problem: StripsProblem, bare: StripsProblem, state: StripsEquilibrium, before: Sequence[History]
) -> tuple[StripsProblem, Minimum]:
    """The first minimum: what rubbed at the end of the last increment rubs on."""
    x = np.clip(state.x, *problem.bounds())
    first = begun(problem, state, before)
    warm = (state.rows, state.multipliers) if state.rows.size == first.row_count else None
    point = newton_rows.minimise(first, x, {"max_iter": _STEPS}, None, warm)
    if point.residual <= RESIDUAL_TOLERANCE or spent():
        return first, point
    first = rubbed(bare, [part.rubs for part in first.parts])
    return first, newton_rows.minimise(first, x, {"max_iter": _COLD, "mu_init": 1e-3})


def _settled(problem: StripsProblem, point: Minimum, before: Sequence[History]) -> StripsEquilibrium:
    """The end of the increment: rounds of bounds and guesses until they settle."""
    change, least, idle = np.inf, np.inf, 0
    for _ in range(alone.ROUNDS):
        if point.residual > RESIDUAL_TOLERANCE or spent():
            break
        problem, point, _ = solve.settled(problem, point)
        rubs = found(problem, point, before)
        change = difference(problem, point, rubs)
        least, idle = (change, 0) if change < 0.5 * least else (least, idle + 1)
        if change <= alone.SETTLED or (change <= alone.LEFT and idle >= alone.IDLE):
            break
        problem, point = _next(problem, point, rubs)
    state = solve.judged(problem, point)
    if state.status not in _GOOD or change <= alone.LEFT:
        return state
    text = Note.RUBS_UNSETTLED.text(change=change, rounds=alone.ROUNDS)
    return replace(state, status=Status.NOT_CONVERGED, stable=None, message=text)


def _next(problem: StripsProblem, point: Minimum, rubs: Sequence[tuple[Rub, ...]]) -> tuple[StripsProblem, Minimum]:
    """The problem with other bounds and guesses and its minimum, with softer places where none is found at once."""
    for tried in (rubs, softer(rubs)):
        fresh = rubbed(problem, tried)
        again = newton_rows.minimise(fresh, point.x, {"max_iter": _STEPS_NEXT}, None, (point.rows, point.multipliers))
        again = replace(again, iterations=again.iterations + point.iterations, seconds=again.seconds + point.seconds)
        if again.residual <= RESIDUAL_TOLERANCE:
            return fresh, again
    return fresh, newton_rows.minimise(fresh, point.x, {"max_iter": _COLD, "mu_init": 1e-5})
