"""Which effects a scene switches on, why, and what each adds (design rule 4: only those that the scene calls for).

The scene's own model says so; whole solves without each effect: `compare.studies.effects_measured`.
"""

from __future__ import annotations

from dataclasses import dataclass

from compare.models.base import Effect, Model, check_keys
from compare.models.capabilities import Choice, Chooses, Evaluates, Evaluation
from compare.models.choice import chosen, is_cross_check, no_third_opinion, shell_in_words, third_opinion
from compare.scene.scene import Scene
from compare.store.progress import Reporter


@dataclass(frozen=True)
class Explanation:
    """The effects of a scene in its own model; evaluation: what that evaluates, None where it has no such thing;
    third_opinion ("": the model itself is that) and shell: what stands beside it, in words; choice: of its energy, None
    where the scene names it."""

    model: str
    effects: tuple[Effect, ...]
    evaluation: Evaluation | None
    third_opinion: str
    shell: str
    choice: Choice | None = None


def explain(scene: Scene, say: Reporter | None = None) -> Explanation:
    """Effects of the scene, each switched off alone where it can be. Raises `BadInput` for a scene that its model
    refuses."""
    model = chosen(scene)
    check_keys(model, scene)
    shell = shell_in_words(scene)
    choice = model.choice(scene, say) if isinstance(model, Chooses) and scene.model.accuracy is not None else None
    if choice is not None and say is not None:
        say.step("evaluations with and without each effect")
    return Explanation(
        model=model.name,
        effects=model.effects(scene) if choice is None else (*model.effects(choice.scene), *choice.effects),
        evaluation=model.evaluation(scene) if isinstance(model, Evaluates) else None,
        third_opinion=_cross_check(scene, model),
        shell=f"{shell.why}; {shell.words}" if shell.on else f"none: {shell.why}.",
        choice=choice,
    )


def _cross_check(scene: Scene, model: Model) -> str:
    """Whether there is one, and where it begins."""
    if is_cross_check(model):
        return ""
    if third_opinion(scene, model) is None:
        return f"no elastica: {no_third_opinion(scene)}"
    start = (
        "begun at the natural shape"
        if scene.clamp_end is None and not scene.path
        else f"begun at the {model.name}'s shape, for the strip may have several"
    )
    return f"planar scene: compare adds the planar elastica (scikit-fem) as a third opinion, {start}"
