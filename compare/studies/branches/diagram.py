"""A bifurcation diagram as data: branches of several models, their points, errors of the special ones."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from compare.continuation.point import Kind
from compare.measure.mesh_limit import Settled
from compare.models.base import Shape, State
from compare.scene.scene import Scene
from compare.studies.branches.along import Along
from compare.studies.branches.bars import Bars
from compare.studies.branches.images import By

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class BranchPoint:
    """An equilibrium of a branch.

    parameter: value of the number, in its unit; error: of a special point's, by finer elements (None: regular, or it
    does not settle); meshes: its values on p, 2p, 4p elements; kind: "regular", "fold", "branch_point", "event", or
    "ruling" where the shape falls by other rulings of a straight part; unstable: number of unstable modes (of a fold or
    branch point that of its side with fewer; of an event: behind it; behind a "ruling": one at least);
    energy: total, D w / l, without the constant of the natural curvature; arc: arc length from the branch's first
    point; end, middle (3,): positions, l; residual: the norm of what is left; critical: eigenvalues that are zero
    there, as located; what: an event in words; force (3,): on the strip, of what holds s = l, D w / l^2 (None: nothing
    does, or the model does not say); bars: errors of all these numbers, None: not asked for; aside: how many
    of a regular point's unstable modes are aside of the plane that the unknowns keep the shape in (of an event where
    they change, by how many), None: there is no such plane, or they are not counted.
    """

    parameter: float
    kind: Kind
    unstable: int
    energy: float
    arc: float
    end: FloatArray
    middle: FloatArray
    residual: float
    t: float
    centreline: FloatArray = field(repr=False)
    settled: Settled | None = None
    meshes: tuple[float, ...] = ()
    critical: tuple[float, ...] = ()
    what: str = ""
    shape: Shape | None = field(default=None, repr=False)
    force: FloatArray | None = None
    bars: Bars | None = None
    aside: int | None = None

    @property
    def stable(self) -> bool:
        """No unstable mode."""
        return self.unstable == 0

    @property
    def error(self) -> float | None:
        """Of the parameter, in its unit: 0 for a regular point that was put where it lies. None: not asked for, or it
        does not settle."""
        if self.kind == "regular":
            return None if self.bars is None or not self.bars.settles else self.bars.parameter
        return None if self.settled is None or not self.settled.settles else self.settled.error

    @property
    def settles(self) -> bool | None:
        """Whether a special point's place is that of finer elements too; None: regular, or not asked."""
        return None if self.settled is None else self.settled.settles


@dataclass(frozen=True)
class Branch:
    """A branch of one model: its number, points in order, how it ended ("range", "closed", "steps", "stuck",
    "unposed", "spread", "unresolved", "stopped"), which branch point it leaves (branch, parameter; None: the one that
    the scene's own state lies on), and of which branch it is the image (`compare.studies.branches.images`).

    unasked: points without an unstable mode of their own of which it is not known whether what is free on them (rulings
    of a straight part) makes them unstable; image_by: by what it is an image: a mirror, a turn, read from the other
    end; joins: other branch points (branch, parameter) that it was found to leave too; circle: whether it stands for a
    circle of branches, which are turned into each other (`compare.continuation.pinned`)."""

    model: str
    number: int
    points: tuple[BranchPoint, ...]
    ended: str
    leaves: tuple[int, float] | None = None
    image_of: int | None = None
    unasked: int = 0
    image_by: By | None = None
    joins: tuple[tuple[int, float], ...] = ()
    circle: bool = False

    @property
    def special(self) -> tuple[BranchPoint, ...]:
        """Folds, branch points and events."""
        return tuple(point for point in self.points if point.kind != "regular")

    @property
    def turning(self) -> BranchPoint | None:
        """The first point, an event too, at which it gains or loses its stability; None: it keeps it, or the place was
        not found."""
        start = now = self.points[0].unstable
        for k, point in enumerate(self.points):
            if point.kind in ("fold", "branch_point"):
                now = point.unstable if now > point.unstable else self._gained(k, now)
            elif point.kind == "ruling":
                now = max(1, point.unstable)
            else:
                now = point.unstable
            if point.kind != "regular" and bool(now) != bool(start):
                return point
        return None

    def _gained(self, k: int, now: int) -> int:
        """Number of unstable modes behind a fold or branch point before which there are `now`, no more than behind it:
        no others where the next regular point has none, as the branch only touches it."""
        more = now + max(1, len(self.points[k].critical))
        behind = next((point.unstable for point in self.points[k + 1 :] if point.kind == "regular"), more)
        return min(more, max(now, behind))


@dataclass(frozen=True)
class Diagram:
    """All branches of all models of a scene over one number.

    starts: model -> its state where its first branch begins; left: branches that were met and not followed; moving:
    whether elements followed what is sudden in the shape; aside: model -> whether modes aside of the plane of its
    unknowns are counted, without models whose unknowns are of space."""

    scene: Scene
    along: Along
    branches: tuple[Branch, ...]
    starts: Mapping[str, State]
    left: int = 0
    moving: bool = False
    aside: Mapping[str, bool] = field(default_factory=dict)

    @property
    def special(self) -> list[tuple[Branch, BranchPoint]]:
        """Folds and branch points first, in order, then events."""
        found = [(branch, point) for branch in self.branches for point in branch.special]
        return sorted(found, key=lambda pair: pair[1].kind == "event")

    @property
    def unsettled(self) -> int:
        """Folds and branch points whose place is the mesh's."""
        return sum(point.settles is False for _, point in self.special if point.kind != "event")

    @property
    def rough(self) -> int:
        """Regular points of which a number does not settle on finer elements."""
        points = [point for branch in self.branches for point in branch.points if point.kind == "regular"]
        return sum(point.bars is not None and not point.bars.settles for point in points)

    @property
    def ok(self) -> bool:
        """Every branch goes to an end of its own and every fold and branch point settles."""
        return not self.unsettled and all(branch.ended in ("range", "closed") for branch in self.branches)

    def spread(self, name: str, component: int) -> float:
        """How far a component of "end" or "middle" ranges over all points beside what is linear in the parameter."""
        points = [point for branch in self.branches for point in branch.points]
        if not points:
            return math.nan
        values = np.array([getattr(point, name)[component] for point in points])
        line = np.column_stack([np.ones(len(points)), [point.t for point in points]])
        left = values - line @ np.linalg.lstsq(line, values, rcond=None)[0]
        return float(left.max() - left.min())
