"""Clamps at the end of their reach: pulled nearly straight, and nearly straight from the beginning."""

from __future__ import annotations

import math
from collections.abc import Iterator

from compare.battery.case import Case, Check, Rung, holds, near
from compare.battery.cases.branches.scenes import CLAMPS, SHIFT
from compare.battery.judge.turning import turning
from compare.scene.scene import loads
from ribbonbench.errors import BadInput

#: Length (l) that is left, from which a branch may end before it is gone: rounding of the layers.
_ROUNDED = 1e-7


def _layers(shift: float) -> tuple[float, float]:
    """Energy (D w / l) of an elastica between level clamps 0.8 l and `shift` apart that is nearly taut, and the part of
    it that two layers which reach into each other change.

    Along the end force of size N it is straight but for a layer at either end, phi' = -2 sqrt(N) sin(phi / 2) from the
    angle a between clamp and force. A layer is shorter along the force by 2 (1 - cos(a / 2)) / sqrt(N), lies
    2 sin(a / 2) / sqrt(N) aside of it, and stores 2 (1 - cos(a / 2)) sqrt(N); both lie to one side of the chord."""
    chord = angle = math.atan2(shift, 0.8)
    short = (0.6 - shift) * (0.6 + shift)  # 1 - distance^2 = 8 (1 - cos(a / 2)) (1 / rate - 4 / rate^2)
    for _ in range(100):
        bent = 1.0 - math.cos(0.5 * angle)
        width = 0.25 * short / bent / (1.0 + math.sqrt(1.0 - 2.0 * short / bent))
        angle = chord + math.atan2(4.0 * math.sin(0.5 * angle) * width, 1.0 - 4.0 * bent * width)
    return 4.0 * bent / width, 20.0 * math.exp(-0.5 / width)


def _reach(left: Rung) -> Iterator[Check]:
    """Level clamps 0.8 l apart, one shifted by 0.6 l less the rung: with nothing left the strip would be straight, and
    cannot be, for its ends are level."""
    from compare.studies.branches.run import Asked, diagram

    short = float(left)
    scene = loads(CLAMPS, "level").replace({"seed.curvature": [-6.0, 0.0, 6.0]})
    try:
        (own,) = diagram(scene, SHIFT, 0.5, 0.6 - short, asked=Asked(branches=1, errors=False)).branches
    except BadInput as error:
        yield holds("refused by name where nothing is left", short == 0.0 and error.key == "--to", str(error))
        return
    last = own.points[-1]
    yield holds("something is left", short > 0.0)
    yield Check("largest residual", max(p.residual for p in own.points), 1e-8)
    energy, open_ = _layers(last.parameter)
    yield near("energy there, over that of two layers", last.energy / energy, 1.0, open_ + 1e-6)
    early = short < _ROUNDED and own.ended in ("stuck", "unresolved")
    yield holds("it goes to the end, or as far as rounding", own.ended == "range" or early, own.ended)


def _shallow(short: Rung) -> Iterator[Check]:
    """An arch between level clamps that are all but 1 l apart, one of them shifted: over into its mirror image at the
    shift that shooting gives, within the error that is stated of it; level it carries Euler's load."""
    from scipy.optimize import brentq
    from scipy.special import ellipe, ellipk

    from compare.models.elastica.shape import ElasticaShape
    from compare.studies.branches.run import Asked, diagram

    less = float(short)
    span = math.sqrt(less * (2.0 - less))
    scene = loads(CLAMPS, "level").replace({"clamp.end.position": [1.0 - less, 0.0, 0.0]})
    (own,) = diagram(scene, SHIFT, 0.0, 0.99 * span, asked=Asked(branches=1)).branches
    places = [point for point in own.points if point.kind == "branch_point"]
    yield Check("forks, apart from one", abs(len(places) - 1), 0.0, said=str(len(places)))
    limit = places[0].settled
    assert limit is not None
    yield holds("its place settles on finer elements", limit.settles, limit.text)
    expected = turning(less)
    yield near("its place, over the reach", limit.value / span, expected / span, 5e-9)
    yield Check("its place, off by how many times the stated error", abs(limit.value - expected) / limit.error, 1.0)
    last = own.points[-1].shape
    assert isinstance(last, ElasticaShape)
    part = brentq(lambda m: 2.0 * (1.0 - ellipe(m) / ellipk(m)) - less, 1e-14, 0.9, xtol=1e-18)
    load = 16.0 * float(ellipk(part)) ** 2
    yield near("load when it is level again (relative)", -last.result.forces.end[0] / load, 1.0, 1e-7)


CASES: tuple[Case, ...] = (
    Case(
        name="branches/reach",
        hard="clamps that go apart to where the strip does not reach, 0.6 l less this",
        expected="up to there equilibria, at the end of the energy of two layers in tension; nothing left is refused",
        parameter="left / l",
        run=_reach,
        rungs=(0.02, 0.005),
        long=(2e-3, 1e-3, 1e-4, 1e-6, 1e-8, 0.0),
    ),
    Case(
        name="branches/shallow",
        hard="an arch between clamps all but l apart, pushed aside until it turns over",
        expected="the fork where shooting has it, within its stated error; Euler's load 16 K(m)^2 when level",
        parameter="shortening / l",
        run=_shallow,
        rungs=(0.1, 1e-3),
        long=(1e-2, 1e-4, 1e-5, 1e-6, 1e-7),
    ),
)
