"""The keys that switch one of a ribbon's effects off alone, and what an evaluation of the ribbon's problem takes.

What an effect costs is the difference of the problems with and without it, in the same formulation.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.models.effects.weightless import weightless
from compare.models.ribbon.build import build_arguments, ribbon_problem
from compare.scene.scene import Scene
from compare.scene.spec import DEFAULT_ELEMENTS
from compare.scene.stages import stages_without
from ribbon.energies import ENERGIES
from ribbon.find.adaptive import FIRST_SEGMENTS
from ribbon.find.seeds import joints, sampled
from ribbon.find.solve import Problem, build

FloatArray = NDArray[np.float64]

#: Effects around the solves: the problem that is evaluated is the same without them.
PROCEDURES = ("adaptive segments", "continuation path", "contact with itself")
#: An evaluation with and one without an effect are timed this often in turns; the median of the differences counts.
_SAMPLES = 40
#: Spread of the states at which it is timed.
_SPREAD = 1e-3

#: Effects that cannot be off, and why.
FIXED = {
    "free twist": "no switch: with rulings it is another model",
    "rulings do not cross": "no switch: beyond the bound no surface exists",
    "closure": "no switch: an open strip would spring back, another scene",
    "rigid motions removed": "no switch: without it the Hessian is singular",
    "stretching and shear": "no switch: the shell has them, the ribbon is the model without",
}
_RULINGS = ("clamp.start", "clamp.end", "closure")


def _straight(scene: Scene) -> dict[str, Any]:
    held = (scene.clamp_start, scene.clamp_end, scene.closure)
    return {
        f"{name}.ruling": "free"
        for name, part in zip(_RULINGS, held, strict=True)
        if part is not None and part.ruling == "straight"
    }


def _plates(scene: Scene) -> dict[str, Any]:
    return {f"wall.{k}.stiffness": None for k, wall in enumerate(scene.walls) if wall.stiffness is not None}


def _rough(scene: Scene) -> dict[str, Any]:
    walls = {f"wall.{k}.friction": None for k, wall in enumerate(scene.walls) if wall.friction}
    return walls | {f"obstacle.{k}.friction": None for k, body in enumerate(scene.obstacles) if body.friction}


_KEYS: Mapping[str, Callable[[Scene], dict[str, Any]]] = {
    "gravity": weightless,
    "load at the tip": lambda scene: {"tip": None},
    "gravity over the surface": lambda scene: {"gravity.exact": None},
    "natural curvature": lambda scene: {"strip.natural_curvature": None},
    "natural twist": lambda scene: {"strip.natural_twist": None},
    "natural curvature in the plane": lambda scene: {"strip.natural_geodesic_curvature": None},
    "clamp at the start": lambda scene: {"clamp.start": None},
    "clamp at the end": lambda scene: {"clamp.end": None},
    "straight rulings": _straight,
    "contact": lambda scene: {"wall": None} | ({"obstacle": None} if scene.obstacles else {}),
    "pressure plates": _plates,
    "contact with itself": lambda scene: {"contact": None},
    "friction": _rough,
    "continuation path": lambda scene: {"path": None},
    "adaptive segments": lambda scene: {"model.elements": DEFAULT_ELEMENTS},
}


#: Effect of an energy -> the energy that lacks it.
_LACKING = {energy.words.effect: energy.words.without for energy in ENERGIES.values() if energy.words is not None}


def keys_without(scene: Scene, effect: str, formulation: str) -> dict[str, Any]:
    """The keys that switch off `effect` alone, one that is not in `FIXED`, in the same formulation.

    What the stages of a path say about the effect goes with it. Equal segments stand for those that a tolerance placed:
    how many is the size of the solved scene (`compare.models.base.Effect.same_size`).
    """
    keys: dict[str, Any] = _KEYS[effect](scene) if effect in _KEYS else {"model.energy": _LACKING[effect]}
    if scene.path and effect not in PROCEDURES:
        keys["path"] = stages_without(scene.path, tuple(keys)) or None
    if scene.model.formulation == "auto":  # which might choose another one without the effect
        keys["model.formulation"] = formulation
    return keys


def explained_problem(scene: Scene) -> Problem:
    """The problem that is evaluated: the scene's own; on the first round's segments for a tolerance."""
    if scene.model.tolerance is None:
        return ribbon_problem(scene)
    return build(**{**build_arguments(scene), "segments": FIRST_SEGMENTS})


def starting_state(scene: Scene, problem: Problem) -> FloatArray:
    """Unknowns of the shape that the seed's curvature and ruling describe, whatever else holds the ribbon."""
    s = joints(problem.lengths)
    shape = sampled(scene.seed_curvature, s), sampled(scene.seed.ruling, s)
    return problem.state(*shape)


def _evaluate(problem: Any, x: FloatArray, rows: FloatArray) -> None:
    problem.value(x)
    problem.gradient(x)
    if not problem.row_count:
        problem.hessian(x)
        return
    problem.constraints(x)
    problem.jacobian(x)
    problem.hessian(x, rows)


def free_unknowns(problem: Any) -> int:
    """How many unknowns nothing fixes."""
    lower, upper = problem.bounds()
    return int(np.sum(lower < upper))


def bounded_unknowns(problem: Any) -> int:
    """How many of them have bounds."""
    lower, upper = problem.bounds()
    return int(np.sum(np.isfinite(upper) & (lower < upper)))


def evaluation_times(problems: tuple[Problem, ...], shape: FloatArray) -> FloatArray:
    """Times (samples, problems) in s of one evaluation of each, in turns, near the unknowns `shape`, kernels warm."""
    rng = np.random.default_rng(0)
    rows = [rng.standard_normal(problem.row_count) for problem in problems]
    times = np.empty((_SAMPLES + 1, len(problems)))
    for sample in times:
        x = shape + _SPREAD * rng.standard_normal(shape.size)
        for k, problem in enumerate(problems):
            own = np.ascontiguousarray(x[: problem.size])
            clock = time.perf_counter()
            _evaluate(problem, own, rows[k])
            sample[k] = time.perf_counter() - clock
    return times[1:]
