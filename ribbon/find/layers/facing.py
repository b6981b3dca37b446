"""Which layers of a plane strip face each of its places: on either side the nearest one alone.

What lies behind the nearest layer is kept away by it, so that places have two rows at the most, however far they see.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ribbon.judge import nearness
from ribbon.problems.itself.pairs import Pair
from ribbon.problems.mixed import MixedProblem

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Samples of a segment in which feet are looked for, at the least, and how far it may bulge between two of them, over
#: the distance to be kept: on which side a layer lies is read there.
_SAMPLES, _BULGE = 4, 0.05


class Faced(NamedTuple):
    """Pairs of places in the middles of rulings, the first of which stays: which of the places asked for it is (k,), on
    which side of the second (k,), and how far (k,) along the strip that is, l."""

    pairs: tuple[Pair, ...]
    own: IntArray
    side: IntArray
    foot: FloatArray


def faced(problem: MixedProblem, x: FloatArray, places: FloatArray, reach: float) -> Faced:
    """Of the abscissae `places` of a plane shape x (n,) those that other layers are nearer to than `reach` (l) beyond
    what is to be kept, against parts farther along, of both ends against any."""
    joints = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    joints[-1] = 1.0
    s = _samples(problem, x, joints)
    both = nearness.shape(problem, x, np.union1d(s, places))
    at = np.union1d(s, places)
    sample, asked = np.searchsorted(at, s), np.searchsorted(at, places)
    across = both.frame[0][:, [2, 1]]
    r, normal = (both.r - both.r[0]) @ across, both.frame[:, :, 1] @ across
    apart = r[asked][:, None, :] - r[sample][None, :, :]
    square = np.einsum("ijd,ijd->ij", apart, apart)
    turn = both.turned[sample][None, :] - both.turned[asked][:, None]
    ends = (places == 0.0) | (places == 1.0)
    faces = nearness.facing(problem, np.zeros_like(turn), np.where(ends[:, None], np.abs(turn), turn), 0.0)
    least = (square[:, 1:-1] < square[:, :-2]) & (square[:, 1:-1] <= square[:, 2:]) & faces[:, 1:-1]
    i, j = np.nonzero(least & (square[:, 1:-1] < (problem.apart + reach) ** 2))
    j = j + 1
    foot, lowest = _vertex(s, square, i, j)
    side = np.sign(np.einsum("kd,kd->k", apart[i, j], normal[sample[j]])).astype(np.int64)
    order = np.lexsort((lowest, side, i))
    i, side, foot = i[order], side[order], foot[order]
    first = np.ones(i.size, dtype=bool)
    first[1:] = (i[1:] != i[:-1]) | (side[1:] != side[:-1])
    i, side, foot = i[first], side[first], foot[first]
    pairs = tuple(Pair(float(places[a]), 0.0, float(b), 0.0, True, True) for a, b in zip(i, foot, strict=True))
    return Faced(pairs, i, side, foot)


def _samples(problem: MixedProblem, x: FloatArray, joints: FloatArray) -> FloatArray:
    """Abscissae so dense that an arc of a curvature kappa bulges by kappa a^2 / 8 at the most between two, a apart."""
    omega = np.abs(x[problem.layout.omega])
    bent = np.maximum(omega[1:], omega[:-1])
    each = np.ceil(problem.lengths * np.sqrt(bent / (8.0 * _BULGE * problem.apart)))
    counts = np.maximum(each, _SAMPLES).astype(np.int64)
    first = np.repeat(np.cumsum(counts) - counts, counts)
    part = (np.arange(counts.sum()) - first) / np.repeat(counts, counts)
    return np.append(np.repeat(joints[:-1], counts) + np.repeat(problem.lengths, counts) * part, 1.0)


def _vertex(s: FloatArray, square: FloatArray, i: IntArray, j: IntArray) -> tuple[FloatArray, FloatArray]:
    """Where the parabolas through squares of distances at the samples beside j are least (k,), and these squares (k,):
    samples may be farther from each other than layers are."""
    low, middle, high = (square[i, j + step] for step in (-1, 0, 1))
    back, on = s[j] - s[j - 1], s[j + 1] - s[j]
    left, right = (middle - low) / back, (high - middle) / on
    bend = (right - left) / (0.5 * (back + on))
    slope = (left * on + right * back) / (back + on)
    bend = np.maximum(bend, 1e-300)
    return np.clip(s[j] - slope / bend, s[j - 1], s[j + 1]), middle - 0.5 * slope * slope / bend


def crossed(before: Faced, after: Faced, far: float) -> bool:
    """Whether a layer is on the other side of a place than before, which no step of `far` (l) may make."""
    known = {
        (a, b): foot for a, b, foot in zip(*map(np.ndarray.tolist, (before.own, before.side, before.foot)), strict=True)
    }
    for a, b, foot in zip(*map(np.ndarray.tolist, (after.own, after.side, after.foot)), strict=True):
        other = known.get((a, -b))
        if other is not None and abs(other - foot) < far:
            same = known.get((a, b))
            if same is None or abs(same - foot) > far:
                return True
    return False
