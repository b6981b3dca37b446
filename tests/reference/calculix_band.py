"""A Moebius band by CalculiX: a flat strip, both end faces moved by hand until one lies upside down on the other.

Solids C3D20R, one over the thickness, to which the program expands S8R itself: the whole end face is prescribed, which
is a clamped section. First the strip is bent to a circle, its free end along the ends of circular arcs; then this end
turns by half a turn about its tangent. Prescribed places of nodes are read off a table of the time, with chords between
its entries that are shorter than the arcs by (angle of a step)^2 / 24 at most, and exact at the end.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.reference.calculix import TIGHT, run
from tests.reference.calculix_surfaces import FloatArray, flat, nset, numbers, shown

#: Entries of the table for the circle and for the turn; the strip leaves its plane by an arc of a little angle first.
BENT, TURNED = 512, 128


def motion() -> FloatArray:
    """(BENT + TURNED + 1, 4, 3): place and axes (tangent, width, normal) of the free end."""
    found = []
    for angle in 2.0 * np.pi * np.linspace(0.0, 1.0, BENT + 1):
        place = [np.sinc(angle / np.pi), 0.0, 0.5 * angle * np.sinc(0.5 * angle / np.pi) ** 2]
        found.append([place, [np.cos(angle), 0.0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0.0, np.cos(angle)]])
    for turn in np.pi * np.linspace(0.0, 1.0, TURNED + 1)[1:]:
        c, s = np.cos(turn), np.sin(turn)
        found.append([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
    return np.array(found)


def moebius(width: float, thickness: float, poisson: float, elements: tuple[int, int], folder: Path) -> FloatArray:
    """Place (3,) over l of the point opposite to the clamp of the band of length 1; the clamp is at the origin, its
    tangent along x, its width along y."""
    surface = flat(1.0, width, thickness, poisson, elements, element="C3D20R")
    nodes, poses = surface.nodes(), motion()
    n, m = elements
    times = np.linspace(0.0, 1.0, len(poses))
    lines = [*surface.mesh(), nset("HELD", surface.line(0)), nset("MIDDLE", [nodes[n, surface.middle, m]])]
    ends = {place: number for place, number in nodes.items() if place[0] == 2 * n}
    for place, number in ends.items():
        rest = surface.place(place)
        moved = poses[:, 0] + rest[1] * poses[:, 2] + rest[2] * poses[:, 3] - rest
        for axis in range(3):
            words = [f"{shown(t)}, {shown(x)}" for t, x in zip(times, moved[:, axis], strict=True)]
            lines += [
                f"*AMPLITUDE, NAME=A{number}{axis}",
                *(", ".join(words[k : k + 4]) for k in range(0, len(words), 4)),
            ]
    lines += ["*BOUNDARY\nHELD, 1, 3", f"*STEP, NLGEOM, INC=2000\n{TIGHT}\n*STATIC\n0.004, 1., 1e-7, 0.01"]
    for number in ends.values():
        for axis in range(3):
            lines += [f"*BOUNDARY, AMPLITUDE=A{number}{axis}\n{number}, {axis + 1}, {axis + 1}, 1."]
    lines += ["*NODE PRINT, NSET=MIDDLE, FREQUENCY=9999\nU", "*END STEP"]
    moved = numbers(run("\n".join(lines) + "\n", folder, "band"), "displacements")[-1][1:]
    return np.asarray(surface.points[n, m] + moved)
