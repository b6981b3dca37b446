"""Which effects a scene switches on in the ribbon, why, and what each adds to the problem.

What an effect adds is measured by switching it off alone (`compare.models.effects.ribbon_off`): unknowns, constraints
and the time of one evaluation.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.models.base import Effect
from compare.models.capabilities import Evaluation
from compare.models.effects.ribbon_off import (
    FIXED,
    PROCEDURES,
    FloatArray,
    bounded_unknowns,
    evaluation_times,
    explained_problem,
    free_unknowns,
    keys_without,
    starting_state,
)
from compare.models.effects.switches import at_rest
from compare.models.holds.friction import rubs
from compare.models.ribbon.build import formulation_why, has_free_twist
from compare.models.scope import require_shell
from compare.scene.inputs.law import values, words
from compare.scene.scene import Scene
from ribbon import RibbonInputError
from ribbon.energies import ENERGIES, FREE_ENERGIES
from ribbon.find.adaptive import FIRST_SEGMENTS
from ribbon.find.solve import Problem
from ribbonbench.errors import BadInput

if TYPE_CHECKING:
    from compare.models.ribbon.auto import Choice


def effects(scene: Scene) -> tuple[Effect, ...]:
    """All effects that a ribbon may have, measured where they are on. Raises `RibbonInputError` for a scene that is
    impossible."""
    problem = explained_problem(scene)
    shape = starting_state(scene, problem)
    found = (
        *_loads(scene, problem),
        *_shape(scene, problem),
        *_ends(scene, problem),
        *_walls(scene, problem),
        _itself(scene),
        *_procedure(scene),
    )
    return tuple(_measured(scene, problem, shape, effect) if effect.on else effect for effect in found)


def skipped(choice: Choice) -> tuple[Effect, ...]:
    """What the energy leaves out that an accuracy chose: off, with its estimated distance as the reason."""
    return tuple(
        Effect(_SKIPPED[name][0], _SKIPPED[name][1], False, f"estimated to move the strip by {moved:.1e} l")
        for name, moved in choice.skipped.items()
    )


#: By the names of `compare.models.ribbon.auto.Choice.skipped`: the effect, and what is spared without it.
_SKIPPED = {
    "thickness": ("section that curves and stretches", "the twist is no unknown of its own"),
    "along": ("twist of a changing section", "no unknown of the section"),
    "between": ("section between soft and stiff", "no unknown of the section"),
    "odd": ("odd curling of a twisted section", "no unknown of the section"),
    "clamp": ("section held flat at a clamp", "no unknown of the section"),
    "fold": ("rulings that crowd at a clamp's corner", "no model of lines knows it"),
    "section": ("shape of the section at a clamp", "no unknown of the section"),
    "in_plane": ("bending in the strip's plane", "no in-plane curvature"),
    "corners": ("corners held alone", "no model of lines knows them"),
}


def evaluation(scene: Scene) -> Evaluation:
    """The ribbon's problem: its size, and the time of one evaluation of all that the minimiser asks for."""
    problem = explained_problem(scene)
    rows = problem.row_count
    return Evaluation(
        formulation=problem.formulation,
        why=formulation_why(scene, problem.formulation),
        unknowns=free_unknowns(problem),
        bounds=bounded_unknowns(problem),
        constraints=rows,
        of="energy, gradient, Hessian" + (", constraints and their Jacobian" if rows else ""),
        seconds=float(np.median(evaluation_times((problem,), starting_state(scene, problem)))),
    )


def _measured(scene: Scene, problem: Problem, shape: FloatArray, effect: Effect) -> Effect:
    """The effect with the keys that switch it off alone, and what its problem has more than that without it."""
    if effect.key in FIXED:
        return replace(effect, fixed=FIXED[effect.key])
    try:
        keys = keys_without(scene, effect.key, problem.formulation)
        if effect.key in PROCEDURES:
            placed = effect.key == "adaptive segments"
            return replace(effect, changes=keys, same_size=placed, unknowns=0, constraints=0)
        other = explained_problem(scene.replace(keys))
    except BadInput as refusal:
        return replace(effect, fixed=f"not alone: {refusal.key} {refusal.problem}")
    except RibbonInputError as refusal:
        return replace(effect, fixed=f"not alone: {refusal}")
    times = evaluation_times((problem, other), shape)
    return replace(
        effect,
        changes=keys,
        unknowns=free_unknowns(problem) - free_unknowns(other),
        constraints=problem.row_count - other.row_count,
        seconds=float(np.median(times[:, 0] - times[:, 1])),
    )


def _effect(name: str, on: bool, why: str, adds: str) -> Effect:
    return Effect(name, adds, on, why)


