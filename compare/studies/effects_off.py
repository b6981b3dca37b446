"""A scene with one of its effects switched off, everything else kept: what an effect costs and changes is the rest."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from compare.errors import BadInput
from compare.scene.scene import Scene
from ribbon import RibbonInputError
from ribbon.energies import ENERGIES

#: Effects around the solves: the problem that is evaluated is the same without them.
PROCEDURES = ("adaptive segments", "continuation path")

_FIXED = {
    "rulings do not cross": "no switch: beyond the bound no surface exists",
    "closure": "no switch: an open strip would spring back, another scene",
    "rigid motions removed": "no switch: without it the Hessian is singular",
    "stretching and shear": "no switch: the shell has them, the ribbon is the model without",
}
_RULINGS = ("clamp.start", "clamp.end", "closure")


@dataclass(frozen=True)
class Off:
    """The scene without an effect, or None and the reason why the effect cannot be off alone."""

    scene: Scene | None
    reason: str = ""


def _straight(scene: Scene) -> dict[str, Any]:
    held = (scene.clamp_start, scene.clamp_end, scene.closure)
    return {
        f"{name}.ruling": None
        for name, part in zip(_RULINGS, held, strict=True)
        if part is not None and part.ruling == "straight"
    }


def _plates(scene: Scene) -> dict[str, Any]:
    return {f"wall.{k}.stiffness": None for k, wall in enumerate(scene.walls) if wall.stiffness is not None}


_KEYS: Mapping[str, Callable[[Scene], dict[str, Any]]] = {
    "gravity": lambda scene: {"gravity": None},
    "gravity over the surface": lambda scene: {"gravity.exact": None},
    "natural curvature": lambda scene: {"strip.natural_curvature": None},
    "clamp at the start": lambda scene: {"clamp.start": None},
    "clamp at the end": lambda scene: {"clamp.end": None},
    "straight rulings": _straight,
    "contact": lambda scene: {"wall": None},
    "pressure plates": _plates,
    "continuation path": lambda scene: {"path": None},
}


#: Effect of an energy -> the energy that lacks it.
_LACKING = {energy.words.effect: energy.words.without for energy in ENERGIES.values() if energy.words is not None}


def without(scene: Scene, effect: str, formulation: str, segments: int | None = None) -> Off:
    """The scene with `effect` (a name of `compare.studies.effects`) off alone, in the same formulation.

    segments: how many equal ones stand for those that a tolerance placed, when "adaptive segments" is off. What the
    stages of a path say about the effect goes with it. Raises `BadInput` for a scene that is impossible without it.
    """
    if effect in _FIXED:
        return Off(None, _FIXED[effect])
    if effect == "adaptive segments":
        if segments is None:
            raise ValueError("segments: how many stand for the placed ones")
        return Off(scene.replace({"model.tolerance": None, "model.elements": segments, **_pinned(scene, formulation)}))
    keys: dict[str, Any] = _KEYS[effect](scene) if effect in _KEYS else {"model.energy": _LACKING[effect]}
    if effect != "continuation path" and scene.path:
        keys["path"] = _stages_without(scene, tuple(keys)) or None
    return Off(scene.replace({**keys, **_pinned(scene, formulation)}))


def _pinned(scene: Scene, formulation: str) -> dict[str, Any]:
    """The key that keeps the formulation where "auto" might choose another one without the effect."""
    return {"model.formulation": formulation} if scene.model.formulation == "auto" else {}


def _stages_without(scene: Scene, keys: tuple[str, ...]) -> list[dict[str, Any]]:
    """The stages of the path without what is named in or under `keys`; those that say nothing more are left out."""
    kept = []
    for stage in scene.to_dict()["path"]:
        left = {
            name: value
            for name, value in stage.items()
            if not any(name == key or name.startswith(f"{key}.") for key in keys)
        }
        if set(left) - {"steps"}:
            kept.append(left)
    return kept


def refused(refusal: BadInput | RibbonInputError) -> str:
    """Why a scene is refused without the effect, in a few words."""
    if isinstance(refusal, RibbonInputError):
        return f"not alone: {refusal}"
    return f"not alone: {refusal.key} {refusal.problem}"
