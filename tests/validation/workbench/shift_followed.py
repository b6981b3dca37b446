"""Thesis 7.2: the branches U, US and S of a ribbon between shifted clamps, followed, and what is special on them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from compare import registry
from compare.continuation.correct import first_point
from compare.continuation.finer import relocated
from compare.continuation.follow import follow, switched
from compare.continuation.point import Options, Point, Run, Special
from compare.models.capabilities import Branches, BranchStart
from compare.scene.scene import Scene, load
from compare.studies.branches.along import Along
from compare.studies.branches.run import scene_for
from ribbon.find.branch.equations import Equations
from ribbon.find.branch.passages import Grading

SHIFT, SPAN, POISSON = "clamp.end.position[1]", (0.01, 0.6), 0.3
#: Meshes on which a special point is located: the first, and so many times halved.
HALVINGS = 2
#: Height (l) at which US is left beside S: elements at passages are not symmetric to S on it, and join the two.
FLAT = 4e-3
#: Shift down to which S is followed.
DOWN = 0.3
#: Seed of S (1/l): its curvature is odd about the middle.
ODD = (-8.0, 0.0, 8.0)
#: Two folds that follow each other and are nearer than this (l) are what elements make of a steep piece.
RIPPLE = 1e-3
#: Where a branch begins: its own elements, or, where no state is found on them, longer ones before.
COARSER = ((1.0,), (4.0, 2.0, 1.0))
#: Shortest elements over a grading's own, one after the other, by which it is reached where neither is.
LEAST = (8.0, 4.0, 2.0, 1.0)
#: Newton's iterations in a step after which the next one is longer: passages go over many short elements.
EASY, STEPS = 8, 420


@dataclass(frozen=True)
class Case:
    """A ribbon of `energy`, w/l = 1 / `narrow`, w/h = `ratio` (0: it knows no thickness), on elements that `grading`
    places at every point, or on so many equal `elements`; U is followed up to a shift of `upto`, every branch over so
    many `steps` at the most, longer again after `easy` iterations."""

    energy: str
    narrow: float
    ratio: float = 0.0
    grading: Grading | None = None
    elements: int = 100
    upto: float = SPAN[1]
    easy: int = EASY
    steps: int = STEPS

    @property
    def options(self) -> Options:
        """How its branches are followed."""
        return Options(easy=self.easy, steps=self.steps)

    @property
    def name(self) -> str:
        """For files: all that it is."""
        g = self.grading
        placed = f"{self.elements}" if g is None else f"{g.longest:g}_{g.least:g}_{g.growth:g}"
        how = f"{self.upto:g}_{self.easy}_{self.steps}"
        return f"{self.energy}_{self.narrow:g}_{self.ratio:g}_{placed}_{how}"

    def scene(self, flat: bool = False) -> Scene:
        """`shift_7_2`, nu = 0.3, both edges held; flat: with the seed of S in place of that of the arch."""
        width = 1.0 / self.narrow
        changes: dict[str, Any] = {
            "strip.poisson": POISSON, "strip.width": width, "model.elements": self.elements, "model.energy": self.energy
        }  # fmt: skip
        if self.ratio:
            changes |= {"shell.width_to_thickness": [self.ratio], "strip.thickness": width / self.ratio}
        if self.energy == "kirchhoff":
            changes |= {"clamp.start.ruling": None, "clamp.end.ruling": None, "seed.ruling": None}
        if flat:
            changes |= {"path": None, "seed.curvature": list(ODD)}
            changes |= {} if self.energy == "kirchhoff" else {"seed.ruling": [0.2, 0.2]}
        return load("shift_7_2").replace(changes)


def begun(case: Case, flat: bool = False) -> tuple[BranchStart, Point, Along]:
    """The arch at the first shift, or S at the last one, on its elements."""
    scene, name = scene_for(case.scene(flat), case.energy)
    along = Along.of(scene, SHIFT, *((SPAN[1], DOWN) if flat else SPAN))
    model = registry.model(name)
    assert isinstance(model, Branches)
    start = model.branch_start(along.scene_at)
    own = first_point(start.system, start.z, 0.0, Options().tolerance)
    first = own
    for way in _ways(case.grading) if case.grading is not None else ():
        first = own
        for grading in way:
            first = None if first is None else _graded(first, grading)
        if first is not None and not first.unstable:
            break
    if first is None or first.unstable:
        raise AssertionError(f"{case.name}: no stable state to begin with")
    if flat and abs(height(start, first)) > 1e-6:
        raise AssertionError(f"{case.name}: its middle is at {height(start, first):g} l, on S it is at 0")
    return start, first, along


def _ways(grading: Grading) -> list[list[Grading]]:
    """Gradings over which a branch's own one is reached: it alone, longer elements first, or shorter and shorter ones
    beside passages and clamps."""
    longer = [[grading.finer(1.0 / times) for times in way] for way in COARSER]
    return [*longer, [replace(grading, least=min(times * grading.least, grading.longest)) for times in LEAST]]


def _graded(point: Point, grading: Grading) -> Point | None:
    """The state at t = 0 on elements that are placed by another grading."""
    assert isinstance(point.system, Equations)
    graded = replace(point.system, grading=grading, placed=np.zeros(0))
    graded.problem(0.0)
    system, z, _ = graded.moved(point.z, 0.0, np.zeros((point.z.size, 0)))
    return first_point(system, z, 0.0, Options().tolerance)


def height(start: BranchStart, point: Point) -> float:
    """Of the strip's middle over the clamps' plane, l."""
    return float(start.shape(point).centreline(np.array([0.5]))[0, 2])


def rippled(folds: Sequence[tuple[int, float]], fork: float = math.nan) -> set[int]:
    """Of folds (place in a list, shift) in their order along a branch: those that are nearer to a neighbour than
    `RIPPLE`, pair by pair, the nearest pair first, as long as there are any; then the first one that is left, if it is
    as near to the `fork` (shift) at which the branch begins: elements that hold the fork make it turn back."""
    left, gone = list(folds), set()
    while len(left) > 1:
        k = min(range(len(left) - 1), key=lambda k: abs(left[k + 1][1] - left[k][1]))
        if abs(left[k + 1][1] - left[k][1]) >= RIPPLE:
            break
        gone |= {left[k][0], left[k + 1][0]}
        del left[k : k + 2]
    return gone | {k for k, shift in left[:1] if abs(shift - fork) < RIPPLE}


class Followed:
    """What is known of one branch and those that leave it, as they are followed."""

    def __init__(self, case: Case, flat: bool = False) -> None:
        self.start, self.first, self.along = begun(case, flat)
        self.name, self.options = case.name, case.options
        self.lines: list[dict[str, Any]] = []
        self.specials: list[dict[str, Any]] = []

    def line(self, name: str, first: Point, on_point: Callable[[Point], bool] | None = None, last: float = 1.0) -> Run:
        """A branch, kept."""
        run = follow(first, (0.0, last), options=self.options, on_point=on_point)
        value = self.along.value
        self.lines.append({
            "name": name, "shift": [value(p.t) for p in run.points], "height": [self.height(p) for p in run.points],
            "unstable": [p.unstable for p in run.points], "ended": run.ended,
            "elements": int(getattr(run.points[-1].system, "lengths", np.zeros(0)).size),
        })  # fmt: skip
        print(f"  {self.name}: {name}, {len(run.points)} points, {run.ended}", flush=True)
        return run

    def height(self, point: Point) -> float:
        """Of the strip's middle, l."""
        return height(self.start, point)

    def located(self, name: str, special: Special, finer: int = HALVINGS) -> None:
        """A special point on its elements and on finer ones, kept."""
        values, heights, last = [self.along.value(special.point.t)], [self.height(special.point)], special
        for _ in range(finer):
            again = relocated(last)
            if again is None:
                break
            values.append(self.along.value(again.point.t))
            heights.append(self.height(again.point))
            last = again
        found = {"branch": name, "kind": special.kind, "values": values, "height": heights[-1],
                 "change": special.change, "unstable": special.point.unstable}  # fmt: skip
        self.specials.append(found)
        print(f"  {self.name}: {found}", flush=True)

    def told(self, ripples: int = 0) -> dict[str, Any]:
        """As `upright` returns it."""
        return {"lines": self.lines, "specials": self.specials, "ripples": ripples}


