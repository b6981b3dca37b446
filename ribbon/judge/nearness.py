"""Where parts of a strip that are far from each other along it come near each other in space.

Rulings are sampled; pairs of them whose middles are near enough are looked for in a tree, those between which the
normals turn by less than parts that face each other do are left out, and of the others the distances of their rulings,
which are straight, have a closed form (V. Lumelsky 1985, doi:10.1016/0020-0190(85)90032-8). Where it is least among its
neighbours a pair of places begins, and goes to the nearest ones on the strip itself (`ribbon.problems.itself.pairs`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon.problems.itself.pairs import Pair
from ribbon.problems.mixed import MixedProblem
from ribbon.surface import centreline

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Furthest (l) that an equilibrium's parts are nearer to each other than they may be.
TOLERANCE = 1e-6
#: Samples of a segment, at the least, and turn (rad) between two of them, at the most.
_SAMPLES, _TURN = 4, 0.1
#: Turn (rad) of the normals below which two parts do not face each other.
_FACING = 2.4
#: Sine of the angle of rulings below which no place on them is nearest, and below which both ends of what lies side by
#: side are looked at: what lies on it would turn about one place.
PARALLEL, ALONG = 2e-2, 0.5
#: How far (l) what is in a plane may be off it.
_FLAT = 1e-12
#: Of so many samples one is a place beside which parts that lie along each other are looked at.
_STATION = 4
#: Times that a pair is put on the segment next to its own.
_PASSED = 4
#: Part of the length from an end at which a place is at the end.
_ENDED = 1e-12
#: Part of a segment by which a place begins beyond a joint that it has passed.
_INSIDE = 0.02


def minima(problem: MixedProblem, x: FloatArray, below: float) -> list[tuple[float, Pair]]:
    """Gaps (l) between far parts over what they are to keep (`problem.apart`), where least, as far as they are smaller
    than `below`; and between which places."""
    s = abscissae(problem, x)
    here = shape(problem, x, s)
    found, nearest = _begins(problem, s, here, below, problem.round)
    gaps, places = _narrowed(problem, x, found, nearest)
    return _facing_once(problem, s, here.turned, gaps, places, below)


def least(problem: MixedProblem, x: FloatArray, below: float) -> list[tuple[float, Pair]]:
    """As `minima`, of both places sliding, whether strands lie along each other or not."""
    s = abscissae(problem, x)
    here = shape(problem, x, s)
    gaps, places = narrowed(problem, x, _begins(problem, s, here, below, False)[0])
    return _facing_once(problem, s, here.turned, gaps, places, below)


def _begins(
    problem: MixedProblem, s: FloatArray, here: Shape, below: float, stays: bool
) -> tuple[list[Pair], list[bool]]:
    """Where rulings are nearest, and which of these are nearer than their neighbours; stays: others too, of which the
    first place might stay."""
    r, ruling, turned, _ = here
    reach = problem.apart + below
    step = float(np.diff(s).max())
    i, j = _close(r, reach + nearer(r, ruling, problem.reach) + step)
    far = facing(problem, turned[i], turned[j], turned[-1])
    i, j = i[far], j[far]
    if not i.size:
        return [], []
    distance, u, other = between_rulings(r, ruling, i, j, problem.reach)
    near = distance < reach + step
    lowest = near & is_least(distance, i, j, s.size)
    beside = np.zeros_like(lowest)
    if stays:
        beside = near & ~lowest & (i % _STATION == 0) & is_least(distance, i, j, s.size, (0,))
    found: list[Pair] = []
    nearest: list[bool] = []
    for k in np.nonzero(lowest | beside)[0]:
        found += _pairs(problem, s, r, ruling, int(i[k]), int(j[k]), float(u[k]), float(other[k]))
        nearest += [bool(lowest[k])] * (len(found) - len(nearest))
    return found, nearest


def _facing_once(
    problem: MixedProblem, s: FloatArray, turned: FloatArray, gaps: FloatArray, places: list[Pair], below: float
) -> list[tuple[float, Pair]]:
    """The pairs nearer than `below` that face each other, the nearest first, each once."""
    if not places:
        return []
    each = np.array([pair[:4] for pair in places], dtype=float)
    one, two = (np.interp([getattr(pair, side) for pair in places], s, turned) for side in ("s", "s_other"))
    counts = (gaps < below) & facing(problem, one, two, turned[-1])
    kept = np.empty(len(places), dtype=np.int64)
    count = 0
    for k in np.argsort(gaps, kind="stable"):
        if counts[k] and not _same(problem, each[kept[:count]], each[k]).any():
            kept[count] = k
            count += 1
    return [(float(gaps[k]), places[k]) for k in kept[:count]]


def same(problem: MixedProblem, one: Pair, other: Pair) -> bool:
    """Whether two pairs are the same places, within a twentieth of a segment."""
    return bool(_same(problem, np.array([one[:4]], dtype=float), np.array(other[:4], dtype=float))[0])


def _same(problem: MixedProblem, some: FloatArray, other: FloatArray) -> NDArray[np.bool_]:
    """Which of some places (k, 4) are those of another (4,)."""
    near = 0.05 * float(problem.lengths.min())
    return np.asarray((np.abs(some - other) < near).all(axis=1))


def _narrowed(
    problem: MixedProblem, x: FloatArray, pairs: list[Pair], nearest: list[bool]
) -> tuple[FloatArray, list[Pair]]:
    """As `narrowed`; where parts of a round rod lie along each other the first place stays, and pairs that are not the
    nearest of their neighbours count there too."""
    if not pairs or not problem.round:
        return narrowed(problem, x, pairs)
    rows = problem.with_changes(pairs=tuple(pair._replace(stays=True) for pair in pairs)).pair_rows()
    along = rows.along(x)
    gaps, stay = narrowed(problem, x, [p._replace(stays=True) for p, lies in zip(pairs, along, strict=True) if lies])
    slide = [p for p, lies, least in zip(pairs, along, nearest, strict=True) if least and not lies]
    more, slid = narrowed(problem, x, slide)
    return np.concatenate([gaps, more]), [*stay, *slid]


def narrowed(problem: MixedProblem, x: FloatArray, pairs: list[Pair]) -> tuple[FloatArray, list[Pair]]:
    """Gaps (k,) over `problem.apart` of the nearest places beside pairs, and these places."""
    if not pairs:
        return np.empty(0), []
    starts = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    for _ in range(_PASSED):
        rows = problem.with_changes(pairs=tuple(pairs)).pair_rows()
        places = rows.places(x)
        gaps = rows.gaps(x)
        passed, moved = False, []
        for k, pair in enumerate(pairs):
            at = places[k].copy()
            for column, side in ((0, 0), (2, 1)):
                i = int(rows.segments[side, k])
                past = rows.beyond(x)[k, side]
                beside = problem.beside(i, int(past)) if past else None
                if beside is not None:
                    inside = _INSIDE * problem.lengths[beside]
                    at[column] = starts[beside] + inside if past > 0 else starts[beside + 1] - inside
                    passed = True
            moved.append(pair.at(at).ordered())
        if not passed:
            break
        pairs = moved
    found = [pair.at(place).ordered() for place, pair in zip(places, pairs, strict=True)]
    along = np.array([[pair.s, pair.s_other] for pair in found])
    at_end = along % 1.0 == 0.0 if problem.round else np.minimum(along, 1.0 - along) < _ENDED
    ended = at_end | (rows.beyond(x) == 0)
    least = ended.all(axis=1)  # what still slides is nearest elsewhere
    return gaps[least], [pair for pair, inside in zip(found, least, strict=True) if inside]


class Shape(NamedTuple):
    """Positions r and rulings (k, 3) at abscissae, by how much (k,) the strip has turned up to there (its normals, of a
    round rod its tangents, which turn by pi too between places that are nearest to each other), and frames
    (k, 3, 3), columns t_x, t_y, t_z."""

    r: FloatArray
    ruling: FloatArray
    turned: FloatArray
    frame: FloatArray


def shape(problem: MixedProblem, x: FloatArray, s: FloatArray) -> Shape:
    """The shape x at abscissae s (k,)."""
    q, (points, frames) = problem.parameters(x), problem.joints(x)
    seam = 0 if problem.closure is None else problem.closure.sign
    r, frame, _, eta = centreline(
        q, problem.lengths, points, frames, s, problem.exponent_limit, seam, problem.fields.free
    )
    ruling = frame[:, :, 0] if problem.fields.free else frame[:, :, 0] + eta[:, None] * frame[:, :, 2]
    return Shape(r, ruling, _turned(frame[:, :, 2 if problem.round else 1]), frame)


def _counts(problem: MixedProblem, x: FloatArray) -> IntArray:
    """Samples (p,) of each segment."""
    q, lengths = problem.parameters(x), problem.lengths
    bend = (np.abs(q[:, 1]) + np.abs(q[:, 0]) * lengths) * lengths
    if problem.fields.in_plane:
        bend = bend + (np.abs(q[:, 5]) + np.abs(q[:, 4]) * lengths) * lengths
    return np.maximum(_SAMPLES, np.ceil(bend / _TURN)).astype(int)


def enough(problem: MixedProblem, x: FloatArray) -> int:
    """Samples of the strip that follow a shape wherever it bends."""
    return int(np.ceil((_counts(problem, x) / problem.lengths).max()))


def abscissae(problem: MixedProblem, x: FloatArray) -> FloatArray:
    """Where a shape is sampled."""
    starts = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    each = zip(starts, problem.lengths, _counts(problem, x), strict=False)
    return np.concatenate([*(a + h * np.arange(n) / n for a, h, n in each), [1.0]])


def nearest(
    problem: MixedProblem,
    s: FloatArray,
    r: FloatArray,
    ruling: FloatArray,
    turned: tuple[FloatArray, ...],
    below: float,
) -> tuple[float, int, int] | None:
    """The least distance of far rulings, where it is smaller than `below`, and which two of them; far by any of the
    turns `turned`."""
    i, j = _close(r, below + nearer(r, ruling, problem.reach))
    far = np.zeros(i.size, dtype=bool)
    for each in turned:
        far |= facing(problem, each[i], each[j], each[-1])
    i, j = i[far], j[far]
    if not i.size:
        return None
    distance, _, _ = between_rulings(r, ruling, i, j, problem.reach)
    k = int(np.argmin(distance))
    return (float(distance[k]), int(i[k]), int(j[k])) if distance[k] < below else None


def _close(r: FloatArray, reach: float) -> tuple[IntArray, IntArray]:
    """Pairs i < j of points (k, 3) no farther from each other than `reach`."""
    near = scipy.spatial.cKDTree(r).query_pairs(reach, output_type="ndarray")
    return near[:, 0], near[:, 1]


def nearer(r: FloatArray, ruling: FloatArray, half: float) -> float:
    """By how much (l) rulings (k, 3), from -`half` to `half`, may be nearer to each other than their middles r (k, 3):
    not at all where these are in a plane that all rulings are normal to."""
    axis = ruling[0] / np.linalg.norm(ruling[0])
    aside = np.abs(np.cross(ruling, axis)).max(initial=0.0)
    if half * aside < _FLAT and np.abs((r - r[0]) @ axis).max(initial=0.0) < _FLAT:
        return 0.0
    return float(2.0 * half * np.linalg.norm(ruling, axis=1).max())


def _turned(normal: FloatArray) -> FloatArray:
    """By how much (k,) the normals have turned since the first."""
    turn = 2.0 * np.arcsin(np.clip(0.5 * np.linalg.norm(np.diff(normal, axis=0), axis=1), 0.0, 1.0))
    return np.concatenate([[0.0], np.cumsum(turn)])


def facing(problem: MixedProblem, one: FloatArray, other: FloatArray, whole: float) -> NDArray[np.bool_]:
    """Whether the normals turn enough for places to face each other, from `one` to `other`, of a band both ways."""
    between = np.asarray(other - one)
    facing = between > _FACING
    return facing & (whole - between > _FACING) if problem.joined else facing


def between_rulings(
    r: FloatArray, ruling: FloatArray, i: IntArray, j: IntArray, half: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Distance (k,) of the rulings i and j, and the places u (k,) on either."""
    one, other, apart = ruling[i], ruling[j], r[i] - r[j]
    a, b, c = (np.einsum("ki,ki->k", p, q) for p, q in ((one, one), (one, other), (other, other)))
    d, e = np.einsum("ki,ki->k", one, apart), np.einsum("ki,ki->k", other, apart)
    det = a * c - b * b
    safe = det > 1e-8 * a * c
    u = np.clip(np.where(safe, (b * e - c * d) / np.where(safe, det, 1.0), 0.0), -half, half)
    v = np.clip((b * u + e) / c, -half, half)
    u = np.clip((b * v - d) / a, -half, half)
    distance = np.linalg.norm(apart + u[:, None] * one - v[:, None] * other, axis=1)
    return distance, u, v


