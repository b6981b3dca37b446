"""The tangent of an equilibrium: its optimality (KKT) system on free unknowns and active rows, factored once.

An equilibrium is a root of ``F = grad E + A^T lambda`` on the unknowns that nothing holds and of ``c = 0`` on the rows
that hold (glue, clamps, seams, gauges, contacts that push). Held unknowns are those eliminated by clamps and gauges and
slopes of rulings on their bound. Matrix: docs/theory.md, eq. (11.1). A chained ribbon is taken over to the unknowns of
the glued one, where its multipliers follow from the glue alone: the same point, and a sparse system.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon.element import quaternion
from ribbon.errors import NotDifferentiable
from ribbon.judge.reduction import dependent_columns
from ribbon.problems.chained import ChainedProblem
from ribbon.problems.layout import ETA
from ribbon.problems.mixed import MixedProblem
from ribbon.result import Equilibrium, Status

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

#: A bound or one-sided row whose multiplier and slack are both below this is neither held nor free.
DEGENERATE = 1e-6
#: Estimated condition (1-norm, rows and columns scaled) from which the tangent counts as singular: derivatives would
#: have fewer than three digits.
SINGULAR = 1e13
#: |omega| l and |eta| below which a joint counts as straight, and its ruling as the one that is kept.
_STRAIGHT = 1e-7
_SCALINGS = 8
#: Largest entry of a contact's row below which no free unknown moves it: a wall that a clamp stands on.
_MOVED = 1e-12
#: Softness, after scaling, of contacts: many that touch at once are redundant, and share their force as evenly as they
#: can. What it costs in accuracy the refinements give back.
_SOFT = 1e-9
_REFINEMENTS = 3
#: Largest share of a change that rows may be missed by.
_MISSED = 1e-6


@dataclass(frozen=True)
class Point:
    """An equilibrium in the unknowns of the glued ribbon: x, multipliers of bounds (n,), of rows (m,)."""

    problem: MixedProblem
    x: FloatArray
    rows: FloatArray
    multipliers: FloatArray


def point(equilibrium: Equilibrium, *, unstable: bool = False) -> Point:
    """The equilibrium as `Point`.

    unstable: also one that is not stable. Raises `NotDifferentiable` for what is no equilibrium.
    """
    require_equilibrium(equilibrium, unstable=unstable)
    old: Any = equilibrium.problem
    if isinstance(old, MixedProblem) and old.pairs:
        raise NotDifferentiable("itself", "it touches itself, and how its pairs of places move is not known")
    if old.row_count:
        return Point(old, equilibrium.x, equilibrium.rows, equilibrium.multipliers)
    problem = glued(old)
    omega, eta = old.joint_values(equilibrium.x)
    x = problem.state(omega, eta, old.in_plane_values(equilibrium.x))
    gradient, jacobian = problem.gradient(x), problem.jacobian_matrix(x)
    dependent = dependent_columns(problem)
    rows = scipy.sparse.linalg.splu(scipy.sparse.csc_matrix(jacobian[:, dependent].T)).solve(-gradient[dependent])
    return Point(problem, x, rows, gradient + jacobian.T @ rows)


def require_equilibrium(equilibrium: Equilibrium, *, unstable: bool = False) -> None:
    """Raises `NotDifferentiable` for what is no stable equilibrium; unstable: for what is none at all."""
    allowed = (Status.CONVERGED, Status.SADDLE) if unstable else (Status.CONVERGED,)
    if equilibrium.status not in allowed:
        raise NotDifferentiable(equilibrium.status.code, f"it is no stable equilibrium: {equilibrium.message}")


def glued(old: ChainedProblem) -> MixedProblem:
    """The glued problem of the same strip, whose quaternions begin at the clamp's own."""
    return MixedProblem(
        old.strip, old.start, None, None, (), old.gravity, old.energy, old.lengths,
        reference=tuple(quaternion.from_matrix(old.start.frame).tolist()), exponent_limit=old.exponent_limit,
        stiffness=old.stiffness, in_plane=old.in_plane, tip=old.tip,
    )  # fmt: skip


