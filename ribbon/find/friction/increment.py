"""One increment of a path with friction: normal pushes and friction put right in turn (docs/theory.md, eq. (5.15)).

With the largest friction b = mu N of every place known, an increment is a minimum (`ribbon.problems.friction.term`).
Its pushes N give other bounds, its friction T better guesses, its contacts other places: the next minimum. That is
Tresca's friction iterated (P. D. Panagiotopoulos 1975, doi:10.1007/BF02152596); it settles for coefficients that are
not large. Beside such a minimum Newton's method finds bounds, pushes and shape at once
(`ribbon.find.friction.coupled`), and where it arrives that is the next one: what lies along a line settles by it alone.
At its end bounds are mu N, guesses T, and places where the strip touches, all to `SETTLED` or `LEFT`: Coulomb's law
holds at the end of the increment, not in the middle of it (backward Euler's rule).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ribbon import surface
from ribbon.contact import Wall
from ribbon.find import contacts, relax
from ribbon.find.friction import coupled, pushes
from ribbon.find.friction.history import History
from ribbon.find.solving.request import How
from ribbon.find.solving.verdict import judged
from ribbon.judge import penetration
from ribbon.notes import Note
from ribbon.problems import transfer
from ribbon.problems.friction.particles import Rub
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.touching import Touch
from ribbon.result import Equilibrium, Status
from ribbon.solvers import choose
from ribbon.solvers.budget import spent
from ribbon.solvers.problem import RESIDUAL_TOLERANCE, Minimum

FloatArray = NDArray[np.float64]

Start = tuple[MixedProblem, Minimum]
Begun = Callable[[MixedProblem, Equilibrium, How], Start | None]

#: Rounds of an increment at the most; change of bounds and friction (over the largest push, at least 1) that ends them,
#: and one that does where it has not fallen to a half for so many rounds: gaps of a barrier, times the stiffness.
ROUNDS = 60
SETTLED, LEFT, IDLE = 1e-8, 5e-7, 4
#: r (D w / l^3) of an increment's first round, where places are yet to stick or slip, its growth, and the largest: what
#: is left of a slip where a place sticks falls by about (the strip's stiffness) / r a round.
SOFT, STIFFER, STIFF = 1e3, 4.0, 1.6e4
#: Push from which a place rubs, over the largest (at least 1 D w / l^2): below it is what an interior point leaves.
LEAST = 1e-8
#: Part of friction's change in a round by which it differs from that of the round before and is the same.
_STEADY = 0.1
#: Part of the largest such change from which a place is one of those that slip first.
_MOSTLY = 0.5
#: Steps of a minimiser in the first round, and in one after it.
_STEPS, _STEPS_NEXT = 150, 30
#: Lengths along the strip (l) at which a wait of one is a difference of its push.
_PLACED = 1e-6
#: How far (l) along its edge a particle may be from the row of a line of contact that pushes it, to be the one that
#: rubs there still.
_SAME = 1e-4


def increment(problem: MixedProblem, state: Equilibrium, history: History, how: How) -> Equilibrium:
    """The equilibrium of `problem`, anchored at `state`, at the end of an increment that begins with `history`.

    Begun from the shape of `state`. Not converged where no minimum is found, or bounds and friction do not settle."""
    how = replace(how, options={"max_iter": _STEPS, **(how.options or {})})
    with choose.using("newton" if choose.asked() == "auto" else None):  # what it does not find a shorter step may
        rubs = again(problem, state, history)
        own = problem.with_changes(touching=(*problem.touching, *_sliding(problem, state)), rubs=rubs)
        found = _settled(own, state, history, how, _beside)
        if found is not None and (found.status is Status.CONVERGED or spent()):
            return found
        found = _settled(problem.with_changes(rubs=rubs), state, history, how, _begun)
        assert found is not None
        return found


def _sliding(problem: MixedProblem, state: Equilibrium) -> tuple[Touch, ...]:
    """The places of `state` that slide, of walls that the problem still has."""
    return tuple(touch for touch in state.problem.touching if touch.slides and touch.wall < len(problem.walls))


def _settled(problem: MixedProblem, state: Equilibrium, history: History, how: How, begun: Begun) -> Equilibrium | None:
    """The end of the increment, or where it does not settle; None where `begun` finds no state to go on from."""
    start = begun(problem, state, how)
    if start is None:
        return None
    problem, minimum = start
    change, count = np.inf, minimum.iterations
    least, idle, fixed = np.inf, 0, False
    last: FloatArray | None = None
    now: FloatArray | None = None
    for _ in range(ROUNDS):
        if minimum.residual > RESIDUAL_TOLERANCE or spent():
            break
        if not fixed or _deep(problem, minimum):
            problem, minimum = contacts.held(problem, minimum, how.options, how.progress)
            fixed = _stays(problem, minimum)
        minimum = pushes.least(problem, minimum)
        rubs = rubbing(problem, minimum.x, minimum.rows, history)
        change = difference(problem, minimum, rubs)
        least, idle = (change, 0) if change < 0.5 * least else (least, idle + 1)
        if change <= SETTLED or (change <= LEFT and idle >= IDLE):
            break
        last, now = now, crept(problem.rubs, rubs)
        if now is not None and steady(last, now, LEFT * _largest(problem, rubs)):
            rubs, least, idle = further(rubs, now), np.inf, 0
        at_once = coupled.settled(problem, minimum, rubs, pushes.bounding(problem, minimum.x, rubs))
        problem, minimum = at_once or _next(problem, rubs, minimum, how)
        count += minimum.iterations
    found = judged(problem, replace(minimum, iterations=count), how)
    if found.status not in (Status.CONVERGED, Status.SADDLE) or change <= LEFT:
        return found
    text = Note.RUBS_UNSETTLED.text(change=change, rounds=ROUNDS)
    return replace(found, status=Status.NOT_CONVERGED, stable=None, message=text, notes=(Note.RUBS_UNSETTLED,))


def crept(before: tuple[Rub, ...], rubs: tuple[Rub, ...]) -> FloatArray | None:
    """By how much (k, 3) friction went on in a round where places stick; None where the places are not the same."""
    found = np.zeros((len(rubs), 3))
    for row, rub in zip(found, rubs, strict=True):
        own = [old for old in before if (old.wall, contacts.line(old.side)) == (rub.wall, contacts.line(rub.side))]
        near = min(own, key=lambda old: abs(old.particle - rub.particle), default=None)
        if near is None or abs(near.particle - rub.particle) > _PLACED:
            return None
        if float(np.linalg.norm(rub.force)) < rub.bound * (1.0 - 1e-9):
            row[:] = np.subtract(rub.force, near.force)
    return found


def steady(last: FloatArray | None, now: FloatArray | None, least: float) -> bool:
    """Whether friction goes on by the same amount, more than `least`, as in the round before, where places stick in
    both."""
    if last is None or now is None or last.shape != now.shape or not now.any():
        return False
    both = now.any(axis=1) & last.any(axis=1)
    size = float(np.abs(now[both]).max(initial=0.0))
    return size > least and float(np.abs(now - last)[both].max()) <= _STEADY * size


def further(rubs: tuple[Rub, ...], now: FloatArray) -> tuple[Rub, ...]:
    """The guesses as far on as friction goes until the first of the places that change most slips.

    Particles that cannot all keep their places (they were beside the wall, and what is between them keeps its length)
    take friction from each other, r times what is missing a round, until one of them is at its bound."""
    size = np.linalg.norm(now, axis=1)
    first = [k for k in range(len(rubs)) if size[k] >= _MOSTLY * size.max()]
    most = min(_until(rubs[k], now[k]) for k in first)
    found = []
    for rub, row in zip(rubs, now, strict=True):
        force = np.asarray(rub.force) + most * row
        own = float(np.linalg.norm(force))
        found.append(rub._replace(force=tuple((force * min(1.0, rub.bound / own) if own > 0.0 else force).tolist())))
    return tuple(found)


def _until(rub: Rub, row: FloatArray) -> float:
    """k of |T + k D| = b."""
    force, square = np.asarray(rub.force), float(row @ row)
    half, rest = float(force @ row), rub.bound**2 - float(force @ force)
    return float((np.sqrt(half**2 + square * rest) - half) / square)


def _deep(problem: MixedProblem, minimum: Minimum) -> bool:
    return bool(penetration.minima(problem, minimum.x, -penetration.TOLERANCE))


def _stays(problem: MixedProblem, minimum: Minimum) -> bool:
    """Whether a single place of contact was not found sliding: rounds that change friction alone would try in vain."""
    places = contacts.single_places(problem, minimum)
    return not all(contacts.place_slides(problem, place) for place in places)


def _same(problem: MixedProblem, state: Equilibrium) -> bool:
    """Whether the state's multipliers are those of the problem's rows."""
    old = state.problem
    return list(old.block_slices()) == list(problem.block_slices()) and state.rows.size == problem.row_count


def _carried(problem: MixedProblem, state: Equilibrium) -> FloatArray:
    """The state's shape, carried along its walls by the clamp where nothing else holds it."""
    old = state.problem
    assert isinstance(old, MixedProblem)
    x = transfer.transferred(old, state.x, problem)
    walls = [np.asarray(wall.normal) for wall in problem.walls if isinstance(wall, Wall)]
    free = problem.end is None and len(walls) == len(problem.walls)
    if free and problem.start_position is not None and old.start_position is not None:
        shift = problem.start_position - old.start_position
        for normal in walls:
            shift = shift - (shift @ normal) * normal
        problem.layout.positions(x)[:] += shift
    return np.clip(x, *problem.bounds())


