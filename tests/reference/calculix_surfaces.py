"""Decks for CalculiX (`ccx`) of surfaces: lattices of S8R shells, or of C3D20R solids, one over the thickness.

The program expands an S8R to a C3D20R of the shell's thickness (its manual, six-node and eight-node shells), so that
both are the same element; as solids whole end faces can be moved by hand and joined upside down, which the rotations of
a shell's node do not allow. Lengths in l and D = Y h^3 / (12 (1 - nu^2)) = 1, so that a force over w is in D w / l^2.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from tests.reference import sze2004
from tests.reference.calculix import TIGHT, TYPES, Failed, run

FloatArray = NDArray[np.float64]
Place = tuple[int, int, int]
#: How far behind a plane a place may be, in l (they are written with six digits), and the part of a plane's force by
#: which a line may pull.
THROUGH, PULL = 1e-7, 1e-6


@dataclass(frozen=True)
class Surface:
    """A stress-free surface.

    points: (2 n + 1, 2 m + 1, 3) corners and midpoints of n x m elements, along and across. normals: the same shape,
    unit, along x across. joined: its last line across is its first (points are given twice). thickness: in l.
    young: Young's modulus, that of D = 1 where none is given.
    """

    points: FloatArray
    normals: FloatArray
    thickness: float
    poisson: float
    element: str = "S8R"
    joined: bool = False
    young: float | None = None

    @property
    def elements(self) -> tuple[int, int]:
        """Along and across."""
        return (self.points.shape[0] - 1) // 2, (self.points.shape[1] - 1) // 2

    @property
    def solid(self) -> bool:
        """Whether the elements are solids: three layers of nodes."""
        return self.element.startswith("C3D")

    @property
    def middle(self) -> int:
        """The layer of the middle surface."""
        return 1 if self.solid else 0

    def nodes(self) -> dict[Place, int]:
        """(along, layer, across) -> node; the layers go against the normal. Places inside a face carry none."""
        (n, m), layers = self.elements, 3 if self.solid else 1
        places = product(range(2 * n if self.joined else 2 * n + 1), range(layers), range(2 * m + 1))
        return {p: k for k, p in enumerate((p for p in places if sum(x % 2 for x in p) <= 1), 1)}

    def place(self, node: Place) -> FloatArray:
        """Where a node rests."""
        i, j, k = node
        shift = 0.5 * (1 - j) * self.thickness if self.solid else 0.0
        return self.points[i, k] + shift * self.normals[i, k]

    def mesh(self) -> Iterator[str]:
        """Nodes (set ALL), elements (set STRIP), material and section."""
        nodes, (n, m) = self.nodes(), self.elements
        yield "*NODE, NSET=ALL"
        for place, number in nodes.items():
            yield f"{number}, " + ", ".join(shown(x) for x in self.place(place))
        yield f"*ELEMENT, TYPE={self.element}, ELSET=STRIP"
        around = 2 * n if self.joined else 2 * n + 1
        for number, (i, k) in enumerate(product(range(n), range(m)), 1):
            corners = [nodes[(2 * i + a) % around, b, 2 * k + c] for a, b, c in TYPES[self.element]]
            words = [str(x) for x in (number, *corners)]
            yield ", ".join(words[:11]) + ("," if len(words) > 11 else "")
            if len(words) > 11:
                yield ", ".join(words[11:])
        young = self.young or 12 * (1 - self.poisson**2) / self.thickness**3
        yield f"*MATERIAL, NAME=M\n*ELASTIC\n{young:.12g}, {self.poisson:.12g}"
        kind = "SOLID" if self.solid else "SHELL"
        yield f"*{kind} SECTION, ELSET=STRIP, MATERIAL=M"
        if not self.solid:
            yield f"{self.thickness:.12g}"

    def line(self, i: int) -> list[int]:
        """All nodes of a line (a face of solids) across."""
        return [number for (a, _, _), number in self.nodes().items() if a == i]


def flat(
    length: float, width: float, thickness: float, poisson: float, elements: tuple[int, int], **keys: str
) -> Surface:
    """A strip along x, its width along y, its normal along z."""
    along = np.linspace(0.0, length, 2 * elements[0] + 1)
    across = np.linspace(-0.5 * width, 0.5 * width, 2 * elements[1] + 1)
    x, y = np.meshgrid(along, across, indexing="ij")
    points = np.stack([x, y, 0.0 * x], axis=-1)
    return Surface(points, np.broadcast_to([0.0, 0.0, 1.0], points.shape), thickness, poisson, **keys)  # type: ignore[arg-type]


def shown(x: float) -> str:
    """A number of at most the 20 characters that the program reads."""
    return f"{x + 0.0:.12g}" if abs(x) > 1e-15 else "0."


def nset(name: str, nodes: list[int]) -> str:
    """A set of nodes."""
    return "\n".join([f"*NSET, NSET={name}", *(f"{n}," for n in nodes)])


def numbers(text: str, heading: str) -> list[FloatArray]:
    """Rows of the last table of a .dat whose heading has these words."""
    tables = re.split(r"\n(?=[ a-zA-Z]*[a-z]+ [^\n]*time)", text)
    chosen = [table for table in tables if heading in table.split("\n", 1)[0]]
    rows = [] if not chosen else [line.split() for line in chosen[-1].split("\n")[1:] if line.strip()]
    if not rows:
        raise Failed(f"no {heading} in the output")
    return [np.array([float(x) for x in row]) for row in rows]


# -- a ring between plates --------------------------------------------------------------------------------------------


class Ring(NamedTuple):
    """force: of a plate, D w / l^2; energy: of the strip that is flat at rest, D w / l; through: deepest place behind a
    plate, l; flat: half the length between the outermost lines that touch a plate, l; solves: equilibria it took."""

    force: float
    energy: float
    through: float
    flat: float
    solves: int


class Squeezed(NamedTuple):
    """An equilibrium with lines on the planes. force, energy: as of a `Ring`; pushes: force of each line that touches,
    by its steps from the highest (of a quarter); heights: of the lines of this quarter over the plane, l."""

    force: float
    energy: float
    pushes: dict[int, float]
    heights: dict[int, float]


def circle(elements: tuple[int, int], thickness: float, width: float) -> Surface:
    """A circle of length 1 about z, joined, from its lowest place; its normal is outwards."""
    angle = 2.0 * np.pi * np.linspace(0.0, 1.0, 2 * elements[0] + 1)
    across = np.linspace(-0.5 * width, 0.5 * width, 2 * elements[1] + 1)
    a, z = np.meshgrid(angle, across, indexing="ij")
    normals = np.stack([np.sin(a), -np.cos(a), 0.0 * a], axis=-1)
    points = 0.5 / np.pi * normals + np.stack([0.0 * a, 0.0 * a, z], axis=-1)
    return Surface(points, normals, thickness, 0.0, joined=True)


def ring(gap: float, elements: tuple[int, int], folder: Path, thickness: float = 5e-4, width: float = 0.1) -> Ring:
    """A circle, nu = 0, whose middle surface is squeezed between planes `gap` apart, by an active set of whole lines
    across: those that touch a plane have their height prescribed. From the highest line on, lines that pull are let go
    and the one that is deepest behind the plane is put on it, until no line does either.

    The circle is without stress; to its energy 2 pi^2 is added, what bending it from flat takes (the tangent turns
    once, whatever the shape: int (K - K0)^2 / 2 = int K^2 / 2 - K0 2 pi + K0^2 / 2, K0 = 2 pi).
    """
    touching, tried = frozenset({0}), set[frozenset[int]]()
    while touching not in tried:
        tried.add(touching)
        found = _squeezed(gap, touching, circle(elements, thickness, width), folder, width)
        pulling = {k for k, force in found.pushes.items() if force < -PULL * found.force}
        deepest = max(found.heights, key=lambda k: found.heights[k] - (k in touching))
        behind = {deepest} if found.heights[deepest] > THROUGH else set()
        if not pulling and not behind:
            through, flat = max(0.0, *found.heights.values()), max(touching) / (2.0 * elements[0])
            return Ring(found.force, found.energy, through, flat, len(tried))
        touching = (touching - pulling) | behind
    raise Failed(f"a ring between planes {gap:g} apart: the lines that touch come back to {sorted(touching)}")


def _squeezed(gap: float, lines: frozenset[int], surface: Surface, folder: Path, width: float) -> Squeezed:
    """With these lines on each plane, counted in steps from the highest and the lowest, to both sides."""
    nodes, (n, m) = surface.nodes(), surface.elements
    quarter, both = n // 2, sorted(lines | {-k for k in lines})
    upper = {k: surface.line(2 * quarter + k) for k in range(-quarter, quarter + 1)}
    lower = {k: surface.line(k % (2 * n)) for k in both}
    deck = [
        *surface.mesh(),
        nset("UPRIGHT", surface.line(0) + upper[0]),
        nset("SIDES", upper[-quarter] + upper[quarter]),
        nset("INNER", [k for (_, _, j), k in nodes.items() if j == m]),
        nset("TOP", [k for i in both for k in upper[i]]),
        "*BOUNDARY\nUPRIGHT, 1, 1\nSIDES, 2, 2\nINNER, 3, 3",
        f"*STEP, NLGEOM, INC=1000\n{TIGHT}\n*STATIC\n0.05, 1., 1e-6, 0.05\n*BOUNDARY",
    ]
    rest = {number: float(surface.place(place)[1]) for place, number in nodes.items()}
    led = {k: 0.5 * gap - rest[k] for i in both for k in upper[i]}
    led |= {k: -0.5 * gap - rest[k] for i in both for k in lower[i]}
    deck += [f"{k}, 2, 2, {shown(by)}" for k, by in led.items()]
    deck += ["*NODE PRINT, NSET=TOP\nRF", "*NODE PRINT, NSET=ALL\nU", "*END STEP"]
    text = run("\n".join(deck) + "\n", folder, "ring")
    forces = {int(row[0]): -float(row[2]) / width for row in numbers(text, "forces")}
    moved = {int(row[0]): float(row[2]) for row in numbers(text, "displacements")}
    pushes = {i: sum(forces[k] for k in upper[i]) for i in both}
    heights = {i: max(rest[k] + moved[k] for k in upper[i]) - 0.5 * gap for i in range(quarter)}
    energy = 2.0 * _work(text, led) / width + 2.0 * np.pi**2
    return Squeezed(sum(pushes.values()), energy, {i: f for i, f in pushes.items() if i >= 0}, heights)


def _work(text: str, displacements: dict[int, float]) -> float:
    """Of the forces along y of a .dat on nodes whose displacement grows evenly with the time: a spline through all
    increments (the program's ELSE comes to nearly twice the work, 1.87 times in 9 increments, 1.98 in 50)."""
    times, power = [0.0], [0.0]
    for part in re.split(r"\n(?= forces )", text)[1:]:
        times.append(float(part.split("time")[1].split()[0]))
        rows = re.findall(r"^\s+(\d+)((?:\s+[-+]?\d+\.\d+E[-+]\d+){3})\s*$", part.split("displacements")[0], re.M)
        power.append(sum(float(row.split()[1]) * displacements[int(node)] for node, row in rows))
    return float(CubicSpline(times, power).integrate(0.0, 1.0))


# -- the slit annular plate -------------------------------------------------------------------------------------------


def slit_annulus(elements: tuple[int, int], folder: Path) -> tuple[float, float]:
    """Deflections of the inner and the outer corner of the free edge, in the units of tests/reference/sze2004.py."""
    data = sze2004.SLIT_ANNULUS
    angle = 2.0 * np.pi * np.linspace(0.0, 1.0, 2 * elements[0] + 1)
    a, r = np.meshgrid(angle, np.linspace(data.inner_radius, data.outer_radius, 2 * elements[1] + 1), indexing="ij")
    points = np.stack([r * np.cos(a), r * np.sin(a), 0.0 * a], axis=-1)
    normals = np.broadcast_to([0.0, 0.0, -1.0], points.shape)
    surface = Surface(points, normals, data.thickness, data.poisson, young=data.young)
    free, m = surface.line(2 * elements[0]), elements[1]
    share = np.zeros(2 * m + 1)
    for k in range(m):
        share[2 * k : 2 * k + 3] += np.array([1.0, 4.0, 1.0]) / (6.0 * m)
    whole = data.p_max * (data.outer_radius - data.inner_radius)
    lines = [
        *surface.mesh(), nset("HELD", surface.line(0)), nset("FREE", free), "*BOUNDARY\nHELD, 1, 6",
        f"*STEP, NLGEOM, INC=1000\n{TIGHT}\n*STATIC\n0.02, 1., 1e-7, 0.05\n*CLOAD",
        *(f"{node}, 3, {shown(whole * part)}" for node, part in zip(free, share, strict=True)),
        "*NODE PRINT, NSET=FREE, FREQUENCY=9999\nU\n*END STEP",
    ]  # fmt: skip
    moved = {int(row[0]): row[3] for row in numbers(run("\n".join(lines) + "\n", folder, "annulus"), "displacements")}
    return float(moved[free[0]]), float(moved[free[-1]])
