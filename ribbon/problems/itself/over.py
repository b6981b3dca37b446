"""One row for each place of contact, on the segment that the place is in.

Beside a joint a place is looked for on the segments on both sides, each continued a little beyond it (`BEYOND`). Both
rows then hold the same place: which of them takes its force is left to differences of rounding, a state is held from
both sides, and a place on a segment continued is beside the strip. An equilibrium is told with one row a place: those
beyond their segments go to the next ones, whose curvatures are the same at the joint, and the same places are one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ribbon.problems.itself.pairs import Pair, PairRows

FloatArray = NDArray[np.float64]

#: Part of a segment by which a place may be beyond it: both elements are alike there up to (jump of the curvature's
#: slope) (1e-6 h)^3.
HERE = 1e-6
#: Parts of a segment and of half a width by which two places are one.
_ONE, _ACROSS = 0.05, 0.1


def gone_over(
    rows: PairRows, x: FloatArray, push: FloatArray, ring: bool
) -> tuple[tuple[Pair, ...], FloatArray] | None:
    """Pairs where their places are, each once, and with what (m,) they push; None where that changes nothing.

    x (n,): unknowns; push (k,): of the rows, in their unit; ring: abscissae go round.
    """
    along = rows.free_places(x)
    along = along % 1.0 if ring else np.clip(along, 0.0, 1.0)
    places = rows.places(x)
    places[:, ::2] = along
    near = np.stack([_ONE * rows.long.min(axis=1), np.full(rows.count, _ACROSS * rows.half_width)], axis=1)
    found: list[int] = []
    force = np.zeros(rows.count)
    for k in np.argsort(-push, kind="stable"):
        off = np.abs(places[found] - places[k])
        same = (off[:, ::2] < near[k, 0]).all(axis=1) & (off[:, 1::2] < near[k, 1]).all(axis=1)
        first = found[int(np.argmax(same))] if same.any() else int(k)
        if first == k:
            found.append(first)
        force[first] += push[k]
    if len(found) == rows.count and not (np.abs(rows.past(x)) > HERE * rows.long).any():
        return None
    found.sort()
    return tuple(rows.pairs[k].at(places[k]) for k in found), force[found]