def _beside(problem: MixedProblem, state: Equilibrium, how: How) -> Start | None:
    """By Newton's method with pushes and friction at once, from the state: most increments are as small as that."""
    if not problem.rubs or not _same(problem, state):
        return None
    x = _carried(problem, state)
    guess = Minimum(x, state.multipliers, state.rows, np.inf, 0, 0, "", True, 0.0, state.solver)
    return coupled.settled(problem, guess, problem.rubs, pushes.bounding(problem, x, problem.rubs))


def _begun(problem: MixedProblem, state: Equilibrium, how: How) -> Start:
    """The minimum with the friction that is known."""
    x = _carried(problem, state)
    if _same(problem, state):
        warm = choose.minimise(problem, x, how.options, how.progress, (state.rows, state.multipliers))
        if warm.residual <= RESIDUAL_TOLERANCE:
            return problem, warm
    return problem, relax.from_near(problem, x, how.options, how.progress)


def _next(problem: MixedProblem, rubs: tuple[Rub, ...], minimum: Minimum, how: How) -> tuple[MixedProblem, Minimum]:
    """The problem with other bounds and guesses and its minimum, from that with the ones before; with softer places
    where none is found at once."""
    options = {**(how.options or {}), "max_iter": _STEPS_NEXT}
    for own in (rubs, tuple(rub._replace(stiffness=SOFT) for rub in rubs)):
        fresh = problem.with_changes(rubs=own)
        fresh.counters.add(problem.counters)
        if list(problem.block_slices()) == list(fresh.block_slices()):
            found = choose.minimise(fresh, minimum.x, options, how.progress, (minimum.rows, minimum.multipliers))
            if found.residual <= RESIDUAL_TOLERANCE:
                return fresh, found
    return fresh, relax.from_near(fresh, minimum.x, how.options, how.progress)


