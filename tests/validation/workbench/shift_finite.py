"""Thesis 7.2: up to which shift `finite` has the upright arch, on elements that stand where k' meets no stiffness.

x = w eta' / 2 of (10.13) has eta = k t / (k^2 + 1 / zeta^2), which is greatest at |k| = 1 / zeta: there

    dx / dk' = w t (1 / zeta^2 - k^2) / (2 (k^2 + 1 / zeta^2)^2) = 0

and nothing resists a change of k', so that k may cross 1 / zeta as steeply as elements let it. Elements that are not
short at such a crossing, and do not move with it, hold it; the arch then seems to go on. Here joints stand at every
crossing beside the clamps, elements are the shortest there, and both are placed anew at every state.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from compare.continuation.correct import first_point
from compare.continuation.follow import follow
from compare.continuation.point import Options, Point
from compare.measure.mesh_limit import Settled
from ribbon.find.branch.equations import Equations
from ribbon.find.branch.passages import FloatArray, Grading, passed
from tests.validation.workbench.shift_followed import SPAN, Case, Followed

#: Where elements are first placed by the crossings, l: before the clamp's curvature comes to 1 / zeta.
FIRST = 0.304
#: Crossings within this distance (l) of a clamp are followed by elements.
BESIDE = 0.03
#: First and last step of the shift, l.
STEP, LOCATED = 5e-4, 2e-5
#: Elements, longest, shortest (at crossings), growth with the distance: from long to short there, then half as long
#: everywhere else.
LADDER = (
    *(Grading(0.01, least, 0.1) for least in (1e-3, 5e-4, 1.25e-4, 3.125e-5, 7.8125e-6, 1.953125e-6)),
    Grading(0.005, 7.8125e-6, 0.05),
)  # fmt: skip
#: How many of the last ones tell the error, and the change over them below which the last shift settles, l.
TELL, SETTLED = 4, 1e-3
#: Times that a state is placed anew, its crossings having moved.
ROUNDS = 2


def limit(told: Sequence[dict[str, Any]]) -> Settled:
    """Of the shift on the last `TELL`: the last one's, with the largest change between them and what they were located
    to, where that is below `SETTLED`."""
    last = [float(one["shift"]) for one in told[-TELL:]]
    apart = max(last) - min(last) + LOCATED if len(told) == len(LADDER) else float("nan")
    return Settled(last[-1], apart, None, apart < SETTLED)


def soft(case: Case) -> float:
    """1 / zeta, 1/l, of (10.13)."""
    width = 1.0 / case.narrow
    thickness = width / case.ratio
    poisson = case.scene().strip.poisson
    return float(np.sqrt(60.0 * thickness**2 / ((1.0 - poisson**2) * width**4)))


def _curvature(point: Point) -> FloatArray:
    """At the joints (p + 1,), 1/l."""
    system = point.system
    assert isinstance(system, Equations)
    return np.asarray(system.problem(point.t).joint_values(system.whole(point.z, point.t)[0])[0])


def crossings(point: Point, limit: float) -> FloatArray:
    """Abscissae (m,) over l at which the curvature passes -limit or limit beside the clamps."""
    system, k = point.system, _curvature(point)
    assert isinstance(system, Equations)
    at = np.sort(np.concatenate([passed(system.lengths, k - limit), passed(system.lengths, k + limit)]))
    return np.asarray(at[(at < BESIDE) | (at > 1.0 - BESIDE)])


def placed(point: Point, t: float, grading: Grading, limit: float) -> Point | None:
    """The state at t on elements that stand at its passages of zero and its crossings; None where none is found."""
    found: Point | None = point
    for _ in range(ROUNDS):
        if found is None:
            return None
        system = found.system
        assert isinstance(system, Equations)
        zeros = passed(system.lengths, _curvature(found))
        lengths = grading.lengths(np.sort(np.concatenate([zeros, crossings(found, limit)])))
        new, z = system.on_lengths(found.z, found.t, lengths)
        found = first_point(new, z, t, Options().tolerance)
    return found


def reach(case: Case, ladder: Sequence[Grading] = LADDER) -> list[dict[str, Any]]:
    """On each rung: "least", "longest", "elements", "shift" of the last stable state, located to `LOCATED`, and the
    first "crossing" there (nan: none), both in l; the clamp's curvature "clamp", 1/l."""
    found = Followed(case)
    value, turn, kept = found.along.value, soft(case), [found.first]

    def seen(point: Point) -> bool:
        kept.append(point)
        return value(point.t) < FIRST

    follow(found.first, options=case.options, on_point=seen)
    start: Point | None = kept[-2]
    t, told = (FIRST - SPAN[0]) / (SPAN[1] - SPAN[0]), []
    for grading in ladder:
        start = None if start is None else placed(start, t, grading, turn)
        if start is None:
            break
        last, step = start, STEP
        while step >= LOCATED:
            there = placed(last, last.t + step / (SPAN[1] - SPAN[0]), grading, turn)
            if there is None or there.unstable:
                step *= 0.5
            else:
                last = there
        at = crossings(last, turn)
        told.append({
            "least": grading.least, "longest": grading.longest, "elements": int(_curvature(last).size - 1),
            "shift": value(last.t), "crossing": float(at[0]) if at.size else float("nan"),
            "clamp": float(_curvature(last)[0]),
        })  # fmt: skip
        print(f"  {case.name}: {told[-1]}", flush=True)
    return told
