"""Parts of a strip kept from each other: self-contact, by an exchange of places.

Of a round rod what is held is a fixed set first, the stations of lines (`ribbon.judge.strands`), and places that slide
only where strands cross; between two stations whose gap is not what it may be places are then found by halving.

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
from ribbon.judge import layers, nearness, strands
from ribbon.problems.itself import over
from ribbon.problems.itself.pairs import Pair
from ribbon.problems.mixed import MixedProblem
from ribbon.result import Equilibrium
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
#: Part of the distance to be kept up to which strands farther than that from each other have their rows too.
_BAND = 0.25
#: Part of a segment by which rows are beside a place of its own, at the least.
_NEAREST = 2e-2
#: How far a place of strands in contact may go in a step, over the distance to be kept.
TRAVEL = 0.25
#: Times that places go over to the segments that they are in.
_GONE = 4
#: Iterations of Newton's method beside an equilibrium, and without its multipliers.
_WARM, _COLD = 60, 150


def kept(
    problem: MixedProblem, minimum: Minimum, options: dict[str, Any] | None = None, progress: Progress | None = None
) -> tuple[MixedProblem, Minimum]:
    """The problem with the pairs that an equilibrium `minimum` of it needs, and the equilibrium then; where none is
    found within the tolerance, the one whose parts are least too near."""
    if not problem.apart or not minimum.residual <= RESIDUAL_TOLERANCE:
        return problem, minimum
    if problem.round:
        return _strands_kept(problem, minimum, options, progress)
    if layers.is_through(problem, minimum.x):  # as below, and soon: hundreds of places of a coil are not looked for
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
    return _once(*let_go(*best), options, progress)


def _once(
    problem: MixedProblem, minimum: Minimum, options: dict[str, Any] | None, progress: Progress | None
) -> tuple[MixedProblem, Minimum]:
    """The equilibrium with one row for each place, on the segment that it is in; as it is where none is found so."""
    first = problem, minimum
    for _ in range(_GONE):
        push = _pushes(problem, minimum)
        gone = over.gone_over(problem.pair_rows(), minimum.x, push, problem.joined) if problem.pairs else None
        if gone is None:
            return problem, minimum
        fresh = problem.with_changes(pairs=tuple(pair.ordered() for pair in gone[0]))
        rows = rows_of(problem, fresh, minimum)
        rows[fresh.block_slices()["pairs"]] = -gone[1]
        again = choose.minimise(
            fresh, minimum.x, {"max_iter": _WARM, **(options or {})}, progress, (rows, minimum.multipliers)
        )
        if again.residual > RESIDUAL_TOLERANCE or _too_deep(fresh, again, nearness.TOLERANCE):
            return first
        fresh.counters.add(problem.counters)
        minimum = replace(
            again, iterations=again.iterations + minimum.iterations, seconds=again.seconds + minimum.seconds
        )
        problem = fresh
    return problem, minimum


def _strands_kept(
    problem: MixedProblem, minimum: Minimum, options: dict[str, Any] | None, progress: Progress | None
) -> tuple[MixedProblem, Minimum]:
    """As `kept`, of a round rod: by stations wherever strands nearly lie along each other, and then, where these are no
    lines and the gap between them is not what it may be, by places that slide."""
    found = _strands_held(problem, minimum, options, progress, sharp=False)
    if found[1].residual > RESIDUAL_TOLERANCE:
        return found
    if not _too_deep(*found) or not any(pair.stays for pair in found[0].pairs):
        return let_go(*found)
    placed = _placed(*found, options, progress)
    sharper = _strands_held(*placed, options, progress, sharp=True)
    tried = [sharper, placed, found]
    found_at = [one for one in tried if one[1].residual <= RESIDUAL_TOLERANCE]
    good = [one for one in found_at if not _too_deep(*one, nearness.TOLERANCE)]
    return let_go(*(good[0] if good else found))


def _placed(
    problem: MixedProblem, minimum: Minimum, options: dict[str, Any] | None, progress: Progress | None
) -> tuple[MixedProblem, Minimum]:
    """From stations to places between them: two rows more beside where the force of each pair of neighbouring stations
    is, nearer and nearer to it, until nothing is too deep. Stations stay, so that it is held wherever it goes."""
    h = float(problem.lengths.min())
    near = h / 8.0
    while near > _NEAREST * h and _too_deep(problem, minimum) and not spent():
        stations = [pair for _, pair in held(problem, minimum, _BAND * problem.apart, problem.pairs)]
        pushing = pushing_with(problem, minimum)
        rows, more = stations + [pair for pair, _ in pushing if not strands.is_station(problem, pair)], False
        for pair in strands.centres(problem, pushing, [pair for _, pair in nearness.least(problem, minimum.x, -DEPTH)]):
            for side in (-near, near):
                s, other = np.clip([pair.s + side, pair.s_other - side], 0.0, 1.0)
                other = pair._replace(s=float(s), s_other=float(other), stays=True)
                if all(abs(other.s - row.s) > 0.25 * near or abs(other.s_other - row.s_other) > h for row in rows):
                    rows.append(other)
                    more = True
        if not more:
            break
        fresh = problem.with_changes(pairs=tuple(rows))
        again = _again(problem, fresh, minimum, options, progress)
        again = replace(
            again, iterations=again.iterations + minimum.iterations, seconds=again.seconds + minimum.seconds
        )
        fresh.counters.add(problem.counters)
        if again.residual > RESIDUAL_TOLERANCE:
            break
        problem, minimum, near = fresh, again, 0.25 * near
    return problem, minimum


def _too_deep(problem: MixedProblem, minimum: Minimum, depth: float = DEPTH) -> bool:
    """Whether strands are nearer to each other than they may be by more than `depth` (l)."""
    return bool(nearness.minima(problem, minimum.x, -depth))


def _strands_held(
    problem: MixedProblem,
    minimum: Minimum,
    options: dict[str, Any] | None,
    progress: Progress | None,
    *,
    sharp: bool,
) -> tuple[MixedProblem, Minimum]:
    """The problem and the equilibrium with what is to be held, until none of it is nearer than it may be and each is
    where it is looked for."""
    lines: list[Pair] = []  # what has been one stays one, so that the rounds end
    for count in range(ROUNDS):
        if count or not sharp:
            lines += [pair for pair in _slid(problem, minimum.x) if pair.stays]
        wanted = held(problem, minimum, _BAND * problem.apart, lines if count or not sharp else (), sharp=sharp)
        depth = max((-gap for gap, _ in wanted), default=0.0)
        between = sharp and any(pair.stays and not strands.is_station(problem, pair) for pair in problem.pairs)
        if spent() or depth > _THROUGH * problem.apart or not (between or _to_solve(problem, minimum, wanted)):
            break
        fresh = problem.with_changes(pairs=tuple(pair for _, pair in wanted))
        again = _again(problem, fresh, minimum, options, progress)
        again = replace(
            again, iterations=again.iterations + minimum.iterations, seconds=again.seconds + minimum.seconds
        )
        fresh.counters.add(problem.counters)
        problem, minimum = fresh, again
        if again.residual > RESIDUAL_TOLERANCE:
            break
    return problem, minimum


def _to_solve(problem: MixedProblem, minimum: Minimum, wanted: list[tuple[float, Pair]]) -> bool:
    """Whether the pairs wanted, with their gaps, tell that the equilibrium is none of them: one that is not held is too
    deep, one that is held is on another segment."""
    known = _slid(problem, minimum.x)
    if known and bool(problem.pair_rows().beyond(minimum.x).any()):
        return True
    return any(gap < -DEPTH and not any(strands.alike(problem, pair, other) for other in known) for gap, pair in wanted)


def held(
    problem: MixedProblem, minimum: Minimum, below: float, known: Iterable[Pair] = (), *, sharp: bool = False
) -> list[tuple[float, Pair]]:
    """Gaps and pairs of strands nearer than `below` beyond what they keep, and of what pushes; known: of lines."""
    pushing = _pushing(problem, minimum)
    wanted = strands.places(problem, minimum.x, below, known, sharp=sharp)
    single = [pair for _, pair in wanted if not pair.stays]
    lines = [pair for _, pair in wanted if pair.stays]
    for pair in pushing:
        if pair.stays:
            replaced = not strands.is_station(problem, pair) or strands.beside_any(problem, pair, single)
        else:
            replaced = strands.beside_any(problem, pair, lines)
        if not replaced and not any(strands.alike(problem, pair, other) for _, other in wanted):
            wanted.append((0.0, pair))
    return wanted


def _slid(problem: MixedProblem, x: FloatArray) -> list[Pair]:
    """The pairs where they have gone."""
    if not problem.pairs:
        return []
    places = problem.pair_rows().places(x)
    return [pair.at(place) for place, pair in zip(places, problem.pairs, strict=True)]


def carried(problem: MixedProblem, old: MixedProblem, x: FloatArray) -> tuple[Pair, ...]:
    """The pairs of an equilibrium x (n,) of `old`, for a problem beside it."""
    if not problem.round:
        return around(problem, old.pairs)
    slid = _slid(old, x)
    if not slid or not np.array_equal(old.lengths, problem.lengths):
        return tuple(slid)
    return tuple(pair for _, pair in strands.places(old, x, _BAND * problem.apart, slid))


def _with(problem: MixedProblem, minimum: Minimum, near: list[Pair]) -> MixedProblem:
    """The problem with more pairs, those that push where they have gone; where one of these is held across the strip
    beside a nearer one, that one instead."""
    return problem.with_changes(pairs=around(problem, [*near, *_pushing(problem, minimum)]))


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


def _pushes(problem: MixedProblem, minimum: Minimum | Equilibrium) -> FloatArray:
    """With what (k,) each pair pushes, D w / l^2."""
    where = problem.block_slices().get("pairs")
    return np.empty(0) if where is None else -minimum.rows[where]


def pushing_with(problem: MixedProblem, minimum: Minimum | Equilibrium) -> list[tuple[Pair, float]]:
    """The pairs that push, where they have gone, and with what (D w / l^2)."""
    push = _pushes(problem, minimum)
    least = max(_PUSHES, _CLEARLY * float(push.max(initial=0.0)))
    return [(pair, float(f)) for pair, f in zip(_slid(problem, minimum.x), push, strict=True) if f > least]


def _pushing(problem: MixedProblem, minimum: Minimum) -> list[Pair]:
    """The pairs that push, where they have gone."""
    return [pair for pair, _ in pushing_with(problem, minimum)]


def rows_of(old: MixedProblem, fresh: MixedProblem, minimum: Minimum | Equilibrium) -> FloatArray:
    """Multipliers of the rows of `fresh`: those of `old` of the same rows, of pairs that are the same; what pushed at
    one place is shared by stations beside it."""
    rows = np.zeros(fresh.row_count)
    here, there = fresh.block_slices(), old.block_slices()
    glue = fresh.row_count - sum(block.count for block in fresh.blocks().values())
    rows[:glue] = minimum.rows[:glue]
    for name, where in there.items():
        if name != "pairs" and name in here:
            rows[here[name]] = minimum.rows[where]
    known = list(zip(_slid(old, minimum.x), _pushes(old, minimum), strict=True))
    alike = strands.alike if fresh.round else nearness.same
    push = np.zeros(len(fresh.pairs))
    for place, force in known:
        same = [k for k, pair in enumerate(fresh.pairs) if alike(fresh, pair, place)]
        if not same and fresh.round:
            same = [k for k, pair in enumerate(fresh.pairs) if strands.beside_any(fresh, pair, [place])]
            force = force / max(len(same), 1)
        push[same] = force
    if fresh.pairs:
        rows[here["pairs"]] = -push
    return rows


def _again(
    old: MixedProblem, fresh: MixedProblem, minimum: Minimum, options: dict[str, Any] | None, progress: Progress | None
) -> Minimum:
    """The equilibrium with other pairs, from the one before: with its multipliers, and else without."""
    travel = {"travel": TRAVEL * fresh.apart} if fresh.round and fresh.pairs else {}
    warm = choose.minimise(
        fresh, minimum.x, {"max_iter": _WARM, **travel, **(options or {})}, progress,
        (rows_of(old, fresh, minimum), minimum.multipliers),
    )  # fmt: skip
    if warm.residual <= RESIDUAL_TOLERANCE or (fresh.round and old.pairs):
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
