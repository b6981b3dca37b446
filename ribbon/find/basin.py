"""Whether a state is the one that its seed means: a ribbon between two clamps may rest on either side of them.

A given seed says by the side to which it bends which of several states is meant. Its rival is the shape with omega and
eta changed in sign, both brought between the clamps (`ribbon.find.seeds.brought`); a state belongs to the nearer one,
in the metric of bending and twist::

    d(u, v)^2 = int (omega_u - omega_v)^2 + (tau_u - tau_v)^2 ds ,    tau = eta omega

A minimiser's long steps may change the side although the seed's own side has a state. Where that is seen the way is
gone again by short steps (`ribbon.solvers.newton_rows`, "reach"): a Levenberg-Marquardt path, which in the limit of
short steps is the steepest descent along the rows, and ends in the basin that it begins in (Nocedal and Wright 2006,
4.1 and 10.3). What it leads to is the answer, and `Equilibrium.branch` says what that is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ribbon.find import relax, seeds
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.result import Branch, Equilibrium
from ribbon.solvers import choose
from ribbon.solvers.budget import spent
from ribbon.solvers.problem import FloatArray, Minimum

#: How much nearer the rival has to be, over the distance of both seeds; distance to the seed (over its size) within
#: which no rival is looked for.
_NEARER, _OWN = 0.25, 0.3
#: Size of the given shape, over that between the clamps and alone, below which it means no side.
_MEANT, _STRAIGHT = 0.3, 0.1
#: Reach, barrier and steps between looks at the side of the way that is gone again, and its steps at the most.
_WAY: dict[str, Any] = {"reach": 0.3, "mu_init": 1e-5, "max_iter": 20}
_STEPS = 300

Shape = tuple[FloatArray, FloatArray]
Relaxed = Callable[[Problem, FloatArray], Equilibrium]


def has_several(problem: Problem) -> bool:
    """Whether a ribbon may rest in several ways for its clamps alone: both ends held, in the glued model."""
    return problem.end is not None and problem.formulation == "mixed"


class Sides:
    """A seed between its clamps, and its rival, which is fitted when it is first needed.

    given, brought: omega and eta (p + 1,) of the seed, as it was given and between the clamps, where the search began.
    """

    def __init__(self, problem: MixedProblem, given: Shape, brought: Shape) -> None:
        self.problem, self.given, self.brought = problem, given, brought
        self.own = self._strains(brought)
        self.size = self._norm(self.own)
        #: Whether the seed says which side is meant: it is not nearly straight, or all bent by the clamps.
        self.meant = self._norm(self._strains(given)) >= max(_MEANT * self.size, _STRAIGHT)
        self._rival: FloatArray | None = None

    def other(self, problem: Problem, x: FloatArray) -> bool:
        """Whether the shape x of `problem`, on any segments, lies clearly on the rival's side."""
        omega, eta = problem.joint_values(x)
        here = self._strains(relax.resampled(omega, eta, problem.lengths, self.problem.lengths))
        away = self._norm(here - self.own)
        if not self.meant or away <= _OWN * self.size:
            return False
        if self._rival is None:
            omega, eta = self.given
            self._rival = self._strains(seeds.brought(self.problem, -omega, -eta))
        apart = self._norm(self._rival - self.own)
        return away > self._norm(here - self._rival) + _NEARER * apart

    def _strains(self, shape: Shape) -> FloatArray:
        """omega and tau (2, p + 1) at the joints."""
        omega, eta = shape
        return np.stack([omega, eta if self.problem.fields.free else eta * omega])

    def _norm(self, strains: FloatArray) -> float:
        """Root of the integral of their squares, by the trapezoidal rule."""
        squares = (strains * strains).sum(axis=0)
        return float(np.sqrt(np.sum(0.5 * (squares[1:] + squares[:-1]) * self.problem.lengths)))


def sides(problem: Problem, given: Shape, brought: Shape) -> Sides | None:
    """The sides of a seed; None where it means none: without both ends held, or beside walls, which a fit knows not."""
    if not has_several(problem) or problem.walls:
        return None
    found = Sides(problem, given, brought)  # type: ignore[arg-type]
    return found if found.meant else None


def held(found: Equilibrium, of: Sides, relaxed: Relaxed) -> Equilibrium:
    """The state that a seed leads to, with its `branch`; `found` itself where that is on the seed's side.

    relaxed: solves from a shape that is near.
    """
    if not found.ok:
        return found
    if not of.other(found.problem, found.x):
        return replace(found, branch=Branch.OWN)
    if spent():
        return replace(found, branch=Branch.LEFT)
    start = relax.placed(of.problem, *of.brought)
    way = _walked(of, start)
    if way.residual <= relax.RESIDUAL_TOLERANCE:
        walked = relaxed(of.problem, way.x)
        if walked.ok:
            found = replace(walked, iterations=walked.iterations + way.iterations + found.iterations)
    if not of.other(found.problem, found.x):
        return replace(found, branch=Branch.OWN)
    down = of.other(of.problem, way.x) and of.problem.value(way.x) < of.problem.value(start)
    return replace(found, branch=Branch.SLID if down else Branch.LEFT)


def _walked(of: Sides, start: FloatArray) -> Minimum:
    """Where short steps lead from a shape, or where they come to the other side; Newton's, whatever else was asked for:
    it is a start for that."""
    x, steps = start, 0
    with choose.using("newton"):
        while True:
            way = relax.once(of.problem, x, dict(_WAY))
            x, steps = way.x, steps + way.iterations
            if way.residual <= relax.RESIDUAL_TOLERANCE or steps >= _STEPS or spent() or of.other(of.problem, x):
                return replace(way, iterations=steps)
