"""Thesis 7.2: what was found along U, US and S of a model, with limits, errors and the hystereses between folds."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from compare.measure.mesh_limit import Settled, settled
from tests.validation.number import Number
from tests.validation.workbench.shift_followed import RIPPLE, Case

#: Every mesh of a shell has elements so many times shorter than the one before.
FINER = 1.5
#: To what a place is located on its mesh (l): where elements are placed anew they are so to a part of the shortest.
PLACED, EQUAL, SHELL = 1e-5, 1e-9, 1e-9
#: Least error (l) of U stable again by shooting, whose equations are singular there: set by hand, and not derived; the
#: page has U lost by the same search beside it (`Shot.searched`), and what is within both errors without it.
SINGULAR = 5e-5


@dataclass(frozen=True)
class Place:
    """A branch point or fold on its meshes: its shift (l) on each, height there, limit."""

    values: tuple[float, ...]
    height: float
    limit: Settled

    @classmethod
    def of(cls, found: Mapping[str, Any], located: float, ratio: float = 2.0) -> Place:
        """From a special point of `followed`; where a mesh has none it does not settle."""
        values = [*found["values"], *[math.nan] * (3 - len(found["values"]))][:3]
        return cls(tuple(values), float(found["height"]), settled(values, located, ratio))

    @property
    def finest(self) -> float:
        """On the finest mesh that has it."""
        return next(value for value in reversed(self.values) if math.isfinite(value))

    def number(self) -> Number:
        """The limit, or the finest mesh's, with why it has no error."""
        if self.limit.settles:
            return Number(self.limit.value, self.limit.error, "l", ".4f")
        return Number(self.finest, None, "l", ".4f", "it does not settle over its meshes")


@dataclass(frozen=True)
class Diagram:
    """One model: where U is lost (and stable again), folds of US in order, where S is lost on the way back, folds of
    U."""

    lost: Place | None
    again: Place | None
    folds: tuple[Place, ...]
    flat: Place | None
    lines: tuple[dict[str, Any], ...]
    ripples: int
    turned: tuple[Place, ...] = ()

    def loops(self) -> list[tuple[Place, Place]]:
        """(where the strip jumps on the way out, where on the way back) of every hysteresis, in order along US."""
        turns = list(self.folds)
        if self.lost is not None and turns and turns[0].finest < self.lost.finest:
            turns.insert(0, self.lost)
        if len(turns) % 2 and self.flat is not None:
            turns.append(self.flat)
        return list(zip(turns[::2], turns[1::2], strict=False))


def goes_back(lost: float, line: Mapping[str, Any]) -> float:
    """By how much (l) US lies before the shift at which U is lost, until it is first down at 0.9 of the height where it
    leaves U: 0 where it leaves to the stable side."""
    high = 0.9 * line["height"][0]
    points = zip(line["shift"], line["height"], strict=True)
    near = [shift for shift, _ in itertools.takewhile(lambda point: point[1] > high, points)]
    return max(0.0, lost - min(near))


def located_to(case: Case) -> float:
    """To what a place is located on its mesh."""
    return EQUAL if case.grading is None else PLACED


def widths(loop: tuple[Place, Place]) -> tuple[float, ...]:
    """Of a hysteresis on each mesh, l."""
    return tuple(a - b for a, b in zip(loop[0].values, loop[1].values, strict=True))


def width(loop: tuple[Place, Place], located: float) -> Settled:
    """Its limit."""
    return settled(widths(loop), located)


def ends(specials: Sequence[Mapping[str, Any]]) -> tuple[int | None, int | None]:
    """Which of the special points of U, in their order along it, is the one where it is lost and which the one from
    where on it has no unstable mode again; it begins with none."""
    unstable, lost, again = 0, None, None
    for k, special in enumerate(specials):
        before, unstable = unstable, unstable + int(special["change"])
        if lost is None and not before and unstable:
            lost = k
        if lost is not None and again is None and before and not unstable:
            again = k
    return lost, again


def diagram(case: Case, *parts: Mapping[str, Any]) -> Diagram:
    """Of a ribbon or a rod, from its branches U, US and S."""
    specials = [special for part in parts for special in part["specials"]]

    def places(branch: str, kind: str) -> list[Place]:
        return [Place.of(s, located_to(case)) for s in specials if s["branch"] == branch and s["kind"] == kind]

    arch = [s for s in specials if s["branch"] == "U"]
    lost, again = (Place.of(arch[k], located_to(case)) if k is not None else None for k in ends(arch))
    odd = places("S", "branch_point")
    return Diagram(
        lost, again, tuple(places("US", "fold")),
        odd[0] if odd else None, tuple(line for part in parts for line in part["lines"]),
        sum(int(part["ripples"]) for part in parts), tuple(places("U", "fold")),
    )  # fmt: skip


