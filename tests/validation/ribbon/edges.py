"""A strip over edges: the rim of a table, by elements in contact and by shooting on the elastica, sharp and round; an
oblique edge, turned and mirrored; a corner; a ring in a box."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

from ribbon import Clamp, Closure, Equilibrium, Gravity, Strip, Wall, solve
from ribbon.solid import Solid
from tests.validation import page
from tests.validation.number import Number

#: The rim stands so far from the clamp and so far below it (l); weight of the strip.
AWAY, BELOW, GAMMA = 0.3, 0.01, 60.0
STRIP = Strip(1.0, 0.05, 0.3, gamma=GAMMA)
SEGMENTS, ROUNDINGS = (20, 40, 80, 160), (1e-2, 1e-3, 1e-4)
X, UP = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
#: Angles (degrees) of an oblique edge to the strip's width.
OBLIQUE = (0.0, 10.0, 30.0, 60.0)
#: Side of a square box around a ring of length 1, over which the ring touches two pairs of sides.
SIDE = 0.28


@cache
def shot(rounding: float) -> tuple[float, float, float]:
    """Abscissa (l) of the contact and the rim's force across and up (D w / l^2): the elastica clamped level at 0,
    ``theta'' = n_z sin theta - n_y cos theta``, with n = (0, -Gamma (1 - s)) behind the rim and the rim's force,
    along the strip's normal nu, before it. The strip stands at ``centre + rounding nu`` there; 0 is a sharp rim.
    Curvature at the clamp, place, force and angle there are 4 unknowns; place (2), angle and the free end 4 rows.
    """
    centre = np.array([AWAY - rounding, -BELOW - rounding])

    def rate(s: float, y: np.ndarray, force: np.ndarray) -> list[float]:
        across, up = force[0], force[1] - GAMMA * (1.0 - s)
        return [np.cos(y[2]), np.sin(y[2]), y[3], across * np.sin(y[2]) - up * np.cos(y[2])]

    def left(unknowns: np.ndarray) -> np.ndarray:
        start, place, push, angle = unknowns
        normal = np.array([-np.sin(angle), np.cos(angle)])
        tight = {"rtol": 1e-11, "atol": 1e-12}
        first = solve_ivp(rate, (0.0, place), [0.0, 0.0, 0.0, start], args=(push * normal,), **tight).y[:, -1]
        last = solve_ivp(rate, (place, 1.0), first, args=(np.zeros(2),), **tight).y[:, -1]
        return np.append(first[:2] - centre - rounding * normal, [first[2] - angle, last[3]])

    found = fsolve(left, [1.6, 0.303, 85.0, -0.45], xtol=1e-13)
    if np.abs(left(found)).max() > 1e-9:
        raise AssertionError(f"shooting: {left(found)}")
    return float(found[1]), float(-found[2] * np.sin(found[3])), float(found[2] * np.cos(found[3]))


def rim(rounding: float, degrees: float = 0.0) -> Solid:
    """The table's rim, turned about the vertical."""
    turn = np.radians(degrees)
    return Solid("edge", (0.0, -BELOW, AWAY), rounding, (np.cos(turn), 0.0, np.sin(turn)), normal=UP)


@cache
def over(rounding: float, segments: int, degrees: float = 0.0) -> Equilibrium:
    """The strip clamped level over the rim, by the energy that is exact in the width."""
    return solve(STRIP, Clamp(), Gravity(UP), walls=[rim(rounding, degrees)], segments=segments)


def off(rounding: float, segments: int, sharp: bool = False) -> tuple[float, float]:
    """How far place (l) and force (D w / l^2) of the contact are from shooting."""
    place, across, up = shot(0.0 if sharp else rounding)
    wall = over(rounding, segments).walls[0]
    apart = float(np.linalg.norm(wall.force - np.array([0.0, up, across])))
    return float(np.abs(wall.contacts - place).max()), apart


@cache
def moved(mirrored: bool) -> float:
    """Energy of the strip over an oblique rim with all of the scene turned and shifted, or mirrored across its middle
    plane, less that as it stands, D w / l."""
    alone = over(1e-3, 40, 10.0).energy.total
    if mirrored:
        return over(1e-3, 40, -10.0).energy.total - alone
    turn, shift = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix(), np.array([0.4, -2.0, 1.0])
    own = rim(1e-3, 10.0)
    wall = Solid("edge", shift + turn @ own.point, 1e-3, turn @ own.axis, normal=turn @ own.normal)
    clamp = Clamp(tuple(shift), tangent=turn[:, 2], normal=turn[:, 1])
    return (
        solve(STRIP, clamp, Gravity(turn[:, 1]), walls=[wall], segments=40).energy.total
        - GAMMA * float(shift @ turn[:, 1])
        - alone
    )


@cache
def over_corner(aside: float) -> Equilibrium:
    """The strip over the corner of a cube that stands on the opposite corner, `aside` (l) of the strip's middle."""
    side = 0.2
    turn = Rotation.align_vectors([UP], [np.ones(3) / np.sqrt(3.0)])[0].as_matrix()
    centre = (aside, -0.02 - 0.5 * side * np.sqrt(3.0), 0.4)
    cube = Solid("box", centre, 2e-3, turn[:, 0], normal=turn[:, 1], size=(side,) * 3)
    return solve(STRIP, Clamp(), Gravity(UP), walls=[cube], segments=40)


