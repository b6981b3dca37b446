"""What a ribbon does when a key of its scene changes: exact derivatives by the chain rule.

The solver knows w / l, h / l, nu, K l and Gamma. A scene in SI units gives Gamma by::

    Gamma = 12 (1 - nu^2) rho g l^3 / (Y h^2)

so that Young's modulus, density and, beside what else they do, thickness and Poisson's ratio act through it; what
pulls at the end in newtons is F l^2 / (D w), D = Y h^3 / (12 (1 - nu^2)).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from compare.models.base import State
from compare.models.capabilities import Moves, NotDifferentiable
from compare.scene.scene import Scene
from ribbon import errors, gradients
from ribbonbench.errors import BadInput

FloatArray = NDArray[np.float64]

#: Keys by which there are derivatives.
KEYS = (
    "strip.width", "strip.thickness", "strip.poisson", "strip.natural_curvature", "strip.gamma", "strip.young",
    "strip.density",
)  # fmt: skip


def derivatives(
    scene: Scene, state: State, keys: Sequence[str], of: Callable[[Moves], dict[str, FloatArray]]
) -> dict[str, FloatArray]:
    """d(output) / d(key) by key, in the output's unit per unit of the key in the scene.

    state: the ribbon's, of this scene; of: which output, e.g. ``lambda g: g.position(s)`` for positions in l (k, 3).
    A natural curvature that is a law is shifted as a whole. Raises `BadInput` for a key by which there is no derivative
    or that the scene does not give, and `NotDifferentiable` where the state has none.
    """
    own = {key: _chain(scene, key) for key in keys}
    names = sorted({"poisson"}.union(*own.values()))
    try:
        by = of(gradients(state.native, names, unstable=state.stable is False))
    except errors.NotDifferentiable as error:
        raise NotDifferentiable(str(error)) from None
    if "natural_curvature" in by:
        by["natural_curvature"] = by["natural_curvature"].sum(axis=-1)
    if "tip" in by:
        by["tip"] = by["tip"] @ _newtons(scene)
    none = np.zeros_like(by["poisson"])
    return {key: sum((factor * by[name] for name, factor in parts.items()), none) for key, parts in own.items()}


def solved_near(scene: Scene, near: State | None) -> State | None:
    """The ribbon's stable state of a scene from a neighbouring one's; None where there is none, or where it does not
    lead to one. Raises `BadInput` like the model."""
    from compare.models.base import Seconds
    from compare.models.ribbon.build import ribbon_problem
    from compare.models.ribbon.state import own_size, state_of
    from ribbon import switch

    if near is not None and near.ok:
        old = near.native.problem
        problem = ribbon_problem(scene, old.formulation)
        if not np.array_equal(problem.lengths, old.lengths):
            problem = problem.with_changes(lengths=old.lengths)
        found = switch(problem, near.native)
        if found.ok:
            return state_of(scene, found, own_size(found), Seconds(float("nan")))
    return None


def _chain(scene: Scene, key: str) -> dict[str, float]:
    """The solver's parameters that the key moves, and by how much per unit of the key."""
    strip = scene.strip
    name = key.removeprefix("strip.")
    value = getattr(strip, name, None) if key in KEYS else None
    if value is None:
        problem = "has no derivative here" if key not in KEYS else "is not given by the scene"
        raise BadInput(key, None, problem, f"use keys that the scene gives, of {', '.join(KEYS)}")
    weight = scene.gamma if strip.gamma is None else 0.0  # the part of Gamma that follows from other keys
    by_gamma = {
        "gamma": 1.0 if scene.gravity is not None else 0.0,
        "young": -weight / strip.young if strip.young else 0.0,
        "density": weight / strip.density if strip.density else 0.0,
        "thickness": -2.0 * weight / strip.thickness if strip.thickness else 0.0,
        "poisson": -2.0 * strip.poisson * weight / (1.0 - strip.poisson**2),
    }.get(name, 0.0)
    found = {"gamma": by_gamma} if by_gamma else {}
    direct = {"width": 1.0 / strip.length, "poisson": 1.0, "natural_curvature": strip.length}
    if strip.thickness is not None:
        direct["thickness"] = 1.0 / strip.length
    if name in direct:
        found[name] = direct[name]
    if np.any(_newtons(scene)):
        by_tip = {
            "young": -1.0 / (strip.young or 1.0),
            "thickness": -3.0 / (strip.thickness or 1.0),
            "width": -1.0 / strip.width,
            "poisson": -2.0 * strip.poisson / (1.0 - strip.poisson**2),
        }
        if name in by_tip:
            found["tip"] = by_tip[name]
    return found


def _newtons(scene: Scene) -> FloatArray:
    """The part (3,) of the force at the end, in D w / l^2, that the scene gives in newtons or kilograms."""
    if scene.tip is None or scene.strip.young is None:
        return np.zeros(3)
    given = scene.tip.load or 0.0
    return scene.tip_force if scene.up is None else scene.tip_force + given * scene.up
