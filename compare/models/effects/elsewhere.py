"""Which models take a scene that another one refuses, and how to ask them."""

from __future__ import annotations

from compare.models.base import check_keys
from compare.registry import RICHEST, USUAL, entries, model
from compare.scene.scene import Scene
from ribbonbench.errors import BadInput

#: A w/h for the question whether a shell could be had, where the scene has none.
ANY_RATIO = 100.0


def takers(scene: Scene) -> tuple[str, ...]:
    """Values of `model.energy` whose models take the scene as it is, one of a model; last the shell's name where the
    shell does, if need be with a thickness given to it."""
    found = []
    for known in entries():
        if known.energies and known.name != USUAL and _takes(known.name, scene, {"model.energy": known.energies[0]}):
            found.append(known.energies[0])
    thick = scene.strip.thickness is not None or scene.shell.width_to_thickness
    if _takes(RICHEST, scene, {} if thick else {"shell.width_to_thickness": [ANY_RATIO]}):
        found.append(RICHEST)
    return tuple(found)


def _takes(name: str, scene: Scene, change: dict[str, object]) -> bool:
    """Whether a model takes the scene with a change."""
    try:
        check_keys(model(name), scene.replace(change))
    except (BadInput, ModuleNotFoundError):
        return False
    return True


def remedy_elsewhere(scene: Scene, key: str) -> str:
    """What to do where the ribbon does not know `key`: the models that take the scene as it is, by the command that
    runs them; where there is none, what to leave out."""
    found = takers(scene)
    lines = " or ".join(f'"{name}"' for name in found if name != RICHEST)
    ways = [f"use ribbonbench solve with model.energy = {lines}"] if lines else []
    if RICHEST in found:
        without = not (scene.strip.thickness is not None or scene.shell.width_to_thickness)
        ways.append("the shell alone (ribbonbench shell" + (" --width-to-thickness R)" if without else ")"))
    if ways:
        return ", or ".join(ways) if lines else f"use {ways[0]}"
    return f"leave {key} out: no model here takes it beside all else that the scene has (ribbonbench explain SCENE)"
