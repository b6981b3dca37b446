"""Equilibria of a curve-angle rod: Ipopt with the exact Hessian, then Newton's own steps.

Ipopt finds minima of the energy of dead forces; where it does not, the loads are raised in pieces, each solved by
Newton's steps, and Ipopt goes on from there. A dead moment has no energy (its work depends on the way): it is always
raised in pieces. Every Newton step has its own anchors, the rod as it is then.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

from ribbon.rods.curve_angle import CurveAngle
from ribbon.rods.quasi_static import QuasiStatic
from ribbon.rods.rod import FloatArray
from ribbon.solvers.budget import spent

#: Residual of a rod that is solved, over its size of forces (`size_of_forces`), beside rounding.
TOLERANCE = 1e-9
#: Ipopt begins again, with new anchors, up to this often; its iterations each time.
ROUNDS, ITERATIONS = 2, 100
#: Newton's steps at most; pieces of the loads at most, the first and the least of them.
STEPS, PIECES = 40, 512
FIRST_PIECE, LEAST_PIECE = 0.25, 1e-4
#: Newton's last step (norm over all vertices and angles, l and rad) of a rod that is solved, where rounding hides its
#: forces.
STILL = 1e-3
#: Longest step: of a position (l) and of an angle (rad).
_REACH = 0.5
#: Least share of a step.
_LEAST = 1e-3
#: Stiffness of a bed (over the rod's least) that keeps Newton's steps from motions that nothing resists, as of a round
#: ring about its seam's tangent; it does not move the equilibria.
SOFT = 1e-5
#: Relative error of multipliers that are found by iteration.
_DIGITS = 1e-14


@dataclass(frozen=True)
class Found:
    """Where a solve stopped: problem with its anchors at y, unknowns, multipliers of the rows, residual over the size
    of the forces, iterations, whether it is an equilibrium, the minimiser's message, seconds."""

    problem: CurveAngle
    y: FloatArray
    rows: FloatArray
    residual: float
    iterations: int
    ok: bool
    message: str
    seconds: float


def size_of_forces(problem: CurveAngle) -> float:
    """At least 1: loads and bending stiffness, in D w / l^2."""
    rod = problem.rod
    return max(1.0, rod.stiffness[0], float(np.abs(problem.loads).sum()), float(np.linalg.norm(rod.moment)))


def rounding(problem: CurveAngle) -> float:
    """Residual that rounding leaves: forces are third differences of positions times the stiffness."""
    rod = problem.rod
    return 2.0 * float(np.finfo(float).eps) * max(rod.stiffness) / float(rod.lengths.min()) ** 3


def solve(
    problem: CurveAngle, y: FloatArray, options: dict[str, Any] | None = None, quasi_static: bool = False
) -> Found:
    """The equilibrium that is found from y (4 n + 3,); options: Ipopt's. quasi_static: the angles are no unknowns of
    Ipopt's but follow the centreline (`ribbon.rods.quasi_static`); the equilibria are the same."""
    clock = time.perf_counter()
    y = spread(problem, y)
    bare = loaded(problem, 1.0, 0.0)
    found = _minimised(bare, y, options, 1, quasi_static)
    if not found.ok and not spent():
        raised = _raised(bare, y, lambda share: loaded(problem, share, 0.0))
        if raised.ok:
            found = _minimised(bare, raised.y, options, ROUNDS, quasi_static)
            found = raised if not found.ok else found
            found = replace(found, iterations=found.iterations + raised.iterations)
    if problem.rod.moment.any() and found.ok:
        raised = _raised(bare, found.y, lambda share: loaded(problem, 1.0, share), found.rows)
        found = replace(raised, iterations=found.iterations + raised.iterations)
    elif found.ok and allowed(found.problem) <= TOLERANCE:
        found = _better(found, newton(found.problem, found.y, found.rows, steps=3))
    elif found.ok:  # forces say little there: a Newton step that moves nothing says it
        other = newton(found.problem, found.y, found.rows)
        found = replace(other, iterations=found.iterations + other.iterations)
    return replace(found, seconds=time.perf_counter() - clock)


def spread(problem: CurveAngle, y: FloatArray) -> FloatArray:
    """y with the held ends where they are held: what misses is spread over the rod, not put on the edges there."""
    rod, points = problem.rod, problem.positions(y).copy()
    for end, at, share in ((rod.start, 0, 1.0 - rod.vertices), (rod.end, -1, rod.vertices)):
        if end.position is not None:
            miss = end.position - points[at]
            if end.slide is not None:
                miss = miss - (miss @ end.slide) * end.slide
            points += share[:, None] * miss
    moved = y.copy()
    for i in range(3):
        moved[i::4] = points[:, i]
    return moved


