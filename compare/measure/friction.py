"""Whether a strip that rubs obeys Coulomb's law, from the numbers told of it alone; no solver's code is used.

At a place with the push N >= 0, the friction f on the strip and the slip u along the wall since the last increment,

    |f| <= mu N ,      f |u| + mu N u = 0 :

where it slips friction is all of mu N and against the slip, where |f| is less it does not slip.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Missed:
    """By how much Coulomb's law is missed: outside, friction beyond mu N over the largest mu N (at least 1 D w / l^2),
    against, the largest f |u| + mu N u (l of it), and leaving, friction along the normal, both over the same."""

    outside: float
    against: float
    leaving: float

    @property
    def most(self) -> float:
        """The largest of them."""
        return max(self.outside, self.against, self.leaving)


def missed(rubs: Sequence[Mapping[str, Any]], coefficient: float, normals: FloatArray) -> Missed:
    """Of the places of one wall (``push``, ``friction`` (3,), ``slip`` (3,)), of its normals (k, 3) there."""
    if not rubs:
        return Missed(0.0, 0.0, 0.0)
    push = np.array([rub["push"] for rub in rubs])
    force = np.array([rub["friction"] for rub in rubs])
    slip = np.array([rub["slip"] for rub in rubs])
    slip = slip - np.sum(slip * normals, axis=1)[:, None] * normals
    most = coefficient * push
    size = max(1.0, float(most.max()))
    outside = float(np.max(np.linalg.norm(force, axis=1) - most)) / size
    way = np.linalg.norm(slip, axis=1)[:, None]
    against = float(np.abs(force * way + most[:, None] * slip).max()) / size
    leaving = float(np.abs(np.sum(force * normals, axis=1)).max()) / size
    return Missed(max(0.0, outside, float(-push.min()) / size), against, leaving)
