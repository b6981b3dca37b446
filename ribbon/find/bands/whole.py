"""Starting shapes of closed bands: a circle, and the way from it to a Moebius band (thesis, 6.1.1, algorithm 2).

The circle is clamped at both ends, at the same place, and the frame of its end is turned about the tangent by half a
turn in a few steps, each started from the last; then the clamps are replaced by the seam. The ruling is held straight
at the clamps on the way, which pins the Wunderlich event to the seam. A small twist breaks the symmetry of the circle.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ribbon import law
from ribbon.boundary import Clamp
from ribbon.find import relax
from ribbon.find.seeds import joints
from ribbon.problems import transfer
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.solvers import choose
from ribbon.solvers.budget import spent
from ribbon.solvers.problem import RESIDUAL_TOLERANCE

FloatArray = NDArray[np.float64]
Progress = Callable[[int, float, float], None]

#: Steps of the half turn; doubled where one fails, up to the second number.
TURN_STEPS = 6
MOST_STEPS = 48
#: Segments on which the way is gone at the most.
MOST_SEGMENTS = 120
#: eta of the twist that breaks the circle's symmetry.
_TWIST = 1e-2
_ITERATIONS = 300
#: w / l from which a Moebius band is made wider step by step, and the steps.
WIDE, _WIDER = 0.45, 0.02


def circle(problem: Problem) -> tuple[FloatArray, FloatArray]:
    """omega and eta (p + 1,) of a circle of the closure's turns, bent the way of the natural curvature, if any."""
    turns = problem.closure.turns if problem.closure is not None else 1
    natural = sum(law.values(problem.strip.curvature))
    omega = math.copysign(2.0 * math.pi * turns, natural) if natural else -2.0 * math.pi * turns
    count = problem.lengths.size + 1
    return np.full(count, omega), np.zeros(count)


def moebius(problem: MixedProblem, progress: Progress | None = None) -> tuple[FloatArray, FloatArray]:
    """omega and eta (p + 1,) of a weightless Moebius band with a straight ruling at the seam, near its equilibrium."""
    lengths = problem.lengths
    while lengths.size > MOST_SEGMENTS:
        lengths = transfer.merged(lengths)
    coarse = problem.with_changes(lengths=lengths)
    if problem.strip.relative_width > WIDE:
        wide = _widened(coarse, progress)
        if wide is not None:
            s, there = joints(lengths), joints(problem.lengths)
            return np.interp(there, s, wide[0]), np.interp(there, s, wide[1])
    steps = TURN_STEPS
    while True:
        shape = _turned(coarse, steps, progress)
        if shape is not None or steps >= MOST_STEPS or spent():
            break
        steps *= 2
    if shape is None:
        return circle(problem)
    s, there = joints(lengths), joints(problem.lengths)
    return np.interp(there, s, shape[0]), np.interp(there, s, shape[1])


def _widened(problem: MixedProblem, progress: Progress | None) -> tuple[FloatArray, FloatArray] | None:
    """A wide band from one of width WIDE, step by step wider: its rulings nearly cross, which no turning end finds."""
    last = problem.strip.relative_width
    widths = [*np.arange(WIDE, last - 0.5 * _WIDER, _WIDER), last]

    def of(width: float) -> MixedProblem:
        strip = replace(problem.strip, width=float(width) * problem.strip.length)
        return problem.with_changes(strip=strip, walls=(), gravity=None)

    current = of(widths[0])
    shape = _turned(current, TURN_STEPS, progress)
    if shape is None:
        return None
    for before, width in pairwise(widths):
        if spent():
            return None
        current = of(width)
        # slopes of rulings keep their distance from the bound 2 / w
        point = relax.from_near(current, current.state(shape[0], shape[1] * (before / width)), None, progress)
        if point.residual > RESIDUAL_TOLERANCE:
            return None
        shape = current.joint_values(point.x)
    return shape


def _turned(problem: MixedProblem, steps: int, progress: Progress | None) -> tuple[FloatArray, FloatArray] | None:
    start = Clamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), "straight")
    x: FloatArray | None = None
    current = problem
    for k in range(1, steps + 1):
        angle = math.pi * k / steps
        end = Clamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (-math.sin(angle), math.cos(angle), 0.0), "straight")
        current = problem.with_changes(start=start, end=end, closure=None, walls=(), gravity=None, box=None)
        if x is None:
            omega, _ = circle(problem)
            x = current.state(omega, _TWIST * np.sin(2.0 * math.pi * joints(problem.lengths)))
        point = choose.minimise(current, x, {"mu_init": 1e-3, "max_iter": _ITERATIONS}, progress)
        problem.counters.add(current.counters)
        if point.residual > RESIDUAL_TOLERANCE or spent():
            return None
        x = point.x
    assert x is not None
    return transfer.resample(current, x, problem.lengths)
