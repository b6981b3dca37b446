"""The shearable rod (`antman`) over one parameter, as a system that a branch is followed of.

Unknowns z: positions (3) and quaternions (4) of the nodes, and the stress at the Gauss points (`shellref.rod.newton`);
what vanishes: the balance on what is free, the way of what is held to its place, |q| - 1, and C (e(u) - e_0) - sigma.
Steps of a node (3 and a turn) are those of z by the tangent vectors of its quaternion, dq = T theta, theta = 4 T^T dq.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from compare.continuation.point import Point
from compare.continuation.system import System, Unbounded, rate_by_differences
from compare.models.antman.problem import problem_of
from compare.models.antman.shape import RodShape
from compare.models.base import Shape, State, natural_constant
from compare.models.capabilities import BranchStart
from compare.scene.scene import Scene
from ribbonbench.errors import BadInput
from shellref.rod.elements import Elements
from shellref.rod.elements import State as Rod
from shellref.rod.layers import fitted, missed
from shellref.rod.newton import Balance, Factor
from shellref.rod.problem import RodProblem
from shellref.rod.quaternion import PRODUCT
from shellref.rod.result import RodResult, reactions
from shellref.rod.solve import energy_of

FloatArray = NDArray[np.float64]
ProblemAt = Callable[[float], RodProblem]

#: dq = sum_i q_i _TURN[i, k, m] theta_m.
_TURN = 0.5 * PRODUCT[:, :, 1:].transpose(1, 0, 2)
#: Turns of a force on z (T^T) over those of a step (4 T^T).
_DUAL = np.array([1.0, 1.0, 1.0, 0.25, 0.25, 0.25])
#: Relative error of the curvature from which elements move, and the part of it that is worth it; above which a point is
#: not resolved.
FITTED, WORTH, RESOLVED = 1e-2, 0.5, 1e-1
#: Residual, over what rounding leaves, that has norm 1.
_NOISE = 3e10
#: Strain by which sigma may miss the stress of u and the tangent is that of u's own stress.
_OWN = 1e-7


@dataclass(frozen=True)
class Factored:
    """The tangent at a state, factored."""

    of: RodEquations
    rod: Rod
    problem: RodProblem
    whole: scipy.sparse.csc_matrix
    factors: Factor
    unstable: int

    def _six(self, nodal: FloatArray) -> FloatArray:
        """Steps (n, 6) that z (n, 7) makes."""
        turn = 4.0 * np.einsum("nkm,nk->nm", self.of.turns(self.rod), nodal[:, 3:])
        return np.concatenate([nodal[:, :3], turn], axis=1)

    def _seven(self, step: FloatArray, nodal: FloatArray) -> FloatArray:
        """z (n, 7) of steps (n, 6), with what of `nodal` is along the quaternions."""
        q = self.rod.q
        dq = np.einsum("nkm,nm->nk", self.of.turns(self.rod), step[:, 3:])
        along = np.einsum("nk,nk->n", q, nodal[:, 3:])[:, None] * q
        return np.concatenate([step[:, :3], dq + along], axis=1)

    def solve(self, b: FloatArray) -> FloatArray:
        """K^-1 b."""
        if b.ndim == 2:
            return np.column_stack([self.solve(column) for column in b.T])
        nodal, beta = self.of.split(b)
        balance, right = self.of.balance, self._six(nodal).ravel()
        held = balance.held @ right
        free = self.factors.solve(balance.free.T @ (right - self.whole @ held))
        if free is None:
            return np.full_like(b, np.nan)
        step = (held + balance.free @ free).reshape(-1, 6)
        elements = self.of.elements
        change = elements.stress(self.rod, self.problem, step) - elements.stress(self.rod, self.problem)
        return self.of.joined(self._seven(step, nodal), change - beta)

    def solve_transposed(self, b: FloatArray) -> FloatArray:
        """K^-T b."""
        nodal, beta = self.of.split(b)
        balance, elements = self.of.balance, self.of.elements
        size = self.problem.section.stiffness / elements.weights[..., None]
        pulled = elements.residual(self.rod, self.problem, beta * size) + elements.loads(self.rod, self.problem)
        right = (self._six(nodal) * _DUAL + pulled).ravel()
        free = self.factors.solve(balance.free.T @ right)
        if free is None:
            return np.full_like(b, np.nan)
        step = balance.free @ free
        step = step + balance.held @ (right - self.whole.T @ step)
        return self.of.joined(self._seven(step.reshape(-1, 6) / _DUAL, nodal), -beta)


@dataclass(frozen=True, eq=False)
class RodEquations(Unbounded):
    """problem_at: t -> the rod there, held alike at every t; constant_at: what its energies leave out."""

    problem_at: ProblemAt
    elements: Elements
    constant_at: Callable[[float], float] = lambda t: 0.0

    @cached_property
    def balance(self) -> Balance:
        """What is free."""
        return Balance(self.elements, self.problem_at(0.0))

    @property
    def size(self) -> int:
        """Numbers of nodes and Gauss points."""
        return 7 * len(self.elements.s) + 6 * self.elements.points.size

    def split(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(n, 7) and stresses (e, g, 6)."""
        nodal, stress = np.split(z, [7 * len(self.elements.s)])
        return nodal.reshape(-1, 7), stress.reshape(*self.elements.points.shape, 6)

    def joined(self, nodal: FloatArray, stress: FloatArray) -> FloatArray:
        """z."""
        return np.concatenate([nodal.ravel(), stress.ravel()])

    def rod(self, z: FloatArray) -> tuple[Rod, FloatArray]:
        """The state of z, quaternions of length 1, and what lengths they have."""
        nodal, _ = self.split(z)
        length = np.linalg.norm(nodal[:, 3:], axis=1)
        return Rod(nodal[:, :3], nodal[:, 3:] / length[:, None]), length

    def turns(self, rod: Rod) -> FloatArray:
        """(n, 4, 3): dq by turns."""
        return np.einsum("ni,ikm->nkm", rod.q, _TURN)

    def residual(self, z: FloatArray, t: float) -> FloatArray:
        """G (n,); nan where the scene cannot be."""
        try:
            problem = self.problem_at(t)
        except ValueError:
            return np.full(self.size, np.nan)
        rod, length = self.rod(z)
        stress = self.elements.stress(rod, problem)
        force = self.elements.residual(rod, problem).ravel()
        step = (self.balance.free @ (self.balance.free.T @ force)).reshape(-1, 6) - self.balance.gap(rod, problem)
        dq = np.einsum("nkm,nm->nk", self.turns(rod), step[:, 3:]) + (length - 1.0)[:, None] * rod.q
        return self.joined(np.concatenate([step[:, :3], dq], axis=1), stress - self.split(z)[1])

    def norm(self, residual: FloatArray) -> float:
        """Out of balance, 3e-11 being at the least what the rounding of the stiffest strain leaves on the shortest
        element, and the strain by which stresses miss."""
        nodal, stress = self.split(residual)
        stiffness = self.problem_at(0.0).section.stiffness
        missed = float(np.abs(stress / stiffness).max())
        shortest = float(np.diff(self.elements.joints).min())
        noise = 2.0 * float(np.finfo(np.float64).eps) * float(stiffness.max()) / shortest
        rounding = max(1.0, _NOISE * noise)
        size = max(float(np.abs(nodal).max()) / rounding, missed)
        return size if np.isfinite(size) else np.inf

    def rate(self, z: FloatArray, t: float) -> FloatArray:
        """dG/dt by differences."""
        return rate_by_differences(self.residual, z, t)

    def factor(self, z: FloatArray, t: float) -> Factored | None:
        """The tangent, factored."""
        try:
            problem = self.problem_at(t)
        except ValueError:
            return None
        rod, _ = self.rod(z)
        if not np.all(np.isfinite(z)):
            return None
        own, sigma = self.elements.stress(rod, problem), self.split(z)[1]
        missed = float(np.abs((sigma - own) / problem.section.stiffness).max())
        used = own if missed <= _OWN else sigma
        whole, factors = self.balance.factor(rod, problem, used)
        if factors.negative is None:
            return None
        return Factored(self, rod, problem, whole, factors, factors.negative)

    @cached_property
    def _weights(self) -> FloatArray:
        free = self.balance.free @ self.balance.free.T
        return np.asarray(self.elements.mass(self.problem_at(0.0))[:, :1] * free.diagonal().reshape(-1, 6)[:, :3])

    def mass(self, v: FloatArray) -> FloatArray:
        """L2 product of positions; what is held does not count."""
        nodal, stress = self.split(v)
        out = np.zeros_like(nodal)
        out[:, :3] = self._weights * nodal[:, :3]
        return self.joined(out, np.zeros_like(stress))

    def stepped(self, z: FloatArray, dz: FloatArray) -> FloatArray:
        """z + dz, quaternions of length 1."""
        rod, _ = self.rod(z + dz)
        return self.joined(np.concatenate([rod.r, rod.q], axis=1), self.split(z + dz)[1])

    def moved(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[RodEquations, FloatArray, FloatArray]:
        """As many elements where the rod is pulled into layers (`shellref.rod.layers`); itself where they resolve
        them."""
        rod, problem = self.rod(z)[0], self.problem_at(t)
        before = missed(self.elements, rod, problem)
        if not before > FITTED:
            return self, z, directions
        joints = fitted(self.elements, rod, problem)
        if not missed(self.elements, rod, problem, joints) < WORTH * before:
            return self, z, directions
        return self._carried(joints, z, t, directions)

    def resolved(self, z: FloatArray, t: float) -> bool:
        """Whether its elements resolve the layers of a rod that is pulled."""
        return missed(self.elements, self.rod(z)[0], self.problem_at(t)) <= RESOLVED

    def finer(self, z: FloatArray, t: float, directions: FloatArray) -> tuple[RodEquations, FloatArray, FloatArray]:
        """Elements half as long."""
        old = self.elements.joints
        return self._carried(np.sort(np.concatenate([old, 0.5 * (old[1:] + old[:-1])])), z, t, directions)

    def _carried(
        self, joints: FloatArray, z: FloatArray, t: float, directions: FloatArray
    ) -> tuple[RodEquations, FloatArray, FloatArray]:
        """The system between these joints, on the same curve; stretch and shear of its interpolation begin at zero."""
        new = replace(self, elements=Elements(joints, self.elements.degree))
        rod = Rod(*self.elements.at(self.rod(z)[0], new.elements.s))
        stress = new.elements.stress(rod, self.problem_at(t))
        stress[..., :3] = 0.0
        carried = np.zeros((new.size, directions.shape[1]))
        for k in range(directions.shape[1]):
            along = np.zeros((len(new.elements.s), 7))
            line = Rod(self.split(directions[:, k])[0][:, :3], self.rod(z)[0].q)
            along[:, :3] = self.elements.at(line, new.elements.s)[0]
            carried[:, k] = new.joined(along, np.zeros_like(stress))
        return new, new.joined(np.concatenate([rod.r, rod.q], axis=1), stress), carried

    def energy(self, z: FloatArray, t: float) -> float:
        """Total energy less that of the rest shape, D w / l."""
        found = energy_of(self.elements, self.rod(z)[0], self.problem_at(t))
        return float(found.elastic + found.gravity + found.force) - self.constant_at(t)


def branch_start(scene_at: Callable[[float], Scene], state: State) -> BranchStart:
    """The branch through a state at t = 0. `BadInput` for a state that is no equilibrium, and for a load without a
    potential, by whose tangent stability cannot be counted."""
    if not state.is_equilibrium:
        raise BadInput(
            "SCENE", scene_at(0.0).name, f"has no equilibrium where the branch would begin: {state.message}",
            "begin elsewhere (--from), or give a [seed] or a [[path]] that leads there",
        )  # fmt: skip
    result: RodResult = state.native
    if not result.problem.conservative:
        why = "of fixed direction on an end that turns has no potential: its tangent's inertia counts no modes"
        raise BadInput("tip.moment", None, why, "hold the end's frame, or leave it out")

    def problem_at(t: float) -> RodProblem:
        try:
            return problem_of(scene_at(t))
        except BadInput as error:
            raise ValueError(str(error)) from None

    system = RodEquations(problem_at, result.elements, lambda t: natural_constant(scene_at(t).curvature))
    rod = result.state
    z = system.joined(np.concatenate([rod.r, rod.q], axis=1), result.elements.stress(rod, problem_at(0.0)))

    def shape(point: Point) -> Shape:
        assert isinstance(point.system, RodEquations)
        found = replace(
            result, elements=point.system.elements, state=point.system.rod(point.z)[0], problem=problem_at(point.t)
        )
        return RodShape(found, scene_at(point.t).width)

    def others(count: int) -> Iterator[tuple[str, System, FloatArray]]:
        return iter(())

    def force(point: Point, shape: Shape) -> FloatArray | None:
        assert isinstance(point.system, RodEquations)
        problem = problem_at(point.t)
        held = problem.end.position is not None
        return reactions(point.system.elements, point.system.rod(point.z)[0], problem)[1].force if held else None

    return BranchStart(state, system, z, shape, others, force=force)
