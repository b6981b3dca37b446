"""Which effects a scene switches on, why, and what each costs (design rule 4: only those that the scene calls for)."""

from __future__ import annotations

import statistics
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from compare.build import build_arguments, check_model, formulation_why, ribbon_problem
from compare.errors import BadInput
from compare.scene import Scene
from compare.shell_build import line_weight, shell_words
from ribbon import Gravity, Wall
from ribbon.adaptive import FIRST_SEGMENTS
from ribbon.chained import ChainedProblem, Counters
from ribbon.seeds import joints, sampled
from ribbon.solve import Problem, build

#: One evaluation of all that a minimiser asks for is timed this often, in bursts of both problems; the median counts.
_SAMPLES = 40
#: Spread of the states at which it is timed.
_SPREAD = 1e-3


@dataclass(frozen=True)
class Effect:
    """An effect of a scene: name, on or off, why, what it adds, and what an evaluation spares (s) when it alone is off.

    seconds: None for an effect that is off, costs nothing in an evaluation, or cannot be switched off alone.
    """

    name: str
    on: bool
    why: str
    adds: str
    seconds: float | None = None


@dataclass(frozen=True)
class Explanation:
    """All effects, the size of the ribbon's problem, and the time (s) of one evaluation.

    unknowns: those that nothing fixes; bounds: how many of them have bounds; constraints: rows; evaluation: of value,
    gradient and Hessian (and constraints and Jacobian where there are rows).
    """

    effects: tuple[Effect, ...]
    unknowns: int
    bounds: int
    constraints: int
    formulation: str
    formulation_why: str
    evaluation: float
    third_opinion: str
    shell: str


def explained_problem(scene: Scene) -> Problem:
    """The problem that `explain` measures: the scene's own; on the first round's segments for a tolerance."""
    if scene.model.tolerance is None:
        return ribbon_problem(scene)
    return build(**{**build_arguments(scene), "segments": FIRST_SEGMENTS})


def starting_state(scene: Scene, problem: Problem) -> np.ndarray:
    """Unknowns of the shape that the seed's curvature and ruling describe, whatever else holds the ribbon."""
    s = joints(problem.lengths)
    shape = sampled(scene.seed_curvature, s), sampled(scene.seed.ruling, s)
    return problem.shape(*shape) if isinstance(problem, ChainedProblem) else problem.state(*shape)


def _evaluate(problem: Any, x: np.ndarray, rows: np.ndarray) -> None:
    problem.value(x)
    problem.gradient(x)
    if isinstance(problem, ChainedProblem):
        problem.hessian(x)
        return
    problem.constraints(x)
    problem.jacobian(x)
    problem.hessian(x, rows)


def _rows(problem: Any) -> int:
    return 0 if isinstance(problem, ChainedProblem) else int(problem.constraint_bounds()[0].size)


def evaluation_time(problem: Problem, shape: np.ndarray) -> float:
    """Median time (s) of one evaluation near the unknowns `shape`, kernels warm; see `Explanation.evaluation`."""
    rng = np.random.default_rng(0)
    states = [shape[: problem.size] + _SPREAD * rng.standard_normal(problem.size) for _ in range(_SAMPLES + 1)]
    rows = rng.standard_normal(_rows(problem))
    times = []
    for x in states:
        clock = time.perf_counter()
        _evaluate(problem, x, rows)
        times.append(time.perf_counter() - clock)
    return statistics.median(times[1:])


def _without(problem: Problem, **changes: Any) -> Problem:
    if isinstance(problem, ChainedProblem):
        return replace(problem, counters=Counters(), _cache={}, **changes)
    return problem.with_changes(**changes)


class _Scale:
    """Measures what an evaluation of a problem spares when something is changed."""

    def __init__(self, problem: Problem, shape: np.ndarray) -> None:
        self.problem, self.shape = problem, shape
        self.whole = evaluation_time(problem, shape)

    def spared(self, **changes: Any) -> float:
        """Time (s) of an evaluation less that of one with `changes` to the problem."""
        return self.whole - evaluation_time(_without(self.problem, **changes), self.shape)


def explain(scene: Scene) -> Explanation:
    """Effects of the scene with measured cost: each that can be is switched off alone and an evaluation timed again."""
    check_model(scene)
    problem = explained_problem(scene)
    scale = _Scale(problem, starting_state(scene, problem))
    effects = (
        *_loads(scene, problem, scale),
        *_shape(scene, problem, scale),
        *_ends(scene, problem, scale),
        *_walls(scene, problem, scale),
        *_procedure(scene),
    )
    reason = scene.nonplanar_reason()
    third = (
        "planar scene: compare adds the planar elastica (scikit-fem) as a third opinion"
        if reason is None
        else f"no elastica: {reason}"
    )
    lower, upper = problem.bounds()
    free = lower < upper
    return Explanation(
        effects=effects,
        unknowns=int(np.sum(free)),
        bounds=int(np.sum(np.isfinite(upper) & free)),
        constraints=_rows(problem),
        formulation=problem.formulation,
        formulation_why=formulation_why(scene, problem.formulation),
        evaluation=scale.whole,
        third_opinion=third,
        shell=_shell(scene),
    )


