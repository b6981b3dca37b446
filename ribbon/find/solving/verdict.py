"""What a minimiser's end is: its status and stability, and what is to be said of it (`ribbon.notes`)."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from ribbon.find import other_models
from ribbon.find.solving.request import How
from ribbon.judge import convexity, nearness, penetration, quadrature, stability
from ribbon.notes import Message, Note
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.result import Energy, Equilibrium, Status
from ribbon.solvers import choose, ipopt
from ribbon.solvers.budget import SPENT, spent
from ribbon.solvers.problem import IPOPT, RESIDUAL_TOLERANCE, FloatArray, Minimum, slack_of, violation

#: Violation of the rows above which a stationary point is called infeasible, and Ipopt's codes for that.
_INFEASIBLE = 1e-6
_IPOPT_INFEASIBLE = (2, -10)
#: Slack (l) between held ends below which rounding is the likely reason of a solve that ends early.
_LEAST_SLACK = 1e-9
#: Part of the largest multiplier above which what keeps a free band from sliding is told.
_SLIDES = 1e-7
_STATIONARY = (Status.CONVERGED, Status.SADDLE)


@dataclass(frozen=True)
class _Measured:
    """What is measured at a minimiser's end: energies by part, the judged stability (None: not judged), the steepest
    ruling |n| w / 2, how far (l) the strip reaches beyond a wall (None: no walls), by how much (l) its parts are nearer
    to each other than they are kept (0: they are not, or may be), and at which abscissae (l)."""

    parts: FloatArray
    check: stability.Stability | None
    steepest: float
    behind: float | None
    too_near: float = 0.0
    where: tuple[float, float] = (0.0, 0.0)


def judged(problem: Problem, minimum: Minimum, how: How) -> Equilibrium:
    """The equilibrium at a minimiser's end."""
    evaluations = problem.counters.by_name()
    parts = problem.energy_parts(minimum.x)
    clock = time.perf_counter()
    at = _measured(problem, minimum, parts, how.check)
    status, message, integral = _verdict(problem, minimum, at, how)
    known, check = status in _STATIONARY, at.check
    return Equilibrium(
        problem=problem,
        status=status,
        message=str(message),
        notes=tuple(message.notes),
        x=minimum.x,
        multipliers=minimum.multipliers,
        rows=minimum.rows,
        residual=minimum.residual,
        iterations=minimum.iterations,
        evaluations=evaluations,
        energy=Energy(*(float(v) for v in parts)),
        stable=check.stable if known and check is not None else None,
        lowest_eigenvalue=check.eigenvalue if check is not None else float("nan"),
        mode=check.mode if check is not None else np.zeros_like(minimum.x),
        at=check.at if check is not None else None,
        active_bounds=check.active if check is not None else 0,
        unstable_modes=check.negative if known and check is not None else None,
        seconds={"solve": minimum.seconds, "stability": time.perf_counter() - clock},
        penetration=at.behind,
        options={**ipopt.DEFAULT_OPTIONS, **(how.options or {})} if minimum.solver == IPOPT else {},
        solver=minimum.solver,
        moved=minimum.moved,
        quadrature_error=integral,
        nonconvex=convexity.share(problem, minimum.x) if known else None,
    )


def _measured(problem: Problem, minimum: Minimum, parts: FloatArray, wanted: bool) -> _Measured:
    finite = bool(np.all(np.isfinite(minimum.x)) and np.all(np.isfinite(parts)))
    requested = wanted and finite and (not problem.row_count or minimum.residual <= RESIDUAL_TOLERANCE)
    check = stability.judge(problem, minimum) if requested else None
    steepest = 0.0
    if not problem.fields.free:
        steepest = float(np.abs(problem.parameters(minimum.x)[:, 2]).max() * problem.half_width)
    near, where = 0.0, (0.0, 0.0)
    if isinstance(problem, MixedProblem) and problem.apart and finite:
        gaps = nearness.minima(problem, minimum.x, -nearness.TOLERANCE)
        if gaps:
            near, where = -gaps[0][0], (gaps[0][1].s, gaps[0][1].s_other)
    return _Measured(parts, check, steepest, penetration.deepest(problem, minimum.x), near, where)


