"""A round rod that touches itself: what a step may not pass through, and where a twisted rod goes when it snaps."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon import Clamp, Strip
from ribbon.energies.section.rod import stiffnesses
from ribbon.find import snap
from ribbon.find.continuation import anchored, follow
from ribbon.find.solve import build, solve
from ribbon.find.solving.request import How
from ribbon.judge import nearness
from ribbon.judge.passage import passage
from tests.reference import touching_ring

NU, WIDTH, THICK = 0.3, 0.01, 0.04
#: Both bendings alike: (1 - nu^2) (w / h)^2 = 1.
STRIP = Strip(1.0, WIDTH, NU, thickness=WIDTH * np.sqrt(1.0 - NU**2))
TORSION = stiffnesses((0.5 * WIDTH, STRIP.thickness, NU, 0.0))[1]
CRITICAL = 2.0 * np.pi * np.sqrt(3.0) / TORSION


def clamps(turn: float) -> tuple[Clamp, Clamp]:
    end = Clamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (np.sin(turn), np.cos(turn), 0.0))
    return Clamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)), end


def ring(turn: float, **keywords):
    start, end = clamps(turn)
    return build(STRIP, start, end=end, energy="kirchhoff", segments=40, **keywords)


@pytest.fixture(scope="module")
def twisted():
    """Michell's ring shortly before its critical turn."""
    start, end = clamps(0.0)
    state = solve(
        STRIP, start, end=end, energy="kirchhoff", segments=40, seed_curvature=2.0 * np.pi, apart=THICK, round_rod=True
    )
    return follow(lambda t: ring(0.99 * CRITICAL * t, apart=THICK, round_rod=True), state, steps=40)


def test_before_it_snaps_nothing_touches_and_it_is_a_circle(twisted):
    assert twisted.ok
    assert twisted.pairs == ()
    known = 2.0 * np.pi**2 + 0.5 * TORSION * (0.99 * CRITICAL) ** 2
    assert twisted.energy.total == pytest.approx(known, rel=1e-4)


def test_a_ring_turned_by_two_turns_less_went_through_itself(twisted):
    """The same circle, and no place of it is anywhere else: frames alone tell."""
    other = ring(0.99 * CRITICAL - 4.0 * np.pi, apart=THICK, round_rod=True)
    few = solve_circle(other)
    assert passage(twisted.problem, twisted.x, twisted.problem, twisted.x) is None
    found = passage(few.problem, few.x, twisted.problem, twisted.x)
    assert found is not None
    assert np.isnan(found.distance)


def solve_circle(problem):
    start = problem.start
    return solve(
        STRIP, start, end=problem.end, energy="kirchhoff", segments=40, seed_curvature=2.0 * np.pi, apart=THICK,
        round_rod=True,
    )  # fmt: skip


def test_strands_that_change_sides_pass(twisted):
    """A helix of one turn and a bit, its end pushed through its beginning."""
    problem = build(STRIP, Clamp(), energy="kirchhoff", segments=40, apart=0.02, round_rod=True, formulation="mixed")
    s = np.linspace(0.0, 1.0, 41)
    above, below = (problem.state(7.5 + 0.0 * s, twist + 0.0 * s) for twist in (0.5, -0.5))
    found = passage(problem, above, problem, below)
    assert found is not None
    assert found.s < found.s_other
    assert found.distance < 0.25 * 0.02
    assert passage(problem, above, problem, problem.state(7.5 + 0.0 * s, 0.45 + 0.0 * s)) is None


def test_places_that_a_step_lays_upon_each_other_are_seen_whatever_the_samples():
    """A flat coil of more than a turn, reached from a helix: nothing tells the side of places that are one."""
    problem = build(STRIP, Clamp(), energy="kirchhoff", segments=40, apart=1e-4, round_rod=True, formulation="mixed")
    s = np.linspace(0.0, 1.0, 41)
    helix, flat = (problem.state(7.5 + 0.0 * s, twist + 0.0 * s) for twist in (0.5, 0.0))
    (gap, pair), *_ = nearness.minima(problem, helix, 0.1)
    assert gap > 0.01
    near = problem.with_changes(pairs=(pair,))
    assert snap.fell(near, helix, flat)
    assert near.pair_rows().gaps(flat)[0] < -0.5 * problem.apart
    assert not snap.fell(near, flat, flat)
    assert not snap.fell(near, helix, helix)