def _shell(scene: Scene) -> str:
    """What the shell does in the scene, in one sentence."""
    try:
        ratios = ", ".join(f"{r:g}" for r in scene.require_shell())
        weight = line_weight(scene)
        return f"w/h = {ratios}; {shell_words(scene)}." + (f" {weight}" if weight else "")
    except BadInput as refusal:
        return f"none: {refusal.key} {refusal.problem}."


def _loads(scene: Scene, problem: Problem, scale: _Scale) -> list[Effect]:
    """Gravity along the centreline or over the surface."""
    p = problem.lengths.size
    gravity = problem.gravity
    if gravity is None or not problem.has_gravity:
        why = "no [gravity] in the scene" if scene.gravity is None else "Gamma = 0"
        surface = "no weight" if scene.gravity is None or not scene.gravity.exact else why
        return [
            Effect("gravity", False, why, "no weight is integrated"),
            Effect("gravity over the surface", False, surface, "no third moment of the series"),
        ]
    full = "; a full Hessian" if problem.formulation == "chained" else ""
    found = [
        Effect(
            "gravity", True, f"[gravity], Gamma = {scene.gamma:g}",
            f"integrals of the position on {p} segments in every evaluation{full}", scale.spared(gravity=None),
        ),
    ]  # fmt: skip
    if gravity.exact:
        line = Gravity(gravity.up)
        adds = "the rulings' share of the weight, one more term a segment"
        spared = scale.spared(gravity=line)
        return [*found, Effect("gravity over the surface", True, "gravity.exact = true (eq. 2.9)", adds, spared)]
    why = "gravity.exact is not set: along the centreline (eq. 2.10)"
    return [*found, Effect("gravity over the surface", False, why, "no term")]


def _shape(scene: Scene, problem: Problem, scale: _Scale) -> list[Effect]:
    """Natural curvature, finite width, the bounds of the rulings."""
    found = []
    start, end = scene.curvature
    if problem.has_natural_curvature:
        law = f"K l = {start:g}" if start == end else f"K l from {start:g} to {end:g}"
        spared = scale.spared(strip=replace(problem.strip, natural_curvature=(0.0, 0.0)))
        found.append(Effect("natural curvature", True, law, "one term, 4 Gauss points a segment", spared))
    else:
        found.append(Effect("natural curvature", False, "the strip is naturally flat", "no term"))
    energy = problem.energy
    if energy == "wunderlich":
        chosen = "chosen by the scene" if scene.model.energy == energy else f'energy = "{scene.model.energy}"'
        why = f"{chosen}, w/l = {scene.width:g}"
        spared = scale.spared(energy="sadowsky")
        found.append(Effect("finite width (Wunderlich)", True, why, "the factor H(w eta'/2)", spared))
    else:
        found.append(Effect("finite width (Wunderlich)", False, f'energy = "{energy}"', "H = 1, not evaluated"))
    bounds = f"{problem.lengths.size} pairs of bounds, no constraint"
    found.append(Effect("rulings do not cross", True, "|eta'| <= 2/w (thesis, 2.7)", bounds))
    return found


def _blocks(problem: Any, *names: str) -> int:
    """Rows of the blocks whose name begins with one of `names`."""
    if isinstance(problem, ChainedProblem):
        return 0
    slices = problem.block_slices().items()
    return sum(where.stop - where.start for name, where in slices if name.startswith(names))


