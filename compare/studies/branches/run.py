"""Following all branches of a scene's models: the scene's own, then those that leave it, and theirs.

Every branch point is left along its null vectors, both ways, a double one every way that leads on
(`compare.continuation.ring`); whether a branch is one that was followed, or the image of one, is told by its first
point (`compare.studies.branches.images`). Folds, branch points and events are located again on elements half and a
quarter as long (`compare.continuation.finer`), and their limit taken (`compare.measure.mesh_limit`); every other point
is put again on them (`compare.studies.branches.bars`).
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from compare import registry
from compare.continuation.correct import first_point
from compare.continuation.follow import follow, switched
from compare.continuation.journal import kept
from compare.continuation.pinned import Pinned
from compare.continuation.point import Options, Point, Run
from compare.models.base import State, check_keys
from compare.models.capabilities import Branches, BranchStart
from compare.models.choice import settled as settled_energy
from compare.scene.scene import Scene
from compare.store.progress import Reporter
from compare.store.provenance import software
from compare.store.store import case_key
from compare.studies.branches import aside, freed
from compare.studies.branches.along import Along, number_of, placed
from compare.studies.branches.diagram import Branch, BranchPoint, Diagram
from compare.studies.branches.images import Image, Known
from compare.studies.branches.measured import HALVINGS, Measured, unpinned
from ribbonbench.errors import BadInput
from ribbonbench.threads import alone

#: Rate of the residual below which a key moves nothing: its norm, and its largest number, for the norm of a thin rod or
#: shell allows for the rounding of its stiffest strain, below which a load that bends it may lie.
MOVES = 1e-9
#: How far beside its first equilibrium that is looked at too.
BESIDE = 1e-3
#: Events of a branch that are located on finer elements, at the most.
EVENTS = 24
#: Branches of a model, and points of a branch, at the most.
BRANCHES, STEPS = 8, 200


@dataclass(frozen=True)
class Asked:
    """What is followed: at most so many branches of a model, and points of one; errors: of special points, on finer
    elements; points: of regular ones too, None: where elements half as long cost no more than twice (`BranchStart`);
    budget: seconds in all, None: as long as it takes; moving: on elements that follow what is sudden."""

    branches: int = BRANCHES
    steps: int = STEPS
    errors: bool = True
    budget: float | None = None
    moving: bool = False
    points: bool | None = None


def scene_for(scene: Scene, model: str) -> tuple[Scene, str]:
    """The scene that a word of --model asks for, an energy or a model, and the name of the model that answers.

    `BadInput` for a word that is neither, and for a model that cannot follow a branch."""
    if registry.knows_energy(model):
        name = registry.name_for(model)
        scene = scene if scene.model.energy == model else scene.replace({"model.energy": model})
    elif model in registry.names():
        name = model
    else:
        known = ", ".join((*registry.energies(), *registry.names()))
        raise BadInput("--model", model, "is no energy and no model", f"choose from {known}")
    if not isinstance(registry.model(name), Branches):
        able = ", ".join(n for n in registry.names() if isinstance(registry.model(n), Branches))
        why = registry.model(name).no_branches
        raise BadInput("--model", model, f"cannot follow a branch: {why}", f"choose an energy of one that can: {able}")
    return scene, name


def energy_of(scene: Scene, key: str, first: float | None, last: float | None) -> str:
    """The scene's own energy; where it leaves that open the one that is chosen where the branch begins."""
    if scene.model.accuracy is None:
        return scene.model.energy
    return settled_energy(Along.of(scene, key, first, last).scene_at(0.0)).model.energy


@alone
def diagram(
    scene: Scene,
    key: str,
    first: float | None = None,
    last: float | None = None,
    models: Sequence[str] = (),
    asked: Asked | None = None,
    say: Reporter | None = None,
    keep: Path | None = None,
) -> Diagram:
    """The branches of every model, `models` being energies or names (none: the scene's own), over `key` from `first` to
    `last` (`Along.of`). keep: a file for what is solved (`compare.continuation.journal`), from which one that was
    stopped goes on. Raises `BadInput` before anything is computed, and for a key that moves no equilibrium."""
    asked = asked or Asked()
    words = tuple(models) or (energy_of(scene, key, first, last),)
    if len(set(words)) < len(words):
        raise BadInput("--model", ",".join(words), "names a model twice", "name each once")
    chosen = []
    for word in words:
        own, name = scene_for(scene, word)
        along = Along.of(own, key, first, last)
        check_keys(registry.model(name), along.scene_at(0.0))
        chosen.append((word, name, along))
    end = None if asked.budget is None else time.monotonic() + asked.budget
    branches: list[Branch] = []
    starts: dict[str, State] = {}
    counted: dict[str, bool] = {}
    left = 0
    with kept(keep, _key(scene, key, first, last, words, asked)):
        for word, name, along in chosen:
            found = _Models(word, name, along, asked, end, say)
            branches += found.all(len(branches))
            starts[word] = found.start.state
            if found.start.planar:
                counted[word] = found.start.aside is not None
            left += found.left
    return Diagram(scene, chosen[0][2], tuple(branches), starts, left, asked.moving, counted)


