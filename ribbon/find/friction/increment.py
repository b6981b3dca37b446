"""One increment of a path with friction: normal pushes and friction put right in turn (docs/theory.md, eq. (5.15)).

With the largest friction b = mu N of every place known, an increment is a minimum (`ribbon.problems.friction.term`).
Its pushes N give other bounds, its friction T better guesses, its contacts other places: the next minimum. That is
Tresca's friction iterated (P. D. Panagiotopoulos 1975, doi:10.1007/BF02152596); it settles for coefficients that are
not large. At its end bounds are mu N, guesses T, and places where the strip touches, all to `SETTLED` or `LEFT`:
Coulomb's law holds at the end of the increment, not in the middle of it (backward Euler's rule).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ribbon import surface
from ribbon.contact import Wall
from ribbon.find import contacts, relax
from ribbon.find.friction.history import History
from ribbon.find.solving.request import How
from ribbon.find.solving.verdict import judged
from ribbon.notes import Note
from ribbon.problems import transfer
from ribbon.problems.friction.particles import Rub
from ribbon.problems.mixed import MixedProblem
from ribbon.result import Equilibrium, Status
from ribbon.solvers import choose
from ribbon.solvers.budget import spent
from ribbon.solvers.problem import RESIDUAL_TOLERANCE, Minimum

FloatArray = NDArray[np.float64]

#: Rounds of an increment at the most; change of bounds and friction (over the largest push, at least 1) that ends them,
#: and one that does where it has not fallen to a half for so many rounds: gaps of a barrier, times the stiffness.
ROUNDS = 60
SETTLED, LEFT, IDLE = 1e-8, 5e-7, 4
#: r (D w / l^3) of an increment's first round, where places are yet to stick or slip, its growth, and the largest: what
#: is left of a slip where a place sticks falls by about (the strip's stiffness) / r a round.
SOFT, STIFFER, STIFF = 1e3, 4.0, 1.6e4
#: Push from which a place rubs, over the largest (at least 1 D w / l^2): below it is what an interior point leaves.
LEAST = 1e-8
#: Steps of a minimiser in the first round, and in one after it.
_STEPS, _STEPS_NEXT = 150, 30
#: Lengths along the strip (l) at which a wait of one is a difference of its push.
_PLACED = 1e-6


def increment(problem: MixedProblem, state: Equilibrium, history: History, how: How) -> Equilibrium:
    """The equilibrium of `problem`, anchored at `state`, at the end of an increment that begins with `history`.

    Begun from the shape of `state`. Not converged where no minimum is found, or bounds and friction do not settle."""
    how = replace(how, options={"max_iter": _STEPS, **(how.options or {})})
    with choose.using("newton" if choose.asked() == "auto" else None):  # what it does not find a shorter step may
        return _settled(problem.with_changes(rubs=again(problem, state, history)), state, history, how)


def _settled(problem: MixedProblem, state: Equilibrium, history: History, how: How) -> Equilibrium:
    minimum = _begun(problem, state, how)
    change, count = np.inf, minimum.iterations
    least, idle = np.inf, 0
    for _ in range(ROUNDS):
        if minimum.residual > RESIDUAL_TOLERANCE or spent():
            break
        problem, minimum = contacts.held(problem, minimum, how.options, how.progress)
        rubs = rubbing(problem, minimum.x, minimum.rows, history)
        change = difference(problem, minimum, rubs)
        least, idle = (change, 0) if change < 0.5 * least else (least, idle + 1)
        if change <= SETTLED or (change <= LEFT and idle >= IDLE):
            break
        problem, minimum = _next(problem, rubs, minimum, how)
        count += minimum.iterations
    found = judged(problem, replace(minimum, iterations=count), how)
    if found.status not in (Status.CONVERGED, Status.SADDLE) or change <= LEFT:
        return found
    text = Note.RUBS_UNSETTLED.text(change=change, rounds=ROUNDS)
    return replace(found, status=Status.NOT_CONVERGED, stable=None, message=text, notes=(Note.RUBS_UNSETTLED,))


def _begun(problem: MixedProblem, state: Equilibrium, how: How) -> Minimum:
    old = state.problem
    assert isinstance(old, MixedProblem)
    x = transfer.transferred(old, state.x, problem)
    same = list(old.block_slices()) == list(problem.block_slices()) and state.rows.size == problem.row_count
    if same:
        warm = choose.minimise(problem, x, how.options, how.progress, (state.rows, state.multipliers))
        if warm.residual <= RESIDUAL_TOLERANCE:
            return warm
    return relax.from_near(problem, x, how.options, how.progress)


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
    for k, wall in enumerate(problem.walls):
        if not wall.friction:
            continue
        own = [(rub, force) for rub, force in zip(problem.rubs, forces, strict=True) if rub.wall == k]
        every = contacts.pushed(problem, x, rows, k)
        least = LEAST * max([1.0, *(push for _, _, push in every)])
        for (s, side, push), v in zip(every, contacts.across(problem, x, k), strict=True):
            if push <= least or not history.known(k, s):
                continue
            near = [pair for pair in own if contacts.line(pair[0].side) == side] or own
            force, stiffness = np.zeros(3), SOFT
            if near:
                old, force = min(near, key=lambda pair: abs(pair[0].s - s))
                stiffness = min(STIFF, STIFFER * old.stiffness)
            rub = _rub(problem, x, k, s, v, wall.friction * push, force)
            found.append(rub._replace(stiffness=stiffness))
    return tuple(_with_places(problem, history, tuple(found)))


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
    mu = [problem.walls[rub.wall].friction for rub in rubs]
    size = max((rub.bound / own for rub, own in zip(rubs, mu, strict=True)), default=1.0)
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
    return worst / max(1.0, size)
