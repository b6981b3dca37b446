"""Where a ribbon touches walls, obstacles and itself: its places in space with what pushes and rubs there."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.models.holds.ribbon import body_of, whole
from compare.store.touches import ITSELF, Touches
from ribbon import Equilibrium, Wall
from ribbon.contact import Barrier

FloatArray = NDArray[np.float64]

#: Points of a line of contact.
_ALONG = 80

Row = tuple[FloatArray, FloatArray, FloatArray, str]


def pushed(e: Equilibrium, ends: FloatArray) -> FloatArray:
    """Positions (m, 3) in l of ends (m, 2) of rulings; of a free twist, of its sections'."""
    r, frames, _, eta = e.continued(ends[:, 0])
    slope = np.zeros_like(eta) if e.has_free_twist else eta
    return np.asarray(r + ends[:, 1:] * (frames[:, :, 0] + slope[:, None] * frames[:, :, 2]))


def touches(e: Equilibrium, names: Sequence[str] | None = None) -> Touches:
    """All places where the ribbon touches, of pairs of its own both; names: of what it cannot cross, in the solver's
    order (None: their numbers). Pushes act along the normals of what is touched, friction along it."""
    problem: Any = e.problem
    held = () if problem.formulation == "chained" else whole(problem.walls)
    known = e.walls if len(e.walls) == len(held) else ()
    rows: list[Row] = []
    for number, (barrier, wall) in enumerate(zip(held, known, strict=False)):
        name = str(number) if names is None or len(names) != len(known) else names[number]
        rows += _of_wall(e, barrier, wall, name)
    return Touches.of([*rows, *_of_itself(e)])


def lines(e: Equilibrium) -> list[FloatArray]:
    """Where walls and obstacles push in one piece: the lines (k, 3), in l, on either side of the centreline
    through what is pushed there."""
    found = []
    for wall in e.walls:
        ends = np.asarray(wall.ends, dtype=float).reshape(-1, 2)
        for first, last in np.asarray(wall.lines).reshape(-1, 2):
            for side in (-1.0, 0.0, 1.0):
                own = ends[(ends[:, 0] >= first) & (ends[:, 0] <= last) & (np.sign(ends[:, 1]) == side)]
                own = own[np.argsort(own[:, 0])]
                if len(own) > 1:
                    s = np.linspace(own[0, 0], own[-1, 0], _ALONG)
                    found.append(pushed(e, np.column_stack([s, np.interp(s, own[:, 0], own[:, 1])])))
    return found


def _of_wall(e: Equilibrium, barrier: Barrier, wall: Any, name: str) -> Iterator[Row]:
    points = pushed(e, np.asarray(wall.ends, dtype=float).reshape(-1, 2))
    if isinstance(barrier, Wall):
        normals = np.broadcast_to(np.asarray(barrier.normal, dtype=float), points.shape)
    else:
        normals = body_of(barrier.scaled(e.problem.strip.length)).facing(points)[1] if len(points) else points
    rubs = {(round(rub.s, 6), round(rub.v, 6)): rub for rub in wall.rubs}
    for end, point, normal, push in zip(wall.ends, points, normals, wall.pushes, strict=True):
        rub = rubs.pop((round(float(end[0]), 6), round(float(end[1]), 6)), None)
        yield point, push * normal, np.zeros(3) if rub is None else rub.friction, name
    for rub in rubs.values():  # at another particle than those that are pushed
        yield rub.point, np.zeros(3), rub.friction, name


def _of_itself(e: Equilibrium) -> Iterator[Row]:
    pairs, none = e.pairs, np.zeros(3)
    if not pairs:
        return
    material = np.array([[(pair.s, pair.v), (pair.s_other, pair.v_other)] for pair in pairs])
    places = np.asarray(e.rulings(material.reshape(-1, 2))[1]).reshape(-1, 2, 3)
    for pair, (one, other) in zip(pairs, places, strict=True):
        yield one, np.asarray(pair.force), none, ITSELF
        yield other, -np.asarray(pair.force), none, ITSELF
