"""A planar elastica whose layers lie on each other: derivatives, a closed form of its tension, and shooting."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from shellref.elastica.contact.barrier import Barrier
from shellref.elastica.contact.layers import Layers, complementary
from shellref.elastica.contact.places import Moving
from shellref.elastica.contact.rows import Beside, Pair, evaluated
from shellref.elastica.contact.rows import slid as slid_alone
from shellref.elastica.contact.stations import Gaps, beside, slid
from shellref.elastica.held import natural_state
from shellref.elastica.problem import ElasticaProblem, LoadPath
from shellref.elastica.result import ElasticaResult
from shellref.elastica.start import natural_start, solve_along
from shellref.elastica.system import System
from tests.reference.touching_fold import folds

TURNS, APART, CURVED = 2.5, 0.01, 20.0


def loose(problem: ElasticaProblem, turns: float, apart: float) -> ElasticaProblem:
    """The strip wound loosely: a spiral, clear of itself."""
    mean, half = 1.0 / (2.0 * math.pi * turns), 0.75 * apart * turns
    return natural_start(problem, (1.0 / (mean - half), 1.0 / (mean + half)))


@cache
def coil(elements: int) -> ElasticaResult:
    problem = ElasticaProblem(curvature=(CURVED, CURVED), apart=APART)
    return solve_along([loose(problem, TURNS, APART), problem], elements, 3, estimate_error=False)


def test_many_gaps_are_those_one_by_one_with_their_derivatives() -> None:
    barrier = Barrier((0.0, 0.075), 0.05)
    problem = ElasticaProblem(curvature=(CURVED, CURVED), apart=APART, barriers=(barrier,))
    nodes = np.linspace(0.0, 1.0, 31)
    system = System(nodes, 3, LoadPath(loose(problem, TURNS, APART), problem))
    z = natural_state(system)
    moving = Moving(system.discrete, 3, z)
    stations = beside(moving, nodes, nodes, APART, (barrier,), 0.05)
    gaps = Gaps(moving, stations, APART, (barrier,))
    assert (stations.barrier < 0).sum() > 10
    assert (stations.barrier == 0).sum() > 2
    pushes = np.random.default_rng(1).normal(size=len(stations.s))
    bent = np.zeros((moving.size, moving.size))
    for k, (s, foot, side, number) in enumerate(
        zip(stations.s, stations.foot, stations.side, stations.barrier, strict=True)
    ):
        row = Pair(s, foot, side, APART, True) if number < 0 else Beside(s, barrier, 0, True)
        alone = slid_alone(moving, row)
        assert alone is not None
        one = evaluated(moving, alone)
        assert one.gap == pytest.approx(gaps.gap[k], abs=1e-13)
        np.testing.assert_allclose(one.slope, gaps.slope[k], atol=1e-12)
        assert one.bend is not None
        bent += pushes[k] * one.bend
    np.testing.assert_allclose(gaps.bent(pushes), bent, atol=1e-12)
    way, step = np.random.default_rng(2).normal(size=moving.size), 1e-5

    def at(sign: float) -> Gaps:
        there = Moving(system.discrete, 3, z + sign * step * way)
        return Gaps(there, slid(there, stations)[0], APART, (barrier,))

    ahead, back = at(1.0), at(-1.0)
    np.testing.assert_allclose((ahead.gap - back.gap) / (2.0 * step), gaps.slope @ way, atol=1e-8)
    np.testing.assert_allclose(pushes @ (ahead.slope - back.slope) / (2.0 * step), bent @ way, atol=1e-7)


def test_a_coil_lies_on_itself_and_nothing_is_too_near() -> None:
    found = coil(30)
    assert found.stable
    assert found.load_factor == 1.0
    assert len(found.touches) > 20
    assert found.through is not None
    assert found.through < 1e-6
    assert max(touch.push * abs(touch.gap) for touch in found.touches) < 1e-8
    assert abs(found.energy.total - coil(60).energy.total) < 2e-6 * abs(found.energy.total)


def test_the_tension_of_a_coil_is_what_its_curvature_says() -> None:
    """Pushes across a strip of one natural curvature K leave T + theta'^2 / 2 as it is (dT/ds = - theta' theta'',
    both from balance): K^2 / 2 and the tension at the free end."""
    found = coil(60)
    s = 0.5 * (found.nodes[3:-4] + found.nodes[4:-3])  # within elements: curvature has kinks at joints
    force = np.zeros((len(s), 2))
    for touch in found.touches:
        force += np.where(s < touch.s, 1.0, 0.0)[:, None] * touch.force
        if touch.other is not None:
            force -= np.where(s < touch.other, 1.0, 0.0)[:, None] * touch.force
    theta, step = found.angle(s), 1e-4
    bent = (found.angle(s + step) - found.angle(s - step)) / (2.0 * step)
    tension = np.cos(theta) * force[:, 0] + np.sin(theta) * force[:, 1]
    last = [touch for touch in found.touches if touch.other == 1.0]
    end = sum(
        -touch.force[0] * math.cos(found.theta[-1]) - touch.force[1] * math.sin(found.theta[-1]) for touch in last
    )
    assert last
    assert np.abs(tension).max() > 20.0
    off = np.abs(tension + 0.5 * bent**2 - 0.5 * CURVED**2 - end)
    assert np.median(off) < 0.1
    assert off.max() < 1.0


def test_a_fold_pushes_as_by_shooting() -> None:
    """Both ends held, from a fold that is clear of itself to one whose sides meet, in one step."""

    def between(z: float) -> ElasticaProblem:
        return ElasticaProblem(end=(z, 0.0), end_angle=0.0, apart=0.02)

    (known,) = folds(np.array([0.12]), 0.02)
    begin = solve_along([natural_start(between(0.5), (2.0, 2.0)), between(0.5), between(0.2)], 40, 3,
                        estimate_error=False)  # fmt: skip
    system = System(begin.nodes, 3, LoadPath(between(0.2), between(0.12)))
    z = np.zeros(system.size)
    z[: system.count] = system.discrete.projected(
        begin.angle(system.discrete.s.ravel()).reshape(system.discrete.s.shape)
    )
    z[system.count :] = begin.forces.end
    found = Layers(system, 3, 1e-9).settle(z)
    assert found.found
    assert float(found.pushes.sum()) == pytest.approx(known.push, rel=2e-3)


def test_pushes_are_complementary_where_rows_are_alike() -> None:
    draw = np.random.default_rng(3)
    for _ in range(20):
        rows = draw.normal(size=(30, 12))  # more rows than unknowns: a singular matrix
        matrix, gap = rows @ rows.T, rows @ draw.normal(size=12) + 0.5
        found = complementary(matrix, gap, np.zeros(30, dtype=bool))
        left = gap + matrix @ found
        assert found.min() >= 0.0
        assert left.min() > -1e-6
        assert abs(found @ left) < 1e-5
