"""Strands of a round rod that lie along each other: a folded rod whose ends are turned, from a point to a line.

The ends stand side by side and are turned against each other by T turns, so that the rod winds up into a ply."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon import Clamp, Strip
from ribbon.energies.section.rod import stiffnesses
from ribbon.find.continuation import follow
from ribbon.find.jointed.path import refined
from ribbon.find.jointed.rounds import Jointed, begun, settled
from ribbon.find.solve import build, solve
from ribbon.judge import nearness, strands
from ribbon.problems.itself.pairs import Pair
from tests.reference.balanced_ply import of_twist

NU, WIDTH = 0.3, 0.01
#: Both bendings alike: (1 - nu^2) (w / h)^2 = 1.
STRIP = Strip(1.0, WIDTH, NU, thickness=WIDTH * np.sqrt(1.0 - NU**2))
TORSION = stiffnesses((0.5 * WIDTH, STRIP.thickness, NU, 0.0))[1]
APART, ENDS = 0.05, 0.1


def folded(turns: float, segments: int):
    """The rod whose ends are `ENDS` apart and turned by `turns` against each other."""
    half = np.pi * turns
    binormal = (np.sin(half), np.cos(half), 0.0)
    start = Clamp((-0.5 * ENDS, 0.0, 0.0), (0.0, 0.0, 1.0), binormal)
    end = Clamp((0.5 * ENDS, 0.0, 0.0), (0.0, 0.0, -1.0), binormal)
    return build(STRIP, start, end=end, energy="kirchhoff", segments=segments, apart=APART, round_rod=True)


def wound(segments: int, stages: tuple[float, ...]):
    """Equilibria by turns, each from the one before."""
    flat = folded(0.0, segments)
    state = solve(
        STRIP, flat.start, end=flat.end, energy="kirchhoff", segments=segments, seed_curvature=1.5 * np.pi,
        apart=APART, round_rod=True,
    )  # fmt: skip
    found, at = {}, 0.0
    for turns in stages:
        state = follow(
            lambda t, a=at, b=turns: folded(a + (b - a) * t, segments), state, steps=max(1, round(10 * (turns - at)))
        )
        found[turns], at = state, turns
    return found


@pytest.fixture(scope="module")
def pointed():
    """With a place of contact, and with two."""
    return wound(50, (1.5, 2.45))


def pushes(state):
    return np.array([np.linalg.norm(pair.force) for pair in state.pairs])


def test_one_place_of_contact_becomes_two(pointed):
    one, two = pointed[1.5], pointed[2.45]
    assert one.ok
    assert two.ok
    assert len(one.pairs) == 1
    big = [pair for pair in two.pairs if np.linalg.norm(pair.force) > 1.0]
    assert big[-1].s - big[0].s > 0.02
    for state in (one, two):
        gaps = state.problem.pair_rows().values(state.x)
        push = -state.rows[state.problem.block_slices()["pairs"]]
        assert (push >= 0.0).all()
        assert np.abs(push * gaps).max() < 1e-8
        assert min((gap for gap, _ in nearness.minima(state.problem, state.x, 0.0)), default=0.0) > -nearness.TOLERANCE


def test_it_is_its_own_image_and_in_balance(pointed):
    """Turned by half a turn about the axis across both ends the rod is itself, end for start."""
    for state in pointed.values():
        s = np.linspace(0.0, 0.5, 21)
        there, back = state.position(s), state.position(1.0 - s)
        assert np.abs(there * [-1.0, -1.0, 1.0] - back).max() < 1e-6
        held = state.start.force + state.end_support.force
        assert np.abs(held).max() < 1e-6 * pushes(state).sum()


def test_the_force_does_not_depend_on_the_segments(pointed):
    """A place that slides is where it is, whatever joints there are."""
    fine = wound(70, (1.5,))[1.5]
    assert pushes(fine).sum() == pytest.approx(pushes(pointed[1.5]).sum(), rel=5e-4)
    assert fine.pairs[0].s == pytest.approx(pointed[1.5].pairs[0].s, abs=5e-5)


def test_joints_follow_and_the_error_falls_by_sixteen(pointed):
    """With joints at both places of contact a force acts within no segment: the energy's order is four."""
    equal, length = pointed[2.45], 1.0 / 50
    first = settled(folded(2.45, 50), Jointed(equal, begun(equal), length))
    places = np.array(first.touching.places)
    joints = np.cumsum(first.state.problem.lengths)
    assert len(places) == 2
    assert max(np.abs(joints - place).min() for place in places.ravel()) < 1e-3 * length  # the stated tolerance
    second = refined(folded(2.45, 50), first)
    third = refined(folded(2.45, 50), second)
    energies = np.array([each.state.energy.total for each in (first, second, third)])
    assert 10.0 < (energies[0] - energies[1]) / (energies[1] - energies[2]) < 25.0
    limit = energies[2] - (energies[1] - energies[2]) / 15.0
    assert abs(equal.energy.total - limit) > 3.0 * abs(energies[0] - limit)
    assert third.state.ok
    forces = np.array([each.pushes.sum() for each in (first, second, third)])
    assert abs(forces[1] - forces[2]) < 0.25 * abs(forces[0] - forces[1])


