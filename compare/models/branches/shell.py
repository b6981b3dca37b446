"""The Naghdi shell over one parameter, as a system that a branch is followed of: where a branch of it begins."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from compare.continuation.point import Point
from compare.continuation.system import System
from compare.models.base import Shape, State, natural_constant, on_strip
from compare.models.branches.shell_remote import ShellEquations, ShellServer
from compare.models.capabilities import BranchStart
from compare.models.scope import require_shell
from compare.models.shell_build import shell_options, shell_problem
from compare.scene.scene import Scene
from ribbonbench.errors import BadInput
from shellref.shell.problem import ShellProblem
from shellref.shell.surface import ShellSurface

FloatArray = NDArray[np.float64]

#: Samples of the centreline for its largest curvature.
_SAMPLES = 2001


@dataclass(frozen=True)
class SurfaceShape(Shape):
    """A shell's middle surface."""

    surface: ShellSurface

    @property
    def bend(self) -> float:
        """Largest curvature of the centreline, 1/l."""
        tangent = self.frames(np.linspace(0.0, 1.0, _SAMPLES))[:, :, 2]
        return float(np.linalg.norm(np.diff(tangent, axis=0), axis=1).max() * (_SAMPLES - 1))

    def points(self, s: FloatArray, v: FloatArray) -> FloatArray:
        """Positions (k, m, 3)."""
        return self.surface.grid(on_strip(s), v)

    def centreline(self, s: FloatArray) -> FloatArray:
        """Positions (k, 3) of v = 0."""
        return self.surface.centreline(on_strip(s))

    def frames(self, s: FloatArray) -> FloatArray:
        """Frames (k, 3, 3) of the centreline, columns across, normal, along."""
        return self.surface.frames(on_strip(s))

    def fields(self, s: FloatArray, v: FloatArray) -> dict[str, FloatArray]:
        """The director."""
        return {"normal": self.surface.director(on_strip(s)[:, None], v[None, :])}


def branch_start(scene_at: Callable[[float], Scene], state: State) -> BranchStart:
    """The branch through a state at t = 0, of the first w/h. `BadInput` for a state that is no equilibrium, and a scene
    of which the shell's equations are not known (`shellref.follow.equations.refused`)."""
    if not state.is_equilibrium:
        raise BadInput(
            "SCENE", scene_at(0.0).name, f"has no equilibrium where the branch would begin: {state.message}",
            "begin elsewhere (--from), or give a [seed] or a [[path]] that leads there",
        )  # fmt: skip
    first = scene_at(0.0)
    mesh = state.native.report.problem.elements

    def problem_at(t: float) -> ShellProblem:
        scene = scene_at(t)
        try:
            return shell_problem(scene, require_shell(scene)[0], mesh, way=False)
        except BadInput as error:
            raise ValueError(str(error)) from None

    server = ShellServer(replace(shell_options(first), accuracy=None))
    system = ShellEquations(problem_at, server, lambda t: natural_constant(scene_at(t).curvature))
    surface: ShellSurface = state.native.surface
    z = system.begun(np.concatenate([surface.points, surface.directors], axis=-1), 0.0)

    def shape(point: Point) -> Shape:
        assert isinstance(point.system, ShellEquations)
        return SurfaceShape(point.system.surface(point.z))

    def others(count: int) -> Iterator[tuple[str, System, FloatArray]]:
        return iter(())

    return BranchStart(state, system, z, shape, others, costly=True)
