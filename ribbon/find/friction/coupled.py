"""Shape, pushes and friction found at once by Newton's method, ``|T| = mu N`` in it (docs/theory.md, eq. (5.26)).

Rounds with the bounds b known (`ribbon.find.friction.increment`) take mu N of one round for b of the next, and do not
settle where pushes answer to friction with more than it: left and right edge of a strip that lies flat, which twists
for next to nothing. With the rows that push, c_a = 0, and ``b_k = mu N_k``, ``N_k = - sum of rows_k``, an increment is

    E_x + sum T_x u_k + J_a^T rows = 0 ,   c_a = 0 ,   T_k = b_k t / |t| (slips) ,   d T_k / d rows_k = - mu t / |t| ,

a system that is not symmetric. Which rows push is put right with each step (M. Hintermueller, K. Ito, K. Kunisch 2002,
doi:10.1137/S1052623401383558). Where rows are more than what they hold, a term ``-R`` on their diagonal keeps the
matrix regular (R. T. Rockafellar 1976, doi:10.1287/moor.1.2.97), and what is undetermined of them is left as it is
(`ribbon.find.friction.pushes`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon.find.friction import pushes
from ribbon.problems.friction.particles import Rub
from ribbon.problems.mixed import MixedProblem
from ribbon.solvers.problem import RESIDUAL_TOLERANCE, Minimum, kkt_residual

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Push over distance (D w / l^3, over the largest push, at least 1) from which a row pushes; below it it is left open.
_PUSHING = 1e4
#: Multiplier of an unknown's bound from which it is there; an interior point leaves less everywhere.
_AT_BOUND = 1e-6
#: How far (l) a joint may go in a step: what goes farther has left the state beside which it began.
_FAR = 0.1
#: Singular value, over the largest, below which rounding alone would tell pushes apart.
_HARDLY = 1e-7
#: Newton's steps at the most; what keeps the matrix regular where nothing does: of the unknowns over the Hessian's
#: largest entry, of the rows, and of what is undetermined of them (l^3 / (D w)).
_STEPS, _PROXIMAL, _ROWS, _KEPT = 12, 1e-13, 1e-7, 1.0


def settled(
    problem: MixedProblem, minimum: Minimum, rubs: tuple[Rub, ...], pushing: Sequence[IntArray]
) -> tuple[MixedProblem, Minimum] | None:
    """The problem with the bounds of its equilibrium, and that, from `minimum` on with what rubs; None where Newton's
    method does not arrive. pushing: of each rub the numbers of the rows whose pushes bound it."""
    if not rubs:
        return None
    below, above = problem.constraint_bounds()
    open_ = below < above
    lower, upper = problem.bounds()
    bound = np.abs(minimum.multipliers) > _AT_BOUND
    free = np.flatnonzero((lower < upper) & ~bound)
    minimum = replace(minimum, multipliers=np.where(bound | (lower == upper), minimum.multipliers, 0.0))
    x, rows = minimum.x.copy(), minimum.rows.copy()
    places = problem.layout.positions(np.arange(problem.size, dtype=float))
    kept, before = None, np.empty(0, dtype=int)
    least, last, found = np.inf, np.inf, None
    for k in range(_STEPS + 1):
        now = problem.with_changes(rubs=_bounded(problem, rubs, pushing, rows))
        residual = kkt_residual(now, x, minimum.multipliers, rows)
        if residual < least and not (rows[open_] > 0.0).any():
            least, found = residual, (now, replace(minimum, x=x.copy(), rows=rows.copy(), residual=residual))
        arrived = k > 0 and 0.5 * last <= residual <= RESIDUAL_TOLERANCE
        if arrived or k == _STEPS or not np.isfinite(now.gradient(x)).all():
            break
        last = residual
        held = _held(now, x, rows, open_, below)
        if not np.array_equal(held, before):
            kept, before = pushes.undetermined(now, x, held[open_[held]], np.flatnonzero(~open_), _HARDLY), held
        rows[np.setdiff1d(np.arange(rows.size), held)] = 0.0
        step = _step(now, x, rows, held, free, below, pushing, kept)
        if step is None or float(np.abs(step[: free.size][np.isin(free, places)]).max(initial=0.0)) > _FAR:
            break
        x[free] += step[: free.size]
        rows[held] += step[free.size :]
    if found is None or least > RESIDUAL_TOLERANCE:
        return None
    found[0].counters.add(problem.counters)
    return found[0], replace(found[1], iterations=k)


def _bounded(
    problem: MixedProblem, rubs: tuple[Rub, ...], pushing: Sequence[IntArray], rows: FloatArray
) -> tuple[Rub, ...]:
    return tuple(
        rub._replace(bound=float(max(0.0, -problem.walls[rub.wall].friction * rows[own].sum())))
        for rub, own in zip(rubs, pushing, strict=True)
    )


def _held(
    problem: MixedProblem, x: FloatArray, rows: FloatArray, open_: NDArray[np.bool_], below: FloatArray
) -> IntArray:
    """Numbers of the rows that are equations, and of those that push."""
    scale = _PUSHING * max(1.0, float(np.abs(rows[open_]).max(initial=0.0)))
    slack = (problem.constraints(x) - below)[open_]
    held = ~open_
    held[open_] = -rows[open_] > scale * slack
    return np.flatnonzero(held)


def _step(
    problem: MixedProblem, x: FloatArray, rows: FloatArray, held: IntArray, free: IntArray, below: FloatArray,
    pushing: Sequence[IntArray], kept: pushes.Undetermined | None,
) -> FloatArray | None:  # fmt: skip
    """Newton's step of the free unknowns and of the rows that are held, of which what is undetermined (`kept`) stays as
    it is; None where there is none."""
    jacobian = problem.jacobian_matrix(x)[held].tocsc()[:, free]
    hessian = problem.hessian_matrix(x, rows)[free].tocsc()[:, free]
    size = float(np.abs(hessian.data).max(initial=1.0))
    slips = _slipping(problem, x, pushing)[free].tocsc()[:, held]
    firm = _ROWS * scipy.sparse.eye_array(held.size)
    if kept is not None:
        own = np.searchsorted(held, kept.walls)
        down, across = np.repeat(own, own.size), np.tile(own, own.size)
        values = _KEPT * (kept.null @ kept.null.T).ravel()
        firm = firm + scipy.sparse.csr_array((values, (down, across)), shape=(held.size, held.size))
    block = scipy.sparse.block_array(
        [
            [hessian + _PROXIMAL * size * scipy.sparse.eye_array(free.size), jacobian.T + slips],
            [jacobian, -firm],
        ],
        format="csc",
    )
    left = problem.gradient(x)[free] + jacobian.T @ rows[held]
    missed = (problem.constraints(x) - below)[held]
    try:
        step = scipy.sparse.linalg.splu(block).solve(-np.concatenate([left, missed]))
    except RuntimeError:  # exactly singular
        return None
    return np.asarray(step) if np.isfinite(step).all() else None


def _slipping(problem: MixedProblem, x: FloatArray, pushing: Sequence[IntArray]) -> scipy.sparse.csr_array:
    """By how much the gradient (n,) changes with the rows (m,) that bound places which slip."""
    down: list[FloatArray] = []
    across: list[FloatArray] = []
    values: list[FloatArray] = []
    assert problem.friction is not None
    friction = problem.friction
    for group in friction.groups:
        u = np.column_stack([rows.values(x) - friction.place[group.which] @ e
                             for e, rows in zip(group.along, group.rows, strict=True)])  # fmt: skip
        t = friction.guess[group.which] @ group.along.T + friction.stiffness[group.which][:, None] * u
        size = np.linalg.norm(t, axis=1)
        slopes = [rows.jacobian(x).reshape(rows.count, -1) for rows in group.rows]
        for j in np.flatnonzero(size > friction.bound[group.which]):
            k = group.which[j]
            own, columns = pushing[k], group.rows[0].columns[j]
            slope = (t[j, 0] * slopes[0][j] + t[j, 1] * slopes[1][j]) / size[j]
            down.append(np.repeat(columns, own.size))
            across.append(np.tile(own, columns.size))
            values.append(np.repeat(-problem.walls[problem.rubs[k].wall].friction * slope, own.size))
    if not values:
        return scipy.sparse.csr_array((problem.size, problem.row_count))
    entries = np.concatenate(values), (np.concatenate(down), np.concatenate(across))
    return scipy.sparse.csr_array(entries, shape=(problem.size, problem.row_count))
