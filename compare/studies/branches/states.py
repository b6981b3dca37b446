"""Other equilibria of one scene: from images of its own shape, committed random starts, and by deflation.

A list of what was found, and no proof that there is no more: the others may lie where no start led.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from compare import registry
from compare.continuation import bordered
from compare.continuation.correct import first_point
from compare.continuation.deflate import deflated
from compare.continuation.finer import refined
from compare.continuation.point import Options, Point
from compare.continuation.system import System
from compare.models.base import Shape, check_keys
from compare.models.capabilities import Branches, BranchStart
from compare.models.holds.friction import rubs
from compare.scene.scene import Scene
from compare.store.progress import Reporter
from compare.studies.branches.bars import Bars, Numbers, bars, known
from compare.studies.branches.measured import HALVINGS, LINE
from ribbonbench.errors import BadInput
from ribbonbench.threads import alone

FloatArray = NDArray[np.float64]

#: Random starts, and seconds after which none is begun.
TRIES, BUDGET = 16, 120.0
#: Distance (l, of points at the same s) and difference of energies (relative, at least 1) of two that are one.
SAME, ALIKE = 1e-3, 1e-6
#: Length in the metric of shapes by which a state is moved along its softest mode, and a saddle to either side; modes
#: among which that of a saddle is looked for.
PUSHED, ASIDE, _NEAR = 0.3, 0.1, 3


@dataclass(frozen=True)
class Seen:
    """An equilibrium: energy (total, D w / l, without the constant of the natural curvature), number of unstable modes,
    distance (largest, of points at the same s, l) from the scene's own state, how it was found, of which one before it
    is an image by its energy (None: of none), its centreline (101, 3) in l and its shape; bars: how far energy and
    shape are from those of elements halved twice, which settle only where finer ones have as many unstable modes; those
    of what it is an image of; None: not asked for, or no time."""

    energy: float
    unstable: int
    distance: float
    found_by: str
    image_of: int | None
    centreline: FloatArray = field(repr=False)
    shape: Shape = field(repr=False, compare=False)
    bars: Bars | None = None

    @property
    def settles(self) -> bool | None:
        """Whether finer elements have this state too; None: not known."""
        return None if self.bars is None else self.bars.settles

    @property
    def stable(self) -> bool:
        """No unstable mode."""
        return self.unstable == 0


@dataclass(frozen=True)
class Barrier:
    """A saddle (number of a state with one unstable mode), the two states that short steps downhill lead to from its
    sides, lower first, and its height over each (D w / l), with errors (None: one of both has none that settles). The
    way over it is there; a lower one over a saddle that was not seen may be."""

    saddle: int
    ends: tuple[int, int]
    heights: tuple[float, float]
    errors: tuple[float | None, float | None]


@dataclass(frozen=True)
class Left:
    """A saddle with one unstable mode (number of a state) over which no barrier is known, and why."""

    saddle: int
    why: str


#: Why a saddle gives no barrier.
SPENT, NO_MODE = "the time was spent", "its unstable mode was not found"
NO_END, NO_LOWER = "steps downhill did not converge", "steps downhill led to no stable state below it"
ONE_END = "both sides fall to one state"


@dataclass(frozen=True)
class States:
    """What was seen, by energy; own: which of them the scene's own solve leads to; tries: starts that were gone from;
    complete: whether all of them, and all saddles, were, within the time; costly: whether errors are not asked for, as
    finer elements of the model cost too much; barriers: between two that are told apart, lowest first; left: the
    saddles that gave none; downhill: whether the model goes downhill from them at all."""

    seen: tuple[Seen, ...]
    own: int
    tries: int
    complete: bool
    costly: bool = False
    barriers: tuple[Barrier, ...] = ()
    left: tuple[Left, ...] = ()
    downhill: bool = True

    @property
    def saddles(self) -> int:
        """How many have one unstable mode."""
        return sum(s.unstable == 1 for s in self.seen)

    @property
    def unsettled(self) -> int:
        """How many are these elements' own."""
        return sum(s.settles is False for s in self.seen)

    @property
    def unasked(self) -> int:
        """How many have no errors, for lack of time or as they cost too much."""
        return sum(s.bars is None for s in self.seen)

    @property
    def lower(self) -> tuple[Seen, ...]:
        """Stable ones below the scene's own."""
        mine = self.seen[self.own]
        return tuple(s for s in self.seen if s.stable and s.energy < mine.energy - ALIKE * max(1.0, abs(mine.energy)))

    def distances(self) -> FloatArray:
        """Largest distances (n, n) between points at the same s, l."""
        lines = np.array([s.centreline for s in self.seen])
        return np.asarray(np.linalg.norm(lines[:, None] - lines[None], axis=3).max(axis=2))


