"""Strips over edges and corners of bodies."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from compare.battery.case import Case, Check, Rung
from compare.battery.cases.contact import UP, checks, moments
from ribbon import Clamp, Equilibrium, Gravity, Strip, solve
from ribbon.obstacle import Obstacle
from ribbon.solid import Solid

#: How far below the clamp and away from it the edge stands, l; weight; time for a solve, s.
BELOW, AWAY, GAMMA, BUDGET = 0.1, 0.6, 5.0, 60.0


def _over(body: Obstacle) -> Equilibrium:
    strip = Strip(1.0, 0.1, 0.3, gamma=GAMMA)
    return solve(strip, Clamp(), Gravity(UP), walls=[body], segments=40, budget=BUDGET)


def _judged(body: Obstacle) -> Iterator[Check]:
    found = _over(body)
    yield from checks(found, GAMMA)
    if found.ok:
        yield moments(found, GAMMA)


def edge(rounding: float, degrees: float = 0.0) -> Solid:
    """The rim of a table that stands on the clamp's side; degrees: from across the strip."""
    turn = math.radians(degrees)
    axis = (math.cos(turn), 0.0, math.sin(turn))
    return Solid("edge", (0.0, -BELOW, AWAY), rounding, axis, normal=UP)


def corner(rounding: float, degrees: float) -> Solid:
    """A box, level, whose corner points at the clamp from under the middle of the strip; degrees: of one of its sides
    from across the strip."""
    turn = math.radians(degrees)
    axis = np.array([math.cos(turn), 0.0, math.sin(turn)])
    third = np.cross(axis, UP)
    sides = np.array([0.4, 0.2, 0.4])
    away = math.copysign(1.0, third[2])
    point = np.array([0.0, -BELOW - 0.5 * sides[1], AWAY]) + 0.5 * (sides[0] * axis + away * sides[2] * third)
    return Solid("box", tuple(point), rounding, tuple(axis), normal=UP, size=tuple(sides))


def _sharp(rung: Rung) -> Iterator[Check]:
    yield from _judged(edge(float(rung)))


def _oblique(rung: Rung) -> Iterator[Check]:
    yield from _judged(edge(1e-3, float(rung)))


def _corner(rung: Rung) -> Iterator[Check]:
    yield from _judged(corner(1e-3, float(rung)))


def _sharp_corner(rung: Rung) -> Iterator[Check]:
    yield from _judged(corner(float(rung), 45.0))


CASES: tuple[Case, ...] = (
    Case(
        "touching/rim_of_a_table",
        "a heavy cantilever (Gamma = 5) over the rim of a table, ever sharper: where it touches slides over an arc "
        "that is thin beside a segment (0.025 l)",
        "forces and moments balance; nothing is in the table by more than 1e-6 l",
        "rounding of the rim / l",
        _sharp,
        (3e-2, 1e-2, 1e-3),
        (3e-3, 1e-4),
    ),
    Case(
        "touching/oblique_rim",
        "the same over a rim (rounding 1e-3 l) that is turned from across the strip: it touches at one edge and twists",
        "forces and moments balance; nothing is in the table by more than 1e-6 l",
        "turn, degrees",
        _oblique,
        (0.0,),
        (10.0, 30.0, 45.0, 60.0),
    ),
    Case(
        "touching/corner_of_a_box",
        "the same on a box (rounding 1e-3 l) whose corner stands under the strip's middle: one place between its edges "
        "or a line along half its width",
        "forces and moments balance; nothing is in the box by more than 1e-6 l",
        "one side of the box from across the strip, degrees",
        _corner,
        (45.0,),
        (30.0, 10.0, 3.0, 0.0),
    ),
    Case(
        "touching/sharp_corner",
        "the same on a corner at 45 degrees, ever sharper",
        "forces and moments balance; nothing is in the box by more than 1e-6 l",
        "rounding / l",
        _sharp_corner,
        (1e-2,),
        (1e-3, 1e-4),
    ),
)
