"""Where folds and branch points go while a second number of the scene changes: curves in the plane of both.

For each value of the second number all branches are followed over the first (`compare.studies.branches.run`), with an
error of every special point. Points of neighbouring values are one curve where they are of one kind and one stability
and nearest to what the curve is extrapolated to. The interval in which a curve begins or ends is halved. Two folds that
end in one interval meet in a cusp: their difference falls as the distance to it to the power 3/2, which tells where.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment

from compare import registry
from compare.models.base import check_keys
from compare.scene.keys import KEYS, contract_name
from compare.scene.scene import Scene
from compare.store.progress import Reporter
from compare.store.provenance import software
from compare.store.store import atomic_write_json, case_key, jsonable, read_json
from compare.studies.axes import parse_axis
from compare.studies.branches.along import Along, placed, taken_apart
from compare.studies.branches.run import Asked, diagram, energy_of, scene_for
from ribbonbench.errors import BadInput

#: Times that an interval in which a curve begins or ends is halved.
HALVED = 5
#: Farthest that a point may be from where its curve is extrapolated to: parts of the range, and of the energy.
NEAR = 0.5
#: Power by which the difference of two folds falls towards their cusp.
CUSP = 1.5
#: Most values of the second number that may be asked for.
MOST = 200


@dataclass(frozen=True)
class Mark:
    """A fold, branch point or fall by rulings at a value of the second number (`other`). value: of the first, its limit
    on finer elements where it settles; error: of that, None: it does not settle, or was not asked for; unstable: modes
    on its side with fewer; energy: total, D w / l."""

    other: float
    model: str
    kind: str
    unstable: int
    value: float
    error: float | None
    settles: bool | None
    energy: float


@dataclass(frozen=True)
class Cut:
    """What a diagram at one value of the second number shows. residual: the largest of its points; short: branches that
    did not come to an end of their own; left: those that were met and not followed; why: why there is no diagram, ""
    where there is one."""

    other: float
    marks: tuple[Mark, ...]
    residual: float = 0.0
    short: int = 0
    left: int = 0
    why: str = ""

    @property
    def whole(self) -> bool:
        """Every branch came to an end of its own and none was left out."""
        return not (self.short or self.left or self.why)


@dataclass(frozen=True)
class Curve:
    """Marks of one model, kind and stability by the second number; begins, ends: the interval of it in which it does,
    None: with the values that were asked for."""

    marks: tuple[Mark, ...]
    begins: tuple[float, float] | None = None
    ends: tuple[float, float] | None = None

    @property
    def model(self) -> str:
        """Whose it is."""
        return self.marks[0].model

    @property
    def kind(self) -> str:
        """Of all its marks."""
        return self.marks[0].kind

    def predicted(self, other: float) -> tuple[float, float]:
        """Value and energy that its last two marks are extrapolated to."""
        last = self.marks[-1]
        if len(self.marks) < 2:
            return last.value, last.energy
        before = self.marks[-2]
        share = (other - last.other) / (last.other - before.other)
        return (
            last.value + share * (last.value - before.value),
            last.energy + share * (last.energy - before.energy),
        )


@dataclass(frozen=True)
class Meeting:
    """A cusp: two folds of a model meet in the interval `between` of the second number. at: its place by the power law,
    None where that lies outside; value: of the first number, between the last of both."""

    model: str
    between: tuple[float, float]
    at: float | None
    value: float


@dataclass(frozen=True)
class Curves:
    """All curves of a scene over two numbers; along: of the first at the first value of the second."""

    scene: Scene
    along: Along
    over: str
    cuts: tuple[Cut, ...]
    curves: tuple[Curve, ...]
    meetings: tuple[Meeting, ...]

    @property
    def unit(self) -> str:
        """Of the second number."""
        about = KEYS.get(contract_name(taken_apart(self.over)[0]))
        return "" if about is None else about.unit or ""

    @property
    def marks(self) -> list[Mark]:
        """All of them."""
        return [mark for curve in self.curves for mark in curve.marks]

    @property
    def ok(self) -> bool:
        """There is a whole diagram for every value, and every mark settles that was asked to."""
        return not any(cut.short or cut.why for cut in self.cuts) and all(m.settles is not False for m in self.marks)


def asked_values(text: str) -> tuple[str, tuple[float, ...]]:
    """Key and values, sorted, of --over KEY=VALUES, as for a sweep; the key may name a component. Raises `BadInput`."""
    key, _, right = (part.strip() for part in text.partition("="))
    if taken_apart(key)[1] is None:
        (values,) = zip(*parse_axis(text, "--over").values, strict=True)
    else:
        (values,) = zip(*parse_axis(f"strip.gamma={right}", "--over").values, strict=True)  # numbers, of any key
    if not all(isinstance(v, int | float) and not isinstance(v, bool) and math.isfinite(v) for v in values):
        raise BadInput("--over", text, "has values that are no numbers", f"e.g. --over {key}=0.1:0.5:9")
    if len(set(values)) < 2 or len(values) > MOST:
        raise BadInput("--over", text, f"has {len(set(values))} different values", f"give from 2 to {MOST}")
    return key, tuple(sorted({float(v) for v in values}))


def curves(
    scene: Scene,
    key: str,
    first: float | None,
    last: float | None,
    over: str,
    values: Sequence[float],
    models: Sequence[str] = (),
    asked: Asked | None = None,
    say: Reporter | None = None,
    keep: Path | None = None,
) -> Curves:
    """The curves over `key` from `first` to `last` and over `over` at `values` and, where one begins or ends, between
    them. keep: a folder for what is finished, which an interrupted run goes on from.

    Raises `BadInput` before anything is computed where a value cannot be; a value at which nothing can be followed is a
    `Cut` that says why.
    """
    asked = dataclasses.replace(asked or Asked(), points=False)  # of special points alone
    if over == key:
        raise BadInput("--over", over, "is the number of --along too", "choose another key")
    words = tuple(models) or (energy_of(placed(scene, "--over", over, min(values)), key, first, last),)
    study = _Study(scene, key, first, last, over, words, asked, say, keep)
    for value in values:
        study.checked(value)
    cuts = {value: study.cut(value) for value in values}
    found = _joined(sorted(cuts.values(), key=lambda cut: cut.other), study.span)
    for _ in range(HALVED):
        open_ones = {interval for curve in found for interval in (curve.begins, curve.ends) if interval is not None}
        between = sorted(0.5 * (a + b) for a, b in open_ones if not (cuts[a].why or cuts[b].why))
        if not between:
            break
        cuts |= {value: study.cut(value) for value in between}
        found = _joined(sorted(cuts.values(), key=lambda cut: cut.other), study.span)
    each = tuple(sorted(cuts.values(), key=lambda cut: cut.other))
    return Curves(scene, study.along(each[0].other), over, each, tuple(found), tuple(_meetings(found)))


@dataclass(frozen=True)
class _Study:
    scene: Scene
    key: str
    first: float | None
    last: float | None
    over: str
    words: tuple[str, ...]
    asked: Asked
    say: Reporter | None
    keep: Path | None

    def at(self, value: float) -> Scene:
        return placed(self.scene, "--over", self.over, value)

    def along(self, value: float) -> Along:
        return Along.of(self.at(value), self.key, self.first, self.last)

    @property
    def span(self) -> float:
        """Of the first number."""
        if self.first is None or self.last is None:
            return 1.0
        return abs(self.last - self.first)

    def checked(self, value: float) -> None:
        for word in self.words:
            own, name = scene_for(self.at(value), word)
            check_keys(registry.model(name), Along.of(own, self.key, self.first, self.last).scene_at(0.0))

    def cut(self, value: float) -> Cut:
        """The diagram at a value, kept or followed."""
        place = None if self.keep is None else self.keep / f"{self._name(value)}.json"
        if place is not None and place.is_file():
            kept = read_json(place)
            return Cut(**{**kept, "marks": tuple(Mark(**mark) for mark in kept["marks"])})
        if self.say is not None:
            self.say.step(f"{self.over} = {value:.6g}")
        found = self._followed(value)
        if place is not None and not (self.asked.budget is not None and not found.whole):
            place.parent.mkdir(parents=True, exist_ok=True)
            atomic_write_json(place, jsonable(dataclasses.asdict(found)))
            place.with_suffix(".journal").unlink(missing_ok=True)
        return found

    def _name(self, value: float) -> str:
        homes = {registry.home(scene_for(self.scene, word)[1]) for word in self.words}
        what = [self.key, self.first, self.last, *self.words, dataclasses.asdict(self.asked)]
        return case_key(self.at(value).canonical(), what, software(__name__, *sorted(homes)))[:24]

    def _followed(self, value: float) -> Cut:
        begun = None if self.keep is None else self.keep / f"{self._name(value)}.journal"
        try:
            found = diagram(self.at(value), self.key, self.first, self.last, self.words, self.asked, self.say, begun)
        except BadInput as error:
            return Cut(value, (), why=str(error))
        marks = []
        for branch, point in found.special:
            if branch.image_of is not None or point.kind == "event":
                continue
            limit = point.settled
            value_there = limit.value if limit is not None and limit.settles else point.parameter
            marks.append(
                Mark(
                    value, branch.model, point.kind, point.unstable, value_there,
                    point.error, point.settles, point.energy,
                )
            )  # fmt: skip
        short = sum(branch.ended not in ("range", "closed") for branch in found.branches)
        residual = max(point.residual for branch in found.branches for point in branch.points)
        return Cut(value, tuple(marks), residual, short, found.left)


def _joined(cuts: Sequence[Cut], span: float) -> list[Curve]:
    """The curves through cuts in order. One that has no mark at the next value ends in the interval before it, and one
    that has none before begins in that."""
    done: list[Curve] = []
    growing: list[Curve] = []
    before: Cut | None = None
    for cut in (cut for cut in cuts if not cut.why):
        pairs = _pairs(growing, cut, span)
        taken = set(pairs.values())
        following = []
        for k, curve in enumerate(growing):
            if k in pairs:
                following.append(dataclasses.replace(curve, marks=(*curve.marks, cut.marks[pairs[k]])))
            else:
                assert before is not None
                done.append(dataclasses.replace(curve, ends=(before.other, cut.other)))
        begins = None if before is None else (before.other, cut.other)
        following += [Curve((mark,), begins) for k, mark in enumerate(cut.marks) if k not in taken]
        growing, before = following, cut
    return sorted([*done, *growing], key=lambda c: (c.model, c.marks[0].other, c.marks[0].value))


def _pairs(growing: Sequence[Curve], cut: Cut, span: float) -> dict[int, int]:
    """Which mark of the cut goes on with which curve, the sum of what they miss least."""
    if not growing or not cut.marks:
        return {}
    cost = np.full((len(growing), len(cut.marks)), 1e6)
    for i, curve in enumerate(growing):
        value, energy = curve.predicted(cut.other)
        last = curve.marks[-1]
        for j, mark in enumerate(cut.marks):
            if (mark.model, mark.kind, mark.unstable) == (last.model, last.kind, last.unstable):
                cost[i, j] = abs(mark.value - value) / span + abs(mark.energy - energy) / (1.0 + abs(energy))
    rows, columns = linear_sum_assignment(cost)
    return {int(i): int(j) for i, j in zip(rows, columns, strict=True) if cost[i, j] <= NEAR}


def _meetings(found: Sequence[Curve]) -> list[Meeting]:
    """Pairs of folds of a model that end, or begin, in one interval."""
    met = []
    for name, side in (("ends", -1), ("begins", 0)):
        folds: dict[tuple[str, tuple[float, float]], list[Curve]] = {}
        for curve in found:
            interval = getattr(curve, name)
            if curve.kind == "fold" and interval is not None:
                folds.setdefault((curve.model, interval), []).append(curve)
        for (model, interval), pair in folds.items():
            if len(pair) == 2:
                value = 0.5 * (pair[0].marks[side].value + pair[1].marks[side].value)
                met.append(Meeting(model, interval, _cusp(pair[0], pair[1], side, interval), value))
    return met


def _cusp(one: Curve, other: Curve, side: int, interval: tuple[float, float]) -> float | None:
    """Where the difference of two folds vanishes by its power law; None where that is not in the interval."""
    step = -1 if side == -1 else 1
    places = [m.other for m in one.marks][side::step][:2], [m.other for m in other.marks][side::step][:2]
    if len(places[0]) < 2 or places[0] != places[1]:
        return None
    apart = [
        abs(a.value - b.value) ** (1.0 / CUSP)
        for a, b in zip(one.marks[side::step][:2], other.marks[side::step][:2], strict=True)
    ]
    if not apart[1] > apart[0] > 0.0:
        return None
    near, far = places[0]
    at = near + (near - far) * apart[0] / (apart[1] - apart[0])
    return at if min(interval) <= at <= max(interval) else None
