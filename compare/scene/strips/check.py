"""Do several strips go together? What contradicts itself is found before anything is computed."""

from __future__ import annotations

import math
from itertools import combinations

from compare.scene.strips.scene import Joined, StripsScene
from compare.scene.strips.spec import ENDS
from ribbonbench.errors import BadInput

End = tuple[int, int]
#: Widths and lengths of a strip that goes on agree to this, relatively.
_SAME = 1e-9
#: How far, relatively, clamps may be farther apart than strips between them are long: rounding.
_TOO_FAR = 1e-12


def check_together(scene: StripsScene) -> None:
    """Raise for the first joint or strip that cannot be."""
    groups = _joined(scene)
    for number, joint in enumerate(scene.joints):
        _check_kind(scene, number, joint)
    _check_loads(scene)
    _check_held(scene)
    _check_distances(scene, groups)


def _joined(scene: StripsScene) -> dict[End, int]:
    """Which ends are at one place: a number for each, the same where joints join them."""
    groups: dict[End, int] = {end: k for k, end in enumerate((n, e) for n in range(len(scene.strips)) for e in (0, -1))}
    for number, joint in enumerate(scene.joints):
        for key, end in (("a", joint.one), ("b", joint.other)):
            if scene.clamped(end):
                raise BadInput(
                    f"joint.{number}.{key}", scene.end_name(end), "is held by a clamp already",
                    f"remove [strip.clamp.{ENDS[end[1]]}] of {scene.names[end[0]]}, or the joint",
                )  # fmt: skip
        one, other = groups[joint.one], groups[joint.other]
        if one == other:
            raise BadInput(
                f"joint.{number}.b", scene.end_name(joint.other),
                f"is joined to {scene.end_name(joint.one)} already", "remove one of the joints",
            )  # fmt: skip
        groups = {end: one if group == other else group for end, group in groups.items()}
    return groups


def _check_kind(scene: StripsScene, number: int, joint: Joined) -> None:
    spec = joint.spec
    turned = spec.angle != 0.0
    if turned and spec.kind in ("seamless", "pin"):
        raise BadInput(f"joint.{number}.angle", spec.angle, f'has no meaning for kind = "{spec.kind}"', "leave it out")
    if spec.kind != "seamless":
        return
    if (joint.one[1], joint.other[1]) != (-1, 0):
        raise BadInput(
            f"joint.{number}.kind", spec.kind, "lets a strip go on: from the end of a into the start of b",
            'give a = "NAME.end" and b = "NAME.start", or kind = "rigid"',
        )  # fmt: skip
    if spec.ruling is not None:
        raise BadInput(f"joint.{number}.ruling", spec.ruling, "has no meaning where the strip goes on", "leave it out")
    one, other = (scene.strips[end[0]].strip for end in (joint.one, joint.other))
    for key in ("width", "thickness", "poisson"):
        here, there = vars(one)[key], vars(other)[key]
        if here != there and not (here and there and math.isclose(here, there, rel_tol=_SAME)):
            raise BadInput(
                f"joint.{number}.kind", spec.kind, f"joins strips of {key} {here} and {there}",
                'give both the same, or kind = "rigid"',
            )  # fmt: skip


def _check_loads(scene: StripsScene) -> None:
    """What is loaded at its end can move there: a joint, or nothing, is at it."""
    for name, strip in zip(scene.names, scene.strips, strict=True):
        clamp = strip.clamp_end
        if strip.tip is None or clamp is None:
            continue
        if strip.tip.moment is not None and clamp.tangent is not None:
            raise BadInput(
                f"strip.{name}.tip.moment", list(strip.tip.moment),
                "turns a frame that its clamp.end holds",
                f"remove it, or the tangent and normal of [strip.{name}.clamp.end]",
            )  # fmt: skip
        tip = strip.tip
        if any(value is not None for value in (tip.mass, tip.load, tip.force)) and clamp.position is not None:
            raise BadInput(
                f"strip.{name}.tip", None, "loads a point that its clamp.end holds",
                f"remove [strip.{name}.tip], or the position of [strip.{name}.clamp.end]",
            )  # fmt: skip


def _check_held(scene: StripsScene) -> None:
    """Whatever hangs together is held by a clamp, or everything hangs together, weightless, and touches nothing."""
    groups = [{k} for k in range(len(scene.strips))]
    for joint in scene.joints:
        one, other = (next(group for group in groups if end[0] in group) for end in (joint.one, joint.other))
        if one is not other:
            groups.remove(other)
            one |= other
    for group in groups:
        clamps = [clamp for k in group for clamp in (scene.strips[k].clamp_start, scene.strips[k].clamp_end)]
        if any(clamp is not None and clamp.holds_all for clamp in clamps):
            continue
        names = ", ".join(scene.names[k] for k in sorted(group))
        why = ""
        if any(clamp is not None for clamp in clamps):
            why = "is held by clamps that leave a part free"
        elif any(scene.strips[k].gamma for k in group):
            why = "is held by no clamp and falls"
        elif any(scene.strips[k].tip_force.any() or scene.strips[k].tip_moment.any() for k in group):
            why = "is held by no clamp, and its load pulls it away for ever"
        elif len(groups) > 1 or scene.distance is not None:
            why = "is held by no clamp, and where it is beside the others is not said"
        if why:
            first = scene.names[min(group)]
            raise BadInput(
                f"strip.{first}.clamp", None, f"{names} {why}",
                "clamp position, tangent and normal of one end of it, or join it to a strip that is clamped",
            )  # fmt: skip


def _check_distances(scene: StripsScene, groups: dict[End, int]) -> None:
    """Clamped points are no farther apart than the strips between them are long (Floyd and Warshall)."""
    count = max(groups.values()) + 1
    way = [[0.0 if i == j else math.inf for j in range(count)] for i in range(count)]
    for k, strip in enumerate(scene.strips):
        i, j = groups[k, 0], groups[k, -1]
        way[i][j] = way[j][i] = min(way[i][j], strip.strip.length)
    for m in range(count):
        for i in range(count):
            for j in range(count):
                way[i][j] = min(way[i][j], way[i][m] + way[m][j])
    held = [
        (k, end, clamp.position)
        for k, strip in enumerate(scene.strips)
        for end, clamp in ((0, strip.clamp_start), (-1, strip.clamp_end))
        if clamp is not None and clamp.position is not None
    ]
    for (k, end, one), (m, other_end, other) in combinations(held, 2):
        longest, apart = way[groups[k, end]][groups[m, other_end]], math.dist(one, other)
        if apart > longest * (1.0 + _TOO_FAR):
            raise BadInput(
                f"strip.{scene.names[m]}.clamp.{ENDS[other_end]}.position", list(other),
                f"is {apart:.12g} from strip.{scene.names[k]}.clamp.{ENDS[end]}.position, and the strips between them "
                f"are {longest:.12g} long",
                "move the clamps nearer to each other, or give longer strips",
            )  # fmt: skip