def loaded(problem: CurveAngle, forces: float, moment: float) -> CurveAngle:
    """The rod with these shares of its dead forces and of its dead moment."""
    rod = problem.rod
    less = replace(rod, weight=forces * rod.weight, force=forces * rod.force, moment=moment * rod.moment)
    return replace(problem, rod=less)


def _minimised(problem: CurveAngle, y: FloatArray, options: dict[str, Any] | None, rounds: int, quasi: bool) -> Found:
    """By Ipopt, again from where it stopped with new anchors if a tangent turned too far from the old ones."""
    from ribbon.solvers.ipopt import minimise

    count = 0
    pulled = np.abs(problem.loads)[problem.loads != 0.0]
    # never more than what pulls at a vertex: of many edges an unloaded rod would be an equilibrium to rounding
    tolerance = max(1e-10, min(rounding(problem), 1e-4 * float(pulled.max()) if pulled.size else np.inf))
    for _ in range(rounds):
        problem = problem.anchored(y)
        requested = {"tol": tolerance, "max_iter": ITERATIONS, **(options or {})}
        if quasi:
            reduced = QuasiStatic(problem, problem.angles(y))
            result = minimise(reduced, problem.positions(y).ravel(), requested)
            y = reduced.whole(result.x)
        else:
            result = minimise(problem, y, requested)
            y = result.x
        count += result.iterations
        residual = result.residual / size_of_forces(problem)
        ok = result.residual == result.residual and (result.finished or residual <= allowed(problem))
        message = "converged" if ok else f"not converged: {result.message}"
        found = Found(problem.anchored(y), y, result.rows, residual, count, ok, message, result.seconds)
        if ok or spent():
            break
    return found


def allowed(problem: CurveAngle) -> float:
    """Residual of an equilibrium over the size of the forces."""
    return max(TOLERANCE, 10.0 * rounding(problem) / size_of_forces(problem))


def _better(found: Found, other: Found) -> Found:
    if other.residual < found.residual:
        return replace(other, iterations=found.iterations, message=found.message, ok=found.ok)
    return found


def balance(problem: CurveAngle, y: FloatArray, rows: FloatArray) -> FloatArray:
    """Forces and twisting moments (4 n + 3,) that are not balanced, and the rows, of a rod with anchors at y."""
    gradient = problem.gradient(y) - dead_moment(problem, y)[0]
    return np.concatenate([gradient + problem.jacobian_matrix(y).T @ rows, problem.constraints(y)])


def dead_moment(problem: CurveAngle, y: FloatArray) -> tuple[FloatArray, Any]:
    """The generalised force (4 n + 3,) of the dead moment m at s = 1 and its derivative, with anchors at y.

    The last edge e = |e| t turns by t x dt + (dp - X.dt) t, X = (t~ x t) / (1 + t~.t) = 0 and dX = t~ x dt / 2 at the
    anchor t~ = t: force m x t / |e| on the edge, m.t on its angle.
    """
    force, m = np.zeros(problem.size), problem.rod.moment
    derivative = scipy.sparse.lil_matrix((problem.size, problem.size))
    if m.any():
        at = problem.size - 7
        edge = y[at + 4 : at + 7] - y[at : at + 3]
        size = float(np.linalg.norm(edge))
        t = edge / size
        pull = np.cross(m, t) / size
        force[at + 4 : at + 7], force[at : at + 3], force[at + 3] = pull, -pull, m @ t
        across = (np.eye(3) - np.outer(t, t)) / size
        turn = np.cross(m, across, axisb=0).T - 0.5 * (m @ t) * np.cross(t, across, axisb=0).T
        by_edge = turn / size - np.outer(pull, t) / size
        for sign, row in ((1.0, at + 4), (-1.0, at)):
            for other, column in ((1.0, at + 4), (-1.0, at)):
                derivative[row : row + 3, column : column + 3] = sign * other * by_edge
            derivative[at + 3, row : row + 3] = sign * (m @ across)
    return force, derivative.tocsc()


