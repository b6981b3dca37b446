"""Cases of a line that begin at their neighbours' states rest where they rest alone."""

from __future__ import annotations

import numpy as np
import pytest

from ribbon import Clamp, Gravity, Strip, solve_many
from ribbon.find.solving import neighbours
from ribbon.solvers import chained_line as at

UP = (0.6, 0.0, 0.8)
CLAMP = Clamp((0.1, -0.2, 0.3))


class Alone:
    """States of the cases of a line alone, counted."""

    def __init__(self, gamma, curvature, segments=9):
        self.strips = [
            Strip(length=1.0, width=0.05, poisson=0.35, natural_curvature=float(k), gamma=float(g))
            for g, k in zip(gamma, curvature, strict=True)
        ]
        self.segments, self.places = segments, []

    def __call__(self, places):
        self.places += list(places)
        some = [self.strips[place] for place in places]
        return solve_many(some, CLAMP, Gravity(UP), segments=self.segments, threads=1).found


def followed(gamma, curvature):
    """The line, the states of all cases alone, and the places that were begun at their neighbours'."""
    gamma, curvature = np.asarray(gamma, dtype=float), np.asarray(curvature, dtype=float)
    solved = Alone(gamma, curvature)
    found = neighbours.along(gamma, curvature, solved)
    assert sorted(solved.places) == sorted(found.alone)  # each once
    every = Alone(gamma, curvature)(range(gamma.size))
    return found, every, [place for place in range(gamma.size) if place not in found.alone]


@pytest.mark.parametrize(
    ("gamma", "curvature"),
    [(np.full(24, 20.0), np.linspace(0.5, 1.5, 24)), (np.geomspace(50.0, 300.0, 24), np.full(24, -1.5))],
)
def test_what_a_line_says_of_a_case_is_what_it_is_alone(gamma, curvature):
    found, every, places = followed(gamma, curvature)
    assert len(places) > 15
    for place in places:
        state, numbers = every[place], found.numbers[place]
        assert state.problem.joints(found.x[place])[0] == pytest.approx(state.joints[0], abs=1e-9)
        assert numbers[at.LOWEST] == pytest.approx(state.lowest_eigenvalue, rel=1e-6)
        assert [numbers[at.BENDING], numbers[at.NATURAL], numbers[at.WEIGHT]] == pytest.approx(
            [state.energy.bending, state.energy.natural, state.energy.gravity], abs=1e-8
        )
        assert numbers[at.END : at.END + 3] == pytest.approx(state.end.position, abs=1e-9)
        assert numbers[at.MIDDLE : at.MIDDLE + 3] == pytest.approx(state.middle.position, abs=1e-9)
        moment = np.cross(numbers[at.MOMENT : at.MOMENT + 3], gamma[place] * np.array(UP))
        assert moment == pytest.approx(state.start.moment, abs=1e-7)
        assert numbers[at.STEEPEST] == pytest.approx(state.max_abs_eta, abs=1e-7)
        assert numbers[at.REST] <= 1e-10
        assert numbers[at.STEPS] < state.iterations


def test_a_line_that_falls_to_the_other_side_goes_both_ways():
    """Curled a little to one side or to the other, a heavy strip falls there; what is followed alone would stay."""
    found, every, places = followed(np.full(33, 31.7), np.linspace(-0.1, 0.1, 33))
    sides = {float(np.sign(state.end.position[1])) for state in every}
    assert sides == {-1.0, 1.0}
    assert places
    for place in places:
        assert found.numbers[place, at.END : at.END + 3] == pytest.approx(every[place].end.position, abs=1e-8)


def test_without_weight_or_with_a_force_nothing_is_followed():
    strip = Strip(length=1.0, width=0.05, poisson=0.35, natural_curvature=1.0, gamma=5.0)
    pulled = solve_many([strip], CLAMP, Gravity(UP), segments=9, tip=(0.0, 1.0, 0.0), threads=1).found[0]
    weightless = solve_many([strip], CLAMP, None, segments=9, threads=1).found[0]
    weighty = solve_many([strip], CLAMP, Gravity(UP), segments=9, threads=1).found[0]
    assert [neighbours.follows(e.problem) for e in (pulled, weightless, weighty)] == [False, False, True]
    assert neighbours.along(np.ones(3), np.ones(3), lambda places: [pulled] * len(places)) is None
