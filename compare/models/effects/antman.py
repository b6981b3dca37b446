"""Which effects a scene of the shearable rod switches on, why, and the keys that switch each off alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from compare.models.base import Effect
from compare.models.effects.weightless import weightless
from compare.scene.scene import Scene
from compare.scene.stages import stages_without

STIFF = 1e4
"""By how much shear and stretch are stiffened where they are switched off."""


def effects(scene: Scene) -> tuple[Effect, ...]:
    """The effects of a scene of the shearable rod. What the stages of a path say about an effect goes with it."""
    from compare.models.antman_problem import section_of

    section = section_of(scene)
    rod, tip = scene.rod, scene.tip
    start, end = scene.curvature
    force, moment = float(np.linalg.norm(scene.tip_force)), float(np.linalg.norm(scene.tip_moment))
    in_plane = (0.0, 0.0) if rod is None else rod.natural_in_plane
    twist = (0.0, 0.0) if rod is None else rod.natural_twist
    shear = [STIFF * value for value in section.shear]

    def either(name: str, on: bool, why: str, why_not: str, adds: str, off: dict[str, Any] | None) -> Effect:
        if not on:
            return Effect(name, "nothing", False, why_not)
        if off is not None and scene.path and "path" not in off:
            off = {**off, "path": stages_without(scene.path, tuple(off))}
        return Effect(name, adds, True, why, off)

    no_force = {"tip": False} if not moment else {f"tip.{k}": None for k in ("mass", "load", "force", "tension")}
    no_moment = {"tip": False} if not force else {"tip.moment": None}
    return (
        Effect("bending and torsion", "position and quaternion: six unknowns a node", True, "a rod in space"),
        Effect(
            "shear", f"stiffness {section.shear[0]:.4g}, {section.shear[1]:.4g} D w / l^2", True,
            "5/6 G w h" if rod is None or rod.shear is None else "rod.shear", {"rod.shear": shear},
        ),
        Effect(
            "stretch", f"stiffness {section.stretch:.4g} D w / l^2", True,
            "Y w h" if rod is None or rod.stretch is None else "rod.stretch", {"rod.stretch": STIFF * section.stretch},
        ),
        either(
            "natural curvature", (start, end) != (0.0, 0.0), f"K l = {start:g} to {end:g}", "naturally straight",
            "a curvature at rest", {"strip.natural_curvature": 0.0},
        ),
        either(
            "natural curvature in the plane", any(in_plane), f"rod.natural_in_plane = {list(in_plane)}", "none",
            "a curvature at rest", {"rod.natural_in_plane": 0.0},
        ),
        either(
            "natural twist", any(twist), f"rod.natural_twist = {list(twist)}", "none", "a twist at rest",
            {"rod.natural_twist": 0.0},
        ),
        either(
            "force at the tip", force > 0.0, f"[tip], {force:.4g} D w / l^2", "none", "a dead force", no_force
        ),
        either(
            "moment at the tip", moment > 0.0, f"tip.moment, {moment:.4g} D w / l", "none",
            "a moment of fixed direction: in space without a potential", no_moment,
        ),
        either(
            "weight", scene.gamma > 0.0, f"[gravity], Gamma = {scene.gamma:g}", "no weight along the rod",
            "a force on every node", weightless(scene),
        ),
        either(
            "clamp at the end", scene.clamp_end is not None, "[clamp.end]", "no [clamp.end]: free",
            "unknowns taken away", None if tip is not None and tip.tension is not None else {"clamp.end": False},
        ),
        either(
            "continuation path", bool(scene.path), f"{len(scene.path)} [[path]] before the scene", "no [[path]]",
            "a walk through the stages", {"path": []},
        ),
        Effect("width", "no ruling: the section stays a straight line", False, "a rod has stiffnesses"),
    )  # fmt: skip
