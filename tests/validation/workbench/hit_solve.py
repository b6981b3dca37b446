"""A scene by one of the models, on elements so fine that their own error does not count beside a shell.

`ELEMENTS` of them, shorter towards every end whose frame is held: the first one 2.5 w / ELEMENTS, each 1.5 times the
one before it until they are equal.
"""

from __future__ import annotations

from typing import Any

from compare.models.base import Options, State
from compare.registry import model, name_for
from compare.scene.scene import Scene
from compare.scene.spec import graded_lengths
from compare.store.progress import Reporter
from ribbon.energies.names import FREE
from ribbonbench.errors import BadInput

ELEMENTS = 80
_FIRST = 2.5


def lengths(scene: Scene, elements: int) -> list[float]:
    """Lengths of the elements in the scene's unit, shorter at each end whose frame is held."""
    first = _FIRST * scene.width / elements
    both = scene.end_frame is not None
    parts = graded_lengths(elements // 2, 2.0 * first) if both else graded_lengths(elements, first)
    whole = [0.5 * part for part in (*parts, *reversed(parts))] if both else list(parts)
    return [scene.strip.length * part for part in whole]


def with_model(scene: Scene, energy: str, elements: int = ELEMENTS) -> Scene:
    """The scene for one model on this many elements."""
    if energy == "elastica":
        return scene.replace({"model.energy": energy, "model.elements": elements})
    keys: dict[str, Any] = {"model.energy": energy, "model.element_lengths": lengths(scene, elements)}
    if energy in FREE and energy != "finite":  # knows no ruling
        held = (("start", scene.clamp_start), ("end", scene.clamp_end))
        keys |= {f"clamp.{end}.ruling": None for end, clamp in held if clamp is not None}
    return scene.replace(keys)


def solve(scene: Scene, energy: str, elements: int = ELEMENTS, say: Reporter | None = None) -> State | None:
    """The state of a model; None where it refuses the scene."""
    found = model(name_for(energy))
    try:
        requested = with_model(scene, energy, elements)
        refused = found.refusal(requested)
        if refused is not None:
            return None
        return found.solve(requested, options=Options(leave_saddle=energy != "elastica"), say=say)  # type: ignore[no-any-return]
    except BadInput:
        return None