def upright(case: Case, finer: int = HALVINGS) -> dict[str, Any]:
    """U over the range, and its branch points and folds, those branch points alone on the first elements that have
    unstable modes on both sides: "lines" (shift, height, unstable modes of every point, how it ended), "specials"
    (branch, kind, shifts on elements halved so often, height), "ripples"."""
    found = Followed(case)
    last = (case.upto - SPAN[0]) / (SPAN[1] - SPAN[0])
    unstable = 0
    for special in found.line("U", found.first, last=last).specials:
        before, unstable = unstable, unstable + special.change
        if special.kind in ("branch_point", "fold"):
            found.located("U", special, 0 if before and unstable and special.kind != "fold" else finer)
    return found.told()


def tilted(case: Case, finer: int = HALVINGS) -> dict[str, Any]:
    """US from where it leaves U until it is beside S: as `upright`, and how many folds were nearer to each other than
    `RIPPLE`."""
    found = Followed(case)
    way = follow(found.first, options=found.options, on_point=lambda p: not p.unstable)
    forks = [s for s in way.specials if s.kind == "branch_point"]
    ripples: set[int] = set()
    for leaving in switched(forks[0])[:1] if forks else ():
        run = found.line("US", leaving, lambda p: found.height(p) > FLAT)
        folds = [(k, found.along.value(s.point.t)) for k, s in enumerate(run.specials) if s.kind == "fold"]
        ripples = rippled(folds, found.along.value(forks[0].point.t))
        for k, special in enumerate(run.specials):
            if k not in ripples:
                found.located("US", special, finer)
    return found.told(len(ripples))


def flat(case: Case, finer: int = HALVINGS) -> dict[str, Any]:
    """S from the largest shift down, and where it loses its stability: as `upright`."""
    found = Followed(case, flat=True)
    for special in found.line("S", found.first).specials:
        found.located("S", special, finer)
    return found.told()
