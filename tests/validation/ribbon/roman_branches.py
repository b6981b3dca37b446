"""Roman's strip under a falling roof as branches (thesis, 6.2.2, figures 6.12 to 6.14): from the free arch to i = 2.3.

Places of contact are unknowns (`ribbon.find.branch.confined`), so that each event has a limit on ever finer elements.
Independent: half waves by shooting (`tests.validation.ribbon.roman`), whose curvature at the floor, length of flat parts
and force they are held to; the glued ribbon's minimiser; N folds alike are one fold with Gamma / N^3.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import scipy.optimize
import scipy.special
from numpy.typing import NDArray

from compare.continuation.correct import first_point
from compare.continuation.finer import relocated
from compare.continuation.follow import follow, switched
from compare.continuation.point import Options, Point, Run, Special
from compare.measure.mesh_limit import Settled, settled
from compare.models.branches.confined import ConfinedShape
from ribbon.find.branch.chain import Setting
from ribbon.find.branch.confined import Confined
from ribbon.find.branch.folds import arch, humped, waves
from tests.validation import page
from tests.validation.number import Number
from tests.validation.ribbon.roman import DELTA, GAMMA, Experiment, free_height, line_contact, press

FloatArray = NDArray[np.float64]

#: Elements of an arc; heights between which the roof moves; the last exponent of the lowering.
ELEMENTS, TOP, LAST = 8, 0.21, 2.3
#: Where the humps begin, times the number of folds, and where what they lead to is left.
BEGUN, LEFT = 0.1, 0.17
#: To what heights are located on a mesh, l.
LOCATED = 1e-9
OPTIONS = Options(steps=300)


@cache
def low() -> float:
    """The roof's height at i = 2.3: the free arch's under weight, over exp(2.3)."""
    own, z = arch(Setting(TOP, DELTA, GAMMA), 2 * ELEMENTS)
    found = first_point(Confined(lambda t: Setting(TOP, DELTA, GAMMA), own), z, 0.0, OPTIONS.tolerance, check=False)
    assert found is not None
    system = found.system
    assert isinstance(system, Confined)
    return system.height(found.z, 0, 0.5, Setting(TOP, DELTA, GAMMA)) * math.exp(-LAST)


@dataclass(frozen=True)
class Lowering:
    """Heights over t, at a weight."""

    gamma: float

    def __call__(self, t: float) -> Setting:
        return Setting(self.height(t), DELTA, self.gamma)

    def height(self, t: float) -> float:
        """H, l."""
        return TOP + t * (low() - TOP)

    def t(self, height: float) -> float:
        """Where the roof is at this height."""
        return (TOP - height) / (TOP - low())


def chain_of(point: Point):  # type: ignore[no-untyped-def]
    """Its chain."""
    assert isinstance(point.system, Confined)
    return point.system.chain


def _first(system: Confined, z: FloatArray, t: float, along: float = 1.0) -> Point:
    found = first_point(system, z, t, OPTIONS.tolerance, along)
    assert found is not None
    return found


@cache
def one_fold(gamma: float) -> Run:
    """From the free arch down."""
    at = Lowering(gamma)
    own, z = arch(at(0.0), ELEMENTS)
    return follow(_first(Confined(at, own), z, 0.0), (0.0, 1.0), OPTIONS)


@cache
def folds(count: int, gamma: float = GAMMA) -> Run:
    """So many alike, from next to no force down."""
    at = Lowering(gamma)
    t = at.t(0.19 / count)
    own, z = waves(at(t), count, ELEMENTS)
    return follow(_first(Confined(at, own), z, t), (0.0, 1.0), OPTIONS)


def at_height(run: Run, gamma: float, height: float) -> Point:
    """The point of a run that goes down at this height."""
    t = Lowering(gamma).t(height)
    k = int(np.flatnonzero([p.t <= t for p in run.points])[-1])
    point = run.points[k]
    return _first(point.system, point.z, t)  # type: ignore[arg-type]


@cache
def leading_on(count: int) -> Run:
    """From the hump on the flat part beside so many folds up, over the fold, to one fold more."""
    at = Lowering(GAMMA)
    below = one_fold(GAMMA) if count == 1 else folds(count)
    flat = at_height(below, GAMMA, BEGUN / count)
    assert isinstance(flat.system, Confined)
    system, z = humped(flat.system, flat.z, flat.t)
    start = _first(system, z, flat.t, -1.0)
    left = LEFT / (count + 1)
    return follow(start, (0.0, 1.0), OPTIONS,
                  lambda p: not (len(chain_of(p).planes) == 2 * count + 3 and at.height(p.t) < left))  # fmt: skip


@cache
def leaning() -> Run:
    """What leaves one fold where it leans over, one of two mirror images."""
    (lost,) = [s for s in one_fold(GAMMA).specials if s.kind == "branch_point"]
    return follow(switched(lost, OPTIONS)[0], (0.0, 1.0), OPTIONS)


TOUCHES, SPREADS, ENDS, BUCKLES = "touches the roof", "spread into flat parts", "have become places", "buckles"
#: Runs by name, of a weight.
RUNS: dict[str, Callable[[float], Run]] = {
    "one": lambda gamma: one_fold(gamma),
    "leaning": lambda gamma: leaning(),
    "on 1": lambda gamma: leading_on(1),
    "on 2": lambda gamma: leading_on(2),
}


def special(run: Run, word: str) -> Special:
    """The first of this kind, or of these words."""
    return next(s for s in run.specials if s.kind == word or word in s.what)


@cache
def limit(name: str, gamma: float, word: str) -> Settled:
    """The height of a special point on elements halved twice."""
    at, found = Lowering(gamma), special(RUNS[name](gamma), word)
    values = [at.height(found.point.t)]
    for _ in range(2):
        finer = relocated(found, OPTIONS)
        assert finer is not None, (name, word, values)
        found = finer
        values.append(at.height(found.point.t))
    return settled(values, LOCATED)


def half_wave(lean: float) -> tuple[float, float, float]:
    """Length, height and thrust of the weightless half wave between flat parts whose ends lean by this angle to the
    force, in closed form (a wave of Euler's elastica from inflection to inflection): k = sin(lean / 2),
    chord / length = 2 E / K - 1, force = (4 K / length)^2."""
    k2 = math.sin(0.5 * lean) ** 2
    whole, part = float(scipy.special.ellipk(k2)), float(scipy.special.ellipe(k2))
    chord = 2.0 * part / whole - 1.0
    length = 0.5 * DELTA / (1.0 - chord * math.cos(lean))
    return length, length * chord * math.sin(lean), (4.0 * whole / length) ** 2 * math.cos(lean)


def shot_spread(gamma: float) -> float:
    """The height at which the curvature at the floor is none: by shooting, without weight in closed form."""
    if not gamma:
        lean = scipy.optimize.brentq(lambda a: half_wave(a)[0] - 0.5, 0.3, 0.9, xtol=1e-15)
        return half_wave(float(lean))[1]
    near = limit("one", gamma, SPREADS).value
    return float(scipy.optimize.brentq(lambda h: line_contact(h, DELTA, gamma).low, near - 1e-4, near + 1e-4,
                                       xtol=1e-13))  # fmt: skip


def closed_buckled() -> float:
    """The height at which a weightless flat part of all the flat length buckles, in closed form."""

    def over(lean: float) -> float:
        length, _, thrust = half_wave(lean)
        return thrust * (1.0 - 2.0 * length) ** 2 - 4.0 * math.pi**2

    return half_wave(float(scipy.optimize.brentq(over, 0.3, 1.2, xtol=1e-15)))[1]


def shot_touch(gamma: float) -> float:
    """The height at which the roof's force is none: by shooting, extrapolated from a little force; of the weightless
    arch by elliptic integrals."""
    if not gamma:
        return free_height(DELTA)
    near = limit("one", gamma, TOUCHES).value
    heights = near - np.array([4e-4, 3e-4, 2e-4, 1e-4])
    forces = [line_contact(float(h), DELTA, gamma).force for h in heights]
    return float(np.polynomial.Polynomial.fit(forces, heights, 3)(0.0))


def shape(point: Point) -> ConfinedShape:
    """As a strip."""
    assert isinstance(point.system, Confined)
    return ConfinedShape(point.system, point.z, point.t, np.zeros(3), np.eye(3), 0.2)


def neck(point: Point) -> float:
    """Of one fold that is its own mirror image: the least distance of its sides over the height, l, below the top."""
    own, s = shape(point), np.linspace(0.0, 0.5, 4001)
    places = own.plane(s)
    top = float(places[-1, 0])
    theta = own.angle(s)
    steep = np.flatnonzero((theta[:-1] > 0.5 * np.pi) != (theta[1:] > 0.5 * np.pi))
    return 2.0 * (top - float(places[steep[0], 0])) if steep.size else float("inf")


def touches_itself() -> float:
    """The height at which the sides of one fold, its own mirror image, meet below its top."""
    run = one_fold(GAMMA)
    at = Lowering(GAMMA)
    heights = [at.height(p.t) for p in run.points]
    k = next(i for i, p in enumerate(run.points) if neck(p) < 0.0)
    return float(scipy.optimize.brentq(lambda h: neck(at_height(run, GAMMA, h)), heights[k], heights[k - 1], xtol=1e-9))


def beside_ribbon(count: int, height: float) -> list[float]:
    """The roof's force, and that of the glued ribbon over it - 1 on three meshes."""
    own = at_height(one_fold(GAMMA) if count == 1 else folds(count), GAMMA, height)
    pushes = chain_of(own).pushes(own.z, GAMMA)
    force = float(pushes[np.array(chain_of(own).planes[1:-1]) == 1].sum())
    found = [press(Experiment().folded(count, height, p)) / force - 1.0 for p in (60, 120, 240)]
    return [force, *found]


def barrier(count: int, height: float) -> tuple[float, float]:
    """Energy of the hump above the flat state, and of the state with one fold more above it, D w / l."""
    at = Lowering(GAMMA)
    own = at_height(one_fold(GAMMA) if count == 1 else folds(count), GAMMA, height)
    run = leading_on(count)
    going_up = [p for p in run.points if len(chain_of(p).planes) == 2 * count + 2 and p.unstable]
    near = min(going_up, key=lambda p: abs(at.height(p.t) - height))
    hump = _first(near.system, near.z, at.t(height))  # type: ignore[arg-type]
    energy = own.system.energy(own.z, own.t)
    more = at_height(folds(count + 1), GAMMA, height)
    return hump.system.energy(hump.z, hump.t) - energy, more.system.energy(more.z, more.t) - energy


def alike(count: int) -> tuple[float, float, float]:
    """N folds alike, as one with Gamma / N^3: heights times N at which they touch and lie flat, and the roof's force
    over N^3 at i = 2.3, nan where their sides have met before."""
    gamma = GAMMA / count**3
    run = one_fold(gamma)
    at = Lowering(gamma)
    touch, spread = (at.height(special(run, word).point.t) for word in (TOUCHES, SPREADS))
    height = low() * count
    if height < touches_itself():
        return touch, spread, float("nan")
    point = at_height(run, gamma, height)
    return touch, spread, float(chain_of(point).pushes(point.z, gamma)[0])


PROBES = {
    "touch_8": lambda: Lowering(GAMMA).height(special(one_fold(GAMMA), TOUCHES).point.t),
    "spread_8": lambda: Lowering(GAMMA).height(special(one_fold(GAMMA), SPREADS).point.t),
    "fold_8": lambda: Lowering(GAMMA).height(special(leading_on(1), "fold").point.t),
}
