"""Which effects a scene of the planar elastica switches on, why, and the keys that switch each off alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from compare.models.base import Effect
from compare.models.effects.weightless import weightless
from compare.scene.scene import Scene
from compare.scene.stages import stages_without


def effects(scene: Scene) -> tuple[Effect, ...]:
    """The effects of a scene of the elastica. What the stages of a path say about an effect goes with it."""
    start, end = scene.curvature
    law = f"K l = {start:g}" if start == end else f"K l from {start:g} to {end:g}"
    tip, weight = float(np.linalg.norm(scene.tip_force)), scene.gamma
    rod = scene.strip.second_moment
    held = scene.clamp_end

    def either(name: str, on: bool, why: str, why_not: str, adds: str, off: dict[str, Any] | None) -> Effect:
        if not on:
            return Effect(name, "nothing", False, why_not)
        if off is not None and scene.path and "path" not in off:
            off = {**off, "path": stages_without(scene.path, tuple(off))}
        return Effect(name, adds, True, why, off)

    return (
        Effect("planar bending", "theta(s): one unknown a node, more for higher elements", True, "the scene is planar"),
        either(
            "load at the tip", tip > 0.0, f"[tip], {tip:.4g} D w / l^2", "no [tip]", "a dead force", {"tip": False}
        ),
        either(
            "weight", weight > 0.0, f"[gravity], Gamma = {weight:g}", "no weight along the strip",
            "a force linear in s", weightless(scene),
        ),
        either(
            "natural curvature", (start, end) != (0.0, 0.0), law, "naturally straight", "a term in theta'",
            {"strip.natural_curvature": 0.0},
        ),
        either(
            "second moment of area given", rod is not None, f"strip.second_moment = {rod}", "from the thickness",
            "the stiffness Y I, no unknown", None,
        ),
        either(
            "clamp at the end", held is not None, "[clamp.end]", "no [clamp.end]: free",
            "up to two multipliers and an angle", {"clamp.end": False},
        ),
        either(
            "continuation path", bool(scene.path), f"{len(scene.path)} [[path]] before the scene", "no [[path]]",
            "a walk through the stages", {"path": []},
        ),
        Effect(
            "arc length", "one bordered row where load steps fail", scene.model.arc_length != "never",
            f'model.arc_length = "{scene.model.arc_length}"',
        ),
        Effect("width, stretching and shear", "no unknown: no shell, no ribbon", False, "an elastica has none"),
    )  # fmt: skip
