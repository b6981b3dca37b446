r"""What keeps parts of a strip from each other along a branch, where the places that touch slide over it.

Of the rows of pairs (`ribbon.problems.itself.pairs`) those in force stand in the branch's equations: the gap between
the nearest places is the distance to be kept, and pushes. As these places are where the gap is least, its derivative by
them vanishes, and they slide with the shape. Four things end one set of rows:

    a gap closes    the least gap of all places that have no row passes zero: a row comes into force
    a pair opens    its push passes zero: the row goes out of force
    it slides over  a place comes to a joint: the row goes over to the next segment, and says the same there
    it spreads      the gap g(s, s') bends no more along its pair, ``g_ss - g_ss'^2 / g_s's' = 0``: beyond, the parts
                    lie along each other. No row of one place is for that, and the branch ends

(the first is the condition of an exchange method: R. Hettich and K. Kortanek 1993, doi:10.1137/1035089; the last one
that of a strict minimum of the gap.) What touches has an interior least gap, of parts that face each other
(`ribbon.judge.nearness`): a shape that begins clear of itself never goes through itself on the way.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ribbon.judge import nearness
from ribbon.problems.itself.pairs import Pair
from ribbon.problems.mixed import MixedProblem

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

#: Gap (l) up to which parts are looked for, and above which it is told as that.
FAR = 0.1
#: Gap (l) up to which pairs come into force together: of one ruling's ends the same to rounding.
TOGETHER = 1e-9
#: Part of a segment within which places pass a joint together, and by which a search begins behind it.
_PASSES, _INSIDE = 1e-6, 0.02
#: Segments within which a gap that closes is beside a pair that pushes: they lie along each other.
_BESIDE = 2.0
#: What happens where they do, from where no branch is followed.
SPREAD = "its parts come to lie along each other"


def slid(problem: MixedProblem, x: FloatArray) -> tuple[Pair, ...]:
    """The pairs of a problem at x (n,), where their places have gone."""
    if not problem.pairs:
        return ()
    places = problem.pair_rows().places(x)
    return tuple(pair.at(place) for place, pair in zip(places, problem.pairs, strict=True))


def unheld(problem: MixedProblem, x: FloatArray, below: float = FAR) -> list[tuple[float, Pair]]:
    """Gaps (l) smaller than `below` over what parts are to keep, and the places, the nearest first, that have no row
    of their own in the problem."""
    known = slid(problem, x)
    found: list[tuple[float, Pair]] = []
    near = nearness.minima(problem, x, below)
    for gap, pair in sorted([*near, *_across(problem, x, [*known, *(pair for _, pair in near)], below)]):
        if not any(nearness.same(problem, pair, other) for other in (*known, *(one for _, one in found))):
            found.append((gap, pair))
    return found


def _across(problem: MixedProblem, x: FloatArray, pairs: list[Pair], below: float) -> list[tuple[float, Pair]]:
    """Gaps smaller than `below`, and the places, that are least at the edges beside pairs: rulings that are nearly
    parallel may be nearest at both ends, nearer to each other along the strip than rulings are sampled."""
    edge = problem.half_width
    begun: list[Pair] = []
    for pair in pairs:
        if not pair.held:
            begun += [pair._replace(u=-edge), pair._replace(u=edge)]
            begun += [pair._replace(u_other=-edge), pair._replace(u_other=edge)]
    gaps, places = nearness.narrowed(problem, x, begun)
    return [(float(gap), pair) for gap, pair in zip(gaps, places, strict=True) if gap < below]


def least(problem: MixedProblem, x: FloatArray) -> float:
    """The least gap (l) beyond the distance to be kept of all places without a row, at most `FAR`."""
    return min((gap for gap, _ in unheld(problem, x)), default=FAR)


def sliding(problem: MixedProblem, x: FloatArray, active: BoolArray) -> FloatArray:
    """How far (2 k,) both places of every pair in force, active (k,), are inside their segments, over these; 1 where
    there is no joint that they could pass."""
    if not problem.pairs:
        return np.zeros(0)
    rows = problem.pair_rows()
    share = (rows.free_places(x) - np.cumsum(np.append(0.0, problem.lengths))[rows.segments.T]) / rows.long
    back = np.array([[problem.beside(int(i), -1) is not None for i in pair] for pair in rows.segments.T])
    on = np.array([[problem.beside(int(i), 1) is not None for i in pair] for pair in rows.segments.T])
    inside = np.minimum(np.where(back, share, 1.0), np.where(on, 1.0 - share, 1.0))
    return np.asarray(np.where(active[:, None], inside, 1.0).ravel())


def bends(problem: MixedProblem, x: FloatArray, active: BoolArray) -> FloatArray:
    """How the gap of every pair in force bends (k,) along it, over 1/l; 1 where it is not in force."""
    if not problem.pairs:
        return np.zeros(0)
    return np.asarray(np.where(active, problem.pair_rows().bulge(x), 1.0))


def closed(problem: MixedProblem, x: FloatArray) -> tuple[Pair, ...]:
    """The pairs that come into force where the least gap without a row is none; none where they lie along one that is
    there."""
    found = [pair for gap, pair in unheld(problem, x, TOGETHER)]
    near = _BESIDE * float(problem.lengths.max())
    for pair in found:
        for other in slid(problem, x):
            if abs(pair.s - other.s) < near and abs(pair.s_other - other.s_other) < near and _alike(pair, other):
                return ()
    return tuple(found)


def _alike(one: Pair, other: Pair) -> bool:
    """Whether two pairs are at the same edges of their rulings."""
    return one.u * other.u >= 0.0 and one.u_other * other.u_other >= 0.0


def gone_over(problem: MixedProblem, x: FloatArray, number: int, ahead: FloatArray) -> tuple[tuple[Pair, ...], str]:
    """The pairs, those whose places pass a joint as the one with this number of `sliding` does begun in the next
    segments, and in words; ahead (n,): a shape a little further along the branch, x (n,) where there is none."""
    rows, starts = problem.pair_rows(), np.cumsum(np.append(0.0, problem.lengths))
    here, there = rows.free_places(x), rows.free_places(ahead)
    pairs, at = list(problem.pairs), 0.0
    for k, pair in enumerate(problem.pairs):
        place = [pair.s, pair.u, pair.s_other, pair.u_other]
        for side in range(2):
            i = int(rows.segments[side, k])
            step = 1 if here[k, side] - starts[i] > 0.5 * problem.lengths[i] else -1
            joint = starts[i + 1] if step > 0 else starts[i]
            near = abs(here[k, side] - joint) <= _PASSES * problem.lengths[i]
            asked = 2 * k + side == number
            beside = problem.beside(i, step)
            if beside is None or not (asked or (near and step * (there[k, side] - here[k, side]) > 0.0)):
                continue
            inside = _INSIDE * problem.lengths[beside]
            place[2 * side] = float(starts[beside] + inside if step > 0 else starts[beside + 1] - inside)
            at = float(joint) if asked else at
        pairs[k] = pair.at(np.array(place))
    return tuple(pairs), f"a contact with itself slides over s = {at:.3g} l"


def on_edges(problem: MixedProblem, pairs: tuple[Pair, ...]) -> tuple[Pair, ...]:
    """The pairs, those that are at ends of parallel rulings on the edges of the problem, whose width may be another."""
    edge = problem.half_width
    return tuple(
        pair._replace(u=float(np.copysign(edge, pair.u)), u_other=float(np.copysign(edge, pair.u_other)))
        if pair.held and not problem.round else pair
        for pair in pairs
    )  # fmt: skip


def named(pairs: tuple[Pair, ...], what: str) -> str:
    """What happens to pairs, in words."""
    places = dict.fromkeys(f"s = {pair.s:.3g} l and {pair.s_other:.3g} l" for pair in pairs)
    return f"its parts at {', '.join(places)} {what}"
