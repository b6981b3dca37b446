"""A deck for CalculiX (`ccx`): a strip between two clamps brought together until the sides of its neck meet.

Half a strip of S8R shells, nu = 0, along x from its clamp to its middle, which stays on the plane of symmetry: that is
the plane on which the sides meet (half the distance kept before it). A load on the middle lifts it while the clamp
begins to be led, goes while it is led to its place, and lines across that come behind the plane are put on it, an
active set as of the ring between planes (`calculix_surfaces.ring`). Lengths in l, D = 1: forces over w in D w / l^2.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from tests.reference.calculix import TIGHT, Failed, run
from tests.reference.calculix_surfaces import PULL, THROUGH, FloatArray, flat, nset, numbers, shown

#: Load on the middle, D w / l^2, that lifts it: pressed flat the strip would stay straight.
LOAD = 40.0
#: Of the strip, l.
WIDTH, THICKNESS = 0.1, 5e-4


class Folded(NamedTuple):
    """push: of one side on the other, D w / l^2; place: arc length from the clamp to the middle of the push, l; energy:
    of bending, D w / l, by a spline through the nodes of the middle line; through: deepest place behind the plane, l;
    lines: that touch; solves: equilibria it took."""

    push: float
    place: float
    energy: float
    through: float
    lines: int
    solves: int


def fold(distance: float, apart: float, along: int, folder: Path) -> Folded:
    """Clamps `distance` apart, sides kept `apart`, `along` elements on half the strip, two across.

    Raises `calculix.Failed` where the program ends early or the lines that touch come back.
    """
    touching, tried = frozenset[int](), set[frozenset[int]]()
    while touching not in tried:
        tried.add(touching)
        pushes, points = _rest(distance, apart, along, touching, folder)
        most = max(pushes.values(), default=0.0)
        pulling = {i for i, force in pushes.items() if force < -PULL * most}
        behind = points[:, 0] - 0.5 * (1.0 - apart)
        behind[-1] = -1.0  # the middle is on the plane of symmetry and beyond the one of contact
        free = {i: float(behind[i]) for i in range(along) if i not in touching}
        deepest = max(free, key=lambda i: free[i])
        enter = {deepest} if free[deepest] > THROUGH else set()
        if not pulling and not enter:
            total = sum(pushes.values())
            place = sum(0.25 * i / along * force for i, force in pushes.items()) / total if total else 0.0
            return Folded(total, place, _bending(points), max(0.0, free[deepest]), len(touching), len(tried))
        touching = (touching - pulling) | enter
    raise Failed(f"a fold with its clamps {distance:g} apart: the lines that touch come back to {sorted(touching)}")


def _rest(
    distance: float, apart: float, along: int, lines: frozenset[int], folder: Path
) -> tuple[dict[int, float], FloatArray]:
    """Pushes of these lines (counted from the clamp), D w / l^2, and the middle line's nodes (2 along + 1, 2)."""
    surface = flat(0.5, WIDTH, THICKNESS, 0.0, (along, 2))
    nodes, far = surface.nodes(), 0.5 * (1.0 - distance)
    middle, centre = surface.line(2 * along), {i: nodes[i, 0, 2] for i in range(2 * along + 1)}
    share = np.array([1.0, 4.0, 2.0, 4.0, 1.0]) / 12.0
    whole, plane = 0.5 * LOAD * WIDTH, 0.5 * (1.0 - apart)

    def step(load: float, led: float, touching: frozenset[int]) -> list[str]:
        touch = [(k, plane - float(surface.points[i, 0, 0])) for i in sorted(touching) for k in surface.line(i)]
        return [
            f"*STEP, NLGEOM, INC=2000\n{TIGHT}\n*STATIC\n0.002, 1., 1e-5, 0.05\n*BOUNDARY\nHELD, 1, 1, {shown(led)}",
            *(f"{k}, 1, 1, {shown(by)}" for k, by in touch), "*CLOAD",
            *(f"{k}, 3, {shown(load * part)}" for k, part in zip(middle, share, strict=True)),
            "*NODE PRINT, NSET=ALL, FREQUENCY=9999\nU, RF\n*END STEP",
        ]  # fmt: skip

    deck = [
        *surface.mesh(), nset("HELD", surface.line(0)), nset("MIDDLE", middle),
        "*BOUNDARY\nHELD, 2, 6\nMIDDLE, 1, 1\nMIDDLE, 4, 6",
        *step(whole, 0.0, frozenset()), *step(whole, 0.3 * far, frozenset()), *step(0.0, far, frozenset()),
    ]  # fmt: skip
    if lines:
        deck += step(0.0, far, lines)
    text = run("\n".join(deck) + "\n", folder, "fold")
    forces = {int(row[0]): -float(row[1]) / WIDTH for row in numbers(text, "forces")}
    moved = {int(row[0]): row[1:] for row in numbers(text, "displacements")}
    points = np.array([surface.points[i, 2, [0, 2]] + moved[k][[0, 2]] for i, k in centre.items()])
    return {i: sum(forces[k] for k in surface.line(i)) for i in lines}, points


def _bending(points: FloatArray) -> float:
    """1/2 int k^2 ds of the whole strip, D w / l, both ends of the half upright to the planes they are on."""
    s = np.linspace(0.0, 0.5, len(points))
    spline = CubicSpline(s, points, bc_type=((1, [1.0, 0.0]), (1, [1.0, 0.0])))
    at, weight = np.polynomial.legendre.leggauss(4)
    fine = (s[:-1, None] + (s[1] - s[0]) * 0.5 * (1.0 + at)).ravel()
    first, second = spline(fine, 1), spline(fine, 2)
    bend = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) ** 2 / np.einsum("ia,ia->i", first, first) ** 2.5
    return float(np.tile(weight, len(s) - 1) @ bend * 0.5 * (s[1] - s[0]))
