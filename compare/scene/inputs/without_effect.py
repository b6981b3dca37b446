"""Values of a scene that have no effect on its result, so that none is ignored silently."""

from __future__ import annotations

from compare.scene.data import SceneData
from compare.scene.spec import STANDARD_GRAVITY


def without_effect(scene: SceneData) -> tuple[str, ...]:
    """One line for every given value that changes nothing."""
    found = []
    if scene.model.held_by != "elimination" and scene.clamp_start is None:
        found.append(f'model.held_by = "{scene.model.held_by}" has no effect: there is no [clamp.start]')
    if scene.gravity is None and scene.strip.gamma:
        found.append(f"strip.gamma = {scene.strip.gamma} has no effect: there is no [gravity], the scene is weightless")
    held = scene.clamp_start is not None or scene.clamp_end is not None or scene.barriers
    if scene.gravity is None and scene.strip.density is not None and held:  # what nothing holds can have no weight
        found.append("strip.density has no effect: there is no [gravity], the scene is weightless")
    if scene.strip.second_moment is not None and scene.tip is None:
        found.append("strip.young and strip.second_moment have no effect: there is no [tip], the rod is weightless")
    if scene.gravity is not None and scene.strip.gamma is not None and scene.gravity.acceleration != STANDARD_GRAVITY:
        found.append(f"gravity.acceleration = {scene.gravity.acceleration} has no effect: strip.gamma gives the weight")
    if scene.shell.width_to_thickness and scene.strip.thickness is not None:
        found.append("strip.thickness is replaced by shell.width_to_thickness in the shell runs, with D and Gamma kept")
    if scene.shell.clamp == "corners" and scene.shell.corner is None:
        found.append(
            'shell.clamp = "corners" without shell.corner holds one cell of the mesh at each corner: the shell\'s '
            "results then depend on the mesh"
        )
    return tuple(found)
