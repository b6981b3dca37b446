"""Points of a branch as a diagram holds them, with what their numbers still change on elements halved twice."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compare.continuation.finer import continued, is_level, refined, relocated
from compare.continuation.pinned import Pinned
from compare.continuation.point import Kind, Options, Point, Special
from compare.measure.mesh_limit import Settled, settled
from compare.models.capabilities import BranchStart
from compare.studies.branches.along import Along
from compare.studies.branches.aside import Passed
from compare.studies.branches.bars import Bars, Numbers, bars
from compare.studies.branches.diagram import BranchPoint

#: Points of a kept centreline.
LINE = 101
#: Meshes on which a point is found: as asked, and so many times halved.
HALVINGS = 2
#: Regular points of a branch that are walked to on one mesh, at the most: the others do not settle.
WALKS = 60
#: To what a special point is located on its mesh, in t.
LOCATED = 1e-9


@dataclass(frozen=True)
class Measured:
    """start, along, options: of the branch; regular, special: whether such points are found on finer elements; spent:
    whether the time is; say: told what is done."""

    start: BranchStart
    along: Along
    options: Options
    regular: bool
    special: bool
    spent: Callable[[], bool]
    say: Callable[[str], None]

    def plain(self, point: Point, kind: Kind = "regular") -> BranchPoint:
        """A point without errors."""
        shape = self.start.shape(point)
        s = np.linspace(0.0, 1.0, LINE)
        line = shape.centreline(s)
        return BranchPoint(
            parameter=self.along.value(point.t), kind=kind, unstable=point.unstable,
            energy=point.system.energy(point.z, point.t), arc=point.arc, end=line[-1], middle=line[LINE // 2],
            residual=point.norm, t=point.t, centreline=line, shape=shape, force=self.start.force(point, shape),
        )  # fmt: skip

    def put_again(self, points: Sequence[Point], image: bool) -> list[BranchPoint]:
        """Regular points of a branch, in order, with their errors, but on an image."""
        made = [self.plain(point) for point in points]
        if not self.regular or image:
            return made
        self.say(f"{len(points)} points on finer elements")
        chain: list[list[Point | None]] = [[*points]]
        for _ in range(HALVINGS):
            chain.append(self._finer(points, chain[-1]))
        return [
            here if self.spent() and None in again else replace(here, bars=self._bars(here, again, is_level(point)))
            for here, point, *again in zip(made, points, *chain[1:], strict=True)
        ]

    def _finer(self, points: Sequence[Point], coarse: Sequence[Point | None]) -> list[Point | None]:
        """On elements half as long as those of `coarse`: from there, else from the one before; points: the branch's."""
        found: list[Point | None] = []
        walks = 0
        for k, (point, here) in enumerate(zip(points, coarse, strict=True)):
            level = is_level(point)
            finer = None if here is None or self.spent() else refined(here, level, self.options)
            before = found[k - 1] if k and level and is_level(points[k - 1]) and walks < WALKS else None
            if finer is None and before is not None and not self.spent():
                walks += 1
                finer = continued(before, point.t, self.options)
            found.append(finer)
        return found

    def located(self, special: Special, image: bool) -> BranchPoint:
        """A fold, branch point or event with its errors, but on an image."""
        made = self.plain(special.point, special.kind)
        chain: list[Special] = [special]
        if self.special and not image:
            self.say(f"{special.kind.replace('_', ' ')} at {made.parameter:.6g} on finer elements")
            for _ in range(HALVINGS):
                finer = None if self.spent() else relocated(chain[-1], self.options)
                if finer is None:
                    break
                chain.append(finer)
        if not self.special or image:
            return replace(made, meshes=(made.parameter,), critical=special.values, what=special.what)
        values = [one.point.t for one in chain] + [float("nan")] * (HALVINGS + 1 - len(chain))
        return replace(
            made, settled=self._settled(values), meshes=tuple(self.along.value(t) for t in values),
            critical=special.values, what=special.what, bars=self._bars(made, [x.point for x in chain[1:]], False),
        )  # fmt: skip

    def aside(self, passed: Passed, finer: bool) -> BranchPoint:
        """Where a mode aside of the plane changes its stability; finer: with its errors."""
        made = replace(self.plain(passed.point, "event"), what=passed.what, aside=passed.change)
        if not finer:
            return replace(made, meshes=(made.parameter,))
        values = [passed.point.t, *(math.nan if one is None else one.t for one in passed.finer)]
        return replace(
            made, settled=self._settled(values), meshes=tuple(self.along.value(t) for t in values),
            bars=self._bars(made, passed.finer, False),
        )  # fmt: skip

    def _bars(self, made: BranchPoint, finer: Sequence[Point | None], level: bool) -> Bars:
        known = [None if one is None else _numbers(self.plain(one)) for one in finer]
        return bars([_numbers(made), *known], level)

    def _settled(self, values: Sequence[float]) -> Settled:
        return settled([self.along.value(t) for t in values], LOCATED * abs(self.along.last - self.along.first))


def _numbers(point: BranchPoint) -> Numbers:
    return Numbers(point.parameter, point.energy, point.centreline, point.force)


def unpinned(start: BranchStart) -> BranchStart:
    """What a model says of points, of those on one of a circle of branches too (`compare.continuation.pinned`)."""

    def own(point: Point) -> Point:
        return replace(point, system=point.system.own) if isinstance(point.system, Pinned) else point

    return replace(
        start, shape=lambda point: start.shape(own(point)), freed=lambda point: start.freed(own(point)),
        force=lambda point, shape: start.force(own(point), shape),
    )  # fmt: skip