def _verdict(problem: Problem, minimum: Minimum, at: _Measured, how: How) -> tuple[Status, Message, float | None]:
    """Status, message, and the error of the energy's quadrature (None: not asked for, or the rule is exact)."""
    status = _status(problem, minimum, at, how.check)
    if status not in _STATIONARY:
        return status, _stopped(problem, minimum, status), None
    behind = at.behind is not None and not at.behind <= penetration.TOLERANCE
    if behind and how.hold:
        return Status.NOT_CONVERGED, Message.of(Note.BEHIND, depth=at.behind), None
    if at.too_near > nearness.TOLERANCE:
        return (
            Status.NOT_CONVERGED,
            Message.of(Note.TOO_NEAR, depth=at.too_near, s=at.where[0], other=at.where[1]),
            None,
        )
    error = quadrature.error(problem, minimum.x, float(at.parts[0]))
    if error is not None and not error <= quadrature.TOLERANCE:
        return Status.NOT_CONVERGED, Message.of(Note.QUADRATURE, error=error), error
    return status, _found(problem, minimum, at, status, behind), error


def _status(problem: Problem, minimum: Minimum, at: _Measured, wanted: bool) -> Status:
    if not np.all(np.isfinite(minimum.x)) or not np.all(np.isfinite(at.parts)):
        return Status.FAILED
    if not np.isfinite(minimum.residual):
        return Status.NOT_CONVERGED if spent() else Status.FAILED
    if minimum.code == other_models.FLIPPED:
        return Status.FLIPPED
    if at.steepest > 1.0:
        return Status.RULINGS_CROSS
    if minimum.residual > RESIDUAL_TOLERANCE:
        if spent():
            return Status.NOT_CONVERGED
        touches = isinstance(problem, MixedProblem) and bool(problem.pairs)  # its rows hold where it is, not the scene
        if not touches and (minimum.code in _IPOPT_INFEASIBLE or violation(problem, minimum.x) > _INFEASIBLE):
            return Status.INFEASIBLE
        return Status.NOT_CONVERGED
    if at.check is None and wanted:
        return Status.FAILED
    return Status.SADDLE if at.check is not None and at.check.stable is False else Status.CONVERGED


def _stopped(problem: Problem, minimum: Minimum, status: Status) -> Message:
    """Why there is no equilibrium."""
    why = SPENT if spent() else f"{minimum.solver}: {minimum.message}"
    message = Message.of(Note.STOPPED, status=status.value, why=why)
    slack = slack_of(problem)
    if status is Status.NOT_CONVERGED and slack is not None and slack < _LEAST_SLACK:
        message.add(Note.SLACK_LOST, slack=slack)
    return message


def _found(problem: Problem, minimum: Minimum, at: _Measured, status: Status, behind: bool) -> Message:
    """What is to be said of an equilibrium."""
    message, check = Message(status.value), at.check
    if check is not None and check.eigenvalue == np.inf:
        message.add(Note.NO_FREEDOM)
    if minimum.solver == IPOPT and choose.asked() == "auto":
        message.add(Note.BY_IPOPT)
    if behind:
        message.add(Note.BEHIND_ON_PATH, depth=at.behind)
    if check is not None and check.stable is None:
        message.add(Note.NOT_JUDGED)
    if check is not None and check.negative and isinstance(problem, MixedProblem):
        message.add(Note.WAYS_DOWN, count=check.negative)
    if check is not None and check.indifferent:
        message.add(Note.INDIFFERENT)
    if problem.closure is not None and problem.start is None and problem.walls:
        message.add(Note.FREE_BAND)
    push = _pushed_along(problem, minimum)
    if push is not None:
        message.add(Note.PUSHED_ALONG, push=push)
    return message


def _pushed_along(problem: Problem, minimum: Minimum) -> float | None:
    """With what (D w / l^2) a free band's segments push it along itself; None where they do not.

    Sliding changes no energy of the strip but that of the segments, unless these are their own mirror image about the
    middle of the first (`ribbon.problems.held.Held.slides`). With c = eta_0 + eta_1 = 0 held by a multiplier y, the
    push is y dc/ds = 2 y eta'.
    """
    where = problem.block_slices().get("gauge_slide") if problem.row_count else None
    if where is None:
        return None
    held = float(minimum.rows[where][0])
    if not abs(held) > _SLIDES * max(1.0, float(np.abs(minimum.rows).max())):
        return None
    return float(2.0 * abs(held * problem.parameters(minimum.x)[0, 0 if problem.fields.free else 2]))
