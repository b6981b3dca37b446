"""The limit of a number over halved elements: Richardson's extrapolation with the order that is observed.

With v_k on elements of length h / 2^k and v_k = v + c (h / 2^k)^q: 2^q = (v_1 - v_0) / (v_2 - v_1), and
v = v_2 + (v_2 - v_1) / (2^q - 1) (L. F. Richardson 1911, doi:10.1098/rsta.1911.0009; P. J. Roache 1994,
doi:10.1115/1.2910291).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

#: Orders that are believed: below, or where the numbers do not tend anywhere, nothing is extrapolated; above the order
#: of eigenvalues of piecewise linear fields coarse elements only seem to be better.
LEAST_ORDER, MOST_ORDER = 0.5, 2.0


@dataclass(frozen=True)
class Limit:
    """value: estimate of the limit; error: of its distance from it, the last step where no order is observed; order:
    the observed one, None: none; stray: more than two numbers, which tend nowhere."""

    value: float
    error: float
    order: float | None
    stray: bool = False

    @property
    def signed(self) -> bool:
        """Whether the limit's sign is known: it is further from zero than its error; than twice that where numbers
        tend nowhere, since one that has just left zero is as far from it as its last step."""
        return abs(self.value) > (2.0 * self.error if self.stray else self.error)


def limit_of(values: Sequence[float]) -> Limit | None:
    """The limit of `values`, each on elements half as long as the one before; None for fewer than two."""
    if len(values) < 2:
        return None
    last = values[-1] - values[-2]
    if len(values) > 2 and last != 0.0:
        ratio = (values[-2] - values[-3]) / last
        order = math.log2(ratio) if ratio > 0.0 else 0.0
        if order >= LEAST_ORDER:
            order = min(order, MOST_ORDER)
            left = last / (2.0**order - 1.0)
            return Limit(values[-1] + left, abs(left), order)
    return Limit(values[-1], abs(last), None, len(values) > 2)
