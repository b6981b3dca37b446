"""The keys of a scene of several strips that a scene of one does not have, and which of its keys are known in both."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from compare.scene import keys as contract
from compare.scene.declare import LENGTH, Key, Kind, collected, key, keys_of

#: Sections of a strip's own, inside its [[strip]].
OWN = ("clamp", "seed", "tip")
#: Keys of [strip] that a strip among others cannot have: what its model does not know.
_NOT = ("second_moment", "transverse_curvature")
#: Keys of [model] and of [gravity] that are known.
_MODEL = ("energy", "stiffness", "in_plane", "elements", "budget", "solver")
#: Keys of [[wall]] that are not: plates on springs.
_NOT_OF_WALLS = ("stiffness",)
_CLAMP = ("position", "frame", "tangent", "normal", "ruling")
#: Keys of [tip] that are: a tension has no direction of its own here.
_TIP = ("mass", "load", "force", "moment")


# fmt: off
@dataclass(frozen=True)
class NamedSpec:
    """What a strip among others is called."""

    name: str = key(Kind.TEXT, "name of the strip, its own", example='"left"')


@dataclass(frozen=True)
class JointSpec:
    """Two ends that are joined."""

    a: str = key(Kind.TEXT, "end that the other one is joined to", example='"left.end"')
    b: str = key(Kind.TEXT, "end that is joined to it", example='"right.start"')
    kind: str = key(
        Kind.CHOICE, "what is held", example='"rigid"', default="rigid",
        choices={"rigid": "position and frame", "seamless": "the strip goes on: curvature and ruling too",
                 "hinge": "position and frame, but for a turn about t_x, across the strip",
                 "pin": "position alone"}
    )
    angle: float = key(
        Kind.NUMBER, "angle by which the frame of b is turned from that of a", "degrees", "-180 <= angle <= 180",
        "60.0", default=0.0
    )
    axis: str = key(
        Kind.CHOICE, "axis of that turn, of a's frame", example='"normal"', default="normal",
        choices={"normal": "t_y: in the plane of the strip", "across": "t_x: a fold", "tangent": "t_z: a twist"}
    )
    ruling: str | None = key(
        Kind.CHOICE, "ruling at both ends", example='"straight"', default=None,
        choices={"straight": "eta = 0, the whole edges are joined", "free": ""},
        absent='"straight" for rigid and hinge, "free" for seamless and pin'
    )


@dataclass(frozen=True)
class BetweenSpec:
    """Contact between strips, and of each with itself, without friction or along a path with Coulomb's."""

    distance: float | None = key(
        Kind.NUMBER, "distance that different strips keep, middle surface from middle surface", LENGTH, "> 0", "1e-3",
        default=None, absent="the largest thickness of the strips", known="distance / l >= 1e-4"
    )
    itself: bool = key(
        Kind.TRUTH, "whether parts of one strip that face each other keep it too, with the same friction",
        example="true", default=False
    )
    friction: float = key(
        Kind.NUMBER, "Coulomb's coefficient between strips; along a [[path]] alone", "none", ">= 0", "0.3", default=0.0
    )
# fmt: on


def _some(spec: type, section: str, names: tuple[str, ...]) -> Mapping[str, Key]:
    return {name: one for name, one in keys_of(spec, section).items() if name.rpartition(".")[2] in names}


def _of(section: str) -> Mapping[str, Key]:
    return {name: one for name, one in contract.KEYS.items() if name.startswith(f"{section}.")}


def _without(keys: Mapping[str, Key], names: tuple[str, ...]) -> Mapping[str, Key]:
    return {name: one for name, one in keys.items() if name.rpartition(".")[2] not in names}


KEYS: Mapping[str, Key] = collected(
    (
        {"title": contract.KEYS["title"]},
        keys_of(NamedSpec, "strip"),
        _without(_of("strip"), _NOT),
        {
            f"strip.{name}": one
            for end in ("start", "end")
            for name, one in _of(f"clamp.{end}").items()
            if name.rpartition(".")[2] in _CLAMP
        },
        {f"strip.{name}": one for name, one in _of("seed").items()},
        {f"strip.{name}": one for name, one in _of("tip").items() if name.rpartition(".")[2] in _TIP},
        keys_of(JointSpec, "joint"),
        _of("gravity"),
        _without(_of("wall"), _NOT_OF_WALLS),
        _without(_of("obstacle"), _NOT_OF_WALLS),
        keys_of(BetweenSpec, "contact"),
        _of("path"),
        _some(contract.SPECS["model"], "model", _MODEL),
    )
)
"""Every key of a scene of several strips, by its dotted name."""

ENDS = ("start", "end")
#: What the turn of a joint is about: columns t_x, t_y, t_z of a frame.
AXES = {"across": 0, "normal": 1, "tangent": 2}
