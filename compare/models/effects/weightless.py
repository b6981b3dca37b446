"""The keys that take the weight off a scene and leave what pulls at its end, which may hang along the weight too; and
those that leave a share of all its loads."""

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


def loaded(scene: SceneData, share: float) -> dict[str, Any]:
    """Keys with this share (>= 0) of weight and dead loads at the tip."""
    if share == 0.0:
        return {"gravity": None, "tip": None}
    keys: dict[str, Any] = {}
    if scene.gravity is not None and scene.strip.gamma is not None:
        keys["strip.gamma"] = share * scene.strip.gamma
    elif scene.gravity is not None:
        keys["gravity.acceleration"] = share * scene.gravity.acceleration
    if scene.tip is not None:
        force = (share * scene.tip_force / force_scale(scene.strip)).tolist()
        keys |= {"tip.mass": None, "tip.load": None, "tip.tension": None, "tip.force": force}
    return keys
