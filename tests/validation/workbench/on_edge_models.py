"""Strips of every model on edge under their weight (thesis 7.1): straight or fallen, how stable, where they hang."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from ribbon import Clamp, Equilibrium, Gravity, Strip, solve
from ribbon.find.continuation import switch
from ribbon.find.solve import Problem, build

FloatArray = NDArray[np.float64]

#: Thesis 7.1 gives neither nu nor h: those of the shells (`shell_lateral`).
POISSON, THICKNESS = 0.35, 1e-3
#: Rolls of the clamp about its tangent (rad): from hanging to one side to upright.
ROLLS = (0.4, 0.2, 0.1, 0.03, 0.01, 0.0)
#: Distance sideways of the free end, in l, above which the strip has fallen over.
FALLEN = 1e-3
#: To this relative width the weight of the frontier is located.
LOCATED = 1e-5


@dataclass(frozen=True)
class Model:
    """One model and what its clamp holds; ruling None: the energy knows none."""

    name: str
    energy: str
    ruling: str | None = None
    keywords: tuple[tuple[str, Any], ...] = ()

    @property
    def developable(self) -> bool:
        """Whether its rulings are free to choose where it is straight."""
        return self.energy in ("sadowsky", "wunderlich")


MODELS = (
    Model("sadowsky, free", "sadowsky", "free"),
    Model("sadowsky, straight", "sadowsky", "straight"),
    Model("wunderlich, free", "wunderlich", "free"),
    Model("wunderlich, straight", "wunderlich", "straight"),
    Model("kirchhoff", "kirchhoff"),
    Model("kirchhoff, plate", "kirchhoff", None, (("stiffness", "plate"),)),
    Model("sano", "sano"),
    Model("extensible", "extensible"),
    Model("finite, free", "finite", "free"),
    Model("finite, straight", "finite", "straight"),
    Model("finite, straight, in-plane", "finite", "straight", (("in_plane", True),)),
)


def cells(width: float, count: int) -> FloatArray:
    """Lengths (count,) that grow by one ratio from w/10 at the clamp, or equal ones where those are shorter."""
    first = 0.1 * width
    if first * count >= 1.0:
        return np.full(count, 1.0 / count)
    ratio = scipy.optimize.brentq(lambda r: first * (r**count - 1.0) / (r - 1.0) - 1.0, 1.0 + 1e-9, 10.0)
    lengths = first * ratio ** np.arange(count)
    return np.asarray(lengths / lengths.sum())


def strip(width: float, gamma: float, thickness: float = THICKNESS) -> Strip:
    """Of length 1."""
    return Strip(1.0, width, POISSON, 0.0, gamma, thickness)


def held(model: Model, roll: float = 0.0) -> dict[str, Any]:
    """Arguments of `solve` and `build` for a strip on edge, its clamp rolled by an angle (rad) about its tangent."""
    rulings = {} if model.ruling is None else {"ruling": model.ruling}
    clamp = Clamp((0, 0, 0), (1, 0, 0), (0, np.cos(roll), np.sin(roll)), **rulings)
    return {"clamp": clamp, "gravity": Gravity((0, 0, 1)), "energy": model.energy, **dict(model.keywords)}


def upright(model: Model, width: float, gamma: float, segments: Any, thickness: float = THICKNESS) -> Equilibrium:
    """The straight state, stable or not."""
    return solve(strip(width, gamma, thickness), **held(model), segments=segments, seed_curvature=0.0)


def fallen(model: Model, width: float, gamma: float, segments: Any, thickness: float = THICKNESS) -> Equilibrium:
    """Where the strip hangs when its clamp is rolled to one side, and upright again in steps (thesis 7.1)."""
    one = strip(width, gamma, thickness)
    found = solve(one, **held(model, ROLLS[0]), segments=segments)
    for roll in ROLLS[1:]:
        problem: Problem = build(one, **held(model, roll), segments=segments)
        found = switch(problem, found, leave_saddle=True)
    return found


def sideways(equilibrium: Equilibrium) -> float:
    """Distance of the free end from the vertical plane of the clamp, in l."""
    return abs(float(equilibrium.end.position[1]))


def by_eigenvalue(model: Model, width: float, segments: Any, near: float) -> float:
    """Gamma_c, expected near a value, where the lowest eigenvalue of the straight state vanishes.

    Where rulings are free to choose it is zero (they move nothing) up to where one of them makes it negative.
    """

    def lowest(gamma: float) -> float:
        found = upright(model, width, gamma, segments)
        if sideways(found) > FALLEN or found.stable is None:
            raise AssertionError(f"{model.name}, w = {width:g}, Gamma = {gamma:g}: {found.message}")
        return found.lowest_eigenvalue

    if model.developable:
        return bisected(lambda gamma: lowest(gamma) < -1e-8, near)
    return float(scipy.optimize.brentq(lowest, 0.8 * near, 1.2 * near, rtol=LOCATED))


def by_shape(model: Model, width: float, segments: Any, near: float) -> float:
    """Gamma_c, expected near a value, between strips that come back upright and strips that stay fallen."""
    return bisected(lambda gamma: sideways(fallen(model, width, gamma, segments)) > FALLEN, near)


def bisected(over: Callable[[float], bool], near: float, located: float = 5e-4) -> float:
    """The weight at which `over` becomes true, within a fifth of `near`."""
    low, high = 0.985 * near, 1.015 * near
    if over(low):
        low, high = 0.8 * near, low
    if not over(high):
        low, high = high, 1.2 * near
    if over(low) or not over(high):
        raise AssertionError(f"no frontier between {low:g} and {high:g}")
    while high - low > located * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if over(middle) else (middle, high)
    return 0.5 * (low + high)
