"""The saddle-point matrix of a problem with rows, factored along the strip (`ribbon.solvers.frontal`)::

    K = [ H + extra + diag(d) , A^T ]
        [ A                   , -diag(e) ]

H: Hessian of the Lagrangian on the free unknowns (k), A: Jacobian of the rows in force (r). H is positive on the null
space of A, and A has full rank, exactly if K has r negative eigenvalues and none that is zero, for e = 0 (Nocedal and
Wright 2006, theorem 16.3).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbon.solvers.frontal import THRESHOLD, Factor, FloatArray, IntArray, Pattern

BoolArray = NDArray[np.bool_]


class Saddle:
    """Structure of K for a problem with `elimination()`.

    free (n,), rows (m,): which unknowns and rows are in it; extra: places (lower triangle) of further entries among the
    unknowns."""

    def __init__(
        self,
        problem: Any,
        free: BoolArray,
        rows: BoolArray | None = None,
        extra: tuple[IntArray, IntArray] | None = None,
    ) -> None:
        columns, order = problem.elimination()
        rows = np.ones(order.size, dtype=bool) if rows is None else rows
        self.free, self.rows = free, rows
        self.unknowns, self.count = int(free.sum()), int(rows.sum())
        column = np.where(free, np.cumsum(free) - 1, -1)
        row = np.where(rows, self.unknowns + np.cumsum(rows) - 1, -1)
        hessian, jacobian = problem.hessian_structure(), problem.jacobian_structure()
        diagonal = np.arange(self.unknowns + self.count)
        more = ((np.empty(0, dtype=np.int64),) * 2) if extra is None else (column[extra[0]], column[extra[1]])
        one = np.concatenate([column[hessian[0]], column[jacobian[1]], more[0], diagonal])
        other = np.concatenate([column[hessian[1]], row[jacobian[0]], more[1], diagonal])
        self.pattern = Pattern(one, other, np.concatenate([columns[free], order[rows]]))

    def factor(
        self,
        hessian: FloatArray,
        jacobian: FloatArray,
        diagonal: FloatArray | float = 0.0,
        soft_rows: FloatArray | float = 0.0,
        extra: FloatArray | None = None,
        soft: IntArray | None = None,
        threshold: float = THRESHOLD,
    ) -> Factor:
        """Factor for the entries of Hessian and Jacobian in the problem's order, d, e, and the extra entries; soft:
        rows, counted among those in force, that may repeat others."""
        n = self.unknowns
        last = np.empty(n + self.count)
        last[:n] = diagonal
        last[n:] = -np.asarray(soft_rows)
        parts = [hessian, jacobian, *([] if extra is None else [extra]), last]
        return self.pattern.factor(np.concatenate(parts), None if soft is None else n + soft, threshold)