@dataclass(frozen=True)
class System:
    """Free unknowns (n,), active rows (m,) and the factored tangent of a `Point`."""

    point: Point
    free: BoolArray
    active: BoolArray
    on_bound: BoolArray

    @classmethod
    def of(cls, here: Point) -> System:
        """The system at a point. Raises `NotDifferentiable` where a contact or bound is about to change."""
        problem, x = here.problem, here.x
        lower, upper = problem.bounds()
        fixed = lower == upper
        slack = np.minimum(x - lower, upper - x)
        on_bound = ~fixed & _active("a ruling's slope", slack, np.abs(here.multipliers), ~fixed)
        below, above = problem.constraint_bounds()
        values = problem.constraints(x)
        open_rows = below != above
        gap = np.minimum(values - below, above - values)
        free = ~(fixed | on_bound)
        free[_rulings_of_nothing(problem, x)] = False
        moved = np.asarray(abs(problem.jacobian_matrix(x)[:, free]).max(axis=1).todense()).ravel() > _MOVED
        active = ~open_rows | _active("a contact", gap, np.abs(here.rows), open_rows & moved)
        return cls(here, free, active, on_bound)

    @cached_property
    def hessian(self) -> scipy.sparse.csr_matrix:
        """Hessian (n, n) of the Lagrangian."""
        return self.point.problem.hessian_matrix(self.point.x, self.point.rows)

    @cached_property
    def jacobian(self) -> scipy.sparse.csr_matrix:
        """Jacobian (m, n) of all rows."""
        return self.point.problem.jacobian_matrix(self.point.x)

    @cached_property
    def _scaled(self) -> tuple[scipy.sparse.csc_matrix, FloatArray, Any]:
        """Matrix, its symmetric scaling, and the factors of the scaled matrix."""
        a = self.jacobian[self.active][:, self.free]
        matrix = scipy.sparse.csc_matrix(scipy.sparse.bmat([[self.hessian[self.free][:, self.free], a.T], [a, None]]))
        scale, scaled = _balanced(matrix)
        count = int(self.free.sum())
        below, above = self.point.problem.constraint_bounds()
        soft = np.concatenate([np.zeros(count), np.where((below != above)[self.active], _SOFT, 0.0)])
        try:
            factors = scipy.sparse.linalg.splu(scipy.sparse.csc_matrix(scaled - scipy.sparse.diags(soft)))
        except RuntimeError:
            raise _singular(np.inf) from None
        return matrix, scale, factors

    @cached_property
    def condition(self) -> float:
        """Estimated condition of the scaled matrix in the 1-norm (Higham & Tisseur 2000, as in scipy)."""
        matrix, scale, factors = self._scaled
        n = scale.size
        solve = scipy.sparse.linalg.LinearOperator(
            (n, n), matvec=factors.solve, rmatvec=lambda b: factors.solve(b, "T"), matmat=factors.solve,
            rmatmat=lambda b: factors.solve(b, "T"), dtype=float,
        )  # fmt: skip
        scaled = _times(matrix, scale)
        with np.errstate(all="ignore"):
            inverse = scipy.sparse.linalg.onenormest(solve)
        found = float(inverse * scipy.sparse.linalg.norm(scaled, 1))
        return found if np.isfinite(found) else np.inf

    def check(self) -> None:
        """Raises `NotDifferentiable` where the tangent is singular to rounding."""
        if not self.condition < SINGULAR:
            raise _singular(self.condition)

    def solve(self, gradient: FloatArray, rows: FloatArray, held: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Change of the unknowns (n, k) and of the multipliers (m, k), eq. (11.2).

        gradient (n, k), rows (m, k): derivatives of F and c by k parameters at fixed unknowns; held (n, k): how the
        held unknowns move with them.
        """
        self.check()
        matrix, scale, factors = self._scaled
        right = -np.vstack([
            (gradient + self.hessian @ held)[self.free],
            (rows + self.jacobian @ held)[self.active],
        ])  # fmt: skip
        found = scale[:, None] * factors.solve(scale[:, None] * right)
        for _ in range(_REFINEMENTS):
            found += scale[:, None] * factors.solve(scale[:, None] * (right - matrix @ found))
        missed = np.abs(scale[:, None] * (right - matrix @ found)).max(axis=0)
        if np.any(missed > _MISSED * np.abs(scale[:, None] * right).max(axis=0)):
            raise NotDifferentiable("degenerate", "the contacts that touch cannot all go on touching")
        dx, drows = held.copy(), np.zeros_like(rows)
        count = int(self.free.sum())
        dx[self.free], drows[self.active] = found[:count], found[count:]
        return dx, drows


def _times(matrix: scipy.sparse.csc_matrix, scale: FloatArray) -> scipy.sparse.csc_matrix:
    """The symmetric matrix (n, n) with rows and columns multiplied by `scale` (n,)."""
    columns = np.repeat(scale, np.diff(matrix.indptr))
    return scipy.sparse.csc_matrix((scale[matrix.indices] * matrix.data * columns, matrix.indices, matrix.indptr))


def _balanced(matrix: scipy.sparse.csc_matrix) -> tuple[FloatArray, scipy.sparse.csc_matrix]:
    """Scaling (n,) of a symmetric matrix by the roots of its columns' largest entries, again and again (D. Ruiz, 2001),
    and the matrix so scaled. Raises `NotDifferentiable` where a column is empty."""
    scale, scaled = np.ones(matrix.shape[0]), matrix
    empty = bool(np.any(np.diff(matrix.indptr) == 0))
    for _ in range(_SCALINGS):
        largest = np.zeros(1) if empty else np.sqrt(np.maximum.reduceat(np.abs(scaled.data), matrix.indptr[:-1]))
        if not np.all(largest > 0.0):
            raise NotDifferentiable("singular", "a free unknown or an active row moves nothing")
        scale = scale / largest
        scaled = _times(matrix, scale)
    return scale, scaled


def _active(what: str, slack: FloatArray, push: FloatArray, possible: BoolArray) -> BoolArray:
    """Which of the one-sided conditions hold; strict complementarity is asked for (Nocedal & Wright 2006, 12.3)."""
    both = possible & (slack < DEGENERATE) & (push < DEGENERATE)
    if both.any():
        raise NotDifferentiable(
            "degenerate", f"{what} touches without pushing: the two sides have different derivatives"
        )
    return np.asarray(possible & (push > slack))


def _rulings_of_nothing(problem: MixedProblem, x: FloatArray) -> NDArray[np.int64]:
    """Columns of eta at joints amid straight ones, where the ruling moves nothing: it stays straight."""
    layout = problem.layout
    if problem.fields.free:
        return np.empty(0, dtype=np.int64)
    straight = (np.abs(x[layout.omega]) < _STRAIGHT) & (np.abs(x[layout.eta]) < _STRAIGHT)
    inner = straight.copy()
    inner[1:] &= straight[:-1]
    inner[:-1] &= straight[1:]
    return layout.columns(ETA)[inner]


def _singular(condition: float) -> NotDifferentiable:
    return NotDifferentiable(
        "singular",
        f"its tangent is singular (condition {condition:.1e}): a fold, a bifurcation or a motion that nothing resists",
    )
