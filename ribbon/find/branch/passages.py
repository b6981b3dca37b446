"""Elements that stand where the curvature passes zero, and move with it.

Where a twisted strip's curvature passes zero Wunderlich's rulings meet at an edge: eta' comes to its bound 2 / w over a
length of the order of w (E. L. Starostin & G. H. M. van der Heijden 2007, doi:10.1038/nmat1929), and where a clamp
holds a ruling straight the same happens beside it. On elements that are not short there, and stay where they are, such
an event is held by the joints: with curvature k = k' s beside it, the energy of the element in which it lies is of the
order k'^2 h^3 and changes with its place in the element; the second derivative, of the order h, is a stiffness that the
strip does not have. The lowest eigenvalue, and with it every critical load, then depends on where the event lies
between two joints. A joint at the passage, elements h_0 long there that grow with the distance from it, and the
same again at the next state make that error as small as h_0 at the cost of log(1 / h_0) elements.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ribbon.errors import RibbonInputError
from ribbon.find.continuation import switch
from ribbon.problems.protocol import Problem
from ribbon.result import Equilibrium

FloatArray = NDArray[np.float64]

#: Passages nearer to each other or to an end than this are one (over l).
APART = 1e-6
#: Points at which the length of the elements is given for counting them: along the strip, and towards each passage.
_ALONG, _TOWARDS, _NEAREST = 4001, 400, 1e-9


def passages(equilibrium: Equilibrium) -> FloatArray:
    """Abscissae over l (m,), ascending, inside the strip, where its curvature changes its sign (linear between the
    joints, as it is on every element)."""
    return passed(equilibrium.problem.lengths, equilibrium.problem.joint_values(equilibrium.x)[0])


def passed(lengths: FloatArray, omega: FloatArray) -> FloatArray:
    """The same of a curvature omega (p + 1,) at the joints of segments of these lengths (p,)."""
    s = np.concatenate([[0.0], np.cumsum(lengths)])
    k = np.flatnonzero(omega[:-1] * omega[1:] < 0.0)
    at = s[k] + (s[k + 1] - s[k]) * omega[k] / (omega[k] - omega[k + 1])
    on_joints = s[1:-1][omega[1:-1] == 0.0]
    at = np.sort(np.concatenate([at, on_joints]))
    at = at[(at > APART) & (at < 1.0 - APART)]
    return at[np.concatenate([[True], np.diff(at) > APART])] if at.size else at


@dataclass(frozen=True)
class Grading:
    """Elements of length min(longest, least + growth d), d being the distance to the nearest passage or end.

    longest, least: over l, 0 < least <= longest < 1; growth: no unit, > 0. ends: whether the ends count as passages, as
    clamps with a straight ruling do. Raises `RibbonInputError` for what is out of range.
    """

    longest: float = 0.01
    least: float = 0.002
    growth: float = 0.1
    ends: bool = True

    def __post_init__(self) -> None:
        if not 0.0 < self.longest < 1.0:
            raise RibbonInputError("longest", self.longest, "a length over l in (0, 1)")
        if not 0.0 < self.least <= self.longest:
            raise RibbonInputError("least", self.least, f"a length over l, at most longest = {self.longest:g}")
        if not self.growth > 0.0:
            raise RibbonInputError("growth", self.growth, "a number above 0")

    def finer(self, times: float = 2.0) -> Grading:
        """The grading whose elements are `times` shorter everywhere: as many times more of them."""
        return Grading(self.longest / times, self.least / times, self.growth / times, self.ends)

    def lengths(self, points: FloatArray) -> FloatArray:
        """Lengths (p,) over l with a joint at each of `points` (m,), which lie inside the strip."""
        centres = np.unique(np.concatenate([points, [0.0, 1.0] if self.ends else []]))
        towards = np.geomspace(_NEAREST, 1.0, _TOWARDS)
        s = np.concatenate([np.linspace(0.0, 1.0, _ALONG), *(c + sign * towards for c in centres for sign in (-1, 1))])
        s = np.unique(np.concatenate([s[(s > 0.0) & (s < 1.0)], points, [0.0, 1.0]]))
        far = np.abs(s[:, None] - centres).min(axis=1) if centres.size else np.ones(s.size)
        h = np.minimum(self.longest, self.least + self.growth * far)
        count = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(s) * (1.0 / h[1:] + 1.0 / h[:-1]))])
        joints = [np.zeros(1)]
        fixed = np.concatenate([[0.0], np.sort(points), [1.0]])
        for first, last in itertools.pairwise(fixed):
            a, b = np.interp([first, last], s, count)
            n = max(1, int(np.ceil(b - a - 1e-9)))
            inner = np.interp(a + (b - a) * np.arange(1, n) / n, count, s)
            joints.append(np.concatenate([inner, [last]]))
        return np.diff(np.concatenate(joints))

    def __call__(self, equilibrium: Equilibrium) -> FloatArray:
        """Lengths (p,) over l for the state `equilibrium`: what `ribbon.follow` takes as `place`."""
        return self.lengths(passages(equilibrium))


def settled(problem: Problem, start: Equilibrium, grading: Grading, rounds: int = 2) -> Equilibrium:
    """The equilibrium of `problem` near `start` on elements graded to its own passages.

    The first round grades to the passages of `start`, each further one to those of the round before, if they moved by
    more than half a `least`. Of an unstable state the side is not left.
    """
    found, placed = start, np.zeros(0)
    for k in range(rounds):
        now = passages(found)
        if k and now.size == placed.size and (not now.size or np.abs(now - placed).max() <= 0.5 * grading.least):
            break
        placed = now
        found = switch(problem.with_changes(lengths=grading.lengths(placed)), found)
    return found
