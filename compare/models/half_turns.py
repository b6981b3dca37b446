"""Half turns of a closed band: whether a state has as many as were asked for.

The equations of a band of three half turns are those of one of a single one, its end faces joined upside down: which of
them is found is a matter of the start, and no equation keeps a strip from passing through itself on the way. So they
are counted at the end, by linking numbers of the surface.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from compare.models.base import State, Status
from ribbonbench.linking import half_turns

if TYPE_CHECKING:
    from compare.scene.scene import Scene

FloatArray = NDArray[np.float64]

#: Stations around a band at which half turns are counted; distance (l) of places of the middle line that cross, and how
#: far (l) from each other along it such places are at least.
AROUND, CROSSING, APART = 300, 1e-4, 0.1


#: What is said of a band that is no minimum.
LEFT = "; what it is left for passes through itself and ends with fewer half turns"


def are_several(scene: Scene) -> bool:
    """Whether a band of two half turns or more is asked for."""
    return scene.closure is not None and (scene.closure.half_turns or 0) > 1


def counted(scene: Scene, state: State) -> State:
    """The state; failed where it has other half turns than `closure.half_turns` asks for, or none that can be counted
    as its middle line crosses itself."""
    closure = scene.closure
    if closure is None or closure.half_turns is None:
        return state
    if are_several(scene) and state.status is Status.INFEASIBLE and state.model == "ribbon":
        return replace(state, remedy="")
    if state.shape is None or not state.is_equilibrium:
        return state
    s = np.linspace(0.0, 1.0, AROUND, endpoint=False)
    lines = state.shape.points(s, np.array([0.25, 0.0, -0.25]) * scene.width)
    near = nearest(lines[:, 1])
    found = abs(half_turns(lines, closure.turned % 2 == 1))
    if near > CROSSING and abs(found - closure.turned) < 0.5:
        unstable = are_several(scene) and state.status is Status.UNSTABLE
        return replace(state, kept=True, remedy=LEFT) if unstable else state
    asked = f"closure.half_turns = {closure.turned}"
    why = f"the band has {found:.0f} half turns, by its linking number, and {asked}"
    if near <= CROSSING:
        why = (
            f"the band crosses itself, its middle line passes itself by {near:.1g} l: half turns undo each other there "
            f"in pairs, and it is no band of {asked}"
        )
    return replace(state, status=Status.FAILED, word="failed", stable=None, message=why, remedy="")


def nearest(line: FloatArray) -> float:
    """The least distance (l) of a closed polygon (n, 3) from itself, of edges that are at least `APART` apart along it
    (S. Ericson 2005, Real-Time Collision Detection, 5.1.9)."""
    count = len(line)
    start, way = line, np.roll(line, -1, axis=0) - line
    one, other = np.triu_indices(count, max(1, round(APART * count)))
    kept = other - one <= count - APART * count
    one, other = one[kept], other[kept]
    u, v, w = way[one], way[other], start[one] - start[other]
    a, b, c, d, e = ((x * y).sum(axis=1) for x, y in ((u, u), (u, v), (v, v), (u, w), (v, w)))
    area = a * c - b * b
    s = np.clip(np.where(area > 1e-12 * a * c, (b * e - c * d) / np.where(area > 0.0, area, 1.0), 0.0), 0.0, 1.0)
    t = np.clip((b * s + e) / c, 0.0, 1.0)
    s = np.clip((b * t - d) / a, 0.0, 1.0)
    return float(np.linalg.norm(w + s[:, None] * u - t[:, None] * v, axis=1).min())
