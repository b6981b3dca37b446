"""Strips held at s = 0 only that differ by little from one to the next in Gamma and natural curvature, along a line.

The first and the last case are solved alone, as `ribbon.solve` does; those between begin where the cases before them
lead (docs/theory.md, eq. (4.11); `ribbon.solvers.chained_line`). Where that does not come to the state that the last
case has alone, somewhere between the state that a start of its own leads to is another one, or there is none to be
followed: the line is then cut there, or into halves, and its parts are gone so, each between two cases solved alone,
down to a few that go alone. The check sees every part along which the state changes once. It cannot see one along which
it changes and changes back: what is found there is a stable state, the neighbours' own, and may be another than the
case has alone. Where the way of a state alone is long, cases that are each other's check are nearer to each other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbon.element import kernel_cache
from ribbon.find.solving import coarse
from ribbon.notes import Note
from ribbon.problems.chained import ChainedProblem
from ribbon.result import Equilibrium
from ribbon.solvers import newton
from ribbon.solvers.problem import NEWTON, scale_of

with kernel_cache.in_use():
    from ribbon.solvers import chained_line

FloatArray = NDArray[np.float64]

#: Distance (l) of joints up to which two states of a case are one.
SAME = 1e-8
#: Distance of two cases up to which those between go alone.
FEWEST = 5
#: Newton's steps of a state alone from which its way is long enough to end elsewhere than its neighbours', and distance
#: of two cases that are each other's check there.
_LONG_WAY, _RUGGED = 20, 16
_follow: Any = chained_line.follow


@dataclass(frozen=True)
class Neighbours:
    """States along a line of k cases. alone: those that were solved so, by their place; numbers (k, NUMBERS): of the
    others, by the places of `ribbon.solvers.chained_line`, and of some of `alone`, as their neighbours lead to them,
    else NaN; x (k, n): unknowns."""

    alone: dict[int, Equilibrium]
    numbers: FloatArray
    x: FloatArray


def is_plain(state: Equilibrium) -> bool:
    """Converged, and the lowest eigenvalue is clearly positive."""
    return state.ok and state.stable is True and Note.INDIFFERENT not in state.notes


def follows(problem: object) -> bool:
    """Whether the neighbours of a problem can be begun at its state: a strip of rulings that is held at s = 0 only,
    with weight, without a force at its end, naturally flat or evenly curved."""
    if not isinstance(problem, ChainedProblem) or problem.fields.free or problem.fields.in_plane:
        return False
    curvature = problem.strip.curvature
    even = len(curvature) == 2 and all(isinstance(k, float) for k in curvature) and curvature[0] == curvature[1]
    return problem.has_gravity and problem.tip is None and not problem.planar and even


def along(
    gamma: FloatArray, curvature: FloatArray, solved: Callable[[Sequence[int]], Sequence[Equilibrium]]
) -> Neighbours | None:
    """The states of a line of cases with these Gamma (k,) and natural curvatures K l (k,), all else the same; solved:
    gives the states of cases (places) alone. None: not even the first can be gone on from."""
    last = gamma.size - 1
    ends = dict(zip((0, last), solved([0, last]), strict=True))
    problem = ends[0].problem
    if not (isinstance(problem, ChainedProblem) and follows(problem) and follows(ends[last].problem)):
        return None
    x, numbers = np.zeros((last + 1, problem.size)), np.full((last + 1, chained_line.NUMBERS), np.nan)
    scale = np.array([scale_of(g + k * k) for g, k in zip(gamma.tolist(), curvature.tolist(), strict=True)])
    line = _Line(problem, chained_line.Line(gamma, curvature, scale), x, numbers, ends, solved)
    line.go(0, last)
    return Neighbours(line.alone, numbers, x)


@dataclass
class _Line:
    """A line while it is gone; alone: the states of those cases that were solved so."""

    problem: ChainedProblem
    own: chained_line.Line
    x: FloatArray
    numbers: FloatArray
    alone: dict[int, Equilibrium]
    solved: Callable[[Sequence[int]], Sequence[Equilibrium]]

    def go(self, begin: int, end: int) -> None:
        """Finds the cases between two that were solved alone: from the first on, where that leads to the last one; else
        up to where it leads, or half by half."""
        if end - begin <= FEWEST:
            between = range(begin + 1, end)
            self.alone |= zip(between, self.solved(between) if between else (), strict=True)
            return
        ends = self.alone[begin], self.alone[end]
        if end - begin > _RUGGED and max(state.iterations for state in ends) > _LONG_WAY:
            self._cut(begin, (begin + end) // 2, end)
            return
        fit = all(map(_is_followed, ends))
        came = self._followed(begin, end) if fit else None
        if came is None or (came > end and not _alike(self.alone[end], self.x[end])):
            place = (begin + end) // 2
        elif came > end:
            return
        else:  # the case before it is its own check; what cannot be followed goes alone
            place = came - 1 if came - 1 > begin + FEWEST else begin + FEWEST
        self._cut(begin, place, end)

    def _cut(self, begin: int, place: int, end: int) -> None:
        """Both parts of the line, each for itself."""
        self.numbers[begin + 1 : end + 1] = np.nan
        self.alone[place] = self.solved([place])[0]
        self.go(begin, place)
        self.go(place, end)

    def _followed(self, begin: int, end: int) -> int:
        """Goes from one case to another; the number of the first case that it did not come to."""
        state, clamp = self.alone[begin], self.problem.clamp
        exact = (newton.TOLERANCE, newton.EXACT * newton.TOLERANCE)
        position = np.asarray(clamp.position) / self.problem.strip.length
        x, numbers = self.x[: end + 1], self.numbers[: end + 1]
        x[begin], numbers[begin, chained_line.LOWEST] = state.x, state.lowest_eigenvalue
        return int(
            _follow(
                x, begin + 1, begin, state.mode.copy(), self.own, *newton.arguments(self.problem), exact,
                coarse.TURNED, position, numbers,
            )
        )  # fmt: skip


def _is_followed(state: Equilibrium) -> bool:
    """Whether neighbours may begin at a state: a clear minimum, found by Newton's method at once, of which nothing
    else is to be said."""
    return is_plain(state) and state.solver == NEWTON and not state.notes and state.minima is None


def _alike(state: Equilibrium, x: FloatArray) -> bool:
    """Whether the unknowns x (n,) are those of the state, by the places of the joints."""
    return bool(np.linalg.norm(state.joints[0] - state.problem.joints(x)[0], axis=1).max() <= SAME)
