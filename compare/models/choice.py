"""Which model answers a scene."""

from __future__ import annotations

from compare.models.base import Model
from compare.registry import model, name_for
from compare.scene.scene import Scene


def chosen(scene: Scene) -> Model:
    """The model that the scene's `model.energy` asks for."""
    return model(name_for(scene.model.energy))  # type: ignore[no-any-return]


def beside_the_shell(scene: Scene) -> Model:
    """The model that is compared with shells: the chosen one; where that is the planar elastica, which is the third
    opinion there, the ribbon."""
    found = chosen(scene)
    return model("ribbon") if found.name == "elastica" else found  # type: ignore[no-any-return]


def third_opinion(scene: Scene, beside: Model) -> Model | None:
    """The planar elastica where the scene is planar, as a third opinion beside another model; None elsewhere."""
    found: Model = model("elastica")
    return None if beside.name == found.name or found.refusal(scene) is not None else found