@cache
def ring(planes: bool) -> Equilibrium:
    """A ring in a box, or between the same four planes."""
    half = 0.5 * SIDE
    sides = [
        Wall(-half * np.array(n), n) for n in ((0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0))
    ]
    box = Solid("box", (0.0, 0.0, 0.0), 0.0, X, True, normal=UP, size=(0.4, SIDE, SIDE))
    return solve(
        Strip(1.0, 0.05, 0.3), None, closure=Closure("circle"), walls=sides if planes else [box], segments=40,
        energy="sadowsky",
    )  # fmt: skip


PROBES = {
    "place": lambda: float(over(1e-3, 40).walls[0].contacts[0]),
    "place_shot": lambda: shot(1e-3)[0],
    "force_up": lambda: float(over(1e-3, 40).walls[0].force[1]),
    "corner_up": lambda: float(over_corner(0.0).walls[0].force[1]),
}


def run(out: Path) -> dict[str, Number]:
    finer = [[str(n), *(f"{x:.1e}" for x in off(1e-3, n)), f"{over(1e-3, n).penetration:.0e}"] for n in SEGMENTS]
    sharp = [
        [f"{r:.0e}", *(f"{x:.1e}" for x in off(r, 40)), *(f"{x:.1e}" for x in off(r, 40, True))] for r in ROUNDINGS
    ]
    if max(off(1e-3, SEGMENTS[-1])) > 1e-2:
        raise AssertionError(f"{off(1e-3, SEGMENTS[-1])}")
    place, across, up = shot(0.0)
    oblique = []
    for degrees in OBLIQUE:
        found, wall = over(1e-3, 40, degrees), over(1e-3, 40, degrees).walls[0]
        ends = ", ".join(f"({s:.4f}, {v:+.4f})" for s, v in np.unique(wall.ends.round(6), axis=0))
        oblique.append([f"{degrees:g}", ends, *(f"{x:.3f}" for x in wall.force), f"{found.penetration:.0e}"])
    corner = over_corner(0.0)
    push, centre = corner.walls[0].force, np.asarray(corner.problem.walls[0].point)
    frame, where = (
        corner.continued(corner.walls[0].ends[:1, 0])[1][0],
        corner.continued(corner.walls[0].ends[:1, 0])[0][0],
    )
    aslant = float(np.linalg.norm(np.cross(push, frame[:, 1])) / np.linalg.norm(push))
    above = float(np.linalg.norm(where - centre - (0.1 - 2e-3) * np.sqrt(3.0) * np.array(UP)) - 2e-3)
    planes, between = ring(False), ring(True)
    pair = abs(between.energy.total - planes.energy.total)
    page.write(
        out / "edges.md", "Edges, corners and a box", "python -m tests.validation edges",
        "## Over the rim of a table",
        f"A strip (w/l = 0.05, Gamma = {GAMMA:g}, `wunderlich`) clamped level {BELOW:g} l above a table, {AWAY:g} l "
        f"before its rim, hangs over it. Shooting on the planar elastica, which shares nothing with them, has it "
        f"sharp at s = {place:.6f} l with a force of {across:.4f} across and {up:.4f} up. Off shooting with "
        "the same rounding, 1e-3 l:",
        page.table(["segments", "place / l", "force", "penetration / l"], finer),
        "## A sharp rim is the limit of a round one\n\n40 segments. Off shooting with the same rounding, "
        "and off that with a sharp rim:",
        page.table(["rounding / l", "place / l", "force", "place, sharp", "force, sharp"], sharp),
        "## Oblique",
        "The rim turned about the vertical, rounding 1e-3 l, 40 segments: where (s, v) it touches, and its force.",
        page.table(["degrees", "places / l", "x", "y", "z", "penetration / l"], oblique),
        f"Turned and shifted in space, its energy at 10 degrees differs by {abs(moved(False)):.0e}, mirrored by "
        f"{abs(moved(True)):.0e}.",
        "## Over a corner",
        "Over the corner of a cube that stands on the opposite one (side 0.2 l, rounding 2e-3 l): the strip is "
        f"{above:.0e} l off the round corner, and the force ({push[1]:.3f} up) is across it, to {aslant:.0e} rad.",
        "## A ring in a box",
        f"A ring of length l in a box of side {SIDE:g} l, whose faces are planes, beside the same between four planes: "
        f"the energies differ by {pair:.0e} D w / l (the ring may turn in itself: its joints stand elsewhere); "
        f"the box exerts {np.abs(planes.walls[0].force).max():.0e} D w / l^2 in all; penetration "
        f"{planes.penetration:.0e} l.",
    )  # fmt: skip
    own = over(1e-3, 40).walls[0]
    coarse = off(1e-3, 40)
    return {
        "place": Number(float(own.contacts[0]), max(coarse[0], 1e-6), "l", ".4f"),
        "place_shot": Number(shot(1e-3)[0], 1e-8, "l", ".5f"),
        "force_up": Number(float(own.force[1]), coarse[1], "D w / l^2", ".1f"),
        "place_off": Number(off(1e-3, SEGMENTS[-1])[0], 1e-5, "l", ".0e"),
        "force_off": Number(off(1e-3, SEGMENTS[-1])[1], 1e-2, "D w / l^2", ".0e"),
        "corner_up": Number(float(corner.walls[0].force[1]), 1e-3, "D w / l^2", ".2f"),
        "corner_aslant": Number(aslant, 1e-6, "rad", ".0e"),
        "ring_and_planes": Number(pair, 2e-3, "D w / l", ".0e"),
    }
