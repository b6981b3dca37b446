"""Which knot a curve is tied into: its determinant, from the crossings of a projection.

Seen from any direction the curve consists of arcs, each from one passage below to the next. At a crossing an arc i goes
over, and arcs j and k end below; the matrix with rows 2 e_i - e_j - e_k has rank n - 1 at the most, and any minor of
order n - 1 has the knot's determinant as its magnitude, |Alexander polynomial (-1)|: 1 of a curve without knot, 3 of a
trefoil (R. H. Fox's colourings). An open curve is closed far away.

A smaller proof that a rod did not go through itself than a look at its whole way: a passage would change it, or another
one undo that.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: A direction to look from that no symmetry knows.
_FROM = (0.36, 0.81, 0.47)
#: How far away an open curve is closed, over its own size.
_FAR = 20.0


def closed_far(points: FloatArray) -> FloatArray:
    """A closed polygon (k + 4, 3) of an open curve (k, 3): its ends go on straight, and are joined far away."""
    size = _FAR * float(np.ptp(points, axis=0).max())
    first = points[0] + size * _unit(points[0] - points[1])
    last = points[-1] + size * _unit(points[-1] - points[-2])
    aside = 2.0 * size * np.array([0.83, -0.21, 0.1])
    return np.vstack([first, points, last, last + aside, first + aside])


def crossings(polygon: FloatArray, direction: tuple[float, float, float] = _FROM) -> list[tuple[float, float, int]]:
    """Where a closed polygon (k, 3) crosses itself, seen from `direction`: what is below and above (index of the vertex
    before, and the share of the way to the next), and the sign of the crossing."""
    w = _unit(np.array(direction))
    u = _unit(np.cross(w, [0.0, 0.0, 1.0]))
    flat = polygon @ np.stack([u, np.cross(w, u), w], axis=1)
    a, e = flat, np.roll(flat, -1, axis=0) - flat
    i, j = np.triu_indices(len(a), 2)
    d = a[j] - a[i]
    across = e[i, 0] * e[j, 1] - e[i, 1] * e[j, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (d[:, 0] * e[j, 1] - d[:, 1] * e[j, 0]) / across
        s = (d[:, 0] * e[i, 1] - d[:, 1] * e[i, 0]) / across
    here = (t >= 0.0) & (t < 1.0) & (s >= 0.0) & (s < 1.0) & (j - i < len(a) - 1)
    found = []
    for k in np.nonzero(here)[0]:
        one, other = i[k] + t[k], j[k] + s[k]
        heights = a[i[k], 2] + t[k] * e[i[k], 2], a[j[k], 2] + s[k] * e[j[k], 2]
        sign = int(np.sign(across[k])) if heights[0] > heights[1] else -int(np.sign(across[k]))
        below, above = (one, other) if heights[0] < heights[1] else (other, one)
        found.append((float(below), float(above), sign))
    return sorted(found)


def determinant(polygon: FloatArray, direction: tuple[float, float, float] = _FROM) -> int:
    """The determinant of a closed polygon (k, 3)."""
    found = crossings(polygon, direction)
    n = len(found)
    if n < 3:
        return 1
    ends = np.array([below for below, _, _ in found])
    rows = np.zeros((n, n))
    for row, (_, above, _) in enumerate(found):
        rows[row, np.searchsorted(ends, above) % n] += 2.0  # arc k ends at the k-th passage below
        rows[row, row] -= 1.0
        rows[row, (row + 1) % n] -= 1.0
    return round(abs(float(np.linalg.det(rows[1:, 1:]))))


def _unit(v: FloatArray) -> FloatArray:
    return np.asarray(v / np.linalg.norm(v))