def test_rows_are_smooth_beyond_a_joint():
    """The foot of a station goes over to the next segment without a jump, and the slope is that of the values."""
    problem = build(STRIP, Clamp(), energy="kirchhoff", segments=40, apart=APART, round_rod=True, formulation="mixed")
    s = np.linspace(0.0, 1.0, 41)
    x = problem.state(13.0 + 0.0 * s, 2.0 + 0.0 * s)
    pair = Pair(0.1, 0.0, 0.1 + 0.487, 0.0, True, True)
    rows = problem.with_changes(pairs=(pair,)).pair_rows()
    direction = np.random.default_rng(3).normal(size=x.size)
    step = 1e-6
    slope = (rows.values(x + step * direction) - rows.values(x - step * direction)) / (2.0 * step)
    columns = rows.jacobian_structure()[1]
    assert rows.jacobian(x) @ direction[columns] == pytest.approx(slope[0], rel=1e-6, abs=1e-7)


def test_coils_that_lie_on_each_other_are_lines_and_crossings_are_places():
    """A close coil: each turn's gap to the next is a helix's, at every joint; a loop that crosses is one place."""
    problem = build(STRIP, Clamp(), energy="kirchhoff", segments=80, apart=APART, round_rod=True, formulation="mixed")
    s = np.linspace(0.0, 1.0, 81)
    bend, twist = 15.0, 1.5
    x = problem.state(bend + 0.0 * s, twist + 0.0 * s)
    rate = np.hypot(bend, twist)
    radius, rise = bend / rate**2, twist / rate  # of the helix; its rise per length
    held = strands.places(problem, x, 0.02)
    assert held
    turn = np.linspace(0.8, 1.2, 400001) * 2.0 * np.pi  # between a place and the next turn
    known = np.sqrt(4.0 * radius**2 * np.sin(0.5 * turn) ** 2 + (rise * turn / rate) ** 2).min() - APART
    stations = [(gap, pair) for gap, pair in held if pair.stays]
    assert len(stations) > 20
    for gap, pair in stations:
        assert gap == pytest.approx(known, abs=2e-6)
        assert strands.is_station(problem, pair)
    crossing = problem.state(7.5 + 0.0 * s, 4.0 * (s - 0.5))
    for _, pair in strands.places(problem, crossing, 0.2, sharp=True):
        assert not pair.stays


@pytest.mark.validate
def test_a_ply_is_that_of_least_energy():
    """Between both ends of the line the angle and the push are those of a balanced ply twisted as much."""
    segments = 120
    state = wound(segments, (2.5, 3.5, 4.5))[4.5]
    assert state.ok
    twist = abs(float(state.tau([0.5])[0]))
    known = of_twist(twist, 0.5 * APART, TORSION)
    line = [pair for pair in state.pairs if 0.19 < pair.s < 0.22]
    assert len(line) >= 3
    for pair in line:
        one, other = state.frame([pair.s, pair.s_other])[:, :, 2]
        assert 0.5 * np.arccos(-one @ other) == pytest.approx(known.angle, rel=0.02)
        assert np.linalg.norm(pair.force) * segments == pytest.approx(known.push, rel=0.05)