def again(problem: MixedProblem, state: Equilibrium, history: History) -> tuple[Rub, ...]:
    """What rubbed at the end of the last increment, to begin this one with: where the same particles were there."""
    old = state.problem
    if not isinstance(old, MixedProblem) or len(old.walls) != len(problem.walls) or state.rows.size != old.row_count:
        return ()
    rubs = rubbing(old.with_changes(walls=problem.walls, rubs=old.rubs), state.x, state.rows, history)
    return tuple(rub._replace(stiffness=SOFT) for rub in _with_places(problem, history, rubs))


def _with_places(problem: MixedProblem, history: History, rubs: tuple[Rub, ...]) -> list[Rub]:
    found = []
    for rub in rubs:
        particle = np.array([[rub.particle, rub.side * problem.half_width]])
        place = history.places(rub.wall, problem.walls[rub.wall], particle)[0]
        found.append(rub._replace(place=tuple(place.tolist())))
    return found


def rubbing(problem: MixedProblem, x: FloatArray, rows: FloatArray, history: History) -> tuple[Rub, ...]:
    """The particles that walls with friction push at x, with the bounds that their pushes give, and what is
    known of their friction: that of the nearest place on the same line of the strip."""
    forces = np.empty((0, 3)) if problem.friction is None else problem.friction.forces(x)
    found: list[Rub] = []
    sliding = {(t.wall, contacts.line(t.side), problem.segment_at(t.s)) for t in problem.touching if t.slides}
    for k, wall in enumerate(problem.walls):
        if not wall.friction:
            continue
        own = [(rub, force) for rub, force in zip(problem.rubs, forces, strict=True) if rub.wall == k]
        every = together(contacts.pushed(problem, x, rows, k), contacts.across(problem, x, k))
        least = LEAST * max([1.0, *(push for _, _, push, _ in every)])
        for s, side, push, v in every:
            if push <= least or not history.known(k, s):
                continue
            near = [pair for pair in own if contacts.line(pair[0].side) == side] or own
            force, stiffness = np.zeros(3), SOFT
            if near:
                old, force = min(near, key=lambda pair: abs(pair[0].s - s))
                stiffness = min(STIFF, STIFFER * old.stiffness)
            rub = _rub(problem, x, k, s, v, wall.friction * push, force)._replace(stiffness=stiffness)
            if near and (k, side, problem.segment_at(s)) not in sliding and abs(old.particle - rub.particle) <= _SAME:
                rub = rub._replace(particle=old.particle)  # rulings of what is flat turn for nothing
            found.append(rub)
    return tuple(_with_places(problem, history, tuple(found)))