@alone
def states(scene: Scene, tries: int = TRIES, budget: float = BUDGET, say: Reporter | None = None) -> States:
    """The equilibria of the scene's own model that these starts lead to. Raises `BadInput` as `able`."""
    start = able(scene).branch_start(lambda _: scene, say)
    own = first_point(start.system, start.z, 0.0, Options().tolerance, check=False)
    if own is None:
        raise BadInput(
            "--all", scene.name, "begins at a state that is no regular equilibrium", "change the scene a bit"
        )
    return _Search(start, own, tries, budget, say).all()


def able(scene: Scene) -> Branches:
    """The scene's own model, if others can be looked for of it; else `BadInput`."""
    name = registry.name_for(scene.model.energy)
    model = registry.model(name)
    if not isinstance(model, Branches):
        known = ", ".join(n for n in registry.names() if isinstance(registry.model(n), Branches))
        raise BadInput("--all", name, "gives no tangent by which others could be told apart", f"ask one of {known}")
    if rubs(scene):
        raise BadInput(
            "--all", "friction", "holds many states, of which the way decides", "ask without --all, or without friction"
        )
    if scene.apart is not None:
        raise BadInput(
            "--all", "contact.itself", "is not known to what tells states apart: they may go through themselves",
            "ask without --all, or without contact.itself",
        )  # fmt: skip
    check_keys(registry.model(name), scene)
    return model


