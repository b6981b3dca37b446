"""A critical load, a fold, an event, a jump: one number from several meshes, with its error, or said not to settle.

Such a number is a root, located to something on every mesh, and what it is on one mesh says nothing of its error. On
elements shorter and shorter by one ratio its changes fall as those of a power of their length, with an observed order
(L. F. Richardson 1911, doi:10.1098/rsta.1911.0009; P. J. Roache 1994, doi:10.1115/1.2910291), or it does not settle,
and then it has no limit that could be told.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from compare.measure.error import SAFETY

#: Orders: below the least the number is not taken to settle; what seems to be above the most is taken as the most.
LEAST_ORDER, MOST_ORDER = 0.5, 4.0


@dataclass(frozen=True)
class Settled:
    """value: the limit, or the finest mesh's where it does not settle; error: of the value, in its unit, what it was
    located to on a mesh included; where it does not settle the largest change between two meshes, which is no bound,
    nan where one mesh gives no number at all; order: the observed one, None: none, as where all changes are within
    what was located; settles: whether the error is one."""

    value: float
    error: float
    order: float | None
    settles: bool

    @property
    def text(self) -> str:
        """Value and error as a page prints them."""
        if not self.settles:
            return f"{self.value:.4f}, not settled (changes by {self.error:.1g})"
        order = "" if self.order is None else f", order {self.order:.1f}"
        return f"{self.value:.4f} +- {self.error:.1g}{order}"

    def record(self, unit: str) -> dict[str, Any]:
        """What a page keeps beside it: value, error (None: it does not settle), order and unit."""
        known = math.isfinite(self.value)
        error = self.error if self.settles else None
        return {"value": self.value if known else None, "error": error, "order": self.order, "unit": unit}


def settled(values: Sequence[float], located: float = 0.0, ratio: float = 2.0) -> Settled:
    """The limit of a number on meshes whose elements are `ratio` times shorter each than on the one before.

    values: at least two, coarse to fine, one unit; nan or inf: that mesh has none. located: how far each may be from
    the root on its own mesh (bisection). With less than three values, or where the last two changes do not fall with an
    order of `LEAST_ORDER` at least, it does not settle, unless the last change is within twice `located` and the one
    before within four times: then no order is seen, and the first is assumed. Raises ValueError for fewer than two
    values, ratio <= 1.
    """
    if len(values) < 2 or not ratio > 1.0 or located < 0.0:
        raise ValueError(f"settled: {len(values)} values, ratio {ratio}, located {located}: two values, ratio above 1")
    numbers = [float(value) for value in values]
    if not all(math.isfinite(value) for value in numbers):
        return Settled(numbers[-1], math.nan, None, False)
    changes = [later - earlier for earlier, later in itertools.pairwise(numbers)]
    rough = max(abs(change) for change in changes)
    if len(numbers) < 3:
        return Settled(numbers[-1], rough, None, False)
    before, last = changes[-2:]
    blur = 2.0 * located
    if abs(last) <= blur and abs(before) <= 2.0 * blur:
        # what is left of changes that fall with the first order at least, each as large as may be
        return Settled(numbers[-1], SAFETY * (abs(last) + blur) / (ratio - 1.0) + located, None, True)
    least = ratio**-LEAST_ORDER
    # the slowest fall that is within what was located: |last| may be that much more, |before| that much less
    if (before * last <= 0.0 and abs(last) > blur) or abs(last) > least * abs(before):
        return Settled(numbers[-1], rough, None, False)
    share = max(abs(last) / abs(before), ratio**-MOST_ORDER)
    slowest = min(max((abs(last) + blur) / max(abs(before) - blur, 1e-300), share), least)
    left = math.copysign(abs(last) * share / (1.0 - share), last)
    size = max(abs(last), abs(before) * ratio**-MOST_ORDER)  # a change that falls further is small by chance
    bound = SAFETY * max(abs(left), (size + blur) * slowest / (1.0 - slowest)) + located
    return Settled(numbers[-1] + left, bound, -math.log(share) / math.log(ratio), True)
