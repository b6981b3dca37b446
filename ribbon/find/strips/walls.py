"""Several strips held on their walls' side between the joints too: as one strip is (`ribbon.find.contacts`).

Each strip's points and places are chosen by the rules for one; the equilibrium that follows is that of all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ribbon.find import contacts
from ribbon.judge import penetration
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.strips.problem import StripsProblem
from ribbon.problems.touching import Touch
from ribbon.solvers import newton_rows
from ribbon.solvers.budget import spent
from ribbon.solvers.problem import RESIDUAL_TOLERANCE, Minimum, kkt_residual

FloatArray = NDArray[np.float64]

#: Iterations of a minimiser that begins beside an equilibrium.
_WARM = 150


def has_walls(problem: StripsProblem) -> bool:
    """Whether a strip has walls."""
    return any(part.walls for part in problem.parts)


def deepest(problem: StripsProblem, x: FloatArray) -> float | None:
    """How far a strip reaches beyond a wall, over its own length; None without walls, and where it has no shape."""
    each = [penetration.deepest(part, problem.own(x, k)) for k, part in enumerate(problem.parts)]
    known = [depth for depth in each if depth is not None]
    return max(known) if known and len(known) == len(each) else None


def held(problem: StripsProblem, point: Minimum) -> tuple[StripsProblem, Minimum]:
    """The problem with the points held that an equilibrium `point` of it needs, and the equilibrium then; where none is
    found within the tolerance, the one that penetrates least is."""
    if not has_walls(problem) or not point.residual <= RESIDUAL_TOLERANCE:
        return problem, point
    best, least = (problem, point), np.inf
    for _ in range(contacts.ROUNDS):
        minima = deep_places(problem, point.x, contacts.DEPTH)
        depth = max((-distance for own in minima for distance, _ in own), default=0.0)
        if depth < least:
            best, least = (problem, point), depth
        if depth <= penetration.TOLERANCE or spent():
            break
        more = [
            contacts.points_beyond(part, problem.own(point.x, k), own)
            for k, (part, own) in enumerate(zip(problem.parts, minima, strict=True))
        ]
        if not any(more):
            break
        parts, rows = [], []
        for part, touches, own in zip(problem.parts, more, each_of(problem, point), strict=True):
            parts.append(part.with_changes(touching=(*part.touching, *touches)))
            rows.append(contacts.carried_rows(part, parts[-1], own, {}))
        fresh = problem.with_changes(parts=tuple(parts))
        again = _again(fresh, point, _gathered(problem, fresh, point, rows))
        if again.residual > RESIDUAL_TOLERANCE:
            break
        problem, point = fresh, again
    return _slid(*_let_go(*best))


def deep_places(problem: StripsProblem, x: FloatArray, depth: float) -> list[list[tuple[float, Touch]]]:
    """What of each strip is deeper behind a wall than `depth`, over its own length."""
    return [
        penetration.minima(part, problem.own(x, k), -depth) if part.walls else []
        for k, part in enumerate(problem.parts)
    ]


def each_of(problem: StripsProblem, point: Minimum) -> list[Minimum]:
    """Each strip's part of an equilibrium of all, its rows' multipliers in its own units."""
    return [
        replace(point, x=problem.own(point.x, k), rows=problem.rows_of(point.rows, k))
        for k in range(len(problem.parts))
    ]


def _gathered(old: StripsProblem, fresh: StripsProblem, point: Minimum, rows: Sequence[FloatArray]) -> FloatArray:
    """Multipliers of the rows of `fresh`: of each strip those given, in its own units, of what joins and parts them
    those of `old`."""
    return fresh.rows_from(rows, point.rows[sum(part.row_count for part in old.parts) :])


def _again(fresh: StripsProblem, point: Minimum, rows: FloatArray) -> Minimum:
    again = newton_rows.minimise(fresh, point.x, {"max_iter": _WARM}, None, (rows, point.multipliers))
    if again.residual > RESIDUAL_TOLERANCE and not spent():
        cold = newton_rows.minimise(fresh, point.x, {"max_iter": _WARM, "mu_init": 1e-5})
        again = replace(cold, iterations=cold.iterations + again.iterations, seconds=cold.seconds + again.seconds)
    return replace(again, iterations=again.iterations + point.iterations, seconds=again.seconds + point.seconds)


def _slid(problem: StripsProblem, point: Minimum) -> tuple[StripsProblem, Minimum]:
    """The problem whose single places of contact slide, and its equilibrium beside `point`; both as they are where
    nothing touches at one place, and where none is found from there."""
    if spent():
        return problem, point
    each = each_of(problem, point)
    places = [
        contacts.single_places(part, own) if part.walls else [] for part, own in zip(problem.parts, each, strict=True)
    ]
    known = zip(problem.parts, places, strict=True)
    if all(contacts.place_slides(part, place) for part, own in known for place in own):
        return problem, point
    changed = [
        contacts.with_sliding(part, own, some) if some else (part, own)
        for part, own, some in zip(problem.parts, each, places, strict=True)
    ]
    now, rows = _together(problem, point, changed)
    here = point
    for _ in range(contacts.FOLLOWED):
        again = newton_rows.minimise(now, here.x, {"max_iter": _WARM}, None, (rows, here.multipliers))
        if again.residual > RESIDUAL_TOLERANCE:
            return problem, point
        here = replace(again, iterations=again.iterations + here.iterations, seconds=again.seconds + here.seconds)
        minima = deep_places(now, here.x, contacts.NEAREST)
        beyond = [
            contacts.next_to_slide(part, [touch for _, touch in own])
            for part, own in zip(now.parts, minima, strict=True)
        ]
        if not any(beyond):
            deep = max((-distance for own in minima for distance, _ in own), default=0.0)
            return (problem, point) if deep > penetration.TOLERANCE else _let_go(now, here)
        changed = [
            contacts.with_more(part, own, touches) if touches else (part, own)
            for part, own, touches in zip(now.parts, each_of(now, here), beyond, strict=True)
        ]
        now, rows = _together(now, here, changed)
    return problem, point


def _together(
    problem: StripsProblem, point: Minimum, changed: Sequence[tuple[MixedProblem, Minimum]]
) -> tuple[StripsProblem, FloatArray]:
    """The problem of strips whose touches are changed, and the multipliers of its rows."""
    fresh = problem.with_parts([{"touching": part.touching} for part, _ in changed])
    return fresh, _gathered(problem, fresh, point, [own.rows for _, own in changed])


def _let_go(problem: StripsProblem, point: Minimum) -> tuple[StripsProblem, Minimum]:
    """Without what does not push: the same equilibrium."""
    if not any(part.touching for part in problem.parts):
        return problem, point
    parts, rows = zip(
        *(contacts.without_idle(part, own) for part, own in zip(problem.parts, each_of(problem, point), strict=True)),
        strict=True,
    )
    fewer = problem.with_changes(parts=parts)
    gathered = _gathered(problem, fewer, point, rows)
    residual = kkt_residual(fewer, point.x, point.multipliers, gathered)
    return (
        (problem, point) if residual > RESIDUAL_TOLERANCE else (fewer, replace(point, rows=gathered, residual=residual))
    )
