"""Which model answers a scene."""

from __future__ import annotations

from collections.abc import Collection

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


def measure_of_all(names: Collection[str]) -> str:
    """Of the models of these names, the one to which all are compared: the shell, which is the richest; without it the
    ribbon; without both the first."""
    return next((name for name in ("shell", "ribbon") if name in names), next(iter(names)))


def third_opinion(scene: Scene, beside: Model) -> Model | None:
    """The planar elastica where the scene is planar, as a third opinion beside another model; None elsewhere."""
    found: Model = model("elastica")
    return None if beside.name == found.name or found.refusal(scene) is not None else found
