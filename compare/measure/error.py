"""The discretisation error of a state from the same state on finer elements. Lengths in l."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from compare.measure.distance import grid_hausdorff, grid_hausdorffs

FloatArray = NDArray[np.float64]

#: Largest factor by which a halving is taken to lessen the error.
MOST_RATIO = 0.5


def rest(first: float, second: float) -> float:
    """What is left beyond the last of three states whose neighbours are `first`, then `second` apart: a geometric
    series with the ratio second / first, taken as `MOST_RATIO` at the most."""
    ratio = min(second / first, MOST_RATIO) if first > 0.0 else MOST_RATIO
    return second * ratio / (1.0 - ratio)


def beyond(first: float, second: float) -> float:
    """Distance from the middle one of three states to their limit: `second`, to the last one, and the `rest`."""
    return second + rest(first, second)


def extrapolated(shapes: Sequence[FloatArray]) -> float | None:
    """Distance (Hausdorff) from the first of up to three shapes (k, m, 3) to their limit, each on elements half as long
    as the one before; None for a single one.

    With d_1, d_2 the distances of neighbours: d(first, third) + `rest`. Of two: 2 d_1, which bounds the error when
    halving the elements halves it at least.
    """
    if len(shapes) < 2:
        return None
    if len(shapes) == 2:
        return 2.0 * grid_hausdorff(shapes[0], shapes[1])
    first, second, whole = grid_hausdorffs(shapes, [(0, 1), (1, 2), (0, 2)])
    return whole + rest(first, second)
