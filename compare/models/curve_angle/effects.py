"""Which effects a scene of the curve-angle rod switches on, why, and the keys that switch each off alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from compare.models.base import Effect
from compare.models.effects.switches import Switch, at_rest, end_clamp, natural, walk, weight
from compare.scene.scene import Scene


def switches(scene: Scene) -> Sequence[Effect | Switch]:
    """The effects of a scene of the rod."""
    rod, closure = scene.rod, scene.closure
    force, moment = float(np.linalg.norm(scene.tip_force)), float(np.linalg.norm(scene.tip_moment))
    return (
        Effect("bending and twist", "three positions a vertex, one angle an edge", True, "a rod in space"),
        Effect("inextensible", "a row for every edge; its multiplier is the tension", True, "a rod in space"),
        weight(scene, "dead forces on the vertices"),
        natural(scene, "a term in kappa_1"),
        *at_rest(scene, "a term in tau", "a term in kappa_2"),
        Switch(
            "force at the tip", force > 0.0, f"[tip], {force:.4g} D w / l^2", "no force at the tip", "a dead force",
            {"tip": False},
        ),
        Switch(
            "moment at the tip", moment > 0.0, f"tip.moment, {moment:.4g} D w / l", "no moment at the tip",
            "a moment without an energy: Newton's steps, stability is not judged", {"tip.moment": None},
        ),
        end_clamp(
            scene, "held positions, a cell to the clamp's frame: the turn of the frames along the rod counts"
        ),
        Switch("closure", closure is not None, "[closure]", "no [closure]: open", "held at its seam from both sides"),
        Switch(
            "turned end", closure is not None and bool(closure.twist), "closure.twist", "no turned end",
            "the twist that is closed in", {"closure.twist": None},
        ),
        Switch(
            "quasi-static twist", rod is not None and rod.twist == "quasi-static", 'rod.twist = "quasi-static"',
            "the angles are unknowns", "the angles follow the centreline; the Hessian is dense", {"rod.twist": None},
        ),
        walk(scene),
        Effect("width, stretching and shear", "no unknown", False, "the section keeps its shape, normal to the line"),
    )  # fmt: skip
