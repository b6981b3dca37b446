"""Cases of a sweep that ended beside their neighbours are begun again at a neighbour's state.

Two kinds are: a case on another branch than most (`compare.sweep.branches`), and one that is no stable state next to
one that is. The scene goes a `[[path]]` of one stage, the neighbour's values of the varied keys, from which the
continuation walks to its own (natural continuation: Allgower and Georg, Numerical Continuation Methods, 1990, chapter
2). What it finds stands for the case where it is a stable state on the branch of most; where the scene has no seed,
which would say what is meant, only where its energy is not above that of the state before.

Rounds go outward from the branch of most: a case is begun at a case next to it in the grid, or, where that has been
begun again itself, at the case where that was. A case is walked to TRIES times at most: where a branch ends (a fold),
only the cases at its edge are walked to. All of it follows from the table, whatever the order in which cases end.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from compare.models import model
from compare.scene.keys import FIXED_ON_PATH
from compare.scene.scene import Scene
from compare.studies.axes import Point
from compare.sweep.branches import branches
from compare.sweep.case import COMPARE, Record
from compare.sweep.file import Sweep
from compare.sweep.finished import Case, Finished
from ribbonbench.errors import BadInput

#: Walks to one case at most; by how much of itself an energy may lie above another that counts as the same.
TRIES, SAME = 2, 1e-9


@dataclass(frozen=True)
class Walk:
    """A case to be begun again: its number, that of the case whose state is its beginning, and the scene with the path
    from there."""

    number: int
    start: int
    scene: Scene


#: Solves scenes: (record, whether it was found among the finished ones) of each walk, in their order.
Solve = Callable[[Sequence[Walk]], list[tuple[Record, bool]]]


def mended(found: Finished, solve: Solve) -> Finished:
    """The sweep with its cases on their neighbours' branch where they could be brought there; `warm` says from where.

    found: every case solved from its own start. Nothing is solved where no case stands out.
    """
    if not _walks_at_all(found.sweep):
        return found
    tried: set[tuple[int, int]] = set()
    while True:
        walks = list(_walks(found, tried))
        if not walks:
            return found
        tried |= {(walk.number, walk.start) for walk in walks}
        found = replace(_accepted(found, walks, solve(walks)), walks=found.walks + len(walks))


def _walks_at_all(sweep: Sweep) -> bool:
    """Whether the sweep's model goes paths and the scene has none of its own, which would say the way."""
    return not sweep.scene.path and (sweep.solver == COMPARE or "path" in model(sweep.solver).reads)


def _walks(found: Finished, tried: set[tuple[int, int]]) -> Iterator[Walk]:
    """The cases that stand out, each with a neighbour that does not and from which it was not walked to."""
    labels = branches(found)
    for case, branch in zip(found.cases, labels, strict=True):
        number = case.point.number
        if not case.record["rows"] or (case.ok and not _aside(branch)):
            continue
        if found.sweep.leave_saddle is False and any(row.get("stable") is False for row in case.record["rows"]):
            continue  # a saddle that is asked for
        if sum(number == known for known, _ in tried) >= TRIES:
            continue
        for beside in _neighbours([len(axis.values) for axis in found.sweep.axes], number):
            other = found.cases[beside]
            if not other.ok or _aside(labels[beside]):
                continue
            start = beside if other.warm is None else other.warm
            scene = None if (number, start) in tried else _led(case.point, found.cases[start].point)
            if scene is not None:
                yield Walk(number, start, scene)
                break


def _aside(branch: Sequence[int | None]) -> bool:
    return any(one is not None and one > 1 for one in branch)


def _neighbours(shape: Sequence[int], number: int) -> Iterator[int]:
    """The numbers of the cases next to one in the grid, the last axis (fastest) first, smaller numbers first."""
    for axis in reversed(range(len(shape))):
        step = math.prod(shape[axis + 1 :])
        place = number // step % shape[axis]
        if place > 0:
            yield number - step
        if place + 1 < shape[axis]:
            yield number + step


def _led(point: Point, start: Point) -> Scene | None:
    """The scene of a point with a path that begins at another's; None where there is none: their seeds differ (each
    says which state is meant), or nothing that a path can change does."""
    changed = {key: value for key, value in start.values.items() if value != point.values[key]}
    parts = {key.partition(".")[0] for key in changed}
    stage = {key: value for key, value in changed.items() if key.partition(".")[0] not in FIXED_ON_PATH}
    if "seed" in parts or not stage:
        return None
    try:
        return point.scene.replace({"path": [stage]})
    except BadInput:
        return None


def _accepted(found: Finished, walks: Sequence[Walk], solved: Sequence[tuple[Record, bool]]) -> Finished:
    """The sweep with the walks' states that stand for their cases."""
    cases = list(found.cases)
    for walk, (record, reused) in zip(walks, solved, strict=True):
        case = cases[walk.number]
        if _better(case, walked := replace(case, record=_spent(case.record, record), warm=walk.start)):
            cases[walk.number] = replace(walked, reused=case.reused and reused)
    tried = replace(found, cases=tuple(cases))
    for walk, branch in ((walk, branches(tried)[walk.number]) for walk in walks):
        if cases[walk.number].warm is not None and _aside(branch):
            cases[walk.number] = found.cases[walk.number]
    return replace(found, cases=tuple(cases))


def _better(case: Case, walked: Case) -> bool:
    """Whether what was walked to may stand for a case: a stable state, and not above it where no seed says which."""
    if not walked.ok:
        return False
    if not case.ok or "seed.curvature" in case.point.scene.own_keys:
        return True
    own, new = (_energy(one.record["rows"]) for one in (case, walked))
    return own is None or new is None or new <= own + SAME * max(1.0, abs(own))


def _energy(rows: Sequence[Mapping[str, Any]]) -> float | None:
    """The energies of a case together; None where one is not known."""
    found = [row.get("energy.total") for row in rows]
    known = [float(value) for value in found if value is not None]
    return math.fsum(known) if len(known) == len(found) else None


def _spent(before: Record, walked: Record) -> Record:
    """The walk's record, with the time of both solves."""
    both = [record["seconds"] for record in (before, walked) if record["seconds"] is not None]
    return {**walked, "seconds": sum(both) if both else None}
