"""A strip between floor and roof, its places of contact unknowns: derivatives, events against shooting on Roman's
elastica, Hamilton's function, virtual work, and the minimiser on the glued ribbon."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from compare.continuation.correct import first_point
from compare.continuation.follow import follow
from compare.continuation.point import Options, Point, Run
from ribbon.find.branch.chain import FLOOR, ROOF, Chain, Setting
from ribbon.find.branch.confined import Confined
from ribbon.find.branch.folds import HUMP, arch, humped, waves
from tests.validation.ribbon.roman import Experiment, free_height, line_contact, plane_contact, press

DELTA, GAMMA, ELEMENTS = 0.1, 10.0, 8
TOP, LOW = 0.21, 0.06


def setting_at(gamma):
    return lambda t: Setting(TOP + t * (LOW - TOP), DELTA, gamma)


def height(point: Point) -> float:
    return TOP + point.t * (LOW - TOP)


def t_of(roof: float) -> float:
    return (TOP - roof) / (TOP - LOW)


@cache
def fold(gamma: float, last: float = 0.1) -> Run:
    """One fold, from the free arch down."""
    own, z = arch(setting_at(gamma)(0.0), ELEMENTS)
    point = first_point(Confined(setting_at(gamma), own), z, 0.0, 1e-10)
    return follow(point, (0.0, t_of(last)), Options())


def special(run: Run, word: str) -> Point:
    (found,) = [one.point for one in run.specials if word in one.what or one.kind == word]
    return found


def test_it_is_a_function_with_exact_derivatives():
    rng = np.random.default_rng(0)
    given = Setting(0.19, DELTA, GAMMA)
    for planes, flat in (((0, 1, 0), False), ((0, 1, 1, 0, 1, 0, 0), True)):
        own = Chain(planes, flat, 2)
        z = 0.3 * rng.normal(size=own.size)
        z[own.angles : own.angles + own.arcs] = 0.3 + 0.1 * rng.random(own.arcs)
        matrix, step = own.jacobian(z, given), 1e-6
        differenced = np.array([
            (own.residual(z + step * e, given) - own.residual(z - step * e, given)) / (2.0 * step)
            for e in np.eye(own.size)
        ])  # fmt: skip
        assert matrix == pytest.approx(differenced, abs=3e-7)
        assert matrix == pytest.approx(matrix.T, abs=1e-12)
        rows = own.residual(z, given)[own.angles + own.arcs :]

        def lagrangian(y, own=own):
            r = own.residual(y, given)[own.angles + own.arcs :]
            return own.energy(y, given) + y[own.angles + own.arcs :] @ r

        slope = np.array([
            (lagrangian(z + step * e) - lagrangian(z - step * e)) / (2.0 * step) for e in np.eye(own.size)
        ])  # fmt: skip
        assert own.residual(z, given) == pytest.approx(slope, abs=3e-7)
        assert rows.size == own.rows


@pytest.mark.parametrize("gamma", [0.0, GAMMA])
def test_events_of_one_fold_are_where_shooting_has_them(gamma):
    run = fold(gamma)
    assert run.ended == "range"
    touches, spreads = height(special(run, "touches the roof")), height(special(run, "spread into flat parts"))
    if gamma:
        assert 0.0 < line_contact(touches - 1e-6, DELTA, gamma).force < 0.05  # next to none there
        low = [line_contact(spreads + side, DELTA, gamma).low for side in (3e-6, -3e-6)]
        assert low[0] > 0.0 > low[1]
    else:
        assert touches == pytest.approx(free_height(DELTA), abs=1e-8)
        left = [1.0 - 2.0 * plane_contact(spreads + side, DELTA).length for side in (3e-6, -3e-6)]
        assert left[0] < 0.0 < left[1]


def test_without_weight_a_flat_part_buckles_where_shooting_says_and_the_count_says_so():
    run = fold(0.0)
    found = special(run, "buckles")
    halves = [plane_contact(height(found) + side, DELTA) for side in (3e-6, -3e-6)]
    loads = [half.thrust * (1.0 - 2.0 * half.length) ** 2 for half in halves]
    assert loads[0] < 4.0 * np.pi**2 < loads[1]
    assert {p.unstable for p in run.points if p.arc < found.arc} == {0}
    assert {p.unstable for p in run.points if p.arc > found.arc} == {1}


def test_under_weight_it_does_not_and_hamiltons_function_is_the_same_at_all_places():
    run = fold(GAMMA)
    assert {p.unstable for p in run.points} == {0}
    for point in run.points:
        own, ends = point.system.chain, np.array([0.0, 1.0])
        if own.arcs < 2:
            continue
        roof, floor = own.curvature(point.z, 0, ends)[1], own.curvature(point.z, 0, ends)[0]
        assert 0.5 * roof**2 - GAMMA * height(point) == pytest.approx(0.5 * floor**2, abs=2e-2)
        if own.flat:
            assert roof == pytest.approx(-np.sqrt(2.0 * GAMMA * height(point)), rel=1e-2)


def test_pushes_are_what_lowering_the_roof_costs():
    point, step = fold(GAMMA).points[-1], 1e-4
    energies = []
    for sign in (1.0, -1.0):
        beside = first_point(point.system, point.z, point.t + sign * step, 1e-11)
        energies.append(beside.system.energy(beside.z, beside.t))
    per_height = (energies[0] - energies[1]) / (2.0 * step * (TOP - LOW))
    assert float(point.system.chain.pushes(point.z, GAMMA)[0]) == pytest.approx(per_height, rel=1e-5)


def test_the_minimiser_on_the_glued_ribbon_has_the_same_fold():
    at = Experiment(segments=60).folded(1, 0.165, 60)
    own = first_point(fold(GAMMA).points[-2].system, fold(GAMMA).points[-2].z, t_of(0.165), 1e-10)
    assert at.ok
    assert press(at) == pytest.approx(float(own.system.chain.pushes(own.z, GAMMA)[0]), rel=3e-3)
    assert at.energy.total == pytest.approx(own.system.energy(own.z, own.t), rel=1e-3)


def test_a_hump_is_that_of_a_line_on_its_bed_and_leads_to_two_folds():
    flat = fold(GAMMA).points[-1]
    system, z = humped(flat.system, flat.z, flat.t)
    hump = first_point(system, z, flat.t, 1e-10, -1.0)
    assert hump.unstable == 1
    thrust = -system.chain.tension(hump.z)
    assert system.chain.lengths(hump.z)[-1] == pytest.approx(2.0 * HUMP / np.sqrt(thrust), rel=1e-4)
    barrier = system.energy(hump.z, flat.t) - flat.system.energy(flat.z, flat.t)
    assert 0.0 < barrier < 1e-2
    run = follow(hump, (0.0, 1.0), Options(), lambda p: height(p) > 0.0873)
    kinds = [one.what or one.kind for one in run.specials]
    assert [kind.split(" at ")[0] for kind in kinds] == [
        "the flat parts have become places", "fold", "touches the roof",
        "contacts with the floor spread into flat parts",
    ]  # fmt: skip
    assert [one.change for one in run.specials] == [0, -1, 0, 0]
    last = run.points[-1]
    assert last.system.chain.planes == (FLOOR, ROOF, FLOOR, ROOF, FLOOR)
    own, z = waves(setting_at(GAMMA)(t_of(0.093)), 2, ELEMENTS)
    alike = first_point(Confined(setting_at(GAMMA), own), z, t_of(0.093), 1e-10)
    alike = follow(alike, (0.0, last.t), Options()).points[-1]
    assert last.system.energy(last.z, last.t) == pytest.approx(alike.system.energy(alike.z, alike.t), rel=1e-9)


def test_without_weight_what_has_buckled_leads_over_a_fold_to_two_folds():
    buckles = special(fold(0.0), "buckles")
    above = height(buckles) + 7e-4
    own = min(fold(0.0).points, key=lambda p: abs(height(p) - above))
    flat = first_point(Confined(setting_at(0.0), own.system.chain), own.z, t_of(above), 1e-10)
    system, z = humped(flat.system, flat.z, flat.t, 0.1)
    hump = first_point(system, z, flat.t, 1e-10, -1.0)
    assert (flat.unstable, hump.unstable) == (0, 1)
    run = follow(hump, (0.0, 1.0), Options(), lambda p: len(p.system.chain.planes) < 5)
    turns, touches = run.specials
    assert (turns.kind, turns.change) == ("fold", -1)
    assert height(turns.point) > above
    assert height(touches.point) == pytest.approx(0.5 * free_height(DELTA), abs=1e-6)