def newton(problem: CurveAngle, y: FloatArray, rows: FloatArray | None = None, steps: int = STEPS) -> Found:
    """Newton's steps on the balance from y, with the rod as it is as anchor of each, until the residual is that of
    rounding.

    Edges turn by a step and keep their lengths (`stepped`). A share of the step is taken for which the next correction,
    with the same matrix, is shorter (Deuflhard's natural monotonicity test): residuals in forces would hold back steps
    that bend a stiff rod a little too much on the way.
    """
    clock = time.perf_counter()
    lower, upper = problem.bounds()
    y = np.clip(y, lower, upper)
    free = np.flatnonzero(lower < upper)
    problem = problem.anchored(y)
    if rows is None:
        rows = multipliers(problem, y)
    size = size_of_forces(problem)
    soft = SOFT * min(problem.rod.stiffness) / problem.rod.edges * scipy.sparse.identity(free.size, format="csc")

    def missing(problem: CurveAngle, y: FloatArray, rows: FloatArray) -> FloatArray:
        r = balance(problem, y, rows)
        return np.concatenate([r[free], r[problem.size :]])

    r = missing(problem, y, rows)
    residual, count, share = float(np.abs(r).max()) / size, 0, 1.0
    length = 0.0
    while count < steps and not spent():
        jacobian = problem.jacobian_matrix(y)[:, free]
        stiff = (problem.hessian_matrix(y, rows) - dead_moment(problem, y)[1])[free][:, free] + soft
        matrix = scipy.sparse.bmat([[stiff, jacobian.T], [jacobian, None]], format="csc")
        try:
            solved = scipy.sparse.linalg.splu(matrix)
        except RuntimeError:  # singular
            break
        step = solved.solve(-r)
        length = float(np.linalg.norm(step[: free.size]))
        if not np.isfinite(length):
            break
        share = min(1.0, 2.0 * share, _REACH / max(_REACH, float(np.abs(step[: free.size]).max())))
        taken = None
        while share > _LEAST and taken is None:
            move = np.zeros(problem.size)
            move[free] = share * step[: free.size]
            y_new, rows_new = stepped(problem, y, move), rows + share * step[free.size :]
            if np.isfinite(problem.value(y_new)):
                other = problem.anchored(y_new)
                r_new = missing(other, y_new, rows_new)
                next_length = float(np.linalg.norm(solved.solve(-r_new)[: free.size]))
                if next_length <= (1.0 - 0.5 * share) * length:
                    taken = other
            share = share if taken is not None else 0.5 * share
        new = np.inf if taken is None else float(np.abs(r_new).max()) / size
        if taken is None or (length < 1e-6 and new >= residual):
            break
        problem, y, rows, r, residual, count = taken, y_new, rows_new, r_new, new, count + 1
    still = length <= STILL or allowed(problem) <= TOLERANCE
    ok = residual <= allowed(problem) and still
    message = "converged" if ok else "not converged: Newton's steps ended above the tolerance"
    return Found(problem, y, rows, residual, count, ok, message, time.perf_counter() - clock)


def stepped(problem: CurveAngle, y: FloatArray, move: FloatArray) -> FloatArray:
    """y after a move, its edges as long as they are to be: turned, not stretched; where both ends are held, what does
    not close is spread over the rod."""
    rod = problem.rod
    moved = y + move
    tangents = problem.tangents(y) + np.diff(problem.positions(move), axis=0) / rod.lengths[:, None]
    edges = rod.lengths[:, None] * tangents / np.linalg.norm(tangents, axis=1)[:, None]
    points = np.concatenate([np.zeros((1, 3)), np.cumsum(edges, axis=0)])
    first, last = moved[:3], moved[-3:]
    if rod.start.position is None and rod.end.position is not None:
        points += last - points[-1]
    else:
        points += first
        if rod.end.position is not None:
            points += rod.vertices[:, None] * (last - points[-1])
    for i in range(3):
        moved[i::4] = points[:, i]
    return moved


def multipliers(problem: CurveAngle, y: FloatArray) -> FloatArray:
    """Those of the rows that leave the least force unbalanced (least squares); where rows repeat one another, as those
    of a straight rod between two clamps do, the smallest of them."""
    lower, upper = problem.bounds()
    free = np.flatnonzero(lower < upper)
    jacobian = problem.jacobian_matrix(y)[:, free]
    gradient = (problem.gradient(y) - dead_moment(problem, y)[0])[free]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", scipy.sparse.linalg.MatrixRankWarning)
        found = np.asarray(scipy.sparse.linalg.spsolve((jacobian @ jacobian.T).tocsc(), -(jacobian @ gradient)))
    if np.all(np.isfinite(found)):
        return found
    return np.asarray(scipy.sparse.linalg.lsmr(jacobian.T, -gradient, atol=_DIGITS, btol=_DIGITS, conlim=0.0)[0])


def _raised(
    problem: CurveAngle, y: FloatArray, at: Callable[[float], CurveAngle], rows: FloatArray | None = None
) -> Found:
    """By Newton's steps at rising shares of the loads from y; a piece is halved where they fail, then doubled again."""
    share, piece, count = 0.0, FIRST_PIECE, 0
    anchors = problem.anchors
    for _ in range(PIECES):
        target = min(1.0, share + piece)
        tried = newton(replace(at(target), anchors=anchors), y, rows)
        count += tried.iterations
        if tried.ok:
            share, piece = target, 2.0 * piece
            anchors, y, rows, last = tried.problem.anchors, tried.y, tried.rows, tried
            if share == 1.0:
                return replace(last, iterations=count)
        else:
            piece *= 0.5
            if piece < LEAST_PIECE or spent():
                break
    return replace(
        tried, iterations=count, ok=False, message=f"not converged: the loads could be raised to {share:.3g}"
    )
