"""Layers of a ribbon that lie on each other in a plane: a coil, beside the planar elastica's."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ribbon import Clamp, Strip
from ribbon.find.solve import build, solve_shape
from ribbon.judge import layers, nearness, passage
from shellref.elastica.problem import ElasticaProblem
from shellref.elastica.start import natural_start, solve_along

TURNS, THICK, CURVED = 1.5, 0.01, 12.0
_MEAN, _HALF = 1.0 / (2.0 * math.pi * TURNS), 0.75 * THICK * TURNS
#: Curvatures (1/l) at both ends, of the strip wound loosely.
LOOSE = (1.0 / (_MEAN - _HALF), 1.0 / (_MEAN + _HALF))


@pytest.fixture(scope="module")
def coil():
    """Wound loosely and let go; it must not curl up through itself."""
    strip = Strip(1.0, 0.05, 0.3, natural_curvature=CURVED)
    problem = build(strip, Clamp((0, 0, 0), (1, 0, 0), (0, 1, 0)), segments=20, apart=THICK)
    return solve_shape(problem, np.linspace(*LOOSE, 21), np.zeros(21))


@pytest.fixture(scope="module")
def elastica():
    light = ElasticaProblem(curvature=(CURVED, CURVED), apart=THICK)
    return solve_along([natural_start(light, LOOSE), light], 40, 3, estimate_error=False)


def test_a_coil_that_lies_on_itself_is_the_planar_elasticas(coil, elastica):
    assert coil.residual <= 1e-8
    assert coil.status.code == "saddle"  # nothing keeps layers from sliding off each other aside
    assert not coil.problem.joint_values(coil.x)[1].any()
    assert coil.energy.total == pytest.approx(elastica.energy.total, rel=2e-5)
    push = sum(np.linalg.norm(pair.force) for pair in coil.pairs)
    assert push == pytest.approx(sum(touch.push for touch in elastica.touches), rel=2e-2)


def test_its_layers_touch_and_are_nowhere_too_near(coil):
    problem, x = coil.problem, coil.x
    push = -coil.rows[problem.block_slices()["pairs"]]
    assert push.min() >= 0.0
    assert push.max() > 1.0
    assert np.abs(push * problem.pair_rows().gaps(x)).max() < 1e-8
    assert not nearness.minima(problem, x, -nearness.TOLERANCE)
    both = {(pair.s, pair.u) for pair in problem.pairs}
    assert {(s, -u) for s, u in both} == both


def test_stations_are_joints_and_the_end_of_the_strip(coil):
    problem = coil.problem.with_changes(pairs=())
    found = layers.stations(problem, coil.x, 2.0 * THICK)
    joints = np.concatenate([[0.0], np.cumsum(problem.lengths)])
    s = np.array([pair.s for _, pair in found])
    assert np.abs(joints[:, None] - s).min(axis=0).max() < 1e-9
    assert s.max() == 1.0
    turn = np.array([abs(pair.s_other - pair.s) for _, pair in found])
    assert turn.min() > 0.3


def test_a_plane_shape_asks_for_its_middles_alone_and_finds_the_same(coil, monkeypatch):
    """Of rulings that are parallel none is nearer than the middles: as deep, and passed at the same place."""
    problem = coil.problem.with_changes(pairs=())
    deeper = problem.with_changes(apart=1.02 * THICK)
    other = coil.x.copy()
    problem.layout.positions(other)[:] *= 0.5  # parts come to half their distance, and no frame turns
    tight = problem.with_changes(apart=2.5 * THICK)

    def found():
        return nearness.minima(deeper, coil.x, -1e-5), passage.passage(tight, coil.x, tight, other)

    s = nearness.abscissae(problem, coil.x)
    here = nearness.shape(problem, coil.x, s)
    assert nearness.nearer(here.r, here.ruling, problem.reach) == 0.0
    assert nearness.nearer(here.r + 1e-3 * here.ruling * s[:, None], here.ruling, problem.reach) > problem.half_width
    fast = found()
    monkeypatch.setattr(nearness, "nearer", lambda r, ruling, half: 2.0 * half)
    slow = found()
    assert len(fast[0]) > 5
    assert [gap for gap, _ in fast[0]] == pytest.approx([gap for gap, _ in slow[0]], abs=1e-12)
    assert fast[1] == slow[1]
    assert fast[1] is not None