class _Search:
    """Equilibria found so far."""

    def __init__(self, start: BranchStart, own: Point, tries: int, budget: float, say: Reporter | None) -> None:
        self.start, self.own, self.count, self.say = start, own, tries, say
        self.end = time.monotonic() + budget
        self.points: list[tuple[Point, str, FloatArray, Shape]] = []
        self.tries = 0
        self.cut = False

    def all(self) -> States:
        """Everything that the starts lead to."""
        self._add(self.own, "the scene's own seed")
        complete = True
        for found_by, system, z in self._starts():
            self.tries += 1
            if self.say is not None:
                self.say.detail(f"{found_by}: {len(self.points)} states so far")
            point = first_point(system, z, 0.0, Options().tolerance, check=False)
            if point is not None:
                self._add(point, found_by)
            if system.size == self.own.system.size:
                known = [p.z for p, *_ in self.points if p.z.shape == z.shape]
                other = deflated(self.own.system, z, 0.0, known, Options().tolerance)
                beside = None if other is None else first_point(
                    self.own.system, other[0], 0.0, Options().tolerance, check=False
                )  # fmt: skip
                if beside is not None:
                    self._add(beside, f"deflation, {found_by}")
            if time.monotonic() > self.end:
                complete = False
                break
        sides = self._sides()
        return self._listed(complete and not self.cut, sides)

    def _sides(self) -> dict[int, tuple[int, int] | str]:
        """Of every saddle with one unstable mode, by its number among the points, those of both states beside it, or
        why they are not known."""
        if self.start.downhill is None:
            return {}
        return {k: self._ends(saddle) for k, (saddle, *_) in enumerate(self.points[:]) if saddle.unstable == 1}

    def _ends(self, saddle: Point) -> tuple[int, int] | str:
        if time.monotonic() > self.end:
            self.cut = True
            return SPENT
        factor = saddle.system.factor(saddle.z, 0.0)
        if factor is None:
            return NO_MODE
        values, modes = bordered.near_zero(saddle.system, factor, _NEAR)
        if not values[0] < 0.0:
            return NO_MODE
        one, other = (self._below(saddle, sign * modes[:, 0]) for sign in (ASIDE, -ASIDE))
        if isinstance(one, str) or isinstance(other, str):
            return one if isinstance(one, str) else str(other)
        return ONE_END if one == other else (one, other)

    def _below(self, saddle: Point, dz: FloatArray) -> int | str:
        """The number of the stable state below a saddle on the side of dz, or why there is none."""
        assert self.start.downhill is not None
        found = self.start.downhill(saddle, dz)
        point = None if found is None else first_point(*found, 0.0, Options().tolerance, check=False)
        if point is None:
            return NO_END
        if point.unstable or not point.system.energy(point.z, 0.0) < saddle.system.energy(saddle.z, 0.0):
            return NO_LOWER
        return self._add(point, "downhill from a saddle")

    def _starts(self) -> Iterator[tuple[str, System, FloatArray]]:
        """Its own state pushed along its softest mode both ways, then the model's others."""
        factor = self.own.system.factor(self.own.z, 0.0)
        if factor is not None:
            _, modes = bordered.near_zero(self.own.system, factor, 2)
            for k in range(modes.shape[1]):
                for sign in (1.0, -1.0):
                    step = sign * PUSHED * modes[:, k]
                    share = self.own.system.reach(self.own.z, step)
                    yield f"pushed along mode {k}", self.own.system, self.own.z + share * step
        yield from self.start.others(self.count)

    def _add(self, point: Point, found_by: str) -> int:
        """Its number among the points, a new one where it is not there yet."""
        shape = self.start.shape(point)
        line = shape.centreline(np.linspace(0.0, 1.0, LINE))
        for k, (_, _, other, _) in enumerate(self.points):
            if not np.abs(line - other).max() > SAME:
                return k
        self.points.append((point, found_by, line, shape))
        return len(self.points) - 1

    def _listed(self, complete: bool, sides: dict[int, tuple[int, int] | str]) -> States:
        own_line = self.points[0][2]
        energies = [point.system.energy(point.z, point.t) for point, *_ in self.points]
        order = sorted(range(len(energies)), key=lambda k: (round(energies[k], 9), k))
        seen: list[Seen] = []
        for k in order:
            point, found_by, line, shape = self.points[k]
            alike = [
                n
                for n, other in enumerate(seen)
                if abs(other.energy - energies[k]) <= ALIKE * max(1.0, abs(energies[k]))
                and other.unstable == point.unstable
            ]
            off = float(np.linalg.norm(line - own_line, axis=1).max())
            image = alike[0] if alike else None
            error = self._bars(point, line) if image is None else seen[image].bars
            seen.append(Seen(energies[k], point.unstable, off, found_by, image, line, shape, error))
        place = {k: n for n, k in enumerate(order)}
        barriers, left = [], []
        for k, side in sides.items():
            if isinstance(side, str):
                left.append(Left(place[k], side))
            else:
                barriers.append(_barrier(seen, place[k], place[side[0]], place[side[1]]))
        return States(
            tuple(seen), place[0], self.tries, complete, self.start.costly, tuple(sorted(barriers, key=_lowest)),
            tuple(left), self.start.downhill is not None,
        )  # fmt: skip

    def _bars(self, point: Point, line: FloatArray) -> Bars | None:
        """Of a state, by the same one on elements halved twice."""
        if self.start.costly:
            return None
        s, here = np.linspace(0.0, 1.0, LINE), point
        found: list[Numbers | None] = [Numbers(point.t, point.system.energy(point.z, point.t), line)]
        same = True
        for _ in range(HALVINGS):
            if time.monotonic() > self.end:
                return None
            finer = refined(here, True, Options())
            if finer is None:
                break
            energy = finer.system.energy(finer.z, finer.t)
            found.append(Numbers(finer.t, energy, self.start.shape(finer).centreline(s)))
            same, here = same and finer.unstable == point.unstable, finer
        error = bars(found, True)
        return error if same else replace(error, settles=False)


def _barrier(seen: list[Seen], saddle: int, one: int, other: int) -> Barrier:
    ends = (min(one, other), max(one, other))
    top = seen[saddle]
    heights = [top.energy - seen[k].energy for k in ends]
    errors = []
    for k in ends:
        both = [known(s.bars, "energy") if s.settles else None for s in (top, seen[k])]
        errors.append(None if None in both else sum(error for error in both if error is not None))
    return Barrier(saddle, ends, (heights[0], heights[1]), (errors[0], errors[1]))


def _lowest(barrier: Barrier) -> float:
    return min(barrier.heights)
