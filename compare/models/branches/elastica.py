"""The planar elastica over one parameter, as a system that a branch is followed of (`shellref.elastica.system`)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from compare.continuation.point import Point
from compare.continuation.system import Unbounded, rate_by_differences
from compare.models.base import Shape, State
from compare.models.capabilities import BranchStart
from compare.models.elastica.shape import ElasticaShape
from compare.models.elastica.start import elastica_problem
from compare.scene.scene import Scene
from ribbonbench.errors import BadInput
from shellref.elastica.fitted import fitted, missed
from shellref.elastica.problem import ElasticaProblem, LoadPath
from shellref.elastica.result import ElasticaResult
from shellref.elastica.solve import branch_result
from shellref.elastica.system import System

FloatArray = NDArray[np.float64]
ProblemAt = Callable[[float], ElasticaProblem]

#: Eigenvalues that are looked at for negative ones.
_SEEN = 10
#: Relative error of the curvature from which elements move, and the part of it that is worth it; above which a point is
#: not resolved.
FITTED, WORTH, RESOLVED = 1e-4, 0.5, 1e-2
#: Slack (l) at the least by which angles are measured, and residuals, which rounding bounds.
_LEAST_SLACK, _FINEST = 1e-9, 1e-5


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
class ElasticaEquations(Unbounded):
    """problem_at: t, without unit -> the elastica there, held alike at every t; nodes (n + 1,), degree: its elements;
    sharp: 1 / width of the layers that they are for, in 1/l, at least 1.

    z: coefficients of theta, and the reactions of a held end."""

    problem_at: ProblemAt
    nodes: FloatArray
    degree: int
    sharp: float = 1.0

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

    @cached_property
    def slack(self) -> float:
        """Twice the length (l) that the strip has to spare between its ends, at the most over the range; 1 where it is
        not held so, or turns by more than half a turn.

        int (1 - cos phi) ds is that length, phi the angle to the chord: of a strip that is nearly straight phi is of
        the size of the root of this number, and so is all that can happen to it."""
        if len(self.system.normals) < 2:
            return 1.0
        most = 0.0
        for t in (0.0, 0.5, 1.0):
            problem = self.problem_at(t)
            if problem.end is None or None in (problem.start_angle, problem.end_angle):
                return 1.0
            if abs(float(problem.end_angle or 0.0) - float(problem.start_angle or 0.0)) > math.pi:
                return 1.0
            most = max(most, 2.0 * (1.0 - math.hypot(*problem.end)))
        return min(max(most, _LEAST_SLACK), 1.0)

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
        """Out-of-balance moment over the strip's own, misfits over the length that it has to spare, or its layers."""
        moment, misfit = self.system.parts(residual)
        own = math.sqrt(max(self.slack, _FINEST)) * self.sharp
        return math.hypot(moment / own, misfit * max(1.0 / max(self.slack, _FINEST), self.sharp))

    def rate(self, z: FloatArray, t: float) -> FloatArray:
        """dG/dt by differences."""
        return rate_by_differences(self.residual, z, t)

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
        """L2 product of angles, over the size of what they may be; given ones do not move."""
        count = self.system.count
        weighed = np.zeros(self.size)
        weighed[:count] = self.system.discrete.weighted(v[:count]) / self.slack
        weighed[self.system.discrete.given] = 0.0
        return weighed

    def stepped(self, z: FloatArray, dz: FloatArray) -> FloatArray:
        """z + dz."""
        return z + dz

    def moved(
        self, z: FloatArray, t: float, directions: FloatArray
    ) -> tuple[ElasticaEquations, FloatArray, FloatArray]:
        """As many elements where the shape needs them (`shellref.elastica.fitted`); itself where they resolve it."""
        before = self.missed(z, t)
        if not before > FITTED:
            return self, z, directions
        problem, sharp = self.system.way.at(t), math.sqrt(max(1.0, self.system.loads(z, t).load))
        joints = fitted(self.system, self.degree, z, t, len(self.nodes) - 1, problem)
        if not missed(self.system, self.degree, z, t, joints) < WORTH * before:
            return self, z, directions
        return self._carried(joints, z, directions, sharp)

    def missed(self, z: FloatArray, t: float) -> float:
        """Relative error of the curvature that its elements leave, estimated."""
        return missed(self.system, self.degree, z, t)

    def resolved(self, z: FloatArray, t: float) -> bool:
        """Whether they leave little."""
        return self.missed(z, t) <= RESOLVED

    def finer(
        self, z: FloatArray, t: float, directions: FloatArray
    ) -> tuple[ElasticaEquations, FloatArray, FloatArray]:
        """Every element cut in two: the same angle, exactly."""
        nodes = np.sort(np.concatenate([self.nodes, 0.5 * (self.nodes[1:] + self.nodes[:-1])]))
        return self._carried(nodes, z, directions)

    def _carried(
        self, nodes: FloatArray, z: FloatArray, directions: FloatArray, sharp: float | None = None
    ) -> tuple[ElasticaEquations, FloatArray, FloatArray]:
        """The system between these joints, z and directions in it: the nearest angles, the same reactions."""
        new = replace(self, nodes=nodes, sharp=sharp or self.sharp)
        old, many = self.system, new.system

        def carried(v: FloatArray) -> FloatArray:
            s = many.discrete.s
            angle = old.discrete.angle(v[: old.count], s.ravel()).reshape(s.shape)
            return np.concatenate([many.discrete.projected(angle), v[old.count :]])

        moved = [carried(directions[:, k]) for k in range(directions.shape[1])]
        return new, carried(z), np.array(moved).reshape(len(moved), many.size).T

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
    system, z, _ = system.moved(z, 0.0, np.zeros((z.size, 0)))

    def shape(point: Point) -> Shape:
        assert isinstance(point.system, ElasticaEquations)
        scene = scene_at(point.t)
        found = point.system.result(point.z, point.t, point.norm)
        return ElasticaShape(found, np.asarray(scene.position), scene.frame, scene.width)

    def force(point: Point, shape: Shape) -> FloatArray | None:
        assert isinstance(shape, ElasticaShape)
        scene, found = scene_at(point.t), shape.result
        if scene.clamp_end is None:
            return None
        along, up = np.asarray(found.forces.end) - np.asarray(found.problem.force)  # a load at the tip is no support
        return np.asarray(along * scene.frame[:, 2] - up * scene.frame[:, 1])

    return BranchStart(state, system, z, shape, lambda count: others(system, z, count), force=force, planar=True)


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
