"""Which cases of a sweep lie on one branch: states that go over into each other from neighbour to neighbour.

A strip that is held at both ends may rest in several ways. Along an axis its state moves by little from case to case,
and by much where a case has ended on another branch. Two neighbours are on one branch where their centrelines (at its
quarters and ends, in l) are nearer than LEAST, or than JUMP times the lower quartile of the pairs around them on their
line; cases that are not next to each other (up to AROUND between them), where they are as near as that. What is joined
so, by whatever way through the grid, is one branch (connected components). The branches are numbered by how many cases
they have, from 1. Where more than MOST of the pairs are jumps the grid is too coarse to tell.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from compare.sweep.finished import Finished

#: Distance (l) that is no jump, and over that of the pairs around; how many of them on either side; share of the pairs.
LEAST, JUMP, AROUND, MOST = 0.05, 8.0, 3, 0.35

Row = Mapping[str, Any]


def branches(finished: Finished) -> list[list[int | None]]:
    """The branch of every row of every case, from 1; None: it is no stable state, has no neighbours, or the grid is too
    coarse to tell."""
    cases = finished.cases
    if finished.part:
        return [[None] * len(case.record["rows"]) for case in cases]
    shape = [len(axis.values) for axis in finished.sweep.axes]
    found: list[list[int | None]] = [[None] * len(case.record["rows"]) for case in cases]
    ratios = dict.fromkeys(row.get("width_to_thickness") for case in cases for row in case.record["rows"])
    for ratio in ratios:
        at = {
            (number, k): points
            for number, case in enumerate(cases)
            for k, row in enumerate(case.record["rows"])
            if row.get("width_to_thickness") == ratio and (points := _points(row)) is not None
        }
        places = {number: (k, points) for (number, k), points in at.items()}
        for number, branch in _numbered(shape, {number: points for number, (_, points) in places.items()}).items():
            found[number][places[number][0]] = branch
    return found


def others(finished: Finished) -> list[tuple[int, int]]:
    """Number and branch of the cases that lie on another branch than most."""
    found = zip(finished.cases, branches(finished), strict=True)
    return [(case.point.number, max(b for b in one if b)) for case, one in found if any(b and b > 1 for b in one)]


def _points(row: Row) -> list[float] | None:
    """The coordinates (12,) at the quarters, the middle and the end of the centreline, in l; None without a state."""
    quarters = row.get("quarters")
    if row["status"] != "converged" or row.get("stable") is False or quarters is None:
        return None
    ends = [row.get(f"{place}.{axis}") for place in ("middle", "end") for axis in "xyz"]
    found = [*itertools.chain.from_iterable(quarters), *ends]
    return None if None in found else [float(value) for value in found]


def _numbered(shape: Sequence[int], points: Mapping[int, list[float]]) -> dict[int, int]:
    """The branch of each case that has points and a neighbour with points."""
    joined: list[tuple[int, int]] = []
    apart: list[tuple[int, int]] = []
    for line in _lines(shape):
        known = [number for number in line if number in points]  # what failed between two is stepped over
        pairs = [(a, b, _distance(points[a], points[b])) for a, b in itertools.pairwise(known)]
        for k, (a, b, far) in enumerate(pairs):
            around = sorted(pair[2] for pair in pairs[max(0, k - AROUND) : k] + pairs[k + 1 : k + 1 + AROUND])
            most = max(LEAST, JUMP * around[len(around) // 4]) if around else math.inf
            (joined if far <= most else apart).append((a, b))
            if far > most:  # cases beside it on another branch do not divide this one
                beyond = known[k + 2 : k + 2 + AROUND]
                joined += [(a, c) for c in beyond if _distance(points[a], points[c]) <= most]
    if len(apart) > MOST * (len(joined) + len(apart)):
        return {}
    parent = {number: number for pair in (*joined, *apart) for number in pair}

    def root(number: int) -> int:
        while parent[number] != number:
            parent[number] = number = parent[parent[number]]
        return number

    for a, b in joined:
        low, high = sorted((root(a), root(b)))
        parent[high] = low
    members: dict[int, list[int]] = {}
    for number in sorted(parent):
        members.setdefault(root(number), []).append(number)
    ranked = sorted(members.values(), key=lambda group: (-len(group), group[0]))
    return {number: rank for rank, group in enumerate(ranked, start=1) for number in group}


def _lines(shape: Sequence[int]) -> Iterator[list[int]]:
    """The numbers of the cases on every line of the grid along every axis, the last axis fastest."""
    for axis, count in enumerate(shape):
        step = math.prod(shape[axis + 1 :])
        for first in range(math.prod(shape)):
            if first // step % count == 0:
                yield [first + k * step for k in range(count)]


def _distance(one: Sequence[float], other: Sequence[float]) -> float:
    """The largest distance of points (x, y, z one after another)."""
    return max(math.dist(one[k : k + 3], other[k : k + 3]) for k in range(0, len(one), 3))
