"""Strips that rub on each other: one increment of their path (docs/theory.md, eq. (5.15), (5.21), (5.24)).

Where they push each other at the end of an increment, and pushed each other near there at its beginning, the spot of
one goes along the other only against Coulomb's friction. Bounds and guesses settle in rounds, as on walls
(`ribbon.find.friction.increment`); places of contact, which slide, are those of the last minimum. What rubs on walls
beside is found in the same rounds (`ribbon.find.strips.rubbing`). Of one strip that touches itself both spots are on
it, and nothing else is another; (5.24) is what that does to a planar fold.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ribbon import surface
from ribbon.find.friction import increment as alone
from ribbon.find.friction.history import FAR, SEGMENTS
from ribbon.find.strips import rubbing, solve, touch
from ribbon.find.strips.result import StripsEquilibrium
from ribbon.notes import Note
from ribbon.problems.friction.particles import Rub
from ribbon.problems.strips.between import BetweenRows
from ribbon.problems.strips.problem import StripsProblem
from ribbon.problems.strips.slide import Slide, Spot, spot_rows
from ribbon.result import Status
from ribbon.solvers import newton_rows
from ribbon.solvers.budget import spent
from ribbon.solvers.problem import RESIDUAL_TOLERANCE, Minimum

FloatArray = NDArray[np.float64]

_GOOD = (Status.CONVERGED, Status.SADDLE)
#: Steps of a minimiser in a round after the first, and without multipliers.
_STEPS, _COLD = 40, 200
#: Rounds that end with strips too near to each other, after which a shorter increment is tried.
_DEEP = 1
#: Lengths along a strip (l) at which a wait of one is a difference of its push.
_PLACED = 1e-6


def increment(problem: StripsProblem, state: StripsEquilibrium) -> StripsEquilibrium:
    """The equilibrium of `problem` one increment behind `state`; not converged where no minimum is found, or bounds and
    friction do not settle."""
    x = np.clip(state.x, *problem.bounds())
    begun = rubbing.begun(problem.with_changes(slides=_again(state)), state, rubbing.histories(state))
    new = _settled(*touch.downhill(begun, x), state)
    if new.status not in _GOOD:
        return new
    taken = lost(new) + rubbing.lost(new)
    return replace(new, rubbed=(state.rubbed or 0.0) + taken, before=replace(state, before=None))


def finer(fresh: StripsProblem, state: StripsEquilibrium) -> StripsEquilibrium:
    """The end of the last increment by `fresh`, the problem of `state` on shorter segments."""
    assert state.before is not None
    slides = tuple(one._replace(stiffness=alone.SOFT) for one in state.problem.slides)
    begun = rubbing.begun(fresh.with_changes(slides=slides), state, rubbing.histories(state.before))
    return _settled(*touch.downhill(begun, solve.carried(state, fresh)), state.before)


def lost(state: StripsEquilibrium) -> float:
    """What friction between strips took away in the last increment, D_0 w_0 / l_0: the sum of T . u."""
    term = state.problem.friction
    return 0.0 if term is None else float(np.sum(term.forces(state.x) * term.slips(state.x)))


def _again(state: StripsEquilibrium) -> tuple[Slide, ...]:
    """What rubbed at the end of the last increment, to begin this one with."""
    return tuple(one._replace(stiffness=alone.SOFT) for one in slides(state.problem, state.x, state.rows, state))


def _settled(problem: StripsProblem, point: Minimum, before: StripsEquilibrium) -> StripsEquilibrium:
    """The end of the increment: rounds of bounds and guesses until they settle."""
    change, least, idle, depth, deep = np.inf, np.inf, 0, None, 0
    histories = rubbing.histories(before)
    for _ in range(alone.ROUNDS):
        if point.residual > RESIDUAL_TOLERANCE or spent():
            break
        problem, point, depth = solve.settled(problem, point)
        deep = deep + 1 if depth is not None and depth > touch.TOLERANCE else 0
        if deep > _DEEP:
            break
        fresh = slides(problem, point.x, point.rows, before)
        rubs = rubbing.found(problem, point, histories)
        change = max(_difference(problem, fresh), rubbing.difference(problem, point, rubs))
        least, idle = (change, 0) if change < 0.5 * least else (least, idle + 1)
        if change <= alone.SETTLED or (change <= alone.LEFT and idle >= alone.IDLE):
            break
        problem, point = _next(problem, point, fresh, rubs)
    found = solve.judged(problem, point, depth)
    if found.status not in _GOOD or change <= alone.LEFT:
        return found
    text = Note.RUBS_UNSETTLED.text(change=change, rounds=alone.ROUNDS)
    return replace(found, status=Status.NOT_CONVERGED, stable=None, message=text)


def _next(
    problem: StripsProblem, point: Minimum, fresh: tuple[Slide, ...], rubs: Sequence[tuple[Rub, ...]]
) -> tuple[StripsProblem, Minimum]:
    """The problem with other bounds and guesses and its minimum, with softer places where none is found at once."""
    softer = tuple(one._replace(stiffness=alone.SOFT) for one in fresh)
    for own, on_walls in ((fresh, rubs), (softer, rubbing.softer(rubs))):
        tried = rubbing.rubbed(problem.with_changes(slides=own), on_walls)
        found = newton_rows.minimise(tried, point.x, {"max_iter": _STEPS}, None, (point.rows, point.multipliers))
        found = replace(found, iterations=found.iterations + point.iterations, seconds=found.seconds + point.seconds)
        if found.residual <= RESIDUAL_TOLERANCE:
            return tried, found
    return tried, newton_rows.minimise(tried, point.x, {"max_iter": _COLD, "mu_init": 1e-5})


def slides(problem: StripsProblem, x: FloatArray, rows: FloatArray, before: StripsEquilibrium) -> tuple[Slide, ...]:
    """Where strips push each other at x with the rows' multipliers, and did so near there at the end of the increment
    `before`: with the bounds that the pushes give, and what is known of their friction."""
    if not problem.mu:
        return ()
    known = [] if problem.friction is None else list(zip(problem.slides, problem.friction.forces(x), strict=True))
    largest = max((float(-rows[where].min(initial=0.0)) for where in _between(problem).values()), default=0.0)
    found = []
    for name, where in _between(problem).items():
        block = problem.blocks()[name]
        assert isinstance(block, BetweenRows)
        one, other = (int(word) for word in name.split("_")[1:])
        for place, at, at_other, row in zip(block.places(x), *block.ends(x), rows[where], strict=True):
            push = -float(row)
            if push <= alone.LEAST * max(1.0, largest):
                continue
            spots = (_spot(problem, x, one, place[:2], 0.5 * (at_other - at)),
                     _spot(problem, x, other, place[2:], 0.5 * (at - at_other)))  # fmt: skip
            if not _touched(before, one, other, spots):
                continue
            normal = (at - at_other) / np.linalg.norm(at - at_other)
            near = [pair for pair in known if (pair[0].one, pair[0].other) == (one, other)]
            force, stiffness, bound = np.zeros(3), alone.SOFT, problem.mu * push
            if near:
                old, force = min(near, key=lambda pair: _away(pair[0].spots, spots))
                stiffness = min(alone.STIFF, alone.STIFFER * old.stiffness)
            force = force - (force @ normal) * normal
            size = float(np.linalg.norm(force))
            force = force * min(1.0, bound / size) if size > 0.0 else force
            found.append(Slide(one, other, spots, tuple(normal.tolist()), _then(before, one, other, spots), bound,
                               tuple(force.tolist()), stiffness))  # fmt: skip
    return tuple(found)


def _between(problem: StripsProblem) -> dict[str, slice]:
    return {name: where for name, where in problem.block_slices().items() if name.startswith("touching_")}


def _spot(problem: StripsProblem, x: FloatArray, k: int, place: FloatArray, arm: FloatArray) -> Spot:
    """The spot of strip k at the place (s, u) of its rulings, with an arm (3,) in l_0."""
    part, own, (s, u) = problem.parts[k], problem.own(x, k), map(float, place)
    points, frames = part.joints(own)
    _, frame, _, eta = surface.centreline(
        part.parameters(own), part.lengths, points, frames, np.array([s]), part.exponent_limit, 0, part.fields.free
    )
    turned = frame[0].T @ arm / problem.lengths_over[k]
    return Spot(s, s if part.fields.free else s + u * float(eta[0]), u, tuple(turned.tolist()))


def _then(state: StripsEquilibrium, one: int, other: int, spots: tuple[Spot, Spot]) -> tuple[float, float, float]:
    """Y - Y' of spots in a state, l_0."""
    places = [
        state.problem.lengths_over[k] * spot_rows(state.problem.parts[k], [spot], np.eye(3)[0]).points(
            state.problem.own(state.x, k)
        )[0]
        for k, spot in zip((one, other), spots, strict=True)
    ]  # fmt: skip
    return tuple((places[0] - places[1]).tolist())


