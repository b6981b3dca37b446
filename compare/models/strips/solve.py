"""Several strips, solved as their scene says: the state of all, each strip's shape, and what acts between them."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.measure.balance import Push, Wrench, abscissae
from compare.models.ribbon.state import RibbonShape
from compare.models.strips.balance import left_over
from compare.models.strips.build import arguments, check_model
from compare.models.strips.walls import walls_of_strip
from compare.scene.strips.read import leg
from compare.scene.strips.scene import StripsScene
from ribbonbench.errors import BadInput

FloatArray = NDArray[np.float64]

#: What ribbon.find.strips refuses -> where the scene says it.
_KEYS = {"walls": "wall", "joint": "joint", "strips": "strip", "start": "contact.distance", "tip": "strip.tip",
         "moment": "strip.tip.moment", "friction": "contact.friction"}  # fmt: skip
#: Words of a status that has a shape and forces.
_STATIONARY = ("converged", "saddle")


@dataclass(frozen=True)
class Went:
    """How a path went to one of its stages: how far (t, 1: there), in how many increments, and where it jumped."""

    stage: int
    t: float
    increments: int
    jumps: tuple[float, ...]


@dataclass(frozen=True)
class StripsState:
    """The state of several strips: `native`, a `ribbon.find.strips.result.StripsEquilibrium`; shapes: each strip's, in
    its own l; over: each one's length over the first one's; balance: what is left of force and moment of each strip;
    seconds: the solve with its verdict, and its error; went: how the path to it went, leg by leg."""

    scene: StripsScene
    native: Any
    shapes: tuple[RibbonShape, ...]
    over: tuple[float, ...]
    balance: tuple[float, ...]
    seconds: dict[str, float]
    went: tuple[Went, ...] = ()

    @property
    def ok(self) -> bool:
        """Converged and stable."""
        return bool(self.native.ok)

    @property
    def is_equilibrium(self) -> bool:
        """Stationary, stable or not: it has a shape and forces."""
        return self.native.status.code in _STATIONARY


def solved(
    scene: StripsScene, leave_saddle: bool = True, say: Callable[[str], object] | None = None, error: bool = True
) -> StripsState:
    """The state of a scene of several strips; error: whether its distance to finer elements is asked.

    `BadInput` for what cannot be; whatever the minimiser meets is a status of the result."""
    from ribbon import RibbonInputError
    from ribbon.find.strips.finer import with_error
    from ribbon.solvers import choose

    check_model(scene)
    clock = time.perf_counter()
    try:
        with choose.using(scene.first.model.solver):
            found, went = _found(scene, leave_saddle, say)
            first = time.perf_counter() - clock
            if error and say is not None:
                say("the same strips on elements half as long")
            found = with_error(found) if error else found
    except RibbonInputError as refusal:
        raise BadInput(_KEYS.get(refusal.key, refusal.key), refusal.value, refusal.remedy) from None
    seconds = {"first": first, "error": time.perf_counter() - clock - first}
    shapes = tuple(RibbonShape(strip) for strip in found.strips)
    over = tuple(found.problem.lengths_over)
    known = found.status.code in _STATIONARY
    balance = tuple(_balance(scene, found, k) if known else float("nan") for k in range(len(shapes)))
    return StripsState(scene, found, shapes, over, balance, seconds, went)


def _found(scene: StripsScene, leave_saddle: bool, say: Callable[[str], object] | None) -> tuple[Any, tuple[Went, ...]]:
    """The state of the scene, at the end of its path if it has one, and how each of its legs went."""
    from ribbon.find.strips import solve as strips
    from ribbon.find.strips.assemble import assembled
    from ribbon.find.strips.path import follow
    from ribbon.solvers.budget import within

    def problem(between: Callable[[float], StripsScene], t: float) -> Any:
        return assembled(**arguments(between(t)))

    budget, begin = scene.first.model.budget, scene.stages[0] if scene.stages else scene
    first = arguments(begin)
    first["walls"] = [replace(wall, friction=0.0) for wall in first["walls"]]  # put there without
    first["friction"] = 0.0
    state = strips.solve(**first, leave_saddle=leave_saddle, budget=budget)
    went: list[Went] = []
    for number in range(len(scene.stages)):
        if state.status.code not in _STATIONARY:
            why = f"the way ended before stage {number + 2} of {len(scene.stages) + 1}: {state.message}"
            return replace(state, message=why), tuple(went)
        if number + 1 == len(scene.stages) and scene.ends_at_its_last_stage:
            break  # increments that change nothing would only forget how it came there
        if say is not None:
            say(f"stage {number + 2} of {len(scene.stages) + 1}")
        between = leg(scene, number)
        with within(budget):
            state, t, log = follow(partial(problem, between), state, scene.steps[number + 1])
        kept = sum(one.kept for one in log)
        went.append(Went(number + 2, t, kept, tuple(one.t for one in log if one.jump)))
        if t < 1.0:
            why = f"the way to stage {number + 2} stopped at t = {t:.4g}: no equilibrium was found beyond it"
            return replace(state, status=strips.Status.NOT_CONVERGED, message=why), tuple(went)
    return state, tuple(went)


def _balance(scene: StripsScene, found: Any, k: int) -> float:
    """What is left of force and moment of strip k, D_0 w_0 / l_0^2 and D_0 w_0 / l_0."""
    over, unit = found.problem.lengths_over[k], found.problem.stiffness_over[k]
    strip = found.strips[k]
    wrenches = []
    for support, place, end in ((strip.start, 0.0, 0), (strip.end_support, 1.0, -1)):
        if support is not None and scene.clamped((k, end)):
            at = over * strip.position([place])[0]
            wrenches.append(Wrench(at, unit / over * support.force, unit * support.moment))
    pull = strip.problem.tip
    if pull is not None:
        wrenches.append(Wrench(over * strip.position([1.0])[0], unit / over * np.asarray(pull), np.zeros(3)))
    if strip.problem.moment is not None:
        wrenches.append(Wrench(np.zeros(3), np.zeros(3), unit * np.asarray(strip.problem.moment)))
    for joint in found.joints:
        for joined, sign in ((joint.other, 1.0), (joint.one, -1.0)):
            if joined.strip == k:
                wrenches.append(Wrench(joint.at, sign * joint.force, sign * joint.moment))
    for touch in found.touching:
        for number, at, sign in ((touch.one, touch.at, 1.0), (touch.other, touch.at_other, -1.0)):
            if number == k:
                wrenches.append(Wrench(at, sign * touch.force, np.zeros(3)))
    for slide in found.slides:
        for number, sign in ((slide.one, 1.0), (slide.other, -1.0)):
            if number == k:
                wrenches.append(Wrench(slide.point, sign * slide.friction, np.zeros(3)))
    s, _ = abscissae()
    places = over * (_middle(strip, s) if scene.first.gravity and scene.first.gravity.exact else strip.position(s))
    pushes = [
        Push(wall.normals, wall.force, wall.points) for wall in walls_of_strip(scene, found, k) if len(wall.points)
    ]
    wrenches += [
        Wrench(rub.point, rub.friction, np.zeros(3)) for wall in walls_of_strip(scene, found, k) for rub in wall.rubs
    ]
    return left_over(places, unit / over * scene.strips[k].gamma, scene.up, wrenches, pushes)


def _middle(strip: Any, s: FloatArray) -> FloatArray:
    """Centres of mass (k, 3) of the lines across the surface at s."""
    v, weights = np.polynomial.legendre.leggauss(4)
    half = 0.5 * strip.problem.strip.relative_width
    grid = RibbonShape(strip).points(s, half * v)
    return np.asarray(np.einsum("kmc,m->kc", grid, 0.5 * weights))
