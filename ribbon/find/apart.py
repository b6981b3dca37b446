"""Parts of a strip kept from each other: self-contact, by an exchange of places.

Where an equilibrium's parts are nearer to each other than they may be, the nearest places of each region are held apart
(`ribbon.problems.itself.pairs`), and the equilibrium is found again from there; what does not push is let go. Contact
is a condition on every pair of places: an exchange method (R. Hettich and K. Kortanek 1993, doi:10.1137/1035089).

Nothing here knows on which side of each other parts have been: a strip that has gone through itself is not brought
back. What begins clear of itself stays so on a path whose steps move it by less than the distance to be kept.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbon.find import relax
from ribbon.find.solving.request import Progress
from ribbon.judge import nearness
from ribbon.problems.itself.pairs import Pair
from ribbon.problems.mixed import MixedProblem
from ribbon.solvers import choose
from ribbon.solvers.budget import spent
from ribbon.solvers.problem import RESIDUAL_TOLERANCE, Minimum, kkt_residual

FloatArray = NDArray[np.float64]

#: Depth (l) from which places are held apart, rounds of that, and pairs that a round adds.
DEPTH, ROUNDS, MOST = 0.3 * nearness.TOLERANCE, 25, 200
#: Push (D w / l^2) of a pair that is let go, and part of the largest one.
_PUSHES, _CLEARLY = 1e-9, 1e-7
#: Part of a segment within which a place is near its joint, and by which one begins behind a joint.
_BESIDE, _INSIDE = 0.35, 0.02
#: Part of a segment up to which places that stay are one.
_STATION = 0.4
#: Depth over the distance to be kept from which parts may have gone through each other, and nothing brings them back.
_THROUGH = 0.5
#: Iterations of Newton's method beside an equilibrium, and without its multipliers.
_WARM, _COLD = 60, 150


def kept(
    problem: MixedProblem, minimum: Minimum, options: dict[str, Any] | None = None, progress: Progress | None = None
) -> tuple[MixedProblem, Minimum]:
    """The problem with the pairs that an equilibrium `minimum` of it needs, and the equilibrium then; where none is
    found within the tolerance, the one whose parts are least too near."""
    if not problem.apart or not minimum.residual <= RESIDUAL_TOLERANCE:
        return problem, minimum
    best, least = (problem, minimum), np.inf
    for _ in range(ROUNDS):
        near = nearness.minima(problem, minimum.x, -DEPTH)
        depth = max((-gap for gap, _ in near), default=0.0)
        if depth < least:
            best, least = (problem, minimum), depth
        if not near or spent() or depth > _THROUGH * problem.apart:
            break
        fresh = _with(problem, minimum, [pair for _, pair in near[:MOST]])
        again = _again(problem, fresh, minimum, options, progress)
        if again.residual > RESIDUAL_TOLERANCE:
            break
        spent_on = minimum.iterations, minimum.seconds
        minimum = replace(again, iterations=again.iterations + spent_on[0], seconds=again.seconds + spent_on[1])
        fresh.counters.add(problem.counters)
        problem = fresh
    return let_go(*best)


def _slid(problem: MixedProblem, x: FloatArray) -> list[Pair]:
    """The pairs where they have gone."""
    if not problem.pairs:
        return []
    places = problem.pair_rows().places(x)
    return [pair.at(place) for place, pair in zip(places, problem.pairs, strict=True)]


def _with(problem: MixedProblem, minimum: Minimum, near: list[Pair]) -> MixedProblem:
    """The problem with more pairs, those that push where they have gone."""
    return problem.with_changes(pairs=around(problem, [*_pushing(problem, minimum), *near]))


def around(problem: MixedProblem, pairs: Iterable[Pair]) -> tuple[Pair, ...]:
    """Pairs, each once, and those on the segments next to theirs where they are near a joint: there the nearest places
    may go over to these."""
    starts = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    found: list[Pair] = []

    def places(s: float) -> list[float]:
        i = problem.segment_at(s)
        share, own = (s - starts[i]) / problem.lengths[i], [s]
        for step, near in ((-1, share < _BESIDE), (1, share > 1.0 - _BESIDE)):
            beside = problem.beside(i, step) if near else None
            if beside is not None:
                inside = _INSIDE * problem.lengths[beside]
                own.append(float(starts[beside] + inside if step > 0 else starts[beside + 1] - inside))
        return own

    for pair in pairs:
        for s in [pair.s] if pair.stays else places(pair.s):
            for other in places(pair.s_other):
                beside = pair._replace(s=s, s_other=other).ordered()
                if not any(_alike(problem, beside, known) for known in found):
                    found.append(beside)
    return tuple(found)


def _alike(problem: MixedProblem, one: Pair, other: Pair) -> bool:
    """Whether two pairs are looked for on the same segments, near the same places across the strip."""
    near = 0.1 * problem.half_width
    if (one.stays or other.stays) and abs(one.s - other.s) > _STATION * float(problem.lengths.min()):
        return False
    alike = all(problem.segment_at(a) == problem.segment_at(b) for a, b in zip(one[:3:2], other[:3:2], strict=True))
    return alike and all(abs(a - b) < near for a, b in zip(one[1:4:2], other[1:4:2], strict=True))


def _pushes(problem: MixedProblem, minimum: Minimum) -> FloatArray:
    """With what (k,) each pair pushes, D w / l^2."""
    where = problem.block_slices().get("pairs")
    return np.empty(0) if where is None else -minimum.rows[where]


def _pushing(problem: MixedProblem, minimum: Minimum) -> list[Pair]:
    """The pairs that push, where they have gone."""
    push = _pushes(problem, minimum)
    least = max(_PUSHES, _CLEARLY * float(push.max(initial=0.0)))
    return [pair for pair, force in zip(_slid(problem, minimum.x), push, strict=True) if force > least]


def rows_of(old: MixedProblem, fresh: MixedProblem, minimum: Minimum) -> FloatArray:
    """Multipliers of the rows of `fresh`: those of `old` of the same rows, of pairs that are the same."""
    rows = np.zeros(fresh.row_count)
    here, there = fresh.block_slices(), old.block_slices()
    glue = fresh.row_count - sum(block.count for block in fresh.blocks().values())
    rows[:glue] = minimum.rows[:glue]
    for name, where in there.items():
        if name != "pairs" and name in here:
            rows[here[name]] = minimum.rows[where]
    known = list(zip(_slid(old, minimum.x), _pushes(old, minimum), strict=True))
    for k, pair in enumerate(fresh.pairs):
        for place, push in known:
            if nearness.same(fresh, pair, place):
                rows[here["pairs"].start + k] = -push
    return rows


def _again(
    old: MixedProblem, fresh: MixedProblem, minimum: Minimum, options: dict[str, Any] | None, progress: Progress | None
) -> Minimum:
    """The equilibrium with other pairs, from the one before: with its multipliers, and else without."""
    warm = choose.minimise(
        fresh, minimum.x, {"max_iter": _WARM, **(options or {})}, progress,
        (rows_of(old, fresh, minimum), minimum.multipliers),
    )  # fmt: skip
    if warm.residual <= RESIDUAL_TOLERANCE:
        return warm
    cold = relax.from_near(fresh, minimum.x, {"max_iter": _COLD, **(options or {})}, progress)
    return replace(cold, iterations=cold.iterations + warm.iterations, seconds=cold.seconds + warm.seconds)


def let_go(problem: MixedProblem, minimum: Minimum) -> tuple[MixedProblem, Minimum]:
    """Without the pairs that do not push: the same equilibrium."""
    if not problem.pairs:
        return problem, minimum
    fewer = problem.with_changes(pairs=tuple(_pushing(problem, minimum)))
    fewer.counters.add(problem.counters)
    rows = rows_of(problem, fewer, minimum)
    residual = kkt_residual(fewer, minimum.x, minimum.multipliers, rows)
    if residual > RESIDUAL_TOLERANCE:
        return problem, minimum
    return fewer, replace(minimum, rows=rows, residual=residual)