def _touched(state: StripsEquilibrium, one: int, other: int, spots: tuple[Spot, Spot]) -> bool:
    """Whether two strips pushed each other near these spots: what touches anew has no friction in its first
    increment."""
    far = [max(FAR, SEGMENTS * float(state.problem.parts[k].lengths.max())) for k in (one, other)]
    return any(
        abs(place.s - spots[0].particle) <= far[0] and abs(place.s_other - spots[1].particle) <= far[1]
        for place in state.touching
        if (place.one, place.other) == (one, other)
    )


def _away(some: tuple[Spot, Spot], others: tuple[Spot, Spot]) -> float:
    """How far (l) spots are from each other along and across both strips."""
    return max(max(abs(a.particle - b.particle), abs(a.v - b.v)) for a, b in zip(some, others, strict=True))


def _difference(problem: StripsProblem, fresh: tuple[Slide, ...]) -> float:
    """By how much bounds and friction of `fresh` differ from those of the problem, over the largest push, at least
    1."""
    left, worst = list(problem.slides), 0.0
    for slide in fresh:
        near = [old for old in left if (old.one, old.other) == (slide.one, slide.other)]
        old = min(near, key=lambda each: _away(each.spots, slide.spots), default=None)
        away = np.inf if old is None else _away(old.spots, slide.spots)
        if old is None or away > _PLACED:
            worst = max(worst, slide.bound)
            continue
        left.remove(old)
        worst = max(worst, abs(old.bound - slide.bound), slide.bound * away / _PLACED * alone.SETTLED)
        worst = max(worst, float(np.abs(np.subtract(old.force, slide.force)).max()))
    worst = max([worst, *(old.bound for old in left)])
    size = max((slide.bound / problem.mu for slide in fresh if problem.mu), default=1.0)
    return worst / max(1.0, size)
