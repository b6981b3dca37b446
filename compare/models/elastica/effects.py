"""Which effects a scene of the planar elastica switches on, why, and the keys that switch each off alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from compare.models.base import Effect
from compare.models.effects.switches import Switch, end_clamp, natural, walk, weight
from compare.scene.scene import Scene


def switches(scene: Scene) -> Sequence[Effect | Switch]:
    """The effects of a scene of the elastica."""
    tip, rod = float(np.linalg.norm(scene.tip_force)), scene.strip.second_moment
    return (
        Effect("planar bending", "theta(s): one unknown a node, more for higher elements", True, "the scene is planar"),
        Switch("load at the tip", tip > 0.0, f"[tip], {tip:.4g} D w / l^2", "no [tip]", "a dead force", {"tip": False}),
        weight(scene, "a force linear in s", of="strip"),
        natural(scene, "a term in theta'"),
        Switch(
            "second moment of area given", rod is not None, f"strip.second_moment = {rod}", "from the thickness",
            "the stiffness Y I, no unknown",
        ),
        Switch(
            "contact with itself", scene.apart is not None, "contact.itself", "no [contact]",
            "a row for each pair of places that touches", {"contact": None},
        ),
        Switch(
            "obstacles", bool(scene.obstacles), "[[obstacle]]", "no [[obstacle]]", "a row for each place that touches",
            {"obstacle": None},
        ),
        end_clamp(scene, "up to two multipliers and an angle"),
        walk(scene),
        Effect(
            "arc length", "one bordered row where load steps fail", scene.model.arc_length != "never",
            f'model.arc_length = "{scene.model.arc_length}"',
        ),
        Effect("width, stretching and shear", "no unknown: no shell, no ribbon", False, "an elastica has none"),
    )  # fmt: skip
