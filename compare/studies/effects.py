"""Which effects a scene switches on, why, and what each costs (design rule 4: only those that the scene calls for).

What each adds is measured by switching it off alone (`compare.studies.effects_off`): unknowns, constraints and one
evaluation here, whole solves in `compare.studies.effects_measured`.
"""

from __future__ import annotations

import statistics
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from compare.errors import BadInput
from compare.models.ribbon_build import build_arguments, check_model, formulation_why, ribbon_problem
from compare.models.shell_build import line_weight, shell_words
from compare.scene.scene import Scene
from compare.studies.effects_off import PROCEDURES, refused, without
from ribbon import RibbonInputError
from ribbon.energies import ENERGIES
from ribbon.find.adaptive import FIRST_SEGMENTS
from ribbon.find.seeds import joints, sampled
from ribbon.find.solve import Problem, build

#: An evaluation with and one without an effect are timed this often in turns; the median of the differences counts.
_SAMPLES = 40
#: Spread of the states at which it is timed.
_SPREAD = 1e-3


@dataclass(frozen=True)
class Effect:
    """An effect of a scene: name, on or off, why, what it adds, and what goes when it alone is switched off.

    unknowns: how many fewer there would be (fewer fixed ones make it negative); constraints: rows; seconds: of one
    evaluation. None for an effect that is off, or that cannot be off alone: `fixed` then says why. A procedure around
    the solves (path, placed segments) costs nothing in an evaluation: seconds is None, `fixed` empty.
    """

    name: str
    on: bool
    why: str
    adds: str
    unknowns: int | None = None
    constraints: int | None = None
    seconds: float | None = None
    fixed: str = ""


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
    return problem.state(*shape)


def _evaluate(problem: Any, x: np.ndarray, rows: np.ndarray) -> None:
    problem.value(x)
    problem.gradient(x)
    if not problem.row_count:
        problem.hessian(x)
        return
    problem.constraints(x)
    problem.jacobian(x)
    problem.hessian(x, rows)


def _free(problem: Any) -> int:
    """Unknowns that nothing fixes."""
    lower, upper = problem.bounds()
    return int(np.sum(lower < upper))


def evaluation_times(problems: tuple[Problem, ...], shape: np.ndarray) -> np.ndarray:
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


def explain(scene: Scene) -> Explanation:
    """Effects of the scene, each switched off alone where it can be: unknowns, constraints, one evaluation."""
    check_model(scene)
    problem = explained_problem(scene)
    shape = starting_state(scene, problem)
    effects = (
        *_loads(scene, problem),
        *_shape(scene, problem),
        *_ends(scene, problem),
        *_walls(scene, problem),
        *_procedure(scene),
    )
    reason = scene.nonplanar_reason()
    third = (
        f"planar scene: compare adds the planar elastica (scikit-fem) as a third opinion, {third_start(scene)}"
        if reason is None
        else f"no elastica: {reason}"
    )
    lower, upper = problem.bounds()
    return Explanation(
        effects=tuple(_measured(scene, problem, shape, effect) if effect.on else effect for effect in effects),
        unknowns=_free(problem),
        bounds=int(np.sum(np.isfinite(upper) & (lower < upper))),
        constraints=problem.row_count,
        formulation=problem.formulation,
        formulation_why=formulation_why(scene, problem.formulation),
        evaluation=statistics.median(evaluation_times((problem,), shape)[:, 0].tolist()),
        third_opinion=third,
        shell=_shell(scene),
    )


def third_start(scene: Scene) -> str:
    """How the third opinion is started, in words."""
    if scene.clamp_end is None and not scene.path:
        return "begun at the natural shape"
    return "begun at the ribbon's shape, for the strip may have several"


def _measured(scene: Scene, problem: Problem, shape: np.ndarray, effect: Effect) -> Effect:
    """The effect with what its problem has more than that without it."""
    if effect.name in PROCEDURES:
        return replace(effect, unknowns=0, constraints=0)
    try:
        off = without(scene, effect.name, problem.formulation)
        other = None if off.scene is None else explained_problem(off.scene)
    except (BadInput, RibbonInputError) as refusal:
        return replace(effect, fixed=refused(refusal))
    if other is None:
        return replace(effect, fixed=off.reason)
    times = evaluation_times((problem, other), shape)
    return replace(
        effect,
        unknowns=_free(problem) - _free(other),
        constraints=problem.row_count - other.row_count,
        seconds=float(np.median(times[:, 0] - times[:, 1])),
    )


