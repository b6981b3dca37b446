"""Scenes that once took minutes: counted in iterations and eigenproblems, not in seconds."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg

from ribbon import Clamp, Gravity, RibbonInputError, Status, Strip, solve
from ribbon.find.adaptive import solve_to_tolerance
from ribbon.solvers import budget
from ribbon.solvers.problem import RESIDUAL_TOLERANCE

UP = Gravity((0.0, 0.0, 1.0))
LEVEL = Clamp(tangent=(1.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0))
RISING = Clamp(tangent=(0.6, 0.0, 0.8), normal=(-0.8, 0.0, 0.6))
UPRIGHT = Clamp(tangent=(0.0, 0.0, 1.0), normal=(1.0, 0.0, 0.0))
TURNED_OVER = Clamp(tangent=(1.0, 0.0, 0.0), normal=(0.0, 0.0, -1.0))


@pytest.mark.parametrize("clamp", [LEVEL, RISING, UPRIGHT, TURNED_OVER])
@pytest.mark.parametrize("gamma", [700.0, 1e4, 1e6])
def test_a_heavy_strip_begins_with_its_boundary_layer(clamp, gamma):
    """The end hangs nearly a length below the clamp, out by about l / sqrt(Gamma)."""
    strip = Strip(1.0, 0.03, 0.3, 0.0, gamma)
    equilibrium = solve_to_tolerance(strip, clamp, UP, tolerance=1e-3)
    assert equilibrium.ok, equilibrium.message
    equal = solve(strip, clamp, UP)
    assert equal.iterations <= 100  # a thousand from the straight strip; rounding counts here
    assert [part.status for part in equilibrium.refinements] == [Status.CONVERGED] * 2
    assert abs(equilibrium.end.position[1]) < 1e-6  # in its plane
    angle = np.arccos(-clamp.frame[2, 2])
    # the layer's first integral: out by 2 sin(angle / 2) / sqrt(Gamma), and down by a length but for the turn
    assert equilibrium.end.position[0] == pytest.approx(2.0 * np.sin(angle / 2.0) / gamma**0.5, rel=0.5)
    assert -1.0 < equilibrium.end.position[2] < -1.0 + 3.0 / gamma**0.5


def test_equal_segments_find_the_heavy_strip_in_few_iterations():
    chained = solve(Strip(1.0, 0.03, 0.3, 0.0, 5000.0), LEVEL, UP, segments=40)
    assert chained.ok
    assert chained.iterations <= 20


@pytest.mark.parametrize("gravity", [None, UP])
@pytest.mark.parametrize("formulation", ["chained", "mixed"])
def test_what_has_the_least_energy_of_all_is_judged_at_once(monkeypatch, gravity, formulation):
    """A flat strip that is weightless, or hangs straight down: no ruling can make it unstable, so none is searched."""
    solved = []
    original = scipy.linalg.eigh
    monkeypatch.setattr(scipy.linalg, "eigh", lambda *a, **k: (solved.append(1), original(*a, **k))[1])
    down = Clamp(tangent=(0.0, 0.0, -1.0), normal=(1.0, 0.0, 0.0))
    found = solve(Strip(1.0, 0.03, 0.3, 0.0, 5.0), down, gravity, formulation=formulation)
    assert found.ok
    assert found.stable is True
    assert len(solved) <= 2


def test_a_budget_ends_a_solve_with_a_status():
    arguments = Strip(1.0, 0.03, 0.3, 0.0, 50.0), LEVEL, UP
    assert solve(*arguments, budget=1e3).ok
    for end in (None, Clamp((0.5, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))):
        found = solve(*arguments, end=end, budget=1e-9)
        assert found.status is Status.NOT_CONVERGED
        assert found.residual > RESIDUAL_TOLERANCE
        assert found.iterations <= 1
        assert budget.SPENT in found.message
    placed = solve_to_tolerance(*arguments, tolerance=1e-3, budget=1e-9)
    assert placed.status is Status.NOT_CONVERGED
    assert not budget.spent()  # it ends with the solve
    with pytest.raises(RibbonInputError):
        solve(*arguments, budget=0.0)


def test_budgets_are_nested():
    with budget.within(1e-9):
        assert solve(Strip(1.0, 0.03, gamma=50.0), LEVEL, UP, budget=1e3).status is Status.NOT_CONVERGED
    with budget.within(None):
        assert not budget.spent()
