"""A scene of several strips, as data: `loads` reads one from a text, strictly; every fault is one `BadInput`.

Every `[[strip]]` is read as the scene of one strip that it would be alone (`compare.scene.scene`), with what all of
them share: weight and model. What holds and joins them is checked here.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.scene.data import frame_of
from compare.scene.declare import literal
from compare.scene.scene import Scene
from compare.scene.strips.spec import ENDS, JointSpec


@dataclass(frozen=True)
class Joined:
    """A joint: numbers of both strips with 0 for their start and -1 for their end, and what it says."""

    one: tuple[int, int]
    other: tuple[int, int]
    spec: JointSpec


@dataclass(frozen=True)
class StripsScene:
    """Several strips: names and scenes, one by one; joints; distance that different strips keep, None: they may pass
    through each other; stiffness: D of each in a unit that all share; document: what the file says; friction: Coulomb's
    coefficient between them; itself: whether parts of one strip that face each other keep the distance too; stages: the
    scenes of its [[path]] in order, without itself, and steps: how many lead to each and to itself (None: chosen)."""

    name: str
    source: str
    title: str
    names: tuple[str, ...]
    strips: tuple[Scene, ...]
    joints: tuple[Joined, ...]
    distance: float | None
    stiffness: tuple[float, ...]
    document: Mapping[str, Any]
    stages: tuple[StripsScene, ...] = ()
    steps: tuple[int | None, ...] = ()
    friction: float = 0.0
    itself: bool = False

    @property
    def first(self) -> Scene:
        """The first strip, whose length and stiffness are the unit of the results."""
        return self.strips[0]

    @property
    def up(self) -> NDArray[np.float64] | None:
        """Unit vector against the weight; None without."""
        return self.first.up

    def notes(self) -> tuple[str, ...]:
        """What in the strips can hardly be meant."""
        return tuple(
            f"{name}: {note}"
            for name, strip in zip(self.names, self.strips, strict=True)
            for note in strip.notes(None if self.stages or self.has_loop else f"strip.{name}.seed.curvature")
            if "[shell]" not in note
        )

    @property
    def has_loop(self) -> bool:
        """Whether joints and clamps close a loop, in which strips are begun bent."""
        count = len(self.strips)
        ties = [(joint.one[0], joint.other[0]) for joint in self.joints]
        ties += [(k, count) for k in range(count) for end in (0, -1) if self.clamped((k, end))]
        groups = list(range(count + 1))  # the last is what stands still
        for one, other in ties:
            kept, gone = groups[one], groups[other]
            if kept == gone:
                return True
            groups = [kept if group == gone else group for group in groups]
        return False

    def end_name(self, end: tuple[int, int]) -> str:
        """How the file calls an end: "left.end"."""
        return f"{self.names[end[0]]}.{ENDS[end[1]]}"

    def clamped(self, end: tuple[int, int]) -> bool:
        """Whether a clamp holds an end."""
        scene = self.strips[end[0]]
        return (scene.clamp_start if end[1] == 0 else scene.clamp_end) is not None

    @property
    def ends_at_its_last_stage(self) -> bool:
        """Whether the last stage of its path is the scene itself."""
        alone = replace(self, stages=(), steps=())
        return bool(self.stages) and self.stages[-1].canonical() == alone.canonical()

    def to_toml(self) -> str:
        """TOML text; `read` gives back the same scene."""
        return _toml(self.document)

    def canonical(self) -> dict[str, Any]:
        """All that can influence the result, ready for hashing."""
        return {
            "strips": [strip.canonical() for strip in self.strips],
            "joints": [[joint.one, joint.other, vars(joint.spec)] for joint in self.joints],
            "distance": self.distance,
            "stiffness": self.stiffness,
            **({"friction": self.friction} if self.friction else {}),
            **({"itself": True} if self.itself else {}),
            **({"stages": [stage.canonical() for stage in self.stages], "steps": self.steps} if self.stages else {}),
        }


def is_several(text: str) -> bool:
    """Whether a text is a scene with [[strip]] instead of [strip]; what is no TOML is not."""
    try:
        return isinstance(tomllib.loads(text).get("strip"), list)
    except (ValueError, RecursionError):
        return False


def turn_of(spec: JointSpec) -> float:
    """The joint's angle, rad."""
    return math.radians(spec.angle)


def frames(scene: Scene) -> tuple[Any, Any]:
    """Frames (3, 3) held at both ends; None: not held."""
    return frame_of(scene.clamp_start), frame_of(scene.clamp_end)


def _toml(document: Mapping[str, Any], section: str = "") -> str:
    """A document of tables and lists of tables as TOML."""
    lines, later = [], []
    for name, value in document.items():
        dotted = f"{section}.{name}" if section else name
        if isinstance(value, Mapping):
            later.append(f"\n[{dotted}]\n{_toml(value, dotted)}")
        elif isinstance(value, list) and value and isinstance(value[0], Mapping):
            later += [f"\n[[{dotted}]]\n{_toml(one, dotted)}" for one in value]
        else:
            lines.append(f"{name} = {literal(value)}\n")
    return "".join([*lines, *later])
