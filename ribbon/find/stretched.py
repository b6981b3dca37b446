"""Ends one length apart: the straight strip is the only shape there is, and its tension is not determined.

No multipliers exist there (the rows' derivatives are dependent), so that no minimiser can be asked.
"""

from __future__ import annotations

import numpy as np

from ribbon.boundary import Clamp
from ribbon.element import quaternion
from ribbon.errors import RibbonInputError
from ribbon.judge import penetration
from ribbon.notes import Message, Note
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.result import Energy, Equilibrium, Status
from ribbon.solvers.problem import KNOWN, violation
from ribbon.strip import Strip

#: Mismatch of the frames at the ends of a stretched strip that counts as rounding.
STRETCHED_MISMATCH = 1e-4
#: How far (l) held ends may be farther apart than the strip is long: rounding of their places.
TOO_FAR = 1e-12
#: Roundings of the places of held ends, each of their distance from the origin or of l, within which a strip is as long
#: as its ends are apart.
_ROUNDINGS = 4.0 * float(np.finfo(float).eps)
#: Sine of the angle between a normal and the chord below which the normal does not tell which way is across.
_STEEP = 1e-3
#: Why a stretched strip has no forces.
UNDETERMINED = Note.UNDETERMINED.text()


def ends_apart(strip: Strip, start: Clamp | None, end: Clamp | None) -> float:
    """Distance of the held ends over l; 0 where one is free."""
    if start is None or end is None or start.position is None or end.position is None:
        return 0.0
    return float(np.linalg.norm(np.asarray(end.position) - np.asarray(start.position))) / strip.length


def check_distance(strip: Strip, start: Clamp | None, end: Clamp | None) -> None:
    """`RibbonInputError` where the held ends are farther apart than the strip is long."""
    apart = ends_apart(strip, start, end)
    if apart > 1.0 + TOO_FAR:
        assert end is not None
        raise RibbonInputError(
            "end.position", end.position, f"it is {apart:.12g} lengths from the start; at most 1 can be reached"
        )


def is_stretched(problem: Problem) -> bool:
    """Whether the ends are held as far apart as the strip is long, to the rounding of their places, so that `straight`
    is the only shape.

    A slack d, however small, is another matter: the strip sags, or bulges, by some sqrt(d), and what it pulls with is
    determined.
    """
    if problem.slack is None or not isinstance(problem, MixedProblem):
        return False
    assert problem.start_position is not None
    assert problem.end_position is not None
    places = max(float(np.abs(problem.start_position).max()), float(np.abs(problem.end_position).max()))
    return bool(problem.slack <= _ROUNDINGS * (1.0 + places))


def straight(problem: Problem) -> Equilibrium:
    """The straight strip between ends that are one length apart: the only shape there is, whatever its tension."""
    none = np.zeros(problem.lengths.size + 1)
    problem = _along_the_chord(problem)
    x = problem.state(none, none, none)
    missing = violation(problem, x)
    beyond = penetration.deepest(problem, x)
    fits = missing <= STRETCHED_MISMATCH and not (beyond is not None and beyond > penetration.TOLERANCE)
    status = Status.CONVERGED if fits else Status.INFEASIBLE
    message = Message(status.value)
    if fits:
        message.add(Note.NO_TENSION, why=UNDETERMINED)
    return Equilibrium(
        problem=problem,
        status=status,
        message=str(message),
        notes=tuple(message.notes),
        x=x,
        multipliers=np.zeros(problem.size),
        rows=np.full(problem.row_count, np.nan),
        residual=missing,
        iterations=0,
        evaluations=problem.counters.by_name(),
        energy=Energy(*(float(v) for v in problem.energy_parts(x))),
        stable=True if fits else None,
        lowest_eigenvalue=float("inf") if fits else float("nan"),
        mode=np.zeros(problem.size),
        active_bounds=0,
        seconds={"solve": 0.0, "stability": 0.0},
        options={},
        solver=KNOWN,
        penetration=beyond,
        forces_why=UNDETERMINED,
    )


def _along_the_chord(problem: Problem) -> Problem:
    """The problem with a start that, where no clamp holds a frame, looks along the chord of its ends, its normal turned
    with it as little as can be."""
    assert isinstance(problem, MixedProblem)
    if problem.start_quaternion is not None or problem.end_quaternion is not None:
        return problem
    assert problem.start_position is not None
    assert problem.end_position is not None
    chord = problem.end_position - problem.start_position
    chord = chord / np.linalg.norm(chord)
    normal = quaternion.matrix(np.asarray([problem.reference]))[0][:, 1]
    across = np.cross(normal, chord)
    if np.linalg.norm(across) < _STEEP:  # the normal would look along the strip
        across = np.cross(np.roll(chord, 1), chord)
    across = across / np.linalg.norm(across)
    frame = np.column_stack([across, np.cross(chord, across), chord])
    origin = tuple(problem.start_position.tolist())
    return problem.anchored((tuple(quaternion.from_matrix(frame).tolist()), origin))
