"""How far the points of a line are from another one: its largest distance, a point's being that to the nearest piece.

Only the largest is asked for, so that a point is left as soon as one piece is as near as another point was far (A. A.
Taha and A. Hanbury, IEEE Trans. Pattern Anal. Mach. Intell. 37, 2015, 2153): the point farthest from its like comes
first, and pieces are looked at from a point's like on, by steps as long as the point is farther than from the nearest
one so far. Of two shapes of one strip, point by point alike, that is a few pieces a point.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def square(point, a, b):
    """Square of the distance of `point` (3,) from the piece from a (3,) to b (3,)."""
    along, length = 0.0, 0.0
    for c in range(3):
        along += (point[c] - a[c]) * (b[c] - a[c])
        length += (b[c] - a[c]) ** 2
    t = min(max(along / length, 0.0), 1.0) if length > 0.0 else 0.0
    found = 0.0
    for c in range(3):
        found += (point[c] - a[c] - t * (b[c] - a[c])) ** 2
    return found


@njit(cache=True)
def nearest(point, line, like, longest, enough):
    """Square of the distance of `point` (3,) from `line` (k, 3), looked for from the vertex `like` on to both ends; the
    first that is at most `enough` where there is one. longest: of the pieces."""
    pieces = len(line) - 1
    found = np.inf
    for way in (1, -1):
        piece = like if way == 1 else like - 1
        while 0 <= piece < pieces:
            here = square(point, line[piece], line[piece + 1])
            if here < found:
                found = here
                if found <= enough:
                    return found
            # who is farther than the nearest by n pieces finds none that is nearer before the n-th
            piece += way * max(1, int((np.sqrt(here) - np.sqrt(found)) / longest))
    return found


@njit(cache=True)
def farthest(points, line, least):
    """Largest distance of `points` (k, 3) from the polyline `line` (k, 3), whose vertices are their likes; `least`
    where none is farther. NaN where a point is not finite."""
    first, bound, longest = 0, -1.0, 0.0
    for k in range(len(points)):
        apart, length = 0.0, 0.0
        for c in range(3):
            apart += (points[k, c] - line[k, c]) ** 2
            length += (line[k, c] - line[max(k - 1, 0), c]) ** 2
        if not np.isfinite(apart):
            return np.nan
        longest = max(longest, length)
        if apart > bound:
            first, bound = k, apart
    longest = max(np.sqrt(longest), 1e-12)
    largest = least**2
    largest = max(largest, nearest(points[first], line, first, longest, largest))
    for k in range(len(points)):
        largest = max(largest, nearest(points[k], line, k, longest, largest))
    return np.sqrt(largest)
