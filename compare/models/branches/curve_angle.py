"""The curve-angle rod over one parameter, as a system that a branch is followed of (`ribbon.rods.equations`)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from compare.continuation.point import Point
from compare.continuation.system import System, Unbounded
from compare.models.base import Shape, State, natural_constant
from compare.models.capabilities import BranchStart
from compare.models.curve_angle.shape import CurveAngleShape
from compare.models.curve_angle.start import origin_of, rod_of
from compare.scene.scene import Scene
from ribbon.rods.equations import Equations
from ribbon.rods.result import RodShape
from ribbon.rods.rod import Rod
from ribbon.solvers.frontal import Factored
from ribbonbench.errors import BadInput

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class RodSystem(Unbounded):
    """own: its equations; more_at: t -> energy (D w / l) of what they leave out, the rod being seen from where it is
    held and measured against its rest shape."""

    own: Equations
    more_at: Callable[[float], float]

    @property
    def size(self) -> int:
        """Unknowns and rows."""
        return self.own.size

    def residual(self, z: FloatArray, t: float) -> FloatArray:
        """G (n,)."""
        return self.own.residual(z, t)

    def norm(self, residual: FloatArray) -> float:
        """What of it counts."""
        return self.own.norm(residual)

    def rate(self, z: FloatArray, t: float) -> FloatArray:
        """dG/dt (n,)."""
        return self.own.rate(z, t)

    def factor(self, z: FloatArray, t: float) -> Factored | None:
        """K, factored."""
        return self.own.factor(z, t)

    def mass(self, v: FloatArray) -> FloatArray:
        """M v (n,)."""
        return self.own.mass(v)

    def stepped(self, z: FloatArray, dz: FloatArray) -> FloatArray:
        """z + dz."""
        return self.own.stepped(z, dz)

    def moved(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[Self, FloatArray, FloatArray]:
        """With edges that stand where it is pulled into layers, and reference frames told anew where one has turned
        far."""
        own, z, directions = self.own.moved(z, t, directions)
        return (self if own is self.own else replace(self, own=own)), z, directions

    def resolved(self, z: FloatArray, t: float) -> bool:
        """Whether its edges resolve the layers of a rod that is pulled."""
        return self.own.resolved(z, t)

    def finer(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[Self, FloatArray, FloatArray]:
        """Every edge cut in two."""
        own, z, directions = self.own.finer(z, t, directions)
        return replace(self, own=own), z, directions

    def energy(self, z: FloatArray, t: float) -> float:
        """Total energy, D w / l."""
        return self.own.energy(z, t) + self.more_at(t)


def branch_start(scene_at: Callable[[float], Scene], state: State) -> BranchStart:
    """The branch through a state at t = 0. `BadInput` for a state that is no equilibrium, and for a dead moment, which
    has no potential."""
    if not state.is_equilibrium:
        raise BadInput(
            "SCENE", scene_at(0.0).name, f"has no equilibrium where the branch would begin: {state.message}",
            "begin elsewhere (--from), or give a [seed] or a [[path]] that leads there",
        )  # fmt: skip
    if scene_at(0.0).tip_moment.any() or scene_at(1.0).tip_moment.any():
        why = "of fixed direction on an end that turns has no potential: its tangent's inertia counts no modes"
        raise BadInput("tip.moment", None, why, "hold the end's frame, or leave it out")
    found: RodShape = state.native
    origin = origin_of(scene_at(0.0))

    def rod_at(t: float, lengths: FloatArray) -> Rod:
        try:
            return rod_of(scene_at(t), lengths, origin)
        except BadInput as error:
            raise ValueError(str(error)) from None

    def more_at(t: float) -> float:
        rod = rod_at(t, found.rod.lengths)
        return float(origin @ (rod.weight - rod.force)) - natural_constant(rod.rest[0])

    own, z = Equations.of(rod_at, found.found)
    system = RodSystem(own, more_at)

    def shape(point: Point) -> Shape:
        assert isinstance(point.system, RodSystem)
        there = point.system.own.shape(point.z, point.t, point.norm)
        return CurveAngleShape(replace(there, origin=origin))

    def others(count: int) -> Iterator[tuple[str, System, FloatArray]]:
        return iter(())

    def force(point: Point, shape: Shape) -> FloatArray | None:
        assert isinstance(shape, CurveAngleShape)
        return None if shape.native.rod.end.free else shape.native.reactions[1][0]

    return BranchStart(state, system, z, shape, others, force=force)
