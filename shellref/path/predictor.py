"""Where the path will be at the next load, and how far to step.

An equilibrium gives u(t) and, by one more solve with the factors that found it, its rate u'(t). Nodal values are
extrapolated by the polynomial through what is known at t_0 and t_1 (docs/theory.md, eq. (7.17)): cubic with both rates,
quadratic with the later one, linear with none; along the rate where there is one point. Directors are brought back to
the sphere.

The stress at the Gauss points goes along a straight line: a rate that is known to 1e-4 makes membrane stresses (stiff
by (w/h)^2) that are wrong by far, and the first tangents then indefinite. From one point it goes along
sigma' = C T(u, u') - C k_nat'.

A predictor of order p (error h^p) that was off by e after a step h is off by `AIM` after h (AIM / e)^(1/p): den Heijer
& Rheinboldt (1981), doi:10.1137/0718024.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shellref.path.point import Walk
from shellref.shell.director import retract
from shellref.shell.naghdi import Stress

#: Largest component (positions in l, directors) by which a predictor may be off: about four Newton iterations.
AIM = 0.1
#: Largest component of a move that is nobody's concern.
SMALL = 1e-2
#: How many times further than the last step the next one may be foreseen to move.
FURTHER = 2.5


@dataclass(frozen=True)
class Predicted:
    """A predicted state (nodes, 6) with its stress; order p of its error h^p, 1: the last state as it is."""

    state: np.ndarray
    stress: Stress
    order: int


def predicted(walk: Walk, load: float) -> Predicted:
    """The state at a load of the present stage, from the walk's last points and their rates."""
    point, older = walk.point, walk.older
    if older is None or older.load == point.load:
        if point.rate is None:
            return Predicted(point.state, point.stress, 1)
        step = load - point.load
        sway, change = point.rate
        stress = Stress(point.stress.full + step * change.full, point.stress.reduced + step * change.reduced)
        return Predicted(retract(point.state, step * sway), stress, 2)
    h = point.load - older.load
    x = (load - point.load) / h
    chord, stress = point.state - older.state, point.stress.extrapolate(older.stress, x)
    if point.rate is None:
        return Predicted(retract(point.state, x * chord), stress, 2)
    late = h * point.rate[0]
    if older.rate is None:
        return Predicted(retract(point.state, x * late + x**2 * (late - chord)), stress, 3)
    third = h * older.rate[0] + late - 2.0 * chord
    return Predicted(retract(point.state, x * late + x**2 * (late - chord + third) + x**3 * third), stress, 4)


def jumped(moved: float, foreseen: float, order: int) -> bool:
    """Whether a state lies on another branch: it moved (largest components) more than twice as far as was foreseen."""
    return order > 1 and moved > max(SMALL, 2.0 * foreseen)


def hasty(foreseen: float, last: float, order: int) -> bool:
    """Whether a step is too long for what is foreseen: much further (largest components) than the last one moved. Near
    a limit point the extrapolated path runs away, and Newton's iteration from there finds the state beyond it."""
    return order > 2 and foreseen > max(SMALL, FURTHER * last)


def next_step(step: float, off: float, order: int, growth: float, cut: float) -> float:
    """The step after one whose predictor of this order was off by `off`; between cut and growth times as large."""
    if off <= 0.0:
        return growth * step
    return float(np.clip((AIM / off) ** (1.0 / order), cut, growth)) * step
