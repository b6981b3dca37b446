"""Walls, from touching to crushing."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from compare.battery.case import Case, Check, Rung, holds, near
from compare.battery.judge.ribbon import judged
from ribbon import Clamp, Closure, Gravity, Strip, Wall, solve
from ribbon.obstacle import Obstacle

if TYPE_CHECKING:
    from ribbon import Equilibrium

UP = (0.0, 1.0, 0.0)
#: Furthest (l) that a strip may be beyond a wall, as the docs state it.
PENETRATION = 1e-6
#: Furthest that the judge's number may be beyond the answer's own (l), and forces from balance, relative.
SAID, BALANCE = 1e-7, 1e-7
#: Time for a solve, s: more than any of the quick part takes.
BUDGET = 60.0


def _floor(height: float) -> Wall:
    return Wall((0.0, -height, 0.0), UP)


def _roof(height: float) -> Wall:
    return Wall((0.0, height, 0.0), (0.0, -1.0, 0.0))


def checks(equilibrium: Equilibrium, weight: float = 0.0) -> Iterator[Check]:
    """An equilibrium that stays on its walls' side, says how far it does, and whose supports carry its weight."""
    yield holds(
        "converged", equilibrium.status.code == "converged", f"{equilibrium.status.code}: {equilibrium.message}"
    )
    own = judged(equilibrium, spectrum=False)
    yield from own
    measured = next((check.value for check in own if check.what.startswith("penetration")), np.inf)
    told = np.nan if equilibrium.penetration is None else equilibrium.penetration
    yield Check("penetration beyond the one said (l)", measured - told, SAID, said=f"{told:.3g}")  # it samples
    if equilibrium.ok:
        assert equilibrium.start is not None  # determined: the strip is not stretched
        held = equilibrium.start.force + sum(wall.force for wall in equilibrium.walls)
        if equilibrium.end_support is not None:
            held = held + equilibrium.end_support.force
        size = max(1.0, weight, max(float(np.abs(wall.force).max()) for wall in equilibrium.walls))
        off = float(np.abs(held - weight * np.array(UP)).max()) / size
        yield Check("supports do not carry the weight, relative to the largest force", off, BALANCE)


def _level(height: float, gamma: float, segments: int = 40) -> Equilibrium:
    return solve(
        Strip(1.0, 0.05, gamma=gamma), Clamp(), Gravity(UP), walls=[_floor(height)], segments=segments, budget=BUDGET
    )


def _on_table(rung: Rung) -> Iterator[Check]:
    """Level on a table at its own height: straight, its whole weight on the table but what the clamp carries."""
    found = _level(float(rung), 1e5)
    yield from checks(found, 1e5)
    if float(rung) <= 1e-12:
        yield near("energy", found.energy.total, -1e5 * float(rung), 1e-6)


def _heavy(rung: Rung) -> Iterator[Check]:
    yield from checks(_level(0.1, float(rung)), float(rung))


def _between(floor: float, roof: float, segments: int, apart: float = 0.9) -> Equilibrium:
    free = {"ruling": "free"}
    return solve(
        Strip(1.0, 0.2, 0.5, gamma=10.0), Clamp(**free), Gravity(UP), end=Clamp((0.0, 0.0, apart), **free),
        walls=[_floor(floor), _roof(roof)], segments=segments, seed_curvature=(-8.0, 8.0, 8.0, -8.0), budget=BUDGET,
    )  # fmt: skip


def _floor_below(rung: Rung) -> Iterator[Check]:
    yield from checks(_between(float(rung), 0.18, 36), 10.0)


def _pressed(rung: Rung) -> Iterator[Check]:
    yield from checks(_between(1e-6, float(rung), 120), 10.0)


def _ring(gap: float, sides: int, segments: int = 40) -> Equilibrium:
    normals = ((0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0))[:sides]
    walls = [Wall(tuple(-0.5 * gap * np.array(normal)), normal) for normal in normals]
    return solve(Strip(1.0, 0.05), closure=Closure("circle"), walls=walls, segments=segments, budget=BUDGET)