def _ends(scene: Scene, problem: Any, scale: _Scale) -> list[Effect]:
    """Clamps at both ends, straight rulings, closure, rigid motions that nothing resists."""
    found = []
    chained = isinstance(problem, ChainedProblem)
    if scene.clamp_start is None:
        why = "closed: the seam is the start" if scene.closure is not None else "no [clamp.start]: free"
        found.append(Effect("clamp at the start", False, why, "nothing is held"))
    else:
        rows = _blocks(problem, "start_position", "start_frame")
        adds = "built in: the chain starts there" if chained else "its unknowns are fixed (eliminated)"
        adds = f"{rows} constraints" if rows else adds
        found.append(Effect("clamp at the start", True, _held(scene.clamp_start), adds))
    if scene.clamp_end is None:
        found.append(Effect("clamp at the end", False, "no [clamp.end]", "no constraint"))
    else:
        rows = _blocks(problem, "end_")
        spared = scale.spared(end=None)
        found.append(Effect("clamp at the end", True, _held(scene.clamp_end), f"{rows} constraints", spared))
    straight = [
        name
        for name, held in (
            ("clamp.start", scene.clamp_start),
            ("clamp.end", scene.clamp_end),
            ("closure", scene.closure),
        )
        if held is not None and held.ruling == "straight"
    ]
    if straight:
        less = 2 if straight == ["closure"] else len(straight)
        adds = "one unknown less" if less == 1 else f"{less} unknowns less"
        found.append(Effect("straight rulings", True, f'{", ".join(straight)}: ruling = "straight", eta = 0', adds))
    else:
        found.append(Effect("straight rulings", False, "no end or seam holds its ruling", "eta is an unknown there"))
    if scene.closure is None:
        found.append(Effect("closure", False, "no [closure]", "no constraint"))
    else:
        rows = _blocks(problem, "end_", "seam_")
        why = f'closure.kind = "{scene.closure.kind}"; it cannot be off alone'
        found.append(Effect("closure", True, why, f"{rows} constraints that glue the end to the start"))
    found.append(_rigid(scene, problem))
    return found


def _held(clamp: Any) -> str:
    """What a clamp of the scene holds, in words."""
    parts = [
        word
        for word, holds in (
            ("position", clamp.position is not None),
            ("frame", clamp.tangent is not None),
            ("ruling", clamp.ruling == "straight"),
        )
        if holds
    ]
    return f"holds {', '.join(parts)}"


def _rigid(scene: Scene, problem: Any) -> Effect:
    """Rigid motions that nothing resists are removed."""
    if isinstance(problem, ChainedProblem):
        return Effect("rigid motions removed", False, "the clamp holds them", "nothing")
    glued: Any = problem if hasattr(problem, "free_motions") else ribbon_problem(scene, "mixed")
    shifts, turns = (len(part) for part in glued.free_motions())
    if not shifts + turns:
        return Effect("rigid motions removed", False, "what is held, and the loads, resist all of them", "nothing")
    rows = _blocks(problem, "gauge_")
    adds = f"{rows} constraints" if rows else "the start's unknowns are fixed"
    why = f"nothing resists {shifts} translations and {turns} rotations"
    return Effect("rigid motions removed", True, why, f"{adds}; their multipliers are zero")


def _walls(scene: Scene, problem: Any, scale: _Scale) -> list[Effect]:
    """Contact with planes and pressure plates."""
    count = len(scene.walls)
    plates = sum(wall.stiffness is not None for wall in scene.walls)
    if not count:
        return [
            Effect("contact", False, "no [[wall]]", "no constraint"),
            Effect("pressure plates", False, "no [[wall]]", "no unknown"),
        ]
    rows = _blocks(problem, "wall_")
    why = "one [[wall]]" if count == 1 else f"{count} [[wall]]s"
    adds = f"{rows} inequalities: both edges of the rulings at the joints"
    found = [Effect("contact", True, why, adds, scale.spared(walls=()))]
    if not plates:
        return [*found, Effect("pressure plates", False, "no wall has a stiffness", "no unknown")]
    rigid = tuple(Wall(wall.point, wall.normal) for wall in problem.walls)
    adds = f"{plates} unknown{'s' if plates > 1 else ''} (heights) and their springs' energy"
    return [*found, Effect("pressure plates", True, "wall.stiffness", adds, scale.spared(walls=rigid))]


def _procedure(scene: Scene) -> list[Effect]:
    """What is done around the solves: placed segments, a path, shells."""
    found = []
    if scene.model.tolerance is None:
        p = len(scene.model.lengths)
        found.append(Effect("adaptive segments", False, f"model.tolerance is not set: {p} segments", "one solve"))
    else:
        why = f"model.tolerance = {scene.model.tolerance:g}"
        adds = f"rounds of two solves from {FIRST_SEGMENTS} segments on, the worst ones cut"
        found.append(Effect("adaptive segments", True, why, adds))
    if scene.path:
        stages = len(scene.path) + 1
        adds = f"{stages} stages, a solve a step, warm started"
        found.append(Effect("continuation path", True, f"{stages - 1} [[path]] before the scene", adds))
    else:
        found.append(Effect("continuation path", False, "no [[path]]", "solved from the seed"))
    if not scene.shell.width_to_thickness and scene.strip.thickness is None:
        why = "the scene has no thickness and no [shell]"
        return [*found, Effect("stretching and shear", False, why, "no shell run")]
    try:
        ratios = ", ".join(f"{r:g}" for r in scene.require_shell())
    except BadInput as refusal:
        return [*found, Effect("stretching and shear", False, f"{refusal.key} {refusal.problem}", "no shell run")]
    why = f"in the shell only, w/h = {ratios}"
    return [*found, Effect("stretching and shear", True, why, "one shell process per w/h in compare")]
