"""Whether a body that moves or turns along a path went through a strip between two states (docs/theory.md, (5.9)).

Seen from the body a particle goes straight, from a place p before it to a place q. Along ``p + v (q - p)`` the gap of a
convex body is convex in v, with its least value where `Obstacle.nearest` says. A particle that slides round the body
cuts off some of it too, ever less in shorter steps (with their square); one that the body went through comes out with
the normal turned to the other side, however short the step is. So a body went through where the two normals look away
from each other and a particle was deeper in it than `_DEEP`, or than half its radius.

A plane and a room that a strip is in have no other side.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ribbon.contact import Barrier
from ribbon.judge import nearness
from ribbon.obstacle import Obstacle, cross_matrix
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.problems.strips.problem import StripsProblem
from ribbon.solid import Face, Solid

FloatArray = NDArray[np.float64]

#: Depth (l) in a body, and part of its radius, from which a particle went through it.
_DEEP, _SHARE = 0.01, 0.5
#: Particles on a segment and on a body's radius, at the least; most of them.
_EACH, _MOST = 4, 1000


def through(one: Problem, x: FloatArray, other: Problem, y: FloatArray) -> bool:
    """Whether a body went through a strip from the unknowns x (n,) of `one` to y (m,) of `other`, the same strip, whose
    walls are the same or have moved."""
    if not (isinstance(one, MixedProblem) and isinstance(other, MixedProblem)) or len(one.walls) != len(other.walls):
        return False
    return any(_went(one, x, other, y, k) for k, wall in enumerate(other.walls) if _has_sides(wall, one.walls[k]))


def through_strips(one: StripsProblem, x: FloatArray, other: StripsProblem, y: FloatArray) -> bool:
    """As `through`, of several strips."""
    pairs = enumerate(zip(one.parts, other.parts, strict=True))
    return any(through(part, one.own(x, k), after, other.own(y, k)) for k, (part, after) in pairs)


def _has_sides(wall: Barrier, before: Barrier) -> bool:
    """Whether a wall is a body seen from outside."""
    if not isinstance(wall, Obstacle) or not isinstance(before, Obstacle) or isinstance(wall, Face) or wall.inside:
        return False
    return wall.kind == before.kind


def turned(before: Obstacle, body: Obstacle) -> FloatArray:
    """The rotation (3, 3) that takes what is fixed to a body from where it was to where it is: of a box or an edge that
    of its frame, of a cylinder the shortest one of its axis, of a sphere none."""
    if isinstance(before, Solid) and isinstance(body, Solid):
        return np.asarray(body.frame.T @ before.frame)
    if before.axis is None or body.axis is None:
        return np.eye(3)
    one, two = np.asarray(before.axis), np.asarray(body.axis)
    two = two if one @ two >= 0.0 else -two  # an axis is a line
    cross = cross_matrix(np.cross(one, two))
    return np.asarray(np.eye(3) + cross + cross @ cross / (1.0 + one @ two))


def _thick(body: Obstacle) -> float:
    """How far a body reaches about its middle, at the least; an edge has none behind it."""
    if body.kind == "edge":
        return np.inf
    if isinstance(body, Solid) and body.size is not None:
        return 0.5 * float(np.min(np.asarray(body.size)))
    return body.radius


def _went(one: MixedProblem, x: FloatArray, other: MixedProblem, y: FloatArray, k: int) -> bool:
    length = other.strip.length
    before, body = one.walls[k].scaled(one.strip.length), other.walls[k].scaled(length)
    assert isinstance(before, Obstacle)
    assert isinstance(body, Obstacle)
    thick = _thick(body)
    s = np.linspace(0.0, 1.0, int(min(_MOST, max(_EACH * other.lengths.size, _EACH / thick))) + 1)
    begin, end = nearness.shape(one, x, s), nearness.shape(other, y, s)
    turn = turned(before, body)
    for side in (-1.0, 0.0, 1.0):
        p = (begin.r + side * one.reach * begin.ruling - np.asarray(before.point)) @ turn.T + np.asarray(body.point)
        q = end.r + side * other.reach * end.ruling
        away = np.sum(body.derivatives(p)[1] * body.derivatives(q)[1], axis=1) < 0.0
        middle, half = 0.5 * (p + q)[away], 0.5 * (q - p)[away]
        if not away.any():
            continue
        v = np.clip(body.nearest(middle, half), -1.0, 1.0)
        if float(body.gaps(middle + v[:, None] * half).min()) < -min(_DEEP, _SHARE * thick):
            return True
    return False