def _shell(scene: Scene) -> str:
    """What the shell does in the scene, in one sentence."""
    try:
        ratios = ", ".join(f"{r:g}" for r in scene.require_shell())
        weight = line_weight(scene)
        return f"w/h = {ratios}; {shell_words(scene)}." + (f" {weight}" if weight else "")
    except BadInput as refusal:
        return f"none: {refusal.key} {refusal.problem}."


def _loads(scene: Scene, problem: Problem) -> list[Effect]:
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
    adds = f"integrals of the position on {p} segments in every evaluation{full}"
    found = [Effect("gravity", True, f"[gravity], Gamma = {scene.gamma:g}", adds)]
    if gravity.exact:
        adds = "the rulings' share of the weight, one more term a segment"
        return [*found, Effect("gravity over the surface", True, "gravity.exact = true (eq. 2.9)", adds)]
    why = "gravity.exact is not set: along the centreline (eq. 2.10)"
    return [*found, Effect("gravity over the surface", False, why, "no term")]


def _shape(scene: Scene, problem: Problem) -> list[Effect]:
    """Natural curvature, finite width, the bounds of the rulings."""
    found = []
    start, end = scene.curvature
    if problem.has_natural_curvature:
        law = f"K l = {start:g}" if start == end else f"K l from {start:g} to {end:g}"
        found.append(Effect("natural curvature", True, law, "one term, 4 Gauss points a segment"))
    else:
        found.append(Effect("natural curvature", False, "the strip is naturally flat", "no term"))
    found.extend(_energies(scene, problem))
    bounds = f"{problem.lengths.size} pairs of bounds, no constraint"
    found.append(Effect("rulings do not cross", True, "|eta'| <= 2/w (thesis, 2.7)", bounds))
    return found


def _energies(scene: Scene, problem: Problem) -> list[Effect]:
    """The effects that energies have of their own: on for the ribbon's energy, off for all others."""
    found = []
    for name, energy in ENERGIES.items():
        if energy.words is None:
            continue
        if name != problem.energy:
            found.append(Effect(energy.words.effect, False, f'energy = "{problem.energy}"', energy.words.absent))
            continue
        why = ["chosen by the scene" if scene.model.energy == name else f'energy = "{scene.model.energy}"']
        why += [f'"{name}"'] if name not in energy.words.effect.lower() else []
        why += [f"w/l = {scene.width:g}"] if energy.knows_width else []
        found.append(Effect(energy.words.effect, True, ", ".join(why), energy.words.adds))
    return found


def _blocks(problem: Any, *names: str) -> int:
    """Rows of the blocks whose name begins with one of `names`."""
    slices = problem.block_slices().items()
    return sum(where.stop - where.start for name, where in slices if name.startswith(names))


def _ends(scene: Scene, problem: Any) -> list[Effect]:
    """Clamps at both ends, straight rulings, closure, rigid motions that nothing resists."""
    found = []
    chained = not problem.row_count
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
        found.append(Effect("clamp at the end", True, _held(scene.clamp_end), f"{rows} constraints"))
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
        why = f'closure.kind = "{scene.closure.kind}"'
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
    if not problem.row_count:
        return Effect("rigid motions removed", False, "the clamp holds them", "nothing")
    shifts, turns = (len(part) for part in problem.free_motions())
    if not shifts + turns:
        return Effect("rigid motions removed", False, "what is held, and the loads, resist all of them", "nothing")
    rows = _blocks(problem, "gauge_")
    adds = f"{rows} constraints" if rows else "the start's unknowns are fixed"
    why = f"nothing resists {shifts} translations and {turns} rotations"
    return Effect("rigid motions removed", True, why, f"{adds}; their multipliers are zero")


def _walls(scene: Scene, problem: Any) -> list[Effect]:
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
    found = [Effect("contact", True, why, adds)]
    if not plates:
        return [*found, Effect("pressure plates", False, "no wall has a stiffness", "no unknown")]
    adds = f"{plates} unknown{'s' if plates > 1 else ''} (heights) and their springs' energy"
    return [*found, Effect("pressure plates", True, "wall.stiffness", adds)]


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
