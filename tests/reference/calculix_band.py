"""A Moebius band by CalculiX: a flat strip, both end faces moved by hand until one lies upside down on the other.

Solids C3D20R, one over the thickness, to which the program expands S8R itself: the whole end face is prescribed, which
is a clamped section. First the strip is bent to a circle, its free end along the ends of circular arcs; then this end
turns by half a turn about its tangent. Prescribed places of nodes are read off a table of the time, with chords between
its entries that are shorter than the arcs by (angle of a step)^2 / 24 at most, and exact at the end.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from tests.reference.calculix import TIGHT, run
from tests.reference.calculix_surfaces import FloatArray, flat, nset, numbers, shown

IntArray = NDArray[np.intp]
#: Entries of the table for the circle and for the turn; the strip leaves its plane by an arc of a little angle first.
BENT, TURNED = 512, 128


class Band(NamedTuple):
    """middle: place over l of the point opposite to the clamp; the clamp is at the origin, its tangent along x, its
    width along y. energy: the work of the moved end, D w / l; error: what its quadrature leaves, from every second
    increment; increments: how many there were."""

    middle: tuple[float, float, float]
    energy: float
    error: float
    increments: int


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


def moebius(width: float, thickness: float, poisson: float, elements: tuple[int, int], folder: Path) -> Band:
    """The clamped band of length 1."""
    surface = flat(1.0, width, thickness, poisson, elements, element="C3D20R")
    nodes, poses = surface.nodes(), motion()
    n, m = elements
    times = np.linspace(0.0, 1.0, len(poses))
    lines = [*surface.mesh(), nset("HELD", surface.line(0)), nset("MIDDLE", [nodes[n, surface.middle, m]])]
    ends = {place: number for place, number in nodes.items() if place[0] == 2 * n}
    paths = np.empty((len(ends), len(poses), 3))
    lines += [nset("MOVED", list(ends.values()))]
    for (place, number), moved in zip(ends.items(), paths, strict=True):
        rest = surface.place(place)
        moved[:] = poses[:, 0] + rest[1] * poses[:, 2] + rest[2] * poses[:, 3] - rest
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
    lines += ["*NODE PRINT, NSET=MOVED\nRF", "*NODE PRINT, NSET=MIDDLE\nU", "*END STEP"]
    text = run("\n".join(lines) + "\n", folder, "band")
    moved = numbers(text, "displacements")[-1][1:]
    x, y, z = (float(x) for x in surface.points[n, m] + moved)
    at, forces = _forces(text, list(ends.values()))
    energy, error = _work(times, paths, at, forces)
    return Band((x, y, z), energy / width, error / width, len(at) - 1)


def _forces(text: str, nodes: list[int]) -> tuple[FloatArray, FloatArray]:
    """Times (k,) and forces (nodes, k, 3) of the tables of a .dat, from rest on."""
    times, found = [0.0], [np.zeros((len(nodes), 3))]
    for part in re.split(r"\n(?= forces )", text)[1:]:
        table = re.split(r"\n(?= [a-z]+ )", part)[0]
        rows = re.findall(r"^\s+(\d+)((?:\s+[-+]?\d+\.\d+E[-+]\d+){3})\s*$", table, re.M)
        known = {int(node): [float(x) for x in row.split()] for node, row in rows}
        times.append(float(table.split("time")[1].split()[0]))
        found.append(np.array([known[node] for node in nodes]))
    return np.array(times), np.stack(found, axis=1)


def _work(times: FloatArray, paths: FloatArray, at: FloatArray, forces: FloatArray) -> tuple[float, float]:
    """Of forces (nodes, k, 3) known at some times, along paths (nodes, n, 3) of chords between `times`; its error from
    every second of them, even and odd. Between, forces are local cubics: where the path turns they have a corner."""

    def of(some: IntArray) -> float:
        whole = PchipInterpolator(at[some], forces[:, some], axis=1).antiderivative()(times)
        return float(np.sum(np.diff(whole, axis=1) * np.diff(paths, axis=1) / np.diff(times)[:, None]))

    every = np.arange(len(at))
    fine = of(every)
    return fine, max(abs(fine - of(np.unique([0, *every[first::2], every[-1]]))) for first in (0, 1))
