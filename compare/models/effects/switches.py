"""Effects of a line as rows: a name, whether the scene has it and why, what it adds, the keys that switch it off."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from compare.models.base import Effect
from compare.models.effects.weightless import weightless
from compare.scene.inputs.law import values, words
from compare.scene.stages import stages_without

if TYPE_CHECKING:
    from compare.scene.scene import Scene


@dataclass(frozen=True)
class Switch:
    """An effect that a scene may leave out: its name, whether it is on, why it is and why it is not, what it adds, and
    the keys that switch it off alone (None: nothing does)."""

    key: str
    on: bool
    why: str
    why_not: str
    adds: str
    off: Mapping[str, Any] | None = None

    def of(self, scene: Scene) -> Effect:
        """The effect in the scene. What the stages of a path say about it goes with it."""
        if not self.on:
            return Effect(self.key, "nothing", False, self.why_not)
        off = self.off
        if off is not None and scene.path and "path" not in off:
            off = {**off, "path": stages_without(scene.path, tuple(off))}
        return Effect(self.key, self.adds, True, self.why, off)


def weight(scene: Scene, adds: str, of: str = "rod") -> Switch:
    """Weight along the line."""
    return Switch(
        "weight", scene.gamma > 0.0, f"[gravity], Gamma = {scene.gamma:g}", f"no weight along the {of}", adds,
        weightless(scene),
    )  # fmt: skip


def natural(scene: Scene, adds: str, law: str | None = None) -> Switch:
    """Natural curvature; law: in words, None: K l, at both ends where it changes."""
    return Switch(
        "natural curvature", any(values(scene.curvature)), law or words(scene.curvature), "naturally straight", adds,
        {"strip.natural_curvature": 0.0},
    )  # fmt: skip


def at_rest(scene: Scene, twist: str, in_plane: str) -> tuple[Switch, Switch]:
    """Twist and curvature in the plane at rest, of [strip] or [rod]; what they add."""
    rod = scene.rod
    own = rod is not None and any(rod.natural_twist), rod is not None and any(rod.natural_in_plane)
    keys = (
        "rod.natural_twist" if own[0] else "strip.natural_twist",
        "rod.natural_in_plane" if own[1] else "strip.natural_geodesic_curvature",
    )
    return (
        Switch(
            "natural twist", any(values(scene.twist)), f"{keys[0]}: {words(scene.twist, 'twist l')}",
            "naturally untwisted", twist, {keys[0]: None},
        ),
        Switch(
            "natural curvature in the plane", any(values(scene.geodesic)),
            f"{keys[1]}: {words(scene.geodesic, 'kappa_2 l')}", "none", in_plane, {keys[1]: None},
        ),
    )  # fmt: skip


def end_clamp(scene: Scene, adds: str, alone: bool = True) -> Switch:
    """What holds the line at s = l; alone: the scene is one without it too."""
    off = {"clamp.end": False} if alone else None
    return Switch("clamp at the end", scene.clamp_end is not None, "[clamp.end]", "no [clamp.end]: free", adds, off)


def walk(scene: Scene) -> Switch:
    """The stages of a path."""
    return Switch(
        "continuation path", bool(scene.path), f"{len(scene.path)} [[path]] before the scene", "no [[path]]",
        "a walk through the stages", {"path": []},
    )  # fmt: skip
