"""Which effects a scene of the shearable rod switches on, why, and the keys that switch each off alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from compare.models.antman.problem import section_of
from compare.models.base import Effect
from compare.models.effects.switches import Switch, at_rest, end_clamp, natural, walk, weight
from compare.scene.scene import Scene

STIFF, LEAST = 1e4, 10.0
"""By how much shear and stretch are stiffened where they are switched off, and by how much at least."""
STIFFEST = 1e12
"""Stiffness (D w / l^2) beyond which they are stiffened by no more than `LEAST`: the rounding of such a strain on short
elements, eps times it over their length, passes the tolerance of the balance, so that nothing stiffer is solved."""


def stiffened(stiffness: float) -> float:
    """The stiffness (D w / l^2) that stands for none of the strain: what the strain moves, in proportion to
    1 / stiffness, is there down to 1 / `STIFF` of itself, in rods so thin that double precision ends before to
    1 / `LEAST`."""
    return max(LEAST * stiffness, min(STIFF * stiffness, STIFFEST))


def switches(scene: Scene) -> Sequence[Effect | Switch]:
    """The effects of a scene of the shearable rod."""
    section = section_of(scene)
    rod, tip = scene.rod, scene.tip
    force, moment = float(np.linalg.norm(scene.tip_force)), float(np.linalg.norm(scene.tip_moment))
    shear = [stiffened(value) for value in section.shear]
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
            "Y w h" if rod is None or rod.stretch is None else "rod.stretch",
            {"rod.stretch": stiffened(section.stretch)},
        ),
        natural(scene, "a curvature at rest"),
        *at_rest(scene, "a twist at rest", "a curvature at rest"),
        Switch(
            "force at the tip", force > 0.0, f"[tip], {force:.4g} D w / l^2", "none", "a dead force", no_force
        ),
        Switch(
            "moment at the tip", moment > 0.0, f"tip.moment, {moment:.4g} D w / l", "none",
            "a moment of fixed direction: in space without a potential", no_moment,
        ),
        weight(scene, "a force on every node"),
        end_clamp(scene, "unknowns taken away", alone=tip is None or tip.tension is None),
        walk(scene),
        Effect("width", "no ruling: the section stays a straight line", False, "a rod has stiffnesses"),
    )  # fmt: skip
