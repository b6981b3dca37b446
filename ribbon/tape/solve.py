"""A tape through a row of stages: from rest to the first holds, from those to the next, with all that happens.

Where a stage's way only turns back in load (a snap), it is followed; where it branches, the tape jumps at that load
from its last stable state to another stable one (`LoadPath.jump`), pushed flat a little in the middle, and goes on.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from ribbon.solvers.budget import SPENT, spent, within
from ribbon.tape.held import Hold
from ribbon.tape.path import LoadPath, Point, Steps, begun, standing
from ribbon.tape.rod import Rod
from ribbon.tape.section import FloatArray, Section

PUSH, PUSH_LENGTH = 0.05, 0.03
"""By which part of its curvature, and over which length (l), the middle is pushed flat before a jump."""

JUMPS, SURE, BACKWARDS = 12, 3, -0.5
"""Jumps of a stage, at most; points in a row behind a branching until one is sure of it; the load at which the way is
lost."""

RAISED = (0.0, 0.001, 0.002, 0.004, 0.008)
"""What the load is raised by, until a state that has branched is left."""


class Status(Enum):
    """How a solve ended."""

    CONVERGED = "converged"
    UNSTABLE = "unstable"
    NOT_CONVERGED = "not_converged"


@dataclass(frozen=True)
class Mark:
    """A point of the way: stage (from 0) and its share; fold: s where the section is flattest, with its kappa^0; forces
    (x, y; `force` at the end) and moments at both ends (D w / l^2, D w / l), angles (rad), the end's point (l);
    iterations of Newton's method."""

    stage: int
    share: float
    stable: bool
    negative: int
    jumped: bool
    angles: tuple[float, float]
    end: tuple[float, float]
    start_force: tuple[float, float]
    force: tuple[float, float]
    moments: tuple[float, float]
    fold: float
    flattest: float
    iterations: int
    x: FloatArray


@dataclass(frozen=True)
class Tape:
    """A solved tape: its rod, unknowns x (size,), the marks of its way, status and what it says; residual as of
    `Point`, iterations of Newton's method in all."""

    rod: Rod
    x: FloatArray
    marks: tuple[Mark, ...]
    status: Status
    negative: int
    message: str
    residual: float
    iterations: int

    @property
    def ok(self) -> bool:
        """A stable equilibrium at the last stage."""
        return self.status is Status.CONVERGED


def solve(
    section: Section,
    stages: Sequence[tuple[Hold, Hold]],
    lengths: FloatArray,
    steps: Steps | None = None,
    told: Callable[[Mark], object] | None = None,
    dent: float = 0.0,
    budget: float | None = None,
) -> Tape:
    """From rest, its start where the first stage holds it, through all stages (start, end), which hold the same things.

    lengths: (elements,) of a tape of length 1; told: of every point; dent: of `Rod`; budget: time of each stage (s).
    Raises ValueError for stages that hold different things.
    """
    first = stages[0]
    if not all(one.alike(first[0]) and other.alike(first[1]) for one, other in stages):
        raise ValueError("the stages hold different things")
    rod = Rod(section, lengths, *first, dent=dent)
    x, marks, iterations, residual, negative = begun(rod), [], 0, 0.0, 0

    def note(stage: int, way: LoadPath, point: Point) -> None:
        mark = marked(way.rod, stage, point)
        marks.append(mark)
        if told is not None:
            told(mark)

    for stage, (start, end) in enumerate(stages):
        before = standing(rod, x)
        rod = replace(rod, start=start, end=end)
        way = LoadPath(rod, before, np.concatenate([start.targets, end.targets]))
        with within(budget):
            point = way.settled(x, 0.0)
            if point is None:
                return Tape(rod, x, tuple(marks), Status.NOT_CONVERGED, 0, _NOWHERE, np.inf, iterations)
            if np.abs(way.finish - way.begin).max(initial=0.0) < 1e-13:
                point = replace(point, load=1.0)
                note(stage, way, point)
            else:
                for at in _gone(way, point, steps):
                    point = at
                    iterations += at.iterations
                    note(stage, way, at)
            late = f": {SPENT}" if spent() else ""
        x, residual, negative = point.x, point.residual, point.negative
        if point.load < 1.0:
            message = f"the way ends at {point.load:.3g} of stage {stage + 1} of {len(stages)}{late}"
            return Tape(rod, x, tuple(marks), Status.NOT_CONVERGED, negative, message, residual, iterations)
    status = Status.UNSTABLE if negative else Status.CONVERGED
    jumps = sum(mark.jumped for mark in marks)
    message = f"unstable in {negative} directions" if negative else "a stable equilibrium"
    message += f", after {jumps} jumps" if jumps > 1 else ", after a jump" if jumps else ""
    return Tape(rod, x, tuple(marks), status, negative, message, residual, iterations)