def _crushed(rung: Rung) -> Iterator[Check]:
    yield from checks(_ring(float(rung), 2))


def _boxed(rung: Rung) -> Iterator[Check]:
    yield from checks(_ring(float(rung), 4))


def _over(obstacle: Obstacle, gamma: float = 20.0, segments: int = 40) -> Equilibrium:
    return solve(Strip(1.0, 0.1, 0.3, gamma=gamma), Clamp(), Gravity(UP), walls=[obstacle], segments=segments,
                 budget=BUDGET)  # fmt: skip


def moments(equilibrium: Equilibrium, gamma: float) -> Check:
    """About the origin: of the clamp there, the obstacles and the weight, whose centre is the centreline's."""
    assert equilibrium.start is not None
    nodes, weights = np.polynomial.legendre.leggauss(6)
    joints = np.concatenate([[0.0], np.cumsum(equilibrium.problem.lengths)])
    steps = np.diff(joints)
    s = (joints[:-1, None] + 0.5 * steps[:, None] * (nodes + 1.0)).ravel()
    centre = (0.5 * steps[:, None] * weights).ravel() @ equilibrium.position(s)
    found = equilibrium.start.moment + np.cross(centre, -gamma * np.array(UP))
    for wall in equilibrium.walls:
        found = found + (0.0 if wall.moment is None else wall.moment)
    return Check("moments are not in balance, D w / l", float(np.abs(found).max()) / max(1.0, gamma), BALANCE)


def _large(rung: Rung) -> Iterator[Check]:
    radius = float(rung)
    found = _over(Obstacle("cylinder", (0.0, -0.1 - radius, 0.0), radius, (1.0, 0.0, 0.0)))
    yield from checks(found, 20.0)
    yield moments(found, 20.0)
    plane = solve(Strip(1.0, 0.1, 0.3, gamma=20.0), Clamp(), Gravity(UP), walls=[_floor(0.1)], segments=40)
    yield Check("energy from the plane's, times the radius", abs(found.energy.total - plane.energy.total) * radius, 4.0)


def _small(rung: Rung) -> Iterator[Check]:
    radius = float(rung)
    found = _over(Obstacle("cylinder", (0.0, -0.1 - radius, 0.6), radius, (1.0, 0.0, 0.0)))
    yield from checks(found, 20.0)
    yield moments(found, 20.0)


def _ball(rung: Rung) -> Iterator[Check]:
    """On a ball aside of the middle; beyond the edge by less than its radius it touches the edge."""
    found = _over(Obstacle("sphere", (0.05 * float(rung), -0.2, 0.6), 0.1))
    yield from checks(found, 20.0)
    yield moments(found, 20.0)


def _coil(rung: Rung) -> Iterator[Check]:
    """In a tube: one end and the arc from the clamp on touch."""
    radius = 1.0 / (2.0 + 2.08889045)
    tube = Obstacle("cylinder", (0.0, 0.0, 0.0), radius, (1.0, 0.0, 0.0), inside=True)
    found = solve(
        Strip(1.0, 0.05, 0.3), Clamp((0.0, -radius, 0.0), normal=UP), walls=[tube], energy="sadowsky",
        segments=int(rung), seed_curvature=-1.0 / radius, formulation="mixed", budget=BUDGET,
    )  # fmt: skip
    yield from checks(found)
    outwards = np.asarray(found.end.position) / radius
    touchdown = np.degrees(np.arcsin(abs(float(np.asarray(found.end.frame)[:, 2] @ outwards))))
    yield near("touchdown angle, degrees", float(touchdown), 24.117, 0.1)


_COARSE = "folds narrower than the segments: it ends not converged, and says how far the strip is beyond the wall"

