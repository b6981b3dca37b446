"""A strip that touches itself: the fold between two clamps against shooting, contact, forces, balance and gaps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compare.battery.judge.touching import Sheet, balanced, kept, of_itself
from ribbon import Clamp, Strip
from ribbon.errors import RibbonInputError
from ribbon.find.continuation import follow, switch
from ribbon.find.solve import build, refine, solve
from ribbon.find.solving.request import How
from ribbon.find.solving.verdict import judged
from ribbon.judge import nearness
from ribbon.problems.mixed import MixedProblem
from ribbon.result import Status
from ribbon.solvers.problem import Minimum
from tests.reference.touching_fold import folds

THICK = 0.02
STRIP = Strip(1.0, 0.05, thickness=THICK)
START = Clamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
APART = (0.5, 0.3, 0.2, 0.19, 0.18, 0.17, 0.16, 0.15, 0.14)


def end(z: float) -> Clamp:
    return Clamp((0.0, 0.0, z), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))


@pytest.fixture(scope="module")
def states():
    """Equilibria by the distance of the clamps, each from the one before."""
    state = solve(
        STRIP, START, end=end(0.6), energy="sadowsky", segments=40, seed_curvature=(3.0, -3.0, 3.0), apart=THICK
    )
    found = {}
    for z in APART:
        problem = build(STRIP, START, end=end(z), energy="sadowsky", segments=40, apart=THICK)
        state = switch(problem, state)
        found[z] = state
    return found


def test_the_fold_is_that_of_shooting_in_contact(states):
    places = (0.17, 0.14)
    for z, known in zip(places, folds(np.array(places), THICK), strict=True):
        state = states[z]
        assert state.ok
        assert len(state.pairs) == 2  # both ends of the rulings that face each other
        push = sum(np.linalg.norm(pair.force) for pair in state.pairs)
        assert push == pytest.approx(known.push, rel=2e-3)
        assert state.energy.elastic == pytest.approx(known.energy, rel=1e-4)
        for pair in state.pairs:
            assert pair.s == pytest.approx(known.s, abs=3e-4)
            assert pair.s_other == pytest.approx(1.0 - known.s, abs=3e-4)
            assert pair.gap == pytest.approx(THICK, abs=1e-8)
            assert pair.force[2] < 0.0
            assert np.abs(pair.force[:2]).max() < 1e-6 * known.push


def test_finer_segments_come_nearer_to_it(states):
    (known,) = folds(np.array([0.17]), THICK)
    coarse, fine = states[0.17], refine(states[0.17])
    errors = [abs(sum(np.linalg.norm(pair.force) for pair in e.pairs) / known.push - 1.0) for e in (coarse, fine)]
    assert fine.ok
    assert errors[1] < 1e-4
    assert errors[1] < 0.5 * errors[0]


def test_nothing_is_nearer_than_it_may_be_and_nothing_pulls(states):
    for z, state in states.items():
        assert state.ok
        near = nearness.minima(state.problem, state.x, 0.5)
        assert min((gap for gap, _ in near), default=0.0) > -nearness.TOLERANCE
        push = -state.rows[state.problem.block_slices()["pairs"]] if state.problem.pairs else np.zeros(1)
        assert (push >= 0.0).all()
        assert (z < 0.175) == bool(state.pairs)
        if state.pairs:
            assert np.abs(push * state.problem.pair_rows().values(state.x)).max() < 1e-8


def test_before_it_touches_it_is_the_fold_without_contact(states):
    free = solve(STRIP, START, end=end(0.6), energy="sadowsky", segments=40, seed_curvature=(3.0, -3.0, 3.0))
    for z in (0.5, 0.3, 0.2):
        free = switch(build(STRIP, START, end=end(z), energy="sadowsky", segments=40), free)
        assert states[z].energy.total == pytest.approx(free.energy.total, rel=1e-12)


def test_a_step_through_itself_is_no_equilibrium(states):
    """From half the length to where the sides would be through each other, at once."""
    problem = build(STRIP, START, end=end(0.05), energy="sadowsky", segments=40, apart=THICK)
    state = switch(problem, states[0.3])
    assert not state.ok or min(gap for gap, _ in nearness.minima(problem, state.x, 0.5)) > -1e-6


@pytest.mark.parametrize("apart", [0.0, 1e-6, 0.7, -1.0, float("nan")])
def test_a_distance_that_is_none_is_refused(apart):
    with pytest.raises(RibbonInputError, match="apart"):
        build(STRIP, START, apart=apart)


@pytest.mark.parametrize("curvature", [7.5, [6.0, 18.0, -3.0], "natural"])
def test_a_start_through_itself_is_refused_with_the_place(curvature):
    """An arc of more than a turn, a loop, and a rest shape that is one."""
    strip = STRIP if curvature != "natural" else Strip(1.0, 0.05, thickness=THICK, natural_curvature=7.5)
    with pytest.raises(RibbonInputError, match=r"through itself: its parts at s = 0\.\d+ l and s = ") as caught:
        solve(strip, START, energy="sadowsky", segments=20, seed_curvature=curvature, apart=THICK)
    assert caught.value.key == "seed_curvature"


def test_a_start_that_winds_more_than_a_turn_clear_of_itself_is_none():
    assert solve(STRIP, START, energy="sadowsky", segments=20, seed_curvature=[4.0, 14.0], apart=THICK).ok


def test_sides_moved_across_each_other_stay_apart(states):
    """Rulings then are nearly parallel, and an edge is nearest to a place within the other's width."""
    thick, across = 0.05, 1e-3

    def at(z: float, x: float) -> MixedProblem:
        there = Clamp((x, 0.0, z), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
        return build(STRIP, START, end=there, energy="sadowsky", segments=28, apart=thick)

    state = solve(STRIP, START, end=end(0.6), energy="sadowsky", segments=28, seed_curvature=(3.0, -3.0, 3.0),
                  apart=thick)  # fmt: skip
    for z in (0.5, 0.3, 0.22):
        state = switch(at(z, 0.0), state)
    state = follow(lambda share: at(0.22 - 0.03 * share, 0.0), state)
    state = follow(lambda share: at(0.19, across * share), state)
    assert state.ok
    sheet, told = Sheet(state), of_itself(state)
    checks = {check.what: check for check in [*kept([sheet], thick, told), balanced(state, sheet, told)]}
    assert told
    assert all(check.value <= check.bound for check in checks.values())
    assert abs(checks["nearer than they are kept (l)"].value) < nearness.TOLERANCE


def test_rows_of_what_touches_do_not_make_a_scene_infeasible(states):
    """They hold the strip where it is now; that they cannot be met together there says nothing of the scene."""
    state = states[0.14]
    x = state.x.copy()
    x[state.problem.layout.omega] += 1e-2
    stopped = Minimum(x, state.multipliers, state.rows, 1.0, 3, 2, "no progress", False, 0.0, "newton", None)
    assert judged(state.problem, stopped, How()).status is Status.NOT_CONVERGED
    bare = state.problem.with_changes(pairs=(), apart=0.0)
    alone = replace(stopped, rows=state.rows[: bare.row_count])
    assert judged(bare, alone, How()).status is Status.INFEASIBLE
