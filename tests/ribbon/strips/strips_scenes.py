"""Several strips that the tests of this folder share."""

from __future__ import annotations

import numpy as np

from ribbon import Clamp, Gravity, Strip
from ribbon.element import quaternion
from ribbon.find.strips.assemble import Member
from ribbon.problems.strips.joint import End, Joint

UP = Gravity((1.0, 0.0, 0.0))
#: A clamp whose width stands at 45 degrees to the weight.
OBLIQUE = Clamp((0.1, -0.2, 0.3), (0.0, 0.0, 1.0), (-np.sqrt(0.5), np.sqrt(0.5), 0.0))
SECTION = {"width": 0.05, "poisson": 0.4, "thickness": 1e-3}


def turn(axis: int, degrees: float) -> tuple[float, float, float, float]:
    """A quaternion of a turn about an axis of the frame."""
    w, x, y, z = quaternion.turn(np.eye(3)[axis], np.radians(degrees))
    return float(w), float(x), float(y), float(z)


def cut(parts: int, segments: int, gamma: float, curvature: float, clamp: Clamp | None = OBLIQUE) -> list[Member]:
    """A strip of length 1 cut into equal parts, the first one clamped; gamma, curvature: of the whole."""
    strip = Strip(length=1.0 / parts, natural_curvature=curvature, gamma=gamma / parts**3, **SECTION)
    return [Member(strip, clamp if k == 0 else None, segments=segments // parts) for k in range(parts)]


def chain(parts: int, kind: str = "seamless") -> list[Joint]:
    """Joints of strips one behind the other."""
    return [Joint(End(k, -1), End(k + 1, 0), kind) for k in range(parts - 1)]


def bigon(
    degrees: float, axis: int, curvature: tuple[float, float] | None = None, **strip: float
) -> tuple[list[Member], list[Joint]]:
    """Two strips of length 1, joined at both ends at an angle about an axis of the frame; curvature: to begin with."""
    own = Strip(length=1.0, **{**SECTION, "thickness": 0.01, **strip})
    members = [Member(own, segments=12, curvature=None if curvature is None else (c,)) for c in curvature or (0.0, 0.0)]
    ends = (Joint(End(0, 0), End(1, 0), "rigid", turn(axis, degrees)),
            Joint(End(0, -1), End(1, -1), "rigid", turn(axis, -degrees)))  # fmt: skip
    return members, list(ends)


def ring(cells: int, degrees: float, turns: int, segments: int = 8) -> tuple[list[Member], list[Joint]]:
    """A ring of bigons (w / l = 0.1, h / w = 0.2): a strip of each goes on into the next; begun as so many turns."""
    strip = Strip(length=1.0, width=0.1, poisson=0.3, thickness=0.02)
    begin = (-2.0 * np.pi * turns / cells,)
    members = [Member(strip, segments=segments, curvature=begin) for _ in range(2 * cells)]
    joints = []
    for one in range(0, 2 * cells, 2):
        other, following = one + 1, (one + 2) % (2 * cells)
        joints += [
            Joint(End(one, 0), End(other, 0), "rigid", turn(1, degrees)),
            Joint(End(one, -1), End(other, -1), "rigid", turn(1, -degrees)),
            Joint(End(other, -1), End(following, 0), "rigid"),
        ]
    return members, joints