CASES: tuple[Case, ...] = (
    Case(
        "contact/level_on_its_table",
        "a heavy strip (Gamma = 1e5, 40 segments) held level at the height of its table or a little above: all of it "
        "touches, every segment would sag in like a beam on two supports (1.6e-4 l), and there is hardly a gap",
        "it lies straight; at height 0 its energy is 0; nothing is beyond the table by more than 1e-6 l",
        "height above the table / l",
        _on_table,
        (0.0, 1e-12, 1e-6, 1e-3),
    ),
    Case(
        "contact/heavy_on_a_table",
        "a strip held 0.1 l above a table, ever heavier: it lands in a layer shorter than a segment and sags between "
        "joints (5e-4 l at Gamma = 1e5)",
        "nothing is beyond the table by more than 1e-6 l; clamp and table carry the weight",
        "Gamma",
        _heavy,
        (10.0, 1e3),
        (1e5, 1e6, 1e7),
        {1e7: "its layer of 3e-4 l on segments of 0.025 l: it ends not converged, and says how deep the strip sags in"},
    ),
    Case(
        "contact/floor_at_the_clamps",
        "an arch under a roof whose two clamps stand on the floor: the rows of the clamped joints have no room",
        "the same arch as with the floor 1e-6 l lower: the floor carries nothing but what lies beside the clamps",
        "depth of the floor under the clamps / l",
        _floor_below,
        (1e-6,),
        (1e-3, 1e-9, 1e-12, 0.0),
    ),
    Case(
        "contact/pressed_by_a_roof",
        "Roman's strip (0.1 l short) between floor and roof: from one line that touches to folds (120 segments)",
        "nothing is beyond a wall by more than 1e-6 l, between joints too; clamps and walls carry the weight",
        "height of the roof / l",
        _pressed,
        (0.185,),
        (0.15, 0.1, 0.05, 0.02, 0.005, 0.0005),
        {0.02: _COARSE, 0.005: _COARSE, 0.0005: _COARSE},
    ),
    Case(
        "contact/crushed_ring",
        "a ring (diameter 0.318 l) between two plates, to 1 % of its diameter: flats and two folds of half the gap",
        "nothing is beyond a plate by more than 1e-6 l; the two forces are one",
        "gap / l",
        _crushed,
        (0.31, 0.1),
        (0.25, 0.03, 0.01, 0.00318),
        {0.00318: "a fold of 0.0016 l on segments of 0.025 l: " + _COARSE},
    ),
    Case(
        "contact/ring_in_a_box",
        "a ring in a square box; at 0.25 l it would be the square itself",
        "nothing is beyond a side by more than 1e-6 l; opposite forces are equal",
        "side of the box / l",
        _boxed,
        (0.31,),
        (0.28, 0.26),
    ),
    Case(
        "contact/cylinder_to_plane",
        "a heavy cantilever (Gamma = 20) on a cylinder in the place of a plane 0.1 l below, ever flatter",
        "forces and moments balance; its energy is the plane's but for what falls with the radius",
        "radius / l",
        _large,
        (1e5,),
        (1e4, 1e2, 10.0),
    ),
    Case(
        "contact/over_a_bar",
        "a heavy cantilever over a bar across, ever thinner: where it touches slides along the strip",
        "forces and moments balance; nothing is in the bar by more than 1e-6 l",
        "radius / l",
        _small,
        (0.1,),
        (0.3, 0.03, 0.01),
    ),
    Case(
        "contact/over_a_ball",
        "a heavy cantilever over a ball of radius 0.1 l, under its middle, aside of it and at its edge",
        "forces and moments balance; nothing is in the ball by more than 1e-6 l, between the edges too",
        "place across / half widths",
        _ball,
        (0.0,),
        (0.4, 0.8, 1.0),
    ),
    Case(
        "contact/coil_in_a_tube",
        "a strip along the wall of a tube whose free end comes back to it: from a few points that touch to a hundred",
        "it touches down at 24.1 degrees on all segments; forces balance",
        "segments",
        _coil,
        (40.0,),
        (20.0, 120.0),
    ),
)
