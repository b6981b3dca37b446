"""The ribbon over one parameter, as a system that a branch is followed of (`ribbon.find.branch.equations`)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from compare.continuation.point import Point
from compare.errors import BadInput
from compare.models.base import Shape, State
from compare.models.capabilities import BranchStart
from compare.models.ribbon.build import ribbon_problem
from compare.models.ribbon.state import RibbonShape
from compare.scene.scene import Scene
from ribbon import Equilibrium, RibbonInputError
from ribbon.find.branch.equations import Equations
from ribbon.find.solving.request import How
from ribbon.find.solving.verdict import judged
from ribbon.problems.mixed import MixedProblem
from ribbon.sensitivity.system import point
from ribbon.solvers.problem import KNOWN, Minimum, kkt_residual

FloatArray = NDArray[np.float64]


def equations(scene_at: Callable[[float], Scene], t: float, found: Equilibrium) -> tuple[Equations, FloatArray]:
    """The system around a ribbon's equilibrium, and its z; scene_at: t, without unit -> the scene there."""
    here = point(found, unstable=True)

    def problem_at(t: float, lengths: FloatArray) -> MixedProblem:
        try:
            made = ribbon_problem(scene_at(t), "mixed")
        except BadInput as error:
            raise RibbonInputError("scene", t, str(error)) from None
        assert isinstance(made, MixedProblem)
        if made.lengths.shape == lengths.shape and np.array_equal(made.lengths, lengths):
            return made
        return made.with_changes(lengths=lengths)

    return Equations.of(problem_at, here.problem.lengths, t, here.x, here.rows, here.multipliers)


def equilibrium(system: Equations, z: FloatArray, t: float) -> Equilibrium:
    """A point of a branch as the ribbon's solve returns it; its stability is told by the branch."""
    problem = system.problem(t)
    x, rows = system.whole(z, t)
    bounds = np.where(system.side != 0.0, system.slope(problem, x, rows), 0.0)
    residual = kkt_residual(problem, x, bounds, rows)
    return judged(problem, Minimum(x, bounds, rows, residual, 0, 0, "", True, 0.0, KNOWN), How(check=False))


def branch_start(scene_at: Callable[[float], Scene], state: State) -> BranchStart:
    """The branch through a state at t = 0. `BadInput` for a state that is no equilibrium."""
    if not state.is_equilibrium:
        raise BadInput(
            "SCENE", scene_at(0.0).name, f"has no equilibrium where the branch would begin: {state.message}",
            "begin elsewhere (--from), or give a [seed] or a [[path]] that leads there",
        )  # fmt: skip
    system, z = equations(scene_at, 0.0, state.native)

    def shape(point: Point) -> Shape:
        assert isinstance(point.system, Equations)
        return RibbonShape(equilibrium(point.system, point.z, point.t))

    return BranchStart(state, system, z, shape)
