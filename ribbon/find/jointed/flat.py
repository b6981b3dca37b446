"""A flat strip's equilibrium on segments that follow its places of contact (`ribbon.find.jointed.rounds`: round rods).

A force within a segment costs the order: curvature has a kink there. On an edge it has an arm v t_x, whose moment
v t_x x F lets the twist (and the curvature in the strip's plane) jump, which segments that are continuous meet to first
order of their length at best. So joints are put where places of contact are, on both parts, and segments beside them
halve towards them; there the strip is found again, places slide on those segments, joints follow, until both are at one
place. Places across the strip slide too. It is for single places (an
edge on an edge or a face): parallel rulings that lie on each other, as in a plane fold, do not converge so.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ribbon.find import apart
from ribbon.find.continuation import switch
from ribbon.find.jointed import rounds
from ribbon.find.jointed import touching as touch
from ribbon.find.jointed.rounds import is_ring
from ribbon.find.jointed.touching import Touching
from ribbon.find.solving import search
from ribbon.find.solving.request import How
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.transfer import transferred
from ribbon.result import Equilibrium
from ribbon.solvers import newton_rows

FloatArray = NDArray[np.float64]

#: Times that a segment beside a place is halved towards it.
GRADED = 5
#: Rounds of joints that move; part of a segment by which places are beside their joints at the most.
ROUNDS, PLACED = 12, 1e-4
#: Part of the largest force from which a place pushes; of a segment, by which places of two edges are one.
_CLEARLY, _ONE = 1e-6, 0.1
#: Iterations of one equilibrium.
_MOST = 80


@dataclass(frozen=True)
class Placed:
    """An equilibrium; length: about that (l) of its segments; counts: how many are between one place and the next."""

    state: Equilibrium
    length: float
    counts: tuple[int, ...] = ()


def places(state: Equilibrium) -> tuple[tuple[float, float], ...]:
    """Abscissae (over l) of the places that push, those of two edges beside each other as one."""
    problem = state.problem
    assert isinstance(problem, MixedProblem)
    pushing = apart.pushing_with(problem, state)
    least = _CLEARLY * max((force for _, force in pushing), default=0.0)
    near = _ONE * float(problem.lengths.min())
    found: list[tuple[float, float]] = []
    for pair, force in pushing:
        if force > least and not any(max(abs(pair.s - s), abs(pair.s_other - t)) < near for s, t in found):
            found.append((pair.s, pair.s_other))
    return tuple(sorted(found))


def graded(s: FloatArray, at: tuple[tuple[float, float], ...]) -> FloatArray:
    """Joints (p + 1,) and, beside each that is a place, others at a half, a fourth, ... of the segments there."""
    parts = 0.5 ** np.arange(1, GRADED + 1)
    more = [s]
    for place in np.ravel(at):
        k = int(np.argmin(np.abs(s - place)))
        more += [s[k] + (s[n] - s[k]) * parts for n in (k - 1, k + 1) if 0 <= n < s.size]
    return np.unique(np.concatenate(more))


def placed(problem: MixedProblem, old: Placed) -> Placed | None:
    """The equilibrium of `problem`, whatever its segments, from `old`, on segments that end within 1e-4 of one from its
    places; None where none is found. Raises AssertionError where `problem` or that of `old` is not mixed."""
    here = old
    for _ in range(ROUNDS):
        at = places(here.state)
        s, counts = touch.joints(Touching(at), old.length, is_ring(problem), here.counts)
        state = _on(problem.with_changes(lengths=np.diff(graded(s, at))), here.state)
        if not state.ok:
            return None
        now = places(state)
        same = len(now) == len(at)
        off = float(np.abs(np.subtract(now, at)).max(initial=0.0)) if same else np.inf
        here = Placed(state, old.length, counts if same else ())
        if off <= PLACED * old.length:
            return here
    return None


def _on(problem: MixedProblem, old: Equilibrium) -> Equilibrium:
    """The equilibrium on other segments: beside the one on as many, else by Newton's iteration with what pushed."""
    was = old.problem
    assert isinstance(was, MixedProblem)
    if was.lengths.size == problem.lengths.size:
        return switch(problem, old)
    pushing = tuple(pair for pair, _ in apart.pushing_with(was, old))
    fresh = problem.with_changes(pairs=apart.around(problem, pushing)).anchored(was.anchor(old.x))
    x = transferred(was, old.x, fresh)
    warm = rounds.warm(was, old, fresh, x, float(was.lengths.min()))
    point = newton_rows.minimise(fresh, x, {"max_iter": _MOST}, None, warm)
    return search.from_state(fresh, point.x, How(options={"max_iter": _MOST}), (point.rows, point.multipliers))


def halved(problem: MixedProblem, old: Placed) -> Placed | None:
    """The same on twice as many segments between places."""
    return placed(problem, Placed(old.state, 0.5 * old.length, tuple(2 * count for count in old.counts)))
