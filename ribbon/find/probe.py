"""Shapes from which another state between two clamps may be reached: cheap ones, asked after the built-in starts.

Two clamps that face each other nearly have symmetries, and a state of the strip has images under them: the bend to the
other side, the twist of the other hand, the strip read from its other end. With omega and tau = eta omega::

    mirrored (omega, -eta)    turned over (-omega, -eta)    the other side (-omega, eta)    and s -> 1 - s of each

Were the symmetry exact, an image would be a state of the same energy; where a clamp leans, the strip is curled or has
weight, it is a start beside a state of another energy, and half of the images need no other end: reading the strip
from its other end and turning it over both keep the hand of the twist. Half a turn of the end's frame more or less, of
either hand, is what arcs with rulings to either side begin with. Shapes at random (a committed draw) are the rest.

Nothing is fitted: the minimiser takes a shape to its clamps itself, where a fit (`ribbon.find.seeds.fitted`) takes as
long and forgets what the shape was. What this finds and what it costs is measured (results/rivals.md); that a state is
the lowest of those seen is no proof that it is the lowest.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ribbon.find import seeds
from ribbon.problems.mixed import MixedProblem
from ribbon.solvers.problem import FloatArray

Shape = tuple[FloatArray, FloatArray]

#: Rulings of arcs that begin with a twist.
_TURNED = 0.4
#: Shapes at random: how many, values along each, size of omega (1/l) and eta, and the draw.
RANDOM = 4
_VALUES, _BENT, _RULED, _DRAW = 4, 4.0, 0.4, 20261127
#: Greatest difference of omega (1/l) and eta up to which two shapes are the same start.
_SAME = 1e-6


def images(problem: MixedProblem, x: FloatArray, kept: bool = False) -> Iterator[Shape]:
    """omega and eta (p + 1,) of the images of the shape x; kept: only those with the twist's hand."""
    omega, eta = problem.joint_values(x)
    s = seeds.joints(problem.lengths)
    back = np.interp(1.0 - s, s, omega), np.interp(1.0 - s, s, eta)
    seen = [(omega, eta)]
    hands = [(-1.0, -1.0)] if kept else [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0)]
    for bent, ruled in (back, (omega, eta)):
        for side, hand in ([(1.0, 1.0)] if bent is back[0] else []) + hands:
            shape = side * bent, hand * ruled
            if all(_apart(shape, other) > _SAME for other in seen):
                seen.append(shape)
                yield shape


def _apart(one: Shape, other: Shape) -> float:
    return float(max(np.abs(one[0] - other[0]).max(), np.abs(one[1] - other[1]).max()))


def further(problem: MixedProblem) -> Iterator[Shape]:
    """omega and eta (p + 1,) of arcs that are twisted to either side, then of random shapes."""
    s = seeds.joints(problem.lengths)
    for omega, _ in seeds.guesses(problem)[2:]:
        for ruled in (_TURNED, -_TURNED):
            yield omega, seeds.held_straight(problem, np.full(s.size, ruled))
    rng = np.random.default_rng(_DRAW)
    knots = np.linspace(0.0, 1.0, _VALUES)
    for _ in range(RANDOM):
        bends = _BENT * rng.standard_normal(_VALUES)
        turns = np.clip(_RULED * rng.standard_normal(_VALUES), -1.0, 1.0)
        yield np.interp(s, knots, bends), seeds.held_straight(problem, np.interp(s, knots, turns))
