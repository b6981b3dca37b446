"""Distances between two triangulated strips, in units of l.

Hausdorff distance (thesis, chapter 3, note 2): ``max(sup_P d(P, Z), sup_Q d(Q, S))``. The suprema are taken over the
vertices, the distances to the *triangles* of the other surface (as VTK's vtkHausdorffDistancePointSetFilter does, to
which the tests hold it: loading VTK takes longer than a solve), so that the result is exact to the distance between a
triangle and the curved surface it stands for: kappa ds^2 / 8, ds the grid's spacing.
`compare.measure.grid` chooses the grid so that this stays below a hundredth of the thesis's yardstick.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from compare.measure.grid import triangles

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

FloatArray = NDArray[np.float64]


class _Triangles:
    """Triangles (T, 3) of points (N, 3), ready for distances to them. grid: the points as (along, across, 3) where they
    are one, all of them vertices of triangles."""

    def __init__(self, points: FloatArray, corners: NDArray[np.int64], grid: FloatArray | None = None) -> None:
        self.points, self.grid = points, grid
        self.a = points.take(corners[:, 0], axis=0)
        self.ab, self.ac = (points.take(corners[:, k], axis=0) - self.a for k in (1, 2))
        self.middle = self.a + (self.ab + self.ac) / 3.0
        bb, bc, cc = _square(self.ab), _dot(self.ab, self.ac), _square(self.ac)
        squares = bb + cc + 2.0 * bc, 4.0 * (bb - bc) + cc, bb + 4.0 * (cc - bc)  # nine times to a, b, c
        self.radius = np.sqrt(np.maximum(np.maximum(*squares[:2]), squares[2])) / 3.0
        self._corners = corners

    @cached_property
    def _used(self) -> NDArray[np.int64]:
        """Vertices (n,) of triangles."""
        return np.unique(self._corners)

    @cached_property
    def _tree(self) -> cKDTree:
        from scipy.spatial import cKDTree  # not before it is needed

        return cKDTree(self.points[self._used], compact_nodes=False, balanced_tree=False)

    @cached_property
    def _blocks(self) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
        """First triangle (b,) of blocks of neighbours in the list; centre (b, 3), radius (b,) of a ball about each."""
        first = np.arange(0, len(self.a), _BLOCK)
        count = np.diff(np.append(first, len(self.a)))
        centre = np.add.reduceat(self.middle, first) / count[:, None]
        reach = np.sqrt(_square(self.middle - np.repeat(centre, count, axis=0))) + self.radius
        return first, centre, np.maximum.reduceat(reach, first)

    def _near(self, points: FloatArray, bound: FloatArray) -> NDArray[np.int64]:
        """Triangles (t,) among which are all that are no farther than its bound from one of the points."""
        first, centre, reach = self._blocks
        apart = np.sqrt(_square(points[:, None, :] - centre)) - reach
        block = np.flatnonzero((apart <= bound[:, None] * (1.0 + 1e-9) + 1e-12 * reach).any(axis=0))
        near = (first[block][:, None] + np.arange(_BLOCK)).ravel()
        return near[near < len(self.a)]

    @cached_property
    def _fans(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Triangles, vertex by vertex, and where those of every used vertex begin."""
        count = np.bincount(self._corners.ravel(), minlength=len(self.points))[self._used]
        return np.argsort(self._corners.ravel(), kind="stable") // 3, np.concatenate([[0], np.cumsum(count)])

    def nearest_vertex(self, points: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
        """Distance (k,) and number (k,), among the used ones, of the vertex that is nearest to each point (k, 3)."""
        distance, vertex = self._tree.query(points)
        return distance, vertex

    def around(self, points: FloatArray, vertex: NDArray[np.int64]) -> FloatArray:
        """Least distance (k,) of each point (k, 3) to the triangles around its vertex (k,)."""
        around, first = self._fans
        count = first[vertex + 1] - first[vertex]
        point = np.repeat(np.arange(len(points)), count)
        within = np.arange(point.size) - np.repeat(np.cumsum(count) - count, count)
        triangle = around[np.repeat(first[vertex], count) + within]
        found = np.full(len(points), np.inf)
        np.minimum.at(found, point, self._squares(points[point], triangle))
        return np.sqrt(found)

    def exact(self, points: FloatArray, bound: FloatArray) -> FloatArray:
        """Distance (k,) of each point (k, 3) to the nearest triangle, which is no farther than its bound (k,)."""
        near = self._near(points, bound)
        apart = np.sqrt(_square(points[:, None, :] - self.middle[near]))
        bound = np.minimum(bound, apart.min(axis=1, initial=np.inf))
        point, triangle = np.nonzero(apart - self.radius[near] <= bound[:, None] * (1.0 + 1e-9) + 1e-300)
        found = bound**2
        np.minimum.at(found, point, self._squares(points[point], near[triangle]))
        return np.sqrt(found)

    def _squares(self, points: FloatArray, triangle: NDArray[np.int64]) -> FloatArray:
        """Squares (k,) of the distances of points (k, 3) to triangles (k,): to the plane's part inside, or an edge."""
        ap, ab, ac = points - self.a[triangle], self.ab[triangle], self.ac[triangle]
        least = np.minimum(_to_edge(ap, ab), np.minimum(_to_edge(ap, ac), _to_edge(ap - ab, ac - ab)))
        bb, bc, cc = _dot(ab, ab), _dot(ab, ac), _dot(ac, ac)
        pb, pc = _dot(ap, ab), _dot(ap, ac)
        area = bb * cc - bc * bc
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v = (cc * pb - bc * pc) / area, (bb * pc - bc * pb) / area
            inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0)  # false where a triangle has no area
        inner = ap[inside] - u[inside, None] * ab[inside] - v[inside, None] * ac[inside]
        least[inside] = np.minimum(least[inside], _square(inner))
        return least


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2])


