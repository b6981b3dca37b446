"""From which w/h on the usual energy is near enough to a shell, where a scene says no thickness.

An estimate falls about as a power of h/w (`compare.models.capabilities.Estimates`), so that a secant in the logarithms
of both finds where it passes the accuracy in three or four of them.
"""

from __future__ import annotations

import math
from dataclasses import replace

from compare.models.base import State
from compare.models.capabilities import Estimates
from compare.models.choice import chosen
from compare.scene.scene import Scene
from compare.scene.spec import USUAL_ACCURACY
from compare.store.progress import Reporter

#: Where the search begins, and the w/h within which it stays.
BEGIN, THICKEST, THINNEST = 100.0, 5.0, 1e4
#: How near (relative) the estimate comes to the accuracy, most estimates, and the power that they begin with.
_NEAR, _MOST, _POWER = 0.05, 5, 1.5


def leaves_open(scene: Scene) -> bool:
    """Whether a thickness would let an energy be chosen: the scene names neither an energy nor a thickness."""
    return scene.model.energy == "auto" and scene.model.accuracy is None and scene.strip.thickness is None


def enough_from(scene: Scene, state: State, accuracy: float = USUAL_ACCURACY) -> tuple[float | None, str]:
    """The w/h from which on the state is within `accuracy` (Hausdorff / l) of a shell by estimate, `THICKEST` where all
    of them are; None with the reason: up to `THINNEST` none is, or nothing can be said."""
    model = chosen(scene)
    if not state.ok:
        return None, "it is no stable state"
    if not isinstance(model, Estimates):
        return None, f"{model.name} estimates nothing"
    known: dict[float, float] = {}
    ratio = BEGIN
    for _ in range(_MOST):
        found = model.estimate(scene, state, ratio)
        if found.rival is not None:
            return None, "another state is lower"
        if found.distance == 0.0:
            return None, "no thickness moves it"
        if found.why or found.distance is None:
            return None, found.why or "the distance to a shell is not known"
        known[ratio] = found.distance
        if abs(math.log(found.distance / accuracy)) <= _NEAR:
            break
        ratio = min(max(_next(known, accuracy), THICKEST), THINNEST)
        if ratio in known:
            break
    near = [one for one, distance in known.items() if distance <= accuracy * (1.0 + _NEAR)]
    return (min(near), "") if near else (None, f"none up to w/h = {THINNEST:g} is near enough")


def _next(known: dict[float, float], accuracy: float) -> float:
    """Where the line through the last two estimates, in logarithms, passes the accuracy."""
    points = [(math.log(ratio), math.log(distance)) for ratio, distance in known.items()][-2:]
    (x, y), slope = points[-1], -_POWER
    if len(points) == 2 and points[0][1] > points[1][1] - (points[1][0] - points[0][0]):
        slope = (points[1][1] - points[0][1]) / (points[1][0] - points[0][0])
    return math.exp(x + (math.log(accuracy) - y) / min(slope, -0.2))


def with_thickness(scene: Scene, state: State, say: Reporter | None = None) -> State:
    """The state with what a thickness would change (`numbers["thickness"]`), where the scene leaves it open."""
    if not leaves_open(scene) or not state.ok:
        return state
    if say is not None:
        say.step("which thickness would change it")
    ratio, why = enough_from(scene, state)
    told = {"accuracy": USUAL_ACCURACY, "enough_from": ratio, **({"enough_from_why": why} if why else {})}
    return replace(state, numbers={**state.numbers, "thickness": told})
