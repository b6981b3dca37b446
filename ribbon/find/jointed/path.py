"""A round rod on segments that follow its places of contact, along a path and on ever more segments."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbon.errors import RibbonInputError
from ribbon.find.jointed import touching as touch
from ribbon.find.jointed.rounds import Jointed, is_ring, settled
from ribbon.find.jointed.touching import Line, Touching
from ribbon.judge import passage
from ribbon.problems.mixed import MixedProblem

FloatArray = NDArray[np.float64]

#: How the gap bends at a place (over 1 / diameter) below which it may be about to become a line, and half the length
#: (segments) with which that begins.
_FLAT, _OPENED = 0.02, 0.3
#: Part of them by which as many segments between places are too many, or too few.
_RENEWED = 0.2


def refined(problem: MixedProblem, old: Jointed) -> Jointed | None:
    """The equilibrium on twice as many segments: each is halved, then joints follow; None, and raises, as `settled`."""
    counts = tuple(2 * count for count in old.counts)
    return settled(problem, Jointed(old.state, old.touching.doubled(), 0.5 * old.length, counts))


def followed(
    problem_at: Callable[[float], MixedProblem],
    start: Jointed,
    begin: float,
    end: float,
    step: float,
    smallest: float = 1e-3,
    note: Callable[[float, Jointed], None] | None = None,
) -> tuple[float, Jointed]:
    """From a parameter to another, by steps of `step`, halved where one is not found or leads through the rod itself;
    how far it got, and the state.

    problem_at: the problem of a parameter, in whose unit are begin, end (on either side of it), step, which is the
    longest, and smallest, the one below which it ends before `end`; start: an equilibrium at `begin`; note: told every
    parameter that is reached, and its state. Raises RibbonInputError where step or smallest is not positive.
    """
    for key, size in (("step", step), ("smallest", smallest)):
        if not size > 0.0:
            raise RibbonInputError(key, size, "a positive step is needed")
    at, here, size = begin, start, step
    behind: tuple[float, Jointed] | None = None
    way = np.sign(end - begin)
    while abs(end - at) > 1e-12:
        to = end if abs(end - at) <= size else at + way * size
        guess = here if behind is None else _ahead(*behind, at, here, to)
        fresh = settled(problem_at(to), guess) or _with_line(problem_at(to), guess)
        if fresh is None or _passes(here, fresh):
            size, behind = 0.5 * size, None
            if size < smallest:
                break
            continue
        behind, at, here, size = (at, here), to, fresh, min(1.5 * size, step)
        evened = _even(fresh)
        if evened is not fresh:  # at the same parameter: with other segments a step is lost more easily
            other = settled(problem_at(to), evened)
            here, behind = (fresh, behind) if other is None or _passes(fresh, other) else (other, None)
        if note is not None:
            note(at, fresh)
    return at, here


def _with_line(problem: MixedProblem, here: Jointed) -> Jointed | None:
    """The next state with a line where strands all but lie along each other at a place of their own: there a place
    slides at next to no change of its gap, and the next one is a line."""
    count, old = len(here.touching.places), here.state.problem
    assert isinstance(old, MixedProblem)
    if not count:
        return None
    bulge = old.pair_rows().bulge(here.state.x)[:count]
    k = int(np.argmin(bulge))
    if bulge[k] > _FLAT / old.apart:
        return None
    (s, other), reach = here.touching.places[k], _OPENED * here.length
    line = touch.short_line(here.state, s, other, reach)
    places = tuple(place for i, place in enumerate(here.touching.places) if i != k)
    opened = Touching(places, (*here.touching.lines, line))
    return settled(problem, replace(here, touching=opened, counts=()))


def _passes(here: Jointed, fresh: Jointed) -> bool:
    one, other = here.state.problem, fresh.state.problem
    assert isinstance(one, MixedProblem)
    assert isinstance(other, MixedProblem)
    return passage.passage(one, here.state.x, other, fresh.state.x) is not None


def _even(here: Jointed) -> Jointed:
    """With as many segments between places as these are apart, where that is another number by two or more, and by a
    fifth."""
    problem = here.state.problem
    assert isinstance(problem, MixedProblem)
    touching = here.touching.on(here.length)
    counts = touch.joints(touching, here.length, is_ring(problem))[1]
    old = [*here.counts, *(line.segments for line in here.touching.lines)]
    new = [*counts, *(line.segments for line in touching.lines)]
    if len(old) == len(new) and all(abs(a - b) < max(2.0, _RENEWED * b) for a, b in zip(old, new, strict=True)):
        return here
    return replace(here, touching=touching, counts=counts)


def _ahead(before: float, old: Jointed, at: float, here: Jointed, to: float) -> Jointed:
    """The state continued straight through the last two, where both are on as many segments."""
    same = old.counts == here.counts and len(old.touching.places) == len(here.touching.places)
    lines = [line.segments for line in old.touching.lines] == [line.segments for line in here.touching.lines]
    if not (same and lines) or old.state.x.size != here.state.x.size or old.state.rows.size != here.state.rows.size:
        return here
    share = (to - at) / (at - before)

    def on(one: Any, other: Any) -> FloatArray:
        return np.asarray(other) + share * (np.asarray(other) - np.asarray(one))

    one, other = old.touching, here.touching
    places = tuple((float(a), float(b)) for a, b in on(one.places, other.places)) if other.places else ()
    ends = []
    for a, b in zip(one.lines, other.lines, strict=True):
        first, last = on((a.begin, a.end), (b.begin, b.end)).tolist()
        ends.append(Line(first, last, tuple(map(float, on(a.facing, b.facing))), b.closed))
    touching = Touching(places, tuple(ends))
    problem = here.state.problem
    assert isinstance(problem, MixedProblem)
    s, _ = touch.joints(touching, here.length, is_ring(problem), here.counts)
    if s.size != problem.lengths.size + 1 or not np.all(np.diff(s) > 0.0):
        return here
    guess = problem.with_changes(lengths=np.diff(s), pairs=touching.pairs())
    rows = on(old.state.rows, here.state.rows)
    state = replace(here.state, problem=guess, x=on(old.state.x, here.state.x), rows=rows)
    return replace(here, state=state, touching=touching)
