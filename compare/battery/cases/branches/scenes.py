"""The two scenes of branches as texts: a heavy mast, an arch between two clamps. Lengths in l."""

from __future__ import annotations

from collections.abc import Sequence

#: Height of the end over the clamp.
SHIFT = "clamp.end.position[2]"
ALONG, UP = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
ARCH = (6.0, -6.0, 6.0)


def mast(
    title: str = "Mast", poisson: float = 0.0, gamma: float = 5.0, energy: str = "wunderlich", elements: int = 10
) -> str:
    """A strip that stands on its clamp."""
    return f"""
title = "{title}"
[strip]
length = 1.0
width = 0.02
poisson = {poisson}
gamma = {gamma}
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [-1.0, 0.0, 0.0]
[model]
energy = "{energy}"
elements = {elements}
"""


def clamps(
    tangent: Sequence[float] = ALONG,
    normal: Sequence[float] = UP,
    seed: Sequence[float] = ARCH,
    elements: int | None = 8,
) -> str:
    """An elastica between two clamps 0.8 l apart, the second turned to this frame; elements None: the usual ones."""
    return f"""
title = "Two clamps"
[strip]
length = 1.0
width = 0.02
poisson = 0.3
gamma = 0.0
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[clamp.end]
position = [0.8, 0.0, 0.0]
tangent = {list(tangent)}
normal = {list(normal)}
[model]
energy = "elastica"
{"" if elements is None else f"elements = {elements}"}
[seed]
curvature = {list(seed)}
"""


MAST, CLAMPS = mast(), clamps()
