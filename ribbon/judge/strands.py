"""Where a round rod's strands touch: at places of their own, or along lines.

Two strands that cross are nearest at one pair of places, which both slide. Two that lie along each other are nearest
nowhere: the gap g(s) = min_s' |r(s) - r(s')| - d is zero on an interval (docs/theory.md, eq. (5.18)), and what pushes
there is a force per length.
It is held at stations, the joints of the strand that comes first, each with the nearest place of the other strand,
which alone slides: a fixed set, one row for each joint. Shapes are cubic between joints in a small frame, so that their
values at joints are independent (interpolation by cubic splines is well posed), and so are the rows. A second set on
the other strand, or places between joints, would repeat them.

Between two stations the gap is no better than the shape is: it is zero at both, and below it by O(h^4 p) under a force
per length p, O(h^3 F) beside a force F at which a line ends. That is what `ribbon.judge.nearness` finds, and says.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon.judge import nearness
from ribbon.problems.itself.pairs import Pair
from ribbon.problems.mixed import MixedProblem

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

#: Segments by which the places of neighbouring stations of a line may be farther from each other than those are.
_NEXT = 2.0
#: Segments up to which a place of its own is one of a line's.
_BESIDE = 1.1
#: Sag (l) of the gap between two stations up to which strands lie along each other.
FLAT = 3e-6
#: Squared sine of an angle of strands below which a place where they cross may become two.
_CROSSING = 0.25
#: Part of the largest force from which a place is one that pushes.
_CLEARLY = 1e-3
#: Part of a segment up to which an abscissa is a joint's.
_AT = 1e-6


def places(
    problem: MixedProblem, x: FloatArray, below: float, known: Iterable[Pair] = (), *, sharp: bool = False
) -> list[tuple[float, Pair]]:
    """What keeps the strands of a round rod apart where they are nearer than `below` (l) beyond `problem.apart`: gaps
    (l) and pairs, of lines the stations.

    sharp: only what lies along each other to `FLAT` is a line; else all that crosses at less than a right angle's third
    or so (`_CROSSING`), for there a place soon becomes two. known: pairs by which strands were held before: a line of
    these stays one."""
    least = nearness.least(problem, x, below)
    if not least:
        return []
    gaps, stations = _stations(problem, x, below)
    before = [pair for pair in known if pair.stays]
    flat = _flat(problem, x, [pair for _, pair in least], sharp)
    own = [
        each for each, lies in zip(least, flat, strict=True) if not lies and not beside_any(problem, each[1], before)
    ]
    on_lines = [pair for (_, pair), lies in zip(least, flat, strict=True) if lies] + before
    taken: list[tuple[float, Pair]] = []
    for line in lines_of(problem, stations):
        if any(beside_any(problem, stations[k], on_lines) for k in line):
            taken += [(float(gaps[k]), stations[k]) for k in line]
    single = [pair for _, pair in own]
    return [*own, *((gap, pair) for gap, pair in taken if not beside_any(problem, pair, single))]


def _flat(problem: MixedProblem, x: FloatArray, pairs: list[Pair], sharp: bool) -> BoolArray:
    """Whether strands lie along each other at nearest places (k,): from one joint to the next the gap does not rise."""
    bulge = problem.with_changes(pairs=tuple(pairs)).pair_rows().bulge(x)
    least = 8.0 * FLAT / float(problem.lengths.max()) ** 2
    return np.asarray(bulge < (least if sharp else max(least, _CROSSING / problem.apart)))


def centres(problem: MixedProblem, pushing: Sequence[tuple[Pair, float]], deep: Sequence[Pair]) -> list[Pair]:
    """Where each place of its own may be: where the force of pairs is that stay and push (with their forces) and follow
    each other on two strands within little more than a segment, and where strands are too deep in each other (`deep`)
    farther from such; in longer lines none."""
    least = _CLEARLY * max((force for _, force in pushing), default=0.0)
    held = sorted(
        ((pair, force) for pair, force in pushing if pair.stays and force > least), key=lambda each: each[0].s
    )
    found: list[Pair] = []
    lines: list[Pair] = []
    for line in lines_of(problem, [pair for pair, _ in held]):
        pairs, force = [held[k][0] for k in line], np.array([held[k][1] for k in line])
        s, other = (np.array([pair[column] for pair in pairs]) for column in (0, 2))
        if s[-1] - s[0] < 1.5 * float(problem.lengths.max()):
            found.append(
                pairs[0]._replace(s=float(s @ force / force.sum()), s_other=float(other @ force / force.sum()))
            )
        else:
            lines += pairs
    between = [pair for pair in deep if not beside_any(problem, pair, lines)]
    near = 0.1 * float(problem.lengths.max())
    return found + [pair for pair in between if all(abs(pair.s - one.s) > near for one in found)]


def is_station(problem: MixedProblem, pair: Pair) -> bool:
    """Whether a pair that stays does so at a joint."""
    starts = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    return pair.stays and float(np.abs(starts - pair.s).min()) < _AT * float(problem.lengths.min())


def alike(problem: MixedProblem, one: Pair, other: Pair) -> bool:
    """Whether two pairs hold the same: a station and the same strand beside it, or places that slide to one another."""
    if one.stays != other.stays:
        return False
    if one.stays:
        own = abs(one.s - other.s) < _AT * float(problem.lengths.min())
        return own and abs(one.s_other - other.s_other) < _NEXT * float(problem.lengths.max())
    return _meets(problem, one, other)


def beside_any(problem: MixedProblem, pair: Pair, others: Iterable[Pair]) -> bool:
    """Whether a pair is beside one of others on both strands."""
    return any(_meets(problem, pair, other) for other in others)


def _meets(problem: MixedProblem, one: Pair, other: Pair) -> bool:
    """Whether two pairs are beside each other on both strands."""
    near = _BESIDE * float(problem.lengths.max())
    return abs(one.s - other.s) < near and abs(one.s_other - other.s_other) < near


def _stations(problem: MixedProblem, x: FloatArray, below: float) -> tuple[FloatArray, list[Pair]]:
    """Gaps (k,) at joints nearer to a later strand than `below`, and the stations, in order."""
    s = nearness.abscissae(problem, x)
    r, _, turned, _ = nearness.shape(problem, x, s)
    joints = np.searchsorted(s, np.concatenate([[0.0], np.cumsum(problem.lengths)]) - 1e-12)
    joints = np.minimum(joints, s.size - 1)
    reach = problem.apart + below + float(np.diff(s).max())
    near = scipy.spatial.cKDTree(r).query_ball_point(r[joints], reach, return_sorted=True)
    found: list[Pair] = []
    for i, others in zip(joints, near, strict=True):
        j = np.asarray(others, dtype=np.int64)
        j = j[j > i]
        j = j[nearness.facing(problem, turned[i], turned[j], turned[-1])]
        distance = np.linalg.norm(r[j] - r[i], axis=1)
        for k in valleys(j, distance):
            found.append(Pair(float(s[i]), 0.0, float(s[j[k]]), 0.0, True, True))
    gaps, kept = nearness.narrowed(problem, x, found)
    near_enough = [k for k in np.argsort(gaps, kind="stable") if gaps[k] < below]
    fresh: list[tuple[float, Pair]] = []
    for k in near_enough:
        if not any(alike(problem, kept[k], pair) for _, pair in fresh):
            fresh.append((float(gaps[k]), kept[k]))
    fresh.sort(key=lambda each: each[1])
    return np.array([gap for gap, _ in fresh]), [pair for _, pair in fresh]


def valleys(j: NDArray[np.int64], distance: FloatArray) -> list[int]:
    """Where distances (k,) to the samples j (k,), in order, are least among their neighbours."""
    found = []
    for k, value in enumerate(distance):
        lower = k > 0 and j[k - 1] == j[k] - 1 and distance[k - 1] < value
        higher = k + 1 < j.size and j[k + 1] == j[k] + 1 and distance[k + 1] <= value
        if not lower and not higher:
            found.append(k)
    return found


def lines_of(problem: MixedProblem, stations: Sequence[Pair]) -> list[list[int]]:
    """Stations, in order of s, that follow each other on two strands, together."""
    h = float(problem.lengths.max())
    found: list[list[int]] = []
    for k, pair in enumerate(stations):
        for line in found:
            last = stations[line[-1]]
            if 0.0 < pair.s - last.s < 1.5 * h and abs(pair.s_other - last.s_other) < pair.s - last.s + _NEXT * h:
                line.append(k)
                break
        else:
            found.append([k])
    return found
