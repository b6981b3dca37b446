"""Whether a strip passes through itself: two particles, far from each other on the strip, at one place.

The surface is cut into cells on a grid of particles. Two cells whose particles meet are joined by a straight line of
the flat strip, which the strip bends into a closed curve with one corner: such a curve turns by pi at the least
(W. Fenchel 1929, doi:10.1007/BF01454836), and a line of a developable surface turns by no more than the normals along
it do. Cells between which the normals turn by less are neighbours and cannot meet, however near they are. Of the
others pairs are looked for whose boxes meet, through a tree of boxes along the strip (O(n log n)), and are told apart
by separating axes of the cells, each thicker by as much as the surface leaves its flat cell. What stays is cut finer
until nothing does, or until steps of Gauss and Newton from there end where the surface of the model, not its grid,
meets itself.

Of a surface that is not developable (a free twist, a shell) the bound is that of a developable one nearby. Lengths in
l.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from compare.measure.grid import Surfaced

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: How near (l) two particles are that stand at one place, and ends that are joined.
MEETS, _JOINED = 1e-9, 1e-6
#: Places that are looked for at the most.
MOST = 3
#: Turn (rad) of a cell along the strip, about; fewest and most cells there; cells across.
_TURN, _CELLS, _ACROSS = 0.12, (96, 4000), 2
#: Turn (rad) of the normals below which two cells cannot meet: pi, less what a grid loses of it.
_APART = 2.8
#: By how much thicker than its second differences say a cell is taken to be.
_THICKER = 2.0
#: Parts into which a cell is cut, rounds of that, pairs that a round takes on, thickness (l) at which it stops.
_PARTS, _ROUNDS, _PAIRS, _FINEST = 4, 9, 10000, 2e-9
#: Pairs, about, that are tried first where there are many more.
_SOME = 600
#: Steps from a pair of cells, and the step (l) of their differences.
_STEPS, _DIFFERENCE = 20, 1e-5
#: Nodes of the tree with which its descent begins.
_TOP = 32


class Place(NamedTuple):
    """Two particles at one place: (s, v) and (s_other, v_other), s < s_other, in l."""

    s: float
    v: float
    s_other: float
    v_other: float


@dataclass(frozen=True)
class Crossing:
    """places: where a strip meets itself, one for each of at most MOST regions, none: it does not; within: how near (l)
    it comes to itself where that could not be told, None: it could."""

    places: tuple[Place, ...] = ()
    within: float | None = None


@dataclass(frozen=True)
class _Cells:
    """Cells (n, m) between lines s and v: s (n, 2), v (m, 2) their sides, corners (n, m, 4, 3), thick (n, m)."""

    s: FloatArray
    v: FloatArray
    corners: FloatArray
    thick: FloatArray


class _Turns:
    """How much the normals turn between cells."""

    def __init__(self, points: FloatArray, joined: bool) -> None:
        normal = _cross(points[1:, 1:] - points[:-1, :-1], points[1:, :-1] - points[:-1, 1:])
        normal /= np.maximum(_size(normal)[..., None], 1e-300)
        along = _angle(normal[1:], normal[:-1])
        self.steepest = float(along.max())
        self.cells = len(normal)
        #: From the first cell on (n, m).
        self.along = np.concatenate([np.zeros((1, normal.shape[1])), np.cumsum(along, axis=0)])
        #: Over the width, at the most (n,).
        self.across = _angle(normal[:, 1:], normal[:, :-1]).sum(axis=1)
        #: Through the seam of a closed strip.
        seam = _angle(normal[-1], normal[0]).min()
        self.seam = float(min(seam, np.pi - seam)) if joined else np.inf
        self.total = float((self.along[-1] + self.across.max(initial=0.0)).max())

    def far(self, i: IntArray, i_end: IntArray, j: IntArray, j_end: IntArray) -> NDArray[np.bool_]:
        """Whether some of the cells i to i_end and some of j to j_end, behind them, are far from each other."""
        aside = self.aside(i, i_end, j, j_end)
        direct = (self.along[j_end] - self.along[i]).max(axis=1) + aside
        far: NDArray[np.bool_] = direct >= _APART
        if np.isfinite(self.seam):
            other = (self.along[-1] - self.along[j]).max(axis=1) + (self.along[i_end]).max(axis=1)
            far &= other + self.seam + aside >= _APART
        return far

    def aside(self, i: IntArray, i_end: IntArray, j: IntArray, j_end: IntArray) -> FloatArray | float:
        """The largest turn across of either."""
        if not self.across.size or i_end is not i:
            return float(self.across.max(initial=0.0))
        return np.asarray(np.maximum(self.across[i], self.across[j]))


def crossing(shape: Surfaced, width: float) -> Crossing | None:
    """Where the strip of `width` (w / l) meets itself; None where its points are not finite."""
    count, v = _CELLS[0], width * np.linspace(-0.5, 0.5, _ACROSS + 1)
    while True:
        s = np.linspace(0.0, 1.0, count + 1)
        points = shape.points(s, v)
        if not np.isfinite(points).all():
            return None
        turns = _Turns(points, _is_joined(points))
        if turns.steepest < 2.0 * _TURN or count == _CELLS[1]:
            break
        count = int(min(np.ceil(count * max(2.0, turns.steepest / _TURN)), _CELLS[1]))
    if turns.total < _APART:
        return Crossing()
    cells = _cells(points[None], s[None], v)
    pairs, all_ = _near(cells, turns, _SOME)
    if not all_:  # layer upon layer: where it passes through itself a few of them say so
        places = _places(shape, width, cells, pairs[:, _meet(cells, pairs)], turns)
        if places:
            return Crossing(places)
        pairs, _ = _near(cells, turns)
    for _ in range(_ROUNDS):
        pairs = pairs[:, _meet(cells, pairs)]
        if not pairs.size:
            return Crossing()
        places = _places(shape, width, cells, pairs, turns)
        if places:
            return Crossing(places)
        within = float(cells.thick[pairs[0], pairs[1]].max() + cells.thick[pairs[2], pairs[3]].max())
        if within < _FINEST or pairs.shape[1] > _PAIRS:
            break
        cells, pairs = _finer(shape, cells, pairs)
    return Crossing(within=within)


def _angle(one: FloatArray, other: FloatArray) -> FloatArray:
    """Between unit vectors."""
    return np.asarray(2.0 * np.arcsin(np.minimum(0.5 * _size(one - other), 1.0)))


def _size(vectors: FloatArray) -> FloatArray:
    """Of vectors (..., 3)."""
    return np.asarray(np.sqrt(np.einsum("...i,...i->...", vectors, vectors)))


def _cross(one: FloatArray, other: FloatArray) -> FloatArray:
    """Products of vectors (..., 3): `numpy.cross`, whose own checks cost more than they do."""
    found = np.empty(np.broadcast_shapes(one.shape, other.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        found[..., i] = one[..., j] * other[..., k] - one[..., k] * other[..., j]
    return found


def _is_joined(points: FloatArray) -> bool:
    """Whether the strip ends where it begins, however its ends are turned against each other there."""
    middle = points[:, _ACROSS // 2]
    return bool(np.abs(middle[-1] - middle[0]).max() < _JOINED)


def _cells(points: FloatArray, s: FloatArray, v: FloatArray) -> _Cells:
    """Cells of patches of points (P, k + 1, m + 1, 3) on lines s (P, k + 1) and v (m + 1,)."""
    along = 0.125 * _size(points[:, 2:] - 2.0 * points[:, 1:-1] + points[:, :-2]).max(axis=2)
    across = 0.125 * _size(points[:, :, 2:] - 2.0 * points[:, :, 1:-1] + points[:, :, :-2])
    along = np.concatenate([along[:, :1], along, along[:, -1:]], axis=1)
    across = np.concatenate([across[:, :, :1], across, across[:, :, -1:]], axis=2)
    along, across = np.maximum(along[:, 1:], along[:, :-1]), np.maximum(across[:, :, 1:], across[:, :, :-1])
    across = np.maximum(across[:, 1:], across[:, :-1])
    thick = _THICKER * (along[:, :, None] + across)
    corners = np.stack([points[:, :-1, :-1], points[:, :-1, 1:], points[:, 1:, :-1], points[:, 1:, 1:]], axis=3)
    sides = np.stack([s[:, :-1], s[:, 1:]], axis=2).reshape(-1, 2)
    columns = v.size - 1
    return _Cells(
        sides, np.column_stack([v[:-1], v[1:]]), corners.reshape(-1, columns, 4, 3), thick.reshape(-1, columns)
    )


def _near(cells: _Cells, turns: _Turns, most: int | None = None) -> tuple[IntArray, bool]:
    """Pairs (4, k) of cells (i, a), (j, b), i before j, that are far on the strip and whose boxes along it meet; and
    whether these are all, or some of them, about `most` at each level of the tree."""
    thick = cells.thick.max(axis=1)[:, None]
    low = [cells.corners.min(axis=(1, 2)) - thick]
    high = [cells.corners.max(axis=(1, 2)) + thick]
    while len(low[-1]) > _TOP:
        low.append(_halved(low[-1], np.minimum))
        high.append(_halved(high[-1], np.maximum))
    first, second = np.triu_indices(len(low[-1]))
    all_ = True
    for level in range(len(low) - 1, -1, -1):
        if level < len(low) - 1:
            first, second = _children(first, second, len(low[level]))
        apart = np.maximum(low[level][first] - high[level][second], low[level][second] - high[level][first])
        meet = (apart <= 0.0).all(axis=1)
        first, second = first[meet], second[meet]
        i, j = first << level, second << level
        ends = [np.minimum(at + (1 << level) - 1, turns.cells - 1) for at in (i, j)] if level else [i, j]
        far = turns.far(i, ends[0], j, ends[1])
        if most is not None and np.count_nonzero(far) > 2 * most:
            far[np.cumsum(far) % (np.count_nonzero(far) // most) != 0] = False
            all_ = False
        first, second = first[far], second[far]
    a, b = np.divmod(np.arange(len(cells.v) ** 2), len(cells.v))
    repeated = np.repeat(first, a.size), np.tile(a, first.size), np.repeat(second, a.size), np.tile(b, first.size)
    return np.stack(repeated), all_


def _halved(values: FloatArray, of: np.ufunc) -> FloatArray:
    """Of neighbouring rows the lesser or the larger ones; a last one without a neighbour stays."""
    pairs = of(values[:-1:2], values[1::2])
    return np.asarray(np.concatenate([pairs, values[-1:]]) if len(values) % 2 else pairs)


def _children(first: IntArray, second: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Pairs of the children of pairs of nodes, the second not before the first."""
    one = (2 * first[:, None] + np.array([0, 0, 1, 1])).ravel()
    other = (2 * second[:, None] + np.array([0, 1, 0, 1])).ravel()
    there = (one <= other) & (one < count) & (other < count)
    return one[there], other[there]


