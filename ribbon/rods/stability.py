"""Is an equilibrium of a curve-angle rod a minimum? The second variation on the tangent of its rows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

from ribbon.rods.curve_angle import CurveAngle
from ribbon.rods.rod import FloatArray
from ribbon.rods.solve import Found, newton, stepped
from ribbon.rods.start import from_frames
from ribbon.solvers.budget import spent

#: Edges up to which eigenvalues are found, with dense matrices; a finer rod is judged on fewer.
DENSE = 120
#: Eigenvalues of the second variation below this share of the largest stiffness are zero.
INDIFFERENT = 1e-7
#: From a saddle: longest move (l, rad), shift over the unstable eigenvalue, steps at most, and the last one's move.
AWAY, FIRM, WALK, SETTLED = 0.05, 2.0, 400, 1e-5


@dataclass(frozen=True)
class Stability:
    """Lowest eigenvalue of the second variation on the tangent of the rows, in the metric int (dkappa_1^2 + dkappa_2^2
    + dtau^2) ds (units D w / l): the least stiffness of a straight rod without load. stable None: not judged.

    mode (4 m + 3,): its eigenvector, on the rod of `problem`, which has fewer edges where there were many.
    """

    eigenvalue: float
    stable: bool | None
    mode: FloatArray
    problem: CurveAngle


def judged(found: Found) -> Stability:
    """Second-order check of an equilibrium. A dead moment has no energy: not judged with one."""
    problem = found.problem
    if problem.rod.moment.any():
        return Stability(np.nan, None, np.zeros(problem.size), problem)
    if problem.rod.edges > DENSE:
        fewer = on_fewer(found)
        return judged(fewer) if fewer.ok else Stability(np.nan, None, np.zeros(problem.size), problem)
    lower, upper = problem.bounds()
    free = np.flatnonzero(lower < upper)
    hessian = problem.hessian_matrix(found.y, found.rows)[free][:, free]
    jacobian = problem.jacobian_matrix(found.y)[:, free]
    tangent = scipy.linalg.null_space(jacobian.toarray(), rcond=1e-12)
    weight = tangent.T @ _metric(problem, found.y)[free][:, free] @ tangent
    # a motion that nothing resists has no metric: a little for every one
    weight += 1e-12 * float(np.trace(weight)) / weight.shape[0] * np.eye(weight.shape[0])
    values, vectors = scipy.linalg.eigh(tangent.T @ hessian @ tangent, weight, subset_by_index=[0, 0])
    mode = np.zeros(problem.size)
    mode[free] = tangent @ vectors[:, 0]
    tolerance = INDIFFERENT * max(problem.rod.stiffness)
    return Stability(float(values[0]), bool(values[0] > -tolerance), mode, problem)


def _metric(problem: CurveAngle, y: FloatArray) -> Any:
    """Hessian of bending and twist of a rod of stiffness 1 that is at rest as it stands at y: no force, the metric."""
    strain, cells = problem.evaluated(y).strain, problem.rod.cells
    unit = replace(problem.rod, stiffness=(1.0, 1.0, 1.0))
    bare = replace(problem, rod=unit, at_rest=strain / cells[:, None])
    return bare.hessian_matrix(y, np.zeros(problem.rod.edges))


def left(found: Found, stability: Stability) -> Found:
    """From a saddle down its unstable direction to another equilibrium.

    Newton's steps with the metric, times more than the unstable eigenvalue, added to the second variation: steps of
    implicit Euler down the energy, which a saddle does not attract; plain Newton's steps at the end. Nothing keeps a
    rod from going through itself on the way.
    """
    problem, y, rows = found.problem, found.y, found.rows
    if stability.mode.size != y.size:
        return found
    y = stepped(problem, y, AWAY / max(float(np.abs(stability.mode).max()), 1e-300) * stability.mode)
    lower, upper = problem.bounds()
    free = np.flatnonzero(lower < upper)
    shift = max(FIRM * abs(stability.eigenvalue), min(problem.rod.stiffness))
    walked = 0
    while walked < WALK:
        walked += 1
        problem = problem.anchored(y)
        stiff = (problem.hessian_matrix(y, rows) + shift * _metric(problem, y))[free][:, free]
        jacobian = problem.jacobian_matrix(y)[:, free]
        matrix = scipy.sparse.bmat([[stiff, jacobian.T], [jacobian, None]], format="csc")
        missing = np.concatenate([problem.gradient(y)[free], problem.constraints(y)])
        step = scipy.sparse.linalg.splu(matrix).solve(-missing)
        size = float(np.abs(step[: free.size]).max())
        move = np.zeros(problem.size)
        move[free] = min(1.0, AWAY / max(size, 1e-300)) * step[: free.size]
        new = stepped(problem, y, move)
        shift *= 4.0 if not problem.value(new) <= problem.value(y) else 0.9
        y, rows = new, step[free.size :]
        if size < SETTLED or spent():
            break
    ended = newton(problem.anchored(y), y, rows)
    return replace(ended, iterations=found.iterations + walked + ended.iterations)


def on_fewer(found: Found) -> Found:
    """The equilibrium beside it of the rod with its edges joined in twos."""
    problem, rod = found.problem, found.problem.rod
    n = rod.edges - rod.edges % 2
    lengths = np.concatenate([rod.lengths[:n].reshape(-1, 2).sum(axis=1), rod.lengths[n:]])
    kept = np.concatenate([np.arange(0, n + 1, 2), np.arange(n + 1, rod.edges + 1)])
    points, frames = problem.positions(found.y)[kept], problem.frames(found.y)
    middle = frames[:n:2] + frames[1:n:2]
    left, _, right = np.linalg.svd(np.concatenate([middle, frames[n:]]))
    few, y = from_frames(replace(rod, lengths=lengths), points, left @ right, turn=_last_twist(found))
    return newton(few, y)


def _last_twist(found: Found) -> float:
    """Twist of the last cell, to which whole turns are counted."""
    return float(found.problem.evaluated(found.y).strain[-1, 2])