def _square(a: FloatArray) -> FloatArray:
    return _dot(a, a)


def _to_edge(ap: FloatArray, edge: FloatArray) -> FloatArray:
    """Squares (k,) of the distances of p to edges that begin at a: ap, edge (k, 3)."""
    t = np.clip(_dot(ap, edge) / np.maximum(_square(edge), 1e-300), 0.0, 1.0)
    return _square(ap - t[:, None] * edge)


def _slid(points: FloatArray, like: NDArray[np.int64], bound: FloatArray, grid: FloatArray) -> FloatArray:
    """Least distance (n,) of points (n, 3) from vertices of a grid (along, across, 3): from their likes (n,), at
    distances `bound` (n,), along the lines of the grid to where the line's tangent is square to what is left,
    `_SLIDES` times."""
    along, across = grid.shape[:2]
    vertices = grid.reshape(-1, 3)
    row, line, here = like // across, like % across, like
    for _ in range(_SLIDES):
        tangent = 0.5 * (grid[np.minimum(row + 1, along - 1), line] - grid[np.maximum(row - 1, 0), line])
        size = np.maximum(_square(tangent), 1e-300)
        steps = np.clip(np.rint(_dot(points - vertices[here], tangent) / size), -along, along)
        row = np.clip(row + steps.astype(np.int64), 0, along - 1)
        here = row * across + line
        bound = np.minimum(bound, np.sqrt(_square(points - vertices[here])))
    return bound


def _apart(a: _Triangles, b: _Triangles) -> float:
    """Symmetric Hausdorff distance of two surfaces.

    Each point has an upper bound: where both surfaces have as many points, the distance to its like, of a grid to what
    lies beside that along a line, then the nearest vertex, then the triangles around it. Only points whose bound is
    above the largest distance known, of either surface, are looked at more closely, those with the largest bounds
    first, at last against every triangle that can be nearer.
    """
    ways = (a.points, b), (b.points, a)
    if len(a.points) != len(b.points):
        return _farthest(b.points, a, _farthest(a.points, b, 0.0))
    like = np.sqrt(_square(a.points - b.points))
    first = slice(int(np.argmax(like)), int(np.argmax(like)) + 1)
    known = [float(other.exact(points[first], like[first]).max()) for points, other in ways]
    largest = max(known)
    for points, other in ways if known[0] >= known[1] else ways[::-1]:  # what finds the most leaves the least to do
        largest = _farther(points, other, like, largest)
    return largest


