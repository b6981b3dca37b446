"""Whether a body that moves along a path went through a strip, from one state to the next (docs/theory.md, (5.9)).

Seen from the body a particle goes straight, from a place p before it to a place q. Along ``p + v (q - p)`` the gap of a
convex body is convex in v, with its least value where `Obstacle.nearest` says. A particle that slides round the body
cuts off some of it too, ever less in shorter steps (with their square); one that the body went through comes out with
the normal turned to the other side, however short the step is. So a body went through where the two normals look away
from each other and a particle was deeper in it than `_DEEP`, or than half its radius.

A plane and a room that a strip is in have no other side. A body that turns is not looked at.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ribbon.contact import Barrier
from ribbon.judge import nearness
from ribbon.obstacle import Obstacle
from ribbon.problems.mixed import MixedProblem
from ribbon.result import Equilibrium
from ribbon.solid import Face, Solid

#: Depth (l) in a body, and part of its radius, from which a particle went through it.
_DEEP, _SHARE = 0.01, 0.5
#: Particles on a segment and on a body's radius, at the least; most of them.
_EACH, _MOST = 4, 1000


def through(old: Equilibrium, new: Equilibrium) -> bool:
    """Whether a body went through the strip between two states of one strip, whose walls are the same or have moved."""
    one, other = old.problem, new.problem
    if not (isinstance(one, MixedProblem) and isinstance(other, MixedProblem)) or len(one.walls) != len(other.walls):
        return False
    return any(_went(one, old, other, new, k) for k, wall in enumerate(other.walls) if _has_sides(wall, one.walls[k]))


def _has_sides(wall: Barrier, before: Barrier) -> bool:
    """Whether a wall is a body seen from outside that did not turn."""
    if not isinstance(wall, Obstacle) or not isinstance(before, Obstacle) or isinstance(wall, Face) or wall.inside:
        return False
    if wall.kind != before.kind or not _alike(wall.axis, before.axis):
        return False
    return not (isinstance(wall, Solid) and isinstance(before, Solid)) or _alike(wall.normal, before.normal)


def _alike(one: ArrayLike | None, other: ArrayLike | None) -> bool:
    """Whether two directions of a body are the same, or both are not there."""
    if one is None or other is None:
        return one is other
    return np.array_equal(np.asarray(one), np.asarray(other))


def _thick(body: Obstacle) -> float:
    """How far a body reaches about its middle, at the least; an edge has none behind it."""
    if body.kind == "edge":
        return np.inf
    if isinstance(body, Solid) and body.size is not None:
        return 0.5 * float(np.min(np.asarray(body.size)))
    return body.radius


def _went(one: MixedProblem, old: Equilibrium, other: MixedProblem, new: Equilibrium, k: int) -> bool:
    length = other.strip.length
    before, body = one.walls[k].scaled(one.strip.length), other.walls[k].scaled(length)
    assert isinstance(body, Obstacle)
    thick = _thick(body)
    s = np.linspace(0.0, 1.0, int(min(_MOST, max(_EACH * other.lengths.size, _EACH / thick))) + 1)
    begin, end = nearness.shape(one, old.x, s), nearness.shape(other, new.x, s)
    moved = np.asarray(body.point) - np.asarray(before.point)
    for side in (-1.0, 0.0, 1.0):
        p = begin.r + side * one.reach * begin.ruling + moved
        q = end.r + side * other.reach * end.ruling
        away = np.sum(body.derivatives(p)[1] * body.derivatives(q)[1], axis=1) < 0.0
        middle, half = 0.5 * (p + q)[away], 0.5 * (q - p)[away]
        if not away.any():
            continue
        v = np.clip(body.nearest(middle, half), -1.0, 1.0)
        if float(body.gaps(middle + v[:, None] * half).min()) < -min(_DEEP, _SHARE * thick):
            return True
    return False
