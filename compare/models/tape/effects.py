"""Which effects a scene of a tape spring switches on, why, and the keys that switch each off alone."""

from __future__ import annotations

from collections.abc import Sequence

from compare.models.base import Effect
from compare.models.effects.switches import Switch
from compare.scene.scene import Scene


def switches(scene: Scene) -> Sequence[Effect | Switch]:
    """Section, rest curvature across, holds and path."""
    enriched = scene.model.energy != "tape_plain"
    slides = [
        name
        for name, clamp in (("start", scene.clamp_start), ("end", scene.clamp_end))
        if clamp is not None and clamp.slide is not None
    ]
    free = [
        name
        for name, clamp in (("start", scene.clamp_start), ("end", scene.clamp_end))
        if clamp is not None and clamp.section == "free"
    ]
    angle = 0.5 * scene.width * scene.transverse_curvature
    return (
        Effect("planar rod that stretches", "x, x', y, y' at a node", True, "the scene is planar",
               fixed="it is the model"),
        Effect("flexible section", "its curvature and slope along at a node", True,
               f"strip.transverse_curvature, beta0 = {angle:.3g} rad", fixed="it is the model"),
        Effect("section of any shape", "two more even Legendre curvatures, four unknowns a node" if enriched
               else "nothing", enriched, 'model.energy = "tape"' if enriched else 'model.energy = "tape_plain": an arc',
               {"model.energy": "tape_plain"} if enriched else None),
        Effect("sliding point", "one row less, no force along it" if slides else "nothing", bool(slides),
               f"clamp.{slides[0]}.slide" if slides else "held points stay", fixed="it is how the tape is held"),
        Effect("free section at a clamp", "its curvatures are unknowns there" if free else "nothing", bool(free),
               f'clamp.{free[0]}.section = "free"' if free else "clamps keep the section",
               {f"clamp.{name}.section": None for name in free} if free else None),
        Effect("continuation path", "a walk by arc length through the stages", bool(scene.path),
               f"{len(scene.path)} [[path]] before the scene" if scene.path else "no [[path]]",
               fixed="it says which state is meant"),
        Effect("weight, twist, natural curvature along", "no unknown", False, "a planar, weightless tape"),
    )  # fmt: skip
