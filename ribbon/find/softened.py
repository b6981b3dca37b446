"""The ribbon with the energy that a strip of finite thickness gains across its width (`ribbon.energies.edge_layer`).

A problem around the ribbon's: same unknowns, bounds and constraints, and the term `softening` added to the energy, its
gradient and its Hessian. Its minimum, warm started from the ribbon's, is a first-order picture of where the shell goes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbon import law
from ribbon.energies import ENERGIES
from ribbon.notes import Note
from ribbon.problems import chained_kernels as kernels
from ribbon.problems.chained import ChainedProblem
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Matrix, Problem
from ribbon.result import Energy, Equilibrium, Status
from ribbon.solvers import newton_dense, newton_rows
from ribbon.solvers.problem import Minimum

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)
_NODES, _WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS
#: Gradient up to which the minimum is found; it is an estimate, not a solution.
_TOLERANCE = 1e-7
_MOST_ITERATIONS = 60
#: Places of the second derivatives of a jet in their matrix.
_UPPER = np.triu_indices(4)


class SoftenedProblem:
    """A ribbon's problem with the softening of a strip of thickness h (in l): its unknowns, bounds and rows."""

    def __init__(self, inner: ChainedProblem | MixedProblem, thickness: float) -> None:
        self.inner = inner
        self.strip, self.slack, self.size = inner.strip, inner.slack, inner.size
        self.relaxed = ENERGIES[inner.energy].relaxed(inner.strip.poisson, inner.strip.relative_width, thickness)
        self.lengths: FloatArray = inner.lengths
        joints = np.concatenate([[0.0], np.cumsum(self.lengths)])
        s = joints[:-1, None] + self.lengths[:, None] * _NODES
        self.natural = law.at(inner.strip.curvature, s)
        self._known: tuple[bytes, tuple[FloatArray, FloatArray, FloatArray]] | None = None

    @property
    def rows(self) -> _WithRows | None:
        """The problem with the rows of the ribbon's; None where that has none."""
        return None

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Those of the ribbon's problem."""
        return self.inner.bounds()

    def _terms(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Value (p,), gradient (p, 4), Hessian (p, 4, 4) by (a, b, n, m) of every segment: omega = a t + b is the first
        of two fields, eta = n t + m the second."""
        key = np.ascontiguousarray(x, dtype=float).tobytes()
        if self._known is not None and self._known[0] == key:
            return self._known[1]
        q = self.inner.parameters(x)
        t = self.lengths[:, None] * _NODES
        omega = q[:, 0:1] * t + q[:, 1:2]
        eta = q[:, 2:3] * t + q[:, 3:4]
        value, gradient, hessian = self.relaxed.softening(omega, eta, self.natural)
        weight = self.lengths[:, None] * _WEIGHTS
        moments = np.stack([weight * t * t, weight * t, weight], axis=1)  # (p, 3, g)
        first = moments[:, 1:] @ gradient  # (p, slope or value, field)
        second = (moments @ hessian.reshape(*t.shape, 4)).reshape(-1, 3, 2, 2)
        blocks = second[:, [[0, 1], [1, 2]]]  # (p, slope or value, the same, field, field)
        found = (
            (weight * value).sum(axis=1),
            first.transpose(0, 2, 1).reshape(-1, 4),
            blocks.transpose(0, 3, 1, 4, 2).reshape(-1, 4, 4),
        )
        self._known = key, found
        return found

    def value(self, x: FloatArray) -> float:
        """Energy, D w / l."""
        return float(self.inner.value(x)) + float(self._terms(x)[0].sum())


class _WithoutRows(SoftenedProblem):
    """Of the chained model: a dense Hessian."""

    inner: ChainedProblem

    def gradient(self, x: FloatArray) -> FloatArray:
        """Gradient (n,)."""
        gradient = np.empty(self.size)
        kernels.assemble_gradient(self.lengths, self._jets(x)[0], gradient)
        return gradient

    def hessian(self, x: FloatArray) -> FloatArray:
        """Dense Hessian (n, n)."""
        hessian = np.empty((self.size, self.size))
        local, u, v = self._jets(x)
        kernels.assemble_hessian(self.lengths, local, self.inner.is_loaded, u, v, hessian)
        return hessian

    def _jets(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """As the ribbon's, with the term."""
        local, u, v = self.inner.jets(x)
        _, gradient, hessian = self._terms(x)
        local = local.copy()
        local[:, 1:5] += gradient
        local[:, 5:] += hessian[:, _UPPER[0], _UPPER[1]]
        return local, u, v


class _WithRows(SoftenedProblem):
    """Of the mixed model: the same rows, more entries in the Hessian."""

    inner: MixedProblem

    def __init__(self, inner: MixedProblem, thickness: float) -> None:
        super().__init__(inner, thickness)
        self._columns, self._slopes = inner.parameter_map()
        self._pairs = [(i, j) for i in range(4) for j in range(i + 1)]
        ends = [self._columns[:, i] for i in range(4)]
        rows = np.concatenate([np.maximum(ends[i], ends[j]) for i, j in self._pairs])
        columns = np.concatenate([np.minimum(ends[i], ends[j]) for i, j in self._pairs])
        known = inner.hessian_structure()
        self._structure = np.concatenate([known[0], rows]), np.concatenate([known[1], columns])

    @property
    def rows(self) -> _WithRows:
        """Itself."""
        return self

    def gradient(self, x: FloatArray) -> FloatArray:
        """Gradient (n,)."""
        added = self._terms(x)[1]
        gradient = np.array(self.inner.gradient(x))
        np.add.at(gradient, self._columns, np.einsum("pj,pjk->pk", added, self._slopes))
        return gradient

    def constraint_bounds(self) -> tuple[FloatArray, FloatArray]:
        """Those of the ribbon's problem, as all that has to do with rows."""
        return self.inner.constraint_bounds()

    def constraints(self, x: FloatArray) -> FloatArray:
        """(m,)."""
        return self.inner.constraints(x)

    def elimination(self) -> tuple[IntArray, IntArray]:
        """The order along the strip: of unknowns (n,) and rows (m,)."""
        return self.inner.elimination()

    def jacobian_structure(self) -> tuple[IntArray, IntArray]:
        """Rows and columns of the Jacobian's entries."""
        return self.inner.jacobian_structure()

    def jacobian(self, x: FloatArray) -> FloatArray:
        """The entries."""
        return self.inner.jacobian(x)

    def jacobian_matrix(self, x: FloatArray) -> Matrix:
        """Sparse (m, n)."""
        return self.inner.jacobian_matrix(x)

    def hessian(self, x: FloatArray, multipliers: FloatArray, factor: float = 1.0) -> FloatArray:
        """The Hessian's entries in `hessian_structure`."""
        added = self._terms(x)[2]
        local = np.einsum("pij,pik,pjl->pkl", added, self._slopes, self._slopes)
        entries = [local[:, i, j] for i, j in self._pairs]
        return np.concatenate([self.inner.hessian(x, multipliers, factor), factor * np.concatenate(entries)])

    def hessian_structure(self) -> tuple[IntArray, IntArray]:
        """Rows and columns of the entries; some places come twice and add."""
        return self._structure


def softened(problem: Problem, thickness: float) -> _WithoutRows | _WithRows:
    """The problem of a strip of thickness h (in l) around a chained or a mixed one."""
    if isinstance(problem, MixedProblem):
        return _WithRows(problem, thickness)
    assert isinstance(problem, ChainedProblem)
    return _WithoutRows(problem, thickness)


def _minimum(problem: _WithoutRows | _WithRows, near: Equilibrium, options: dict[str, Any]) -> Minimum:
    if isinstance(problem, _WithRows):
        return newton_rows.minimise(problem, near.x, options, warm=(near.rows, near.multipliers))
    return newton_dense.minimise(problem, near.x, options, warm=near.multipliers)


def soften(equilibrium: Equilibrium, thickness: float) -> Equilibrium | None:
    """The ribbon at the minimum of its softened energy near `equilibrium`; None where it has not been found.

    thickness: h in l. The formulations "chained" (one clamp) and "mixed" are possible. The answer tells the shape and
    its energies of the ribbon, by part; whether the softened state is stable is not judged.
    """
    problem = equilibrium.problem
    if problem.formulation not in ("chained", "mixed") or (problem.formulation == "chained" and problem.row_count):
        return None
    options = {"tol": _TOLERANCE, "max_iter": _MOST_ITERATIONS}
    minimum = _minimum(softened(problem, thickness), equilibrium, options)
    if not minimum.residual < 100.0 * _TOLERANCE:
        return None
    return Equilibrium(
        problem=problem,
        status=Status.CONVERGED,
        message=Note.SOFTENED.text(thickness=thickness),
        notes=(Note.SOFTENED,),
        x=minimum.x,
        multipliers=minimum.multipliers,
        rows=minimum.rows,
        residual=minimum.residual,
        iterations=minimum.iterations,
        evaluations={},
        energy=Energy(*(float(v) for v in problem.energy_parts(minimum.x))),
        stable=None,
        lowest_eigenvalue=float("nan"),
        mode=np.zeros(problem.size),
        active_bounds=0,
        seconds={"solve": minimum.seconds, "stability": 0.0},
        options=dict(options),
        penetration=None,
        solver=minimum.solver,
    )
