"""Which effects a scene switches on, why, and what each costs (design rule 4: only those that the scene calls for)."""

from __future__ import annotations

import statistics
import time
from dataclasses import dataclass, replace

import numpy as np

from compare.run import ribbon_clamp, ribbon_energy, ribbon_gravity, ribbon_strip
from compare.scene import Scene
from ribbon.chained import ChainedProblem, Counters, segment_lengths

#: One evaluation of value, gradient and Hessian is timed this often; the median counts.
_SAMPLES = 40


@dataclass(frozen=True)
class Effect:
    """An effect of a scene: name, on or off, why, what it adds, and its measured part of an evaluation (s, or None)."""

    name: str
    on: bool
    why: str
    adds: str
    seconds: float | None = None


@dataclass(frozen=True)
class Explanation:
    """All effects, the size of the ribbon's problem, the time (s) of one evaluation of value, gradient and Hessian."""

    effects: tuple[Effect, ...]
    unknowns: int
    bounds: int
    formulation: str
    formulation_why: str
    evaluation: float
    third_opinion: str


def ribbon_problem(scene: Scene) -> ChainedProblem:
    """The ribbon's minimisation problem of a scene."""
    return ChainedProblem(
        ribbon_strip(scene),
        ribbon_clamp(scene),
        ribbon_gravity(scene),
        ribbon_energy(scene),
        segment_lengths(np.asarray(scene.model.lengths)),
    )


def evaluation_time(problem: ChainedProblem, shape: np.ndarray) -> float:
    """Median time (s) of one evaluation of value, gradient and Hessian near the unknowns `shape`, kernels warm."""
    rng = np.random.default_rng(0)
    states = [shape + 1e-3 * rng.standard_normal(problem.size) for _ in range(_SAMPLES + 1)]
    times = []
    for x in states:
        clock = time.perf_counter()
        problem.value(x)
        problem.gradient(x)
        problem.hessian(x)
        times.append(time.perf_counter() - clock)
    return statistics.median(times[1:])


def _without(problem: ChainedProblem, **changes: object) -> ChainedProblem:
    return replace(problem, counters=Counters(), _cache={}, **changes)  # type: ignore[arg-type]


def explain(scene: Scene) -> Explanation:
    """Effects of the scene with measured cost: each that is on is switched off alone and the evaluation timed again."""
    problem = ribbon_problem(scene)
    shape = problem.natural_state()
    whole = evaluation_time(problem, shape)
    p = problem.lengths.size
    effects = []

    if problem.has_gravity:
        spared = whole - evaluation_time(_without(problem, gravity=None), shape)
        adds = f"power series of {p} segments in every evaluation; a full Hessian"
        effects.append(Effect("gravity", True, f"[gravity], Gamma = {scene.gamma:g}", adds, spared))
    else:
        why = "no [gravity] in the scene" if scene.gravity is None else "Gamma = 0"
        effects.append(Effect("gravity", False, why, "no series is evaluated"))

    start, end = scene.curvature
    if problem.has_natural_curvature:
        flat = _without(problem, strip=replace(problem.strip, natural_curvature=(0.0, 0.0)))
        spared = whole - evaluation_time(flat, shape)
        law = f"K l = {start:g}" if start == end else f"K l from {start:g} to {end:g}"
        effects.append(Effect("natural curvature", True, law, "one term, 4 Gauss points a segment", spared))
    else:
        effects.append(Effect("natural curvature", False, "the strip is naturally flat", "no term"))

    energy = problem.energy
    if energy == "wunderlich":
        spared = whole - evaluation_time(_without(problem, energy="sadowsky"), shape)
        chosen = "chosen by the scene" if scene.model.energy == energy else f'energy = "{scene.model.energy}"'
        why = f"{chosen}, w/l = {scene.width:g}"
        effects.append(Effect("finite width (Wunderlich)", True, why, "the factor H(w eta'/2)", spared))
    else:
        effects.append(Effect("finite width (Wunderlich)", False, f'energy = "{energy}"', "H = 1, not evaluated"))

    effects.append(
        Effect("rulings do not cross", True, "|eta'| <= 2/w (thesis, 2.7)", f"{p} pairs of bounds, no constraint")
    )
    if scene.clamp_start.ruling == "straight":
        effects.append(
            Effect("clamped edge straight", True, 'clamp.start.ruling = "straight": eta(0) = 0', "one unknown less")
        )
    else:
        effects.append(Effect("clamped edge straight", False, 'clamp.start.ruling = "free"', "eta(0) is an unknown"))

    if scene.shell.width_to_thickness or scene.strip.thickness is not None:
        ratios = ", ".join(f"{r:g}" for r in scene.require_shell())
        why = f"in the shell only, w/h = {ratios}"
        effects.append(Effect("stretching and shear", True, why, "one shell process per w/h in compare"))
    else:
        why = "the scene has no thickness and no [shell]"
        effects.append(Effect("stretching and shear", False, why, "no shell run"))
    for name in ("clamp at the end", "closure", "contact", "gravity over the surface"):
        effects.append(Effect(name, False, "not in the scene", "no variable, no constraint"))

    reason = scene.nonplanar_reason()
    third = (
        "planar scene: compare adds the planar elastica (scikit-fem) as a third opinion"
        if reason is None
        else f"no elastica: {reason}"
    )
    lower, upper = problem.bounds()
    return Explanation(
        effects=tuple(effects),
        unknowns=int(np.sum(lower < upper)),
        bounds=int(np.sum(np.isfinite(lower) & (lower < upper))),
        formulation="chained",
        formulation_why="the ribbon is held at s = 0 only; the chained model needs no constraint for that",
        evaluation=whole,
        third_opinion=third,
    )
