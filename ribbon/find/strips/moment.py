"""Moments at ends of several strips whose axes are fixed in space: they have no potential (docs/theory.md, eq. (5.20)).

At an equilibrium under the forces f(q*) of such moments, each taken at a quaternion q* of its end, the end stands at
q = F(q*); what is looked for is q* = F(q*). With S (4 m, 4 m) the ends' answer to forces on them, of the system that
the equilibrium's active rows hold, ``F' = S A``, and Newton's step is::

    (1 - S A) d = F(q*) - q* ,   x goes on by  (answer of all unknowns) A d

Between two such steps there is a minimum of an energy, with all that strips touch. From nothing the moments grow step
by step: which of several equilibria they lead to is said by that way, not by an energy.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon.find.strips.result import StripsEquilibrium
from ribbon.judge.reduction import tangent
from ribbon.problems import mixed_kernels as kernels
from ribbon.problems.strips.part import turning
from ribbon.problems.strips.problem import StripsProblem
from ribbon.result import Status
from ribbon.solvers import newton_rows
from ribbon.solvers.budget import spent
from ribbon.solvers.problem import RESIDUAL_TOLERANCE, Minimum

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Held = Callable[[StripsProblem, Minimum], tuple[StripsProblem, Minimum, float | None]]
Rest = Callable[[StripsProblem, Minimum], StripsEquilibrium]

#: Newton's steps for the ends' quaternions, and what is left of their forces (D_0 w_0 / l_0) at which they end.
ROUNDS, SETTLED = 20, 1e-10
#: Part of the moments by which they grow at first, at the most and at the least, growth and cut.
FIRST, MOST, LEAST, GROW, CUT = 0.1, 0.2, 1e-3, 1.5, 0.4
#: How far (l_0) strips may go in a step of growth.
FAR = 0.4
#: Iterations of a minimiser beside an equilibrium; what is added to the diagonal where nothing resists (a ruling of a
#: straight strip).
_WARM, _LITTLE = 80, 1e-10
_GOOD = (Status.CONVERGED, Status.SADDLE)


def loaded(problem: StripsProblem) -> list[int]:
    """The strips with a moment."""
    return [k for k, part in enumerate(problem.parts) if part.moment is not None]


def _columns(problem: StripsProblem) -> list[IntArray]:
    """Columns (4,) of the quaternions of the ends of `loaded`."""
    return [problem.offsets[k] + problem.parts[k].layout.joint(-1).quaternion for k in loaded(problem)]


def taken_at(problem: StripsProblem, x: FloatArray) -> StripsProblem:
    """The problem with the forces of its moments as they are where its ends stand in x."""
    return _taken(problem, [x[columns] for columns in _columns(problem)])


def _taken(problem: StripsProblem, turned: list[FloatArray]) -> StripsProblem:
    each = dict(zip(loaded(problem), turned, strict=True))
    changes = [
        {"turned": tuple(map(float, each[k] / np.linalg.norm(each[k])))} if k in each else {}
        for k in range(len(problem.parts))
    ]
    return problem.with_parts(changes)


def _forces(problem: StripsProblem) -> FloatArray:
    """A (4 m, 4 m) of all moments, D_0 w_0 / l_0."""
    blocks = []
    for k in loaded(problem):
        moment = problem.parts[k].moment
        assert moment is not None
        blocks.append(problem.stiffness_over[k] * turning(moment))
    return np.asarray(scipy.linalg.block_diag(*blocks))


def balanced(problem: StripsProblem, point: Minimum, held: Held) -> tuple[StripsProblem, Minimum, float | None]:
    """The equilibrium, beside `point`, under the moments as they are where the ends stand then; held: an equilibrium
    with all that it touches held. Its residual says what is left of the moments' forces too."""
    problem, point, depth = held(problem, point)
    forces, columns = _forces(problem), np.concatenate(_columns(problem))
    left = np.inf
    for _ in range(ROUNDS):
        if point.residual > RESIDUAL_TOLERANCE or spent():
            return problem, point, depth
        turned = np.concatenate([np.asarray(problem.parts[k].turned) for k in loaded(problem)])
        missed = point.x[columns] - turned
        left = float(np.abs(forces @ missed).max())
        if left <= SETTLED:
            break
        answers = _answers(problem, point, columns)
        step = np.linalg.solve(np.eye(columns.size) - answers[columns] @ forces, missed)
        problem = _taken(problem, np.split(turned + step, columns.size // 4))
        x = np.clip(point.x + answers @ (forces @ step), *problem.bounds())
        warm = point.rows, point.multipliers
        fresh = newton_rows.minimise(problem, x, {"max_iter": _WARM}, None, warm)
        if fresh.residual > RESIDUAL_TOLERANCE:
            fresh = newton_rows.minimise(problem, point.x, {"max_iter": _WARM}, None, warm)
        point = replace(fresh, iterations=fresh.iterations + point.iterations, seconds=fresh.seconds + point.seconds)
        problem, point, depth = held(problem, point)
    return problem, replace(point, residual=max(point.residual, left)), depth


def _answers(problem: StripsProblem, point: Minimum, columns: IntArray) -> FloatArray:
    """How all unknowns (n, k) answer to unit forces on `columns` (k,), what holds at the equilibrium held."""
    active = tangent(problem, point.x, point.multipliers, point.rows)  # type: ignore[arg-type]
    rows = np.concatenate([np.arange(kernels.ROWS * problem.lengths.size), active.rows])
    free = np.flatnonzero(active.free)
    hessian = problem.hessian_matrix(point.x, point.rows)[free][:, free]
    jacobian = problem.jacobian_matrix(point.x)[rows][:, free]
    little = _LITTLE * scipy.sparse.eye(free.size)
    whole = scipy.sparse.bmat([[hessian + little, jacobian.T], [jacobian, -1e-12 * scipy.sparse.eye(rows.size)]])
    right = np.zeros((whole.shape[0], columns.size))
    place = np.full(problem.size, -1)
    place[free] = np.arange(free.size)
    for k, column in enumerate(columns):
        if place[column] >= 0:
            right[place[column], k] = 1.0
    found = np.zeros((problem.size, columns.size))
    found[free] = scipy.sparse.linalg.splu(whole.tocsc()).solve(right)[: free.size]
    return found


def grown(state: StripsEquilibrium, moments: list[tuple[float, float, float] | None], rest: Rest) -> StripsEquilibrium:
    """The equilibrium that `state`, without moments, goes to while they grow from nothing to `moments` (D w / l of
    each strip); rest: an equilibrium beside a minimiser's end, judged."""
    t, size = 0.0, FIRST
    while t < 1.0 - 1e-12 and not spent():
        target = min(1.0, t + size)
        fresh = state.problem.with_parts(
            [{"moment": None if one is None else tuple(target * c for c in one)} for one in moments]
        )
        fresh = taken_at(fresh, state.x)
        point = newton_rows.minimise(fresh, state.x, {"max_iter": _WARM}, None, (state.rows, state.multipliers))
        new = rest(fresh, point)
        if new.status in _GOOD and _moved(state, new) <= FAR:
            state, size, t = new, min(MOST, GROW * (target - t)), target
            continue
        size = CUT * (target - t)
        if size < LEAST:
            why = f"no equilibrium was found beyond {t:.3g} of the moment at its end ({new.message})"
            return replace(new, status=Status.NOT_CONVERGED, stable=None, message=why)
    return state


def _moved(one: StripsEquilibrium, other: StripsEquilibrium) -> float:
    s = np.linspace(0.0, 1.0, 21)
    return max(
        float(np.linalg.norm(one.positions(k, s) - other.positions(k, s), axis=1).max()) for k in range(len(one.strips))
    )
