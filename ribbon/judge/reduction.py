"""What is active at a point of a glued ribbon, and the metric of its second variation (`ribbon.judge.spectrum`).

Second-order condition: the Hessian of the Lagrangian is positive on the tangent of all active constraints, the glue and
what else holds the ribbon: held ends, seams, contacts, bounds, gauges (Nocedal and Wright 2006, section 12.5).
Eigenvalues are taken in the metric ``int (domega^2 + deta^2) ds + |dr_0|^2 + |dq_0|^2`` (the latter two where the start
is free).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon.problems import mixed_kernels as kernels
from ribbon.problems.layout import ETA, OMEGA, POSITION
from ribbon.problems.mixed import MixedProblem

FloatArray = NDArray[np.float64]

#: A bound or a one-sided row holds when it is this close, relative to its size, and pushes.
ACTIVE_DISTANCE = 1e-7
_PUSHES = 1e-9


@dataclass(frozen=True)
class Tangent:
    """What is held at a point: `free` columns of the unknowns, `rows` active rows beside the glue, `bounds` active."""

    free: NDArray[np.bool_]
    rows: NDArray[np.int64]
    bounds: int
    contacts: int


def tangent(problem: MixedProblem, x: FloatArray, multipliers: FloatArray, rows: FloatArray) -> Tangent:
    """Active set at x from the multipliers of bounds (n,) and rows (m,)."""
    lower, upper = problem.bounds()
    fixed = lower == upper
    reach = np.where(np.isfinite(upper), ACTIVE_DISTANCE * np.maximum(np.abs(upper), np.abs(lower)), -1.0)
    held = ~fixed & (np.minimum(x - lower, upper - x) <= reach) & (np.abs(multipliers) > _PUSHES)
    below, above = problem.constraint_bounds()
    glue = kernels.ROWS * problem.lengths.size
    equal = below == above
    values = problem.constraints(x)
    slack = np.minimum(values - below, above - values)
    pushing = ~equal & (np.abs(rows) > _PUSHES) & (slack <= ACTIVE_DISTANCE)
    if isinstance(problem, MixedProblem):  # several strips have no such rows
        equal[problem.idle_rows(x)] = False
    active = np.nonzero(equal | pushing)[0]
    return Tangent(~(fixed | held), active[active >= glue], int(held.sum()), int(pushing.sum()))


def metric(problem: MixedProblem) -> scipy.sparse.csr_matrix:
    """Gram matrix (size, size) of the metric of the module; zero on what the metric does not see."""
    lengths = problem.lengths
    p = lengths.size
    diagonal = np.zeros(p + 1)
    diagonal[:-1] += lengths / 3.0
    diagonal[1:] += lengths / 3.0
    off = lengths / 6.0
    entries, rows, columns = [], [], []
    fields = [problem.layout.columns(place) for place in (OMEGA, ETA)]
    if problem.fields.in_plane:
        fields.append(np.arange(problem.size)[problem.layout.sideways])
    for joints in fields:
        entries += [diagonal, off, off]
        rows += [joints, joints[:-1], joints[1:]]
        columns += [joints, joints[1:], joints[:-1]]
    extra = np.concatenate([np.arange(POSITION, OMEGA), np.arange(problem.layout.ribbon, problem.size)])
    entries.append(np.ones(extra.size))
    rows.append(extra)
    columns.append(extra)
    return scipy.sparse.csr_matrix(
        (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))), shape=(problem.size,) * 2
    )


def dependent_columns(problem: MixedProblem) -> NDArray[np.int64]:
    """Columns that the glue determines: r, q and eta of joints 1 ... p."""
    return problem.layout.columns(*range(POSITION, OMEGA), ETA)[1:].ravel()
