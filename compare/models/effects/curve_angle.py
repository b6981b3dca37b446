"""Which effects a scene of the curve-angle rod switches on, why, and the keys that switch each off alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from compare.models.base import Effect
from compare.models.effects.weightless import weightless
from compare.scene.scene import Scene
from compare.scene.stages import stages_without


def effects(scene: Scene) -> tuple[Effect, ...]:
    """The effects of a scene of the rod. What the stages of a path say about an effect goes with it."""
    start, end = scene.curvature
    law = f"K l = {start:g}" if start == end else f"K l from {start:g} to {end:g}"
    rod, closure = scene.rod, scene.closure
    force, moment = float(np.linalg.norm(scene.tip_force)), float(np.linalg.norm(scene.tip_moment))
    twist = rod is not None and any(rod.natural_twist)
    in_plane = rod is not None and any(rod.natural_in_plane)

    def either(name: str, on: bool, why: str, why_not: str, adds: str, off: dict[str, Any] | None) -> Effect:
        if not on:
            return Effect(name, "nothing", False, why_not)
        if off is not None and scene.path and "path" not in off:
            off = {**off, "path": stages_without(scene.path, tuple(off))}
        return Effect(name, adds, True, why, off)

    return (
        Effect("bending and twist", "three positions a vertex, one angle an edge", True, "a rod in space"),
        Effect("inextensible", "a row for every edge; its multiplier is the tension", True, "a rod in space"),
        either(
            "weight", scene.gamma > 0.0, f"[gravity], Gamma = {scene.gamma:g}", "no weight along the rod",
            "dead forces on the vertices", weightless(scene),
        ),
        either(
            "natural curvature", (start, end) != (0.0, 0.0), law, "naturally straight", "a term in kappa_1",
            {"strip.natural_curvature": 0.0},
        ),
        either(
            "natural twist", twist, "rod.natural_twist", "naturally untwisted", "a term in tau",
            {"rod.natural_twist": None},
        ),
        either(
            "natural curvature in the plane", in_plane, "rod.natural_in_plane", "none", "a term in kappa_2",
            {"rod.natural_in_plane": None},
        ),
        either(
            "force at the tip", force > 0.0, f"[tip], {force:.4g} D w / l^2", "no force at the tip", "a dead force",
            {"tip": False},
        ),
        either(
            "moment at the tip", moment > 0.0, f"tip.moment, {moment:.4g} D w / l", "no moment at the tip",
            "a moment without an energy: Newton's steps, stability is not judged", {"tip.moment": None},
        ),
        either(
            "clamp at the end", scene.clamp_end is not None, "[clamp.end]", "no [clamp.end]: free",
            "held positions, a cell to the clamp's frame: the turn of the frames along the rod counts",
            {"clamp.end": False},
        ),
        either(
            "closure", closure is not None, "[closure]", "no [closure]: open", "held at its seam from both sides", None
        ),
        either(
            "turned end", closure is not None and bool(closure.twist), "closure.twist", "no turned end",
            "the twist that is closed in", {"closure.twist": None},
        ),
        either(
            "quasi-static twist", rod is not None and rod.twist == "quasi-static", 'rod.twist = "quasi-static"',
            "the angles are unknowns", "the angles follow the centreline; the Hessian is dense", {"rod.twist": None},
        ),
        either(
            "continuation path", bool(scene.path), f"{len(scene.path)} [[path]] before the scene", "no [[path]]",
            "a walk through the stages", {"path": []},
        ),
        Effect("width, stretching and shear", "no unknown", False, "the section keeps its shape, normal to the line"),
    )  # fmt: skip