def _loads(scene: Scene, problem: Problem) -> list[Effect]:
    """Gravity along the centreline or over the surface, and what pulls at the end."""
    return [*_weight(scene, problem), _pull(problem)]


def _pull(problem: Problem) -> Effect:
    if problem.tip is None:
        return _effect("load at the tip", False, "no [tip]", "no term")
    adds = "the place of the end in every evaluation" if problem.formulation == "chained" else "a linear term"
    return _effect("load at the tip", True, f"[tip], {float(np.linalg.norm(problem.tip)):.4g} D w / l^2", adds)


def _weight(scene: Scene, problem: Problem) -> list[Effect]:
    p = problem.lengths.size
    gravity = problem.gravity
    if gravity is None or not problem.has_gravity:
        why = "no [gravity] in the scene" if scene.gravity is None else "Gamma = 0"
        surface = "no weight" if scene.gravity is None or not scene.gravity.exact else why
        return [
            _effect("gravity", False, why, "no weight is integrated"),
            _effect("gravity over the surface", False, surface, "no third moment of the series"),
        ]
    full = "; a full Hessian" if problem.formulation == "chained" else ""
    adds = f"integrals of the position on {p} segments in every evaluation{full}"
    found = [_effect("gravity", True, f"[gravity], Gamma = {scene.gamma:g}", adds)]
    if gravity.exact:
        adds = "the rulings' share of the weight, one more term a segment"
        return [*found, _effect("gravity over the surface", True, "gravity.exact = true (eq. 2.9)", adds)]
    why = "gravity.exact is not set: along the centreline (eq. 2.10)"
    return [*found, _effect("gravity over the surface", False, why, "no term")]


def _shape(scene: Scene, problem: Problem) -> list[Effect]:
    """Natural curvature, finite width, the bounds of the rulings or the twist that is free of them."""
    found = []
    if any(values(scene.curvature)):
        why = words(scene.curvature)
        found.append(_effect("natural curvature", True, why, "one term, 4 Gauss points a segment"))
    else:
        found.append(_effect("natural curvature", False, "the strip is naturally flat", "no term"))
    if scene.shaped:
        for one in at_rest(scene, "a twist at rest", "kappa_2 at rest"):
            found.append(_effect(one.key, one.on, one.why if one.on else one.why_not, one.adds))
    found.extend(_energies(scene, problem))
    if problem.fields.free:
        why = f'energy = "{problem.energy}" has no rulings'
        found.append(_effect("rulings do not cross", False, why, "no bound"))
        found.append(_effect("free twist", True, f'energy = "{problem.energy}"', FREE_ENERGIES[problem.energy].words))
        return found
    bounds = f"{problem.lengths.size} pairs of bounds, no constraint"
    found.append(_effect("rulings do not cross", True, "|eta'| <= 2/w (thesis, 2.7)", bounds))
    return found


def _energies(scene: Scene, problem: Problem) -> list[Effect]:
    """The effects that energies have of their own: on for the ribbon's energy, off for all others."""
    found = []
    for name, energy in ENERGIES.items():
        if energy.words is None:
            continue
        if name != problem.energy:
            found.append(_effect(energy.words.effect, False, f'energy = "{problem.energy}"', energy.words.absent))
            continue
        why = ["chosen by the scene" if scene.model.energy == name else f'energy = "{scene.model.energy}"']
        why += [f'"{name}"'] if name not in energy.words.effect.lower() else []
        why += [f"w/l = {scene.width:g}"] if energy.knows_width else []
        found.append(_effect(energy.words.effect, True, ", ".join(why), energy.words.adds))
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
        found.append(_effect("clamp at the start", False, why, "nothing is held"))
    else:
        rows = _blocks(problem, "start_position", "start_frame")
        adds = "built in: the chain starts there" if chained else "its unknowns are fixed (eliminated)"
        adds = f"{rows} constraints" if rows else adds
        found.append(_effect("clamp at the start", True, _held(scene.clamp_start), adds))
    if scene.clamp_end is None:
        found.append(_effect("clamp at the end", False, "no [clamp.end]", "no constraint"))
    else:
        rows = _blocks(problem, "end_")
        found.append(_effect("clamp at the end", True, _held(scene.clamp_end), f"{rows} constraints"))
    straight = [
        name
        for name, held in (
            ("clamp.start", scene.clamp_start),
            ("clamp.end", scene.clamp_end),
            ("closure", scene.closure),
        )
        if held is not None and held.ruling == "straight"
    ]
    zero, held = ("tau = 0", problem.fields.held_straight) if problem.fields.free else ("eta = 0", True)
    if straight and held:
        less = 2 if straight == ["closure"] else len(straight)
        adds = "one unknown less" if less == 1 else f"{less} unknowns less"
        found.append(_effect("straight rulings", True, f'{", ".join(straight)}: ruling = "straight", {zero}', adds))
    else:
        why = "no end or seam holds its ruling" if held else f'energy = "{problem.energy}" has no rulings'
        found.append(_effect("straight rulings", False, why, f"{zero.split()[0]} is an unknown there"))
    if scene.closure is None:
        found.append(_effect("closure", False, "no [closure]", "no constraint"))
    else:
        rows = _blocks(problem, "end_", "seam_")
        why = f'closure.kind = "{scene.closure.kind}"'
        found.append(_effect("closure", True, why, f"{rows} constraints that glue the end to the start"))
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
        return _effect("rigid motions removed", False, "the clamp holds them", "nothing")
    shifts, turns = (len(part) for part in problem.free_motions())
    if not shifts + turns:
        return _effect("rigid motions removed", False, "what is held, and the loads, resist all of them", "nothing")
    rows = _blocks(problem, "gauge_")
    adds = f"{rows} constraints" if rows else "the start's unknowns are fixed"
    why = f"nothing resists {shifts} translations and {turns} rotations"
    return _effect("rigid motions removed", True, why, f"{adds}; their multipliers are zero")


