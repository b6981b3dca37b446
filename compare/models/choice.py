"""Which model answers a scene."""

from __future__ import annotations

from collections.abc import Collection
from typing import cast

from compare.models.base import Effect, Model, Size, check_keys
from compare.models.capabilities import Chooses, Differentiates, Fittable
from compare.registry import RICHEST, USUAL, entries, entry, model, name_for
from compare.scene.scene import Scene
from ribbonbench.errors import BadInput


def chosen(scene: Scene) -> Model:
    """The model that the scene's `model.energy` asks for."""
    return model(name_for(scene.model.energy))  # type: ignore[no-any-return]


def settled(scene: Scene) -> Scene:
    """The scene with the energy that its model chooses for it, where it leaves that open: what is varied about a scene
    is solved with one energy."""
    model = chosen(scene)
    return model.settled(scene) if isinstance(model, Chooses) else scene


def beside_the_shell(scene: Scene) -> Model:
    """The model that is compared with shells: the chosen one; where that is the planar elastica, which is the third
    opinion there, the ribbon."""
    found = chosen(scene)
    return model(USUAL) if is_cross_check(found) else found  # type: ignore[no-any-return]


def measure_of_all(names: Collection[str]) -> str:
    """Of the models of these names, the one to which all are compared: the shell, which is the richest; without it the
    ribbon; without both the first."""
    return next((name for name in (RICHEST, USUAL) if name in names), next(iter(names)))


def third_opinion(scene: Scene, beside: Model) -> Model | None:
    """The planar elastica where the scene is planar, as a third opinion beside another model; None elsewhere."""
    found: Model = model(next(entry.name for entry in entries() if entry.planar))
    if beside.name == found.name:
        return None
    try:
        check_keys(found, scene)
    except BadInput:
        return None
    return found


def no_third_opinion(scene: Scene) -> str:
    """Why there is none: what leaves the plane, or the key that the planar elastica does not read; "" where it can."""
    if (reason := scene.nonplanar_reason()) is not None:
        return reason
    try:
        check_keys(model(next(entry.name for entry in entries() if entry.planar)), scene)
    except BadInput as error:
        return f"{error.key} {error.problem}"
    return ""


def is_cross_check(found: Model) -> bool:
    """Whether a model is the one that is the third opinion beside others."""
    return entry(found.name).planar


def differentiable(scene: Scene) -> Fittable:
    """The model by whose derivatives keys of the scene are fitted: the chosen one; where that has none, the ribbon."""
    found: Model = chosen(scene)
    return cast(Fittable, found if isinstance(found, Differentiates) else model(USUAL))


def shell_in_words(scene: Scene) -> Effect:
    """The shell of a scene: on where there is one, w/h as its reason, and what it does."""
    found: tuple[Effect, ...] = model(RICHEST).effects(scene)
    return found[0]


def coarse_shell(scene: Scene) -> tuple[Model, Scene, Size]:
    """The shell, the scene with its thickest one alone, and a mesh on which that can be solved several times.

    Raises `BadInput` for a scene without a shell.
    """
    from compare.models.effects.shell import thickest
    from compare.models.shell import mesh_size

    alone, mesh = thickest(scene)
    return model(RICHEST), alone, mesh_size(mesh)
