"""From a scene of several strips to what the ribbon's solver takes: strips in the scene's unit of length, joints."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from compare.models.holds.friction import several_refused
from compare.models.ribbon.build import has_free_twist, ribbon_energy, ribbon_walls
from compare.registry import USUAL, chosen_by
from compare.scene.data import frame_of
from compare.scene.scene import Scene
from compare.scene.strips.scene import Joined, StripsScene
from compare.scene.strips.spec import AXES, KEYS
from ribbon import Clamp, Gravity, Strip
from ribbon.element import quaternion
from ribbon.find.strips.assemble import Member
from ribbon.problems.strips.joint import End, Joint
from ribbonbench.errors import BadInput


def check_model(scene: StripsScene) -> None:
    """Refuses energies that are not the ribbon's, friction that has no way, strips without the thickness they need."""
    first = scene.first
    if chosen_by(first.model.energy).name != USUAL:
        raise BadInput(
            "model.energy", first.model.energy, "is no energy of the ribbon, which alone knows several strips",
            'give one of the ribbon\'s, e.g. "wunderlich" or "kirchhoff"',
        )  # fmt: skip
    before = scene.stages[:-1] if scene.ends_at_its_last_stage else scene.stages
    refusal = several_refused([stage.first for stage in (*before, scene)])
    if refusal is not None:
        raise refusal
    if scene.friction and not before:
        raise BadInput(
            "contact.friction", scene.friction, "needs a [[path]]: how strips that rub lie depends on the way there",
            "add [[path]] stages that lead to the scene from elsewhere, or leave friction out",
        )  # fmt: skip
    for name, strip in zip(scene.names, scene.strips, strict=True):
        if has_free_twist(strip) and strip.strip.thickness is None:
            about = KEYS["strip.thickness"]
            raise BadInput(
                f"strip.{name}.thickness", None, f'is missing: the energy "{first.model.energy}" needs it',
                f"add e.g. thickness = {about.example}",
            )  # fmt: skip


def arguments(scene: StripsScene) -> dict[str, Any]:
    """Keywords of `ribbon.find.strips.solve.solve`."""
    first = scene.first
    return {
        "members": [_member(*each) for each in zip(scene.names, scene.strips, scene.stiffness, strict=True)],
        "joints": [_joint(joint) for joint in scene.joints],
        "gravity": _gravity(scene),
        "energy": ribbon_energy(first),
        "apart": scene.distance or 0.0,
        "rulings": [joint.spec.ruling for joint in scene.joints],
        "stiffness": first.model.stiffness,
        "in_plane": first.model.in_plane,
        "friction": scene.friction,
        "itself": scene.itself,
        "walls": [wall.scaled(1.0 / first.strip.length) for wall in ribbon_walls(first)],
    }


def _member(name: str, scene: Scene, stiffness: float) -> Member:
    strip = scene.strip
    return Member(
        Strip(
            strip.length, strip.width, strip.poisson, strip.natural_curvature, scene.gamma, strip.thickness,
            natural_twist=strip.natural_twist, natural_geodesic_curvature=strip.natural_geodesic_curvature,
        ),
        _clamp(scene, "start"),
        _clamp(scene, "end"),
        stiffness,
        scene.model.elements,
        scene.seed.curvature,
        scene.seed.ruling,
        name,
        _load(scene),
        _moment(scene),
    )  # fmt: skip


def _load(scene: Scene) -> tuple[float, float, float] | None:
    if scene.tip is None:
        return None
    x, y, z = map(float, scene.tip_force)
    return x, y, z


def _moment(scene: Scene) -> tuple[float, float, float] | None:
    x, y, z = map(float, scene.tip_moment)
    return (x, y, z) if x or y or z else None


def _clamp(scene: Scene, end: str) -> Clamp | None:
    spec = scene.clamp_start if end == "start" else scene.clamp_end
    if spec is None:
        return None
    frame = frame_of(spec)
    tangent, normal = (None, None) if frame is None else (frame[:, 2], frame[:, 1])
    ruling: str | None = spec.ruling
    if has_free_twist(scene) and f"clamp.{end}.ruling" not in scene.own_keys:
        ruling = None
    return Clamp(spec.position, tangent, normal, ruling)


def _joint(joint: Joined) -> Joint:
    axis = np.eye(3)[AXES[joint.spec.axis]]
    turn = tuple(map(float, quaternion.turn(axis, math.radians(joint.spec.angle))))
    return Joint(End(*joint.one), End(*joint.other), joint.spec.kind, turn)  # type: ignore[arg-type]


def _gravity(scene: StripsScene) -> Gravity | None:
    first = scene.first
    if first.gravity is None or first.up is None or not any(strip.gamma for strip in scene.strips):
        return None
    return Gravity(first.up, first.gravity.exact)
