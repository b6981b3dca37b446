"""The planar elastica over one parameter, as a system that a branch is followed of (`shellref.elastica.system`)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from compare.continuation.point import Point
from compare.models.base import Shape, State
from compare.models.capabilities import BranchStart
from compare.models.elastica.shape import ElasticaShape
from compare.models.elastica.start import elastica_problem
from compare.scene.scene import Scene
from ribbonbench.errors import BadInput
from shellref.elastica.problem import ElasticaProblem, LoadPath
from shellref.elastica.result import ElasticaResult
from shellref.elastica.solve import branch_result
from shellref.elastica.system import System

FloatArray = NDArray[np.float64]
ProblemAt = Callable[[float], ElasticaProblem]

#: Eigenvalues that are looked at for negative ones.
_SEEN = 10
_STEP = 1e-4


@dataclass(frozen=True)
class _Way(LoadPath):
    """Problems at any t, not on a straight line."""

    of: ProblemAt

    def at(self, t: float) -> ElasticaProblem:
        return self.of(t)


@dataclass(frozen=True)
class Factored:
    """The tangent at a point (z, t), factored."""

    factor: scipy.sparse.linalg.SuperLU
    system: System
    z: FloatArray
    t: float

    @cached_property
    def unstable(self) -> int:
        """Number of negative eigenvalues of the second variation on the constraints."""
        return int((self.system.eigenpairs(self.z, self.t, _SEEN)[0] < 0.0).sum())

    def solve(self, b: FloatArray) -> FloatArray:
        """K^-1 b."""
        return np.asarray(self.factor.solve(b))

    def solve_transposed(self, b: FloatArray) -> FloatArray:
        """K^-T b."""
        return np.asarray(self.factor.solve(b, "T"))


@dataclass(frozen=True)
class ElasticaEquations:
    """problem_at: t, without unit -> the elastica there, held alike at every t; nodes (n + 1,), degree: its elements.

    z: coefficients of theta, and the reactions of a held end."""

    problem_at: ProblemAt
    nodes: FloatArray
    degree: int

    @classmethod
    def of(cls, problem_at: ProblemAt, result: ElasticaResult) -> tuple[ElasticaEquations, FloatArray]:
        """The system on the elements of a result, and its z."""
        system = cls(problem_at, result.nodes, result.degree)
        s = system.system.discrete.s
        theta = system.system.discrete.projected(result.angle(s.ravel()).reshape(s.shape))
        pushed = np.asarray(result.forces.end) - np.asarray(result.problem.force)
        return system, np.concatenate([theta, system.system.normals @ pushed])

    @cached_property
    def system(self) -> System:
        """Its discretisation."""
        start, end = self.problem_at(0.0), self.problem_at(1.0)
        return System(self.nodes, self.degree, _Way(start, end, self.problem_at))

    @property
    def size(self) -> int:
        """Coefficients and reactions."""
        return self.system.size

    def residual(self, z: FloatArray, t: float) -> FloatArray:
        """G (n,); nan where the scene cannot be."""
        try:
            return np.asarray(self.system.residual(z, t))
        except ValueError:
            return np.full(self.size, np.nan)

    def norm(self, residual: FloatArray) -> float:
        """Out-of-balance moment and misfits."""
        return float(self.system.norm(residual))

    def rate(self, z: FloatArray, t: float) -> FloatArray:
        """dG/dt by differences, from one side at an end of what is possible."""
        after, before = self.residual(z, t + _STEP), self.residual(z, t - _STEP)
        if np.all(np.isfinite(after)) and np.all(np.isfinite(before)):
            return (after - before) / (2.0 * _STEP)
        side = _STEP if np.all(np.isfinite(after)) else -_STEP
        near, far = self.residual(z, t + side), self.residual(z, t + 2.0 * side)
        return (4.0 * near - 3.0 * self.residual(z, t) - far) / (2.0 * side)

    def factor(self, z: FloatArray, t: float) -> Factored | None:
        """The tangent, factored."""
        matrix = self.system.jacobian(z, t)
        if not np.all(np.isfinite(matrix.data)):
            return None
        try:
            found = scipy.sparse.linalg.splu(matrix)
        except RuntimeError:  # singular to the last bit: any neighbour has the same null vector
            shift = 1e-15 * abs(matrix).max() * scipy.sparse.eye(self.size, format="csc")
            found = scipy.sparse.linalg.splu(matrix + shift)
        return Factored(found, self.system, z, t)

    def mass(self, v: FloatArray) -> FloatArray:
        """L2 product of angles; given ones do not move."""
        count = self.system.count
        weighed = np.zeros(self.size)
        weighed[:count] = self.system.discrete.weighted(v[:count])
        weighed[self.system.discrete.given] = 0.0
        return weighed

    def reach(self, z: FloatArray, dz: FloatArray) -> float:
        """Nothing bounds an elastica."""
        return 1.0

    def stepped(self, z: FloatArray, dz: FloatArray) -> FloatArray:
        """z + dz."""
        return z + dz

    def slacks(self, z: FloatArray, t: float) -> FloatArray:
        """No conditions of one side."""
        return np.zeros(0)

    def beyond(
        self, z: FloatArray, t: float, condition: int, directions: FloatArray
    ) -> tuple[ElasticaEquations, FloatArray, FloatArray, str]:
        """There is none to go beyond."""
        raise ValueError(f"condition = {condition}: an elastica has no conditions of one side")

    def renewed(
        self, z: FloatArray, t: float, directions: FloatArray
    ) -> tuple[ElasticaEquations, FloatArray, FloatArray]:
        """Everything moves something."""
        return self, z, directions

    def moved(
        self, z: FloatArray, t: float, directions: FloatArray
    ) -> tuple[ElasticaEquations, FloatArray, FloatArray]:
        """Nothing of an elastica is sudden."""
        return self, z, directions

    def finer(
        self, z: FloatArray, t: float, directions: FloatArray
    ) -> tuple[ElasticaEquations, FloatArray, FloatArray]:
        """Every element cut in two: the same angle, exactly."""
        nodes = np.sort(np.concatenate([self.nodes, 0.5 * (self.nodes[1:] + self.nodes[:-1])]))
        new = ElasticaEquations(self.problem_at, nodes, self.degree)
        old, many = self.system, new.system

        def carried(v: FloatArray) -> FloatArray:
            s = many.discrete.s
            angle = old.discrete.angle(v[: old.count], s.ravel()).reshape(s.shape)
            return np.concatenate([many.discrete.projected(angle), v[old.count :]])

        moved = [carried(directions[:, k]) for k in range(directions.shape[1])]
        return new, carried(z), np.array(moved).reshape(len(moved), -1).T

    def energy(self, z: FloatArray, t: float) -> float:
        """Total energy, D w / l."""
        bending, loads = self.system.discrete.energies(z[: self.system.count], self.system.way.at(t))
        return float(bending + loads)

    def result(self, z: FloatArray, t: float, norm: float) -> ElasticaResult:
        """The equilibrium as a solve returns it."""
        return branch_result(self.system, self.degree, z, t, norm)


def branch_start(scene_at: Callable[[float], Scene], state: State) -> BranchStart:
    """The branch through a state at t = 0. `BadInput` for a state that is no equilibrium."""
    if not state.is_equilibrium:
        raise BadInput(
            "SCENE", scene_at(0.0).name, f"has no equilibrium where the branch would begin: {state.message}",
            "begin elsewhere (--from), or give a [seed] or a [[path]] that leads there",
        )  # fmt: skip
    result = state.native
    turn = float(result.theta[-1])

    def problem_at(t: float) -> ElasticaProblem:
        try:
            return elastica_problem(scene_at(t), turn)
        except BadInput as error:
            raise ValueError(str(error)) from None

    system, z = ElasticaEquations.of(problem_at, result)

    def shape(point: Point) -> Shape:
        assert isinstance(point.system, ElasticaEquations)
        scene = scene_at(point.t)
        found = point.system.result(point.z, point.t, point.norm)
        return ElasticaShape(found, np.asarray(scene.position), scene.frame, scene.width)

    return BranchStart(state, system, z, shape, lambda count: others(system, z, count))


#: Waves and sizes (rad) of random angles; the seed of the committed draws.
_WAVES, _TURN, _DRAW = 5, 2.0, 20261125


def others(system: ElasticaEquations, z: FloatArray, count: int) -> Iterator[tuple[str, ElasticaEquations, FloatArray]]:
    """Shapes beside which other equilibria may be: its own on the other side of its chord, and random waves on it."""
    discrete, many = system.system.discrete, system.system.count
    held = 0.0 if not discrete.angles.size else float(discrete.angles[0])
    linear = discrete.projected(
        held + (float(discrete.angles[-1]) - held if discrete.angles.size else 0.0) * discrete.s
    )
    starts = [("the other side", 2.0 * linear - z[:many])]
    rng = np.random.default_rng(_DRAW)
    for k in range(count):
        sizes = _TURN * rng.normal(size=_WAVES) / np.arange(1, _WAVES + 1)
        wave = sum(a * np.sin(np.pi * (n + 1) * discrete.s) for n, a in enumerate(sizes))
        starts.append((f"random start {k}", linear + discrete.projected(np.asarray(wave))))
    for name, theta in starts:
        theta[discrete.given] = discrete.angles
        yield name, system, np.concatenate([theta, np.zeros(system.size - many)])
