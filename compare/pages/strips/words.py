"""What a terminal is told of several strips, name and text: their ends, what holds and joins them, what touches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from compare.models.strips.solve import StripsState
from compare.page import wording
from compare.scene.units import Units

Rows = list[tuple[str, str]]


def ends(state: StripsState, units: Units) -> Rows:
    """Of each strip where its ends that no clamp holds are, and what the clamps of the others exert on it."""
    found: Rows = []
    scene, native = state.scene, state.native
    for k, (name, strip) in enumerate(zip(scene.names, native.strips, strict=True)):
        over, unit = state.over[k], native.problem.stiffness_over[k]
        for place, end, support in (("start", 0, strip.start), ("end", -1, strip.end_support)):
            if not scene.clamped((k, end)):
                at = strip.end.position if end else strip.position([0.0])[0]
                found.append((f"{name}.{place}", wording.place(over * at, units)))
            elif support is not None:
                found.append((f"force at {name}.{place}", wording.force(unit / over * support.force, units)))
                found.append((f"moment at {name}.{place}", wording.moment(unit * support.moment, units)))
    return found


def joints(state: StripsState, units: Units) -> Rows:
    """What acts at every joint on the second of its ends."""
    found: Rows = []
    scene = state.scene
    for joined, joint in zip(scene.joints, state.native.joints, strict=True):
        other = scene.end_name(joined.other)
        name = f"{joined.spec.kind} {scene.end_name(joined.one)} - {other}"
        text = f"{wording.force(joint.force, units)}; moment {wording.moment(joint.moment, units)}; both on {other}"
        found.append((name, text))
    return found


def contact(state: StripsState, units: Units) -> Rows:
    """How strips push each other, by pairs of strips: at how many places, the force on the first, where most."""
    if state.scene.distance is None:
        return []
    names = state.scene.names
    pairs: dict[tuple[int, int], list[Any]] = {}
    for touch in state.native.touching:
        pairs.setdefault((touch.one, touch.other), []).append(touch)
    found: Rows = []
    for (one, other), own in sorted(pairs.items()):
        most = max(own, key=lambda touch: float(np.linalg.norm(touch.force)))
        total = np.sum([touch.force for touch in own], axis=0)
        where = ", ".join(
            f"s = {units.text(state.over[k] * s, 'l', 4)} of {names[k]}"
            for k, s in ((one, most.s), (other, most.s_other))
        )
        text = f"{wording.force(total, units)} on {names[one]}; {_places(len(own))}, most at {where}"
        found.append((f"contact {names[one]} - {names[other]}", text))
        rubbed = [slide.friction for slide in state.native.slides if (slide.one, slide.other) == (one, other)]
        if rubbed:
            text = f"{wording.force(np.sum(rubbed, axis=0), units)} on {names[one]}"
            found.append((f"friction {names[one]} - {names[other]}", text))
    return found or [("contact", "strips touch each other nowhere")]


def walls(exerted: Sequence[Mapping[str, Any]], units: Units) -> Rows:
    """How every wall and obstacle pushes all strips (`compare.pages.strips.page.walls`), and which it touches."""
    found: Rows = []
    for wall in exerted:
        touched = ", ".join(f"{name} at {len(own['contacts'])}" for name, own in wall["strips"].items())
        text = f"{wording.force(wall['force'], units)}; {touched or 'touches nothing'}"
        found.append((f"force of {wall['name']}", text))
        if "friction" in wall:
            found.append((f"friction of {wall['name']}", wording.force(wall["friction"], units)))
    return found


def _places(count: int) -> str:
    return f"{count} place{'s' if count != 1 else ''}"