def test_where_nothing_is_kept_apart_a_strip_goes_downhill_as_it_is():
    """From the shape of a second arch to the first; nothing passes, whatever the way."""
    strip, end = Strip(1.0, 0.02, NU, thickness=0.001), Clamp((0.0, 0.0, 0.8), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
    problem = build(strip, Clamp(), end=end, energy="finite", segments=20, formulation="mixed")
    s = np.linspace(0.0, 1.0, 21)
    begin = problem.state(3.0 * np.sin(4.0 * np.pi * s) + 3.0 * np.cos(4.0 * np.pi * s), 0.01 + 0.0 * s)
    with np.errstate(divide="raise"):
        state = snap.landed(problem, begin, How())
    known = solve(strip, Clamp(), end=end, segments=20, energy="finite")
    assert state.ok
    assert state.pairs == ()
    assert state.energy.total == pytest.approx(known.energy.total)
    assert passage(problem, begin, problem, state.x) is None


def rod(turn: float, z: float):
    end = Clamp((0.0, 0.0, z), (0.0, 0.0, 1.0), (np.sin(turn), np.cos(turn), 0.0))
    return build(STRIP, Clamp(), end=end, energy="kirchhoff", segments=40, apart=0.02, round_rod=True)


@pytest.mark.validate
def test_a_twisted_rod_whose_ends_come_together_snaps_into_a_loop_that_lies_on_itself():
    """Two turns; without contact it would go on through itself. On 60 elements the push is 53.13."""
    turn = 4.0 * np.pi
    end = Clamp((0.0, 0.0, 0.9), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
    state = solve(STRIP, Clamp(), end=end, energy="kirchhoff", segments=40, apart=0.02, round_rod=True)
    state = follow(lambda t: rod(turn * t, 0.9), state, steps=25)
    state = follow(lambda t: rod(turn, 0.9 - 0.4 * t), state, steps=20)
    assert state.pairs == ()
    bent = state.energy.total
    state = snap.landed(anchored(rod(turn, 0.492), state), state.x, How())
    assert state.ok
    assert state.energy.total < bent - 1.5
    push = sum(float(np.linalg.norm(pair.force)) for pair in state.pairs)
    assert push == pytest.approx(53.2, rel=0.02)
    for pair in state.pairs:
        assert pair.s + pair.s_other == pytest.approx(1.0, abs=0.05)  # along the rod it slides at next to no energy
        assert pair.gap == pytest.approx(0.02, abs=1e-8)
    assert min(gap for gap, _ in nearness.minima(state.problem, state.x, 0.01)) > -nearness.TOLERANCE
    assert np.abs(state.start.force + state.end_support.force).max() < 1e-5 * push


@pytest.mark.validate
def test_a_ring_beyond_its_critical_turn_touches_itself_at_two_places_and_going_back_at_one():
    """Beside shooting, C / B = 0.6183, diameter 0.02; on 40 segments forces between joints cost some 1e-3."""
    critical = 2.0 * np.pi * np.sqrt(3.0) / TORSION
    at = {"apart": 0.02, "round_rod": True}
    start, end = clamps(0.0)
    state = solve(STRIP, start, end=end, energy="kirchhoff", segments=40, seed_curvature=2.0 * np.pi, **at)
    state = follow(lambda t: ring(-0.999 * critical * t, **at), state, steps=16)
    layout = state.problem.layout
    places, mode = layout.positions(state.x), layout.positions(state.mode)
    side = np.sign(mode[20] @ places[20]) * 0.004 / np.abs(mode).max()  # the seam becomes the apex of a loop
    state = snap.landed(anchored(ring(-1.002 * critical, **at), state), state.x + side * state.mode, How())
    assert state.ok
    assert state.lowest_eigenvalue > 0.01
    assert np.abs(state.rows[state.problem.block_slices()["gauge_ring"]]).max() < 1e-6
    begin, known, seen = -1.002 * critical, shot(1.002 * critical, 2), [(state, 2)]
    for turn, places in ((14.5, 1),):
        seen.append((follow(lambda t, b=turn: ring(begin + (-b - begin) * t, **at), state, steps=12), places))
    for (state, places), turn in zip(seen, (1.002 * critical, 14.5), strict=True):
        known = shot(turn, places)
        assert state.ok
        assert state.energy.total == pytest.approx(known.energy, rel=1e-4)
        push = [float(np.linalg.norm(pair.force)) for pair in state.pairs]
        assert [f for f in push if f > 1e-3 * max(push)] == pytest.approx([known.force] * places, rel=3e-3)


def shot(turn: float, places: int) -> touching_ring.Ring:
    """A quarter of the ring by shooting, followed from where it is known for C / B = 2/3."""
    guess = (0.196, -0.008, 4.1, -86.63, 30.97) if places == 1 else (
        0.20908, -1.10255, 6.48049, -19.34, 167.567, 0.2308, 201.19,
    )  # fmt: skip
    v, apex, before = np.array(guess), 17.0 if places == 1 else 22.01, None
    for c in np.linspace(2.0 / 3.0, TORSION, 6):
        v = touching_ring.ring(apex, c, 0.02, v, places, chords=20).unknowns
    while True:
        found = touching_ring.ring(apex, TORSION, 0.02, v, places, chords=60)
        if before is not None and (before.turn - turn) * (found.turn - turn) <= 0.0:
            return touching_ring.of_turn(turn, TORSION, 0.02, before.unknowns, (before.apex, apex), places)
        before, v = found, found.unknowns
        apex += 0.1 if found.turn < turn else -0.1
