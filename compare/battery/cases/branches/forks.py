"""Forks ever nearer to each other, a double one, forks on few and many segments: Greenhill's mast."""

from __future__ import annotations

from collections.abc import Iterator

from compare.battery.case import Case, Check, Rung, holds, near
from compare.battery.cases.branches.scenes import MAST
from compare.scene.scene import Scene, loads

#: Greenhill's mast: 9/4 j^2, j the first zero of J_(-1/3).
_ZERO = 1.8663508587
#: Weights that are nearer to each other may be told as one double fork.
_TOLD_APART = 1e-5
#: Stiffness in shear and stretch (Y I / l^2) of a rod that is all but Kirchhoff's.
_STIFF = 1e7


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
    scene = loads(MAST, "mast").replace({**keys, "strip.thickness": 0.02 / (1.0 + more)})
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
    scene = loads(MAST, "mast").replace({"model.elements": int(segments)})
    places, ended, unstable = _forks(scene, "strip.gamma", 5.0, 10.0)
    yield holds("it goes to the end of the range", ended == "range", ended)
    yield Check("forks, apart from one", abs(len(places) - 1), 0.0, said=str(places))
    yield near("its place", places[0], greenhill(), 0.02 / int(segments) ** 2 + 2e-9)
    yield holds("stable before and not behind", unstable[0] == 0 and unstable[-1] == 1, str(unstable))


def _square(torsion: Rung) -> Iterator[Check]:
    """A rod of square section falls over to every side at one weight: one fork with two null vectors. What leaves it is
    a circle of branches, turned about the mast, of which one is followed: stable, and the planar elastica's."""
    from compare.studies.branches.run import Asked, diagram

    rod = {"rod.bending": [1.0, 1.0], "rod.torsion": float(torsion), "rod.shear": [_STIFF] * 2, "rod.stretch": _STIFF}
    scene = loads(MAST, "mast").replace({**rod, "model.energy": "antman", "model.elements": 12})
    asked = Asked(branches=4, errors=False)
    own, *others = diagram(scene, "strip.gamma", 7.0, 10.0, asked=asked).branches
    forks = [point for point in own.points if point.kind == "branch_point"]
    yield Check("forks, apart from one", abs(len(forks) - 1), 0.0, said=str([p.parameter for p in forks]))
    yield Check("null vectors of it, apart from two", abs(len(forks[0].critical) - 2), 0.0)
    yield near("its place", forks[0].parameter, greenhill(), 2e-5)
    regular = [point.unstable for point in own.points if point.kind == "regular"]
    yield Check("unstable modes at the end, apart from two", abs(regular[-1] - 2), 0.0)
    yield Check("branches that leave, apart from one", abs(len(others) - 1), 0.0)
    yield holds("it stands for a circle", others[0].circle)
    yield Check("its unstable modes beside the turn", max(point.unstable for point in others[0].points), 0.0)
    plane = loads(MAST, "mast").replace({"model.energy": "elastica"})
    _, fallen, *_ = diagram(plane, "strip.gamma", 7.0, 10.0, asked=asked).branches
    yield near("its energy at the end, the elastica's", others[0].points[-1].energy, fallen.points[-1].energy, 2e-5)


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
        name="branches/square",
        hard="square symmetry: a mast of square section, whose fork has a double eigenvalue",
        expected="one fork at Greenhill's weight with two null vectors, left by a circle of the elastica's branches",
        parameter="torsional stiffness / Y I",
        run=_square,
        rungs=(0.8,),
        long=(0.1, 3.0),
    ),
)
