"""Where parts of a strip that are far from each other along it come near each other in space.

Rulings are sampled; pairs of them whose middles are near enough are looked for in a tree, those between which the
normals turn by less than parts that face each other do are left out, and of the others the distances of their rulings,
which are straight, have a closed form (V. Lumelsky 1985, doi:10.1016/0020-0190(85)90032-8). Where it is least among its
neighbours a pair of places begins, and goes to the nearest ones on the strip itself (`ribbon.problems.itself.pairs`).
"""

from __future__ import annotations

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
#: Angle (rad) of rulings below which no place on them is nearest, and both their ends are looked at.
_PARALLEL = 2e-2
#: Times that a pair is put on the segment next to its own.
_PASSED = 4


def minima(problem: MixedProblem, x: FloatArray, below: float) -> list[tuple[float, Pair]]:
    """Gaps (l) between far parts over what they are to keep (`problem.apart`), where least, as far as they are smaller
    than `below`; and between which places."""
    s, r, normal, ruling = _sampled(problem, x)
    reach = problem.apart + below
    length = float(np.linalg.norm(ruling, axis=1).max())
    step = float(np.diff(s).max())
    near = scipy.spatial.cKDTree(r).query_pairs(reach + 2.0 * problem.half_width * length + step, output_type="ndarray")
    i, j = near[:, 0], near[:, 1]
    turned = _turned(normal)
    far = _facing(problem, turned[i], turned[j], turned[-1])
    i, j = i[far], j[far]
    if not i.size:
        return []
    distance, u, other = _between(r, ruling, i, j, problem.half_width)
    least = _least(distance, i, j, s.size) & (distance < reach + step)
    found: list[Pair] = []
    for k in np.nonzero(least)[0]:
        found += _pairs(problem, s, ruling, int(i[k]), int(j[k]), float(u[k]), float(other[k]))
    gaps, places = narrowed(problem, x, found)
    kept: list[tuple[float, Pair]] = []
    for k in np.argsort(gaps, kind="stable"):
        pair = places[k]
        one, two = np.interp([pair.s, pair.s_other], s, turned)
        if (
            gaps[k] < below
            and _facing(problem, one, two, turned[-1])
            and not any(same(problem, pair, known) for _, known in kept)
        ):
            kept.append((float(gaps[k]), pair))
    return kept


def same(problem: MixedProblem, one: Pair, other: Pair) -> bool:
    """Whether two pairs are the same places, within a twentieth of a segment."""
    near = 0.05 * float(problem.lengths.min())
    return all(abs(a - b) < near for a, b in zip(one[:4], other[:4], strict=True))


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
                if past and 0 <= i + past < problem.lengths.size:
                    at[column] = starts[i + (past > 0)] + 0.02 * past * problem.lengths[i + past]
                    passed = True
            moved.append(pair.at(at))
        if not passed:
            break
        pairs = moved
    found = [pair.at(place) for place, pair in zip(places, pairs, strict=True)]
    ended = (np.array([[pair.s, pair.s_other] for pair in found]) % 1.0 == 0.0) | (rows.beyond(x) == 0)
    least = ended.all(axis=1)  # what still slides is nearest elsewhere
    return gaps[least], [pair for pair, inside in zip(found, least, strict=True) if inside]


def _sampled(problem: MixedProblem, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Abscissae (k,), positions, normals and rulings (k, 3)."""
    q, lengths = problem.parameters(x), problem.lengths
    bend = (np.abs(q[:, 1]) + np.abs(q[:, 0]) * lengths) * lengths
    counts = np.maximum(_SAMPLES, np.ceil(bend / _TURN)).astype(int)
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    parts = [a + h * np.arange(n) / n for a, h, n in zip(starts, lengths, counts, strict=False)]
    s = np.concatenate([*parts, [1.0]])
    points, frames = problem.joints(x)
    seam = 0 if problem.closure is None else problem.closure.sign
    r, frame, _, eta = centreline(q, lengths, points, frames, s, problem.exponent_limit, seam, problem.fields.free)
    ruling = frame[:, :, 0] if problem.fields.free else frame[:, :, 0] + eta[:, None] * frame[:, :, 2]
    return s, r, frame[:, :, 1], ruling


def _turned(normal: FloatArray) -> FloatArray:
    """By how much (k,) the normals have turned since the first."""
    turn = 2.0 * np.arcsin(np.clip(0.5 * np.linalg.norm(np.diff(normal, axis=0), axis=1), 0.0, 1.0))
    return np.concatenate([[0.0], np.cumsum(turn)])


def _facing(problem: MixedProblem, one: FloatArray, other: FloatArray, whole: float) -> NDArray[np.bool_]:
    """Whether the normals turn enough for places to face each other, from `one` to `other`, of a band both ways."""
    between = np.asarray(other - one)
    facing = between > _FACING
    return facing & (whole - between > _FACING) if problem.closure is not None else facing


def _between(
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


def _least(distance: FloatArray, i: IntArray, j: IntArray, count: int) -> NDArray[np.bool_]:
    """Whether a pair's distance (k,) is no greater than those of the pairs beside it."""
    key = i.astype(np.int64) * (count + 2) + j
    order = np.argsort(key)
    keys, values = key[order], distance[order]
    least = np.ones(distance.size, dtype=bool)
    for di in (-1, 0, 1):
        for dj in (-1, 0, 1):
            if di or dj:
                wanted = key + di * (count + 2) + dj
                at = np.minimum(np.searchsorted(keys, wanted), keys.size - 1)
                least &= ~((keys[at] == wanted) & (values[at] < distance - 1e-15))
    return least


def _pairs(
    problem: MixedProblem, s: FloatArray, ruling: FloatArray, i: int, j: int, u: float, other: float
) -> list[Pair]:
    """The pair that begins between two rulings; where they are parallel those between both their ends."""
    one, two = (ruling[k] / np.linalg.norm(ruling[k]) for k in (i, j))
    if np.linalg.norm(np.cross(one, two)) > _PARALLEL:
        return [Pair(float(s[i]), u, float(s[j]), other)]
    edge = problem.half_width
    sign = 1.0 if one @ two > 0.0 else -1.0
    return [Pair(float(s[i]), side * edge, float(s[j]), sign * side * edge, True) for side in (1.0, -1.0)]
