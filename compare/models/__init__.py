"""The models: one room for everything that knows a solver; the rest of `compare` asks for them here, by role or name.

`solve` is the way for one's own scripts::

    from compare.models import solve
    from compare.scene import load

    state = solve(load("curl_4_3"))
    print(state.status, state.end.position, state.energy.total)
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from compare import registry
from compare.registry import RICHEST, USUAL, home, in_words, model, name_for, names

if TYPE_CHECKING:
    from compare.models.base import Options, Shape, Size, State
    from compare.scene.scene import Scene
    from compare.store.progress import Reporter

__all__ = ["RICHEST", "USUAL", "home", "in_words", "model", "name_for", "names", "registry", "solve"]


def solve(
    scene: Scene,
    model: str | None = None,
    *,
    size: Size | None = None,
    near: Shape | None = None,
    options: Options | None = None,
    say: Reporter | None = None,
) -> State:
    """The scene's state by the model of this name ("ribbon", "elastica", "shell", ...; None: the one that the scene's
    `model.energy` asks for). The other arguments, and what is raised: `compare.models.base.Model.solve`.

    Keys of the scene that the model does not read are refused, as by every command (`BadInput`).
    """
    from compare.models.base import check_keys
    from compare.models.choice import chosen

    found = chosen(scene) if model is None else registry.model(model)
    check_keys(found, scene)
    state = found.solve(scene, size, near=near, options=options, say=say)
    return replace(state, units=scene.units, width=scene.width)
