"""Segments placed by an error estimate, so that a user asks for a tolerance instead of a number of segments.

Every round solves on the segments and on their halves. The distance d between the two surfaces estimates the error of
the halved ones: it is at most d when halving all segments at least halves the error (measured orders are 1 at a
Wunderlich event that is not resolved and 2 to 4 elsewhere). Where d is too large, the segments that turn the ribbon
most by their error are cut: ``e_i = int |d omega| + |d (omega eta)| ds`` over segment i, d being the difference of the
two solutions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import scipy  # its parts are loaded where they are first used
from numpy.typing import NDArray

from ribbon.boundary import Closure
from ribbon.errors import RibbonInputError
from ribbon.find import seeds
from ribbon.find.continuation import switch
from ribbon.find.solve import build, on_segments, solve
from ribbon.find.stretched import is_stretched
from ribbon.result import Equilibrium, Refinement, Status
from ribbon.solvers.budget import SPENT, spent, within

FloatArray = NDArray[np.float64]

#: Segments of the first round, most of the last one (halved once more), if a tolerance is a wish only, most rounds.
FIRST_SEGMENTS = 24
MOST_SEGMENTS = 6000
MOST_WISHED = 200
ROUNDS = 30
#: Gamma beyond which the chained unknowns, in which the weight of all that follows a segment is one sum, are not known
#: to the residual that is asked for: 1e-14 Gamma was seen (`compare.battery`, size/weight).
HEAVY = 1e5
#: Share of the sum of e_i that the cut segments carry; a segment this many times above the threshold is quartered.
BULK = 0.8
QUARTERED = 16.0
#: Keywords of `ribbon.find.solve.build` among those of `solve`, without the segments.
_OF_THE_PROBLEM = (
    "strip", "clamp", "gravity", "end", "closure", "walls", "energy", "formulation", "held_by", "stiffness", "in_plane",
    "tip",
)  # fmt: skip
_GOOD = (Status.CONVERGED, Status.SADDLE)
#: Distance of joints (l) that are one but for rounding.
_SAME = 1e-12
#: Points along the ribbon for the distance.
_ALONG = 2000


def solve_to_tolerance(*arguments: Any, tolerance: float, strict: bool = True, **keywords: Any) -> Equilibrium:
    """As `ribbon.solve` (without `segments`), on segments placed so that the surface's error is below `tolerance` * l.

    tolerance: Hausdorff distance over l to the limit of many segments, in (0, 0.1). The estimate is the result's
    `tolerance_error`. strict: see `refine_to_tolerance`. Raises `RibbonInputError` on bad input.
    """
    if not 0.0 < tolerance < 0.1:
        raise RibbonInputError("tolerance", tolerance, "a distance over l in (0, 0.1)")
    if "segments" in keywords:
        raise RibbonInputError("segments", keywords["segments"], "give a tolerance or segments, not both")
    with within(keywords.pop("budget", None)):
        return _to_tolerance(arguments, tolerance, strict, keywords)


def _to_tolerance(
    arguments: tuple[Any, ...], tolerance: float, strict: bool, keywords: Mapping[str, Any]
) -> Equilibrium:
    """The seam of a Moebius band whose ruling is free is held until the elements are placed."""
    closure = keywords.get("closure")
    pinned: Mapping[str, Any]
    pinned, free_seam = keywords, False
    if closure is not None and closure.ruling == "free" and closure.sign < 0:
        pinned, free_seam = {**keywords, "closure": Closure(closure.kind, "straight", closure.turns)}, True
    asked = {key: pinned[key] for key in _OF_THE_PROBLEM if key in pinned}
    begun = build(*arguments, segments=FIRST_SEGMENTS, **asked)
    if begun.strip.gamma > HEAVY and not begun.row_count and pinned.get("formulation", "auto") == "auto":
        pinned, asked = ({**keys, "formulation": "mixed"} for keys in (pinned, asked))
        begun = build(*arguments, segments=FIRST_SEGMENTS, **asked)
    segments = seeds.graded(begun)
    first = solve(*arguments, segments=segments, **pinned)
    leave = bool(keywords.get("leave_saddle", False))
    found = refine_to_tolerance(first, tolerance, leave_saddle=leave, strict=strict)
    if free_seam and found.status in _GOOD:
        loose = build(*arguments, segments=_opened(found.problem.lengths), **{**asked, "closure": closure})
        slid = switch(loose, found)
        found = replace(slid, tolerance_error=found.tolerance_error, refinements=found.refinements)
    found = replace(found, branch=first.branch, left=found.left or first.left)
    if first.left is not None and found.left is first.left and found.ok:
        found = replace(found, message=f"{found.message}; {first.left}")
    if first.minima is not None and found.status in _GOOD:
        found = replace(found, minima=first.minima, message=f"{found.message}; {first.minima}")
    return found


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

    def ended(found: Equilibrium, **changes: Any) -> Equilibrium:
        return replace(found, tolerance_error=estimate, refinements=tuple(tried), **changes)

    def short(found: Equilibrium, message: str) -> Equilibrium:
        """What to answer where the tolerance is not reached."""
        if strict or finest is None:
            return ended(found, status=Status.NOT_CONVERGED, stable=None, message=message)
        return ended(finest, message=f"{finest.message}; {message}")

    for _ in range(ROUNDS):
        if current.status not in _GOOD:
            return ended(current if strict or finest is None else finest)
        if spent():
            return short(current, f"the tolerance {tolerance:g} was not reached: {SPENT}")
        problem: Any = current.problem
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
        lengths = cut(problem.lengths, indicators(current, halved))
        most = MOST_SEGMENTS if strict else MOST_WISHED
        if lengths.size > most:
            needs = f"the tolerance {tolerance:g} needs more than {most} segments; reached {estimate:.2g}"
            return short(halved, needs)
        current = _moved_to(halved, lengths, check=False)
    return short(current, f"the tolerance {tolerance:g} was not reached in {ROUNDS} rounds; reached {estimate:.2g}")


def _moved_to(found: Equilibrium, lengths: FloatArray, **keywords: Any) -> Equilibrium:
    """The scene on other segments, beside what was found."""
    if found.problem.row_count:
        old: Any = found.problem
        return switch(old.with_changes(lengths=lengths), found, **keywords)
    return on_segments(found, lengths, **keywords)


def _tried(found: Equilibrium, moved: float | None, coarse: Equilibrium | None = None) -> Refinement:
    """coarse: the state on segments twice as long that it was begun at, None: none."""
    before = None if coarse is None else coarse.numbers
    segments = found.problem.lengths.size
    return Refinement(segments, found.status, found.lowest_eigenvalue, moved, found.numbers, before)


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
    return max(
        max(_to_polyline(a, b), _to_polyline(b, a)) for a, b in zip(lines[0], lines[1], strict=True)
    )  # fmt: skip


def _lines(found: Equilibrium, s: FloatArray) -> list[FloatArray]:
    """Centreline and both edges (k, 3) at abscissae s (k,), the edges as the ends of the rulings."""
    r, frame, eta = found.position(s), found.frame(s), found.eta(s)
    ruling = frame[:, :, 0] + eta[:, None] * frame[:, :, 2]
    half = found.problem.half_width
    return [r, r + half * ruling, r - half * ruling]


def _moved_onto(lines: list[FloatArray], target: list[FloatArray]) -> list[FloatArray]:
    """The lines moved rigidly so that their first fits the target's, point by point (least squares, W. Kabsch 1976)."""
    a, b = lines[0], target[0]
    u, _, v = np.linalg.svd((a - a.mean(axis=0)).T @ (b - b.mean(axis=0)))
    rotation = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ v))]) @ v
    return [(line - a.mean(axis=0)) @ rotation + b.mean(axis=0) for line in lines]


def _to_polyline(points: FloatArray, line: FloatArray) -> float:
    """Largest distance of `points` (k, 3) from the polyline `line` (m, 3), by the two pieces at the nearest vertex."""
    _, nearest = scipy.spatial.cKDTree(line).query(points)
    best = np.full(len(points), np.inf)
    for shift in (-1, 0):
        first = np.clip(nearest + shift, 0, len(line) - 2)
        a, d = line[first], line[first + 1] - line[first]
        t = np.clip(np.einsum("ij,ij->i", points - a, d) / np.maximum(np.einsum("ij,ij->i", d, d), 1e-300), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(points - a - t[:, None] * d, axis=1))
    return float(best.max())
