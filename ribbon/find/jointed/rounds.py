"""A round rod's equilibrium on segments that follow its places of contact.

What touches where is part of the state (`Touching`): the equilibrium is found with it held, places slide to where they
are nearest, the ends of lines go to where the gap leaves zero with its third derivative (by secants), joints follow,
and the equilibrium is found again from its own multipliers, until nothing moves. What pulls is let go; what is too near
besides is a new place, and a place beside which strands are too near becomes a line of one segment.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbon.find import apart
from ribbon.find.jointed import touching as touch
from ribbon.find.jointed.touching import Line, Touching
from ribbon.find.solving.request import How
from ribbon.find.solving.verdict import judged
from ribbon.judge import nearness, strands
from ribbon.problems import mixed_kernels as kernels
from ribbon.problems.itself.pairs import Pair
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.transfer import transferred
from ribbon.result import Equilibrium
from ribbon.solvers import newton_rows
from ribbon.solvers.problem import RESIDUAL_TOLERANCE, Minimum

FloatArray = NDArray[np.float64]
#: Of a line and a side of it: where its end was, the gap's second derivative there, and how that changes outwards.
Ends = dict[tuple[int, int], tuple[float, float, float]]

#: Rounds of joints that move, of which each takes an equilibrium; iterations of one.
ROUNDS, _MOST = 40, 80
#: Part of a segment by which places, and ends of lines, are beside their joints at the most.
_PLACED, _ENDED = 1e-3, 1e-2
#: Part of a segment that an end must have gone for a secant.
_SEEN = 3e-3
#: Part of the way to where the second derivative would vanish that an end goes at first, and of a segment at the most.
_FIRST, _STEP = 0.5, 0.4
#: Part of a segment below which a line is a place.
_SHORT = 0.1
#: Segments from a place of contact within which strands that are too near are of its own line.
_OWN = 2.5
#: Part of the largest force from which a place pushes.
_CLEARLY = 1e-3
#: Part of it below which a place pushes nothing and is let go.
_NONE = 1e-6


@dataclass(frozen=True)
class Jointed:
    """An equilibrium, what touches in it, and its segments.

    state: of a `MixedProblem`, on any segments where a search starts from it; length: about that (l) of the segments
    beside lines; counts: how many are between one place, or end of a line, and the next along the strip, those on lines
    left out, (): as the length says; even: half a turn takes the state to itself, s to 1 - s, and joints are put so.
    """

    state: Equilibrium
    touching: Touching
    length: float
    counts: tuple[int, ...] = ()
    even: bool = False

    @property
    def pushes(self) -> FloatArray:
        """What each pair pushes with (k,), D w / l^2: places, then the stations of lines."""
        where = self.state.problem.block_slices().get("pairs")
        return np.empty(0) if where is None else np.asarray(-self.state.rows[where])

    def lines(self) -> list[dict[str, Any]]:
        """Each line of contact: `s` and `s_other`, where it begins and ends on both strands (over l); `force`, what it
        pushes with in all (D w / l^2); and at its stations `at` (over l) that `share` of it (sums to `force`): at both
        ends a force of its own and half a step of what is spread over the line."""
        found, k = [], len(self.touching.places)
        for line in self.touching.lines:
            own = self.pushes[k : k + line.rows]
            k += line.rows
            ends = [line.facing[0], line.facing[-1]]
            found.append({
                "s": [line.begin, line.end], "s_other": ends, "force": float(own.sum()),
                "at": line.stations[: line.rows].tolist(), "share": own.tolist(),
            })  # fmt: skip
        return found


def begun(state: Equilibrium) -> Touching:
    """What touches in an equilibrium on segments that do not follow it."""
    problem = state.problem
    assert isinstance(problem, MixedProblem)
    pushing = apart.pushing_with(problem, state)
    least = _CLEARLY * max((force for _, force in pushing), default=0.0)
    held = sorted(((pair, force) for pair, force in pushing if force > least), key=lambda each: each[0].s)
    places, lines = [(pair.s, pair.s_other) for pair, _ in held if not pair.stays], []
    stay = [(pair, force) for pair, force in held if pair.stays]
    for run in strands.lines_of(problem, [pair for pair, _ in stay]):
        s, other, force = (
            np.array(v) for v in zip(*((stay[k][0].s, stay[k][0].s_other, stay[k][1]) for k in run), strict=True)
        )
        if s.size > 2 and s[0] == 0.0 and abs(s[-1] - other[0]) < _SHORT / problem.lengths.size and is_ring(problem):
            lines.append(_closed(s, other))
        elif s.size > 2:
            lines.append(Line(float(s[0]), float(s[-1]), tuple(map(float, other))))
        else:
            places.append((float(s @ force / force.sum()), float(other @ force / force.sum())))
    return Touching(tuple(places), tuple(lines))


def _closed(s: FloatArray, other: FloatArray) -> Line:
    """The line without ends of a ring that touches itself all along, of its stations s (k,) and what faces them (k,):
    the last is the first one again, its strands exchanged."""
    stations = np.linspace(0.0, other[0], s.size)
    facing = np.interp(stations, np.append(s[:-1], other[0]), np.append(other[:-1], 1.0))
    return Line(0.0, float(other[0]), tuple(map(float, facing)), True)


def settled(problem: MixedProblem, old: Jointed, how: How | None = None) -> Jointed | None:
    """The equilibrium of `problem`, whatever its segments and pairs, from `old` on segments that follow its places,
    judged; None where none is found, something pulls, or strands are too deep in each other between joints.

    problem: of a round rod that is kept apart from itself (`apart` > 0). Places are within 1e-3, ends of lines within
    1e-2 of a segment where they belong, but an end whose gap outside has no nearest place stays where it is. how: of
    the verdict, None: the usual one. Raises AssertionError where `problem`, or the one `old` is of, is not mixed.
    """
    here = old
    before: Ends = {}
    for _ in range(ROUNDS):
        found = _found(problem, here)
        if found is None:
            return None
        fresh, minimum = found
        changed = _changed(fresh)
        if changed is not None:
            changed = changed.even() if fresh.even else changed
            here, before = replace(fresh, touching=changed, counts=()), {}
            continue
        moved = _moved(fresh, before)
        if _far(fresh, moved):
            here = replace(fresh, touching=moved)
            continue
        own = fresh.state.problem
        assert isinstance(own, MixedProblem)
        if (fresh.pushes < 0.0).any() or nearness.minima(own, minimum.x, -nearness.TOLERANCE):
            return None
        return replace(fresh, state=judged(own, minimum, how or How()))
    return None


def _found(problem: MixedProblem, old: Jointed) -> tuple[Jointed, Minimum] | None:
    """The equilibrium with what touches in `old` held at joints."""
    was = old.state.problem
    assert isinstance(was, MixedProblem)
    s, counts = touch.joints(old.touching, old.length, is_ring(problem), old.counts)
    fresh = problem.with_changes(lengths=np.diff(s), pairs=old.touching.pairs())
    fresh = fresh.anchored(was.anchor(old.state.x))
    x = transferred(was, old.state.x, fresh)
    options: dict[str, Any] = {"max_iter": _MOST, "travel": apart.TRAVEL * fresh.apart}
    if fresh.pairs:
        options["sliding"] = newton_rows.SLIDING
    minimum = newton_rows.minimise(fresh, x, options, None, warm(was, old.state, fresh, x, old.length))
    if not minimum.residual <= RESIDUAL_TOLERANCE:
        minimum = newton_rows.minimise(fresh, x, options)
    if not minimum.residual <= RESIDUAL_TOLERANCE:
        return None
    touching = touch.slid(fresh, minimum.x, old.touching)
    state = judged(fresh, minimum, How(check=False))
    return replace(old, state=state, touching=touching, counts=counts), minimum


def is_ring(problem: MixedProblem) -> bool:
    """Whether both ends are at one place, so that the rod is held halfway too."""
    start, end = problem.start, problem.end
    if start is None or end is None or start.position is None or end.position is None:
        return problem.joined
    return bool(np.allclose(start.position, end.position, atol=1e-12))


def warm(
    was: MixedProblem, state: Equilibrium, fresh: MixedProblem, x: FloatArray, length: float
) -> tuple[FloatArray, FloatArray]:
    """Multipliers of the rows of `fresh` at its unknowns x (n,), and of its bounds, from a state of `was`: of pairs
    what pushed there (per length on lines), of what holds the ends the same, of the glue from balance. length: about
    that (l) of segments."""
    rows = np.zeros(fresh.row_count)
    here, there = fresh.block_slices(), was.block_slices()
    for name, where in there.items():
        if name != "pairs" and name in here:
            rows[here[name]] = state.rows[where]
    if fresh.pairs and was.pairs:
        push = -state.rows[there["pairs"]]
        rows[here["pairs"]] = -_shared(was.pairs, push, fresh.pairs, length)
    glue = kernels.ROWS * fresh.lengths.size
    row, column = fresh.jacobian_structure()
    jacobian = fresh.jacobian(x)
    slope = fresh.gradient(x) + np.bincount(column, jacobian * rows[row], minlength=fresh.size)
    kernels.costates(jacobian, fresh.fields.components, slope, rows[:glue])
    bounds = state.multipliers
    return rows, bounds if bounds.size == fresh.size else np.zeros(fresh.size)


def _shared(old: tuple[Pair, ...], push: FloatArray, fresh: tuple[Pair, ...], near: float) -> FloatArray:
    """What pairs (k,) push with at first: as before where they are as many, else each push goes to the pairs beside it
    of the same kind, or of any; to stations by how near they are over how far the next one was, so that pushes per
    length go on straight from one to the next, to others in equal parts."""
    if len(old) == len(fresh):
        return push
    s, out = np.array([pair.s for pair in fresh]), np.zeros(len(fresh))
    stays = np.array([pair.stays for pair in fresh])
    stations = np.array([pair.s for pair in old if pair.stays])
    for pair, force in zip(old, push, strict=True):
        far = np.abs(s - pair.s)
        if pair.stays and stations.size > 1:
            width = float(np.sort(np.abs(stations - pair.s))[1])
            share = np.where(stays, np.maximum(1.0 - far / max(width, 1e-300), 0.0), 0.0)
            if share.sum() > 0.5:
                out += force * share / share.sum()
                continue
        close = far < near
        alike = close & (stays == pair.stays)
        to = np.nonzero(alike if alike.any() else close)[0]
        out[to] += force / max(to.size, 1)
    return out


def _changed(here: Jointed) -> Touching | None:
    """What touches instead, where something pulls or is too near; None where nothing does."""
    touching, h = _without_pull(here), here.length
    places, lines = list(touching.places), list(touching.lines)
    problem = here.state.problem
    assert isinstance(problem, MixedProblem)
    for _, pair in nearness.minima(problem, here.state.x, -nearness.TOLERANCE):
        if any(_on(line, pair.s, pair.s_other, h) for line in lines):
            continue
        near = [p for p in places if max(abs(p[0] - pair.s), abs(p[1] - pair.s_other)) < _OWN * h]
        if not near:
            places.append((pair.s, pair.s_other))
            continue
        (s, other), reach = near[0], max(0.25 * h, abs(pair.s - near[0][0]))
        places.remove(near[0])
        lines.append(touch.short_line(here.state, s, other, reach))
    fresh = Touching(tuple(sorted(places)), tuple(lines))
    return None if _same(here.touching, fresh, _PLACED * h) else fresh


def _same(old: Touching, fresh: Touching, near: float) -> bool:
    """Whether the same lines touch, and as many places, each of them nearer than this to one that touched."""
    if len(fresh.places) != len(old.places) or fresh.lines != old.lines:
        return False
    return all(any(max(abs(s - t), abs(r - q)) <= near for t, q in old.places) for s, r in fresh.places)


def _without_pull(here: Jointed) -> Touching:
    """Without places that pull, lines shorter by half a segment where an end does, and a place for a line without
    length."""
    touching, push = here.touching, here.pushes
    k, none = len(touching.places), _NONE * push.max(initial=0.0)
    places = [place for place, force in zip(touching.places, push[:k], strict=True) if force > none]
    lines = []
    for line in touching.lines:
        own, half = push[k : k + line.rows], 0.5 * (line.end - line.begin) / line.segments
        k += line.rows
        if line.closed:
            lines.append(line)
        elif line.end - line.begin < _SHORT * here.length:
            places.append((0.5 * (line.begin + line.end), 0.5 * (line.facing[0] + line.facing[-1])))
        elif own[0] < 0.0 or own[-1] < 0.0:
            lines.append(line.to(line.begin + half * bool(own[0] < 0.0), line.end - half * bool(own[-1] < 0.0)))
        else:
            lines.append(line)
    return Touching(tuple(places), tuple(lines))


def _on(line: Line, s: float, other: float, h: float) -> bool:
    own = line.begin - h <= s <= line.end + h
    return own and min(line.facing) - h <= other <= max(line.facing) + h


def _moved(here: Jointed, before: Ends) -> Touching:
    """What touches where it goes next: places to where they have slid, ends of lines by secants (`before`)."""
    problem = here.state.problem
    assert isinstance(problem, MixedProblem)
    lines = []
    for k, line in enumerate(here.touching.lines):
        if line.closed:
            lines.append(line)
            continue
        slopes = touch.leaving(problem, here.state.x, line)
        ends = []
        for side, (at, way) in enumerate(((line.begin, -1.0), (line.end, 1.0))):
            second, third = slopes[side, 1:]
            if not np.isfinite(second):  # nothing says where to: it stays, and no secant goes through it
                ends.append(at)
                continue
            step = -_FIRST * second / max(third, 1e-300) if third > 0.0 else -_STEP * here.length
            was, value, slope = before.get((k, side), (at, second, np.nan))
            if (k, side) not in before or abs(at - was) > _SEEN * here.length:  # nearer, their difference is noise
                slope = (second - value) / (at - was) * way if at != was else np.nan
                before[(k, side)] = (at, second, slope)
            if np.isfinite(slope):
                secant = -second / slope if slope else np.nan
                step = secant if secant * step > 0.0 else 0.5 * step
            most = min(_STEP * here.length, 0.45 * (line.end - line.begin) if step < 0.0 else np.inf)
            ends.append(at + way * float(np.clip(step, -most, most)))
        lines.append(line.to(*(_alike(line, *ends) if here.even else ends)))
    moved = replace(here.touching, lines=tuple(lines))
    return moved.even() if here.even else moved


def _alike(line: Line, begin: float, end: float) -> tuple[float, float]:
    """Ends for these of a line that half a turn takes to itself: both as far out as in the mean, its middle there. One
    that goes to another is left to itself."""
    off = line.uneven()
    if abs(off) > 0.5 * (line.end - line.begin):
        return begin, end
    out = 0.5 * (line.begin - begin + end - line.end)
    return line.begin - off - out, line.end - off + out


def _far(here: Jointed, moved: Touching) -> bool:
    """Whether joints are not yet where they belong."""
    problem = here.state.problem
    assert isinstance(problem, MixedProblem)
    h, was = here.length, problem.pairs
    for place, pair in zip(moved.places, was, strict=False):
        if max(abs(place[0] - pair.s), abs(place[1] - pair.s_other)) > _PLACED * h:
            return True
    k = len(moved.places)
    for line, old in zip(moved.lines, here.touching.lines, strict=True):
        if max(abs(line.begin - old.begin), abs(line.end - old.end)) > _ENDED * h:
            return True
        for facing, pair in zip(old.facing[: old.rows], was[k:], strict=False):
            if abs(facing - pair.s_other) > _PLACED * h:
                return True
        k += line.rows
    return False