def _meet(cells: _Cells, pairs: IntArray) -> NDArray[np.bool_]:
    """Of pairs (4, k) of cells (i, a), (j, b) those that no axis parts, as thick as they are."""
    middle = cells.corners.mean(axis=2)
    reach = _size(cells.corners - middle[:, :, None]).max(axis=2) + cells.thick
    i, a, j, b = pairs
    meet = _size(middle[i, a] - middle[j, b]) <= reach[i, a] + reach[j, b]
    at = np.nonzero(meet)[0]
    for number in range(11):
        i, a, j, b = pairs[:, at]
        one, other = cells.corners[i, a], cells.corners[j, b]
        axis = _axis(one, other, number)
        size = _size(axis)
        own, its = np.einsum("kci,ki->kc", one, axis), np.einsum("kci,ki->kc", other, axis)
        gap = np.maximum(own.min(axis=1) - its.max(axis=1), its.min(axis=1) - own.max(axis=1))
        parted = gap > size * (cells.thick[i, a] + cells.thick[j, b])
        meet[at[parted]] = False
        at = at[~parted]
        if not at.size:
            break
    return meet


def _axis(one: FloatArray, other: FloatArray, number: int) -> FloatArray:
    """Axes (k, 3) of cells (k, 4, 3): both normals, what joins their middles, those of sides in their planes, and
    those across sides of both."""
    sides = [(cell[:, 2] - cell[:, 0], cell[:, 1] - cell[:, 0]) for cell in (one, other)]
    if number < 2:
        return _cross(*sides[number])
    if number == 2:
        return np.asarray(other.mean(axis=1) - one.mean(axis=1))
    if number < 7:
        which, side = divmod(number - 3, 2)
        return _cross(sides[which][side], _cross(*sides[which]))
    return _cross(sides[0][(number - 7) // 2], sides[1][(number - 7) % 2])


def _finer(shape: Surfaced, cells: _Cells, pairs: IntArray) -> tuple[_Cells, IntArray]:
    """The cells of pairs, cut into parts, and pairs of these parts whose boxes meet."""
    rows, inverse = np.unique(pairs[[0, 2]], return_inverse=True)
    inverse = inverse.reshape(2, -1)
    share = np.linspace(0.0, 1.0, _PARTS + 1)
    s = cells.s[rows, :1] + np.diff(cells.s[rows], axis=1) * share
    tall, wide = np.diff(cells.s[rows], axis=1).max(), np.diff(cells.v, axis=1).max()
    parts = 2 if wide > tall else 1
    v = np.append((cells.v[:, :1] + np.diff(cells.v, axis=1) * np.arange(parts) / parts).ravel(), cells.v[-1, 1])
    found = shape.points(s.ravel(), v).reshape(*s.shape, v.size, 3)
    finer = _cells(found, s, v)
    each = np.meshgrid(*(np.arange(n) for n in (_PARTS, parts, _PARTS, parts)), indexing="ij")
    low, high = finer.corners.min(axis=2), finer.corners.max(axis=2)
    low, high = low - finer.thick[:, :, None], high + finer.thick[:, :, None]
    size = np.array([_PARTS, parts, _PARTS, parts])
    begin = np.stack([inverse[0], pairs[1], inverse[1], pairs[3]])
    i, a, j, b = ((start[:, None] * n + part.ravel()).ravel() for start, n, part in zip(begin, size, each, strict=True))
    meet = (low[i, a] <= high[j, b]).all(axis=1) & (low[j, b] <= high[i, a]).all(axis=1)
    return finer, np.stack([i, a, j, b])[:, meet]


def _places(shape: Surfaced, width: float, cells: _Cells, pairs: IntArray, turns: _Turns) -> tuple[Place, ...]:
    """Places of the surface that are reached from pairs of cells, the nearest of each region."""
    i, a, j, b = pairs
    middles = cells.corners.mean(axis=2)
    apart = np.linalg.norm(middles[i, a] - middles[j, b], axis=1)
    s, v = cells.s.mean(axis=1), cells.v.mean(axis=1)
    begins = np.stack([s[i], v[a], s[j], v[b]], axis=1)
    open_, found = np.ones(len(apart), dtype=bool), []
    reach = max(width, 4.0 * float(np.diff(cells.s, axis=1).max()))
    for _ in range(MOST):
        if not open_.any():
            break
        best = int(np.argmin(np.where(open_, apart, np.inf)))
        open_ &= np.abs(begins[:, [0, 2]] - begins[best, [0, 2]]).max(axis=1) > reach
        place = _met(shape, width, begins[best], turns)
        if place is not None:
            found.append(place)
    return tuple(sorted(found))


def _met(shape: Surfaced, width: float, begin: FloatArray, turns: _Turns) -> Place | None:
    """Where the surface meets itself near (s, v, s', v'): the shortest steps by which its two points fall together,
    within the strip; None where they do not, or where they are neighbours."""
    low, high = np.array([0.0, -0.5 * width] * 2), np.array([1.0, 0.5 * width] * 2)
    at, last = begin.copy(), np.inf
    for _ in range(_STEPS):
        one, other = _tangents(shape, at[:2], low, high), _tangents(shape, at[2:], low, high)
        missed = other[0] - one[0]
        size = float(np.linalg.norm(missed))
        if size < MEETS:
            return _far(at, turns)
        if not size < 4.0 * last:
            return None
        last = min(last, size)
        matrix = np.column_stack([-one[1], -one[2], other[1], other[2]])
        at = np.clip(at + _within(matrix, missed, at, low, high), low, high)
    return None


def _within(matrix: FloatArray, missed: FloatArray, at: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """The shortest step, of no more than a tenth of the strip, that leaves what is at a bound there or inside."""
    free = np.ones(4, dtype=bool)
    step = np.zeros(4)
    for _ in range(4):
        step[:] = 0.0
        step[free] = np.linalg.lstsq(matrix[:, free], -missed, rcond=1e-6)[0]
        out = free & (((at <= low) & (step < 0.0)) | ((at >= high) & (step > 0.0)))
        if not out.any():
            break
        free &= ~out
    return step * min(1.0, 0.1 / max(float(np.abs(step).max()), 1e-300))


def _tangents(
    shape: Surfaced, at: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Position and derivatives by s and v (3,) of a particle, by differences that stay on the strip."""
    s, v = (np.clip(at[k] + _DIFFERENCE * np.array([-1.0, 0.0, 1.0]), low[k], high[k]) for k in (0, 1))
    points = shape.points(s, v)
    by_s = (points[2, 1] - points[0, 1]) / (s[2] - s[0])
    by_v = (points[1, 2] - points[1, 0]) / (v[2] - v[0])
    return points[1, 1], by_s, by_v


def _far(at: FloatArray, turns: _Turns) -> Place | None:
    """Both particles in order of s, where they are no neighbours."""
    if at[0] > at[2]:
        at = at[[2, 3, 0, 1]]
    i, j = (np.clip(np.array([int(s * turns.cells)]), 0, turns.cells - 1) for s in at[[0, 2]])
    return Place(*map(float, at)) if turns.far(i, i, j, j)[0] else None