def together(points: list[tuple[float, float, float]], across: list[float]) -> list[tuple[float, float, float, float]]:
    """Abscissa, edge, push and place across of what pushes, those as one that are at one place.

    A place that slides at a joint is a row of both segments there, and how they share its push is left to rounding."""
    found: list[tuple[float, float, float, float]] = []
    for (s, side, push), v in zip(points, across, strict=True):
        same = [
            k for k, other in enumerate(found)
            if other[1] == side and abs(other[0] - s) <= pushes.ONE and abs(other[3] - v) <= pushes.ONE
        ]  # fmt: skip
        if same:
            one = found[same[0]]
            found[same[0]] = (s, side, push + one[2], v) if push > one[2] else (*one[:2], push + one[2], one[3])
        else:
            found.append((s, side, push, v))
    return found


def _rub(problem: MixedProblem, x: FloatArray, k: int, s: float, side: float, bound: float, force: FloatArray) -> Rub:
    eta = 0.0
    if not problem.fields.free:
        i = problem.segment_at(s)
        q = problem.parameters(x)[i]
        eta = q[2] * (s - float(np.sum(problem.lengths[:i]))) + q[3]
    particle = s + side * problem.half_width * eta
    wall = problem.walls[k]
    normal = np.asarray(wall.normal) if isinstance(wall, Wall) else _normal(problem, x, k, s, side, eta)
    force = force - (force @ normal) * normal
    size = float(np.linalg.norm(force))
    force = force * min(1.0, bound / size) if size > 0.0 else force
    return Rub(
        k, s, side, float(particle), tuple(normal.tolist()), (0.0, 0.0, 0.0), float(bound), tuple(force.tolist())
    )


def _normal(problem: MixedProblem, x: FloatArray, k: int, s: float, side: float, eta: float) -> FloatArray:
    points, frames = problem.joints(x)
    r, frame, _, _ = surface.centreline(
        problem.parameters(x), problem.lengths, points, frames, np.array([s]), problem.exponent_limit, 0,
        problem.fields.free,
    )  # fmt: skip
    own = problem.walls[k].scaled(problem.strip.length)
    point = r + side * problem.half_width * (frame[:, :, 0] + eta * frame[:, :, 2])
    return np.asarray(own.derivatives(point)[1][0])  # type: ignore[union-attr]


def difference(problem: MixedProblem, minimum: Minimum, rubs: tuple[Rub, ...]) -> float:
    """By how much bounds and friction of `rubs` differ from those that the minimum was found with, over the largest
    bound's push, at least 1."""
    left = dict(enumerate(problem.rubs))
    worst = 0.0
    for rub in rubs:
        near = [
            (max(abs(old.particle - rub.particle), problem.half_width * abs(old.side - rub.side)), k)
            for k, old in left.items()
            if (old.wall, contacts.line(old.side)) == (rub.wall, contacts.line(rub.side))
        ]
        away, k = min(near, default=(np.inf, -1))
        if away > _PLACED:
            worst = max(worst, rub.bound)
            continue
        old = left.pop(k)
        worst = max(worst, abs(old.bound - rub.bound), rub.bound * away / _PLACED * SETTLED)
        worst = max(worst, float(np.abs(np.subtract(old.force, rub.force)).max()))
    worst = max([worst, *(old.bound for old in left.values())])
    return worst / _largest(problem, rubs)


def _largest(problem: MixedProblem, rubs: tuple[Rub, ...]) -> float:
    """The largest push, at least 1."""
    return max([1.0, *(rub.bound / problem.walls[rub.wall].friction for rub in rubs)])