_NOWHERE = "no equilibrium at the beginning of a stage"


def _gone(way: LoadPath, point: Point, steps: Steps | None) -> list[Point]:
    """The points of a stage, jumps among them."""
    found: list[Point] = []
    rod = way.rod
    push = -PUSH * rod.section.curvature * np.exp(-(((rod.s - 0.5) / PUSH_LENGTH) ** 2))
    follow = False  # where no jump settles, the way itself is followed
    for _ in range(JUMPS + 1):
        branched = 0
        for ahead in way.walk(point, steps):
            found.append(ahead)
            branched = branched + 1 if ahead.branched else 0
            if (branched == SURE and not follow) or ahead.load < BACKWARDS:
                break
        if branched < SURE or follow or spent():
            return found
        last = next((one for one in reversed(found) if one.stable), point)
        load = min(max([last.load, *(one.load for one in found[-SURE:])]), 1.0)
        del found[found.index(last) + 1 if last in found else 0 :]
        here = _beyond(way, last, load, push)
        if here is None:
            follow, point = True, last
            continue
        found.append(here)
        if here.load >= 1.0:
            return found
        point = here
    return found


def _beyond(way: LoadPath, last: Point, load: float, push: FloatArray) -> Point | None:
    """Where the tape is once `load`, where a branching was passed, is exceeded: it is raised until the state of `last`
    is unstable or gone, and the tape jumps from it. None: it does not settle."""
    for more in RAISED:
        raised = min(load + more, 1.0)
        here = way.settled(last.x, raised)
        if here is None or not here.stable:
            return way.jump(here or replace(last, load=raised), push)
        last = here
    return last


def marked(rod: Rod, stage: int, point: Point) -> Mark:
    """What is told of a point."""
    nodes = rod.nodes(point.x)
    size = nodes[:, 4] * np.sign(rod.section.curvature or 1.0)
    flat = int(np.argmin(size))
    forces, moments = [], []
    for hold, places in zip((rod.start, rod.end), rod.multipliers, strict=True):
        mu = point.x[places]
        k = len(hold.directions)
        along = mu[:k] @ hold.directions
        forces.append((float(along[0]), float(along[1])))
        moments.append(float(mu[k]) if hold.angle is not None else 0.0)
    angles = np.arctan2(nodes[[0, -1], 3], nodes[[0, -1], 1])
    turns = [hold.angle if hold.angle is not None else a for hold, a in zip((rod.start, rod.end), angles, strict=True)]
    turns = [a + 2.0 * np.pi * round((t - a) / (2.0 * np.pi)) for a, t in zip(angles, turns, strict=True)]
    z = float(rod.middle @ nodes[-1, 4::2])
    end = nodes[-1, 0] + z * np.sin(angles[1]), nodes[-1, 2] - z * np.cos(angles[1])
    return Mark(
        stage, point.load, point.stable, point.negative, point.jumped, (float(turns[0]), float(turns[1])),
        (float(end[0]), float(end[1])), forces[0], forces[1], (moments[0], moments[1]), float(rod.s[flat]),
        float(nodes[flat, 4]), point.iterations, point.x,
    )  # fmt: skip


def refined(tape: Tape) -> Tape | None:
    """The same state on elements half as long, begun at it, its last mark alone; None: none is found there."""
    rod = tape.rod
    finer = replace(rod, lengths=np.repeat(0.5 * rod.lengths, 2))
    fields = rod.at(tape.x, finer.s)[:, :, :2]
    x = np.zeros(finer.size)
    x[finer.column[:, None] + np.arange(finer.fields)] = fields.reshape(len(finer.s), -1)
    for places, own in zip(finer.multipliers, rod.multipliers, strict=True):
        x[places] = tape.x[own]
    targets = np.concatenate([finer.start.targets, finer.end.targets])
    point = LoadPath(finer, targets, targets).settled(x, 1.0)
    if point is None:
        return None
    status = Status.UNSTABLE if point.negative else Status.CONVERGED
    marks = (marked(finer, tape.marks[-1].stage, point),) if tape.marks else ()
    return Tape(finer, point.x, marks, status, point.negative, tape.message, point.residual, point.iterations)
