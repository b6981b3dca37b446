"""Whether clamps, joints and contacts carry the weight of every strip: its statics alone, no constitutive law.

For a strip at rest, with the weight per length along -up at its places r(s) and every wrench (point, force, moment)
that acts on it::

    sum F - G up = 0 ,    sum (M + p x F) - int r x up g ds = 0

No solver's code is used; lengths in l_0, forces in D_0 w_0 / l_0^2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from compare.measure.balance import Push, Wrench, abscissae, unbalanced

FloatArray = NDArray[np.float64]


def left_over(
    places: FloatArray,
    weight: float,
    up: FloatArray | None,
    wrenches: Sequence[Wrench],
    pushes: Sequence[Push] = (),
) -> float:
    """What is left of force and moment over the largest of them (at least 1); places (k, 3): of the centreline (or of
    the middle line of the surface) at `abscissae`, weight: of the strip; pushes: of walls."""
    _, weights = abscissae()
    pull = np.zeros(3) if up is None else -weight * up
    return unbalanced(wrenches, pull, np.asarray(weights @ places), pushes)
