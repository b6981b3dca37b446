"""Segments placed by an error estimate, so that a user asks for a tolerance instead of a number of segments.

Every round solves on the segments and on their halves. The distance d between the two surfaces estimates the error of
the halved ones: it is at most d when halving all segments at least halves the error (measured orders are 1 at a
Wunderlich event that is not resolved and 2 to 4 elsewhere). Where d is too large, the segments that turn the ribbon
most by their error are cut: ``e_i = int |d omega| + |d (omega eta)| ds`` over segment i, d being the difference of the
two solutions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Unpack

import numpy as np
from numpy.typing import NDArray

from ribbon.boundary import Clamp, Closure
from ribbon.element import kernel_cache
from ribbon.errors import RibbonInputError
from ribbon.find import seeds
from ribbon.find.continuation import switch
from ribbon.find.solve import on_segments, solve_request
from ribbon.find.solving.assemble import assembled
from ribbon.find.solving.request import How, Request, Seed, SolveKeywords, split
from ribbon.find.stretched import is_stretched
from ribbon.loads import Gravity
from ribbon.notes import Note
from ribbon.problems.chained import segment_lengths
from ribbon.problems.mixed import MixedProblem
from ribbon.problems.protocol import Problem
from ribbon.result import Equilibrium, Refinement, Status
from ribbon.solvers import choose
from ribbon.solvers.budget import SPENT, spent, within
from ribbon.strip import Strip

with kernel_cache.in_use():
    from ribbon.judge import polyline

FloatArray = NDArray[np.float64]

#: Segments of the first round, most of the last one (halved once more), if a tolerance is a wish only, most rounds.
FIRST_SEGMENTS = 24
MOST_SEGMENTS = 6000
#: How often the first segments are halved where they find no state beside walls.
HALVED = 2
MOST_WISHED = 200
ROUNDS = 30
#: Gamma beyond which the chained unknowns, in which the weight of all that follows a segment is one sum, are not known
#: to the residual that is asked for: 1e-14 Gamma was seen (`compare.battery`, size/weight).
HEAVY = 1e5
#: Share of the sum of e_i that the cut segments carry; a segment this many times above the threshold is quartered.
BULK = 0.8
QUARTERED = 16.0
_GOOD = (Status.CONVERGED, Status.SADDLE)
#: Distance of joints (l) that are one but for rounding.
_SAME = 1e-12
#: Points along the ribbon for the distance.
_ALONG = 2000


def solve_to_tolerance(
    strip: Strip,
    clamp: Clamp | None = None,
    gravity: Gravity | None = None,
    *,
    tolerance: float,
    strict: bool = True,
    **keywords: Unpack[SolveKeywords],
) -> Equilibrium:
    """As `ribbon.solve` (without `segments`), on segments placed so that the surface's error is below `tolerance` * l.

    tolerance: Hausdorff distance over l to the limit of many segments, in (0, 0.1). The estimate is the result's
    `tolerance_error`. strict: see `refine_to_tolerance`. Raises `RibbonInputError` on bad input.
    """
    if not 0.0 < tolerance < 0.1:
        raise RibbonInputError("tolerance", tolerance, "a distance over l in (0, 0.1)")
    if "segments" in keywords:
        raise RibbonInputError("segments", keywords["segments"], "give a tolerance or segments, not both")
    requested, seed, how, budget, solver = split(keywords)
    requested["segments"] = FIRST_SEGMENTS
    request = Request.of(strip, clamp, gravity, **requested)
    with within(budget), choose.using(solver):
        return _to_tolerance(request, seed, how, tolerance, strict)


def _to_tolerance(request: Request, seed: Seed, how: How, tolerance: float, strict: bool) -> Equilibrium:
    """The seam of a Moebius band whose ruling is free is held until the elements are placed."""
    closure = request.closure
    pinned = request
    if _evenly(closure):
        equal = np.full(FIRST_SEGMENTS, 1.0 / FIRST_SEGMENTS)
        first = solve_request(replace(request, lengths=equal), seed, how)
        return refine_to_tolerance(first, tolerance, leave_saddle=how.leave_saddle, strict=strict)
    if closure is not None and closure.ruling == "free" and closure.sign < 0:
        pinned = replace(request, closure=replace(closure, ruling="straight"))
    problem = assembled(pinned)
    if problem.strip.gamma > HEAVY and not problem.row_count and pinned.formulation == "auto":
        pinned = replace(pinned, formulation="mixed")
        problem = assembled(pinned)
    first = _first(pinned, problem, seed, how)
    state = refine_to_tolerance(first, tolerance, leave_saddle=how.leave_saddle, strict=strict)
    if pinned.closure is not closure and state.status in _GOOD:
        loose = assembled(replace(pinned, closure=closure, lengths=segment_lengths(_opened(state.problem.lengths))))
        slid = switch(loose, state)
        state = replace(slid, tolerance_error=state.tolerance_error, refinements=state.refinements)
    state = replace(state, branch=first.branch, left=state.left or first.left)
    if first.left is not None and state.left is first.left and state.ok:
        state = replace(state, message=f"{state.message}; {first.left}")
    if first.minima is not None and state.status in _GOOD:
        told = f"; {first.minima}" if len(first.minima.energies) > 1 else ""
        state = replace(state, minima=first.minima, message=state.message + told)
    return state


def _first(request: Request, problem: Problem, seed: Seed, how: How) -> Equilibrium:
    """The state on the first segments; beside walls and bodies that these are too coarse to pass, on their halves."""
    lengths = segment_lengths(seeds.graded(problem))
    first = solve_request(replace(request, lengths=lengths), seed, how)
    for _ in range(HALVED if problem.walls else 0):
        if first.status in _GOOD or spent():
            break
        lengths = np.repeat(lengths / 2.0, 2)
        finer = solve_request(replace(request, lengths=lengths), seed, how)
        first = finer if finer.status in _GOOD else first
    return first


def _evenly(closure: Closure | None) -> bool:
    """Whether a band keeps equal segments, all halved at once: of several folds, of which each has to have the same.

    One of three half turns is a minimum, which is found on any segments.
    """
    return closure is not None and closure.folded and closure.half_turns != 3


def _opened(lengths: FloatArray) -> FloatArray:
    """Lengths of segments about a seam that is let go, from those (p,) about a seam that is held.

    It slides until the ruling is straight in the first segment's middle (`ribbon.problems.held.Held.slides`), about
    which the band is its own mirror image; so are the segments: joints are those and their images, with one segment
    more in front. Otherwise they push along the band, and what keeps it from sliding carries a force.
    """
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    both = np.sort(np.concatenate([ends, ends[-1] - ends]))
    mirrored = np.diff(both)
    mirrored = mirrored[mirrored > _SAME]
    opened = np.concatenate([mirrored[:1], mirrored])
    opened[1:] = 0.5 * (opened[1:] + opened[:0:-1])
    return np.asarray(opened / opened.sum())


def refine_to_tolerance(
    equilibrium: Equilibrium,
    tolerance: float,
    *,
    leave_saddle: bool = False,
    strict: bool = True,
    report: Callable[[int, float], None] | None = None,
) -> Equilibrium:
    """The same scene on segments placed for `tolerance`, started from `equilibrium`; report(segments, estimate).

    strict: a tolerance that is not reached is "not converged"; otherwise the finest equilibrium that was found is the
    answer as it is, its estimate beside it (None where there is none).
    """
    if is_stretched(equilibrium.problem):  # straight on any segments
        return replace(equilibrium, tolerance_error=0.0)
    current = equilibrium
    finest: Equilibrium | None = None
    estimate: float | None = None
    tried = [_tried(current, None)]

    def ended(state: Equilibrium) -> Equilibrium:
        return replace(state, tolerance_error=estimate, refinements=tuple(tried))

    def short(state: Equilibrium, note: Note, **numbers: object) -> Equilibrium:
        """What to answer where the tolerance is not reached."""
        message = note.text(tolerance=tolerance, **numbers)
        if strict or finest is None:
            missed = replace(state, status=Status.NOT_CONVERGED, stable=None, message=message, notes=(note,))
            return ended(missed)
        return ended(replace(finest, message=f"{finest.message}; {message}", notes=(*finest.notes, note)))

    for _ in range(ROUNDS):
        if current.status not in _GOOD:
            return ended(current if strict or finest is None else finest)
        if spent():
            return short(current, Note.TOLERANCE_MISSED, why=SPENT)
        problem = current.problem
        halved = _moved_to(current, np.repeat(problem.lengths / 2.0, 2))
        if halved.status not in _GOOD:
            tried.append(_tried(halved, None))
            return ended(halved if strict else finest or current)
        moved = distance(current, halved)
        tried.append(_tried(halved, moved, current))
        finest, estimate = halved, moved
        if report is not None:
            report(halved.problem.lengths.size, moved)
        if moved <= tolerance:
            if leave_saddle and halved.status is Status.SADDLE:
                halved = switch(problem.with_changes(lengths=halved.problem.lengths), halved, leave_saddle=True)
                tried.append(_tried(halved, None))
            return ended(halved)
        even = _evenly(problem.closure)
        lengths = halved.problem.lengths if even else cut(problem.lengths, indicators(current, halved))
        most = MOST_SEGMENTS if strict else MOST_WISHED
        if lengths.size * (2 if even else 1) > most:
            return short(halved, Note.TOLERANCE_SEGMENTS, most=most, reached=estimate)
        current = halved if even else _moved_to(halved, lengths, check=False)
    return short(current, Note.TOLERANCE_ROUNDS, rounds=ROUNDS, reached=estimate)


def _moved_to(state: Equilibrium, lengths: FloatArray, check: bool = True) -> Equilibrium:
    """The scene on other segments, from its state on those before."""
    if state.problem.row_count and not _evenly(state.problem.closure) and not _lies(state.problem, state.x):
        return switch(state.problem.with_changes(lengths=lengths), state, check=check)
    return on_segments(state, lengths, check=check)


def _lies(problem: Problem, x: FloatArray) -> bool:
    """Whether layers lie on each other in a plane, where they are found again from their curvatures."""
    if not isinstance(problem, MixedProblem) or not problem.pairs:
        return False
    from ribbon.find.layers import plane

    return plane.is_layered(problem, x)


def _tried(state: Equilibrium, moved: float | None, coarse: Equilibrium | None = None) -> Refinement:
    """coarse: the state on segments twice as long that it was begun at, None: none."""
    before = None if coarse is None else coarse.numbers
    segments = state.problem.lengths.size
    return Refinement(segments, state.status, state.lowest_eigenvalue, moved, state.numbers, before)


def indicators(coarse: Equilibrium, fine: Equilibrium) -> FloatArray:
    """e_i (p,) of the coarse segments: how much the difference of the two solutions turns the ribbon on each (rad)."""
    old, new = coarse.problem, fine.problem
    omega, eta = old.joint_values(coarse.x)
    omega_fine, eta_fine = new.joint_values(fine.x)
    s = np.concatenate([[0.0], np.cumsum(old.lengths)])
    s_fine = np.concatenate([[0.0], np.cumsum(new.lengths)])
    omega_there, eta_there = np.interp(s_fine, s, omega), np.interp(s_fine, s, eta)
    bend = np.abs(omega_fine - omega_there)
    twisted = (eta_fine, eta_there) if new.fields.free else (omega_fine * eta_fine, omega_there * eta_there)
    twist = np.abs(twisted[0] - twisted[1])
    local = 0.5 * new.lengths * ((bend + twist)[1:] + (bend + twist)[:-1])
    return np.asarray(local.reshape(-1, 2).sum(axis=1))


def cut(lengths: FloatArray, error: FloatArray) -> FloatArray:
    """The lengths (p,), the segments that carry BULK of the error (p,) halved or, where it is large, quartered."""
    order = np.argsort(error)[::-1]
    share = np.cumsum(error[order]) / max(float(error.sum()), 1e-300)
    marked = order[: int(np.searchsorted(share, BULK)) + 1]
    threshold = error[marked].min()
    parts = np.ones(lengths.size, dtype=int)
    parts[marked] = np.where(error[marked] > QUARTERED * threshold, 4, 2)
    return np.repeat(lengths / parts, parts)


def distance(one: Equilibrium, other: Equilibrium) -> float:
    """Hausdorff distance / l between the centrelines and edges of two shapes: points to polylines, both ways."""
    s = np.unique(
        np.concatenate([np.linspace(0.0, 1.0, _ALONG + 1), *(np.cumsum(e.problem.lengths)[:-1] for e in (one, other))])
    )
    lines = [_lines(one, s), _lines(other, s)]
    if sum(len(free) for free in one.problem.free_motions()) == 6:
        lines[0] = _moved_onto(lines[0], lines[1])
    found = 0.0
    for a, b in zip(lines[0], lines[1], strict=True):
        found = polyline.farthest(b, a, polyline.farthest(a, b, found))
    return found


def _lines(state: Equilibrium, s: FloatArray) -> list[FloatArray]:
    """Centreline and both edges (k, 3) at abscissae s (k,), the edges as the ends of the rulings."""
    r, frame, _, eta = state.continued(s)
    if state.has_free_twist:  # sections are square to the centreline
        eta = np.zeros_like(eta)
    ruling = frame[:, :, 0] + eta[:, None] * frame[:, :, 2]
    half = state.problem.half_width
    return [r, r + half * ruling, r - half * ruling]


def _moved_onto(lines: list[FloatArray], target: list[FloatArray]) -> list[FloatArray]:
    """The lines moved rigidly so that their first fits the target's, point by point (least squares, W. Kabsch 1976)."""
    a, b = lines[0], target[0]
    u, _, v = np.linalg.svd((a - a.mean(axis=0)).T @ (b - b.mean(axis=0)))
    rotation = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ v))]) @ v
    return [(line - a.mean(axis=0)) @ rotation + b.mean(axis=0) for line in lines]
