"""What a round rod may do for nothing is held by rows, and by none where it costs something."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ribbon import Clamp, Strip, Wall
from ribbon.energies.section.rod import stiffnesses
from ribbon.find.continuation import follow
from ribbon.find.solve import build, solve
from ribbon.judge import reduction

NU, WIDTH, THICK = 0.3, 0.01, 0.03
#: Both bendings alike: (1 - nu^2) (w / h)^2 = 1.
STRIP = Strip(1.0, WIDTH, NU, thickness=WIDTH * np.sqrt(1.0 - NU**2))
TORSION = stiffnesses((0.5 * WIDTH, STRIP.thickness, NU, 0.0))[1]
ROUND = {"energy": "kirchhoff", "apart": THICK, "round_rod": True}
AT, ALONG = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def end(turn: float, z: float) -> Clamp:
    return Clamp((0.0, 0.0, z), ALONG, (-np.sin(turn), np.cos(turn), 0.0))


def ring(turn: float, segments: int):
    return build(STRIP, Clamp(), end=end(turn, 0.0), segments=segments, **ROUND)


def circle(turn: float, segments: int):
    """The circle twisted evenly: an equilibrium at any turn."""
    state = solve(STRIP, Clamp(), end=end(0.0, 0.0), segments=segments, seed_curvature=2.0 * np.pi, **ROUND)
    return follow(lambda t: ring(turn * t, segments), state, steps=16)


def test_a_bowed_rod_does_not_turn_about_its_axis():
    """Without contact asked for its lowest eigenvalue is that motion's zero; with it the next one."""
    bare = solve(STRIP, Clamp(), end=end(0.5, 0.8), segments=20, energy="kirchhoff")
    state = solve(STRIP, Clamp(), end=end(0.5, 0.8), segments=20, **ROUND)
    assert "gauge_ring" not in bare.problem.blocks()
    assert abs(bare.lowest_eigenvalue) < 1e-5
    assert state.ok
    assert state.lowest_eigenvalue > 0.05
    assert state.energy.total == pytest.approx(bare.energy.total, abs=1e-9)
    assert np.abs(state.rows[state.problem.block_slices()["gauge_ring"]]).max() < 1e-7


@pytest.mark.parametrize("segments", [24, 25])
def test_critical_turn_of_a_ring_is_one_simple_zero(segments):
    """2 pi sqrt(3) over the torsional stiffness (Michell 1889)."""
    exact = 2.0 * np.pi * np.sqrt(3.0) / TORSION
    states = [circle(part * exact, segments) for part in (0.997, 0.999)]
    low, high = (state.lowest_eigenvalue for state in states)
    assert low > high > 0.0
    part = 0.999 + 0.002 * high / (low - high)
    assert part == pytest.approx(1.0, abs=2e-3)
    assert states[1].unstable_modes == 0


def test_no_row_where_it_costs_something():
    flat = replace(STRIP, thickness=0.5 * STRIP.thickness)
    curved = replace(STRIP, natural_curvature=1.0)
    aside = Clamp((0.1, 0.0, 0.7), ALONG, (0.0, 1.0, 0.0))
    back = Clamp((0.0, 0.0, 0.7), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))
    wall = Wall((0.0, -1.0, 0.0), (0.0, 1.0, 0.0))
    straight = build(STRIP, Clamp(), end=end(0.0, 0.7), segments=8, **ROUND)
    assert straight.blocks()["gauge_ring"].count == 1
    assert ring(0.0, 8).blocks()["gauge_ring"].count == 2
    for strip, other, walls in (
        (flat, end(0.0, 0.7), ()), (curved, end(0.0, 0.7), ()), (STRIP, aside, ()), (STRIP, back, ()),
        (STRIP, end(0.0, 0.7), (wall,)),
    ):  # fmt: skip
        problem = build(strip, Clamp(), end=other, walls=walls, segments=8, **ROUND)
        assert "gauge_ring" not in problem.blocks()
    strip = build(STRIP, Clamp(), end=end(0.0, 0.7), segments=8, energy="kirchhoff", apart=THICK)
    assert "gauge_ring" not in strip.blocks()


def test_a_row_that_holds_another_motion_does_not_count():
    """A straight rod's place halfway is on the axis: nothing is left out of its stability."""
    problem = build(STRIP, Clamp(), end=end(0.0, 0.7), segments=8, **ROUND)
    bent, none = np.zeros(9), np.zeros(9)
    straight = problem.state(bent, none)
    where = problem.block_slices()["gauge_ring"].start
    held = reduction.tangent(problem, straight, np.zeros(problem.size), np.zeros(problem.row_count))
    assert where not in held.rows
    bowed = problem.state(bent + np.sin(np.linspace(0.0, np.pi, 9)), none)
    held = reduction.tangent(problem, bowed, np.zeros(problem.size), np.zeros(problem.row_count))
    assert where in held.rows
