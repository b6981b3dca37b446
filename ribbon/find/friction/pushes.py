"""Of all pushes that hold one equilibrium the least (docs/theory.md, eq. (5.26)).

A strip that lies flat has more places that push than what bends it.

Along a line of contact rows are more than the unknowns that they hold, and the multipliers of a minimum are then known
but for the null space of ``J^T``. Which of them a minimiser ends with is left to its last step, so that bounds mu N
would jump from round to round, and right and left edge share a push as rounding has it. The least ones,

    min |N|^2 / 2 ,   J_w^T N + J_g^T m = const ,   N >= 0 ,

(J_w: the walls' rows, J_g: what else has rows) are one vector, mirrored with the strip. With an orthonormal basis Z of
the null space that is the least ``|u|`` with ``N + Z u >= 0`` (C. L. Lawson and R. J. Hanson 1995, chapter 23,
doi:10.1137/1.9781611971217). No push that is determined is changed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon.find import contacts
from ribbon.problems.friction.particles import Rub
from ribbon.problems.mixed import MixedProblem
from ribbon.solvers.problem import RESIDUAL_TOLERANCE, Minimum, kkt_residual

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Lengths along the strip (l), or places across, up to which two places are one.
ONE = 1e-8
#: Distance (l) from its wall up to which a row may push.
_TOUCHES = 1e-9
#: Singular value, over the largest, below which pushes change nothing but each other.
_NULL = 1e-10
#: What keeps the equations' matrix regular, over its largest entry.
_FIRM = 1e-14


@dataclass(frozen=True)
class Undetermined:
    """Pushes that change nothing but each other: walls (n,), others (g,): numbers of the rows that may push, and of
    those that are equations; null (n, k): orthonormal basis of such pushes; carried (g, n): what the equations' rows
    take over of a push."""

    walls: IntArray
    others: IntArray
    null: FloatArray
    carried: FloatArray

    def along(self, rows: FloatArray, change: FloatArray) -> FloatArray:
        """Rows (m,) with a change (n,) of the walls' that is in the null space."""
        found = rows.copy()
        found[self.walls] += change
        found[self.others] -= self.carried @ change
        return found


def undetermined(
    problem: MixedProblem, x: FloatArray, walls: IntArray, others: IntArray, below: float = _NULL
) -> Undetermined | None:
    """What is undetermined of the rows `walls` that push and the rows `others` that are equations; None where nothing
    is. below: singular value, over the largest, up to which pushes are that."""
    if walls.size < 2:
        return None
    lower, upper = problem.bounds()
    jacobian = problem.jacobian_matrix(x).tocsc()[:, lower < upper].tocsr()
    held, pushing = jacobian[others], jacobian[walls].T.toarray()
    square = held @ held.T
    firm = _FIRM * abs(square).max() * scipy.sparse.eye_array(others.size)  # rows of what a clamp holds are empty
    try:
        carried = np.asarray(scipy.sparse.linalg.splu((square + firm).tocsc()).solve(held @ pushing))
    except RuntimeError:  # exactly singular: nothing can be told apart
        return None
    null = _null(pushing - held.T @ carried, below)
    return Undetermined(walls, others, null, carried) if null.shape[1] else None


def least(problem: MixedProblem, minimum: Minimum) -> Minimum:
    """The same minimum with the least pushes of its walls; as it is where all are determined."""
    free = undetermined(problem, minimum.x, *_rows(problem, minimum))
    if free is None:
        return minimum
    rows = free.along(minimum.rows, -_change(free.null, -minimum.rows[free.walls]))
    rows[free.walls] = np.minimum(rows[free.walls], 0.0)
    residual = kkt_residual(problem, minimum.x, minimum.multipliers, rows)
    if residual > max(RESIDUAL_TOLERANCE, minimum.residual):
        return minimum
    return replace(minimum, rows=rows, residual=residual)


def bounding(problem: MixedProblem, x: FloatArray, rubs: tuple[Rub, ...]) -> list[IntArray]:
    """Of each of the places that rub at x (`ribbon.find.friction.increment.rubbing`) the numbers of the rows that push
    it: a place at a joint may have two."""
    slices = problem.block_slices()
    numbers: dict[int, IntArray] = {}
    places: dict[int, FloatArray] = {}
    for k in {rub.wall for rub in rubs}:
        own = [slices[name] for name in (f"wall_{k}", f"touch_{k}") if name in slices]
        numbers[k] = np.concatenate([np.arange(where.start, where.stop) for where in own])
        points = contacts.pushed(problem, x, np.zeros(problem.row_count), k)
        across = contacts.across(problem, x, k)
        places[k] = np.array([(s, side, v) for (s, side, _), v in zip(points, across, strict=True)])
    return [
        numbers[rub.wall][np.all(np.abs(places[rub.wall] - (rub.s, contacts.line(rub.side), rub.side)) <= ONE, axis=1)]
        for rub in rubs
    ]


def _rows(problem: MixedProblem, minimum: Minimum) -> tuple[IntArray, IntArray]:
    """Numbers of the walls' rows that may push, and of the rows that are equations."""
    below, above = problem.constraint_bounds()
    slack = problem.constraints(minimum.x) - below
    walls = np.zeros(below.size, dtype=bool)
    for name, where in problem.block_slices().items():
        if name.startswith(("wall_", "touch_")):
            walls[where] = True
    may = walls & (below < above) & ((slack <= _TOUCHES) | (minimum.rows != 0.0))
    return np.flatnonzero(may), np.flatnonzero(below == above)


def _null(matrix: FloatArray, below: float) -> FloatArray:
    """Orthonormal basis (n, k) of what a matrix (m, n) takes to nothing."""
    _, sizes, right = np.linalg.svd(np.linalg.qr(matrix, mode="r"))
    rank = int(np.sum(sizes > below * sizes[0])) if sizes.size else 0
    return np.asarray(right[rank:].T)


def _change(null: FloatArray, pushes: FloatArray) -> FloatArray:
    """What (n,) of the null space to add to pushes (n,) >= 0, so that they are least and still >= 0."""
    own = null.T @ pushes
    least = pushes - null @ own
    if least.min() >= 0.0:
        return least - pushes
    system = np.vstack([null.T, -least / np.abs(least).max()])
    try:
        weights, _ = scipy.optimize.nnls(system, np.append(np.zeros(null.shape[1]), 1.0))
    except RuntimeError:  # it made all its steps: the pushes stay as they are
        return np.zeros_like(pushes)
    at_rest = weights > 0.0  # these push nothing
    own_change = np.linalg.lstsq(null[at_rest], -least[at_rest], rcond=None)[0]
    return np.asarray(null @ (own_change - own))
