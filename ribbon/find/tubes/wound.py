"""A strip wound on the inside of a tube or a sphere: its end first, then all that lies on the wall before it.

A strip bent to its wall keeps to it for a thrust alone: with kappa = 1 / R constant, the elastica's balance
``M' = -Q``, ``Q' - kappa N + p = 0``, ``N' + kappa Q = 0`` has M = D kappa, Q = 0, N constant and the push
``p = kappa N`` per length (the coil of V. Romero, T. Witten and E. Cerda, Proc. R. Soc. A 464, 2008). Without friction
the push at a free end has no moment about the axis: ``N = D / R^2``, ``p = D / R^3`` for a flat strip. What lies on the
wall does not know how long it is, nor does the end (the free arc, and where it touches down).

An iteration on a start wound by many radians has to find the pushes of all turns at once, and leaves the plane by
rounding on its way. Instead the last few rad (`KEPT`) are found alone, clamped where the start is there, and what is
before them is put back as it was; multipliers are those of the least norm that balance it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon import law
from ribbon.boundary import Clamp
from ribbon.element import quaternion
from ribbon.obstacle import Obstacle
from ribbon.problems.mixed import MixedProblem
from ribbon.solid import Face, Solid
from ribbon.solvers import choose
from ribbon.solvers.problem import RESIDUAL_TOLERANCE, Minimum

FloatArray = NDArray[np.float64]
Progress = Callable[[int, float, float], None]
#: How the end alone is found: problem, unknowns (n,), options, progress.
Solve = Callable[[MixedProblem, FloatArray, dict[str, Any] | None, Progress | None], Minimum]

#: Turn (rad) from which a start is wound, and what is kept of it to find the end: more first, then less.
WOUND, KEPT = 14.0, (10.0, 7.0, 5.0)
#: Distance (l) from the wall up to which a joint lies on it; slack (l) up to which a row may push.
_ON = 1e-8
_PUSHES = 1e-8
#: Weight of the multipliers' norm against the balance.
_NORM = 1e-12
_ITERATIONS = 60


def minimum(
    problem: MixedProblem, x: FloatArray, options: dict[str, Any] | None, progress: Progress | None, solve: Solve
) -> Minimum | None:
    """The equilibrium beside a shape x (n,) that is wound on its wall but for its end; None for other shapes, and where
    the end is not found alone."""
    if not _alone(problem):
        return None
    omega, _ = problem.joint_values(x)
    turns = np.concatenate([[0.0], np.cumsum(0.5 * np.abs(omega[1:] + omega[:-1]) * problem.lengths)])
    if turns[-1] < WOUND:
        return None
    for kept in KEPT:
        k = int(np.searchsorted(turns, turns[-1] - kept))
        if not _on_wall(problem, x, k):
            continue
        found = _from_end(problem, x, k, options, progress, solve)
        if found is not None:
            return found
    return None


def _alone(problem: MixedProblem) -> bool:
    """Whether nothing acts but a clamp at s = 0 and one round wall from within."""
    start = problem.start
    if start is None or not start.is_whole or problem.end is not None or problem.closure is not None:
        return False
    acted = problem.has_gravity or problem.tip is not None or bool(problem.apart) or problem.friction is not None
    if acted or len(problem.walls) != 1 or any(map(law.is_table, problem.strip.rest)):
        return False
    wall = problem.walls[0]
    return isinstance(wall, Obstacle) and not isinstance(wall, (Face, Solid)) and wall.inside


def _on_wall(problem: MixedProblem, x: FloatArray, k: int) -> bool:
    """Whether x lies on the wall up to joint k, where a clamp may hold it, and is held at nothing but joints there."""
    block = problem.wall_rows(0)
    before = np.asarray(block.joints) <= k
    off = block.values(x).reshape(-1, 2)[before]
    assert problem.start is not None
    turned = problem.start.ruling == "straight" and abs(problem.joint_values(x)[1][k]) > _ON
    s = float(problem.lengths[:k].sum())
    return not turned and all(t.s > s for t in problem.touching) and float(np.abs(off).max(initial=0.0)) < _ON


def _from_end(
    problem: MixedProblem, x: FloatArray, k: int, options: dict[str, Any] | None, progress: Progress | None,
    solve: Solve,
) -> Minimum | None:  # fmt: skip
    """The equilibrium whose part before joint k is that of x; None where it is not found."""
    short = _end(problem, x, k)
    omega, eta = problem.joint_values(x)
    share = 1.0 - float(problem.lengths[:k].sum())
    sideways = problem.in_plane_values(x)
    begin = short.state(share * omega[k:], eta[k:], None if sideways is None else share * sideways[k:])
    found = solve(short, begin, options, progress)
    problem.counters.add(short.counters)
    if found.residual > RESIDUAL_TOLERANCE:
        return None
    bent, turned = short.joint_values(found.x)
    aside = short.in_plane_values(found.x)
    if sideways is not None and aside is not None:
        sideways = np.concatenate([sideways[:k], aside / share])
    y = problem.state(np.concatenate([omega[:k], bent / share]), np.concatenate([eta[:k], turned]), sideways)
    with choose.using("newton" if choose.asked() == "auto" else None):
        again = choose.minimise(
            problem, y, {"max_iter": _ITERATIONS, **(options or {})}, progress,
            (balancing(problem, y), np.zeros(problem.size)),
        )  # fmt: skip
    if again.residual > RESIDUAL_TOLERANCE:
        return None
    return replace(again, iterations=again.iterations + found.iterations, seconds=again.seconds + found.seconds)


def _end(problem: MixedProblem, x: FloatArray, k: int) -> MixedProblem:
    """The problem of what is beyond joint k, clamped where x is there; its length is 1."""
    positions, frames = problem.joints(x)
    share = 1.0 - float(problem.lengths[:k].sum())
    frame = frames[k]
    assert problem.start is not None
    clamp = Clamp(positions[k] * problem.strip.length, frame[:, 2], frame[:, 1], problem.start.ruling)
    strip = replace(problem.strip, length=share * problem.strip.length)
    touching = tuple(touch._replace(s=min((touch.s - (1.0 - share)) / share, 1.0)) for touch in problem.touching)
    return problem.with_changes(
        strip=strip, start=clamp, lengths=problem.lengths[k:] / share, touching=touching,
        reference=tuple(quaternion.from_matrix(frame)),
    )  # fmt: skip


def balancing(problem: MixedProblem, x: FloatArray) -> FloatArray:
    """Multipliers (m,) of the rows that balance x best, of those the ones of the least norm; none of a row with slack,
    none that pulls."""
    below, above = problem.constraint_bounds()
    c = problem.constraints(x)
    lower, upper = problem.bounds()
    free = np.flatnonzero(lower < upper)
    may = np.flatnonzero((below == above) | (c - below < _PUSHES))
    a = problem.jacobian_matrix(x)[may][:, free]
    gradient = problem.gradient(x)[free]
    matrix = scipy.sparse.bmat([[scipy.sparse.identity(free.size), a.T], [a, -_NORM * scipy.sparse.identity(may.size)]])
    solved = scipy.sparse.linalg.spsolve(matrix.tocsc(), np.concatenate([-gradient, np.zeros(may.size)]))
    rows = np.zeros(c.size)
    rows[may] = solved[free.size :]
    return np.where(below < above, np.minimum(rows, 0.0), rows)