def is_least(
    distance: FloatArray, i: IntArray, j: IntArray, count: int, steps: tuple[int, ...] = (-1, 0, 1)
) -> NDArray[np.bool_]:
    """Whether a pair's distance (k,) is no greater than those of the pairs beside it, i as much apart as `steps`."""
    key = i.astype(np.int64) * (count + 2) + j
    order = np.argsort(key)
    keys, values = key[order], distance[order]
    least = np.ones(distance.size, dtype=bool)
    for di in steps:
        for dj in (-1, 0, 1):
            if di or dj:
                wanted = key + di * (count + 2) + dj
                at = np.minimum(np.searchsorted(keys, wanted), keys.size - 1)
                least &= ~((keys[at] == wanted) & (values[at] < distance - 1e-15))
    return least


def _pairs(
    problem: MixedProblem, s: FloatArray, r: FloatArray, ruling: FloatArray, i: int, j: int, u: float, other: float
) -> list[Pair]:
    """The pair that begins between two rulings, but for parallel ones, and where they are nearly so (or parts would
    turn about one place) those between both ends of what lies side by side."""
    sizes = (float(np.linalg.norm(ruling[i])), float(np.linalg.norm(ruling[j])))
    one, two = ruling[i] / sizes[0], ruling[j] / sizes[1]
    sine = float(np.linalg.norm(np.cross(one, two)))
    if problem.round and sine <= PARALLEL:
        return [Pair(float(s[i]), 0.0, float(s[j]), 0.0, True)]
    found = [Pair(float(s[i]), u, float(s[j]), other)] if sine > PARALLEL else []
    if sine < ALONG and not problem.round:
        half = problem.half_width
        middles = float(r[i] @ one), float(r[j] @ one)
        places = beside(middles, (half * sizes[0], half * sizes[1]), float(one @ two))
        found += [Pair(float(s[i]), a * half, float(s[j]), b * half, True) for a, b in places]
    return found


def beside(
    middles: tuple[float, float], widths: tuple[float, float], along: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Places (-1 to 1) on two nearly parallel rulings at both ends of what lies side by side.

    middles: where both rulings' middles lie along the first one; widths: halves of their lengths; along: cosine of the
    two.
    """
    low = max(m - w for m, w in zip(middles, widths, strict=True))
    high = min(m + w for m, w in zip(middles, widths, strict=True))
    if low > high:
        low = high = 0.5 * (low + high)
    sign = 1.0 if along > 0.0 else -1.0

    def at(place: float) -> tuple[float, float]:
        u, v = ((place - middle) / width for middle, width in zip(middles, widths, strict=True))
        return min(max(u, -1.0), 1.0), min(max(sign * v, -1.0), 1.0)

    return at(low), at(high)