@dataclass(frozen=True)
class Thin:
    """A shell over its meshes: shifts at which U and S are lost; pairs of folds of US (out, back) on each; folds and
    lines of the finest, places (shift, height)."""

    meshes: tuple[tuple[int, int], ...]
    lost: tuple[float, ...]
    flat: tuple[float, ...]
    pairs: tuple[tuple[tuple[float, float], ...], ...]
    folds: tuple[tuple[float, float], ...]
    lines: tuple[dict[str, Any], ...]

    def limit(self, values: Sequence[float]) -> Settled:
        """Of a number on the meshes; one mesh has no error."""
        if len(values) < 2:
            return Settled(values[-1], math.nan, None, False)
        return settled(values, SHELL, FINER)

    @property
    def ends(self) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
        """Shifts at which it jumps on the way out, and on the way back, on each mesh; None where the two finest meshes
        have no hysteresis."""
        if not any(self.pairs[-2:]):
            return None
        widest = [max(pairs, key=lambda pair: pair[0] - pair[1], default=(math.nan,) * 2) for pairs in self.pairs]
        return tuple(out for out, _ in widest), tuple(back for _, back in widest)

    def width(self) -> Settled:
        """Of its hysteresis, with the errors of both ends; 0 where there is none."""
        if self.ends is None:
            return Settled(0.0, RIPPLE, None, len(self.pairs) > 1)
        out, back = (self.limit(values) for values in self.ends)
        return Settled(out.value - back.value, out.error + back.error, None, out.settles and back.settles)


@dataclass(frozen=True)
class Shot:
    """A ribbon's special points without elements (`shift_shot`), each (shift, error), l: where U is lost and stable
    again, folds of US and of U in order, where S is lost; integral: of the equations, by how much it changes; searched:
    where U is lost as `again` is found, by the first of its forks; bare: error of `again` without the floor."""

    lost: tuple[float, float]
    again: tuple[float, float]
    folds: tuple[tuple[float, float], ...]
    turned: tuple[tuple[float, float], ...]
    flat: tuple[float, float]
    integral: float
    searched: tuple[float, float] = (math.nan, math.nan)
    bare: float = math.nan

    @classmethod
    def of(cls, us: Mapping[str, Any], u: Mapping[str, Any]) -> Shot:
        """From what `shift_shot.measured` and `arch` keep: U counts as stable again from its last fork on; that it
        is stable there is not asked."""
        lost, flat = ((one["value"], one["error"]) for one in (us["lost"], us["flat"]))
        first, last = ((one["value"], one["error"]) for one in (u["forks"][0], u["forks"][-1]))
        folds, turned = (tuple((one["value"], one["error"]) for one in found["folds"]) for found in (us, u))
        again, searched = ((value, max(SINGULAR, error)) for value, error in (last, first))
        return cls(lost, again, folds, turned, flat, us["integral"], searched, last[1])

    def points(self, one: Diagram) -> list[tuple[str, Place, tuple[float, float]]]:
        """What, on elements and without, of everything that both have."""
        named = [("U lost", one.lost, self.lost), ("U stable again", one.again, self.again)]
        for branch, on, by in (("U", one.turned, self.turned), ("US", one.folds, self.folds)):
            named += [(f"fold of {branch} {k + 1}", a, b) for k, (a, b) in enumerate(zip(on, by, strict=False))]
        named.append(("S lost", one.flat, self.flat))
        return [(what, place, by) for what, place, by in named if place is not None]

    def named(self) -> dict[str, tuple[float, float]]:
        """By the words of the page's numbers."""
        ends = dict(zip(("out", "back"), self.folds, strict=False))
        return {"lost": self.lost, "again": self.again, **ends, "flat": self.flat}


Found = Sequence[Mapping[str, Any]]


def thin(meshes: Sequence[tuple[int, int]], arch: Found, odd: Found) -> Thin:
    """From what `shift_shells` found on each mesh."""
    pairs = []
    for found in arch:
        turns, fork = [float(shift) for shift, _ in found["folds"]], _float(found["lost"])
        if turns and turns[0] < fork:  # US leaves to the unstable side: U itself is the first place of a jump
            turns.insert(0, fork)
        pairs.append(tuple(zip(turns[::2], turns[1::2], strict=False)))
    return Thin(
        tuple(meshes), tuple(_float(f["lost"]) for f in arch), tuple(_float(f["lost"]) for f in odd), tuple(pairs),
        tuple((float(shift), float(high)) for shift, high in arch[-1]["folds"]),
        (*arch[-1]["lines"], *odd[-1]["lines"]),
    )  # fmt: skip


def _float(value: float | None) -> float:
    return math.nan if value is None else float(value)