def _farther(points: FloatArray, other: _Triangles, like: FloatArray, largest: float) -> float:
    """The largest distance of `points` (N, 3) from the other surface, whose points are their likes at distances (N,);
    `largest` where none is farther."""
    left = np.flatnonzero(like > largest)
    bound = like[left]
    if left.size > _FEW and other.grid is not None:
        bound = _slid(points[left], left, bound, other.grid)
        most = np.argpartition(bound, -_FEW)[-_FEW:]
        largest = _largest(points[left], bound, most, other, largest, 1)
        left, bound = left[bound > largest], bound[bound > largest]
    if left.size <= _MANY:
        return _largest(points[left], bound, np.arange(left.size), other, largest, _FEW)
    return _farthest(points[left], other, largest)


def _farthest(points: FloatArray, other: _Triangles, largest: float) -> float:
    """The largest distance of `points` (N, 3) from the other surface; `largest` where none is farther."""
    bound, vertex = other.nearest_vertex(points)
    order = np.argsort(-bound)
    for batch in np.split(order, range(_FIRST, order.size, _FIRST)):
        if bound[batch[0]] <= largest:
            break
        bound[batch] = np.minimum(bound[batch], other.around(points[batch], vertex[batch]))
        largest = _largest(points, bound, batch, other, largest, 1)  # the first one is nearly always the last one
    return largest


def _largest(
    points: FloatArray, bound: FloatArray, some: NDArray[np.int64], other: _Triangles, largest: float, many: int
) -> float:
    """`_farthest` of `some` (n,) of the points (N, 3) with upper bounds (N,), `many` of them at first."""
    closer = some[np.argsort(-bound[some])]
    begin = 0
    while begin < closer.size and bound[closer[begin]] > largest:
        few = closer[begin : begin + many]
        largest = max(largest, float(other.exact(points[few], bound[few]).max()))
        begin, many = begin + many, _FEW
    return largest


#: Points looked at together: against the triangles around a vertex, and against all triangles; and up to how many are
#: before the nearest vertices are looked up.
_FIRST, _FEW, _MANY = 2048, 8, 100
#: Steps along the lines of a grid.
_SLIDES = 3
#: Triangles of a block, that are left out together.
_BLOCK = 64


def hausdorff(
    points_a: FloatArray, triangles_a: NDArray[np.int64], points_b: FloatArray, triangles_b: NDArray[np.int64]
) -> float:
    """Symmetric Hausdorff distance of two triangulations, points (N, 3) and triangles (T, 3); NaN where a point is not
    finite."""
    if not (np.isfinite(points_a).all() and np.isfinite(points_b).all()):
        return float("nan")
    return _apart(_Triangles(points_a, triangles_a), _Triangles(points_b, triangles_b))


def grid_hausdorff(grid_a: FloatArray, grid_b: FloatArray) -> float:
    """Symmetric Hausdorff distance of two surfaces given on material grids (along, across, 3) of any sizes; NaN where a
    point is not finite."""
    return grid_hausdorffs([grid_a, grid_b], [(0, 1)])[0]


def grid_hausdorffs(grids: Sequence[FloatArray], pairs: Sequence[tuple[int, int]]) -> list[float]:
    """`grid_hausdorff` of several pairs (their numbers) among `grids`, each made ready once."""
    ready = [_ready(grid) if np.isfinite(grid).all() else None for grid in grids]
    found = []
    for one, other in pairs:
        a, b = ready[one], ready[other]
        found.append(float("nan") if a is None or b is None else _apart(a, b))
    return found


def _ready(grid: FloatArray) -> _Triangles:
    points = np.ascontiguousarray(grid, dtype=float)
    return _Triangles(points.reshape(-1, 3), triangles(*grid.shape[:2]), points)


def centreline_distance(line_a: FloatArray, line_b: FloatArray) -> float:
    """Largest distance between points of equal abscissa of two centrelines (k, 3)."""
    return float(np.linalg.norm(line_a - line_b, axis=1).max())
