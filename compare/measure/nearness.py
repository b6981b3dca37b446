"""Whether a strip comes near itself, or runs through itself: contact that would happen, where no model keeps it apart.

Two particles are near each other though far apart along the strip where their distance is less than half of the strip
between them: of a straight piece none is, of a circle those more than 3.8 radii apart along it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Share of the strip between two particles below which their distance is one of two turns.
_SHARE = 0.5


@dataclass(frozen=True)
class Nearest:
    """The two particles of different turns that are nearest to each other: abscissae (l), gap (l), and whether the
    strip passes through itself anywhere."""

    s: tuple[float, float]
    gap: float
    crosses: bool


def nearest(points: FloatArray, s: FloatArray, closed: bool = False) -> Nearest | None:
    """Of particles (k, m, 3) at abscissae s (k,) in l; None where no turn comes near another.

    closed: the band ends where it begins. The gap is right to about the size of a cell of the grid.
    """
    across = points.shape[1]
    cloud, place = points.reshape(-1, 3), np.repeat(s, across)
    arc = np.abs(place[:, None] - place)
    if closed:
        arc = np.minimum(arc, 1.0 - arc)
    apart = np.linalg.norm(cloud[:, None] - cloud, axis=-1)
    apart[apart >= _SHARE * arc] = np.inf
    i, j = divmod(int(np.argmin(apart)), apart.shape[1])
    gap = float(apart[i, j])
    if not np.isfinite(gap):
        return None
    near = apart < 2.0 * _cell(points)
    first, second = np.nonzero(near & (place[:, None] < place))
    crosses = _crosses(points, np.column_stack([first // across, second // across]))
    ends = sorted((float(place[i]), float(place[j])))
    return Nearest((ends[0], ends[1]), 0.0 if crosses else gap, crosses)


def _cell(points: FloatArray) -> float:
    """The longest diagonal of a cell."""
    return float(np.linalg.norm(points[1:, 1:] - points[:-1, :-1], axis=-1).max())


def _crosses(points: FloatArray, pairs: NDArray[np.int64]) -> bool:
    """Whether an edge of the cells beside one row passes through a triangle of the cells beside the other; pairs (n, 2)
    of rows."""
    last = len(points) - 2
    pairs = np.unique(np.clip(pairs, 0, last), axis=0)
    for one, other in pairs[np.abs(pairs[:, 0] - pairs[:, 1]) > 1]:
        if _through(points[one : one + 2], points[other : other + 2]):
            return True
        if _through(points[other : other + 2], points[one : one + 2]):
            return True
    return False


def _through(edges: FloatArray, cells: FloatArray) -> bool:
    """Whether an edge of two rows (2, m, 3) passes through a triangle of two others (Moeller & Trumbore 1997)."""
    start = np.concatenate([edges[0], edges[0, :-1], edges[1, :-1]])
    along = np.concatenate([edges[1], edges[0, 1:], edges[1, 1:]]) - start
    a, b, c, d = cells[0, :-1], cells[1, :-1], cells[1, 1:], cells[0, 1:]
    corner = np.concatenate([a, a])
    one, two = np.concatenate([b, c]) - corner, np.concatenate([c, d]) - corner
    normal = np.cross(along[:, None], two)
    size = np.einsum("tk,etk->et", one, normal)
    with np.errstate(divide="ignore", invalid="ignore"):
        from_corner = start[:, None] - corner
        u = np.einsum("etk,etk->et", from_corner, normal) / size
        side = np.cross(from_corner, one)
        v = np.einsum("ek,etk->et", along, side) / size
        t = np.einsum("tk,etk->et", two, side) / size
        both = u + v
    inside = (u >= 0.0) & (v >= 0.0) & (both <= 1.0) & (t >= 0.0) & (t <= 1.0)
    return bool(inside.any())
