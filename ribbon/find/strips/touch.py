"""Strips kept from each other: contact between them, by short steps and an exchange of places (`ribbon.find.apart`).

Strips go downhill from where they begin, and all that could meet before the next look is held apart. A step in which no
place goes farther than an eighth of the distance that they keep leads none through another; after longer ones their way
is looked at, and gone again shorter where something passed. Where they are near each
other because a joint joins them they are not looked at: within `BESIDE` widths of it. A strip that is kept from itself
is looked at as two, between places that face each other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations, combinations_with_replacement

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon.judge import nearness
from ribbon.problems.itself import over
from ribbon.problems.itself.pairs import Pair
from ribbon.problems.strips.between import BetweenRows, Touching
from ribbon.problems.strips.joint import End
from ribbon.problems.strips.part import Part
from ribbon.problems.strips.problem import StripsProblem
from ribbon.solvers import newton_rows
from ribbon.solvers.budget import spent
from ribbon.solvers.problem import RESIDUAL_TOLERANCE, Minimum, kkt_residual

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Furthest (l_0) that an equilibrium's strips are nearer to each other than they may be, and what a look corrects.
TOLERANCE, DEPTH = 1e-6, 0.3e-6
#: Widths (of the wider strip) along both strips from a joint that joins them, within which they are not looked at.
BESIDE = 3.0
#: How far a place may go in a step, over the distance to be kept; steps between two looks; looks.
_TRAVEL, _STEPS, _LOOKS = 0.125, 3, 1200
#: The same of strips that touch, and part of a segment that places of them may go along it between two looks; part of
#: the distance by which strips come nearer, at the least, between two looks on their way.
_TOUCHING, _ALONG_SEGMENT, _LOOKED_AT = 1.0, 0.3, 0.25
#: Part of the way of a look that is left of the last two where the second one went back.
_BACK = 0.25
#: How far (l_0) it may go at the most where nothing could meet before the next look.
_FARTHEST = 0.01
#: Places of a segment that are looked at for how far it went.
_LOOKED = 8
_MOST = 64
#: Depth over the distance to be kept from which strips may have gone through each other, and nothing brings them back.
_THROUGH = 0.6
#: The same from which a look is gone again with steps half as long, and the shortest, over the first ones.
_DEEP, _SHORTEST = 0.1, 1e-2
#: Rounds of the exchange at an equilibrium, and iterations of each.
_ROUNDS, _WARM = 25, 150
#: Push (D_0 w_0 / l_0^2) of a pair that is let go, and part of the largest one.
_PUSHES, _CLEARLY = 1e-9, 1e-7
#: Times that a pair is put on the segment next to its own; where it begins there; near a joint: both, of a segment.
_PASSED, _INSIDE, _NEAR = 4, 0.02, 0.35
#: Part of a strip's length from its end at which a place is at the end.
_ENDED = 1e-12


def minima(problem: StripsProblem, x: FloatArray, below: float) -> list[tuple[float, Touching]]:
    """Gaps (l_0) between different strips, and far parts of one where these are kept apart too (`problem.itself`), over
    what they are to keep, where least, as far as they are smaller than `below`; and between which places."""
    found: list[tuple[float, Touching]] = []
    sampled = [_Sampled.of(problem, x, k) for k in range(len(problem.parts))]
    looked_at = combinations_with_replacement if problem.itself else combinations
    for one, other in looked_at(range(len(problem.parts)), 2):
        pairs = _beginnings(problem, sampled, one, other, problem.apart + below)
        gaps, places = narrowed(problem, x, one, other, pairs)
        if places:  # what has slid to a joint is not looked at either
            along = np.array([[pair.s, pair.s_other] for pair in places])
            far = _far(problem, sampled, one, other, along[:, 0], along[:, 1])
            gaps, places = gaps[far], [pair for pair, kept in zip(places, far, strict=True) if kept]
        found_here: list[Pair] = []
        for k in np.argsort(gaps, kind="stable"):
            if gaps[k] < below and not any(_same(problem, one, other, places[k], known) for known in found_here):
                found_here.append(places[k])
                found.append((float(gaps[k]), Touching(one, other, places[k])))
    return sorted(found, key=lambda each: each[0])


class _Sampled:
    """A strip at abscissae s (n,): positions r (n, 3) in l_0, half rulings (n, 3), by how much (n,) its normals have
    turned up to there; step: the greatest between."""

    def __init__(self, s: FloatArray, r: FloatArray, ruling: FloatArray, turned: FloatArray, step: float) -> None:
        self.s, self.r, self.ruling, self.turned, self.step = s, r, ruling, turned, step

    @classmethod
    def of(cls, problem: StripsProblem, x: FloatArray, k: int) -> _Sampled:
        part, sigma, own = problem.parts[k], problem.lengths_over[k], problem.own(x, k)
        s = nearness.abscissae(part, own)
        r, ruling, turned, _ = nearness.shape(part, own, s)
        return cls(s, sigma * r, sigma * part.half_width * ruling, turned, sigma * float(np.diff(s).max()))


def _beginnings(problem: StripsProblem, sampled: list[_Sampled], one: int, other: int, reach: float) -> list[Pair]:
    """Pairs of places near each other, where the distance of rulings is least among their neighbours."""
    a, b = sampled[one], sampled[other]
    wide = float(np.linalg.norm(a.ruling, axis=1).max() + np.linalg.norm(b.ruling, axis=1).max())
    near = scipy.spatial.cKDTree(a.r).query_ball_tree(scipy.spatial.cKDTree(b.r), reach + wide + a.step + b.step)
    i = np.repeat(np.arange(len(near)), [len(each) for each in near])
    j = np.array([k for each in near for k in each], dtype=np.int64)
    far = _far(problem, sampled, one, other, a.s[i], b.s[j]) if i.size else np.zeros(0, dtype=bool)
    i, j = i[far], j[far]
    if not i.size:
        return []
    both = np.vstack([a.ruling, b.ruling])
    distance, u, v = nearness.between_rulings(np.vstack([a.r, b.r]), both, i, j + len(a.s), 1.0)
    least = (distance < reach + a.step + b.step) & nearness.is_least(distance, i, j + len(a.s), len(a.s) + len(b.s))
    found: list[Pair] = []
    half = problem.parts[one].half_width, problem.parts[other].half_width
    for k in np.flatnonzero(least):
        s, s_other = float(a.s[i[k]]), float(b.s[j[k]])
        first, second = (ruling / np.linalg.norm(ruling) for ruling in (a.ruling[i[k]], b.ruling[j[k]]))
        sine = float(np.linalg.norm(np.cross(first, second)))
        if sine > nearness.PARALLEL:
            found.append(Pair(s, float(u[k]) * half[0], s_other, float(v[k]) * half[1]))
        if sine < nearness.ALONG:
            middles = float(a.r[i[k]] @ first), float(b.r[j[k]] @ first)
            widths = float(np.linalg.norm(a.ruling[i[k]])), float(np.linalg.norm(b.ruling[j[k]]))
            places = nearness.beside(middles, widths, float(first @ second))
            found += [Pair(s, p * half[0], s_other, q * half[1], True) for p, q in places]
    return found


def _far(
    problem: StripsProblem, sampled: list[_Sampled], one: int, other: int, s: FloatArray, s_other: FloatArray
) -> NDArray[np.bool_]:
    """Which places of two strips, or first and second ones of one, are looked at: not beside a joint of both; of one
    strip those that face each other, as its normals turn between them (`ribbon.judge.nearness`)."""
    far = ~joined(problem, one, other, s, s_other)
    if one == other:
        own = sampled[one]
        first, second = np.interp(s, own.s, own.turned), np.interp(s_other, own.s, own.turned)
        far &= nearness.facing(problem.parts[one], first, second, float(own.turned[-1]))
    return far


def joined(problem: StripsProblem, one: int, other: int, s: FloatArray, s_other: FloatArray) -> NDArray[np.bool_]:
    """Whether places are beside ends of both strips that stand at one place."""
    group = _places(problem)
    near = np.zeros(s.shape, dtype=bool)
    width = max(2.0 * problem.lengths_over[k] * problem.parts[k].half_width for k in (one, other))
    for end in (0, -1):
        for end_other in (0, -1):
            if (one, end) == (other, end_other):
                continue  # one end of one strip: what is beside it there faces nothing
            if group[End(one, end)] == group[End(other, end_other)]:
                along = problem.lengths_over[one] * (s if end == 0 else 1.0 - s)
                along_other = problem.lengths_over[other] * (s_other if end_other == 0 else 1.0 - s_other)
                near |= np.maximum(along, along_other) < BESIDE * width
    return near


def _places(problem: StripsProblem) -> dict[End, int]:
    """Which ends joints hold at one place: a number for each end, the same for those."""
    group = {End(k, end): 2 * k + (end != 0) for k in range(len(problem.parts)) for end in (0, -1)}
    for joint in problem.joints:
        one, other = group[joint.one], group[joint.other]
        group = {end: one if number == other else number for end, number in group.items()}
    return group


def narrowed(
    problem: StripsProblem, x: FloatArray, one: int, other: int, pairs: list[Pair]
) -> tuple[FloatArray, list[Pair]]:
    """Gaps (k,) of the nearest places beside pairs of two strips, and these places; those that still slide over a
    joint are nearest elsewhere."""
    if not pairs:
        return np.empty(0), []
    parts = problem.parts[one], problem.parts[other]
    for _ in range(_PASSED):
        rows = problem.with_changes(touching=tuple(Touching(one, other, pair) for pair in pairs)).between(one, other)
        places, beyond = rows.places(x), rows.beyond(x)
        passed, moved = False, []
        for k, pair in enumerate(pairs):
            at = places[k].copy()
            for side, part in enumerate(parts):
                past = int(beyond[k, side])
                beside = part.beside(int(rows.segments[side, k]), past) if past else None
                if beside is not None:
                    at[2 * side] = inside(part, beside, past)
                    passed = True
            moved.append(pair.at(at))
        if not passed:
            break
        pairs = moved
    gaps = rows.gaps(x)
    found = [pair.at(place) for pair, place in zip(pairs, places, strict=True)]
    along = np.array([[pair.s, pair.s_other] for pair in found])
    ended = (np.minimum(along, 1.0 - along) < _ENDED) | (beyond == 0)
    least = ended.all(axis=1)
    for k in np.flatnonzero(~least):
        least[k] = not any(_beside(parts, found[k], found[m]) for m in np.flatnonzero(least))
    return gaps[least], [pair for pair, inside in zip(found, least, strict=True) if inside]


def _beside(parts: tuple[Part, Part], pair: Pair, known: Pair) -> bool:
    """Whether two pairs are no farther from each other than two segments and half of half a width, on both strips."""
    along = zip(parts, (pair.s, pair.s_other), (known.s, known.s_other), strict=True)
    across = zip(parts, (pair.u, pair.u_other), (known.u, known.u_other), strict=True)
    return all(abs(part.segment_at(s) - part.segment_at(t)) <= 2 for part, s, t in along) and all(
        abs(u - v) <= 0.5 * part.half_width for part, u, v in across
    )


def inside(part: Part, segment: int, step: int) -> float:
    """Where a place begins that goes over to a segment."""
    starts = np.concatenate([[0.0], np.cumsum(part.lengths)])
    inside = _INSIDE * part.lengths[segment]
    return float(starts[segment] + inside if step > 0 else starts[segment + 1] - inside)


def _same(problem: StripsProblem, one: int, other: int, pair: Pair, known: Pair) -> bool:
    near = [0.05 * float(problem.parts[k].lengths.min()) for k in (one, other)]
    wide = [0.1 * problem.parts[k].half_width for k in (one, other)]
    room = (near[0], wide[0], near[1], wide[1])
    return all(abs(a - b) < most for a, b, most in zip(pair[:4], known[:4], room, strict=True))


def around(problem: StripsProblem, touching: list[Touching]) -> tuple[Touching, ...]:
    """Pairs, each once, and those on the segments next to theirs where they are near a joint of segments."""
    found: list[Touching] = []

    def places(part: Part, s: float) -> list[float]:
        i = part.segment_at(s)
        share = (s - float(part.lengths[:i].sum())) / part.lengths[i]
        own = [s]
        for step, near in ((-1, share < _NEAR), (1, share > 1.0 - _NEAR)):
            beside = part.beside(i, step) if near else None
            if beside is not None:
                own.append(inside(part, beside, step))
        return own

    for touch in touching:
        parts = problem.parts[touch.one], problem.parts[touch.other]
        for s in places(parts[0], touch.pair.s):
            for s_other in places(parts[1], touch.pair.s_other):
                fresh = touch._replace(pair=touch.pair._replace(s=s, s_other=s_other))
                if not any(_alike(parts, fresh, known) for known in found):
                    found.append(fresh)
    return tuple(sorted(found, key=lambda each: (each.one, each.other)))


def _alike(parts: tuple[Part, Part], one: Touching, other: Touching) -> bool:
    """Whether two pairs are looked for on the same segments, near the same places across."""
    if (one.one, one.other) != (other.one, other.other):
        return False
    a, b = one.pair, other.pair
    segments = all(
        part.segment_at(s) == part.segment_at(t)
        for part, s, t in zip(parts, (a.s, a.s_other), (b.s, b.s_other), strict=True)
    )
    across = zip(parts, (a.u, a.u_other), (b.u, b.u_other), strict=True)
    return segments and all(abs(u - v) < 0.2 * part.half_width for part, u, v in across)


def _slid(problem: StripsProblem, x: FloatArray, rows: FloatArray | None) -> list[tuple[Touching, float]]:
    """The pairs where they have gone, each with its push."""
    found = []
    for name, where in problem.block_slices().items():
        block = problem.blocks()[name]
        if isinstance(block, BetweenRows):
            one, other = (int(word) for word in name.split("_")[1:])
            push = np.zeros(block.count) if rows is None else -rows[where]
            for pair, place, force in zip(block.pairs, block.places(x), push, strict=True):
                found.append((Touching(one, other, pair.at(place)), float(force)))
    return found


def _pushing(problem: StripsProblem, point: Minimum) -> list[Touching]:
    slid = _slid(problem, point.x, point.rows)
    least = max(_PUSHES, _CLEARLY * max((push for _, push in slid), default=0.0))
    return [touch for touch, push in slid if push > least]


def rows_of(old: StripsProblem, fresh: StripsProblem, point: Minimum) -> FloatArray:
    """Multipliers of the rows of `fresh`: those of `old` of the same rows, of pairs that are the same."""
    rows = np.zeros(fresh.row_count)
    same = fresh.joint_rows.stop
    rows[:same] = point.rows[:same]
    known = _slid(old, point.x, point.rows)
    for name, where in fresh.block_slices().items():
        block = fresh.blocks()[name]
        if isinstance(block, BetweenRows):
            one, other = (int(word) for word in name.split("_")[1:])
            for k, pair in enumerate(block.pairs):
                for touch, push in known:
                    if (touch.one, touch.other) == (one, other) and _same(fresh, one, other, pair, touch.pair):
                        rows[where.start + k] = -push
    return rows


def downhill(
    problem: StripsProblem, x: FloatArray, until: Callable[[StripsProblem, FloatArray], object] | None = None
) -> tuple[StripsProblem, Minimum]:
    """The problem with the pairs of places that its equilibrium needs, and the equilibrium downhill of the unknowns x
    (n,), without strips that pass through each other; one that has not arrived where none is found, and where `until`
    is true of the unknowns on the way."""
    far, shorter, before = _TRAVEL * problem.apart, 1.0, None
    chosen: dict[str, float] = {"mu_init": 1e-5, "max_iter": _STEPS}
    point: Minimum | None = None
    iterations, seconds = 0, 0.0
    for _ in range(_LOOKS):
        travel, near = _ahead(problem, x, far)
        reach = 2.0 * travel * _STEPS
        if near and near[0][0] < -_DEEP * problem.apart and before is not None and shorter > _SHORTEST:
            (problem, x, point), before, shorter = before, None, 0.5 * shorter  # with shorter steps
            chosen["max_iter"] = _STEPS
            continue
        if near and near[0][0] < -_THROUGH * problem.apart:  # they may come out on the other side
            return problem, replace(point or newton_rows.minimise(problem, x, {"max_iter": 0}), residual=np.inf)
        travel *= shorter
        chosen["travel"], limits = travel, problem.limits(travel)
        fresh = problem.with_changes(touching=around(problem, [touch for _, touch in near]))
        warm = None if point is None else (rows_of(problem, fresh, point), point.multipliers)
        went = newton_rows.minimise(fresh, x, chosen, None, warm)
        iterations, seconds = iterations + went.iterations, seconds + went.seconds
        if (travel > _TRAVEL * problem.apart or chosen["max_iter"] > _STEPS) and _astray(fresh, x, went.x, reach):
            far, chosen["max_iter"] = 0.25 * travel, _STEPS
            continue
        moved = float((np.abs(went.x - x) / limits).max())  # of a step's length
        # so few steps from a barrier as it begins with can end off what strips lie on, and the next ones back on it
        back = before is not None and float((np.abs(went.x - before[1]) / limits).max()) < _BACK * moved
        before, point = (problem, x, point), went
        problem, x = fresh, point.x
        chosen["max_iter"] = _STEPS if moved > 1.0 and not back else min(2 * int(chosen["max_iter"]), _MOST)
        far = min(2.0 * travel, _FARTHEST) if moved > 1.0 else travel
        shorter = min(1.0, 1.2 * shorter)
        if until is not None and until(problem, x):
            break
        if point.finished or point.residual <= RESIDUAL_TOLERANCE or spent() or not np.all(np.isfinite(x)):
            break
        if point.code not in (newton_rows.SOLVED, newton_rows.MOST):
            point = None
            chosen["mu_init"] = 1e-4
    if point is None:
        point = newton_rows.minimise(problem, x, chosen)
    return problem, replace(point, iterations=iterations, seconds=seconds)


def _ahead(problem: StripsProblem, x: FloatArray, far: float) -> tuple[float, list[tuple[float, Touching]]]:
    """How far (l_0) a place may go in a step from the unknowns x (n,), and the pairs of places that could meet before
    the next look. A step is `far` where none could; else as far as the nearest are from meeting, or, where they are
    nearer than that, what strips that touch may go, whose way is looked at afterwards (`_astray`)."""
    least = _TRAVEL * problem.apart
    segment = min(sigma * float(p.lengths.min()) for p, sigma in zip(problem.parts, problem.lengths_over, strict=True))
    touching = min(_TOUCHING * problem.apart, _ALONG_SEGMENT * segment / (2.0 * _STEPS))
    far = max(far, least)
    near = minima(problem, x, 2.0 * far * _STEPS)
    free = near[0][0] if near else 2.0 * far * _STEPS
    travel = max(least, min(far, max(free / (2.0 * _STEPS), touching)))
    return travel, [each for each in near if each[0] <= 2.0 * travel * _STEPS]


def _astray(problem: StripsProblem, x: FloatArray, other: FloatArray, reach: float) -> bool:
    """Whether strips went so far from the unknowns x to `other` (n,) that places which are not held, `reach` (l_0) or
    more beyond what they keep, could have met, or whether those which are held passed through each other on the
    straight way: by half as far at a time as the nearest are from that (conservative advancement, as in
    `ribbon.judge.passage`)."""
    went, deep = _farthest(problem, x, other), _THROUGH * problem.apart
    if not went <= reach:
        return True
    held = [block for block in problem.blocks().values() if isinstance(block, BetweenRows)]
    t = 0.0
    while held and t < 1.0:
        free = min(float(block.gaps(x + t * (other - x)).min()) for block in held) + deep
        if not free > 0.0:
            return True
        if free > went * (1.0 - t):
            return False
        t += max(0.5 * free, _LOOKED_AT * problem.apart) / went
    return False


def _farthest(problem: StripsProblem, x: FloatArray, other: FloatArray) -> float:
    """How far (l_0) places of the two strips that go farthest go together from the unknowns x to `other` (n,); with
    strips that touch themselves, two places of the one that does."""
    went = []
    for k, part in enumerate(problem.parts):
        s = np.linspace(0.0, 1.0, _LOOKED * part.lengths.size + 1)
        begin, end = (nearness.shape(part, problem.own(each, k), s) for each in (x, other))
        edges = [end.r - begin.r + side * part.half_width * (end.ruling - begin.ruling) for side in (-1.0, 1.0)]
        went.append(problem.lengths_over[k] * max(float(np.linalg.norm(edge, axis=1).max()) for edge in edges))
    return 2.0 * max(went) if problem.itself else sum(sorted(went)[-2:])


def kept(problem: StripsProblem, point: Minimum) -> tuple[StripsProblem, Minimum, float | None]:
    """The equilibrium with the places held apart that it needs, those that push nothing let go, and how far (l_0)
    strips are nearer to each other than they are kept; None where nothing keeps them."""
    if not problem.apart or not point.residual <= RESIDUAL_TOLERANCE:
        return problem, point, None
    best, least = (problem, point), np.inf
    for _ in range(_ROUNDS):
        near = minima(problem, point.x, -DEPTH)
        depth = max((-gap for gap, _ in near), default=0.0)
        if depth < least:
            best, least = (problem, point), depth
        if not near or spent() or depth > _THROUGH * problem.apart:
            break
        # what is looked up now first: a pair at the end of rulings side by side stays there, and may not be nearest
        touching = around(problem, [*(touch for _, touch in near), *_pushing(problem, point)])
        fresh = problem.with_changes(touching=touching)
        warm = rows_of(problem, fresh, point), point.multipliers
        again = newton_rows.minimise(fresh, point.x, {"max_iter": _WARM}, None, warm)
        if again.residual > RESIDUAL_TOLERANCE:
            again = newton_rows.minimise(fresh, point.x, {"max_iter": _WARM, "mu_init": 1e-5})
        if again.residual > RESIDUAL_TOLERANCE:
            break
        point = replace(again, iterations=again.iterations + point.iterations, seconds=again.seconds + point.seconds)
        problem = fresh
    return (*_once(*_let_go(*best)), least)


def _once(problem: StripsProblem, point: Minimum) -> tuple[StripsProblem, Minimum]:
    """The equilibrium with one row for each place, on the segment that it is in; as it is where none is found so."""
    first = problem, point
    for _ in range(_PASSED):
        touching, pushes, changed = [], [], False
        for name, where in problem.block_slices().items():
            block = problem.blocks()[name]
            if not isinstance(block, BetweenRows):
                continue
            one, other = (int(word) for word in name.split("_")[1:])
            gone = over.gone_over(block, point.x, -point.rows[where], ring=False)
            changed |= gone is not None
            pairs, push = gone or (block.pairs, -point.rows[where])
            touching += [Touching(one, other, pair) for pair in pairs]
            pushes.append(push)
        if not changed:
            return problem, point
        fresh = problem.with_changes(touching=tuple(touching))
        rows = rows_of(problem, fresh, point)
        slices = [
            where for name, where in fresh.block_slices().items() if isinstance(fresh.blocks()[name], BetweenRows)
        ]
        for where, push in zip(slices, pushes, strict=True):
            rows[where] = -push
        again = newton_rows.minimise(fresh, point.x, {"max_iter": _WARM}, None, (rows, point.multipliers))
        if again.residual > RESIDUAL_TOLERANCE or minima(fresh, again.x, -TOLERANCE):
            return first
        point = replace(again, iterations=again.iterations + point.iterations, seconds=again.seconds + point.seconds)
        problem = fresh
    return problem, point


def _let_go(problem: StripsProblem, point: Minimum) -> tuple[StripsProblem, Minimum]:
    """Without the pairs that do not push: the same equilibrium."""
    if not problem.touching:
        return problem, point
    fewer = problem.with_changes(touching=tuple(sorted(_pushing(problem, point), key=lambda each: each[:2])))
    rows = rows_of(problem, fewer, point)
    residual = kkt_residual(fewer, point.x, point.multipliers, rows)
    return (problem, point) if residual > RESIDUAL_TOLERANCE else (fewer, replace(point, rows=rows, residual=residual))
