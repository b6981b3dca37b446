"""The keys that take the weight off a scene and leave what pulls at its end, which may hang along the weight too."""

from __future__ import annotations

from typing import Any

from compare.scene.data import SceneData
from compare.scene.loads import force_scale


def weightless(scene: SceneData) -> dict[str, Any]:
    """Keys without the weight; a mass or load at the tip, which needs gravity.up, becomes the force that it is."""
    if not scene.tip_load:
        return {"gravity": None}
    force = (scene.tip_force / force_scale(scene.strip)).tolist()
    return {"gravity": None, "tip.mass": None, "tip.load": None, "tip.tension": None, "tip.force": force}
