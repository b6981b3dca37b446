"""A chained problem solved on few segments first: every doubling then takes Newton's method a few steps.

The shapes nest: what is linear on a segment is linear on its halves. The error falls with the fourth power of the
length of the segments where nothing sudden happens, so that how far the joints move in the last doubling is more than
what is still missing (`Minimum.moved`) wherever halving the segments at least halves the error.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbon.find import doubling
from ribbon.judge.inertia import Pencil
from ribbon.problems import prolonged, transfer
from ribbon.problems.chained import ChainedProblem
from ribbon.solvers import choose
from ribbon.solvers.problem import RESIDUAL_TOLERANCE, Minimum

FloatArray = NDArray[np.float64]

#: Segments that are few: not joined any more.
FEWEST = 40


def minimum(
    problem: ChainedProblem,
    x: FloatArray,
    options: dict[str, Any] | None = None,
    progress: Callable[[int, float, float], None] | None = None,
    rough: bool = False,
) -> Minimum:
    """Stationary point from x (n,), over fewer segments where there are many and the solver is Newton's.

    rough: a start for another only. Where the one on fewer segments is none, or a saddle,
    the problem is solved from x itself; so it is where what the doublings led to has more energy than x or than the
    one on fewer segments: of both the lower is returned.
    """
    if problem.lengths.size < 2 * FEWEST or not choose.by_recursion(problem, options):
        return choose.minimise(problem, x, options, progress, rough=rough)
    few = problem.with_changes(lengths=transfer.merged(problem.lengths))
    first = minimum(few, transfer.on_joints(problem, x, few), options, progress, rough=True)
    problem.counters.add(few.counters)
    if not first.residual <= RESIDUAL_TOLERANCE or not _is_minimum(few, first):
        return choose.minimise(problem, x, options, progress, rough=rough)
    start = transfer.on_joints(few, first.x, problem)
    near = prolonged.fields(few, first.x, problem)
    point = choose.minimise(problem, near, options, progress, near=True, rough=rough)
    if doubling.above(problem, point.x, start, x):
        other = choose.minimise(problem, x, options, progress, rough=rough)
        if not doubling.above(problem, other.x, point.x):
            return other
    there, here = few.joints(first.x)[0], problem.joints(point.x)[0]
    kept = np.minimum(2 * np.arange(len(there)), len(here) - 1)
    return replace(
        point, iterations=point.iterations + first.iterations, seconds=point.seconds + first.seconds,
        moved=float(np.linalg.norm(there - here[kept], axis=1).max()),
    )  # fmt: skip


def _is_minimum(problem: ChainedProblem, point: Minimum) -> bool:
    lower, upper = problem.bounds()
    return Pencil(problem, point.x, (point.multipliers != 0.0) | (lower == upper)).below(0.0) == 0