def _key(scene: Scene, key: str, first: float | None, last: float | None, words: Sequence[str], asked: Asked) -> str:
    """Of what is followed, however long it may take."""
    homes = {registry.home(scene_for(scene, word)[1]) for word in words}
    what = [key, first, last, *words, asdict(replace(asked, budget=None))]
    return case_key(scene.canonical(), what, software(__name__, *sorted(homes)))


def branch(
    scene: Scene,
    *,
    along: str,
    start: float | None = None,
    stop: float | None = None,
    model: str | None = None,
    errors: bool = True,
    steps: int = STEPS,
) -> Iterator[BranchPoint]:
    """The points of the scene's own branch over `along` (a key, a component of it as "clamp.end.position[1]", or
    "path"), from `start` to `stop` in the scene's unit; model: an energy, or a model's name. Raises `BadInput`."""
    asked = Asked(branches=1, steps=steps, errors=errors)
    yield from diagram(scene, along, start, stop, () if model is None else (model,), asked).branches[0].points


def through(scene: Scene, key: str, low: float, high: float, steps: int = STEPS) -> tuple[str, list[tuple[str, float]]]:
    """The branch through the scene itself, whose `key` is between low and high: how it ends (at one of both, or
    "closed"), kinds and values of its folds, branch points and events in order. Raises `BadInput`."""
    own, name = scene_for(scene, scene.model.energy)
    now = number_of(own, key)

    @lru_cache(maxsize=64)
    def scene_at(t: float) -> Scene:
        return placed(own, "--along", key, now + t * (high - now))

    model = registry.model(name)
    assert isinstance(model, Branches)
    start = model.branch_start(scene_at)
    options = Options(steps=steps)
    first = first_point(start.system, start.z, 0.0, options.tolerance)
    if first is None:
        raise BadInput("--along", key, "has no regular equilibrium at the scene's own value", "begin beside it")
    run = follow(first, ((low - now) / (high - now), 1.0), options)
    return run.ended, [(special.kind, now + special.point.t * (high - now)) for special in run.specials]


