"""Branches: forks near each other, loops, clamps at the end of their reach, corners, many segments."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from compare import registry
from compare.battery.case import Case, Check, Rung, holds, near
from compare.scene.scene import Scene, loads
from ribbonbench.errors import BadInput

#: Greenhill's mast: 9/4 j^2, j the first zero of J_(-1/3).
_ZERO = 1.8663508587
#: Where the level arch between clamps 0.8 l apart turns into its mirror image: the shift, by AUTO-07p on the elastica
#: (results/branches_auto.md), and the error that its digits leave.
TURNS, _TURNS_ERROR = 0.473535450, 2e-8
_MAST = """
title = "Mast"
[strip]
length = 1.0
width = 0.02
poisson = 0.0
gamma = 5.0
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
tangent = [0.0, 0.0, 1.0]
normal = [-1.0, 0.0, 0.0]
[model]
energy = "wunderlich"
elements = 10
"""
_CLAMPS = """
title = "Two clamps"
[strip]
length = 1.0
width = 0.02
poisson = 0.3
gamma = 0.0
[clamp.start]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[clamp.end]
position = [0.8, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[model]
energy = "elastica"
elements = 8
[seed]
curvature = [-6.0, 6.0, -6.0]
"""
#: Shift (l) up to which the loop may go.
_FAR = 0.59
_LAYERS_OPEN = "the elastica's elements stay those of the branch's first state, which do not resolve such layers"
#: Weights that are nearer to each other may be told as one double fork.
_TOLD_APART = 1e-5
FloatArray = NDArray[np.float64]
SHIFT = "clamp.end.position[2]"


def greenhill() -> float:
    """The weight at which a mast of bending stiffness 1 falls over."""
    from scipy.optimize import brentq
    from scipy.special import jv

    zero: float = brentq(lambda z: jv(-1.0 / 3.0, z), _ZERO - 0.1, _ZERO + 0.1, xtol=1e-14)
    return 2.25 * zero**2


def _forks(scene: Scene, key: str, first: float, last: float) -> tuple[list[float], str, list[int]]:
    """Branch points of the scene's own branch, how it ends, and the counts of unstable modes along it."""
    from compare.studies.branches.run import Asked, diagram

    (own,) = diagram(scene, key, first, last, asked=Asked(branches=1, errors=False)).branches
    places = [point.parameter for point in own.points if point.kind == "branch_point"]
    return places, own.ended, [point.unstable for point in own.points if point.kind == "regular"]


def _nearly_square(apart: Rung) -> Iterator[Check]:
    """A rod whose section is nearly a square falls over to either side at nearly one weight: w/h - 1 is the rung."""
    more = float(apart)
    keys = {"model.energy": "kirchhoff", "model.stiffness": "plate", "model.elements": 40}
    scene = loads(_MAST, "mast").replace({**keys, "strip.thickness": 0.02 / (1.0 + more)})
    places, ended, unstable = _forks(scene, "strip.gamma", 5.0, 10.0)
    yield holds("it goes to the end of the range", ended == "range", ended)
    yield Check("unstable modes at the end, apart from two", abs(unstable[-1] - 2), 0.0)
    first, second = greenhill(), greenhill() * (1.0 + more) ** 2
    if second - first > _TOLD_APART:
        yield Check("forks, apart from two", abs(len(places) - 2), 0.0, said=str(places))
        yield near("the first, of Greenhill's", places[0], first, 2e-6)
        yield near("between the two, over what it is", (places[-1] - places[0]) / (second - first), 1.0, 1e-3)
    else:
        yield Check("forks, apart from one that is double or two", min(abs(len(places) - n) for n in (1, 2)), 0.0)
        yield near("the first, of Greenhill's", places[0], first, second - first + 2e-6)


def _mast(segments: Rung) -> Iterator[Check]:
    """Greenhill's mast on many segments: one fork, at 7.8373, whose error falls as their square."""
    scene = loads(_MAST, "mast").replace({"model.elements": int(segments)})
    places, ended, unstable = _forks(scene, "strip.gamma", 5.0, 10.0)
    yield holds("it goes to the end of the range", ended == "range", ended)
    yield Check("forks, apart from one", abs(len(places) - 1), 0.0, said=str(places))
    yield near("its place", places[0], greenhill(), 0.02 / int(segments) ** 2 + 2e-9)
    yield holds("stable before and not behind", unstable[0] == 0 and unstable[-1] == 1, str(unstable))


def _loop(energy: Rung) -> Iterator[Check]:
    """The arch between two level clamps, one of which is shifted: over to its mirror image at one side, and back at the
    other. It closes; both turns are at AUTO's shift."""
    from compare.continuation.correct import first_point
    from compare.continuation.follow import follow
    from compare.continuation.point import Options
    from compare.models.capabilities import Branches

    keys = {"model.energy": str(energy), "model.elements": 8 if energy == "elastica" else 60}
    level = loads(_CLAMPS, "level").replace(keys)
    model = registry.model(registry.name_for(str(energy)))
    assert isinstance(model, Branches)

    def scene_at(t: float) -> Scene:
        return level.replace({"clamp.end.position": [0.8, 0.0, _FAR * t]})

    start = model.branch_start(scene_at, None)
    first = first_point(start.system, start.z, 0.0, 1e-10)
    assert first is not None
    found = follow(first, (-1.0, 1.0), Options(steps=300))
    yield holds("it closes", found.ended == "closed", found.ended)
    turns = sorted({round(_FAR * special.point.t, 6) for special in found.specials if special.kind != "event"})
    bound = _TURNS_ERROR if energy == "elastica" else 2e-3
    yield Check("places of its special points, apart from two", abs(len(turns) - 2), 0.0, said=str(turns))
    shifts = [_FAR * special.point.t for special in found.specials if special.kind != "event"]
    yield near("the turn at one side", max(shifts), TURNS, bound)
    yield near("the turn at the other", min(shifts), -TURNS, bound)


def _layers(shift: float) -> tuple[float, float]:
    """Energy (D w / l) of an elastica between level clamps 0.8 l and `shift` apart that is nearly taut, and the part of
    it that two layers which reach into each other change.

    Along the end force of size N it is straight but for a layer at either end, phi' = -2 sqrt(N) sin(phi / 2) from the
    angle a between clamp and force. A layer is shorter along the force by 2 (1 - cos(a / 2)) / sqrt(N), lies
    2 sin(a / 2) / sqrt(N) aside of it, and stores 2 (1 - cos(a / 2)) sqrt(N); both lie to one side of the chord."""
    from scipy.optimize import fsolve

    def missed(unknowns: FloatArray) -> list[float]:
        angle, rate = unknowns
        along = 1.0 - 4.0 * (1.0 - math.cos(0.5 * angle)) / rate
        aside = 4.0 * math.sin(0.5 * angle) / rate
        return [math.hypot(along, aside) - math.hypot(0.8, shift),
                angle - math.atan2(aside, along) - math.atan2(shift, 0.8)]  # fmt: skip

    begin = math.atan2(shift, 0.8)
    rate = 4.0 * (1.0 - math.cos(0.5 * begin)) / (1.0 - math.hypot(0.8, shift))
    angle, rate = fsolve(missed, [begin, rate], xtol=1e-13)
    return 4.0 * rate * (1.0 - math.cos(0.5 * angle)), 20.0 * math.exp(-0.5 * rate)


def _reach(left: Rung) -> Iterator[Check]:
    """Level clamps 0.8 l apart, one shifted by 0.6 l less the rung: with nothing left the strip would be straight, and
    cannot be, for its ends are level."""
    from compare.studies.branches.run import Asked, diagram

    short = float(left)
    scene = loads(_CLAMPS, "level").replace(
        {"seed.curvature": [-6.0, 0.0, 6.0], "model.elements": max(40, round(0.4 / short) if short else 0)}
    )
    try:
        (own,) = diagram(scene, SHIFT, 0.5, 0.6 - short, asked=Asked(branches=1, errors=False)).branches
    except BadInput as error:
        yield holds("refused by name where nothing is left", short == 0.0 and error.key == "--to", str(error))
        return
    last = own.points[-1]
    yield holds("something is left", short > 0.0)
    yield Check("largest residual", max(p.residual for p in own.points), 1e-8)
    energy, open_ = _layers(last.parameter)
    yield near("energy there, over that of two layers", last.energy / energy, 1.0, open_ + 1e-4)
    yield holds("it goes to the end of the range", own.ended == "range", own.ended)


def _corners(stages: Rung) -> Iterator[Check]:
    """The same arch at the end of paths of one to four straight stages, followed along the last: the state there is
    that of a start of its own."""
    from compare.models import solve
    from compare.studies.branches.run import Asked, diagram

    corners = [[0.8, 0.0, 0.0], [0.8, 0.0, 0.2], [0.7, 0.0, 0.2], [0.75, 0.0, -0.1], [0.6, 0.0, 0.1]]
    count = int(stages)
    plain = loads(_CLAMPS, "corners").replace({"clamp.end.position": corners[count]})
    path = [{"clamp.end.position": place} for place in corners[:count]]
    found = diagram(plain.replace({"path": path}), "path", asked=Asked(branches=1, errors=False))
    (own,) = found.branches
    yield holds("it goes to the end of the path", own.ended == "range", own.ended)
    alone = solve(plain, "elastica")
    assert alone.shape is not None
    assert own.points[-1].shape is not None
    s = np.linspace(0.0, 1.0, 41)
    off = float(np.abs(own.points[-1].shape.centreline(s) - alone.shape.centreline(s)).max())
    yield Check("apart from the state of its own start (l)", off, 1e-7)
    yield Check("unstable modes at its end", own.points[-1].unstable, 0.0)


CASES: tuple[Case, ...] = (
    Case(
        name="branches/near",
        hard="two branch points ever nearer to each other: a mast of nearly square section, w/h - 1",
        expected="both forks, the first at Greenhill's weight, the second higher by (w/h)^2; two unstable modes behind",
        parameter="w/h - 1",
        run=_nearly_square,
        rungs=(1e-2, 1e-4, 6e-6),
        long=(1e-6, 1e-7, 1e-9, 1e-12),
    ),
    Case(
        name="branches/segments",
        hard="Greenhill's mast on 10 to 1,000 segments",
        expected="one fork, at 9/4 j^2 of the first zero of J_(-1/3), to 0.02 / p^2",
        parameter="segments",
        run=_mast,
        rungs=(10, 40),
        long=(100, 1000),
    ),
    Case(
        name="branches/loop",
        hard="a branch that closes on itself, through both its turns",
        expected="closed; the turns at AUTO-07p's shift, to its digits for the elastica, to 2e-3 for ribbons",
        parameter="model",
        run=_loop,
        rungs=("elastica",),
        long=("sadowsky", "wunderlich"),
    ),
    Case(
        name="branches/reach",
        hard="clamps that go apart to where the strip does not reach, 0.6 l less this",
        expected="up to there equilibria, at the end of the energy of two layers in tension; nothing left is refused",
        parameter="left / l",
        run=_reach,
        rungs=(0.02, 0.005),
        long=(2e-3, 1e-3, 0.0),
        known={2e-3: _LAYERS_OPEN, 1e-3: _LAYERS_OPEN},
    ),
    Case(
        name="branches/corners",
        hard="paths of straight stages with corners, followed along their last",
        expected="the state at the end is that of a start of its own, stable",
        parameter="stages",
        run=_corners,
        rungs=(1, 2),
        long=(3, 4),
    ),
)
