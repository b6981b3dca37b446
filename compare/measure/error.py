"""The discretisation error of a state, and of the numbers that are told of it, from the same on finer elements.

Shapes by their distances (lengths in l), numbers by their own changes (in their own unit): with a change that falls by
the ratio r = 2^-q in every halving what is left is a geometric series, exact for one term c h^q of the error (L. F.
Richardson 1911, doi:10.1098/rsta.1911.0009). Two guards keep it a bound: r is taken as `MOST_RATIO` at the most, and a
change that is less than 1 / `MOST_DROP` of the one before is taken as that, since no order of these elements lets it
fall so far: it is small by chance.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from compare.measure.distance import grid_hausdorff, grid_hausdorffs

FloatArray = NDArray[np.float64]

#: Factor for what an estimate by three meshes leaves out, the terms of higher order (P. J. Roache 1994,
#: doi:10.1115/1.2910291).
SAFETY = 1.25
#: Largest factor by which a halving is taken to lessen the error.
MOST_RATIO = 0.5
#: Furthest that a change is believed to fall in a halving: the order 5, where energies of linear curvatures have 4.
MOST_DROP = 32.0


def rest(first: float, second: float) -> float:
    """What is left beyond the last of three states whose neighbours are `first`, then `second` apart: a geometric
    series with the ratio second / first, taken as `MOST_RATIO` at the most."""
    ratio = min(second / first, MOST_RATIO) if first > 0.0 else MOST_RATIO
    return second * ratio / (1.0 - ratio)


def beyond(first: float, second: float) -> float:
    """Distance from the middle one of three states to their limit: `second`, to the last one, and the `rest`."""
    return second + rest(first, second)


def behind(first: float, second: float, whole: float) -> float:
    """Distance from the first of three states to their limit, where neighbours are `first`, then `second` apart and the
    first and the last one `whole`: the furthest of the others, and the `rest`."""
    return max(whole, first) + rest(first, max(second, first / MOST_DROP))


def extrapolated(shapes: Sequence[FloatArray]) -> float | None:
    """Distance (Hausdorff) from the first of up to three shapes (k, m, 3) to their limit, each on elements half as long
    as the one before; None for a single one.

    With d_1, d_2 the distances of neighbours: `behind`. Of two: 2 d_1, which bounds the error when halving the elements
    halves it at least.
    """
    if len(shapes) < 2:
        return None
    if len(shapes) == 2:
        return 2.0 * grid_hausdorff(shapes[0], shapes[1])
    return behind(*grid_hausdorffs(shapes, [(0, 1), (1, 2), (0, 2)]))


def error_of_first(values: Sequence[ArrayLike]) -> float | None:
    """Error of the first of up to three values, numbers or vectors of one shape and unit, each on elements half as long
    as the one before, in the Euclidean norm: `SAFETY` times `behind`; of two 2 |change|. None for a single one, or
    where one is not finite.

    For one term c h^q with q >= 1 `behind` is the error itself; with noise of at most e on every value the error is
    less than it and 12 e.
    """
    known = _finite(values)
    if known is None or len(known) < 2:
        return None
    if len(known) == 2:
        return 2.0 * _apart(known[0], known[1])
    first, second, third = known[:3]
    return SAFETY * behind(_apart(first, second), _apart(second, third), _apart(first, third))


def error_of_last(values: Sequence[ArrayLike]) -> float | None:
    """Error of the last of the values, each on finer elements than the one before (the last ones half as long): its
    change, which bounds it when halving the elements halves it at least, but no less than the changes before it let it
    be (`MOST_DROP`). None for a single one, or where one is not finite."""
    known = _finite(values)
    if known is None or len(known) < 2:
        return None
    left = 0.0
    for one, other in pairwise(known):
        left = max(_apart(one, other), left / MOST_DROP)
    return left


def _finite(values: Sequence[ArrayLike]) -> list[FloatArray] | None:
    known = [np.asarray(value, dtype=float) for value in values]
    return known if all(np.all(np.isfinite(value)) for value in known) else None


def _apart(one: FloatArray, other: FloatArray) -> float:
    return float(np.linalg.norm(np.atleast_1d(other - one)))
