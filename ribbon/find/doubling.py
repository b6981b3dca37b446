"""A mixed problem of many segments from its state on few: every doubling takes a few steps along the strip.

The state on half the segments is prolonged with its multipliers (`ribbon.problems.prolonged`) and followed
(`ribbon.solvers.newton_near`). That is done only where it is safe: Newton's iteration is asked for, nothing is in
contact, and each state is a strict minimum near that before; a doubling that does not end so is made with a barrier and
a line search, and where that leads far away, or up, nothing is returned and the search is made as without. How far the
joints move in the last doubling is more than what is still missing wherever halving the segments at least halves the
error (`Minimum.moved`, as `ribbon.find.nested` has it for chained ribbons).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from ribbon import law
from ribbon.problems import prolonged
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.problems.transfer import merged
from ribbon.solvers import choose
from ribbon.solvers.newton_near import minimum_near
from ribbon.solvers.problem import Minimum, kkt_residual

FloatArray = NDArray[np.float64]

#: Segments that are few: a ribbon of four times as many, or more, is solved on so many at least and then halved.
FEWEST = 80
#: How far (l) joints may move in a doubling, and rulings turn beyond the steepest before.
NEAR = 0.02
_TURNS = 1.0
#: Barrier of a doubling that takes more.
_BARRIER = 1e-5
#: Distance (l) between joints that are the same.
_ROUNDING = 1e-12
#: Difference of energies, relative (at least 1), up to which they are the same, by one rule and by those of two sets of
#: segments.
_SAME, _HIGHER = 1e-6, 1e-4
#: Residual of a state that is a start for another only, and of one that is exact.
ROUGH, EXACT = 1e-6, 1e-10


def is_possible(problem: Problem, options: dict[str, Any] | None) -> TypeGuard[MixedProblem]:
    """Whether states of the problem can be followed from few segments to many."""
    return (
        isinstance(problem, MixedProblem)
        and problem.formulation == "mixed"
        and not problem.walls
        and not problem.apart
        and not any(map(law.is_table, problem.strip.rest))  # whose points end segments, few ones too
        and not options
        and choose.asked() != "ipopt"
    )


def few(problem: MixedProblem) -> MixedProblem:
    """The problem on few segments, in which its own nest."""
    lengths = problem.lengths
    while lengths.size >= 2 * FEWEST:
        lengths = merged(lengths)
    return problem.with_changes(lengths=lengths)


def doubled(coarse: MixedProblem, minimum: Minimum, problem: MixedProblem, rough: bool = False) -> Minimum | None:
    """The minimum of `problem` beside that of `coarse`, whose segments its own are cut from; `moved`: their joints."""
    x = prolonged.shape(coarse, minimum.x, problem)
    if not np.all(np.isfinite(x)):
        return None
    rows = prolonged.multipliers(coarse, minimum.rows, problem, x)
    fine = minimum_near(problem, x, rows, ROUGH if rough else EXACT)
    if fine is None or _higher(coarse, minimum, problem, fine):
        return None
    moved = _moved(coarse, minimum, problem, fine)
    if moved is None:
        return None
    residual = fine.residual if rough else kkt_residual(problem, fine.x, fine.multipliers, fine.rows)
    return replace(
        fine, iterations=fine.iterations + minimum.iterations, seconds=fine.seconds + minimum.seconds, moved=moved,
        residual=residual,
    )  # fmt: skip


def nested(coarse: MixedProblem, problem: MixedProblem) -> bool:
    """Whether the joints of `coarse` are joints of `problem`."""
    s, t = prolonged.joints(problem.lengths), prolonged.joints(coarse.lengths)
    beside = np.clip(np.searchsorted(s, t), 1, s.size - 1)
    return bool(np.minimum(np.abs(s[beside] - t), np.abs(s[beside - 1] - t)).max() <= _ROUNDING)


def by_doublings(coarse: MixedProblem, minimum: Minimum, problem: MixedProblem) -> Minimum | None:
    """The minimum of `problem` above that of `coarse`, which nests in it, by doublings where those lead there."""
    steps = [problem.lengths]
    while steps[-1].size >= 2 * coarse.lengths.size:
        steps.append(merged(steps[-1]))
    if steps[-1].size != coarse.lengths.size or not np.allclose(steps[-1], coarse.lengths, rtol=0.0, atol=_ROUNDING):
        steps = [problem.lengths, coarse.lengths]
    last = minimum
    for lengths in reversed(steps[:-1]):
        fine = problem if lengths is problem.lengths else problem.with_changes(lengths=lengths)
        above = doubled(coarse, last, fine, rough=fine is not problem)
        above = _relaxed(coarse, last, fine) if above is None else above
        if fine is not problem:
            problem.counters.add(fine.counters)
        if above is None:
            return None
        coarse, last = fine, above
    return last


def _relaxed(coarse: MixedProblem, minimum: Minimum, problem: MixedProblem) -> Minimum | None:
    """As `doubled`, by Newton's iteration with its barrier and its line search: while segments are few rulings may
    turn far in a doubling."""
    fine = choose.minimise(problem, prolonged.shape(coarse, minimum.x, problem), {"mu_init": _BARRIER})
    moved = _moved(coarse, minimum, problem, fine)
    if not fine.finished or moved is None or _higher(coarse, minimum, problem, fine):
        return None
    return replace(
        fine, iterations=fine.iterations + minimum.iterations, seconds=fine.seconds + minimum.seconds, moved=moved
    )


def above(problem: Problem, x: FloatArray, *starts: FloatArray) -> bool:
    """Whether a minimum x (n,) has clearly more energy than one of the shapes `starts` (n,), a coarser one's, say.

    The shapes nest, and a minimiser goes down: x is then another state than that which it began beside."""
    here, known = problem.value(x), (problem.value(start) for start in starts)
    return any(bool(np.isfinite(there) and here > there + _SAME * max(1.0, abs(there))) for there in known)


def _higher(coarse: MixedProblem, minimum: Minimum, problem: MixedProblem, fine: Minimum) -> bool:
    """Whether the finer minimum has clearly more energy than the coarse one, which its segments contain: another one.

    The rules of both differ where rulings are steep, so that this is coarser than `above`."""
    there = coarse.value(minimum.x)
    return bool(problem.value(fine.x) > there + _HIGHER * max(1.0, abs(there)))


def _moved(coarse: MixedProblem, minimum: Minimum, problem: MixedProblem, fine: Minimum) -> float | None:
    """How far (l) the joints of `coarse` went; None where that is too far, or rulings turned too far."""
    there, here = coarse.layout.positions(minimum.x), problem.layout.positions(fine.x)
    s = prolonged.joints(problem.lengths)
    kept = np.clip(np.searchsorted(s, prolonged.joints(coarse.lengths) - 0.5 * problem.lengths.min()), 0, s.size - 1)
    moved = float(np.linalg.norm(there - here[kept], axis=1).max())
    both = ((problem, fine.x), (coarse, minimum.x))
    steep, before = (float(np.abs(each.joint_values(y)[1]).max()) for each, y in both)
    return moved if moved <= NEAR and steep <= before + _TURNS else None