def _walls(scene: Scene, problem: Any) -> list[Effect]:
    """Contact with planes and pressure plates."""
    count, curved = len(scene.walls), len(scene.obstacles)
    plates = sum(wall.stiffness is not None for wall in scene.walls)
    if not count and not curved:
        return [
            _effect("contact", False, "no [[wall]]", "no constraint"),
            _effect("pressure plates", False, "no [[wall]]", "no unknown"),
        ]
    rows = _blocks(problem, "wall_")
    listed = ((count, "[[wall]]"), (curved, "[[obstacle]]"))
    why = ", ".join(f"one {name}" if number == 1 else f"{number} {name}s" for number, name in listed if number)
    adds = f"{rows} inequalities: both edges of the rulings at the joints"
    if any(not obstacle.inside for obstacle in scene.obstacles):
        adds += ", and points between them where an obstacle reaches there"
    found = [_effect("contact", True, why, adds)]
    if rubs(scene):
        adds = "a term of the energy at every place that is pushed, and rounds of minima in every step of the path"
        found.append(_effect("friction", True, "wall.friction or obstacle.friction", adds))
    if not plates:
        return [*found, _effect("pressure plates", False, "no wall has a stiffness", "no unknown")]
    adds = f"{plates} unknown{'s' if plates > 1 else ''} (heights) and their springs' energy"
    return [*found, _effect("pressure plates", True, "wall.stiffness", adds)]


def _itself(scene: Scene) -> Effect:
    """Contact of the strip with itself: nothing where no place touches, and the problem that is evaluated, of the
    seed's shape, has none yet."""
    if scene.apart is None:
        return _effect("contact with itself", False, "no [contact]", "no look for places that are near each other")
    adds = "looks for places that are near each other, shorter steps, an equation for each pair that touches"
    return _effect("contact with itself", True, "contact.itself", adds)


def _procedure(scene: Scene) -> list[Effect]:
    """What is done around the solves: placed segments, a path, shells."""
    found = []
    if scene.model.tolerance is None:
        p = len(scene.model.lengths)
        found.append(_effect("adaptive segments", False, f"model.tolerance is not set: {p} segments", "one solve"))
    else:
        why = f"model.tolerance = {scene.model.tolerance:g}"
        adds = f"rounds of two solves from {FIRST_SEGMENTS} segments on, the worst ones cut"
        found.append(_effect("adaptive segments", True, why, adds))
    if scene.path:
        stages = len(scene.path) + 1
        adds = f"{stages} stages, a solve a step, warm started"
        found.append(_effect("continuation path", True, f"{stages - 1} [[path]] before the scene", adds))
    else:
        found.append(_effect("continuation path", False, "no [[path]]", "solved from the seed"))
    if not scene.shell.width_to_thickness and scene.strip.thickness is None:
        why = "the scene has no thickness and no [shell]"
        return [*found, _effect("stretching and shear", False, why, "no shell run")]
    try:
        ratios = ", ".join(f"{r:g}" for r in require_shell(scene))
    except BadInput as refusal:
        return [*found, _effect("stretching and shear", False, f"{refusal.key} {refusal.problem}", "no shell run")]
    own = has_free_twist(scene)
    why = f"in the shell{'' if own else ' only'}, w/h = {ratios}"
    return [*found, _effect("stretching and shear", own, why, "one shell process per w/h in compare")]