class _Models:
    """All branches of one model."""

    def __init__(
        self, word: str, name: str, along: Along, asked: Asked, end: float | None, say: Reporter | None
    ) -> None:
        self.word, self.along, self.asked, self.end, self.say = word, along, asked, end, say
        self.scene_at = along.scene_at
        self.options = Options(steps=asked.steps)
        model = registry.model(name)
        assert isinstance(model, Branches)
        self._told(f"{word}: the state where the branch begins")
        self.start: BranchStart = unpinned(model.branch_start(self.scene_at, say, moving=asked.moving))
        self.left = 0
        regular = asked.errors and (not self.start.costly if asked.points is None else asked.points)
        self.measured = Measured(
            self.start,
            along,
            self.options,
            regular,
            asked.errors,
            self._spent,
            lambda what: self._told(f"{word}: {what}"),
        )

    def _told(self, text: str) -> None:
        if self.say is not None:
            self.say.step(text)

    def all(self, number: int) -> list[Branch]:
        """The branches, numbered from `number`."""
        system, z = self.start.system, self.start.z
        start = first_point(system, z, 0.0, self.options.tolerance)
        if start is None:
            raise BadInput(
                "--from", self.along.first, "is on a fold or branch point, or its state is no regular equilibrium",
                "begin a little before or behind it",
            )  # fmt: skip
        beside = start.z + BESIDE * np.random.default_rng(0).normal(
            size=start.z.size
        )  # a straight strip stays straight
        rates = [system.rate(z, 0.0) for z in (start.z, beside)]
        if max(map(system.norm, rates)) <= MOVES and not self._comes_near(start):
            self._refuse(max(float(np.abs(rate).max()) for rate in rates))
        found: list[Branch] = []
        waiting: list[tuple[Point, tuple[int, float] | None]] = [(start, None)]
        known = Known(self.start.shape, lambda t: self.scene_at(t).width, self.options)
        while waiting:
            first, leaves = waiting.pop(0)
            image = None if leaves is None or self._spent() else known.image(first)
            if image is not None and image.by is None:  # that branch again, from its other end
                at = next(k for k, one in enumerate(found) if one.number == image.of)
                assert leaves is not None
                found[at] = replace(found[at], joins=(*found[at].joins, leaves))
                continue
            if len(found) >= self.asked.branches or self._spent():
                self.left += 1
                continue
            made, run, fallen = self._branch(first, number, leaves, image)
            found.append(made)
            known.add(number, run.points)
            if image is None:
                for special in run.specials:
                    if special.kind == "branch_point":
                        place = number, self.along.value(special.point.t)
                        waiting += [(point, place) for point in switched(special, self.options)]
                if fallen is not None:
                    self.left += not fallen.states  # what it falls to was not found
                    place = number, self.along.value(fallen.point.t)
                    waiting += [(point, place) for point in self._beside(fallen)]
            number += 1
        return found

    def _refuse(self, largest: float) -> None:
        """`BadInput` for a key whose rate has a norm that is none; largest: the largest number of the rate."""
        along = self.along
        if largest > MOVES:
            raise BadInput(
                "--along", along.key, f"moves this scene's {self.word} by less than the rounding of its stiffest "
                "strain, so thin is the strip", "take a thicker strip, a longer range, or a model without stretching",
            )  # fmt: skip
        weightless = along.key == "strip.gamma" and self.scene_at(0.0).up is None
        raise BadInput(
            "--along", along.key, f"does not move this scene's {self.word}: its equilibrium stays one",
            "add [gravity] with up: nothing weighs without" if weightless
            else "choose a key that acts here, or begin where it does",
        )  # fmt: skip

    def _comes_near(self, start: Point) -> bool:
        """Whether a condition of one side comes nearer, or goes away, as with a wall that touches nothing yet."""
        here, there = (start.system.slacks(start.z, t) for t in (0.0, 0.5))
        return bool(here.size == there.size and np.any(np.abs(there - here) > MOVES))

    def _spent(self) -> bool:
        return self.end is not None and time.monotonic() > self.end

    def _branch(
        self, first: Point, number: int, leaves: tuple[int, float] | None, image: Image | None
    ) -> tuple[Branch, Run, freed.Lost | None]:
        key, begun = self.along.key, self.along.value(first.t)
        origin = "" if leaves is None else f", leaving branch {leaves[0]} at {leaves[1]:.6g}"

        def on_point(point: Point) -> bool:
            if self.say is not None:
                self.say.detail(f"{key} = {self.along.value(point.t):.6g}, {point.unstable} unstable modes")
            return not self._spent()

        self._told(f"{self.word}: branch {number} from {key} = {begun:.6g}{origin}")
        run = follow(first, (0.0, 1.0), self.options, on_point)
        beside, turns = self._aside(run.points, image is not None)
        free = freed.unstable(run.points, self.start.freed, self._spent)
        made = [
            (point.arc, 1, 0, replace(put, unstable=1) if falls else replace(
                put, unstable=put.unstable + (more or 0), aside=more))
            for point, put, falls, more in zip(
                run.points, self.measured.put_again(run.points, image is not None), free, beside, strict=True
            )
        ]  # fmt: skip
        made += turns
        fallen = None if image is not None else self._fallen(run.points, free)
        if fallen is not None:
            what = "it falls by other rulings of its straight part"
            made.append((fallen.point.arc, 0, 0, replace(self.measured.plain(fallen.point, "ruling"), what=what)))
        events = 0
        for special in run.specials:
            events += special.kind == "event"
            once = image is not None or (special.kind == "event" and events > EVENTS)
            made.append((special.point.arc, 0, special.change, self.measured.located(special, once)))
        made.sort(key=lambda entry: entry[:2])
        points: list[BranchPoint] = []
        count = run.points[0].unstable + (beside[0] or 0)
        for _, regular, change, point in made:
            before, count = count, point.unstable if regular else max(count + change, 0)
            both = count if regular or point.kind == "event" else min(before, count)
            points.append(point if regular else replace(point, unstable=both))
        return Branch(
            self.word, number, tuple(points), run.ended, leaves, None if image is None else image.of, free.count(None),
            None if image is None else image.by, circle=isinstance(first.system, Pinned),
        ), run, fallen  # fmt: skip

    def _aside(
        self, points: Sequence[Point], image: bool
    ) -> tuple[list[int | None], list[tuple[float, int, int, BranchPoint]]]:
        """Numbers of unstable modes aside of the plane, and where they change, as entries of a branch; None, none:
        they are not told apart, or not known."""
        asks = self.start.aside
        if asks is None:
            return [None] * len(points), []
        self._told(f"{self.word}: modes aside of its plane")
        found = aside.counts(points, asks, self._spent)
        self.left += None in found and not image
        halvings = HALVINGS if self.measured.special and not image else 0
        entries = []
        for one in aside.passed(points, found, asks, self.options, halvings, self._spent):
            if one is None:
                self.left += 1
                continue
            self.left += one.change > 0 and not image  # what leaves there is not of the plane
            entries.append((one.point.arc, 0, one.change, self.measured.aside(one, halvings > 0)))
        return [*found], entries

    def _fallen(self, points: Sequence[Point], free: Sequence[bool | None]) -> freed.Lost | None:
        """Where the branch first loses its stability to what is free on it."""
        pairs = range(1, len(free))
        k = next((k for k in pairs if free[k] and free[k - 1] is False and not points[k - 1].unstable), None)
        if k is None:
            return None
        self._told(f"{self.word}: where it falls by rulings that are free")
        return freed.lost(points[k - 1], points[k], self.start.freed, self.options)

    def _beside(self, fallen: freed.Lost) -> list[Point]:
        """First points of the branches that it falls to."""
        found = [first_point(system, z, fallen.t, self.options.tolerance) for system, z in fallen.states]
        return [point for point in found if point is not None]
